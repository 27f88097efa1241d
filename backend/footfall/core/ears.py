"""A simple polygon in triangles, concave ones too (ear clipping; Meisters, "Polygons have ears", 1975)."""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def triangles_of(corners: ArrayLike) -> NDArray[np.int64]:
    """Corners (n, 3) or (n, 2) of one face, in order → triangles (n − 2, 3) of their indices, wound as the face is.

    A face in space is seen along its own normal (Newell's method), so that a steep one keeps its shape. Raises
    ValueError for a face that crosses itself: what it covers is anybody's guess.
    """
    points = np.asarray(corners, float)
    points = points - points[0]  # far from the origin, products of coordinates would lose the face
    flat = points if points.shape[1] == 2 else _flattened(points)
    if len(flat) == 3:
        return np.array([[0, 1, 2]])
    if _signed_area(flat) < 0:
        flat = flat * (1.0, -1.0)
    left = list(range(len(flat)))
    found: list[tuple[int, int, int]] = []
    while len(left) > 3:
        ear = next((i for i in range(len(left)) if _is_ear(flat, left, i)), None)
        if ear is None:
            break  # what is left lies on one line, or the face crosses itself
        found.append((left[ear - 1], left[ear], left[(ear + 1) % len(left)]))
        del left[ear]
    found += [(left[0], left[i], left[i + 1]) for i in range(1, len(left) - 1)]
    made = np.array(found)
    a, b, c = flat[made].transpose(1, 0, 2)
    covered = 0.5 * np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]).sum()
    if abs(covered - abs(_signed_area(flat))) > 1e-6 * np.ptp(flat, axis=0).prod():
        raise ValueError("it crosses itself")
    return made


def _flattened(points: NDArray[np.float64]) -> NDArray[np.float64]:
    following = np.roll(points, -1, axis=0)
    normal = np.cross(points, following).sum(axis=0)
    size = np.linalg.norm(normal)
    if size == 0:
        return points[:, :2].copy()
    normal = normal / size
    across = np.eye(3)[int(np.argmin(np.abs(normal)))]
    u = np.cross(normal, across)
    u = u / np.linalg.norm(u)
    return np.stack([points @ u, points @ np.cross(normal, u)], axis=1)


def _signed_area(points: NDArray[np.float64]) -> float:
    x, y = points.T
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def _is_ear(points: NDArray[np.float64], left: list[int], i: int) -> bool:
    before, here, after = left[i - 1], left[i], left[(i + 1) % len(left)]
    a, b, c = points[before], points[here], points[after]
    if _turn(a, b, c) <= 0:
        return False
    others = points[[k for k in left if k not in (before, here, after)]]
    within = (_turn(a, b, others) >= 0) & (_turn(b, c, others) >= 0) & (_turn(c, a, others) >= 0)
    # corners that lie on one of the ear's own are of a bridge to a hole
    apart = ~((others == a).all(axis=1) | (others == b).all(axis=1) | (others == c).all(axis=1))
    return not bool((within & apart).any())


def _turn(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> NDArray[np.float64]:
    """Twice the area of a, b and each c, positive counter-clockwise."""
    return (b[0] - a[0]) * (c[..., 1] - a[1]) - (b[1] - a[1]) * (c[..., 0] - a[0])
