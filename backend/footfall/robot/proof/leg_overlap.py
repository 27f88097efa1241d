"""Postures of one leg that surely collide, told without meshes; what it does not tell is still open.

A collision is sure where two convex bodies share room: links, chassis and payload are convex, and no face normal nor
product of edges separates two that overlap (separating axis theorem; Gottschalk, Lin & Manocha, "OBBTree", 1996).
Ground is sure to be hit where a vertex of it is closer to a link than allowed, or the middle of a link lies under it.
Between bodies clearances are left out: those that overlap are closer than any δ. The answers are those of
:class:`~footfall.robot.meshes.collision.CollisionScene`, only fewer.
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, inverse, require_transform
from footfall.core.grid import GridGeometry
from footfall.core.mesh import Mesh
from footfall.robot.description import PARTS, link_name
from footfall.robot.kinematics import leg_link_poses
from footfall.robot.leg_frames import leg_lengths
from footfall.robot.meshes import shapes
from footfall.robot.meshes.bvh import PAYLOAD, robot_meshes
from footfall.robot.model import Robot
from footfall.robot.proof import overlap_kernel
from footfall.robot.proof.obstacles import CHASSIS, LEG, NOTHING
from footfall.robot.proof.obstacles import PAYLOAD as PAYLOAD_CODE
from footfall.robot.proof.overlap_kernel import Ground, OverlapPairs, Solids, WheelAndGround

_WHEEL_SIDES = 8
_ROUNDING = 1e-5
"""Distances to the ground this close to what is needed [m] are left to the meshes; above what the two computations may
differ by: vertices in whole nanometres, and a base whose axes are orthogonal to 1e-6 only (``require_transform``)."""
_SPACING = 0.02
"""Ground vertices are tried about this far apart [m]; fewer tell less, never something wrong."""


class LegOverlap:
    """One leg moves over ground; chassis, payload and the other legs are frozen at ``posture`` (legs × 6,) [rad].

    heights: (rows, cols) [m] on ``geometry``, NaN where there is no ground. clearance: added to every δ [m].
    raise_terrain [m]: for ground mode "raised".
    """

    def __init__(
        self,
        robot: Robot,
        posture: ArrayLike,
        leg: int,
        T_site_base: ArrayLike,
        heights: NDArray[np.float32],
        geometry: GridGeometry,
        clearance: float = 0.0,
        raise_terrain: float = 0.0,
    ) -> None:
        q = robot.require_posture(posture)
        leg = robot.require_leg(leg)
        if heights.shape != geometry.shape:
            raise InvalidInput(f"heights {heights.shape} do not fit their grid {geometry.shape}")
        description = robot.description
        spec = description.legs[leg]
        self._lengths = leg_lengths(spec)
        T_hip_base = inverse(spec.T_base_hip)
        T_site_hip = require_transform(T_site_base, "T_site_base") @ spec.T_base_hip
        meshes = robot_meshes(description)
        inner = math.cos(math.pi / description.wheel_sides)
        # eight corners on the circle inside the mesh's own polygon
        meshes["wheel"] = shapes.cylinder_y(description.wheel_radius * inner, description.wheel_width, _WHEEL_SIDES)
        moving = [meshes[part] for part in PARTS]
        frozen = [
            (CHASSIS, _moved(T_hip_base, meshes["base"]), [part in description.clearances.chassis for part in PARTS])
        ]
        if PAYLOAD in meshes:
            frozen.append((PAYLOAD_CODE, _moved(T_hip_base, meshes[PAYLOAD]), [True] * len(PARTS)))
        for other in robot.legs:
            if other != leg:
                poses = leg_link_poses(robot, q[6 * other : 6 * other + 6], other)
                for part in PARTS:
                    T = T_hip_base @ poses[link_name(other, part)]
                    frozen.append((LEG + other, _moved(T, meshes[part]), [True] * len(PARTS)))
        own = [(PARTS.index(pair.part_a), PARTS.index(pair.part_b)) for pair in description.clearances.own_leg]
        self._moving = _packed(moving)
        self._frozen = _packed([mesh for _, mesh, _ in frozen])
        self._pairs = OverlapPairs(
            np.array([code for code, _, _ in frozen], np.uint8),
            np.array([checked for _, _, checked in frozen], bool).T.copy(),
            np.array(own, np.int64).reshape(-1, 2),
        )
        self._ground = Ground(
            np.ascontiguousarray(heights, np.float32),
            geometry.x0,
            geometry.y0,
            geometry.resolution,
            max(1, int(_SPACING / geometry.resolution + 1e-9)),
            np.ascontiguousarray(T_site_hip),
        )
        sink = description.clearances.wheel_sink
        whole = description.wheel_radius * inner, description.wheel_width / 2
        touching = (
            (description.wheel_radius - sink) * inner - 2 * _ROUNDING,
            description.wheel_width / 2 - sink - 2 * _ROUNDING,
        )
        deltas = np.array([description.clearances.terrain[part] for part in PARTS]) + (clearance - _ROUNDING)
        touched = np.append(deltas[:-1], _ROUNDING)
        self._modes = {
            "true": WheelAndGround(0.0, *touching, touched),
            "raised": WheelAndGround(raise_terrain, *whole, deltas),
            "none": WheelAndGround(-np.inf, *whole, deltas),
        }

    def certain(self, qs: ArrayLike, terrain: str) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """For leg postures (n, 6) [rad] the link that surely hits, index into PARTS, and what it hits, (n,) each.

        Codes of what is hit: see :mod:`footfall.robot.proof.obstacles`; NOTHING where no collision is sure.
        """
        qs = np.array(qs, float, order="C")  # a copy: compiled code takes read-only arrays for another kind
        if qs.ndim != 2 or qs.shape[1] != 6:
            raise InvalidInput("leg postures need the shape (n, 6)", shape=list(qs.shape))
        if terrain not in self._modes:
            raise InvalidInput(f"terrain is one of {', '.join(self._modes)}", terrain=terrain)
        link, hit = np.zeros(len(qs), np.uint8), np.full(len(qs), NOTHING, np.uint8)
        overlap_kernel.overlaps(
            self._lengths, qs, self._moving, self._frozen, self._pairs, self._ground, self._modes[terrain], link, hit
        )
        return link, hit


def _moved(T: Array, mesh: Mesh) -> Mesh:
    return Mesh(apply(T, mesh.vertices), mesh.triangles)


def _packed(meshes: list[Mesh]) -> Solids:
    """Convex meshes as arrays of one size; short rows are filled with copies of their first entry."""
    vertices = [np.asarray(mesh.vertices) for mesh in meshes]
    normals, edges = zip(*(_directions(mesh) for mesh in meshes), strict=True)
    centers = np.array([v.mean(axis=0) for v in vertices])
    radii = np.array([np.linalg.norm(v - c, axis=1).max() for v, c in zip(vertices, centers, strict=True)])
    halves = np.array([_half_size(v, c) for v, c in zip(vertices, centers, strict=True)])
    return Solids(_padded(vertices), _padded(normals), _padded(edges), centers, radii, halves)


def _padded(rows: list[Array] | tuple[Array, ...]) -> Array:
    size = max(len(row) for row in rows)
    return np.array([np.concatenate([row, np.repeat(row[:1], size - len(row), axis=0)]) for row in rows])


def _half_size(vertices: Array, center: Array) -> Array:
    """Half edges of a box along the frame's axes, NaN for another shape."""
    half = np.abs(vertices - center)
    box = len(vertices) == 8 and np.ptp(half, axis=0).max() < 1e-9
    return half.max(axis=0) if box else np.full(3, np.nan)


def _directions(mesh: Mesh) -> tuple[Array, Array]:
    """Unit normals of the faces and directions of the edges between different faces, without parallels."""
    corners = mesh.vertices[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    faces: dict[tuple[int, int], list[int]] = {}
    for face, triangle in enumerate(mesh.triangles.tolist()):
        for a, b in zip(triangle, triangle[1:] + triangle[:1], strict=True):
            faces.setdefault((min(a, b), max(a, b)), []).append(face)
    sharp = [
        edge for edge, sides in faces.items() if len(sides) == 2 and normals[sides[0]] @ normals[sides[1]] < 1 - 1e-9
    ]
    along = np.array([mesh.vertices[b] - mesh.vertices[a] for a, b in sharp])
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return _without_parallels(normals), _without_parallels(along)


def _without_parallels(directions: Array) -> Array:
    kept: list[Array] = []
    for one in directions:
        if all(abs(one @ other) < 1 - 1e-9 for other in kept):
            kept.append(one)
    return np.array(kept)
