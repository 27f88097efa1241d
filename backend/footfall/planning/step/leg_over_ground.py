"""The moving leg against the ground, exactly: triangles against triangles, and what is below the surface.

The ground is looked at twice, as a mesh is a surface: triangles against triangles, and every vertex of a link against
the height of the ground there. Only those tiles of the ground take part whose box comes within the clearance of the
box around a link.
"""

from collections.abc import Iterator

import coal
import numpy as np

from footfall.core.frames import transform
from footfall.core.mesh import Mesh
from footfall.planning.step.edges import Array
from footfall.planning.step.ground import Nearby
from footfall.planning.step.solids import Gap, Solid, distance, part_poses, solid, touch
from footfall.robot.collision import TERRAIN, Collision
from footfall.robot.description import PARTS, RobotDescription, link_name
from footfall.robot.model import Robot
from footfall.terrain.surface import height_at

_ROUNDING = 1e-6
"""Tiles this much farther than allowed are still looked at [m]."""


class LegOverGround:
    """One leg over the ground around it; the chassis stays. clearance: added to every δ to the ground [m]."""

    def __init__(self, robot: Robot, leg: int, T_site_base: Array, ground: Nearby, clearance: float) -> None:
        self._robot, self._leg, self._clearance, self._ground = robot, leg, clearance, ground
        self._T_site_base = T_site_base
        self._names = {part: link_name(leg, part) for part in PARTS}
        self._moving = {part: solid(robot.description.meshes[name]) for part, name in self._names.items()}
        self._touching = solid(_sunk_wheel(robot.description, leg))

    def collision(self, qs: Array, raise_terrain: float, touching: bool) -> tuple[int, str] | None:
        """The first of n postures in which a link is too close to the ground raised by so much [m], and which.

        touching: the wheel may touch the ground, and be in it by what it can sink.
        """
        first: tuple[int, str] | None = None
        for part, body, Ts, delta in self._links(qs, touching):
            spare = self._spare(body, Ts, raise_terrain, delta)
            for at in np.flatnonzero(spare.min(axis=1) <= 0):
                if first is not None and at >= first[0]:
                    break
                if any(
                    self._touches(body, Ts[at], int(t), raise_terrain, delta) for t in np.flatnonzero(spare[at] <= 0)
                ):
                    first = int(at), f"{self._names[part]} is too close to the terrain"
            depth = self._depth(body.vertices, Ts, raise_terrain).max(axis=1)
            under = np.flatnonzero(depth > 0)
            if len(under) and (first is None or under[0] < first[0]):
                first = int(under[0]), f"{self._names[part]} is {depth[under[0]]:.3f} m under the terrain"
        return first

    def gap(self, qs: Array, raise_terrain: float, touching: bool, below: float = np.inf) -> tuple[int, Gap]:
        """The least spare distance of a link to the ground, exact under ``below``; the touching wheel is left out."""
        links = [one for one in self._links(qs, touching) if one[1] is not self._touching]
        spare = np.stack([self._spare(body, Ts, raise_terrain, delta) for _, body, Ts, delta in links])
        worst, least = 0, Gap(below, "")
        while spare.flat[index := int(np.argmin(spare))] < least.spare:
            spare.flat[index] = np.inf
            link, at, tile = np.unravel_index(index, spare.shape)
            part, body, Ts, delta = links[link]
            shape, T_site_tile = self._tile(int(tile), raise_terrain)
            found = distance(body.shape, Ts[at], shape, T_site_tile, least.spare + delta) - delta
            if found < least.spare:
                worst, least = int(at), Gap(found, f"{self._names[part]} and the terrain")
        return worst, least

    def contacts(self, q: Array, raise_terrain: float, touching: bool) -> list[Collision]:
        """Every link that is too close to the ground at q (6,), or in it, with sizes for reports."""
        found = []
        for part, body, Ts, delta in self._links(q[None], touching):
            tiles = np.flatnonzero(self._spare(body, Ts, raise_terrain, delta)[0] <= 0)
            near = [int(t) for t in tiles if self._touches(body, Ts[0], int(t), raise_terrain, delta)]
            if near:
                away = min(self._distance(body, Ts[0], t, raise_terrain) for t in near)
                found.append(Collision(self._names[part], TERRAIN, delta, away))
            middle = self._moving[part].vertices.mean(axis=0)
            depth = float(self._depth(middle[None], Ts, raise_terrain)[0, 0])
            if 0 < depth < np.inf:
                found.append(Collision(self._names[part], TERRAIN, 0.0, -depth))
        return found

    def _spare(self, body: Solid, Ts: Array, raise_terrain: float, delta: float) -> Array:
        """Lower bounds of what a link's distance to each tile is above δ, (n, tiles) [m]."""
        low, high = body.boxes(Ts)
        lift = (0.0, 0.0, raise_terrain)
        return self._ground.tiles.distances(low - lift, high - lift) - (delta + _ROUNDING)

    def _tile(self, tile: int, raise_terrain: float) -> tuple[coal.BVHModelOBBRSS, Array]:
        shape, T_site_tile = self._ground.tiles.shape(tile)
        return shape, transform(translation=(0.0, 0.0, raise_terrain)) @ T_site_tile

    def _touches(self, body: Solid, T: Array, tile: int, raise_terrain: float, delta: float) -> bool:
        return touch(body.shape, T, *self._tile(tile, raise_terrain), delta)

    def _distance(self, body: Solid, T: Array, tile: int, raise_terrain: float) -> float:
        return distance(body.shape, T, *self._tile(tile, raise_terrain), np.inf)

    def _depth(self, points: Array, Ts: Array, raise_terrain: float) -> Array:
        """How far points (v, 3) of a link are under the raised ground, (n, v) [m]; +inf where none was prepared."""
        placed = points @ np.swapaxes(Ts[:, :3, :3], 1, 2) + Ts[:, None, :3, 3]
        ground = height_at(self._ground.dem, placed[..., 0], placed[..., 1]) + raise_terrain
        return np.nan_to_num(ground - placed[..., 2], nan=np.inf)

    def _links(self, qs: Array, touching: bool) -> Iterator[tuple[str, Solid, Array, float]]:
        """Part, shape, T_site_link (n, 4, 4) and required distance."""
        poses = part_poses(self._robot, self._leg, qs)
        deltas = self._robot.description.clearances.terrain
        for part in PARTS:
            Ts = self._T_site_base @ poses[part]
            if touching and part == "wheel":
                yield part, self._touching, Ts, 0.0
            else:
                yield part, self._moving[part], Ts, deltas[part] + self._clearance


def _sunk_wheel(description: RobotDescription, leg: int) -> Mesh:
    """The wheel's mesh smaller by the allowed sinkage all round (axle along y)."""
    mesh, sink = description.meshes[link_name(leg, "wheel")], description.clearances.wheel_sink
    radial = 1.0 - sink / description.wheel_radius
    return Mesh(mesh.vertices * (radial, 1.0 - 2.0 * sink / description.wheel_width, radial), mesh.triangles)
