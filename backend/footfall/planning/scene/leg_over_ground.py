"""The moving leg against the ground, exactly: triangles against triangles, and what is below the surface.

The ground is looked at twice, as a mesh is a surface: triangles against triangles, and every vertex of a link against
the height of the ground there. Only those tiles of the ground take part whose box comes within the clearance of the
box around a link.
"""

from collections.abc import Iterator

import coal
import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import transform
from footfall.core.mesh import Mesh
from footfall.planning.scene.ground import Nearby
from footfall.planning.scene.ground_nearness_kernel import RaisedGround, ground_bounds, ground_depths
from footfall.planning.scene.solids import (
    TOLERANCE,
    Gap,
    Solid,
    distance,
    leg_poses,
    measured,
    part_poses,
    solid,
    touch,
)
from footfall.robot.description import PARTS, RobotDescription, link_name
from footfall.robot.meshes.collision import TERRAIN, Collision
from footfall.robot.model import Robot
from footfall.robot.proof.shells import FIRST, LAST, point_shells
from footfall.terrain.ground.surface import height_at

_ROUNDING = 1e-6
"""Tiles this much farther than allowed are still looked at [m]."""


class LegOverGround:
    """One leg over the ground around it; the chassis stays. clearance: added to every δ to the ground [m]."""

    def __init__(self, robot: Robot, leg: int, T_site_base: Array, ground: Nearby, clearance: float) -> None:
        self._robot, self._leg, self._clearance, self._ground = robot, leg, clearance, ground
        self._T_site_base = T_site_base
        self._names = {part: link_name(leg, part) for part in PARTS}
        self._moving = {part: solid(robot.description.meshes[name]) for part, name in self._names.items()}
        links, sunk = (
            [robot.description.meshes[name] for name in self._names.values()],
            _sunk_wheel(robot.description, leg),
        )
        self._touching = solid(sunk)
        # by whether the wheel touches
        self._shells = with_ground(links), with_ground([*links[:-1], sunk])

    def collision(self, qs: Array, raise_terrain: float, touching: bool, more: float = 0.0) -> tuple[int, str] | None:
        """The first of n postures (n, 6) in which a link is too close to the ground raised by so much [m], and which.

        touching: the wheel may touch the ground, and be in it by what it can sink. more: asked beyond every δ [m].
        """
        poses, deltas = self._poses(qs), self._deltas(touching) + more
        shells = self._shells[touching]
        depths = ground_depths(*shells, poses, self._raised(raise_terrain))
        *_, bounds = self._bounds(poses, deltas, raise_terrain, shells, 0.0, nearest=False)
        near = bounds <= _ROUNDING
        bodies = [self._moving[part] for part in PARTS[:-1]] + [self._touching if touching else self._moving["wheel"]]
        for at in np.flatnonzero(near.any(axis=(1, 2)) | (depths > 0).any(axis=1)):
            for link, (part, body) in enumerate(zip(PARTS, bodies, strict=True)):
                T, delta = poses[at, link], float(deltas[link])
                if any(self._touches(body, T, int(t), raise_terrain, delta) for t in np.flatnonzero(near[at, link])):
                    return int(at), f"{self._names[part]} is too close to the terrain"
                if depths[at, link] > 0:
                    return int(at), f"{self._names[part]} is {depths[at, link]:z.3f} m under the terrain"
        return None

    def gap(self, qs: Array, raise_terrain: float, touching: bool, below: float = np.inf) -> tuple[int, Gap]:
        """The least spare distance of a link to the ground [m], exact under ``below``; the touching wheel is left out.

        qs: (n, 6). With it comes the number of the posture that has it.
        Exact to ``TOLERANCE``: a link's point over the ground is a distance that exists, and only what is not proven
        to be farther than the least known is measured.
        """
        parts = PARTS[:-1] if touching else PARTS
        poses, deltas = self._poses(qs)[:, : len(parts)], self._deltas(touching)[: len(parts)]
        spare, worst, link, bounds = self._bounds(
            poses, deltas, raise_terrain, self._shells[touching], below, nearest=True
        )
        least = Gap(spare, "" if link < 0 else self._between(parts[link]))
        while bounds.flat[index := int(np.argmin(bounds))] < least.spare - TOLERANCE:
            at, link, tile = (int(one) for one in np.unravel_index(index, bounds.shape))
            shape, T_site_tile = self._tile(tile, raise_terrain)
            body, bound = self._moving[parts[link]].shape, float(bounds.flat[index])
            found = measured(body, poses[at, link], shape, T_site_tile, float(deltas[link]), bound, least.spare)
            bounds.flat[index] = np.inf
            if found < least.spare:
                worst, least = at, Gap(found, self._between(parts[link]))
        return max(worst, 0), least

    def _poses(self, qs: Array) -> Array:
        """T_site_link (n, 7, 4, 4)."""
        return self._T_site_base @ leg_poses(self._robot, self._leg, qs)

    def _deltas(self, touching: bool) -> Array:
        """Required distances of the parts (7,) [m]."""
        deltas = self._robot.description.clearances.terrain
        out = np.array([deltas[part] for part in PARTS]) + self._clearance
        if touching:
            out[-1] = 0.0
        return out

    def _bounds(
        self, poses: Array, deltas: Array, lift: float, shells: tuple[Array, Array], below: float, nearest: bool
    ) -> tuple[float, int, int, Array]:
        tiles = self._ground.tiles
        poses = np.ascontiguousarray(poses)
        return ground_bounds(*shells, poses, deltas, self._raised(lift), tiles.boxes, tiles.windows, below, nearest)

    def _raised(self, lift: float) -> RaisedGround:
        tiles = self._ground.tiles
        return RaisedGround(tiles.heights, tiles.corner, tiles.resolution, lift)

    def _between(self, part: str) -> str:
        return f"{self._names[part]} and the terrain"

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


def with_ground(links: list[Mesh]) -> tuple[Array, Array]:
    """Shells of links, and two more that stand for a box and a triangle of ground in turn.

    The table (links + 2, columns) and the points (n, 3) of :func:`~footfall.robot.proof.shells.point_shells`.
    """
    table, points = point_shells(links)
    more = np.zeros((2, table.shape[1]))
    more[:, FIRST] = len(points), len(points) + 1
    more[:, LAST] = len(points) + 1, len(points) + 4
    return np.concatenate([table, more]), np.concatenate([points, np.zeros((4, 3))])


def _sunk_wheel(description: RobotDescription, leg: int) -> Mesh:
    """The wheel's mesh smaller by the allowed sinkage all round (axle along y)."""
    mesh, sink = description.meshes[link_name(leg, "wheel")], description.clearances.wheel_sink
    radial = 1.0 - sink / description.wheel_radius
    return Mesh(mesh.vertices * (radial, 1.0 - 2.0 * sink / description.wheel_width, radial), mesh.triangles)
