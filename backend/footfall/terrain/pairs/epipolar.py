"""How far the right camera of a rectified pair is turned from where its model says, seen from the pair itself.

The two views of one point must lie in one plane with the baseline (epipolar constraint: Longuet-Higgins, Nature 1981;
Hartley & Zisserman, *Multiple View Geometry*, 2004, ch. 9). In a rectified pair that plane cuts both images in one
row. Let x = (x, y, 1) be the ray through a point of the right image and R the small rotation that carries the rays of
the real right camera into its model; then the row of (R x) equals the left row. To first order in the angles (ωx, ωy,
ωz) about the camera's axes

    y_right − y_left = (1 + y²) ωx − x y ωy − x ωz

so ωx (pitch) shifts all rows and ωz (roll) tilts them: a handful of matches tells both. ωy (yaw) shows itself only
through x·y, that is by perspective towards the corners of the image: it needs a wide view and many matches, its
uncertainty is several times larger, and where it is too large yaw is left alone (``YAW_OBSERVABLE``). A wrong length
of the baseline can't be seen at all without something of known size; a wrong direction (1, by, bz) can, by rows that
shift with disparity. It is not corrected: the camera is not where it should be, or was not there at that moment.

Matches: SIFT with the ratio test (Lowe, IJCV 2004) at reduced size; these, and corners (Shi & Tomasi, CVPR 1994) near
them, are then placed by Lucas & Kanade (IJCAI 1981) in the full images. Solved by random samples of three (Fischler &
Bolles, CACM 1981), then Gauss–Newton with Tukey's weights (Huber, *Robust Statistics*, 1981).
"""

from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from footfall.core.errors import InvalidImages
from footfall.core.value import Value, value
from footfall.telemetry.images import ImagePair
from footfall.terrain.pairs.stereo import require_rectified

Array = NDArray[np.float64]

LARGEST_CORRECTION = np.deg2rad(0.3)
"""A camera turned by this or more about any axis is no small error of calibration: the pair is refused [rad]."""

SMALLEST_CORRECTION = np.deg2rad(0.02)
"""Below this (or three times its uncertainty) an angle is taken to be zero [rad]."""

LARGEST_ASIDE = 0.02
"""The right camera may lie this share of the baseline off it, as seen in the images."""

MOST_DISAGREEMENT = 0.5
"""Rows may differ by this after correction, as the median over all matches [px]."""

FEWEST_MATCHES = 40
"""With fewer, nothing can be said about a pair."""

YAW_OBSERVABLE = np.deg2rad(0.04)
"""Yaw is estimated only where its uncertainty is at most this [rad]."""

RATIO = 0.8
"""The best partner must be this much closer than the second best (Lowe)."""

FEATURES = 800
"""Of each image, the strongest so many."""

CORNERS = 1200
"""Corners tracked from the left into the right image once matches tell where to look."""

WIDEST = 320
"""Features are searched in images reduced to about this width [px]."""

BAND = np.deg2rad(4.0)
"""Partners are looked for within this of the same row [rad]."""

ROUNDS = 15
"""Gauss–Newton is done by then; it takes about six."""

PATCH = 21
"""Side of the patches compared at full size [px]."""

FINDS_BACK = 0.3
"""A point tracked there and back must return within this [px]."""

CAUTION = 2.0
"""Errors on simulated pairs, where the truth is known, were up to twice what the residuals say."""

FAINT = 3.0
"""Contrast that counts as noise more than as detail [grey levels]."""

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
            return f"{self.pair} aligned: rows agree to {self.rows_after:.2f} px"
        return f"{self.pair} corrected by {np.rad2deg(self.angle):.2f}°"


def align_pair(pair: ImagePair) -> tuple[ImagePair, PairAlignment]:
    """The pair with its right image turned to where its camera model says, and what was found.

    A pair with too few matches, or with an error too small to tell, comes back as it is. Raises InvalidImages, with
    the number, where the camera is turned by LARGEST_CORRECTION or more, lies off its baseline, or rows still disagree
    after correction; ``brief`` in the error's details says it in a few words.
    """
    require_rectified(pair)
    found = estimate_rotation(pair)
    if not found.checked:
        return pair, found
    turned = np.abs(found.rotation)
    details: dict[str, Any] = {"pair": pair.name, "rows_before": found.rows_before, "rows_after": found.rows_after}
    if turned.max() >= LARGEST_CORRECTION:
        axis = ("pitch", "yaw", "roll")[int(np.argmax(turned))]
        raise InvalidImages(
            f"pair {pair.name}: the right camera is turned by {np.rad2deg(turned.max()):.2f}° ({axis}) from its model, "
            f"rows disagree by {found.rows_before:.1f} px; up to {np.rad2deg(LARGEST_CORRECTION):.1f}° are corrected, "
            "beyond that calibrate the pair anew",
            brief=f"turned by {np.rad2deg(turned.max()):.2f}°",
            rotation_deg=np.rad2deg(found.rotation).tolist(),
            **details,
        )
    aside = float(np.linalg.norm(found.aside))
    if aside > LARGEST_ASIDE * pair.baseline:
        raise InvalidImages(
            f"pair {pair.name}: the images look as if the right camera lay {1000 * aside:.0f} mm off its baseline, "
            f"rows disagree by {found.rows_before:.2f} px; they are not of one moment, or its mount has moved",
            brief=f"right camera {1000 * aside:.0f} mm off its baseline",
            aside=aside,
            **details,
        )
    if found.rows_after > MOST_DISAGREEMENT:
        raise InvalidImages(
            f"pair {pair.name}: rows disagree by {found.rows_after:.2f} px after correction "
            f"({MOST_DISAGREEMENT} px at most); the images may not be of one moment, or not rectified",
            brief=f"rows disagree by {found.rows_after:.1f} px",
            **details,
        )
    return (turn_right_image(pair, found.rotation) if found.corrected else pair), found


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
    left, right = matches(pair)
    nothing = PairAlignment(pair.name, np.zeros(3), np.full(3, np.inf), np.nan, np.nan, len(left), False, np.zeros(2))
    if len(left) < FEWEST_MATCHES:
        return nothing
    focal = pair.camera_right.fy
    rays = _rays(pair, left, right)
    before = float(np.median(np.abs(_row_errors(rays, np.zeros(5))))) * focal
    fit = _fit(rays, 1.0 / focal, TURN)
    sigma, rotation = fit.uncertainty[:3], fit.found[:3]
    if sigma[1] > YAW_OBSERVABLE and np.abs(rotation).max() < LARGEST_CORRECTION:
        rotation = _fit(rays, 1.0 / focal, TURN_WITHOUT_YAW).found[:3]
    if (np.abs(rotation) < np.maximum(SMALLEST_CORRECTION, 3.0 * sigma)).all():
        rotation = np.zeros(3)
    after = float(np.median(np.abs(_row_errors(rays, np.r_[rotation, 0.0, 0.0])))) * focal
    freely = _fit(rays, 1.0 / focal, EVERYTHING)
    aside = np.where(np.abs(freely.found[3:]) > 4.0 * freely.uncertainty[3:], freely.found[3:], 0.0)
    return PairAlignment(
        pair.name, rotation, sigma, before, after, len(left), bool(rotation.any()), aside * pair.baseline
    )


def matches(pair: ImagePair) -> tuple[Array, Array]:
    """Pixels (n, 2) of the same points in the left and in the right image, to a tenth of a pixel or so."""
    images = [_even(image) for image in (pair.left, pair.right)]
    left, right = _track(images, *_sift_matches(images, pair))
    if len(left) < FEWEST_MATCHES:
        return left, right
    corners = cv2.goodFeaturesToTrack(images[0], CORNERS, 0.01, PATCH / 2)[:, 0]
    # the median of three neighbours: one wrong match does not mislead all around it
    _, neighbours = KDTree(left).query(corners, k=3)
    guess = corners + np.median((right - left)[neighbours], axis=1)
    more = _track(images, corners.astype(float), guess.astype(float))
    return np.concatenate([left, more[0]]), np.concatenate([right, more[1]])


def _sift_matches(images: list[NDArray[np.uint8]], pair: ImagePair) -> tuple[Array, Array]:
    scale = max(1, round(images[0].shape[1] / WIDEST))
    small = [cv2.resize(image, None, fx=1 / scale, fy=1 / scale, interpolation=cv2.INTER_AREA) for image in images]
    sift = cv2.SIFT.create(nfeatures=FEATURES, contrastThreshold=0.02)
    found = [sift.detectAndCompute(image, None) for image in small]
    points = [np.array([k.pt for k in keys]).reshape(-1, 2) * scale + 0.5 * (scale - 1) for keys, _ in found]
    if min(len(p) for p in points) < 2:
        return np.zeros((0, 2)), np.zeros((0, 2))
    i, j = _partners(found[0][1], found[1][1], points[0], points[1], pair)
    return points[0][i], points[1][j]


def _partners(
    left: NDArray[Any], right: NDArray[Any], at_left: Array, at_right: Array, pair: ImagePair
) -> tuple[NDArray, NDArray]:
    """Indices of descriptors that are each other's nearest by far, among those that the geometry allows."""
    distance = np.sqrt(np.maximum((left**2).sum(1)[:, None] + (right**2).sum(1) - 2.0 * left @ right.T, 0.0))
    apart = at_left[:, None] - at_right[None]
    offset = pair.camera_right.cx - pair.camera_left.cx
    shift = BAND * pair.camera_right.fx
    distance[(np.abs(apart[..., 1]) > BAND * pair.camera_right.fy) | (apart[..., 0] + offset < -shift)] = np.inf
    each = np.arange(len(left))
    partner = distance.argmin(axis=1)
    mutual = distance.argmin(axis=0)[partner] == each
    best = distance[each, partner]
    distance[each, partner] = np.inf
    second = distance.min(axis=1)
    chosen = np.flatnonzero(np.isfinite(best) & (best < RATIO * second) & mutual)
    return chosen, partner[chosen]


def _track(images: list[NDArray[np.uint8]], left: Array, guess: Array) -> tuple[Array, Array]:
    """Partners in the right image near a guess; those that do not find back to where they came from are dropped."""
    if len(left) == 0:
        return left, guess
    options = {
        "winSize": (PATCH, PATCH),
        "maxLevel": 0,
        "criteria": (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, 0.003),
        "flags": cv2.OPTFLOW_USE_INITIAL_FLOW,
    }
    start, near = left.astype(np.float32)[:, None], guess.astype(np.float32)[:, None]
    there, ok, _ = cv2.calcOpticalFlowPyrLK(images[0], images[1], start, near.copy(), **options)
    back, ok_back, _ = cv2.calcOpticalFlowPyrLK(images[1], images[0], there, start.copy(), **options)
    keep = (ok[:, 0] == 1) & (ok_back[:, 0] == 1)
    keep &= np.abs(back - start).max(axis=(1, 2)) < FINDS_BACK
    keep &= np.abs(there - near).max(axis=(1, 2)) < PATCH / 2
    return left[keep], there[keep, 0].astype(float)


def _even(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The image with mean and contrast made equal everywhere, so that exposure and vignetting don't matter."""
    grey, size = image.astype(np.float32), (2 * PATCH + 1, 2 * PATCH + 1)
    detail = grey - cv2.blur(grey, size)
    contrast = cv2.sqrt(cv2.blur(detail * detail, size)) + FAINT
    return cv2.convertScaleAbs(np.maximum(128.0 + 40.0 * detail / contrast, 0.0)).astype(np.uint8)


class _Fit(NamedTuple):
    found: Array
    """(5,) ωx, ωy, ωz [rad], by, bz; zero where not free."""
    uncertainty: Array


class _Rays(NamedTuple):
    right: Array
    """(n, 3) through pixels of the right image, at depth one."""
    left: Array
    """(n, 2) x and y of their partners at depth one."""


def _fit(rays: _Rays, tolerance: float, free: NDArray[np.bool_]) -> _Fit:
    """Robust least squares of the row errors over the ``free`` unknowns; ``tolerance``: of an inlier [rad]."""
    found = _best_sample(rays, tolerance, free)
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
