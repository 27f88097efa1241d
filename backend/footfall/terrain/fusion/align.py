"""Fit of new points to the map: the small rigid motion that lays them onto its surface.

Point-to-plane registration (Y. Chen, G. Medioni, "Object modelling by registration of multiple range images", 1992)
with the plane taken straight below each point, as for range images (S. Rusinkiewicz, M. Levoy, "Efficient variants
of the ICP algorithm", 2001). The expected error of the pose is a prior: what the ground does not tell, such as the
position on a plane, stays as it was.
"""

import math

import cv2
import numpy as np

from footfall.core import frames
from footfall.core.arrays import Array
from footfall.core.errors import InvalidImages
from footfall.core.value import Value, value
from footfall.terrain.dem import Dem
from footfall.terrain.terrain_settings import TerrainSettings

MIN_POINTS = 500
"""With fewer points over known map there is nothing to fit to."""

FARTHEST = 0.3
"""Points further than this above or below the map [m] belong to something else."""

MIN_AGREEING = 0.5
"""A fit leaves at least this share of the points within the gate of the map, or the ground is another one."""

SURPRISING = 2.5
"""A fit that moves the chassis by more of its expected deviations than this is believed only where it is CLEARLY so."""

CLEARLY = 0.2
"""The least share by which such a fit must lessen the points' robust cost: on ground that is almost flat its ripples
lead a fit 0.1 m astray, which lessens it by a twentieth."""

_INDEPENDENT = 0.1
"""Errors of neighbouring pixels are one error: this many independent measurements per point."""

_ROBUST = 2.0
_ROUNDS = 25
_DONE = 1e-6


@value
class Alignment(Value):
    """How new points were moved onto the map: p_map = correction @ p_site.

    shift: of the chassis [m]; turn: [rad]. points: how many had known map below them.
    before, after: median distance of those from the map [m]; 0 where there were too few, and nothing was moved.
    """

    correction: Array
    shift: float
    turn: float
    points: int
    before: float
    after: float

    @property
    def text(self) -> str:
        """For a person."""
        if self.points < MIN_POINTS:
            return "not aligned: too little common ground"
        return f"moved {1e3 * self.shift:z.0f} mm, {math.degrees(self.turn):z.2f}° onto the map"


def align(
    map: Dem, points: Array, deviation: Array, center: Array, settings: TerrainSettings | None = None
) -> Alignment:
    """Fit points to a map.

    Deterministic: the correction is rounded to 1 µm and 0.1 µrad, so that neither processor nor number of threads
    shows.

    Args:
        map: the ground so far, in site.
        points: (n, 3) in site [m].
        deviation: (n,) standard deviation of each [m].
        center: (3,) where the chassis stood, about which the points turn, in site [m].
        settings: how far they may move; None: as delivered.

    Returns:
        How the points have to be moved, and how well they fit then.

    Raises:
        InvalidImages: the fit is beyond ``max_shift`` or ``max_turn``, or leaves more than half of the points off the
            map.
    """
    settings = settings or TerrainSettings()
    surface = _Surface(map)
    shift, angles = np.zeros(3), np.zeros(3)
    arms = points - center
    off = surface.distance(points)[0]
    known = int(np.isfinite(off).sum())
    if known < MIN_POINTS:
        return Alignment(np.eye(4), 0.0, 0.0, known, 0.0, 0.0)
    before = float(np.nanmedian(np.abs(off)))
    prior = 1.0 / np.repeat([settings.pose_shift, settings.pose_turn], 3) ** 2
    for _ in range(_ROUNDS):
        turned = _product(frames.rotation_rpy(*angles), arms)
        distance, normal = surface.distance(turned + center + shift)
        use = np.flatnonzero(np.abs(distance) < FARTHEST)
        r, n, q, s = distance[use], normal[use], turned[use], deviation[use]
        J = np.concatenate([n, np.cross(q, n)], axis=1)
        # Cauchy weights; the scale shrinks with the fit, so that a tilted start does not look like outliers
        scale = np.maximum(s, 1.4826 * float(np.median(np.abs(r))) if len(r) else 1.0)
        weight = _INDEPENDENT / (scale**2 * (1.0 + (r / (_ROBUST * scale)) ** 2))
        A = np.einsum("ni,n,nj->ij", J, weight, J, optimize=False) + np.diag(prior)
        b = np.einsum("ni,n,n->i", J, weight, r, optimize=False) + prior * np.concatenate([shift, angles])
        step = np.linalg.solve(A, b)
        shift, angles = shift - step[:3], angles - step[3:]
        if np.abs(step).max() < _DONE:
            break
    shift, angles = np.round(shift, 6), np.round(angles, 7)
    R = frames.rotation_rpy(*angles)
    correction = frames.transform(R, center + shift - R @ center)
    there = surface.distance(_product(R, arms) + center + shift)[0]
    if np.linalg.norm(shift) > SURPRISING * settings.pose_shift and not _clearly_nearer(off, there, deviation):
        return Alignment(np.eye(4), 0.0, 0.0, known, before, before)
    left = np.abs(there[np.isfinite(there)])
    turn = float(2.0 * np.arcsin(min(1.0, np.linalg.norm(R - np.eye(3)) / math.sqrt(8.0))))
    found = Alignment(correction, float(np.linalg.norm(shift)), turn, known, before, float(np.median(left)))
    _accept(found, float((left <= settings.gate).mean()), settings)
    return found


def _clearly_nearer(before: Array, after: Array, deviation: Array) -> bool:
    """Whether points that are ``before`` and ``after`` (n,) [m] from the map clearly fit it better.

    NaN where it is unknown. By their robust cost, at the scale that they have at first.
    """
    both = np.isfinite(before) & np.isfinite(after)
    both[both] = (np.abs(before[both]) < FARTHEST) & (np.abs(after[both]) < FARTHEST)
    scale = np.maximum(deviation[both], 1.4826 * float(np.median(np.abs(before[both]))))
    first, last = (float(np.log1p((r[both] / (_ROBUST * scale)) ** 2).sum()) for r in (before, after))
    return last <= (1.0 - CLEARLY) * first


def _accept(found: Alignment, agreeing: float, settings: TerrainSettings) -> None:
    if found.shift > settings.max_shift or found.turn > settings.max_turn:
        raise InvalidImages(
            f"the images fit the map only when moved by {found.shift:z.2f} m and {math.degrees(found.turn):z.1f}°; "
            f"at most {settings.max_shift:g} m and {math.degrees(settings.max_turn):z.1f}° are believed. "
            "Check the rover's pose and the cameras' calibration (principal points, doffs), or start a new map "
            "(keep = false)",
            shift=found.shift,
            turn=found.turn,
        )
    if agreeing < MIN_AGREEING:
        raise InvalidImages(
            f"only {agreeing:.0%} of the points lie within {settings.gate:g} m of the map, wherever it is moved; the "
            "pose or the calibration (principal points, doffs) may be wrong, or the ground changed. Check these, or "
            "start a new map (keep = false)",
            agreeing=agreeing,
            after=found.after,
        )


class _Surface:
    """Heights and slopes of a map between its cells, by bilinear interpolation."""

    def __init__(self, map: Dem) -> None:
        self._grid = map.geometry
        self._heights = map.heights.astype(np.float64)
        known = np.isfinite(self._heights)
        share = cv2.blur(known.astype(np.float64), (3, 3))
        smooth = cv2.blur(np.where(known, self._heights, 0.0), (3, 3)) / np.where(share > 0, share, 1.0)
        smooth[~known] = np.nan
        self._north, self._east = np.full(known.shape, np.nan), np.full(known.shape, np.nan)
        if min(known.shape) > 2:
            self._north[1:-1] = (smooth[2:] - smooth[:-2]) / (2.0 * self._grid.resolution)
            self._east[:, 1:-1] = (smooth[:, 2:] - smooth[:, :-2]) / (2.0 * self._grid.resolution)

    def distance(self, points: Array) -> tuple[Array, Array]:
        """Signed distances (n,) to the plane below each point, NaN where unknown, and its normals (n, 3)."""
        grid = self._grid
        u = (points[:, 0] - grid.x0) / grid.resolution
        v = (points[:, 1] - grid.y0) / grid.resolution
        inside = (u >= 0) & (v >= 0) & (u < grid.cols - 1) & (v < grid.rows - 1)
        at = np.flatnonzero(inside)
        col, row = np.floor(u[at]).astype(np.int64), np.floor(v[at]).astype(np.int64)
        e, f = u[at] - col, v[at] - row
        distance, normal = np.full(len(points), np.nan), np.full((len(points), 3), np.nan)

        def between(layer: Array) -> Array:
            return (1 - f) * ((1 - e) * layer[row, col] + e * layer[row, col + 1]) + f * (
                (1 - e) * layer[row + 1, col] + e * layer[row + 1, col + 1]
            )

        east, north = between(self._east), between(self._north)
        length = np.sqrt(1.0 + east**2 + north**2)
        distance[at] = (points[at, 2] - between(self._heights)) / length
        normal[at] = np.stack([-east / length, -north / length, 1.0 / length], axis=1)
        return distance, normal


def _product(R: Array, points: Array) -> Array:
    """R p for each of (n, 3); written out, so that the result does not depend on the number of threads."""
    x, y, z = points.T
    return np.stack([R[i, 0] * x + R[i, 1] * y + R[i, 2] * z for i in range(3)], axis=1)
