"""The rules of motion over a terrain: collisions and balance at dense samples of every command.

Each LEG_MOVE is a straight joint-space line; it is sampled so that no joint moves more than
``settings.sample`` between two checked postures. The terrain is the true one, not raised.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from footfall.balance.support import margins
from footfall.core.frames import apply
from footfall.robot.collision import CollisionScene
from footfall.robot.ik import contact_point
from footfall.robot.kinematics import center_of_mass
from footfall.robot.model import Robot
from footfall.sequence.commands import Command, RuleResult
from footfall.sequence.feet import feet
from footfall.sequence.predict import after, target
from footfall.sequence.settings import SequenceSettings
from footfall.terrain.dem import Dem
from footfall.terrain.triangulate import crop

Array = NDArray[np.float64]

STANDING_GAP = 0.05
"""A foot that a sequence has moved stands on the ground when it is within this of it [m].

Reconstructed heights are good to a few centimetres; a foot that is being lifted is soon farther off."""


def check_motion(
    robot: Robot,
    commands: tuple[Command, ...],
    start: Array,
    T_site_base: Array,
    dem: Dem,
    settings: SequenceSettings,
) -> list[RuleResult]:
    """Results of self-collision, terrain-collision and balance for every row that moves a leg."""
    ground = crop(dem, T_site_base[:2, 3], reach(robot))
    results: list[RuleResult] = []
    scene: CollisionScene | None = None
    before = start
    for row, command in enumerate(commands):
        moved = target(command, robot.leg_count)
        if moved is None:
            continue
        leg, _ = moved
        # consecutive rows of one leg leave the others where they are, so they share a scene
        if scene is None or leg != scene.leg:
            scene = CollisionScene(robot, before, leg, T_site_base, ground, clearance=settings.clearance)
        reached = after(before, command)
        postures = samples(before, reached, settings.sample)
        results += _collisions(row, scene, postures[:, 6 * leg : 6 * leg + 6])
        results.append(_balance(robot, row, leg, postures, start, T_site_base, dem, settings))
        before = reached
    return results


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


def _balance(
    robot: Robot,
    row: int,
    leg: int,
    postures: Array,
    start: Array,
    T_site_base: Array,
    dem: Dem,
    settings: SequenceSettings,
) -> RuleResult:
    gaps = feet(robot, dem, postures[0], T_site_base).gaps
    # A foot that never moved stands where the rover stood on it, whatever a reconstructed terrain says.
    unmoved = (postures[0] == start).reshape(-1, 6).all(axis=1)
    support = unmoved | (gaps <= STANDING_GAP)
    support[leg] = False
    # the same points as the planner's, so that a plan's margin is its sequence's
    contacts = np.array([contact_point(robot, postures[0], int(i), T_site_base) for i in np.flatnonzero(support)])
    coms = np.array([apply(T_site_base, center_of_mass(robot, posture)) for posture in postures])
    all_margins = margins(contacts.reshape(-1, 3), coms[:, :2], settings.conservative)
    worst = int(np.argmin(all_margins))
    kind = "conservative support polygon" if settings.conservative else "support polygon"
    spare = float(all_margins[worst]) - settings.least_margin
    text = (
        f"margin {all_margins[worst]:.3f} m to the {kind} of {int(support.sum())} feet, "
        f"at least {settings.least_margin:.3f} m wanted, least at {worst / (len(postures) - 1):.0%} of the row"
    )
    return RuleResult("balance", row, spare >= 0, spare, "m", text)
