"""The tables of tether_kernel.py: a tether over some ground, the capsules of a robot's links, its chassis' hull."""

from functools import lru_cache

import numpy as np
from scipy.ndimage import maximum_filter
from scipy.spatial import ConvexHull

from footfall.balance.tether import Tether
from footfall.core.arrays import Array
from footfall.planning.scene.rover_tables import body_named
from footfall.planning.scene.tether_kernel import DECK, GROUND, REEL, TetherTables
from footfall.robot.description import PARTS
from footfall.robot.meshes.bvh import PAYLOAD, robot_meshes
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem


def tether_tables(robot: Robot, dem: Dem | None, tether: Tether | None, added: float = 0.0) -> TetherTables:
    """What ``tether_spare`` takes.

    Args:
        robot: the rover.
        dem: the ground without holes, in site; None: there is no tether.
        tether: that the rover hangs on; None: none.
        added: to its clearance [m].

    Returns:
        The tables, empty without a tether.
    """
    capsules, walls = link_capsules(robot), _walls(robot)
    if tether is None or dem is None:
        return TetherTables(np.empty((0, 9)), capsules, walls, np.empty((0, 0)), np.zeros(3))
    clearance, grid = tether.clearance + added, dem.geometry
    # a look is for the half step along the tether on each side of it, at a place up to half a cell beside the middle of
    # its cell; what the ground's triangles reach between cells is no higher than the highest of their corners
    around = int(np.ceil((clearance + 0.25 * grid.resolution) / grid.resolution + 0.71)) + 1
    steps = np.arange(-around, around + 1)
    disc = np.hypot(steps, steps[:, None]) <= around
    highest = maximum_filter(np.asarray(dem.heights, np.float64), footprint=disc, mode="nearest")
    return TetherTables(
        np.array([[*tether.anchor, *tether.attachment, clearance, tether.bare, tether.free_length]], float),
        capsules,
        walls,
        np.ascontiguousarray(highest),
        np.array([grid.x0, grid.y0, 1.0 / grid.resolution]),
    )


def beside_tether(code: int) -> str:
    """What the tether is too near to, in words."""
    return {GROUND: "the terrain", DECK: "the chassis", REEL: "the end of its drum"}.get(code) or body_named(code)


@lru_cache(maxsize=8)
def link_capsules(robot: Robot) -> Array:
    """Capsules around the parts of a leg, (7, 7): both ends in the part's frame, radius [m]."""
    meshes = robot_meshes(robot.description)
    return np.array([_capsule(np.asarray(meshes[part].vertices)) for part in PARTS])


def _capsule(vertices: Array) -> Array:
    """Around the middle of the box along the axis in which that is longest."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    axis, middle = int(np.argmax(high - low)), 0.5 * (low + high)
    across = np.delete(vertices - middle, axis, axis=1)
    radius = float(np.linalg.norm(across, axis=1).max())
    half = np.zeros(3)
    half[axis] = max(float(0.5 * (high - low)[axis]) - radius, 0.0)
    ends = middle - half, middle + half
    # the round ends may leave corners out
    along = np.abs(vertices[:, axis] - middle[axis]) - half[axis]
    reach = np.hypot(np.maximum(along, 0.0), np.linalg.norm(across, axis=1)).max()
    return np.array([*ends[0], *ends[1], reach])


@lru_cache(maxsize=8)
def _walls(robot: Robot) -> Array:
    """Planes (k, 4) of the hull of chassis and payload."""
    meshes = robot_meshes(robot.description)
    points = np.vstack([np.asarray(meshes[name].vertices) for name in ("base", PAYLOAD) if name in meshes])
    equations = ConvexHull(points).equations
    return np.column_stack([equations[:, :3], -equations[:, 3]])
