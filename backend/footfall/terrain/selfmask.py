"""Which pixels show the robot itself: its meshes projected into the image."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from footfall.core import frames
from footfall.core.mesh import Mesh
from footfall.robot.kinematics import link_poses
from footfall.robot.model import Robot
from footfall.robot.shapes import box
from footfall.telemetry.images import Camera
from footfall.telemetry.state import RobotState

NEAREST = 0.05
"""Triangles are cut off this close to the lens [m]."""

MAX_WIDENING = 40
"""No part is widened by more than this [px], however near."""

_FRACTION_BITS = 4
_FAR_OUTSIDE = 2.0**20  # [px]; keeps the fixed-point numbers within 32 bits


def robot_mask(
    robot: Robot, state: RobotState, camera: Camera, margin: float = 0.03, extra_px: int = 3
) -> NDArray[np.bool_]:
    """Pixels that show the robot, (height, width), True on the robot.

    Each part is widened by ``margin`` [m] at its nearest depth (pose and shape are not exact) and by ``extra_px``
    (matching smears edges by half a block).
    """
    T_camera_base = frames.inverse(camera.T_base_camera)
    parts = [
        Mesh(frames.apply(T_camera_base @ T_base_part, mesh.vertices), mesh.triangles)
        for mesh, T_base_part in robot_parts(robot, state.posture)
    ]
    return mesh_mask(parts, camera, margin, extra_px)


def robot_parts(robot: Robot, posture: NDArray[np.float64]) -> list[tuple[Mesh, NDArray[np.float64]]]:
    """All that a camera can see of the robot: meshes of the links and the payload, each with its pose in base."""
    poses = link_poses(robot, posture)
    parts = [(mesh, poses[name]) for name, mesh in robot.description.meshes.items()]
    payload = robot.description.payload
    if payload is not None:
        parts.append((box(payload.size, payload.position), np.eye(4)))
    return parts


def mesh_mask(parts: list[Mesh], camera: Camera, margin: float, extra_px: int) -> NDArray[np.bool_]:
    """As :func:`robot_mask` for any meshes in the camera frame."""
    # drawn with a border all round, from which parts just outside the image widen into it
    border = MAX_WIDENING
    mask = np.zeros((camera.height + 2 * border, camera.width + 2 * border), np.uint8)
    for part in parts:
        polygons, nearest = _project(part, camera)
        if not polygons:
            continue
        silhouette = np.zeros_like(mask)
        for polygon in polygons:
            cv2.fillConvexPoly(silhouette, polygon, 1, shift=_FRACTION_BITS)
        mask |= _widened(silhouette, min(math.ceil(camera.fx * margin / nearest) + extra_px, MAX_WIDENING))
    return mask[border:-border, border:-border].astype(bool)


def _widened(silhouette: NDArray[np.uint8], width: int) -> NDArray[np.uint8]:
    """Dilated in place by a disc of that radius [px], worked only around the silhouette."""
    u, v, w, h = cv2.boundingRect(silhouette)
    if w == 0 or width == 0:
        return silhouette
    rows, cols = slice(max(v - width, 0), v + h + width), slice(max(u - width, 0), u + w + width)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * width + 1, 2 * width + 1))
    silhouette[rows, cols] = cv2.dilate(silhouette[rows, cols], disc)
    return silhouette


def _project(part: Mesh, camera: Camera) -> tuple[list[NDArray[np.int32]], float]:
    """Polygons (fixed point, on the bordered image) of triangles that may be in view; their nearest depth [m]."""
    corners = part.vertices[part.triangles]
    ahead = corners[..., 2] >= NEAREST
    whole = corners[ahead.all(axis=1)]
    cut = [_clip_near(one) for one in corners[ahead.any(axis=1) & ~ahead.all(axis=1)]]
    shown, nearest = [], np.inf
    for polygons in ([whole] if len(whole) else []) + [one[None] for one in cut]:
        z = polygons[..., 2]
        u = camera.fx * polygons[..., 0] / z + camera.cx
        v = camera.fy * polygons[..., 1] / z + camera.cy
        near = (u.max(axis=1) > -MAX_WIDENING) & (u.min(axis=1) < camera.width + MAX_WIDENING)
        near &= (v.max(axis=1) > -MAX_WIDENING) & (v.min(axis=1) < camera.height + MAX_WIDENING)
        if near.any():
            pixels = np.clip(np.stack([u[near], v[near]], axis=-1) + MAX_WIDENING, -_FAR_OUTSIDE, _FAR_OUTSIDE)
            shown.extend(np.rint(pixels * 2**_FRACTION_BITS).astype(np.int32))
            nearest = min(nearest, float(z[near].min()))
    return shown, nearest


def _clip_near(triangle: NDArray[np.float64]) -> NDArray[np.float64]:
    """The part of one triangle with z ≥ NEAREST, three or four corners (Sutherland & Hodgman, 1974)."""
    kept = []
    for i in range(3):
        p, q = triangle[i], triangle[(i + 1) % 3]
        if p[2] >= NEAREST:
            kept.append(p)
        if (p[2] >= NEAREST) != (q[2] >= NEAREST):
            kept.append(p + (q - p) * (NEAREST - p[2]) / (q[2] - p[2]))
    return np.array(kept)
