"""How high the bodies of a legged robot are over the ground, all but what of them the feet stand on."""

from typing import NamedTuple

import numpy as np
import trimesh

from footfall.core.arrays import Array
from footfall.core.mesh import Mesh
from footfall.planning.legged.over_ground_kernel import lowest_of
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import Placed
from footfall.terrain.dem import Dem

NEAR_SOLE = 2.0
"""Clearances around a sole within which a body may be nearer to the ground: there the foot stands."""
FINEST = 0.005
"""Share of the longest leg that points are apart at least, whatever the clearance: samples of a motion are farther
apart, and at a millimetre a large robot's points fill the memory."""


class Lowest(NamedTuple):
    """height: least over all points [m], NaN over unknown ground; body: whose it is; place: (3,) in site [m]."""

    height: float
    body: int
    place: Array


class Surfaces:
    """Points all over the bodies' surfaces: every place is within a clearance of one, or FINEST where that is more."""

    def __init__(self, robot: LeggedRobot) -> None:
        self.clearance = robot.clearances["ground"]
        spacing = max(self.clearance, FINEST * robot.length, 1e-3)
        self._points = [
            np.concatenate([_points(mesh, spacing) for mesh in shapes]) if shapes else np.zeros((0, 3))
            for shapes in robot.shapes
        ]
        self._reach = np.array([np.linalg.norm(part, axis=1).max(initial=0.0) for part in self._points])
        self._leg_of = {}
        for leg in robot.legs:
            self._leg_of[robot.slices[leg].stop] = leg  # the last body of a leg bears its sole
        self._near = robot.radii + NEAR_SOLE * self.clearance

    def lowest(self, dem: Dem, placed: Placed, T_site_base: Array) -> Lowest:
        """The point that is lowest over the ground, of bodies that may come near it."""
        Ts = T_site_base @ placed.Ts_base_body
        soles = placed.soles @ T_site_base[:3, :3].T + T_site_base[:3, 3]
        highest = _highest_around(dem, Ts[:, :3, 3], self._reach)
        low = Ts[:, 2, 3] - self._reach - highest
        found = Lowest(np.inf, -1, np.full(3, np.nan))
        grid = np.array([dem.geometry.x0, dem.geometry.y0, dem.geometry.resolution])
        for body in np.argsort(low):
            if low[body] > min(found.height, 2 * self.clearance) or not len(self._points[body]):
                continue
            leg = self._leg_of.get(int(body))
            sole, near = (np.zeros(3), -1.0) if leg is None else (soles[leg], float(self._near[leg]))
            over, at = lowest_of(self._points[body], Ts[body], sole, near, dem.heights, grid, highest)
            if at >= 0 and not over >= found.height:
                place = Ts[body, :3, :3] @ self._points[body][at] + Ts[body, :3, 3]
                found = Lowest(over, int(body), place)
            if np.isnan(found.height):
                break
        return found


def _highest_around(dem: Dem, places: Array, reach: Array) -> float:
    """The highest known ground within the reach of any of the places (n, 3) [m]; −inf where none is known."""
    grid = dem.geometry
    low = (places[:, :2] - reach[:, None]).min(axis=0)
    high = (places[:, :2] + reach[:, None]).max(axis=0)
    first = np.floor((low - (grid.x0, grid.y0)) / grid.resolution).astype(int)
    last = np.ceil((high - (grid.x0, grid.y0)) / grid.resolution).astype(int) + 1
    around = dem.heights[max(first[1], 0) : max(last[1], 0), max(first[0], 0) : max(last[0], 0)]
    if not around.size or np.isnan(around).any() or (first < 0).any() or (last > (grid.cols, grid.rows)).any():
        return np.inf  # some of it is unknown: every point is asked
    return float(around.max())


def _points(mesh: Mesh, spacing: float) -> Array:
    """Points on a mesh's surface (n, 3), one in each cube of half of the spacing that it passes through."""
    divided = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.triangles, spacing, max_iter=20)
    points = np.asarray(divided[0], float)
    _, kept = np.unique(np.round(points / (0.5 * spacing)).astype(np.int64), axis=0, return_index=True)
    return points[np.sort(kept)]
