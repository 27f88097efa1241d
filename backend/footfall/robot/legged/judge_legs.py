"""A robot's legs judged: feet, what moves them, and how alike those of one group are."""

from collections.abc import Iterator, Mapping

import numpy as np

from footfall.robot.legged.able_to_walk import why_unable
from footfall.robot.legged.finding import Finding, doubtful, good, unusable
from footfall.robot.legged.groups import leg_mass, part_lengths
from footfall.robot.legged.judge_tree import kilograms, least_distance
from footfall.robot.legged.legged_model import FEWEST_LEGS, LegChain, LeggedModel
from footfall.robot.legged.touching import body_mesh
from footfall.robot.legged.tree import RobotTree

SAME = 0.005
"""Legs of a group are the same where they differ by at most this share."""
SAME_FOOT = 0.05
"""The same of the radii of their feet, which may be fitted to meshes."""
MASS_SAME, MASS_NEAR = 0.02, 0.2
"""A weighed mass agrees with the description's within the first share; beyond the second it can't be this robot."""


def judge_legs(model: LeggedModel) -> tuple[Finding, ...]:
    """Findings about legs, feet and groups; one that all is well for each check that found nothing."""
    groups = " + ".join(str(len(group)) for group in model.groups())
    found = [good("legs", f"{len(model.legs)} legs, alike in groups of {groups}")]
    found += [doubtful("legs", leg.name, leg.doubt) for leg in model.legs if leg.doubt]
    found += [
        doubtful("legs", leg.name, f"its name is a number, and it is leg {number}: commands, pages and --leg say so")
        for number, leg in enumerate(model.legs)
        if leg.name.isdecimal() and leg.name != str(number)
    ]
    checks = (
        ("feet", _feet(model), "every foot has a shape, and its frame lies at it"),
        ("collision", _shapes(model), "every part of every leg has a collision shape"),
        ("mimic", [*_mimics(model), *_followers(model)], "every joint of every leg moves by itself"),
        ("symmetry", _asymmetries(model), "legs of a group are the same"),
        ("walking", _unable(model), "every leg can walk"),
    )
    for check, findings, well in checks:
        listed = list(findings)
        found += listed or [good(check, well)]
    return tuple(found)


def judge_mass(tree: RobotTree, weighed: float) -> Finding:
    """Whether the links together weigh what the robot was found to weigh [kg]."""
    off = abs(tree.mass - weighed) / weighed
    text = f"the links weigh {kilograms(tree.mass)}, mass_check says {kilograms(weighed)}: {off:.1%} apart"
    if off > MASS_NEAR:
        return unusable("mass_check", tree.root, text)
    return doubtful("mass_check", tree.root, text) if off > MASS_SAME else good("mass_check", text)


def judge_posture(model: LeggedModel, name: str, posture: Mapping[str, float]) -> Finding:
    """Whether a named posture names the free joints and keeps their limits.

    Args:
        model: the robot.
        name: of the posture.
        posture: joint → angle [rad] or way [m].

    Returns:
        What was found.
    """
    free = {joint.name: joint for joint in model.tree.free()}
    unknown = [joint for joint in posture if joint not in free]
    if unknown:
        return unusable("posture", name, f"{unknown[0]} is no joint that moves by itself")
    for joint, angle in posture.items():
        lower, upper = free[joint].lower, free[joint].upper
        if free[joint].kind != "continuous" and (angle < lower or angle > upper):
            return unusable("posture", name, f"{joint} at {angle:g} is outside its limits {lower:g} … {upper:g}")
    moved = {joint for leg in model.legs for joint in leg.joints}
    missing = [joint for joint in free if joint not in posture]
    if missing:
        parts = (
            ([joint for joint in missing if joint in moved], "taken at 0"),
            ([joint for joint in missing if joint not in moved], "held in the middle"),
        )
        text = "; ".join(f"{', '.join(joints)} not said: {where}" for joints, where in parts if joints)
        return doubtful("posture", name, text)
    return good("posture", "it keeps all limits", name)


def _feet(model: LeggedModel) -> Iterator[Finding]:
    tree = model.tree
    for leg in model.legs:
        if leg.sole.doubt:
            yield doubtful("feet", leg.foot, f"{leg.sole.kind}: {leg.sole.doubt}")
        points = [shape.points for shape in tree.link(leg.foot).shapes]
        if not points:
            continue
        surface = np.concatenate(points)
        off, size = least_distance(surface, np.zeros(3)), float(np.ptp(surface, axis=0).max())
        if off > size / 2:
            text = f"its frame lies {off:z.3f} m off its collision shape, which is {size:z.3f} m large"
            yield doubtful("feet", leg.foot, text)


def _shapes(model: LeggedModel) -> Iterator[Finding]:
    for leg in model.legs:
        for name in leg.joints:
            body = model.tree.joint(name).child
            if body_mesh(model.tree, body) is None:
                yield doubtful("collision", body, f"no collision shape, so nothing keeps leg {leg.name} from hitting")


def _mimics(model: LeggedModel) -> Iterator[Finding]:
    for leg in model.legs:
        for name in leg.joints:
            leader = model.tree.joint(name).mimic
            if leader and leader not in leg.joints:
                yield unusable("mimic", name, f"it follows {leader}, which is no joint of leg {leg.name}")
            elif leader:
                text = f"it follows {leader}, so leg {leg.name} has one free joint fewer, and is taken as rigid"
                yield doubtful("mimic", name, text)


def _followers(model: LeggedModel) -> Iterator[Finding]:
    """Joints beside a leg's chain that follow one of it, such as rods along a shank: only chains move."""
    moved = {name: leg.name for leg in model.legs for name in leg.joints}
    for joint in model.tree.joints:
        leader = joint
        while leader.mimic:
            leader = model.tree.joint(leader.mimic)
        if joint.mimic and joint.moves and joint.name not in moved and leader.name in moved:
            text = (
                f"it follows {leader.name} of leg {moved[leader.name]} beside its chain, and is held as at zero of that"
            )
            yield doubtful("mimic", joint.name, text)


def _unable(model: LeggedModel) -> Iterator[Finding]:
    if len(model.legs) == FEWEST_LEGS:
        text = f"it stands on {FEWEST_LEGS} legs, and none of them can be lifted: a robot that walks has four or more"
        yield doubtful("walking", model.tree.root, text)
    for leg in model.legs:
        if reason := why_unable(model.tree, leg):
            yield doubtful("walking", leg.name, f"FootFall can't walk with it: {reason}")


def _asymmetries(model: LeggedModel) -> Iterator[Finding]:
    for first, *others in model.groups():
        for leg in others:
            yield from _differences(model.tree, first, leg)


def _differences(tree: RobotTree, a: LegChain, b: LegChain) -> Iterator[Finding]:
    where = f"{b.name} and {a.name}"
    mass_a, mass_b = leg_mass(tree, a), leg_mass(tree, b)
    if abs(mass_a - mass_b) > SAME * max(mass_a, mass_b):
        yield doubtful("symmetry", where, f"one weighs {mass_b:.4g} kg, the other {mass_a:.4g} kg")
    lengths_a, lengths_b = part_lengths(tree, a), part_lengths(tree, b)
    worst = int(np.argmax(np.abs(lengths_a - lengths_b)))
    if abs(lengths_a - lengths_b)[worst] > SAME * lengths_a.sum():
        text = f"from {b.joints[worst]} on one is {lengths_b[worst]:z.4f} m long, the other {lengths_a[worst]:z.4f} m"
        yield doubtful("symmetry", where, text)
    radius_a, radius_b = a.sole.radius, b.sole.radius
    if abs(radius_a - radius_b) > SAME_FOOT * max(radius_a, radius_b):
        yield doubtful("symmetry", where, f"one has a foot of radius {radius_b:.4g} m, the other {radius_a:.4g} m")
    for name_a, name_b in zip(a.joints, b.joints, strict=True):
        one, other = tree.joint(name_b), tree.joint(name_a)
        for what in ("effort", "velocity"):
            size, size_other = getattr(one, what), getattr(other, what)
            if abs(size - size_other) > SAME * max(size, size_other):
                yield doubtful("symmetry", where, f"{what} of {name_b} is {size:g}, of {name_a} {size_other:g}")
        # limits of mirrored legs are mirrored
        own, same = np.array([one.lower, one.upper]), np.array([other.lower, other.upper])
        apart = min(np.abs(own - same).max(), np.abs(own + same[::-1]).max())
        if apart > SAME * np.ptp(same):
            text = f"limits of {name_b} are {own[0]:g} … {own[1]:g}, of {name_a} {same[0]:g} … {same[1]:g}"
            yield doubtful("symmetry", where, text)
