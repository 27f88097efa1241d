"""A robot's cameras judged: whether their lenses are outside of what it is made of."""

from collections.abc import Iterator, Mapping

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.robot.description import CameraPairSpec
from footfall.robot.legged.finding import Finding, doubtful, good
from footfall.robot.legged.tree import RobotTree


def judge_cameras(tree: RobotTree, pairs: tuple[CameraPairSpec, ...], held: Mapping[str, float]) -> tuple[Finding, ...]:
    """Findings about camera pairs; one that all is well where there are some and nothing was found.

    Args:
        tree: links and joints of the robot.
        pairs: on its chassis.
        held: joint → where it is held, of those that are no leg's [rad or m].

    Returns:
        What was found; nothing of a robot without cameras.
    """
    hulls = list(_hulls(tree, held)) if pairs else []
    found = [finding for pair in pairs for finding in _inside(pair, hulls)]
    names = ", ".join(pair.name for pair in pairs)
    return (
        *found,
        *([good("cameras", f"every lens is outside of all shapes: {names}")] if pairs and not found else []),
    )


def _hulls(tree: RobotTree, held: Mapping[str, float]) -> Iterator[tuple[str, Array]]:
    """Name of a link, and the planes (n, 4) around one of its shapes, in the root's frame, legs in the middle."""
    poses = tree.poses(tree.neutral() | dict(held))
    for link in tree.links:
        for shape in link.shapes:
            try:
                yield link.name, ConvexHull(apply(poses[link.name], shape.points)).equations
            except QhullError:
                # flat: nothing is inside
                continue


def _inside(pair: CameraPairSpec, hulls: list[tuple[str, Array]]) -> Iterator[Finding]:
    for side, camera in (("left", pair.camera_left), ("right", pair.camera_right)):
        lens = camera.T_base_camera[:3, 3]
        inside = ((-float(np.max(planes[:, :3] @ lens + planes[:, 3])), link) for link, planes in hulls)
        depth, link = max(inside, default=(0.0, ""))
        if depth > 0:
            text = f"its {side} lens lies {1000 * depth:z.0f} mm inside the hull of {link}, which may hide its view"
            yield doubtful("cameras", pair.name, text)
