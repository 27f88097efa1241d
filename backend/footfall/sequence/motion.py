"""The rules of motion over a terrain: collisions, dragging, balance and torque at dense samples of every command.

Each LEG_MOVE is a straight joint-space line; it is sampled so that no joint moves more than
``settings.sample`` between two checked postures. The terrain is the true one, not raised; its holes near the rover
are filled as for planning: unseen ground must not be free.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from footfall.balance.moving_leg import centers_of_mass
from footfall.balance.support import margins
from footfall.balance.torques import torque_margin
from footfall.core.frames import apply
from footfall.maps.standing import STANDING_GAP, Contacts, contacts, standing, wheel_gaps
from footfall.planning.step.ground import Nearby, Refused, nearby
from footfall.robot.collision import CollisionScene
from footfall.robot.kinematics import leg_wheel_pose
from footfall.robot.model import Robot
from footfall.sequence.commands import Command, RuleResult
from footfall.sequence.predict import after, target
from footfall.sequence.settings import SequenceSettings
from footfall.terrain.dem import Dem

Array = NDArray[np.float64]

MOTION_RULES = ("self-collision", "terrain-collision", "no-drag", "balance", "torque", "ends-on-ground")
DRAG = 0.02
"""How far a wheel may move sideways while it is down on the ground [m]."""
CLEAR = 0.01
"""A wheel higher than this over the ground is off it [m]."""
TORQUE_SAMPLING = 0.05
"""Largest joint step between two postures whose torques are checked [rad]: each is a linear program."""


def check_motion(
    robot: Robot,
    commands: tuple[Command, ...],
    start: Array,
    T_site_base: Array,
    dem: Dem,
    settings: SequenceSettings,
) -> list[RuleResult]:
    """Results of the rules of motion for every row that moves a leg, and of ends-on-ground for every leg moved."""
    moves = [(row, moved[0]) for row, command in enumerate(commands) if (moved := target(command, robot.leg_count))]
    if not moves:
        return []
    legs = sorted({leg for _, leg in moves})
    feet = contacts(robot, dem, start, T_site_base, legs).points
    ground = nearby(dem, np.asarray(T_site_base)[:2, 3], reach(robot), feet)
    if isinstance(ground, Refused):
        return [RuleResult("terrain-collision", moves[0][0], False, np.nan, "m", ground.reason)]
    results: list[RuleResult] = []
    scene: CollisionScene | None = None
    before = start
    touched: dict[int, Array] = {}
    for row, leg in moves:
        # consecutive rows of one leg leave the others where they are, so they share a scene
        if scene is None or leg != scene.leg:
            scene = CollisionScene(robot, before, leg, T_site_base, ground.mesh, clearance=settings.clearance)
        reached = after(before, commands[row])
        postures = samples(before, reached, settings.sample)
        results += _collisions(row, scene, postures[:, 6 * leg : 6 * leg + 6])
        results.append(_drag(robot, row, leg, postures, T_site_base, ground, touched))
        down = _down(robot, dem, start, before, T_site_base, [i for i in robot.legs if i != leg])
        support = contacts(robot, dem, before, T_site_base, down)
        results.append(_balance(robot, row, leg, postures, T_site_base, support, settings))
        results.append(_torque(robot, row, postures, T_site_base, down, support, settings))
        before = reached
    last = {leg: row for row, leg in moves}
    return results + [_ends(robot, last[leg], leg, before, T_site_base, dem) for leg in legs]


def samples(before: Array, reached: Array, largest_step: float) -> Array:
    """Postures on the straight line from before to reached, ends included, (n, legs × 6) [rad]."""
    count = max(1, int(np.ceil(np.max(np.abs(reached - before)) / largest_step)))
    return before + np.linspace(0.0, 1.0, count + 1)[:, None] * (reached - before)


def reach(robot: Robot) -> float:
    """Radius about the base within which terrain can be touched [m]: every leg stretched out, and its wheel."""
    return max(
        float(np.linalg.norm(leg.T_base_hip[:3, 3]) + np.linalg.norm(leg.hip_offset))
        + leg.thigh
        + leg.shank
        + leg.foot
        + float(np.hypot(robot.wheel_radius, robot.description.wheel_width))
        for leg in robot.description.legs
    )


def _collisions(row: int, scene: CollisionScene, qs_leg: Array) -> Iterator[RuleResult]:
    hit: dict[str, int] = {}
    for index, q_leg in enumerate(qs_leg):
        if scene.collides(q_leg, terrain="true"):
            rule = "self-collision" if scene.collides(q_leg, terrain="none") else "terrain-collision"
            hit.setdefault(rule, index)
            if len(hit) == 2:
                break
    for rule in ("self-collision", "terrain-collision"):
        if rule not in hit:
            yield RuleResult(rule, row, True, np.nan, "m", f"clear at {len(qs_leg)} samples")
            continue
        terrain = "none" if rule == "self-collision" else "true"
        at = f"first at {hit[rule] / (len(qs_leg) - 1):.0%} of the row"
        contacts = scene.contacts(qs_leg[hit[rule]], terrain=terrain)
        if not contacts:
            yield RuleResult(rule, row, False, np.nan, "m", f"a clearance is just missed, {at}")
            continue
        worst = min(contacts, key=lambda one: one.distance - one.required)
        apart = f"{worst.distance:.3f} m apart" if worst.distance >= 0 else f"{-worst.distance:.3f} m into each other"
        text = f"{worst.link_a} and {worst.link_b} are {apart}, {worst.required:.3f} m are required, {at}"
        yield RuleResult(rule, row, False, worst.distance - worst.required, "m", text)


def _down(robot: Robot, dem: Dem, start: Array, posture: Array, T_site_base: Array, legs: list[int]) -> list[int]:
    """The legs that carry the rover. On unseen ground that is one that never moved, not one that was put there."""
    moved = [leg for leg in legs if (posture != start)[6 * leg : 6 * leg + 6].any()]
    gaps = wheel_gaps(robot, dem, posture, T_site_base, moved)
    unseen = [leg for leg, gap in zip(moved, gaps, strict=True) if np.isnan(gap)]
    return [leg for leg in standing(robot, dem, posture, T_site_base, legs) if leg not in unseen]


def _drag(
    robot: Robot,
    row: int,
    leg: int,
    postures: Array,
    T_site_base: Array,
    ground: Nearby,
    touched: dict[int, Array],
) -> RuleResult:
    """A wheel that is down stays where it is. touched: leg → where it came down, while it is; kept from row to row."""
    worst, at = 0.0, 0
    for index, posture in enumerate(postures):
        gap = wheel_gaps(robot, ground.dem, posture, T_site_base, [leg])[0]
        if gap > CLEAR:
            touched.pop(leg, None)
            continue
        centre = apply(T_site_base, leg_wheel_pose(robot, posture[6 * leg : 6 * leg + 6], leg)[:3, 3])[:2]
        away = float(np.hypot(*(centre - touched.setdefault(leg, centre))))
        if away > worst:
            worst, at = away, index
    text = f"the wheel moves {worst:.3f} m sideways while it is down, {DRAG:.3f} m are allowed"
    where = f", farthest at {at / (len(postures) - 1):.0%} of the row" if worst > DRAG else ""
    return RuleResult("no-drag", row, worst <= DRAG, DRAG - worst, "m", text + where)


def _balance(
    robot: Robot,
    row: int,
    leg: int,
    postures: Array,
    T_site_base: Array,
    support: Contacts,
    settings: SequenceSettings,
) -> RuleResult:
    coms = apply(T_site_base, centers_of_mass(robot, postures[0], leg, postures[:, 6 * leg : 6 * leg + 6]))
    all_margins = margins(support.points, coms[:, :2], settings.conservative)
    worst = int(np.argmin(all_margins))
    kind = "conservative support polygon" if settings.conservative else "support polygon"
    spare = float(all_margins[worst]) - settings.least_margin
    text = (
        f"margin {all_margins[worst]:.3f} m to the {kind} of {len(support.points)} feet, "
        f"at least {settings.least_margin:.3f} m wanted, least at {worst / (len(postures) - 1):.0%} of the row"
    )
    return RuleResult("balance", row, spare >= 0, spare, "m", text)


def _torque(
    robot: Robot,
    row: int,
    postures: Array,
    T_site_base: Array,
    down: list[int],
    support: Contacts,
    settings: SequenceSettings,
) -> RuleResult:
    every = max(1, int(TORQUE_SAMPLING / settings.sample))
    chosen = sorted({*range(0, len(postures), every), len(postures) - 1})
    checks = [torque_margin(robot, postures[i], T_site_base, down, support.normals, settings.friction) for i in chosen]
    worst = int(np.argmax([check.ratio for check in checks]))
    at, check = f"at {chosen[worst] / (len(postures) - 1):.0%} of the row", checks[worst]
    text = f"{check.joint_name} at {check.ratio:.0%} of its limit {at}"
    if not check.feasible:
        text = f"no contact forces inside friction hold the rover {at}"
    return RuleResult("torque", row, check.holds, 1.0 - check.ratio, "of the limit", text)


def _ends(robot: Robot, row: int, leg: int, posture: Array, T_site_base: Array, dem: Dem) -> RuleResult:
    """Whether a leg that was moved is down at the end; over unknown ground nobody can tell, so it does not hold."""
    gap = float(wheel_gaps(robot, dem, posture, T_site_base, [leg])[0])
    if np.isnan(gap):
        text = f"leg {leg} ends over unknown ground"
    elif gap > STANDING_GAP:
        text = f"leg {leg} ends {gap:.3f} m above the ground, at most {STANDING_GAP:.3f} m still stand"
    else:
        text = f"leg {leg} ends on the ground"
    return RuleResult("ends-on-ground", row, gap <= STANDING_GAP, STANDING_GAP - gap, "m", text)
