"""What kind of foot a link is, guessed from its collision shapes."""

from collections.abc import Mapping

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from footfall.core.arrays import Array
from footfall.core.frames import inverse
from footfall.robot.legged.legged_model import Sole
from footfall.robot.legged.tree import TreeLink, TreeShape

ROUND = 0.03
"""A ball's or wheel's surface is round where it leaves the fitted one by at most this share of the radius."""
NEARLY_ROUND = 0.15
"""Up to here a mesh that is neither round nor a wheel is still taken for a ball, and the difference told."""
FLAT_DEPTH = 0.02
"""Points count to a flat sole within this share of the foot's height above the lowest."""
FLAT_SHARE = 0.3
"""A foot is flat where its sole covers at least this share of what it covers seen from above."""

_NOTHING = np.zeros((0, 3))


def sole_of(links: tuple[TreeLink, ...], Ts_foot_link: Mapping[str, Array], down: Array) -> Sole:
    """The sole of a foot: its lowest shape decides.

    Args:
        links: whose shapes it is made of.
        Ts_foot_link: link → its pose in the foot link's frame, (4, 4).
        down: direction of the ground in that frame, (3,), at the posture in the middle.

    Returns:
        What of the foot touches the ground.
    """
    placed = [(Ts_foot_link[link.name] @ shape.T_link_shape, shape) for link in links for shape in link.shapes]
    if not placed:
        return Sole("point", np.zeros(3), 0.0, np.zeros(3), 0.0, _NOTHING, "no collision shape: taken at its frame")
    T_foot_shape, shape = max(placed, key=lambda one: float((_points(*one) @ down).max()))
    if shape.kind == "sphere":
        return _ball(T_foot_shape[:3, 3], float(shape.size[0]))
    if shape.kind == "cylinder":
        axis = T_foot_shape[:3, 2]
        if abs(axis @ down) < 0.5:
            return _wheel(T_foot_shape[:3, 3], axis, float(shape.size[0]), float(shape.size[2]))
    points = _points(T_foot_shape, shape)
    if shape.kind == "mesh":
        # with the middles of triangles, as the corners alone of a cylinder or box lie on a sphere too
        corners = points[shape.mesh.triangles]
        surface = np.concatenate([points, corners.mean(axis=1)])
        round_one = (
            _as_ball(surface, down, ROUND)
            or _as_wheel(T_foot_shape, shape, down)
            or _as_ball(surface, down, NEARLY_ROUND)
        )
        if round_one is not None:
            return round_one
    return _flat_or_point(points, down)


def _points(T_foot_shape: Array, shape: TreeShape) -> Array:
    return shape.mesh.vertices @ T_foot_shape[:3, :3].T + T_foot_shape[:3, 3]


def _ball(center: Array, radius: float, doubt: str = "") -> Sole:
    return Sole("ball", center, radius, np.zeros(3), 0.0, _NOTHING, doubt)


def _wheel(center: Array, axis: Array, radius: float, width: float, doubt: str = "") -> Sole:
    return Sole("wheel", center, radius, axis, width, _NOTHING, doubt)


def _as_ball(points: Array, down: Array, off_by: float) -> Sole | None:
    """A ball where a mesh's lower end, or all of it, leaves a fitted sphere by at most that share of the radius."""
    heights = points @ down
    width = float(np.ptp(points - np.outer(heights, down), axis=0).max())
    lower = points[heights > heights.max() - 0.3 * min(width, float(np.ptp(heights)))]
    for part in (lower, points):
        fitted = _sphere(part) if len(part) >= 12 else None
        if fitted is None:
            continue
        center, radius = fitted
        off = float(np.percentile(np.abs(np.linalg.norm(part - center, axis=1) - radius), 95))
        if 0 < radius <= width and off <= off_by * radius:
            return _ball(center, radius, f"a ball fitted to the mesh, which leaves it by {1e3 * off:z.1f} mm")
    return None


def _sphere(points: Array) -> tuple[Array, float] | None:
    """Centre and radius of |p|² = 2 c·p + (r² − |c|²) by least squares; None where the points lie in a plane."""
    middle = points.mean(axis=0)
    near = points - middle
    matrix = np.column_stack([2 * near, np.ones(len(near))])
    solution, _, rank, _ = np.linalg.lstsq(matrix, (near**2).sum(axis=1), rcond=None)
    if rank < 4:
        return None
    return solution[:3] + middle, float(np.sqrt(max(solution[3] + solution[:3] @ solution[:3], 0.0)))


def _as_wheel(T_foot_shape: Array, shape: TreeShape, down: Array) -> Sole | None:
    """A wheel where a mesh seen along one of its own axes is a disc, narrower than it is high, with that axis level."""
    vertices = shape.mesh.vertices
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    for k in range(3):
        axis = T_foot_shape[:3, k]
        seen = np.delete(vertices - (low + high) / 2, k, axis=1)
        radius = float(np.linalg.norm(seen, axis=1).max())
        width = float(high[k] - low[k])
        if abs(axis @ down) > 0.5 or width > 2 * radius or np.ptp(np.delete(high - low, k)) > ROUND * 2 * radius:
            continue
        try:
            disc = ConvexHull(seen).volume
        except QhullError:
            continue
        if disc > (1 - 2 * ROUND) * np.pi * radius**2:
            center = T_foot_shape[:3, :3] @ ((low + high) / 2) + T_foot_shape[:3, 3]
            return _wheel(center, axis, radius, width, "a disc, guessed from the mesh")
    return None


def _flat_or_point(points: Array, down: Array) -> Sole:
    """A flat sole where the lowest points span an area, else the lowest point."""
    # x, y of `level` lie in the plane across `down`, so that turns are counter-clockwise seen from below
    across = np.cross(down, (1.0, 0.0, 0.0) if abs(down[0]) < 0.9 else (0.0, 1.0, 0.0))
    across = across / np.linalg.norm(across)
    T_level_foot = np.eye(4)
    T_level_foot[:3, :3] = np.stack([across, np.cross(down, across), down])
    level = points @ T_level_foot[:3, :3].T
    lowest = level[level[:, 2] > level[:, 2].max() - max(FLAT_DEPTH * float(np.ptp(level[:, 2])), 1e-6)]
    try:
        sole, whole = ConvexHull(lowest[:, :2]), ConvexHull(level[:, :2])
    except QhullError:
        sole = whole = None
    T_foot_level = inverse(T_level_foot)[:3, :3]
    if sole is None or whole is None or sole.volume < FLAT_SHARE * whole.volume:
        tip = points[int(np.argmax(points @ down))]
        return Sole("point", tip, 0.0, np.zeros(3), 0.0, _NOTHING, "neither round nor flat below: its lowest point")
    corners = np.column_stack([lowest[sole.vertices, :2], np.full(len(sole.vertices), level[:, 2].max())])
    polygon = corners @ T_foot_level.T
    return Sole("flat", polygon.mean(axis=0), 0.0, down, 0.0, polygon)
