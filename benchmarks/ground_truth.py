"""What the cameras could have seen of the simulated ground, by casting rays at it."""

import numpy as np
from numpy.typing import NDArray

from footfall.core import frames
from footfall.core.grid import GridGeometry
from footfall.core.mesh import Mesh
from footfall.robot.model import Robot
from footfall.sim.raycast import RayScene
from footfall.telemetry.images import Camera, Snapshot
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
    points = np.stack([x, y, height_at(world, x, y) + LIFT], -1).reshape(-1, 3)
    body = [
        Mesh(frames.apply(true.T_site_base @ T_base_part, mesh.vertices), mesh.triangles)
        for mesh, T_base_part in robot_parts(robot, true.posture)
    ]
    scene = RayScene([triangulate(world), *body])
    seen = np.zeros(len(points), bool)
    for pair in snapshot.pairs:
        both = np.flatnonzero(np.isfinite(points[:, 2]) & ~seen)
        for camera in (pair.camera_left, pair.camera_right):
            both = both[_open_to(scene, points[both], camera, true.T_site_base)]
        seen[both] = True
    return seen.reshape(x.shape)


def _open_to(scene: RayScene, points: NDArray, camera: Camera, T_site_base: NDArray) -> NDArray[np.bool_]:
    T = T_site_base @ camera.T_base_camera
    p = (points - T[:3, 3]) @ T[:3, :3]
    ahead = p[:, 2] > 0.05
    z = np.where(ahead, p[:, 2], 1.0)
    u, v = camera.fx * p[:, 0] / z + camera.cx, camera.fy * p[:, 1] / z + camera.cy
    inside = ahead & (u >= 0) & (u <= camera.width - 1) & (v >= 0) & (v <= camera.height - 1)
    some = np.flatnonzero(inside)
    hits = scene.first_hits(T[:3, 3], points[some] - T[:3, 3])
    inside[some] = (hits.body < 0) | (hits.distance > 0.999)
    return inside
