"""The recheck of a finished path, independent of the planner's scene, edge checks and balance test.

Every joint moves in straight lines between waypoints; the path is sampled so densely that no joint changes by more
than ``SAMPLING`` between samples, half of the planner's ε by default. Torque is a linear program, so it is
solved at every waypoint and at least every ``TORQUE_SAMPLING`` between.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from footfall.balance.moving_leg import centers_of_mass
from footfall.balance.support import margins
from footfall.balance.torques import torque_margin
from footfall.core.frames import apply, inverse
from footfall.maps.standing import contacts
from footfall.planning.step.edges import Array, samples
from footfall.planning.step.ground import Nearby
from footfall.planning.step.problem import Check, StepSettings
from footfall.planning.step.situation import Situation
from footfall.planning.step.solids import Gap, Solids, part_poses
from footfall.robot.kinematics import wheel_pose
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

SAMPLING = 0.005
TORQUE_SAMPLING = 0.05
OFF_LINE = 0.002
"""How far the wheel may leave the vertical while it lifts and lowers [m]."""
_AT_ONCE = 64
"""Samples between two pulses."""
UNDER = 0.3
"""Ground within this distance of the leg, seen from above, counts as under the path [m]."""


@dataclass(frozen=True)
class _Sample:
    q: Array
    phase: str
    segment: int
    fraction: float

    @property
    def where(self) -> str:
        return f"{self.phase}, {self.fraction:.0%} of the way to waypoint {self.segment + 1}"


def recheck(
    situation: Situation,
    dem: Dem,
    waypoints: Array,
    phases: tuple[str, ...],
    pulse: Callable[[], None] = lambda: None,
) -> tuple[Check, ...]:
    """Every check of a path of whole postures (n, legs × 6); phases: (n,), of the motion that ends there.

    Of the situation only what was asked is used: robot, state, leg, ground and settings. The plan is good if all
    hold. The margins of the clearances are exact distances at the waypoints, beyond δ; between waypoints it is only
    asked whether δ is kept.
    """
    robot, state, leg, settings = situation.robot, situation.state, situation.leg, situation.settings
    q_path = waypoints[:, 6 * leg : 6 * leg + 6]
    path = _sampled(q_path, phases)
    T_site_base = np.asarray(state.T_site_base)
    solids = Solids(robot, np.asarray(state.posture), leg, T_site_base, situation.ground, settings.clearance)
    return (
        _limits(robot, leg, path),
        *_clearances(solids, path, q_path, phases, settings, pulse),
        _straight(robot, state, leg, path),
        _balance(robot, dem, state, leg, settings, path),
        _torque(robot, dem, state, leg, settings, path, pulse),
        _unknown(robot, state, leg, situation.ground, path),
    )


def _sampled(q_path: Array, phases: tuple[str, ...]) -> list[_Sample]:
    out = []
    for i, (a, b) in enumerate(itertools.pairwise(q_path)):
        out += [_Sample(q, phases[i + 1], i, t) for t, q in samples(a, b, SAMPLING)]
    return out


def _whole(state: RobotState, own: slice, q: Array) -> Array:
    posture = np.array(state.posture)
    posture[own] = q
    return posture


def _limits(robot: Robot, leg: int, path: list[_Sample]) -> Check:
    own = slice(6 * leg, 6 * leg + 6)
    qs = np.array([s.q for s in path])
    spare = np.minimum(qs - robot.lower[own], robot.upper[own] - qs)
    at, joint = np.unravel_index(int(np.argmin(spare)), spare.shape)
    least = float(spare[at, joint])
    return Check("joint limits", least >= 0, least, "rad", f"{robot.joint_names[6 * leg + joint]}, {path[at].where}")


def _clearances(
    solids: Solids,
    path: list[_Sample],
    q_path: Array,
    phases: tuple[str, ...],
    settings: StepSettings,
    pulse: Callable[[], None],
) -> list[Check]:
    """Three checks: the rover with itself, the leg with the ground, the leg with the raised ground."""
    swing = [s for s in path if s.phase == "swing"]
    rest = [s for s in path if s.phase != "swing"]
    ends = np.array([[one == "swing", one != "swing"] for one in phases])
    ends[:-1] |= ends[1:]  # a waypoint ends one phase and begins the next
    raised = settings.raise_terrain

    def ground(lift: float, touching: bool) -> Callable[[Array], tuple[int, str] | None]:
        return lambda qs: solids.terrain_collision(qs, lift, touching)

    def ground_gap(lift: float, touching: bool) -> Callable[[Array, float], tuple[int, Gap]]:
        return lambda qs, below: solids.terrain_gap(qs, lift, touching, below)

    every = np.ones(len(q_path), bool)
    return [
        _clearance("self collision", solids.own_collision, path, solids.own_gap, q_path, phases, every, pulse),
        _clearance(
            "terrain collision in lift and lower",
            ground(0.0, True),
            rest,
            ground_gap(0.0, True),
            q_path,
            phases,
            ends[:, 1],
            pulse,
        ),
        _clearance(
            f"terrain collision in swing, raised {raised:.2f} m",
            ground(raised, False),
            swing,
            ground_gap(raised, False),
            q_path,
            phases,
            ends[:, 0],
            pulse,
        ),
    ]


def _clearance(
    name: str,
    collision: Callable[[Array], tuple[int, str] | None],
    dense: list[_Sample],
    gap: Callable[[Array, float], tuple[int, Gap]],
    q_path: Array,
    phases: tuple[str, ...],
    chosen: NDArray[np.bool_],
    pulse: Callable[[], None],
) -> Check:
    hit, where = None, ""
    for first in range(0, len(dense), _AT_ONCE):
        pulse()
        part = dense[first : first + _AT_ONCE]
        hit = collision(np.array([s.q for s in part]))
        if hit is not None:
            where = f"{hit[1]}: {part[hit[0]].where}"
            break
    numbers = np.flatnonzero(chosen)
    least, at = Gap(np.inf, ""), 0
    for number in numbers:
        pulse()
        _, found = gap(q_path[number : number + 1], least.spare)
        if found.spare < least.spare:
            least, at = found, int(number)
    # a collision between waypoints has no size here: no number is better than a kind one
    size = least.spare if hit is None or least.spare < 0 else float("nan")
    holds = hit is None and least.spare >= 0
    return Check(name, holds, size, "m", where or f"{least.between}, beyond δ, at waypoint {at} ({phases[at]})")


def _straight(robot: Robot, state: RobotState, leg: int, path: list[_Sample]) -> Check:
    own = slice(6 * leg, 6 * leg + 6)
    up = inverse(state.T_site_base)[:3, 2]
    worst, where = 0.0, "nowhere"
    for phase, foot in (("lift", 0), ("lower", -1)):
        there = [s for s in path if s.phase == phase]
        if not there:
            continue
        centers = np.array([wheel_pose(robot, _whole(state, own, s.q), leg)[:3, 3] for s in there])
        away = centers - centers[foot]
        away = np.linalg.norm(away - (away @ up)[:, None] * up, axis=1)
        if away.max() > worst:
            worst, where = float(away.max()), there[int(np.argmax(away))].where
    return Check("straight lift and lower", worst <= OFF_LINE, OFF_LINE - worst, "m", where)


def _balance(robot: Robot, dem: Dem, state: RobotState, leg: int, settings: StepSettings, path: list[_Sample]) -> Check:
    others = [i for i in robot.legs if i != leg]
    feet = contacts(robot, dem, state.posture, state.T_site_base, others).points
    coms = centers_of_mass(robot, state.posture, leg, np.array([s.q for s in path]))
    found = margins(feet, apply(state.T_site_base, coms)[:, :2], settings.conservative)
    at = int(np.argmin(found))
    spare = float(found[at]) - settings.least_margin
    name = "balance (conservative polygon)" if settings.conservative else "balance (support polygon)"
    return Check(name, spare >= 0, spare, "m", path[at].where)


def _torque(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    leg: int,
    settings: StepSettings,
    path: list[_Sample],
    pulse: Callable[[], None],
) -> Check:
    own = slice(6 * leg, 6 * leg + 6)
    others = [i for i in robot.legs if i != leg]
    feet = contacts(robot, dem, state.posture, state.T_site_base, others)
    unseen = ~feet.seen
    worst, joint, where = 0.0, "", ""
    last: _Sample | None = None
    for s in path:
        due = last is None or s.fraction in (0.0, 1.0) or np.abs(s.q - last.q).max() > TORQUE_SAMPLING - SAMPLING
        if not due or (last is not None and np.array_equal(s.q, last.q)):
            continue
        pulse()
        last = s
        posture = _whole(state, own, s.q)
        check = torque_margin(robot, posture, state.T_site_base, others, feet.normals, settings.friction)
        if check.ratio > worst:
            worst, where = check.ratio, s.where
            joint = check.joint_name if check.feasible else "no contact forces inside friction hold the rover"
    note = f"; ground taken as level under legs {_listed(others, unseen)}, where it is unknown" if unseen.any() else ""
    return Check("torque", worst <= 1.0, 1.0 - worst, "of the limit", f"{joint}, {where}{note}")


def _listed(legs: list[int], chosen: NDArray[np.bool_]) -> str:
    return ", ".join(str(leg) for leg, one in zip(legs, chosen, strict=True) if one)


def _unknown(robot: Robot, state: RobotState, leg: int, ground: Nearby, path: list[_Sample]) -> Check:
    """How much of the ground under the path was not seen; never a reason to refuse, but to be told."""
    name = "unknown ground under the path"
    if not ground.filled.any():
        return Check(name, True, float("nan"), "", "none")
    qs = np.array([s.q for s in path[:: max(1, round(TORQUE_SAMPLING / SAMPLING))]])
    joints = np.stack([Ts[:, :3, 3] for Ts in part_poses(robot, leg, qs).values()], axis=1)
    along = np.linspace(0.0, 1.0, 5)[:, None, None, None]
    points = apply(state.T_site_base, (1 - along) * joints[None, :, :-1] + along * joints[None, :, 1:])
    under = np.unique(np.rint(points[..., :2].reshape(-1, 2) / 0.1), axis=0)
    grid = ground.dem.geometry
    rows, cols = np.nonzero(ground.filled)
    cells = np.column_stack([grid.xs[cols], grid.ys[rows]])
    near = np.zeros(len(cells), bool)
    for x, y in under:
        near |= (cells[:, 0] - 0.1 * x) ** 2 + (cells[:, 1] - 0.1 * y) ** 2 <= UNDER**2
    count = int(near.sum())
    text = f"{count} cells, taken as high as their highest known neighbour" if count else "none"
    return Check(name, True, float("nan"), "", text)
