"""What the cameras could have seen of the simulated ground, by casting rays at it."""

import numpy as np
from numpy.typing import NDArray

from footfall.core import frames
from footfall.core.grid import GridGeometry
from footfall.core.mesh import Mesh
from footfall.robot.model import Robot
from footfall.sim.raycast import RayScene
from footfall.telemetry.images import Camera, ImagePair, Snapshot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at
from footfall.terrain.ground.triangulate import triangulate
from footfall.terrain.rover_mask.selfmask import robot_parts

LIFT = 0.004
"""Points are looked at this far above the ground, so that their own triangle doesn't hide them [m]."""


def true_heights(world: Dem, geometry: GridGeometry) -> NDArray[np.float64]:
    """Heights of the world at the cells of a map, (rows, cols), NaN outside."""
    x, y = np.meshgrid(geometry.xs, geometry.ys)
    return height_at(world, x, y)


def cells_seen(robot: Robot, true: RobotState, world: Dem, snapshot: Snapshot, geometry: GridGeometry) -> NDArray:
    """Cells that lie open to both cameras of at least one pair, (rows, cols) bool; true: where the rover really is."""
    x, y = np.meshgrid(geometry.xs, geometry.ys)
    points = _above(world, x, y)
    scene = _scene(robot, true, world)
    seen = np.zeros(len(points), bool)
    for pair in snapshot.pairs:
        new = np.flatnonzero(np.isfinite(points[:, 2]) & ~seen)
        seen[new[_open_to_both(scene, points[new], pair, true)]] = True
    return seen.reshape(x.shape)


def pixels_across(
    robot: Robot, true: RobotState, world: Dem, snapshot: Snapshot, x: NDArray, y: NDArray, length: float
) -> float:
    """How many pixels a length [m] is wide at some places (n,), in the pair that shows them largest of those both of
    whose cameras see at least half of them; 0 where there is none."""
    points = _above(world, x, y)
    scene = _scene(robot, true, world)
    most = 0.0
    for pair in snapshot.pairs:
        both = _open_to_both(scene, points, pair, true)
        if both.mean() >= 0.5:
            camera = pair.camera_left
            most = max(most, length * camera.fx / float(_in_camera(points[both], camera, true)[:, 2].mean()))
    return most


def _above(world: Dem, x: NDArray, y: NDArray) -> NDArray[np.float64]:
    return np.stack([x, y, height_at(world, x, y) + LIFT], -1).reshape(-1, 3)


def _scene(robot: Robot, true: RobotState, world: Dem) -> RayScene:
    body = [
        Mesh(frames.apply(true.T_site_base @ T_base_part, mesh.vertices), mesh.triangles)
        for mesh, T_base_part in robot_parts(robot, true.posture)
    ]
    return RayScene([triangulate(world), *body])


def _open_to_both(scene: RayScene, points: NDArray, pair: ImagePair, true: RobotState) -> NDArray[np.bool_]:
    both = _open_to(scene, points, pair.camera_left, true)
    both[both] = _open_to(scene, points[both], pair.camera_right, true)
    return both


def _in_camera(points: NDArray, camera: Camera, true: RobotState) -> NDArray[np.float64]:
    T = true.T_site_base @ camera.T_base_camera
    return (points - T[:3, 3]) @ T[:3, :3]


def _open_to(scene: RayScene, points: NDArray, camera: Camera, true: RobotState) -> NDArray[np.bool_]:
    p = _in_camera(points, camera, true)
    ahead = p[:, 2] > 0.05
    z = np.where(ahead, p[:, 2], 1.0)
    u, v = camera.fx * p[:, 0] / z + camera.cx, camera.fy * p[:, 1] / z + camera.cy
    inside = ahead & (u >= 0) & (u <= camera.width - 1) & (v >= 0) & (v <= camera.height - 1)
    some = np.flatnonzero(inside)
    eye = (true.T_site_base @ camera.T_base_camera)[:3, 3]
    hits = scene.first_hits(eye, points[some] - eye)
    inside[some] = (hits.body < 0) | (hits.distance > 0.999)
    return inside
