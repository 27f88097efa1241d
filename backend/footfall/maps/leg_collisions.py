"""Which of the postures that reach a cell are free of collision, there and above: exact, with few mesh checks.

Three answers in turn: a *certificate* of freedom (conservative: what it certifies is free), overlaps of convex bodies
(what they tell surely collides), and exact meshes for what is still open.
"""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, no_progress
from footfall.maps.layers import RAISE_TERRAIN
from footfall.maps.reach_classes import FOOT_COLLISION, FREE, NO_LIFT, UNSURE, WAYPOINT_COLLISION
from footfall.robot.description import PARTS
from footfall.robot.leg_branches import bend_of
from footfall.robot.meshes.bvh import PAYLOAD, robot_meshes
from footfall.robot.meshes.collision import TERRAIN
from footfall.robot.meshes.first_contact import NamingScene
from footfall.robot.model import Robot
from footfall.robot.proof.clearance import LegClearance, clearance_ground, leg_reach
from footfall.robot.proof.leg_overlap import LegOverlap
from footfall.robot.proof.obstacles import CHASSIS, LEG, NOTHING, SELF
from footfall.robot.proof.obstacles import PAYLOAD as PAYLOAD_CODE
from footfall.robot.proof.obstacles import TERRAIN as TERRAIN_CODE
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.ground.triangulate import crop

Certified = Callable[[Array, str], NDArray[np.bool_]]
"""(leg postures (n, 6), ground mode) → (n,), True only where a posture is certainly free."""

_FREE, _OPEN, _HIT, _NONE = 1, 0, -1, -2
_TURNING = PARTS.index("ankle_roll")
"""This link and those after it turn with the last joint."""
_AT_ONCE = 256
"""Mesh checks between two calls of the progress."""
_MORE_THAN_LEG = 1.0
"""Ground is kept this much farther than a stretched leg reaches [m]; the scene cuts it to the leg's meshes."""


@dataclass(frozen=True)
class Verdict:
    """For n cells. reason: FREE, UNSURE, FOOT_COLLISION, NO_LIFT or WAYPOINT_COLLISION.

    chosen: index of the candidate that the reason speaks of. link: index into PARTS of what hits, blame: what is hit
    (robot.proof.obstacles), both only in collisions. checks: mesh checks made.
    turnable: (candidates,) those that another heading of the wheel may help: only links that turn with it collide, or
    there is no posture above.
    """

    reason: NDArray[np.uint8]
    chosen: NDArray[np.int64]
    link: NDArray[np.uint8]
    blame: NDArray[np.uint8]
    checks: int
    turnable: NDArray[np.bool_]


class LegCollisions:
    """One leg's collision checks over one ground, for very many postures; one thread at a time.

    ground: without holes where the leg may get, as for planning: what is unknown there is taken for free.
    clearance [m]: added to every δ. raise_terrain [m]: how much higher the ground is for a leg above its footfall.
    certified: a certificate for the same robot, state, ground and distances, see :meth:`with_certificate`; None: what
    does not overlap is asked of the meshes.
    most_checks: mesh checks for one reach map; what they don't decide is UNSURE. None: no bound.
    """

    def __init__(
        self,
        robot: Robot,
        state: RobotState,
        leg: int,
        ground: Dem,
        clearance: float = 0.0,
        raise_terrain: float = RAISE_TERRAIN,
        certified: Certified | None = None,
        most_checks: int | None = None,
    ) -> None:
        leg = robot.require_leg(leg)
        if most_checks is not None and most_checks < 0:
            raise InvalidInput("most_checks can't be negative", most_checks=most_checks)
        hip = (np.asarray(state.T_site_base) @ robot.description.legs[leg].T_base_hip)[:3, 3]
        spec = robot.description.legs[leg]
        radius = spec.reaches[-1] + _MORE_THAN_LEG
        args = robot, state.posture, leg, state.T_site_base

        def certificate() -> LegClearance:
            tables = clearance_ground(robot, ground.heights, ground.geometry, clearance, hip[:2], leg_reach(robot))
            return LegClearance(*args, tables, clearance, raise_terrain)

        self._meshes = lambda: NamingScene(*args, crop(ground, hip[:2], radius), clearance, raise_terrain)
        self._overlap = LegOverlap(*args, ground.heights, ground.geometry, clearance, raise_terrain)
        self._certificate = certificate
        self._certified = certified
        self.most_checks = most_checks
        meshes = robot_meshes(robot.description)
        turned = ("knee_roll", "ankle_pitch", "ankle_roll", "wheel")
        self.half_turn_alike = all(_half_turn_alike(np.asarray(meshes[part].vertices)) for part in turned)

    @cached_property
    def scene(self) -> NamingScene:
        """The exact meshes; they take the longest to build, so they are built when first needed."""
        return self._meshes()

    def with_certificate(self) -> "LegCollisions":
        """The same checks, with the certificate of robot.proof.clearance before all others."""
        sure = copy(self)
        sure._certified = self._certificate().certified
        return sure

    def sketch(self) -> "LegCollisions":
        """The same checks without meshes: at once, and what only meshes tell is UNSURE."""
        quick = copy(self)
        quick.most_checks = 0
        return quick

    def decide(
        self,
        cell: NDArray[np.int64],
        branch: NDArray[np.int64],
        qs: Array,
        above: Array,
        most_checks: int | None = None,
        progress: Progress = no_progress,
    ) -> Verdict:
        """The verdict on every cell from its candidates: free where one is free at the footfall and above.

        cell: (m,) number of the cell of each candidate, rising from 0 without a gap; the candidates of a cell stand in
        the order in which they are preferred. branch: (m,). qs, above: (m, 6) [rad], ``above`` NaN where there is no
        posture above. One that is known to be free without meshes goes before one that needs them. most_checks: of
        meshes, None for no bound.
        """
        foot, way = np.zeros(len(qs), np.int8), np.where(np.isnan(above[:, 0]), _NONE, _OPEN).astype(np.int8)
        link, blame = np.zeros(len(qs), np.uint8), np.zeros(len(qs), np.uint8)
        count = int(cell[-1]) + 1 if len(cell) else 0
        first = np.searchsorted(cell, np.arange(count + 1))
        kept = ~self._repeated(cell, branch, way)
        done = np.full(count, -1, np.int64)
        rank = np.arange(len(cell)) - first[cell]
        for k in range(int(rank.max(initial=-1)) + 1):
            tried = np.flatnonzero((rank == k) & kept & (done[cell] < 0))
            self._without_meshes(tried, qs, "true", foot, link, blame)
            tried = tried[(foot[tried] != _HIT) & (way[tried] == _OPEN)]
            self._without_meshes(tried, above, "raised", way, link, blame)
            free = tried[(foot[tried] == _FREE) & (way[tried] == _FREE)]
            done[cell[free]] = free
            progress(0.2 * (k + 1) / (int(rank.max()) + 1), "collisions")
        checks = self._with_meshes(first, done, kept, qs, above, foot, way, link, blame, most_checks, progress)
        return _verdict(first, done, kept, foot, way, link, blame, checks)

    def _without_meshes(
        self,
        tried: NDArray[np.int64],
        qs: Array,
        mode: str,
        answer: NDArray[np.int8],
        link: NDArray[np.uint8],
        blame: NDArray[np.uint8],
    ) -> None:
        if self._certified is not None and len(tried):
            free = self._certified(qs[tried], mode)
            answer[tried[free]] = _FREE
            tried = tried[~free]
        if not len(tried):
            return
        links, hits = self._overlap.certain(qs[tried], mode)
        sure = hits != NOTHING
        answer[tried[sure]] = _HIT
        link[tried[sure]], blame[tried[sure]] = links[sure], hits[sure]

    def _with_meshes(
        self,
        first: NDArray[np.int64],
        done: NDArray[np.int64],
        kept: NDArray[np.bool_],
        qs: Array,
        above: Array,
        foot: NDArray[np.int8],
        way: NDArray[np.int8],
        link: NDArray[np.uint8],
        blame: NDArray[np.uint8],
        most_checks: int | None,
        progress: Progress,
    ) -> int:
        """Settle what is open, cells in scattered order, so that a bound leaves no region out. Returns the checks."""
        cells = np.flatnonzero(done < 0)
        cells = cells[np.argsort(cells * 0.6180339887498949 % 1.0, kind="stable")]
        checks = 0
        for number, cell in enumerate(cells):
            if number % _AT_ONCE == 0:
                progress(0.2 + 0.8 * number / len(cells), "collisions")
            for i in range(first[cell], first[cell + 1]):
                if not kept[i] or foot[i] == _HIT or way[i] < 0:
                    continue
                for mode, q, answer in (("true", qs[i], foot), ("raised", above[i], way)):
                    if answer[i] != _OPEN:
                        continue
                    if most_checks is not None and checks >= most_checks:
                        return checks
                    checks += 1
                    pair = self.scene.first_contact(q, mode)
                    answer[i] = _FREE if pair is None else _HIT
                    if pair is not None:
                        link[i], blame[i] = _codes(*pair)
                        break
                if foot[i] == _FREE and way[i] == _FREE:
                    done[cell] = i
                    break
        return checks

    def _repeated(self, cell: NDArray[np.int64], branch: NDArray[np.int64], way: NDArray[np.int8]) -> NDArray[np.bool_]:
        """Candidates that differ from an earlier one of their cell by half turns of links that look the same then.

        Both solutions of a wrist put every link into the same place, turned by half a turn about its x.
        """
        if not self.half_turn_alike or not len(cell):
            return np.zeros(len(cell), bool)
        key = (cell * 4 + bend_of(branch)) * 2 + (way == _NONE)
        _, earliest = np.unique(key, return_index=True)
        repeated = np.ones(len(cell), bool)
        repeated[earliest] = False
        return repeated


def _verdict(
    first: NDArray[np.int64],
    done: NDArray[np.int64],
    kept: NDArray[np.bool_],
    foot: NDArray[np.int8],
    way: NDArray[np.int8],
    link: NDArray[np.uint8],
    blame: NDArray[np.uint8],
    checks: int,
) -> Verdict:
    """Free where a candidate is; else open, if one is; else what stops the one that gets farthest, in this order."""
    reasons = np.full(len(foot), UNSURE, np.uint8)
    reasons[way == _NONE] = NO_LIFT
    reasons[way == _HIT] = WAYPOINT_COLLISION
    reasons[foot == _HIT] = FOOT_COLLISION
    rank = {UNSURE: 3, WAYPOINT_COLLISION: 2, NO_LIFT: 1, FOOT_COLLISION: 0}
    progressed = np.array([rank.get(k, 0) for k in range(max(rank) + 1)])[reasons]
    progressed[~kept] = -1
    cell = np.repeat(np.arange(len(done)), np.diff(first))
    farthest = np.lexsort((-progressed, cell))[first[:-1]]
    chosen = np.where(done >= 0, done, farthest)
    reason = np.where(done >= 0, FREE, reasons[chosen]).astype(np.uint8)
    collides = (reason == FOOT_COLLISION) | (reason == WAYPOINT_COLLISION)
    hit = (foot == _HIT) | (way == _HIT)
    turnable = kept & ((hit & (link >= _TURNING)) | (~hit & (way == _NONE)))
    return Verdict(
        reason, chosen, np.where(collides, link[chosen], 0), np.where(collides, blame[chosen], 0), checks, turnable
    )


def _half_turn_alike(vertices: Array) -> bool:
    """Whether vertices look the same after half a turn about x."""
    turned = vertices * (1.0, -1.0, -1.0)
    return bool(np.linalg.norm(vertices[:, None] - turned, axis=2).min(axis=1).max() < 1e-6)


def _codes(a: str, b: str) -> tuple[int, int]:
    """Link and obstacle codes of a pair of names; the leg's own link comes first, of two the outer one is the link."""
    link = PARTS.index(a.split("_", 1)[1])
    if b == TERRAIN:
        return link, TERRAIN_CODE
    if b == "base":
        return link, CHASSIS
    if b == PAYLOAD:
        return link, PAYLOAD_CODE
    if "_" in b:
        return max(link, PARTS.index(b.split("_", 1)[1])), SELF
    return link, LEG + int(b.removeprefix("leg"))
