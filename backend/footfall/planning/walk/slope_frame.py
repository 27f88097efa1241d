"""A steep site, turned so that its slope is level: in that frame a rover on a tether walks as on even ground.

Frame ``slope``: origin that of the site, z along the normal of the plane through the ground on the way. What is planned
there is told in the site's frame; gravity leans instead (``BalanceSettings.slope``).
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from footfall.balance.tether import Tether
from footfall.core.arrays import Array
from footfall.core.frames import transform
from footfall.core.grid import GridGeometry
from footfall.core.mesh import Mesh
from footfall.planning.walk.problem import Place, Stance
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.ground.rasterise import rasterise
from footfall.terrain.ground.surface import height_at, normal_at
from footfall.terrain.ground.triangulate import triangulate

LEVEL = math.radians(15.0)
"""Ground that is less steep is not turned [rad]."""
FINENESS = 0.05
"""Cells of the turned ground are at most so large [m]."""
_LOOKED_AT = 4000
"""Places at which turned ground is compared with that of the site, at most."""
_LEAST_UP = 0.5
"""A site's triangle that leans more from the slope's normal than this cosine allows is not compared: it is a step."""
_BESIDE = 25.0
"""Ground so far beside all places that a walk is asked about is turned [m]: ways lead around up to 10 m beside."""


@dataclass(frozen=True, eq=False)
class SlopeFrame:
    """steep: of the slope [rad]; downhill: azimuth in site [rad]. dem: of the site."""

    steep: float
    downhill: float
    dem: Dem

    @cached_property
    def R_site_slope(self) -> Array:
        """Rotation (3, 3) that takes the slope's frame to the site."""
        c, s = math.cos(self.downhill), math.sin(self.downhill)
        turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        ct, st = math.cos(self.steep), math.sin(self.steep)
        return turned @ np.array([[ct, 0.0, st], [0.0, 1.0, 0.0], [-st, 0.0, ct]]) @ turned.T

    @property
    def uphill(self) -> float:
        """Azimuth in the slope's frame that rises against gravity [rad]."""
        return self.downhill + math.pi

    @cached_property
    def ground(self) -> Dem:
        """The ground in the slope's frame; what overhangs there is cut to its upper side."""
        if self.steep == 0.0:
            return self.dem
        mesh = triangulate(self.dem)
        turned = Mesh(np.ascontiguousarray(mesh.vertices @ self.R_site_slope), mesh.triangles)
        found = rasterise(turned, min(FINENESS, self.dem.geometry.resolution), self.dem.name)
        return Dem(found.heights, found.geometry, self.dem.name, self.dem.provenance)

    @cached_property
    def off(self) -> float:
        """How far the site's ground is above the turned one between its cells, at most of what is looked at [m]."""
        mesh = triangulate(self.dem)
        corners = mesh.vertices[mesh.triangles] @ self.R_site_slope
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        corners = corners[normals[:, 2] > _LEAST_UP * np.linalg.norm(normals, axis=1)]
        points = np.concatenate([corners.mean(axis=1), corners[:, 0], corners[:, :2].mean(axis=1)])
        points = points[:: max(1, len(points) // _LOOKED_AT)]
        above = points[:, 2] - height_at(self.ground, points[:, 0], points[:, 1])
        above = above[np.isfinite(above)]
        return max(float(above.max()), 0.0) if len(above) else 0.0

    def to_slope(self, points: Array) -> Array:
        """Points or directions (…, 3) of the site in the slope's frame."""
        return points @ self.R_site_slope

    def to_site(self, points: Array) -> Array:
        """Points or directions (…, 3) of the slope's frame in the site."""
        return points @ self.R_site_slope.T

    def poses_to_slope(self, Ts: Array) -> Array:
        """Poses (n, 4, 4) of the site as the slope's frame has them."""
        return transform(self.R_site_slope.T) @ Ts

    def poses_to_site(self, Ts: Array) -> Array:
        """Poses (n, 4, 4) of the slope's frame as the site has them."""
        return transform(self.R_site_slope) @ Ts

    def seated(self, contacts: Array, radius: float) -> tuple[Array, Array]:
        """Contacts and normals (n, 3) on the site's ground above or below contacts (n, 3), in the slope's frame both.

        radius: of the wheel, under which normals are those of the fitted plane [m].
        """
        x, y, _ = self.to_site(contacts).T
        points = np.column_stack([x, y, height_at(self.dem, x, y)])
        return self.to_slope(points), self.to_slope(normal_at(self.dem, x, y, radius))

    def tether(self, tether: Tether) -> Tether:
        """The tether with its anchor in the slope's frame."""
        return replace(tether, anchor=self.to_slope(tether.anchor))

    def state(self, state: RobotState) -> RobotState:
        """The state in the slope's frame."""
        forces = self.to_slope(np.asarray(state.wheel_forces))
        return replace(state, T_site_base=self.poses_to_slope(np.asarray(state.T_site_base)), wheel_forces=forces)

    def stance(self, stance: Stance, site: bool) -> Stance:
        """A stance of the slope's frame in the site (True), or the other way."""
        turn, poses = (self.to_site, self.poses_to_site) if site else (self.to_slope, self.poses_to_slope)
        return Stance(
            turn(np.asarray(stance.contacts)),
            turn(np.asarray(stance.normals)),
            poses(np.asarray(stance.Ts_site_wheel)),
            np.array(stance.branches),
        )

    def on_slope(self, x: float, y: float, above: float) -> Array:
        """The point (3,) in the slope's frame that is (x, y) in site and ``above`` the ground along the slope's normal.

        NaN where the ground is unknown.
        """
        up = self.R_site_slope[:, 2]
        foot = np.array([x, y]) - above * up[:2]
        z = float(height_at(self.dem, foot[0], foot[1]))
        return self.to_slope(np.array([*foot, z]) + above * up)

    def place(self, place: Place) -> Place:
        """A place on the ground, in the slope's frame."""
        z = float(height_at(self.dem, place.x, place.y))
        x, y, _ = self.to_slope(np.array([place.x, place.y, z]))
        return replace(place, x=float(x), y=float(y))


def slope_between(dem: Dem, here: Array, there: Array, around: float, anchor: Array) -> SlopeFrame:
    """The frame of the plane through the ground between two places, by least squares.

    It is that of the site where the plane is nearly level. Of a map that is larger by far only what lies between the
    two and the anchor is turned.

    Args:
        dem: the ground, in site.
        here: (2,) in site [m].
        there: (2,) in site [m].
        around: ground so far around counts too [m].
        anchor: of the tether, (2,) or (3,) in site [m].

    Returns:
        The frame.
    """
    places = np.array([here, there, anchor[:2]])
    dem = _between(dem, places.min(axis=0) - _BESIDE, places.max(axis=0) + _BESIDE)
    grid = dem.geometry
    low, high = np.minimum(here, there) - around, np.maximum(here, there) + around
    x, y = np.meshgrid(grid.xs, grid.ys)
    inside = (x >= low[0]) & (x <= high[0]) & (y >= low[1]) & (y <= high[1]) & np.isfinite(dem.heights)
    if inside.sum() < 3:
        return SlopeFrame(0.0, 0.0, dem)
    columns = np.column_stack([x[inside], y[inside], np.ones(int(inside.sum()))])
    (east, north, _), *_ = np.linalg.lstsq(columns, dem.heights[inside].astype(float), rcond=None)
    steep = math.atan(math.hypot(east, north))
    return SlopeFrame(steep, math.atan2(-north, -east), dem) if steep > LEVEL else SlopeFrame(0.0, 0.0, dem)


def _between(dem: Dem, low: Array, high: Array) -> Dem:
    """The ground between two corners (2,) [m]; all of it where it lies between them, or nothing known does."""
    grid = dem.geometry
    row, col = (np.flatnonzero((at >= low[axis]) & (at <= high[axis])) for at, axis in ((grid.ys, 1), (grid.xs, 0)))
    if (len(row), len(col)) == grid.shape or not len(row) or not len(col):
        return dem
    heights = dem.heights[row[0] : row[-1] + 1, col[0] : col[-1] + 1]
    if not np.isfinite(heights).any():
        return dem
    part = GridGeometry(float(grid.xs[col[0]]), float(grid.ys[row[0]]), grid.resolution, len(row), len(col))
    return Dem(heights.copy(), part, dem.name, dem.provenance)
