"""Which pixels show the robot itself: its meshes projected into the image, widened by what may be wrong with them.

Encoders err and loaded legs sag, so no link is exactly where its joint angles say; where images show a leg, less is
open (:mod:`footfall.terrain.rover_mask.posture_fit`). What remains is carried through the Jacobian of every point of a
link into pixels: Σ_image = J_image J Σ Jᵀ J_imageᵀ for joint angles of covariance Σ (first-order propagation: Hartley &
Zisserman, *Multiple View Geometry*, 2004, §5.2.6).
"""

import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from footfall.core import frames
from footfall.core.mesh import Mesh
from footfall.robot.kinematics import leg_link_poses, link_poses
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.meshes.shapes import box
from footfall.robot.model import Robot
from footfall.telemetry.images import Camera
from footfall.telemetry.state import RobotState
from footfall.terrain.rover_mask.leg_errors import LegError, encoder_and_sag_errors, joint_axes, point_jacobians
from footfall.terrain.rover_mask.legged_parts import legged_displacements, legged_parts

NEAREST = 0.05
"""Triangles are cut off this close to the lens [m]."""

MAX_WIDENING = 40
"""No part is widened by more than this [px], however near."""

_FRACTION_BITS = 4
_FAR_OUTSIDE = 2.0**20  # [px]; keeps the fixed-point numbers within 32 bits


SIGMAS = 2.0
"""Errors up to this many standard deviations are covered."""


def robot_depths(
    robot: Robot | LeggedRobot,
    state: RobotState,
    camera: Camera,
    margin: float = 0.03,
    extra_px: int = 3,
    *,
    errors: Sequence[LegError] | None = None,
    fitted_margin: float = 0.01,
) -> NDArray[np.float32]:
    """Greatest depth at which each pixel may show the robot.

    Infinite on the robot as its posture has it: what is matched there is the robot or wrong. Around that, each part is
    widened by how far errors of the joint angles move it in the image. In that rim, only what lies no deeper than the
    part can be the part: the ground behind stays.

    Args:
        robot: the rover.
        state: how the rover stands.
        camera: a pinhole, without distortion.
        margin: each part is widened by so much at least, at its nearest depth (shapes and camera poses are not exact)
            [m].
        extra_px: and by so much (matching smears edges by half a block) [px].
        errors: of each leg's posture; None: what encoders and sag do. Of robots that others described, always these.
        fitted_margin: instead of ``margin``, for legs that images showed [m].

    Returns:
        (height, width) [m]: 0 where it never does.
    """
    T_camera_base = frames.inverse(camera.T_base_camera)
    R_camera_base = T_camera_base[:3, :3]
    if isinstance(robot, LeggedRobot):
        displaced = legged_displacements(robot, state.posture)
    else:
        found = encoder_and_sag_errors(robot, state.posture) if errors is None else errors
        displaced = displacements(robot, state.posture, found)
    parts, widths, deeper, margins = [], [], [], []
    for (mesh, T_base_part), (spread, bend, fitted) in zip(robot_parts(robot, state.posture), displaced, strict=True):
        part = Mesh(frames.apply(T_camera_base @ T_base_part, mesh.vertices), mesh.triangles)
        spread, bend = np.einsum("ij,njk->nik", R_camera_base, spread), bend @ R_camera_base.T
        parts.append(part)
        widths.append(_moved_px(part, spread, bend, camera))
        margins.append(fitted_margin if fitted else margin)
        along = SIGMAS * np.linalg.norm(spread[:, 2], axis=1) + np.abs(bend[:, 2])
        deeper.append(max(float(along.max()), margins[-1]))
    return mesh_depths(parts, camera, margins, extra_px, widths, deeper)


def beside(depths: NDArray[np.float32], width: int) -> NDArray[np.float32]:
    """Greatest depth of the robot's rims within ``width`` [px] along rows and columns of each pixel.

    (height, width) [m]: 0 where there is none. depths: as :func:`robot_depths` has them.

    Matching carries the disparities of a leg on beside its outline (boundary overreach: Okutomi, Katayama & Oka, *A
    simple stereo algorithm to recover precise object boundaries and smooth surfaces*, IJCV 2002): what lies no deeper
    there may be it.
    """
    return np.asarray(_spread(np.where(np.isinf(depths), np.float32(0.0), depths), width), np.float32)


def near_rims(depths: NDArray[np.float32], width: int) -> NDArray[np.bool_]:
    """Which pixels (height, width) have a rim of the robot within ``width`` [px] along rows and columns."""
    return _spread(((depths > 0) & (depths < np.inf)).astype(np.uint8), width) > 0


def _spread(image: NDArray, width: int) -> NDArray:
    """The largest value within ``width`` along rows and columns."""
    return cv2.dilate(image, np.ones((2 * width + 1, 2 * width + 1), np.uint8))


def displacements(
    robot: Robot, posture: NDArray[np.float64], errors: Sequence[LegError]
) -> list[tuple[NDArray[np.float64], NDArray[np.float64], bool]]:
    """How far the vertices of every part of :func:`robot_parts`, in that order, may be from where the posture has them.

    The chassis and what it carries stay: cameras ride on it.

    Args:
        robot: the rover.
        posture: joint angles, (legs × 6,) [rad].
        errors: of each leg's posture.

    Returns:
        For each part: ``spread`` (n, 3, 6), what each independent error of its leg moves a vertex by at one standard
        deviation, ``bend`` (n, 3), what the sag does [m], both in base, and whether images showed its leg.
    """
    found: dict[str, tuple[NDArray[np.float64], NDArray[np.float64], bool]] = {}
    for leg, (spec, error) in enumerate(zip(robot.description.legs, errors, strict=True)):
        q_leg = posture[6 * leg : 6 * leg + 6]
        poses, (axes, origins) = leg_link_poses(robot, q_leg, leg), joint_axes(robot, q_leg, leg)
        for place, name in enumerate(spec.link_names):
            if name not in robot.description.meshes:
                continue
            points = frames.apply(poses[name], robot.description.meshes[name].vertices)
            J = point_jacobians(axes, origins, points, np.full(len(points), place))
            found[name] = J @ error.factor, J @ error.bend, error.fitted
    names = [*robot.description.meshes, *([None] if robot.description.payload is not None else [])]
    return [found[name] if name in found else (np.zeros((1, 3, 6)), np.zeros((1, 3)), False) for name in names]


def _moved_px(part: Mesh, spread: NDArray[np.float64], bend: NDArray[np.float64], camera: Camera) -> float:
    """Bound on how far errors move what this part (camera frame) shows in the image [px]."""
    if not spread.any() and not bend.any():
        return 0.0
    x, y, z = part.vertices.T
    z = np.maximum(z, NEAREST)
    # a vertex outside the image only matters through the points of its triangles inside
    a = np.clip(x / z, -(camera.cx + 1) / camera.fx, (camera.width - camera.cx) / camera.fx)
    b = np.clip(y / z, -(camera.cy + 1) / camera.fy, (camera.height - camera.cy) / camera.fy)
    zero = np.zeros_like(z)
    rows = [[camera.fx / z, zero, -camera.fx * a / z], [zero, camera.fy / z, -camera.fy * b / z]]
    J_image = np.array(rows).transpose(2, 0, 1)
    J = J_image @ spread
    covariance = J @ J.transpose(0, 2, 1)
    half_trace = 0.5 * (covariance[:, 0, 0] + covariance[:, 1, 1])
    half_gap = np.hypot(0.5 * (covariance[:, 0, 0] - covariance[:, 1, 1]), covariance[:, 0, 1])
    longest = np.sqrt(half_trace + half_gap)
    return float((SIGMAS * longest + np.linalg.norm(np.einsum("nij,nj->ni", J_image, bend), axis=1)).max())


def robot_parts(robot: Robot | LeggedRobot, posture: NDArray[np.float64]) -> list[tuple[Mesh, NDArray[np.float64]]]:
    """All that a camera can see of the robot: meshes of the links and the payload, each with its pose in base."""
    if isinstance(robot, LeggedRobot):
        return legged_parts(robot, posture)
    poses = link_poses(robot, posture)
    parts = [(mesh, poses[name]) for name, mesh in robot.description.meshes.items()]
    payload = robot.description.payload
    if payload is not None:
        parts.append((box(payload.size, payload.position), np.eye(4)))
    return parts


def mesh_depths(
    parts: list[Mesh],
    camera: Camera,
    margin: float | Sequence[float],
    extra_px: int,
    widths: Sequence[float] | None = None,
    deeper: Sequence[float] | None = None,
) -> NDArray[np.float32]:
    """As :func:`robot_depths`, for any meshes.

    Args:
        parts: in the camera's frame [m].
        camera: a pinhole, without distortion.
        margin: of all or of each [m].
        extra_px: each is widened by so much more [px].
        widths: at least so wide is each widened [px]; None: by its margin alone.
        deeper: so much deeper than it was drawn each may be [m]; None: no more.

    Returns:
        (height, width) [m]: 0 where none is.
    """
    # drawn with a border all round, from which parts just outside the image widen into it
    border = MAX_WIDENING
    shape = (camera.height + 2 * border, camera.width + 2 * border)
    depths, core = np.zeros(shape, np.float32), np.zeros(shape, np.uint8)
    none = [0.0] * len(parts)
    margins = np.broadcast_to(margin, len(parts))
    for part, least, width, more in zip(parts, margins, widths or none, deeper or none, strict=True):
        polygons, nearest, farthest = _project(part, camera)
        if not polygons:
            continue
        silhouette = np.zeros(shape, np.uint8)
        for polygon in polygons:
            cv2.fillConvexPoly(silhouette, polygon, 1, shift=_FRACTION_BITS)
        core |= silhouette
        width = math.ceil(max(camera.fx * least / nearest, width)) + extra_px
        rim = _widened(silhouette, min(width, MAX_WIDENING)).astype(bool)
        depths[rim] = np.maximum(depths[rim], farthest + more)
    depths[core.astype(bool)] = np.inf
    return depths[border:-border, border:-border]


def _widened(silhouette: NDArray[np.uint8], width: int) -> NDArray[np.uint8]:
    """Dilated in place by a disc of that radius [px], worked only around the silhouette."""
    u, v, w, h = cv2.boundingRect(silhouette)
    if w == 0 or width == 0:
        return silhouette
    rows, cols = slice(max(v - width, 0), v + h + width), slice(max(u - width, 0), u + w + width)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * width + 1, 2 * width + 1))
    silhouette[rows, cols] = cv2.dilate(silhouette[rows, cols], disc)
    return silhouette


def _project(part: Mesh, camera: Camera) -> tuple[list[NDArray[np.int32]], float, float]:
    """Polygons (fixed point, on the bordered image) of triangles that may be in view; their depths, from, to [m]."""
    corners = part.vertices[part.triangles]
    ahead = corners[..., 2] >= NEAREST
    whole = corners[ahead.all(axis=1)]
    cut = [_clip_near(one) for one in corners[ahead.any(axis=1) & ~ahead.all(axis=1)]]
    shown, nearest, farthest = [], np.inf, 0.0
    for polygons in ([whole] if len(whole) else []) + [one[None] for one in cut]:
        z = polygons[..., 2]
        u = camera.fx * polygons[..., 0] / z + camera.cx
        v = camera.fy * polygons[..., 1] / z + camera.cy
        near = (u.max(axis=1) > -MAX_WIDENING) & (u.min(axis=1) < camera.width + MAX_WIDENING)
        near &= (v.max(axis=1) > -MAX_WIDENING) & (v.min(axis=1) < camera.height + MAX_WIDENING)
        if near.any():
            pixels = np.clip(np.stack([u[near], v[near]], axis=-1) + MAX_WIDENING, -_FAR_OUTSIDE, _FAR_OUTSIDE)
            shown.extend(np.rint(pixels * 2**_FRACTION_BITS).astype(np.int32))
            nearest, farthest = min(nearest, float(z[near].min())), max(farthest, float(z[near].max()))
    return shown, nearest, farthest


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
