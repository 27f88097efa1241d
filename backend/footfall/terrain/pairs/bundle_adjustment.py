"""Joint refinement of all pairs of a snapshot, for offline use: how each right camera and each pair is really turned.

Bundle adjustment (B. Triggs, P. McLauchlan, R. Hartley, A. Fitzgibbon, "Bundle adjustment: a modern synthesis", Vision
Algorithms, 2000) with rotations only: where the cameras sit is known to a millimetre, how they are turned is what
shifts. Unknown are

* of each pair, the turn of its right camera, as in :mod:`footfall.terrain.pairs.epipolar`;
* of each pair but the reference, its turn as a whole about its left camera's centre;
* the points that two pairs see.

Each pair's own matches must lie in one row; each common point must be seen where it is in all four images. Errors are
pixels, with a robust loss, so that a wrong match counts little; weak priors hold what the images don't tell.

Common points are found without regard to how either camera looks at them: the ground about a point is taken to be level
and resampled from above in both images, then compared by normalised cross-correlation.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.sparse import coo_array, csr_array
from scipy.sparse.linalg import splu
from scipy.spatial.transform import Rotation

from footfall.core import frames
from footfall.core.arrays import Array
from footfall.core.errors import InvalidImages
from footfall.core.progress import Progress, no_progress
from footfall.core.value import Value, value
from footfall.telemetry.images import Camera, ImagePair
from footfall.telemetry.projection import sight
from footfall.terrain.pairs.epipolar import estimate_rotation, turn_right_image
from footfall.terrain.pairs.point_matches import matches
from footfall.terrain.pairs.stereo import require_rectified

EXPECTED_RIGHT, EXPECTED_PAIR = np.deg2rad(0.3), np.deg2rad(0.5)
"""Priors: deviations of a right camera's and of a pair's turn [rad]."""

CANDIDATES, COMMON_POINTS = 300, 150
"""Matches of one pair that are looked for in another, and points common to two pairs that are used, at most."""
FEWEST_COMMON = 15
"""Fewer common points of two pairs are taken for chance."""

NEAREST, FARTHEST = 0.5, 12.0
"""Depths of points that are used [m]."""
HALF_PATCH, SEARCH = 10, 24
"""Compared patches reach this far, and are looked for within this, in pixels' width on the ground."""
ALIKE = 0.75
"""Least correlation of two patches of one point."""

NOISE, LOSS_SCALE = 0.3, 2.0
"""Expected deviation of a match [px]; errors beyond this many deviations count as outliers more and more."""

OUTLIER = 1.0
"""A common point that is still off by this after the first solution is left out of the second [px]."""
SURE = 2.0
"""Turns smaller than this many standard deviations are left out."""

ROUNDS = 50
"""Steps of each solution; it takes about twenty."""


@value
class Refinement(Value):
    """What was applied.

    right_turns, pair_turns: (pairs, 3) about the axes of each right and left camera [rad], 0 where what was found is
    less than SURE deviations. right_uncertainty, pair_uncertainty: (pairs, 3) one standard deviation of each [rad];
    zero for the reference, and that of the prior where the images don't tell. common: (pairs, pairs) points seen by
    both. before, after: median error over the common points [px]; NaN without.
    """

    pairs: tuple[str, ...]
    right_turns: Array
    pair_turns: Array
    right_uncertainty: Array
    pair_uncertainty: Array
    common: NDArray[np.int64]
    before: float
    after: float

    @property
    def text(self) -> str:
        """For a person."""
        joined = int((self.common > 0).any(axis=1).sum())
        if not joined:
            return "pairs have no common ground: only right cameras refined"
        return f"{joined} pairs refined together, errors {self.before:z.2f} → {self.after:z.2f} px"


def refine(pairs: Sequence[ImagePair], progress: Progress = no_progress) -> tuple[tuple[ImagePair, ...], Refinement]:
    """The pairs with right images and camera poses as all images say together; the first is the reference.

    A pair that shares no ground with the others keeps its pose. Deterministic. Raises InvalidImages without a pair, or
    where one is not rectified.
    """
    if not pairs:
        raise InvalidImages("there is no image pair to refine")
    for pair in pairs:
        require_rectified(pair)
    right, own = [], []
    for i, pair in enumerate(pairs):
        progress(0.4 * i / len(pairs), f"matching {pair.name}")
        right.append(estimate_rotation(pair).rotation)
        own.append(matches(pair))
    seen, common = [], np.zeros((len(pairs), len(pairs)), np.int64)
    for i in range(len(pairs)):
        progress(0.4 + 0.4 * i / len(pairs), f"looking for what {pairs[i].name} shares with others")
        for j in range(len(pairs)):
            found = None if i == j else _common(pairs[i], pairs[j], own[i], right[i])
            if found is not None:
                seen.append((i, j, found))
                common[[i, j], [j, i]] += len(found.points)
    progress(0.85, "solving")
    problem = _Problem(pairs, own, seen)
    start = np.concatenate([np.ravel(right), np.zeros(3 * (len(pairs) - 1))])
    solved = problem.solved(start)
    # once more without what is wrong beyond doubt: a robust loss lessens its pull, it does not end it
    before = problem.common_error(problem.with_points(start))
    agreed = problem.agreeing(solved.x)
    problem = _Problem(pairs, own, agreed)
    solved = problem.solved(solved.x[: problem.turns])
    after = problem.common_error(solved.x)
    deviations = problem.uncertainty(solved.jac)
    found = solved.x[: problem.turns]
    # what the images don't tell apart from nothing would only add its own error
    found = np.where(np.abs(found) >= SURE * deviations, np.round(found, 7), 0.0)
    right_turns, pair_turns = problem.split(found)
    # of a pair that shares nothing its rows say no more than when asked alone, where mistaken matches pull less
    for alone in set(range(len(pairs))) - {k for i, j, _ in agreed for k in (i, j)}:
        right_turns[alone] = right[alone]
    refined = tuple(
        _turned(turn_right_image(pair, right_turn) if right_turn.any() else pair, pair_turn)
        for pair, right_turn, pair_turn in zip(pairs, right_turns, pair_turns, strict=True)
    )
    names = tuple(pair.name for pair in pairs)
    return refined, Refinement(names, right_turns, pair_turns, *problem.split(deviations), common, before, after)


def _turned(pair: ImagePair, turn: Array) -> ImagePair:
    """The pair with both cameras turned as one about the left one's centre, by ``turn`` in its axes [rad]."""
    T_base_left = pair.camera_left.T_base_camera
    T_left_right = frames.inverse(T_base_left) @ pair.camera_right.T_base_camera
    T_left = T_base_left @ frames.transform(_rotation(turn))
    left = replace(pair.camera_left, T_base_camera=T_left)
    return replace(pair, camera_left=left, camera_right=replace(pair.camera_right, T_base_camera=T_left @ T_left_right))


class _Common(NamedTuple):
    """Points (n, 3) of the site that two pairs see, and their pixels (n, 2) in each image of both."""

    points: Array
    pixels: tuple[tuple[Array, Array], tuple[Array, Array]]


def _thinned(left: Array, right: Array, count: int) -> tuple[Array, Array]:
    """At most ``count`` matches, evenly out of all."""
    chosen = np.unique(np.linspace(0, len(left) - 1, min(count, len(left))).astype(np.int64))
    return left[chosen], right[chosen]


def _common(one: ImagePair, other: ImagePair, own: tuple[Array, Array], turn: Array) -> _Common | None:
    """Points of one pair's own matches that are found in both images of another; None where there are too few."""
    left, right = _thinned(*own, CANDIDATES)
    camera = one.camera_left
    model = _pixels(sight(one.camera_right, *right.T) @ _rotation(turn).T, one.camera_right)
    apart = left[:, 0] - model[:, 0] + one.camera_right.cx - camera.cx
    z = camera.fx * one.baseline / np.where(apart > 0, apart, np.nan)
    at = sight(camera, *left.T) * z[:, None]
    points = frames.apply(one.T_site_base @ camera.T_base_camera, at)
    usable = np.flatnonzero((z > NEAREST) & (z < FARTHEST) & _in_view(points, other))
    rows = []
    for k in usable:
        template = _from_above(one.left, camera, one.T_site_base, points[k], _footprint(points[k], other), HALF_PATCH)
        if template is None:
            continue
        hits = [
            _found(template, image, view, other.T_site_base, points[k], _footprint(points[k], other))
            for image, view in ((other.left, other.camera_left), (other.right, other.camera_right))
        ]
        if hits[0] is not None and hits[1] is not None:
            rows.append((k, hits[0], hits[1]))
    if len(rows) < FEWEST_COMMON:
        return None
    rows = [rows[i] for i in np.unique(np.linspace(0, len(rows) - 1, min(COMMON_POINTS, len(rows))).astype(np.int64))]
    index = np.array([k for k, _, _ in rows])
    there = np.array([hit for _, hit, _ in rows]), np.array([hit for _, _, hit in rows])
    return _Common(points[index], ((left[index], right[index]), there))


def _in_view(points: Array, pair: ImagePair) -> NDArray[np.bool_]:
    """Whether points (n, 3) lie well inside of both images of a pair."""
    inside = np.ones(len(points), bool)
    for camera in (pair.camera_left, pair.camera_right):
        at = frames.apply(frames.inverse(pair.T_site_base @ camera.T_base_camera), points)
        with np.errstate(invalid="ignore", divide="ignore"):
            u, v = _pixels(at, camera).T
            inside &= (at[:, 2] > NEAREST) & (at[:, 2] < FARTHEST)
            inside &= (u > 2 * HALF_PATCH) & (u < camera.width - 2 * HALF_PATCH)
            inside &= (v > 2 * HALF_PATCH) & (v < camera.height - 2 * HALF_PATCH)
    return inside


def _footprint(point: Array, pair: ImagePair) -> float:
    """Width of a pixel of a pair at a point [m]."""
    T = pair.T_site_base @ pair.camera_left.T_base_camera
    return float(np.linalg.norm(point - T[:3, 3])) / pair.camera_left.fx


def _from_above(
    image: NDArray[np.uint8], camera: Camera, T_site_base: Array, point: Array, spacing: float, half: int
) -> NDArray[np.float32] | None:
    """The level ground about a point, seen from above, (2 half + 1,) squared; None where the image does not hold it."""
    steps = np.arange(-half, half + 1) * spacing
    east, north = np.meshgrid(steps, steps)
    ground = point + np.stack([east, north, np.zeros_like(east)], axis=-1)
    at = frames.apply(frames.inverse(T_site_base @ camera.T_base_camera), ground)
    if at[..., 2].min() < NEAREST:
        return None
    u, v = np.moveaxis(_pixels(at, camera), -1, 0).astype(np.float32)
    if u.min() < 0 or v.min() < 0 or u.max() > camera.width - 1 or v.max() > camera.height - 1:
        return None
    return cv2.remap(image, u, v, cv2.INTER_LINEAR).astype(np.float32)


def _found(
    template: NDArray[np.float32],
    image: NDArray[np.uint8],
    camera: Camera,
    T_site_base: Array,
    point: Array,
    spacing: float,
) -> Array | None:
    """The pixel (2,) at which an image shows the ground of a template, near a point; None where it does not."""
    ground = _from_above(image, camera, T_site_base, point, spacing, HALF_PATCH + SEARCH)
    if ground is None or template.std() < 1.0:
        return None
    score = cv2.matchTemplate(ground, template, cv2.TM_CCOEFF_NORMED)
    row, col = np.unravel_index(int(np.argmax(score)), score.shape)
    if score[row, col] < ALIKE or not (0 < row < 2 * SEARCH and 0 < col < 2 * SEARCH):
        return None
    offset = [
        _peak(*line) + at - SEARCH
        for line, at in ((score[row, col - 1 : col + 2], col), (score[row - 1 : row + 2, col], row))
    ]
    moved = point + spacing * np.array([*offset, 0.0])
    return _pixels(frames.apply(frames.inverse(T_site_base @ camera.T_base_camera), moved), camera)


def _peak(before: float, middle: float, after: float) -> float:
    """Where the parabola through three values at −1, 0, 1 is highest."""
    bend = before - 2.0 * middle + after
    return 0.0 if bend >= 0 else float(0.5 * (before - after) / bend)


class _Problem:
    """Residuals, in expected deviations, of the turns and the common points, and which unknown each of them depends on.

    Unknowns: turns of the right cameras (3 each), of the pairs but the first (3 each), points (3 each).
    """

    def __init__(
        self, pairs: Sequence[ImagePair], own: list[tuple[Array, Array]], seen: list[tuple[int, int, _Common]]
    ) -> None:
        self._pairs = pairs
        self._own = [
            (sight(p.camera_left, *left.T), sight(p.camera_right, *right.T))
            for p, (left, right) in zip(pairs, own, strict=True)
        ]
        self._seen = seen
        self._Ts = [frames.inverse(pair.T_site_base @ pair.camera_left.T_base_camera) for pair in pairs]
        self.turns = 3 * len(pairs) + 3 * (len(pairs) - 1)

    def split(self, x: Array) -> tuple[Array, Array]:
        """Turns of the right cameras and of the pairs, (pairs, 3) each."""
        count = len(self._pairs)
        right = x[: 3 * count].reshape(count, 3)
        return right, np.concatenate([np.zeros((1, 3)), x[3 * count : self.turns].reshape(count - 1, 3)])

    def with_points(self, turns: Array) -> Array:
        """All unknowns, the points where the first of each two pairs sees them."""
        return np.concatenate([turns, *(found.points.ravel() for _, _, found in self._seen)])

    def solved(self, turns: Array) -> Any:
        """The least-squares solution from given turns."""
        return least_squares(
            self.residuals,
            self.with_points(turns),
            jac_sparsity=self.sparsity(),
            loss="soft_l1",
            f_scale=LOSS_SCALE,
            x_scale="jac",
            max_nfev=ROUNDS,
        )

    def agreeing(self, x: Array) -> list[tuple[int, int, _Common]]:
        """The common points whose errors are all below OUTLIER, where at least FEWEST_COMMON are left."""
        errors = np.linalg.norm(self._common_errors(x), axis=1)
        kept, first = [], 0
        for i, j, found in self._seen:
            n = len(found.points)
            good = (errors[first : first + 4 * n].reshape(4, n) < OUTLIER).all(axis=0)
            first += 4 * n
            if good.sum() >= FEWEST_COMMON:
                pixels = tuple((left[good], right[good]) for left, right in found.pixels)
                kept.append((i, j, _Common(found.points[good], (pixels[0], pixels[1]))))
        return kept

    def residuals(self, x: Array) -> Array:
        right, whole = self.split(x)
        rows = [self._row_errors(i, right[i]) for i in range(len(self._pairs))]
        priors = [np.ravel(right) / EXPECTED_RIGHT, np.ravel(whole[1:]) / EXPECTED_PAIR]
        # in expected deviations; patches of neighbouring matches overlap, so that about four rows tell as much as one
        own = [row / (2.0 * NOISE) for row in rows]
        return np.concatenate([*own, *priors, self._common_errors(x).ravel() / NOISE])

    def uncertainty(self, jacobian: csr_array) -> Array:
        """One standard deviation of each turn [rad], the points being as uncertain as they are (Schur complement)."""
        A, B = jacobian[:, : self.turns], jacobian[:, self.turns :]
        information = (A.T @ A).toarray()
        if B.shape[1]:
            between = (B.T @ A).toarray()
            information -= between.T @ splu((B.T @ B).tocsc()).solve(between)
        return np.sqrt(np.diag(np.linalg.inv(information)))

    def common_error(self, x: Array) -> float:
        """Median length of the errors of common points [px]."""
        errors = self._common_errors(x)
        return float(np.median(np.linalg.norm(errors, axis=1))) if len(errors) else float("nan")

    def sparsity(self) -> csr_array:
        count = len(self._pairs)
        rows: list[NDArray[np.int64]] = []
        cols: list[NDArray[np.int64]] = []
        at = 0

        def depends(n: int, first: int) -> None:
            """The next n residuals depend on three unknowns from ``first``."""
            rows.append(np.repeat(np.arange(at, at + n), 3))
            cols.append(np.tile(np.arange(first, first + 3), n))

        for i in range(count):
            depends(len(self._own[i][0]), 3 * i)
            at += len(self._own[i][0])
        rows.append(np.arange(at, at + self.turns))
        cols.append(np.arange(self.turns))
        at += self.turns
        first = self.turns
        for i, j, found in self._seen:
            n = len(found.points)
            for pair in (i, j):
                for side in range(2):
                    if side == 1:
                        depends(2 * n, 3 * pair)
                    if pair > 0:
                        depends(2 * n, 3 * count + 3 * (pair - 1))
                    rows.append(np.repeat(np.arange(at, at + 2 * n), 3))
                    cols.append((first + 3 * np.repeat(np.arange(n), 2)[:, None] + np.arange(3)).ravel())
                    at += 2 * n
            first += 3 * n
        row, col = np.concatenate(rows), np.concatenate(cols)
        return coo_array((np.ones(len(row)), (row, col)), shape=(at, first)).tocsr()

    def _row_errors(self, i: int, turn: Array) -> Array:
        left, right = self._own[i]
        turned = right @ _rotation(turn).T
        return self._pairs[i].camera_left.fy * (turned[:, 1] / turned[:, 2] - left[:, 1])

    def _common_errors(self, x: Array) -> Array:
        """(m, 2): for each two pairs, first, then other, left, then right, all of their points."""
        right, whole = self.split(x)
        errors = [np.zeros((0, 2))]
        first = self.turns
        for i, j, found in self._seen:
            points = x[first : first + 3 * len(found.points)].reshape(-1, 3)
            first += points.size
            for pair, pixels in ((i, found.pixels[0]), (j, found.pixels[1])):
                model = self._pairs[pair]
                in_left = frames.apply(self._Ts[pair], points) @ _rotation(whole[pair])
                in_right = (in_left - [model.baseline, 0.0, 0.0]) @ _rotation(right[pair])
                errors.append(_pixels(in_left, model.camera_left) - pixels[0])
                errors.append(_pixels(in_right, model.camera_right) - pixels[1])
        return np.concatenate(errors)


def _rotation(turn: Array) -> Array:
    # a copy: read-only arrays are not taken
    return Rotation.from_rotvec(np.array(turn)).as_matrix()


def _pixels(points: Array, camera: Camera) -> Array:
    """Pixels (…, 2) of points (…, 3) of the camera's frame."""
    z = points[..., 2]
    return np.stack([camera.fx * points[..., 0] / z + camera.cx, camera.fy * points[..., 1] / z + camera.cy], axis=-1)
