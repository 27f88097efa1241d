"""How near two things come to each other along sampled motions: conservative advancement over the samples.

No point of a body moves farther from one sample to the next than a corner of the box around it does, so a distance
measured at one sample bounds those of the following ones: samples that can't bring the least distance down are skipped
(Mirtich, "Impulse-based Dynamic Simulation of Rigid Body Systems", 1996). Near the least one every sample is measured.
"""

import itertools
from dataclasses import dataclass
from functools import cached_property

import coal
import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import inverse
from footfall.core.mesh import Mesh
from footfall.robot.meshes.bvh import bvh

CLOSE = 0.001
"""Within this of the least distance found, distances need not be measured, unless there is nothing to spare [m]."""
ARC = 1.01
"""Points move on arcs between samples; over any turn of a sample's length they are longer than chords by far less."""


@dataclass(frozen=True, eq=False)
class MovingBody:
    """A mesh that moves. corners: (8, 3) of the box around it; middle, radius: of the ball around that box's middle."""

    mesh: Mesh

    @cached_property
    def shape(self) -> coal.BVHModelOBBRSS:
        """The mesh as the collision library has it."""
        return bvh(self.mesh)

    @cached_property
    def corners(self) -> Array:
        """Corners (8, 3) of the box around the mesh, in its own frame [m]."""
        low, high = self.mesh.vertices.min(axis=0), self.mesh.vertices.max(axis=0)
        return np.array(list(itertools.product(*zip(low, high, strict=True))))

    @cached_property
    def middle(self) -> Array:
        """Middle (3,) of that box [m]."""
        return self.corners.mean(axis=0)

    @cached_property
    def radius(self) -> float:
        """Farthest that the mesh is from that middle [m]."""
        return float(np.linalg.norm(self.mesh.vertices - self.middle, axis=1).max())

    def places(self, Ts: Array) -> Array:
        """Corners (n, 8, 3) at poses (n, 4, 4)."""
        return np.einsum("nij,vj->nvi", Ts[:, :3, :3], self.corners) + Ts[:, None, :3, 3]


@dataclass(frozen=True)
class NearestSample:
    """spare: the least distance, less what is asked for [m]; at: of the samples."""

    spare: float
    at: int


def nearest(
    shape_a: coal.BVHModelOBBRSS,
    Ts_a: Array,
    body_b: MovingBody,
    Ts_b: Array,
    asked: float,
    bounds: Array,
    below: float,
) -> NearestSample | None:
    """The least spare distance of two things that move.

    What is found is at most CLOSE above the least, and both are above zero or none is. Ends at the first sample with
    nothing to spare.

    Args:
        shape_a: the one, as the collision library has it.
        Ts_a: its poses, (n, 4, 4).
        body_b: the other.
        Ts_b: its poses, (n, 4, 4).
        asked: the distance that they must keep [m].
        bounds: lower bounds of the spare distance, (n,) [m].
        below: only less counts [m].

    Returns:
        The sample where it is; None where it is not less than ``below``.
    """
    at = _next(bounds, 0, below)
    if at == len(bounds):
        return None
    places = body_b.places(inverse(Ts_a) @ Ts_b)
    steps = np.sqrt(np.square(np.diff(places, axis=0)).sum(axis=2).max(axis=1))
    way = ARC * np.concatenate([[0.0], np.cumsum(steps)])
    found = None
    while at < len(bounds):
        spare = distance(shape_a, Ts_a[at], body_b.shape, Ts_b[at]) - asked
        if spare < below:
            below, found = spare, NearestSample(spare, at)
            if spare <= 0:
                break
        free = spare - below + min(CLOSE, 0.5 * below)
        at = _next(bounds, max(at + 1, int(np.searchsorted(way, way[at] + free))), below)
    return found


def _next(bounds: Array, at: int, below: float) -> int:
    """The first sample from one on that may have less to spare; their number where none may."""
    may = bounds[at:] < below
    return at + int(np.argmax(may)) if may.any() else len(bounds)


def distance(a: coal.BVHModelOBBRSS, T_a: Array, b: coal.BVHModelOBBRSS, T_b: Array) -> float:
    """Distance of two surfaces.

    Args:
        a: the one, as the collision library has it.
        T_a: its pose, (4, 4).
        b: the other.
        T_b: its pose, (4, 4).

    Returns:
        [m], 0 where they meet.
    """
    poses = (coal.Transform3s(T[:3, :3], T[:3, 3]) for T in (T_a, T_b))
    return max(float(coal.distance(a, next(poses), b, next(poses), coal.DistanceRequest(), coal.DistanceResult())), 0.0)
