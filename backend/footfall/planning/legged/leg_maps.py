"""The maps of one leg of a robot that others described: onto which cells a step leads, and what refuses the others.

A cell is green only where the foot move to its middle was made and every sample of it checked. ``plan_step`` tries the
same poses of the chassis by the same functions, so it finds a step to every green cell.
"""

import time
from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.frames import apply, heading
from footfall.core.progress import Progress, no_progress
from footfall.maps import refusals
from footfall.maps.layers import MapSettings, MapStack
from footfall.maps.traversability import traversability
from footfall.planning.legged.chassis_poses import poses
from footfall.planning.legged.foot_move import ReadyToLift, Sample, foot_free, foot_way, judged, set_down, way_ahead
from footfall.planning.legged.footing import LATTICE, LEAST_DISC, Rest, rest
from footfall.planning.legged.problem import LeggedSettings, LeggedState
from footfall.planning.legged.stance import Ground, all_standing
from footfall.planning.legged.step import begun, provenance, start_refused, tally_in_words
from footfall.planning.legged.whole_check import LIMIT_RESERVE, Margin, Refusal, Tally
from footfall.planning.watch import time_taken
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

ROUGHEST = 0.03
"""RMS distance of the ground under a foot from its plane at most, as a share of the longest leg."""
EDGE = 1.5 / LATTICE
"""A foot may touch so much farther beside its middle than on the steepest plane, as a share of its radius: its points
are so far apart."""

NUMBERS = ("seat", "limit_margin", "margin_lifted", "torque_ratio")


class _Begun(NamedTuple):
    """A chassis pose that a foot move can begin from: how the robot stands there, margins, and the hip in site [m].

    ready: as ``foot_move`` tries it, at first without the chassis' way, and at last after it.
    """

    ready: tuple[ReadyToLift, ...]
    margins: Tally
    hip: Array


def compute_maps(
    robot: LeggedRobot,
    dem: Dem,
    state: LeggedState,
    leg: int,
    settings: LeggedSettings | None = None,
    progress: Progress = no_progress,
) -> MapStack:
    """Map where one step of ``leg`` leads from a state: class of each cell, what refuses it, and the least margins.

    Margins are those of a whole foot move and stand at green cells alone, NaN elsewhere; "margin" is with the foot
    down. Cells near the foot are looked at first; what ``time_limit`` leaves over is not proven.

    Args:
        robot: the robot.
        dem: the ground, in site.
        state: how the robot stands.
        leg: number of the leg that is to step, from 0.
        settings: with what cells are judged; None: as delivered.
        progress: called with a fraction 0…1 and a text; what it raises ends the work.

    Returns:
        Layers (rows, cols) on the grid of the terrain.

    Raises:
        InvalidInput: the robot has no such leg, or the state is of another robot.
    """
    settings = settings or LeggedSettings()
    leg = robot.require_leg(leg)
    ground = Ground(robot, dem, settings)
    start = begun(ground, state)
    cells = _Cells(ground, leg)
    no = start_refused(ground, start)
    ready, why = ([], no.reason) if no is not None else _ready(ground, start, leg)
    cells.refuse_unknown_and_far(ready, start)
    began = time.monotonic()
    places = cells.left_over(start.soles[leg])
    for done, (row, col) in enumerate(places):
        if why:
            cells.code[row, col] = refusals.NOT_LIFTED
        elif time_taken(began) > settings.time_limit:
            cells.code[row, col] = refusals.NOT_PROVEN
        else:
            cells.look(row, col, ready)
        if done % 16 == 0:
            progress((done + 1) / len(places), f"{done + 1} of {len(places)} cells")
    progress(1.0, "maps")
    parents = provenance(ground, state)
    shape = "conservative" if settings.conservative else "plain"
    return MapStack(dem.geometry, leg, shape, cells.layers(shape), parents, why)


def _ready(ground: Ground, state: LeggedState, leg: int) -> tuple[list[_Begun], str]:
    """Poses that a step of the leg can begin from, in the planner's order; why there is none."""
    T, tally = state.T_site_base, Tally()
    yaw = heading(T)
    standing = [one for one in ground.robot.legs if one != leg]
    found = []
    for pose in poses(ground, state.soles, state.contacts, standing, float(T[0, 3]), float(T[1, 3]), yaw, state.q):
        own = Tally()
        free = foot_free(ground, state, leg, pose, own)
        ahead = free if isinstance(free, Refusal) else way_ahead(ground, state, free.sample, own)
        if isinstance(ahead, Refusal):
            tally.refuse(ahead)
        elif isinstance(free, ReadyToLift):
            rolled = [ReadyToLift(ahead.samples[-1], ahead.end)] if ground.robot.rolls else []
            found.append(_Begun((free, *rolled), own, _hip(ground, leg, pose)))
    return found, "" if found else tally_in_words(tally)


def _hip(ground: Ground, leg: int, T_site_base: Array) -> Array:
    return apply(T_site_base, ground.robot.limbs[leg].limb.placements[0, :3, 3])


class _Cells:
    """The layers while they are filled; code: (rows, cols) classes of ``maps.refusals``."""

    def __init__(self, ground: Ground, leg: int) -> None:
        self.ground, self.leg, self.geometry = ground, leg, ground.dem.geometry
        self.radius = float(ground.robot.radii[leg])
        window = 2 * max(self.radius, LEAST_DISC, self.geometry.resolution)
        plane = traversability(ground.dem, MapSettings(window=window))
        self.slope, self.roughness = plane.slope, plane.roughness
        self.code = np.full(self.geometry.shape, refusals.NOT_PROVEN, np.uint8)
        self.margin = np.full(self.geometry.shape, np.nan, np.float32)
        self.numbers = {name: np.full(self.geometry.shape, np.nan, np.float32) for name in NUMBERS}

    def refuse_unknown_and_far(self, ready: list[_Begun], state: LeggedState) -> None:
        """Cells that no pose brings the leg to, by their distance alone, and those without a height."""
        reach = self.ground.robot.limbs[self.leg].limb.reach
        hips = [one.hip for one in ready] or [_hip(self.ground, self.leg, state.T_site_base)]
        x, y = np.meshgrid(self.geometry.xs, self.geometry.ys)
        away = np.min([np.hypot(x - hip[0], y - hip[1]) for hip in hips], axis=0)
        self.code[away > reach] = refusals.OUT_OF_RANGE
        self.code[~np.isfinite(height_at(self.ground.dem, x, y))] = refusals.UNKNOWN

    def left_over(self, near: Array) -> list[tuple[int, int]]:
        """Rows and columns of the cells that are left, those near a place first."""
        x, y = np.meshgrid(self.geometry.xs, self.geometry.ys)
        away = np.hypot(x - near[0], y - near[1])
        left = np.argwhere(self.code == refusals.NOT_PROVEN)
        order = np.lexsort((left[:, 1], left[:, 0], away[tuple(left.T)]))
        return [(int(row), int(col)) for row, col in left[order]]

    def look(self, row: int, col: int, ready: list[_Begun]) -> None:
        """What comes of a step to a cell, from the first pose that it can be made from."""
        x, y = float(self.geometry.xs[col]), float(self.geometry.ys[row])
        down = rest(self.ground.dem, x, y, self.radius)
        unfit = self._unfit(down, x, y, float(self.roughness[row, col]))
        if unfit != refusals.UNKNOWN:
            self.numbers["seat"][row, col] = down.center[2] - self.radius - height_at(self.ground.dem, x, y)
        if unfit != refusals.NOTHING:
            self.code[row, col] = unfit
            return
        refused: Counter[int] = Counter()
        reach = self.ground.robot.limbs[self.leg].limb.reach
        for one in ready:
            if np.linalg.norm(one.hip - down.center) > reach:
                refused[refusals.OUT_OF_RANGE] += 1
                continue
            found = _step_to(self.ground, self.leg, down, one)
            if not isinstance(found, Refusal):
                self._take(row, col, *found)
                return
            refused[_class_of(found)] += 1
        self.code[row, col] = max(refused, key=lambda code: (refused[code], code))

    def _unfit(self, down: Rest, x: float, y: float, roughness: float) -> int:
        """The class of ground that no foot is put on whatever the leg can do; NOTHING where it is fit."""
        settings, robot = self.ground.settings, self.ground.robot
        if not np.isfinite(down.normal).all():
            return refusals.UNKNOWN
        if float(np.arccos(down.normal[2])) > settings.steepest:
            return refusals.STEEP
        beside = float(np.hypot(down.contact[0] - x, down.contact[1] - y))
        if beside > self.radius * (np.sin(settings.steepest) + EDGE):
            return refusals.EDGE
        if not roughness <= ROUGHEST * robot.length:
            return refusals.ROUGH
        return refusals.NOTHING

    def _take(self, row: int, col: int, way: Tally, settled: dict[str, Margin]) -> None:
        """A green cell: the least margins of its foot move."""
        settings, at = self.ground.settings, (row, col)
        least = {name: min(one.size, settled[name].size) for name, one in way.least.items()}
        lean = settings.least_margin * self.ground.robot.length
        self.code[at] = refusals.NOTHING
        self.margin[at] = settled["support"].size + lean
        self.numbers["margin_lifted"][at] = way.least["support"].size + lean
        self.numbers["limit_margin"][at] = least["limits"] + LIMIT_RESERVE
        self.numbers["torque_ratio"][at] = settings.most_effort - least["effort"]

    def layers(self, shape: str) -> dict[str, NDArray[np.generic]]:
        of_class = np.array([refusals.REFUSALS[code].footing for code in sorted(refusals.REFUSALS)], np.uint8)
        return {
            "slope": self.slope,
            "roughness": self.roughness,
            **self.numbers,
            "margin" if shape == "plain" else "margin_conservative": self.margin,
            "refused_by": self.code,
            "footing": of_class[self.code],
        }


def _step_to(ground: Ground, leg: int, target: Rest, pose: _Begun) -> tuple[Tally, dict[str, Margin]] | Refusal:
    """The margins of the foot's whole way from a pose and of where it ends, or what refuses it.

    The end is asked first, as it is what most tries fail at.
    """
    own = Tally()
    own.merge(pose.margins)
    last: Sample | Refusal = pose.ready[-1].sample
    for ready in pose.ready:
        way = list(foot_way(ground, leg, target, ready.sample))
        for sample in _end_first(way):
            held = sample if isinstance(sample, Refusal) else judged(ground, sample, ready.state, leg, own)
            if isinstance(held, Refusal):
                return held
        last = way[-1]
    if isinstance(last, Refusal):
        return last
    end = set_down(ground, pose.ready[-1].state, leg, target, last)
    settled = ground.check.margins(end.q, end.T_site_base, all_standing(end))
    return settled if isinstance(settled, Refusal) else (own, settled)


def _end_first(way: list[Sample | Refusal]) -> Iterator[Sample | Refusal]:
    yield way[-1]
    yield from way[:-1]


def _class_of(refusal: Refusal) -> int:
    """The class of what refused a try; a leg that does not reach is refused by limits without an amount."""
    if refusal.name == "limits" and np.isnan(refusal.margin):
        return refusals.NOT_REACHED
    return refusals.OF_CHECK[refusal.name]
