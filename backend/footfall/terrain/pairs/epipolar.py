"""How far the right camera of a rectified pair is turned from where its model says, seen from the pair itself.

The two views of one point must lie in one plane with the baseline (epipolar constraint: Longuet-Higgins, Nature 1981;
Hartley & Zisserman, *Multiple View Geometry*, 2004, ch. 9). In a rectified pair that plane cuts both images in one
row. Let x = (x, y, 1) be the ray through a point of the right image and R the small rotation that carries the rays of
the real right camera into its model; then the row of (R x) equals the left row. To first order in the angles (ωx, ωy,
ωz) about the camera's axes

    y_right − y_left = (1 + y²) ωx − x y ωy − x ωz

so ωx (pitch) shifts all rows and ωz (roll) tilts them: a handful of matches tells both. ωy (yaw) shows itself only
through x·y, that is by perspective towards the corners of the image: it needs a wide view and many matches, its
uncertainty is several times larger, and where it is too large yaw is left alone (``YAW_OBSERVABLE``). So it is where
yaw would bend the rows no more than well calibrated lenses do (``BENT_ROWS``): in a narrow view that looks like a yaw
which shifts disparities by a hundred times as much. A wrong length of the baseline can't be seen at all without
something of known size; a wrong direction (1, by, bz) can, by rows that shift with disparity. It is not corrected: the
camera is not where it should be, or was not there at that moment.

Solved over matches (:mod:`footfall.terrain.pairs.point_matches`) by random samples of three (Fischler & Bolles, CACM
1981), then Gauss–Newton with Tukey's weights (Huber, *Robust Statistics*, 1981).
"""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.errors import InvalidImages
from footfall.core.value import Value, value
from footfall.telemetry.images import ImagePair
from footfall.terrain.pairs.point_matches import FEWEST_MATCHES, matches
from footfall.terrain.pairs.stereo import offset, require_rectified

LARGEST_CORRECTION = np.deg2rad(0.3)
"""A camera turned by this or more about any axis is no small error of calibration: the pair is refused [rad]."""

SMALLEST_CORRECTION = np.deg2rad(0.02)
"""Below this (or three times its uncertainty) an angle is taken to be zero [rad]."""

LARGEST_ASIDE = 0.02
"""The right camera may lie this share of the baseline off it, as seen in the images."""

MOST_DISAGREEMENT = 0.5
"""Rows may differ by this after correction, as the median over all matches [px]."""

YAW_OBSERVABLE = np.deg2rad(0.04)
"""Yaw is estimated only where its uncertainty is at most this [rad]."""

BENT_ROWS = 0.05
"""A yaw that changes rows by less, root mean square, may be what is left of the lenses' distortion [px]: photographed
pairs that are calibrated well show 0.03 to 0.04."""

MISTAKEN = np.deg2rad(1.0)
"""Matches whose rows are further apart are mistakes, if they are the minority: no camera is turned so far and used."""

BEFORE = 0.9
"""Share of the matches with a disparity above zero that shows which image is the left one."""

BEYOND_INFINITY = np.deg2rad(0.3)
"""A disparity may be less than that of what is infinitely far by so much [rad]: as a yaw that rows don't show."""

MOST_BEHIND = 0.1
"""Share of the matches that may lie behind the cameras: mistakes."""

ROUNDS = 15
"""Gauss–Newton is done by then; it takes about six."""

CAUTION = 2.0
"""Errors on simulated pairs, where the truth is known, were up to twice what the residuals say."""

BLOCK = 40
"""Matches this close together are not taken to be independent [px]."""

TURN = np.array([True, True, True, False, False])
TURN_WITHOUT_YAW = np.array([True, False, True, False, False])
EVERYTHING = np.ones(5, bool)


@value
class PairAlignment(Value):
    """What the images of a pair say about its calibration.

    rotation: (3,) about x, y, z of the right camera (pitch, yaw, roll) [rad]: turns rays of the camera as it really
        stands into those of its model; zeros where nothing was found or needed.
    uncertainty: (3,) one standard deviation of each [rad]; infinite where there were too few matches.
    rows_before, rows_after: median |Δrow| over all matches as taken and with ``rotation`` applied [px]; NaN likewise.
    matches: points found in both images.
    corrected: whether the right image was turned.
    aside: (2,) how far the right camera seems to lie off the baseline along y and z of its model [m]; 0 where that
        can't be told from none.
    """

    pair: str
    rotation: Array
    uncertainty: Array
    rows_before: float
    rows_after: float
    matches: int
    corrected: bool
    aside: Array

    @property
    def angle(self) -> float:
        """Length of the rotation [rad]."""
        return float(np.linalg.norm(self.rotation))

    @property
    def checked(self) -> bool:
        """Whether there were enough matches to tell anything."""
        return self.matches >= FEWEST_MATCHES

    @property
    def text(self) -> str:
        """For the operator."""
        if not self.checked:
            return f"{self.pair} not checked: {self.matches} matches, {FEWEST_MATCHES} needed"
        if not self.corrected:
            return f"{self.pair} aligned: rows agree to {self.rows_after:z.2f} px"
        return f"{self.pair} corrected by {np.rad2deg(self.angle):z.2f}°"


def align_pair(pair: ImagePair) -> tuple[ImagePair, PairAlignment]:
    """The pair with its right image turned to where its camera model says, and what was found.

    A pair with too few matches, or with an error too small to tell, comes back as it is. Raises InvalidImages, with
    the number, where the camera is turned by LARGEST_CORRECTION or more, lies off its baseline, or rows still disagree
    after correction; ``brief`` in the error's details says it in a few words.
    """
    require_rectified(pair)
    left, right = matches(pair)
    found = _estimated(pair, left, right)
    if not found.checked:
        return pair, found
    turned = np.abs(found.rotation)
    details = {"pair": pair.name, "rows_before": found.rows_before, "rows_after": found.rows_after}
    if turned.max() >= LARGEST_CORRECTION:
        axis = ("pitch", "yaw", "roll")[int(np.argmax(turned))]
        center = {"pitch": "cy", "yaw": "cx"}.get(axis)
        alike = f"; {center} wrong by {pair.camera_right.fy * turned.max():z.0f} px looks alike" if center else ""
        raise InvalidImages(
            f"pair {pair.name}: the right camera is turned by {np.rad2deg(turned.max()):z.2f}° ({axis}) from its "
            f"model, rows disagree by {found.rows_before:z.1f} px; up to {np.rad2deg(LARGEST_CORRECTION):z.1f}° are "
            f"corrected, beyond that calibrate the pair anew{alike}",
            brief=f"turned by {np.rad2deg(turned.max()):z.2f}°",
            rotation_deg=np.rad2deg(found.rotation).tolist(),
            **details,
        )
    aside = float(np.linalg.norm(found.aside))
    if aside > LARGEST_ASIDE * pair.baseline:
        raise InvalidImages(
            f"pair {pair.name}: the images look as if the right camera lay {1000 * aside:z.0f} mm off its baseline, "
            f"rows disagree by {found.rows_before:z.2f} px; they are not of one moment, its mount has moved, or its "
            "calibration is wrong (principal points cx and cy; doffs, their difference)",
            brief=f"right camera {1000 * aside:z.0f} mm off its baseline",
            aside=aside,
            **details,
        )
    if found.rows_after > MOST_DISAGREEMENT:
        raise InvalidImages(
            f"pair {pair.name}: rows disagree by {found.rows_after:z.2f} px after correction "
            f"({MOST_DISAGREEMENT} px at most); the images may not be of one moment, not rectified, or calibrated "
            "wrongly (principal points cx and cy, focal length)",
            brief=f"rows disagree by {found.rows_after:z.1f} px",
            **details,
        )
    aligned = turn_right_image(pair, found.rotation) if found.corrected else pair
    if not found.corrected:
        _require_ahead(pair, left, right)
    return aligned, found


def _require_ahead(pair: ImagePair, left: Array, right: Array) -> None:
    """Raise InvalidImages where much that rows agree on would lie behind the cameras: no lens sees that."""
    agree = np.abs(right[:, 1] - left[:, 1]) < 2.0 * MOST_DISAGREEMENT
    shifted = (left[:, 0] - right[:, 0] + offset(pair))[agree]
    behind = float(np.mean(shifted < -BEYOND_INFINITY * pair.camera_left.fx)) if len(shifted) else 0.0
    if behind > MOST_BEHIND:
        raise InvalidImages(
            f"pair {pair.name}: {behind:.0%} of the points found in both images would lie behind the cameras, by up to "
            f"{-shifted.min():z.0f} px; the calibration is wrong: check cx of both cameras, or doffs (cx of the right "
            f"one less that of the left one, here {offset(pair):z.1f} px), and that left and right are not exchanged",
            brief=f"{behind:.0%} behind the cameras",
            behind=behind,
            pair=pair.name,
        )


def fits(pair: ImagePair) -> bool:
    """Whether rows agree, and nearly all that both images show lies before the cameras: left and right in place."""
    found = estimate_rotation(pair)
    if not found.checked or found.rows_after > MOST_DISAGREEMENT:
        return False
    left, right = matches(pair)
    return float(np.mean(left[:, 0] - right[:, 0] + offset(pair) > 0.0)) > BEFORE


def turn_right_image(pair: ImagePair, rotation: Array) -> ImagePair:
    """The pair with its right image as the camera would have taken it without that rotation (3,) [rad].

    A rotation about the centre of projection moves the image by the homography K R K⁻¹, whatever the scene.
    """
    K = _matrix(pair)
    R, _ = cv2.Rodrigues(np.asarray(rotation, float))
    size = pair.camera_right.width, pair.camera_right.height
    right = cv2.warpPerspective(pair.right, K @ R @ np.linalg.inv(K), size, flags=cv2.INTER_CUBIC)
    return ImagePair(
        pair.name, pair.time, pair.left, right.astype(np.uint8), pair.camera_left, pair.camera_right, pair.T_site_base
    )


def estimate_rotation(pair: ImagePair) -> PairAlignment:
    """What :func:`align_pair` finds, without judging it. Deterministic."""
    return _estimated(pair, *matches(pair))


def _estimated(pair: ImagePair, left: Array, right: Array) -> PairAlignment:
    found = _seen_in(pair, left, right)
    if found.rows_after > MOST_DISAGREEMENT:
        # a pattern that repeats, such as a board for calibration, or much that only one camera sees
        likely = np.abs(right[:, 1] - left[:, 1]) < MISTAKEN * pair.camera_right.fy
        if 2 * likely.sum() > len(left):
            found = _seen_in(pair, left[likely], right[likely])
    return found


def _seen_in(pair: ImagePair, left: Array, right: Array) -> PairAlignment:
    """What these matches (n, 2) [px] say."""
    nothing = PairAlignment(pair.name, np.zeros(3), np.full(3, np.inf), np.nan, np.nan, len(left), False, np.zeros(2))
    if len(left) < FEWEST_MATCHES:
        return nothing
    focal = pair.camera_right.fy
    rays = _rays(pair, left, right)
    before = float(np.median(np.abs(_row_errors(rays, np.zeros(5))))) * focal
    fit = _fit(rays, 1.0 / focal, TURN)
    sigma, rotation = fit.uncertainty[:3], fit.found[:3]
    bent = abs(rotation[1]) * _yaw_in_rows(rays) * focal < BENT_ROWS
    if bent or (sigma[1] > YAW_OBSERVABLE and np.abs(rotation).max() < LARGEST_CORRECTION):
        rotation = _fit(rays, 1.0 / focal, TURN_WITHOUT_YAW, fit.found).found[:3]
    if (np.abs(rotation) < np.maximum(SMALLEST_CORRECTION, 3.0 * sigma)).all():
        rotation = np.zeros(3)
    after = float(np.median(np.abs(_row_errors(rays, np.r_[rotation, 0.0, 0.0])))) * focal
    freely = _fit(rays, 1.0 / focal, EVERYTHING, fit.found)
    aside = np.where(np.abs(freely.found[3:]) > 4.0 * freely.uncertainty[3:], freely.found[3:], 0.0)
    return PairAlignment(
        pair.name, rotation, sigma, before, after, len(left), bool(rotation.any()), aside * pair.baseline
    )


def _yaw_in_rows(rays: "_Rays") -> float:
    """By how much of a yaw rows change, root mean square, that neither pitch nor roll explains; x·y is left of them."""
    x, y = rays.right[:, 0], rays.right[:, 1]
    others = np.stack([1.0 + y * y, x], axis=1)
    explained, *_ = np.linalg.lstsq(others, x * y)
    return float(np.sqrt(np.mean((x * y - others @ explained) ** 2)))


class _Fit(NamedTuple):
    found: Array
    """(5,) ωx, ωy, ωz [rad], by, bz; zero where not free."""
    uncertainty: Array


class _Rays(NamedTuple):
    right: Array
    """(n, 3) through pixels of the right image, at depth one."""
    left: Array
    """(n, 2) x and y of their partners at depth one."""


def _fit(rays: _Rays, tolerance: float, free: NDArray[np.bool_], near: Array | None = None) -> _Fit:
    """Robust least squares of the row errors over the ``free`` unknowns; ``tolerance``: of an inlier [rad].

    near: unknowns (5,) of a fit to begin at; None: at the best of many samples.
    """
    found = _best_sample(rays, tolerance, free) if near is None else np.where(free, near, 0.0)
    count = int(free.sum())
    inverse, A, weighted = np.eye(count), np.zeros((0, count)), np.zeros(0)
    for _ in range(ROUNDS):
        error = _row_errors(rays, found)
        scale = max(1.4826 * float(np.median(np.abs(error))), 0.02 * tolerance)
        weight = np.maximum(1.0 - (error / (4.685 * scale)) ** 2, 0.0) ** 2
        A, weighted = _slopes(rays, found)[:, free], weight * error
        # the tiny addition keeps matches that all lie in one place from dividing by zero; they get a huge uncertainty
        inverse = np.linalg.inv(A.T @ (weight[:, None] * A) + 1e-9 * np.eye(count))
        step = -inverse @ (A.T @ weighted)
        found[free] += step
        if np.abs(step).max() < 1e-9:
            break
    # errors of neighbouring matches are alike, their patches overlap: summed by blocks (Liang & Zeger, Biometrika 1986)
    blocks = np.floor(rays.right[:, :2] / (BLOCK * tolerance))
    _, block = np.unique(blocks, axis=0, return_inverse=True)
    scores = np.stack([np.bincount(block, weighted * column) for column in A.T])
    uncertainty = np.zeros(5)
    uncertainty[free] = CAUTION * np.sqrt(np.diag(inverse @ (scores @ scores.T) @ inverse))
    return _Fit(found, uncertainty)


def _best_sample(rays: _Rays, tolerance: float, free: NDArray[np.bool_]) -> Array:
    """Of 300 linear solutions through as many matches as there are unknowns, the one that most rows agree with."""
    rng = np.random.default_rng(0)
    count = int(free.sum())
    A, b = _slopes(rays, np.zeros(5))[:, free], -_row_errors(rays, np.zeros(5))
    picked = rng.integers(0, len(b), (300, count))
    # a touch of ridge: samples of nearly the same point have no solution of their own
    A_t = np.swapaxes(A[picked], 1, 2)
    some = np.linalg.solve(A_t @ A[picked] + 1e-6 * np.eye(count), (A_t @ b[picked][..., None]))[..., 0]
    loss = np.minimum(np.abs(some @ A.T - b), tolerance).sum(axis=1)
    found = np.zeros(5)
    found[free] = some[int(np.argmin(loss))]
    return found


def _row_errors(rays: _Rays, unknowns: Array) -> Array:
    """Left ray · (baseline × turned right ray), (n,): the difference of rows where the baseline is along x."""
    x, y = _turned(rays, unknowns)
    x_left, y_left = rays.left.T
    by, bz = unknowns[3:]
    return (y - y_left) - by * (x - x_left) + bz * (x * y_left - y * x_left)


def _slopes(rays: _Rays, unknowns: Array) -> Array:
    """Derivatives (n, 5) of the row errors; those by the angles for a baseline along x, which it nearly is."""
    x, y = _turned(rays, unknowns)
    x_left, y_left = rays.left.T
    return np.stack([-(1.0 + y * y), x * y, x, x_left - x, x * y_left - y * x_left], axis=1)


def _turned(rays: _Rays, unknowns: Array) -> Array:
    R, _ = cv2.Rodrigues(unknowns[:3])
    turned = rays.right @ R.T
    return (turned[:, :2] / turned[:, 2:]).T


def _rays(pair: ImagePair, left: Array, right: Array) -> _Rays:
    a, b = pair.camera_left, pair.camera_right
    x, y = (right[:, 0] - b.cx) / b.fx, (right[:, 1] - b.cy) / b.fy
    at_left = np.stack([(left[:, 0] - a.cx) / a.fx, (left[:, 1] - a.cy) / a.fy], axis=1)
    return _Rays(np.stack([x, y, np.ones(len(x))], axis=1), at_left)


def _matrix(pair: ImagePair) -> Array:
    camera = pair.camera_right
    return np.array([[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]])
