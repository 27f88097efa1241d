"""Of the ground, the triangles that can matter to the rover's links at one posture: those beside and above them.

A hierarchy of all the ground in reach takes up to a second to build and is used for one question. Ground that lies
lower than a link by more than it must keep from it, or beside its box, neither touches it nor is above it.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.core.grid import GridGeometry
from footfall.core.mesh import Mesh
from footfall.core.value import Provenance
from footfall.robot.description import PARTS, link_name
from footfall.robot.kinematics import link_poses
from footfall.robot.meshes.bvh import PAYLOAD, robot_meshes
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem
from footfall.terrain.ground.triangulate import triangulate

_ROUNDING = 1e-4
"""Added to what links must keep from the ground [m]; float32 heights and the boxes' corners are rounded by less."""


def ground_near_links(robot: Robot, dem: Dem, posture: ArrayLike, T_site_base: Array) -> Mesh:
    """The triangles of the ground for which :func:`posture_collisions` answers as for all of them.

    Args:
        robot: the rover.
        dem: the ground, in site.
        posture: joint angles, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).

    Returns:
        Those triangles.
    """
    deltas = robot.description.clearances
    keep = max([*deltas.terrain.values(), deltas.chassis_terrain, 0.0]) + _ROUNDING
    low, high = _boxes(robot, posture, T_site_base)
    low, high = low - keep, high + keep
    grid = dem.geometry
    first, last = _cells(grid, low.min(axis=0), high.max(axis=0))
    heights = dem.heights[first[0] : last[0] + 1, first[1] : last[1] + 1]
    window = GridGeometry(
        grid.x0 + first[1] * grid.resolution, grid.y0 + first[0] * grid.resolution, grid.resolution, *heights.shape
    )
    # a block that holds an unknown cell is a hole: its highest is NaN, which is above no box
    rows = np.maximum(heights[:-1], heights[1:])
    tops = np.maximum(rows[:, :-1], rows[:, 1:])
    used = np.zeros(heights.shape, bool)
    for bottom, top in zip(low, high, strict=True):
        (r0, c0), (r1, c1) = _cells(window, bottom, top)
        blocks = tops[r0:r1, c0:c1] >= bottom[2]
        for dr, dc in ((0, 0), (0, 1), (1, 0), (1, 1)):
            used[r0 + dr : r1 + dr, c0 + dc : c1 + dc] |= blocks
    if not used.any():
        return Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    return triangulate(Dem(np.where(used, heights, np.nan).astype(np.float32), window, dem.name, Provenance({})))


def _boxes(robot: Robot, posture: ArrayLike, T_site_base: Array) -> tuple[Array, Array]:
    """Lowest and highest corner (n, 3) of each link and of what the chassis carries, in site [m]."""
    meshes, poses = robot_meshes(robot.description), link_poses(robot, posture)
    placed = [(meshes[part], poses[link_name(leg, part)]) for leg in robot.legs for part in PARTS]
    placed += [(meshes[part], np.eye(4)) for part in ("base", PAYLOAD) if part in meshes]
    corners = [apply(T_site_base @ T_base_link, mesh.vertices) for mesh, T_base_link in placed]
    return np.array([c.min(axis=0) for c in corners]), np.array([c.max(axis=0) for c in corners])


def _cells(grid: GridGeometry, low: Array, high: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First and last (row, column) of the cells whose blocks come into a rectangle, one more against rounding."""
    origin, end = np.array([grid.y0, grid.x0]), np.array(grid.shape) - 1
    first = np.floor((low[[1, 0]] - origin) / grid.resolution).astype(np.int64) - 1
    last = np.ceil((high[[1, 0]] - origin) / grid.resolution).astype(np.int64) + 1
    return np.clip(first, 0, end), np.clip(last, 0, end)
