"""The rules of motion over a terrain: collisions, dragging, balance and torque at dense samples of every command.

Each move is a straight joint-space line; it is sampled so that no joint moves more than
``settings.sample`` between two checked postures. The terrain is the true one, not raised; its holes near the rover
are filled as for planning: unseen ground must not be free. Moves of all legs are in ``posture_motion``.
"""

from collections.abc import Iterator

import numpy as np

from footfall.balance.moving_leg import centers_of_mass
from footfall.balance.payload import loaded
from footfall.core.arrays import Array
from footfall.core.beside import beside
from footfall.core.frames import apply
from footfall.maps.standing import STANDING_GAP, Contacts, contacts, wheel_gaps
from footfall.planning.answers import No
from footfall.planning.scene.collision_depth import in_words, worst
from footfall.planning.scene.ground import Nearby, nearby, touch_radius
from footfall.planning.scene.whole_body import WholeBody
from footfall.robot.kinematics import leg_wheel_pose
from footfall.robot.meshes.collision import CollisionScene
from footfall.robot.model import Robot
from footfall.sequence.commands import Command, RuleResult
from footfall.sequence.passage import CLEAR, Passage, passages, standing_legs
from footfall.sequence.posture_motion import check_posture_move
from footfall.sequence.predict import target
from footfall.sequence.sampled import balance_result, drag_result, samples, torque_result
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.terrain.dem import Dem

MOTION_RULES = ("self-collision", "terrain-collision", "no-drag", "balance", "torque", "ends-on-ground")
LOOKS = 12
"""Postures of a row that collides at which it is measured how deep: measuring takes longer than asking."""

DEEPEST = 0.2
"""How far under the ground the set point of a lowered wheel may lie [m]: under full weight a rover sags by as much."""


def check_motion(
    robot: Robot,
    commands: tuple[Command, ...],
    start: Array,
    T_site_base: Array,
    dem: Dem,
    settings: SequenceSettings,
) -> list[RuleResult]:
    """Results of the rules of motion for every row that moves joints, and of ends-on-ground for every leg moved.

    A leg that only moves with all others is asked for where it stood and was drawn up.

    Args:
        robot: the rover.
        commands: the rows.
        start: posture before the first, (legs × 6,) [rad].
        T_site_base: pose of the chassis before the first, (4, 4).
        dem: the ground, in site.
        settings: how closely is looked, and what is asked for.

    Returns:
        The results, row by row.
    """
    moves = [row for row, command in enumerate(commands) if target(command, robot.leg_count) is not None]
    if not moves:
        return []
    way = passages(robot, start, T_site_base, commands, dem)
    of_leg = {row: leg for row in moves if (leg := commands[row].leg) is not None}
    legs = sorted(set(of_leg.values())) if len(of_leg) == len(moves) else list(robot.legs)
    feet = contacts(robot, dem, start, T_site_base, legs).points
    centers = np.array([passage.T_after[:2, 3] for passage in way])
    shifted = float(np.linalg.norm(centers - way[0].T_before[:2, 3], axis=1).max())
    ground = nearby(dem, way[0].T_before[:2, 3], touch_radius(robot) + shifted, feet)
    if isinstance(ground, No):
        return [RuleResult("terrain-collision", moves[0], False, np.nan, "m", ground.reason)]
    body = WholeBody(robot, ground, settings.clearance) if len(of_leg) < len(moves) else None
    results: list[RuleResult] = []
    scene: CollisionScene | None = None
    touched: dict[int, Array] = {}
    for row in moves:
        passage = way[row]
        if row not in of_leg:
            if body is not None:
                results += check_posture_move(robot, row, passage, body, dem, touched, settings)
            scene = None
            continue
        leg = of_leg[row]
        # consecutive rows of one leg leave the others where they are, so they share a scene
        if scene is None or leg != scene.leg:
            scene = CollisionScene(
                robot, passage.before, leg, passage.T_before, ground.mesh, clearance=settings.clearance
            )
        results += _leg_row(robot, row, leg, passage, scene, ground, dem, touched, settings)
    last = {leg: row for row, leg in of_leg.items()}
    end, T_end = way[-1].after, way[-1].T_after
    results += [_ends(robot, last[leg], leg, end, T_end, dem) for leg in sorted(last)]
    stood = {leg: row for row in moves for leg in way[row].standing if leg not in last}
    gaps = wheel_gaps(robot, dem, end, T_end, list(stood))
    drawn_up = [leg for leg, gap in zip(stood, gaps, strict=True) if gap > STANDING_GAP]
    return results + [_ends(robot, stood[leg], leg, end, T_end, dem) for leg in drawn_up]


def _leg_row(
    robot: Robot,
    row: int,
    leg: int,
    passage: Passage,
    scene: CollisionScene,
    ground: Nearby,
    dem: Dem,
    touched: dict[int, Array],
    settings: SequenceSettings,
) -> Iterator[RuleResult]:
    """A row that moves one leg; what it asks for beyond where the wheel touches is asked of the set point alone."""
    T_site_base = passage.T_before
    postures = samples(passage.before, passage.after, settings.sample)
    asked = postures
    if passage.after is not passage.target:
        asked = np.concatenate([postures, samples(passage.after, passage.target, settings.sample)[1:]])
    depth = -float(wheel_gaps(robot, dem, passage.target, T_site_base, [leg])[0])
    too_deep = passage.after is not passage.target and depth > DEEPEST
    for result in _collisions(robot, row, passage, scene, ground, (postures, asked)):
        if result.rule == "terrain-collision" and result.holds and too_deep:
            deep, allowed = beside(depth, DEEPEST)
            text = f"the set point of the wheel ends {deep} m under the ground, {allowed} m are allowed"
            yield RuleResult("terrain-collision", row, False, DEEPEST - depth, "m", text)
        else:
            yield result
    yield _drag(robot, row, leg, asked, T_site_base, ground, touched)
    others = [i for i in robot.legs if i != leg]
    down = standing_legs(robot, dem, passage.resting, passage.before, T_site_base, others)
    support = contacts(robot, dem, passage.before, T_site_base, down)
    yield _balance(robot, row, leg, postures, T_site_base, support, settings)
    Ts_site_base = np.broadcast_to(T_site_base, (len(postures), 4, 4))
    yield torque_result(robot, row, postures, Ts_site_base, down, support, settings)


def _collisions(
    robot: Robot, row: int, passage: Passage, scene: CollisionScene, ground: Nearby, ways: tuple[Array, Array]
) -> Iterator[RuleResult]:
    """What the leg or the rover touches on the way of one row, by rule.

    ways: postures (n, legs × 6) of the row, and those with what it asks for beyond it, which must be clear of the
    rover, not of the ground.
    """
    postures, asked = ways
    begins = _first_hits(scene, postures, asked)
    for rule in ("self-collision", "terrain-collision"):
        if rule not in begins:
            yield RuleResult(rule, row, True, np.nan, "m", f"clear at {len(postures)} samples")
            continue
        end = len(asked if rule == "self-collision" else postures)
        looks = np.unique(np.linspace(begins[rule], end - 1, LOOKS).astype(int))
        terrain = "none" if rule == "self-collision" else "true"
        own = slice(6 * scene.leg, 6 * scene.leg + 6)
        hits = {i: scene.contacts(asked[i][own], terrain=terrain) for i in looks}
        first = f"first at {begins[rule] / (len(asked) - 1):.0%} of the row"
        if not any(hits.values()):
            yield RuleResult(rule, row, False, np.nan, "m", f"a clearance is just missed, {first}")
            continue
        met = {i: worst(hits[i], robot, ground.dem, asked[i], passage.T_before) for i in looks if hits[i]}
        at = max(met, key=lambda i: met[i].missed)
        text = f"{in_words(met[at], robot, met[at].hit.link_b)} at {at / (len(asked) - 1):.0%} of the row, {first}"
        yield RuleResult(rule, row, False, -met[at].missed, "m", text)


def _first_hits(scene: CollisionScene, postures: Array, asked: Array) -> dict[str, int]:
    """Rule that is broken → the first sample at which it is."""
    own = slice(6 * scene.leg, 6 * scene.leg + 6)
    hit: dict[str, int] = {}
    for index, q in enumerate(postures):
        if scene.collides(q[own], terrain="true"):
            rule = "self-collision" if scene.collides(q[own], terrain="none") else "terrain-collision"
            hit.setdefault(rule, index)
            if len(hit) == 2:
                return hit
    for index in range(len(postures), len(asked)):
        if "self-collision" not in hit and scene.collides(asked[index][own], terrain="none"):
            hit["self-collision"] = index
    return hit


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
    return drag_result(row, "the wheel", worst, at / (len(postures) - 1))


def _balance(
    robot: Robot,
    row: int,
    leg: int,
    postures: Array,
    T_site_base: Array,
    support: Contacts,
    settings: SequenceSettings,
) -> RuleResult:
    own = centers_of_mass(robot, postures[0], leg, postures[:, 6 * leg : 6 * leg + 6])
    _, coms = loaded(robot, own, settings.balance)
    return balance_result(row, support, apply(T_site_base, coms), settings)


def _ends(robot: Robot, row: int, leg: int, posture: Array, T_site_base: Array, dem: Dem) -> RuleResult:
    """Whether a leg that was moved is down at the end; over unknown ground nobody can tell, so it does not hold."""
    gap = float(wheel_gaps(robot, dem, posture, T_site_base, [leg])[0])
    if np.isnan(gap):
        text = f"leg {leg} ends over unknown ground"
    elif gap > STANDING_GAP:
        above, most = beside(gap, STANDING_GAP)
        text = f"leg {leg} ends {above} m above the ground, at most {most} m still stand"
    else:
        text = f"leg {leg} ends on the ground"
    return RuleResult("ends-on-ground", row, gap <= STANDING_GAP, STANDING_GAP - gap, "m", text)
