"""A robot's links and joints judged: masses, inertias, limits, torques, speeds, sizes of meshes."""

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from footfall.core.frames import apply, inverse
from footfall.robot.legged.finding import Finding, Grade, doubtful, good, unusable
from footfall.robot.legged.tree import RobotTree, TreeJoint, TreeLink

TRIANGLE_SLACK = 1e-3
"""Share of the larger moments by which a rounded inertia may break the triangle inequality."""
POINT_RADIUS = 1e-4
"""A radius of gyration below this [m] is none: descriptions write zeros or 1e-22 where they mean a point mass."""
ROUNDING = 1e-12
LARGE_MESH, HUGE_MESH = 5.0, 50.0
"""A mesh this many times as large as the robot's joints are apart is doubtful, or in another unit than metres."""
SMALL_MESH = 1 / 300
"""One this small is doubtful, too: scaled twice, it keeps nothing from hitting."""


def judge_tree(tree: RobotTree) -> tuple[Finding, ...]:
    """Findings about links and joints, leg or not; one that all is well for each check that found nothing."""
    found: list[Finding] = []
    checks = (
        ("mass", _masses(tree), f"{len(tree.links)} links weigh {kilograms(tree.mass)}"),
        ("inertia", _inertias(tree), "inertias are positive definite and keep the triangle inequality"),
        ("limits", _limits(tree), "every joint that needs limits has them in order"),
        ("effort", _given(tree, "effort"), "every joint says how strong it is"),
        ("velocity", _given(tree, "velocity"), "every joint says how fast it is"),
        ("mesh size", _sizes(tree), "collision shapes are about as large as the joints are apart"),
    )
    for check, findings, well in checks:
        listed = list(findings)
        found += listed or [good(check, well)]
    return tuple(found)


def spread(tree: RobotTree) -> float:
    """The longest way along the joints from the root to a link, at zero: how large the robot is [m]."""
    far = {tree.root: 0.0}
    for joint in tree.joints:
        far[joint.child] = far[joint.parent] + float(np.linalg.norm(joint.T_parent_joint[:3, 3]))
    return max(far.values())


def _masses(tree: RobotTree) -> Iterator[Finding]:
    for link in tree.links:
        if not 0 <= link.mass < math.inf:
            yield unusable("mass", link.name, f"its mass is {link.mass:g} kg; 0 or more would be right")
        elif not np.isfinite(link.center).all():
            yield unusable("mass", link.name, "its centre of mass is not finite")
    if tree.mass == 0:
        yield unusable("mass", tree.root, "all links together weigh 0 kg, so nothing is known of balance")
        return
    for joint in tree.joints:
        if joint.moves and sum(link.mass for link in tree.members(joint.child)) == 0:
            yield doubtful("mass", joint.child, f"what {joint.name} moves weighs 0 kg")


def _inertias(tree: RobotTree) -> Iterator[Finding]:
    first = tree.bodies()
    for link in tree.links:
        fault = inertia_fault(link.mass, link.inertia) if link.mass > 0 else None
        if fault is None:
            continue
        grade, text = fault
        if grade is Grade.UNUSABLE and inertia_fault(*_mass_and_inertia(tree, first[link.name])) is None:
            grade, text = Grade.DOUBTFUL, f"{text}; that of its rigid body {first[link.name]} is sound"
        yield Finding(grade, "inertia", link.name, text)


def inertia_fault(mass: float, inertia: NDArray[np.float64]) -> tuple[Grade, str] | None:
    """What is wrong with the inertia (3, 3) [kg·m²] of so much mass [kg]; None where it is sound.

    The principal moments of every body are positive, and none is larger than the sum of the two others (Traversaro et
    al., Identification of fully physical consistent inertial parameters, 2016).
    """
    if not np.isfinite(inertia).all():
        return Grade.UNUSABLE, "its inertia is not finite"
    a, b, c = np.linalg.eigvalsh(inertia)
    if max(-a, c) <= POINT_RADIUS**2 * mass:
        return Grade.DOUBTFUL, f"it has {mass:g} kg and no inertia to speak of: a point mass"
    if a <= ROUNDING * c:
        return Grade.UNUSABLE, f"its inertia is not positive definite: its least principal moment is {a:.3g} kg·m²"
    if c > (a + b) * (1 + TRIANGLE_SLACK):
        excess = f"{c:.4g} kg·m² is more than {a:.4g} + {b:.4g}"
        return Grade.DOUBTFUL, f"its inertia breaks the triangle inequality: {excess}"
    return None


def _mass_and_inertia(tree: RobotTree, body: str) -> tuple[float, NDArray[np.float64]]:
    mass, _, inertia = body_inertia(tree, body)
    return mass, inertia


def body_inertia(tree: RobotTree, body: str) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    """Mass [kg], centre of mass (3,) [m] and inertia about it (3, 3) [kg·m²] of a body, in its first link's frame.

    The parallel axis theorem: I = Σ R Iᵢ Rᵀ + mᵢ (|d|² 1 − d dᵀ), d from the common centre to that of link i.
    """
    Ts_root_link = tree.poses({})
    T_body_root = inverse(Ts_root_link[body])
    return joined_inertia([(T_body_root @ Ts_root_link[link.name], link) for link in tree.members(body)])


def joined_inertia(
    placed: Sequence[tuple[NDArray[np.float64], TreeLink]],
) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    """The same of links, each with its T_body_link (4, 4), in the body's frame."""
    masses = np.array([link.mass for _, link in placed])
    centers = np.array([apply(T_body_link, link.center) for T_body_link, link in placed])
    if not masses.sum() > 0:
        return float(masses.sum()), np.zeros(3), np.zeros((3, 3))
    center = masses @ centers / masses.sum()
    inertia = np.zeros((3, 3))
    for (T_body_link, link), offset in zip(placed, centers - center, strict=True):
        R = T_body_link[:3, :3]
        inertia += R @ link.inertia @ R.T + link.mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    return float(masses.sum()), center, inertia


def kilograms(mass: float) -> str:
    """A mass with its unit, in words: to the gram, or to three digits where it is less than 100 g."""
    return f"{mass:z.3f} kg" if mass >= 0.1 else f"{mass:.3g} kg"


def _limits(tree: RobotTree) -> Iterator[Finding]:
    for joint in tree.free():
        if joint.kind == "continuous":
            continue
        unit = _unit(joint)
        if not np.isfinite([joint.lower, joint.upper]).all():
            wanted = "lower and upper would be right, in the URDF or the robot.toml" + (
                ", or continuous" if joint.kind == "revolute" else ""
            )
            yield unusable("limits", joint.name, f"it is {joint.kind} without limits; {wanted}")
        elif joint.lower > joint.upper:
            text = f"its limits are reversed: lower {joint.lower:g}, upper {joint.upper:g} {unit}"
            yield unusable("limits", joint.name, text)
        elif joint.lower == joint.upper:
            yield unusable("limits", joint.name, f"both limits are {joint.lower:g} {unit}, so it can't move")
        elif joint.kind == "revolute" and joint.upper - joint.lower > 4 * math.pi + 0.01:
            turns = (joint.upper - joint.lower) / (2 * math.pi)
            yield doubtful(
                "limits", joint.name, f"it turns {turns:z.1f} times round: limits in degrees, or none meant?"
            )


def _given(tree: RobotTree, what: str) -> Iterator[Finding]:
    for joint in tree.free():
        size = getattr(joint, what)
        if math.isnan(size):
            yield doubtful(what, joint.name, f"its {what} is not said")
        elif size == 0:
            yield doubtful(what, joint.name, f"its {what} is 0, so it could not move; not said is taken to be meant")
        elif size < 0:
            yield unusable(what, joint.name, f"its {what} is {size:g}; above zero would be right")


def _sizes(tree: RobotTree) -> Iterator[Finding]:
    length = spread(tree)
    if length == 0:
        return
    for link in tree.links:
        for shape in link.shapes:
            ratio = float(shape.size.max()) / length
            small = shape.kind == "mesh" and ratio < SMALL_MESH
            if ratio <= LARGE_MESH and not small:
                continue
            size = (
                f"{shape.source or shape.kind} is {shape.size.max():.3g} m large, and the joints reach {length:.3g} m"
            )
            if small:
                yield doubtful("mesh size", link.name, f"{size}: scaled twice? So small it keeps nothing from hitting")
            elif ratio > HUGE_MESH:
                yield unusable(
                    "mesh size", link.name, f'{size}: in millimetres? scale="0.001 0.001 0.001" would be right'
                )
            else:
                yield doubtful("mesh size", link.name, size)


def _unit(joint: TreeJoint) -> str:
    return "m" if joint.kind == "prismatic" else "rad"


def least_distance(points: NDArray[np.float64], place: NDArray[np.float64]) -> float:
    """From a place to the box around points, 0 inside [m]."""
    outside = np.maximum(points.min(axis=0) - place, place - points.max(axis=0))
    return float(np.linalg.norm(np.maximum(outside, 0.0)))
