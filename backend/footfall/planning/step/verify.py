"""The recheck of a finished path, independent of the planner's edge checks and balance test.

Every joint moves in straight lines between waypoints; the path is sampled so densely that no joint changes by more
than ``SAMPLING`` between samples, half of the planner's ε by default. Clearances are certified by a proven check
(proof/clearance.py), a piece of the path at a time where there is room, so that what lies between samples is proven
too; by meshes where that is unsure, and around samples with little to spare ten times as densely: between samples two
things may come nearer. The margins are the least distances of the meshes at the waypoints: found by branch
and bound, so that only what can be the least is measured (nearness_kernel.py). Torque is a linear program, looked at at
every waypoint and at least every ``TORQUE_SAMPLING`` between, and solved where it can be worst.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from footfall.balance.moving_leg import centers_with
from footfall.balance.support import margins_inside
from footfall.core.arrays import Array
from footfall.core.frames import apply, inverse
from footfall.planning.answers import Check
from footfall.planning.scene.ground import Nearby
from footfall.planning.scene.solids import Gap, part_poses
from footfall.planning.step.footing import Footing
from footfall.planning.step.held import NOTHING_HOLDS, listed, spare_torque, worst_held
from footfall.planning.step.problem import StepSettings
from footfall.planning.step.situation import NO_GROUND, RAISED, TRUE, Situation
from footfall.robot.limits import room_to_limits
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

SAMPLING = 0.005
TORQUE_SAMPLING = 0.05
OFF_LINE = 0.002
"""How far the wheel may leave the vertical while it lifts and lowers [m]."""
LITTLE = 1e-3
"""What a sample has to spare where the samples around it speak for all between them [m]. Between two samples h apart,
distances d of at least δ, here 2 cm, dip by no more than v² h² / (8 d), as of two points that pass each other at the
speed v: 1 mm at 2.5 m for a radian, which takes every joint at once."""
FINER = 10
"""Parts into which the way to a sample with less is divided; what lies between those dips by a hundredth of that."""
_AT_ONCE = 64
"""Samples between two pulses."""
UNDER = 0.3
"""Ground within this distance of the leg, seen from above, counts as under the path [m]."""


@dataclass(frozen=True)
class _Path:
    """Samples of a path, every waypoint twice: as the end of one segment and the beginning of the next.

    qs: (n, 6); segments, fractions: (n,), on which segment and how far along it; phases: of each waypoint.
    """

    qs: Array
    segments: NDArray[np.int64]
    fractions: Array
    phases: tuple[str, ...]

    @cached_property
    def swings(self) -> NDArray[np.bool_]:
        """Which samples belong to the swing, (n,)."""
        return self.phase_is("swing")

    def phase_is(self, phase: str) -> NDArray[np.bool_]:
        return np.array([one == phase for one in self.phases])[self.segments + 1]

    def where(self, at: int) -> str:
        segment = int(self.segments[at])
        return f"{self.phases[segment + 1]}, {self.fractions[at]:.0%} of the way to waypoint {segment + 1}"


def recheck(
    situation: Situation,
    dem: Dem,
    waypoints: Array,
    phases: tuple[str, ...],
    pulse: Callable[[], None] = lambda: None,
) -> tuple[Check, ...]:
    """Every check of a path of whole postures; the plan is good if all hold.

    Of the situation only what was asked is used (robot, state, leg, ground, settings, the feet that stand and their
    polygon), and the certificate of clearances, which is proven. The margins of the clearances are exact distances at
    the waypoints, beyond δ; between waypoints it is only asked whether δ is kept.

    Args:
        situation: what was asked.
        dem: the ground with its holes, in site.
        waypoints: (n, legs × 6) [rad].
        phases: (n,), of the motion that ends there.
        pulse: called again and again meanwhile.

    Returns:
        The checks.
    """
    robot, state, leg, settings = situation.robot, situation.state, situation.leg, situation.settings
    q_path = waypoints[:, 6 * leg : 6 * leg + 6]
    path = _sampled(q_path, phases)
    return (
        _limits(robot, leg, path),
        *_clearances(situation, path, q_path, pulse),
        _straight(robot, state, leg, path),
        _balance(robot, state, leg, settings, situation.footing, path),
        _torque(situation, path),
        _unknown(robot, state, leg, situation.ground, path),
    )


def _sampled(q_path: Array, phases: tuple[str, ...]) -> _Path:
    changes = np.abs(np.diff(q_path, axis=0)).max(axis=1)
    counts = np.maximum(np.ceil(changes / SAMPLING).astype(np.int64), 1)
    segments = np.repeat(np.arange(len(counts)), counts + 1)
    first = np.cumsum(counts + 1) - (counts + 1)
    fractions = (np.arange(len(segments)) - first[segments]) / counts[segments]
    a, b = q_path[segments], q_path[segments + 1]
    return _Path(a + fractions[:, None] * (b - a), segments, fractions, phases)


def _limits(robot: Robot, leg: int, path: _Path) -> Check:
    own = slice(6 * leg, 6 * leg + 6)
    spare = room_to_limits(robot, path.qs, own)
    at, joint = np.unravel_index(int(np.argmin(spare)), spare.shape)
    least = float(spare[at, joint])
    name = robot.joint_names[6 * leg + int(joint)]
    return Check("joint limits", least >= 0, least, "rad", f"{name}, {path.where(int(at))}")


def _clearances(situation: Situation, path: _Path, q_path: Array, pulse: Callable[[], None]) -> list[Check]:
    """Three checks: the rover with itself, the leg with the ground, the leg with the raised ground.

    Meshes are asked between waypoints only where the certificate is unsure, and for the margins at the waypoints.
    """
    certificate, own = situation.footing.certificate, situation.footing.solids
    ground, raised = situation.footing.over_ground, situation.settings.raise_terrain
    unsure = np.zeros(len(path.qs), bool)
    for chosen, mode in ((path.swings, RAISED), (~path.swings, TRUE)):
        unsure[chosen] = ~certificate.clear(path.qs[chosen], mode)
    own_unsure = unsure.copy()
    own_unsure[unsure] = ~certificate.clear(path.qs[unsure], NO_GROUND)
    swing_ends = np.array([one == "swing" for one in path.phases])
    ends = np.column_stack([swing_ends, ~swing_ends])
    ends[:-1] |= ends[1:]  # a waypoint ends one phase and begins the next
    asked = [
        ("self collision", own_unsure, own.own_collision, np.ones(len(q_path), bool), own.own_gap),
        (
            "terrain collision in lift and lower",
            unsure & ~path.swings,
            lambda qs, more: ground.collision(qs, 0.0, True, more),
            ends[:, 1],
            lambda qs: ground.gap(qs, 0.0, touching=True),
        ),
        (
            f"terrain collision in swing, raised {raised:z.2f} m",
            unsure & path.swings,
            lambda qs, more: ground.collision(qs, raised, False, more),
            ends[:, 0],
            lambda qs: ground.gap(qs, raised, touching=False),
        ),
    ]
    return [_clearance(name, path, dense, hit, q_path, chosen, gap, pulse) for name, dense, hit, chosen, gap in asked]


def _clearance(
    name: str,
    path: _Path,
    unsure: NDArray[np.bool_],
    collision: Callable[[Array, float], tuple[int, str] | None],
    q_path: Array,
    chosen: NDArray[np.bool_],
    gap: Callable[[Array], tuple[int, Gap]],
    pulse: Callable[[], None],
) -> Check:
    hit, where = None, ""
    doubtful = np.flatnonzero(unsure)
    for first in range(0, len(doubtful), _AT_ONCE):
        pulse()
        part = doubtful[first : first + _AT_ONCE]
        hit = collision(path.qs[part], 0.0) or _hit_beside(path, part, collision)
        if hit is not None:
            where = f"{hit[1]}: {path.where(int(part[hit[0]]))}"
            break
    pulse()
    numbers = np.flatnonzero(chosen)
    least, at = Gap(np.inf, ""), 0
    if len(numbers):
        found, least = gap(q_path[numbers])
        at = int(numbers[found])
    # a collision between waypoints has no size here: no number is better than a kind one
    size = least.spare if hit is None or least.spare < 0 else float("nan")
    holds = hit is None and least.spare >= 0
    place = (
        f"{least.between}, beyond δ, at waypoint {at} ({path.phases[at]})" if len(numbers) else "nothing of the path"
    )
    return Check(name, holds, size, "m", where or place)


def _hit_beside(
    path: _Path, part: NDArray[np.int64], collision: Callable[[Array, float], tuple[int, str] | None]
) -> tuple[int, str] | None:
    """The first of some free samples that has LITTLE to spare and is beside a place that collides, and with what."""
    at = 0
    while (near := collision(path.qs[part[at:]], LITTLE)) is not None:
        at += near[0]
        here = int(part[at])
        for beside in (here - 1, here + 1):
            if 0 <= beside < len(path.qs) and path.segments[beside] == path.segments[here]:
                shares = np.arange(1, FINER)[:, None] / FINER
                found = collision(path.qs[here] + shares * (path.qs[beside] - path.qs[here]), LITTLE / FINER**2)
                if found is not None:
                    return at, found[1]
        at += 1
        if at == len(part):
            break
    return None


def _straight(robot: Robot, state: RobotState, leg: int, path: _Path) -> Check:
    up = inverse(state.T_site_base)[:3, 2]
    worst, where = 0.0, "nowhere"
    for phase, foot in (("lift", 0), ("lower", -1)):
        there = np.flatnonzero(path.phase_is(phase))
        if not len(there):
            continue
        centers = part_poses(robot, leg, path.qs[there])["wheel"][:, :3, 3]
        away = centers - centers[foot]
        away = np.linalg.norm(away - (away @ up)[:, None] * up, axis=1)
        if away.max() > worst:
            worst, where = float(away.max()), path.where(int(there[int(np.argmax(away))]))
    return Check("straight lift and lower", worst <= OFF_LINE, OFF_LINE - worst, "m", where)


def _balance(robot: Robot, state: RobotState, leg: int, settings: StepSettings, footing: Footing, path: _Path) -> Check:
    coms = centers_with(robot, leg, footing.moment, path.qs)
    found = margins_inside(footing.normals, footing.offsets, apply(state.T_site_base, coms)[:, :2])
    at = int(np.argmin(found))
    spare = float(found[at]) - settings.least_margin
    name = "balance (conservative polygon)" if settings.conservative else "balance (support polygon)"
    return Check(name, spare >= 0, spare, "m", path.where(at))


def _torque(situation: Situation, path: _Path) -> Check:
    feet, others = situation.footing.feet, np.array(situation.others)
    due = _torque_samples(path)
    worst, check = worst_held(situation.stance, feet, situation.settings.friction, path.qs[due])
    joint, unseen = check.joint_name or NOTHING_HOLDS, others[~feet.seen]
    note = f"; ground taken as level under legs {listed(unseen)}, where it is unknown" if len(unseen) else ""
    where = path.where(int(due[worst]))
    return Check("torque", check.holds, spare_torque(check), "of the limit", f"{joint}, {where}{note}")


def _torque_samples(path: _Path) -> NDArray[np.int64]:
    """Every waypoint, and so many samples between that no joint changes by more than TORQUE_SAMPLING, (k,)."""
    every = int(TORQUE_SAMPLING / SAMPLING)
    chosen = np.isin(path.fractions, (0.0, 1.0))
    chosen |= _places_on_segment(path.segments) % every == 0
    chosen[1:] &= (path.qs[1:] != path.qs[:-1]).any(axis=1)
    return np.flatnonzero(chosen)


def _places_on_segment(segments: NDArray[np.int64]) -> NDArray[np.int64]:
    """How many samples before each are on the same segment, (n,)."""
    first = np.searchsorted(segments, segments)
    return np.arange(len(segments)) - first


def _unknown(robot: Robot, state: RobotState, leg: int, ground: Nearby, path: _Path) -> Check:
    """How much of the ground under the path was not seen; never a reason to refuse, but to be told."""
    name = "unknown ground under the path"
    if not ground.filled.any():
        return Check(name, True, float("nan"), "", "none")
    qs = path.qs[:: max(1, round(TORQUE_SAMPLING / SAMPLING))]
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
