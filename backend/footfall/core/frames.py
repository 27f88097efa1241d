"""Rigid transforms as 4 × 4 arrays. ``T_a_b`` maps points: p_a = T_a_b @ p_b; inner labels cancel.

Frames: ``site`` (x east, y north, z up), ``base`` (x forward, y left, z up), ``camera`` (OpenCV: z
forward, x right, y down). Stacks of transforms are ``Ts_*`` with shape (…, 4, 4).
"""

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput


def transform(rotation: ArrayLike | None = None, translation: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """4 × 4 transform from a 3 × 3 rotation (identity when None) and a translation [m]."""
    T = np.eye(4)
    if rotation is not None:
        T[:3, :3] = rotation
    T[:3, 3] = translation
    return T


def rotation(axis: str, angle: ArrayLike) -> Array:
    """Rotation about ``x``, ``y`` or ``z`` by ``angle`` [rad], vectorised: (…) → (…, 3, 3)."""
    angle = np.asarray(angle, float)
    c, s = np.cos(angle), np.sin(angle)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    k = 3 - i - j
    R = np.zeros((*angle.shape, 3, 3))
    R[..., k, k] = 1.0
    R[..., i, i] = R[..., j, j] = c
    R[..., i, j] = -s
    R[..., j, i] = s
    return R


def rotation_rpy(roll: float, pitch: float, yaw: float) -> Array:
    """Rotation R = Rz(yaw) Ry(pitch) Rx(roll).

    Args:
        roll: about x [rad].
        pitch: about y [rad].
        yaw: about z [rad].

    Returns:
        R, (3, 3).
    """
    return rotation("z", yaw) @ rotation("y", pitch) @ rotation("x", roll)


def rpy(R: ArrayLike) -> tuple[float, float, float]:
    """Roll, pitch, yaw [rad] of a rotation (3, 3) or a pose (4, 4): backwards :func:`rotation_rpy`, |pitch| ≤ π/2."""
    R = np.asarray(R, float)
    pitch = -np.arcsin(np.clip(R[2, 0], -1.0, 1.0))
    return float(np.arctan2(R[2, 1], R[2, 2])), float(pitch), heading(R)


def heading(T: ArrayLike) -> float:
    """Where the x axis of a pose (4, 4), or of a rotation (3, 3), points, seen from above [rad]; 0 is east."""
    T = np.asarray(T, float)
    return float(np.arctan2(T[1, 0], T[0, 0]))


def turn_of(R: ArrayLike) -> float:
    """How far a rotation (3, 3) turns about its axis [rad], 0…π."""
    return float(np.arccos(np.clip((np.trace(R) - 1.0) / 2.0, -1.0, 1.0)))


def inverse(T: ArrayLike) -> Array:
    """Inverse of rigid transforms, (…, 4, 4) → (…, 4, 4)."""
    T = np.asarray(T, float)
    R_T = np.swapaxes(T[..., :3, :3], -1, -2)
    out = np.zeros_like(T)
    out[..., :3, :3] = R_T
    out[..., :3, 3] = -(R_T @ T[..., :3, 3, None])[..., 0]
    out[..., 3, 3] = 1.0
    return out


def apply(T_a_b: ArrayLike, p_b: ArrayLike) -> Array:
    """Points (…, 3) in frame b to frame a."""
    T = np.asarray(T_a_b, float)
    return np.asarray(p_b, float) @ T[:3, :3].T + T[:3, 3]


def quat_wxyz(R: ArrayLike) -> Array:
    """Unit quaternion (w, x, y, z), w ≥ 0, of a 3 × 3 rotation (Shepperd's method)."""
    R = np.asarray(R, float)
    trace = np.trace(R)
    choice = int(np.argmax([trace, R[0, 0], R[1, 1], R[2, 2]]))
    q = np.empty(4)
    if choice == 0:
        q[0] = 1.0 + trace
        q[1:] = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    else:
        i = choice - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        q[0] = R[k, j] - R[j, k]
        q[1 + i] = 1.0 + R[i, i] - R[j, j] - R[k, k]
        q[1 + j] = R[j, i] + R[i, j]
        q[1 + k] = R[k, i] + R[i, k]
    q /= np.linalg.norm(q)
    return q if q[0] >= 0 else -q


def rotation_from_quat_wxyz(quat_wxyz: ArrayLike) -> Array:
    """3 × 3 rotation of a quaternion (w, x, y, z). Raises InvalidInput unless its norm is 1 ± 1e-3."""
    q = _numbers(quat_wxyz, "a quaternion")
    norm = float(np.linalg.norm(q)) if q.shape == (4,) else None
    if norm is None or not abs(norm - 1.0) <= 1e-3:
        raise InvalidInput("a quaternion needs four numbers (w, x, y, z) of norm 1", norm=norm, shape=list(q.shape))
    w, x, y, z = q / norm
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def rotation_from_z(normal: ArrayLike, forward: ArrayLike = (1.0, 0.0, 0.0)) -> Array:
    """Rotation whose z is ``normal`` and whose x is ``forward`` made perpendicular to it.

    Raises InvalidInput where either is zero or not finite, and where they are parallel.
    """
    z = _direction(normal, "normal")
    x = _direction(forward, "forward")
    y = np.cross(z, x)
    length = np.linalg.norm(y)
    if length < 1e-9:
        raise InvalidInput("a frame needs a normal that is not parallel to its forward axis")
    y /= length
    return np.column_stack([np.cross(y, z), y, z])


def _direction(vector: ArrayLike, name: str) -> Array:
    v = np.asarray(vector, float)
    size = np.abs(v).max()
    if not 0 < size < np.inf:
        raise InvalidInput(f"a frame needs a {name} that is finite and not zero")
    v = v / size
    return v / np.linalg.norm(v)


def pose_difference(T_site_a: Array, T_site_b: Array, reach: float = 1.0) -> float:
    """How far two poses have points apart that are near the origin.

    Args:
        T_site_a: one pose, (4, 4).
        T_site_b: the other, (4, 4).
        reach: how far from the origin the points may be [m].

    Returns:
        A bound on the distance [m] of any of them.
    """
    shift = float(np.linalg.norm(T_site_a[:3, 3] - T_site_b[:3, 3]))
    return shift + reach * float(np.linalg.norm(T_site_a[:3, :3] - T_site_b[:3, :3], 2))


def require_transform(T: ArrayLike, name: str) -> Array:
    """Return T as a 4 × 4 float array; raises InvalidInput unless it is a finite rigid transform."""
    T = _numbers(T, name)
    if T.shape != (4, 4) or not np.isfinite(T).all():
        raise InvalidInput(f"{name} needs 4 × 4 finite numbers", shape=list(T.shape))
    R = T[:3, :3]
    # entries past 1 fail already here: their squares could overflow to NaN, which no comparison catches
    error = float(np.abs(R @ R.T - np.eye(3)).max()) if np.abs(R).max() < 2 else None
    if error is None or error > 1e-6 or np.linalg.det(R) < 0 or not np.array_equal(T[3], [0, 0, 0, 1]):
        raise InvalidInput(f"{name} is no rigid transform", orthogonality_error=error)
    return T


def _numbers(item: ArrayLike, name: str) -> Array:
    try:
        return np.asarray(item, float)
    except (TypeError, ValueError) as err:
        raise InvalidInput(f"{name} needs an array of numbers: {err}") from err
