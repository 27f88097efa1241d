"""Where the legs really are: joint angles estimated from the depth images that show them.

Encoders err and loaded legs sag. Both have a known size, which makes a Gaussian prior of each leg's six joint angles;
what the cameras measured of the leg's surface makes it narrower. The maximum a posteriori angles come from Gauss–Newton
steps on the distances between measured points and the leg's meshes, points assigned anew at every step, as depth
trackers of articulated bodies do it (Schmidt, Newcombe & Fox, *DART: Dense articulated real-time tracking*, RSS 2014).
Points that fit nothing lose their weight (Geman & McClure, 1987).
"""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from footfall.core import frames
from footfall.robot.kinematics import link_poses, wheel_centers
from footfall.robot.model import Robot
from footfall.telemetry.images import ImagePair
from footfall.terrain.pairs import stereo
from footfall.terrain.rover_mask.leg_errors import (
    ENCODER_SD,
    SAG,
    LegError,
    encoder_and_sag_errors,
    joint_axes,
    point_jacobians,
)
from footfall.terrain.rover_mask.nearest import nearest_triangles

STEPS = 5
"""Gauss–Newton steps; points are assigned to the meshes anew at each."""

REACH = 0.12
"""Points further than this from every mesh show something else [m]."""

ALIKE = 0.5
"""Cosine of the largest angle between a measured surface and the face that it may be."""

DISPARITY_SD = 0.2
"""Of a disparity on a leg [px]: noise, and the errors of matching that neighbours share."""

EDGE_SD = 1.0
"""Matching smears the outline of a leg by about this much [px]."""

TOGETHER = 8.0
"""So many neighbouring points err alike, and count as one."""

TOLERANCE = 2.0
"""Points further off than so many standard deviations lose most of their weight."""

SMOOTH = 1.5
"""A point counts where the disparities of its 5 × 5 neighbours differ by no more than this [px]."""

PLAUSIBLE = 20.06
"""Squared Mahalanobis distance from the prior that a fit may reach: χ² of six with the probability of 3 σ."""


class PostureFit(NamedTuple):
    """What the images say of the legs.

    posture: joint angles (36,) [rad]. errors: of each leg, how wrong they may still be. points: measured points that
    each leg rests on; 0 where it was left as encoded. moved: of each wheel, from where its encoders had it [m].
    """

    posture: NDArray[np.float64]
    errors: tuple[LegError, ...]
    points: tuple[int, ...]
    moved: tuple[float, ...]

    @property
    def text(self) -> str:
        """How many legs were found, and how far their wheels are off the encoders' at most, for a person."""
        found = sum(count > 0 for count in self.points)
        if not found:
            return "no leg was found in the images, all are taken to be where the encoders say"
        return f"{found} of {len(self.points)} legs found in the images, wheels moved by up to {max(self.moved):z.3f} m"


class Points(NamedTuple):
    """Measured points of surfaces. position: (n, 3) base [m]. normal: (n, 3) base, towards the camera.

    along: (n, 3) base [m], one standard deviation of the position, in the direction of the ray. across: (n,) [m].
    """

    position: NDArray[np.float64]
    normal: NDArray[np.float64]
    along: NDArray[np.float64]
    across: NDArray[np.float64]


class Prior(NamedTuple):
    """Gaussian of what a leg's joint angles are beyond those encoded: mean (6,) [rad] and inverse covariance (6, 6)."""

    mean: NDArray[np.float64]
    information: NDArray[np.float64]


class Residuals(NamedTuple):
    """Of each point: the leg whose mesh is nearest (−1 = none), its distance [m], its gradient (6,), its variance."""

    leg: NDArray[np.int64]
    distance: NDArray[np.float64]
    gradient: NDArray[np.float64]
    variance: NDArray[np.float64]


def fit_posture(
    robot: Robot,
    encoded: NDArray[np.float64],
    matched: Sequence[tuple[ImagePair, NDArray[np.float32]]],
    encoder_sd: float = ENCODER_SD,
    sag: float = SAG,
) -> PostureFit:
    """The posture that the disparities of all pairs show.

    A leg that nothing is seen of, or whose fit does not explain its points better than the prior, or lies further from
    it than three standard deviations, stays as it was encoded.

    Args:
        robot: the rover.
        encoded: what the encoders say, (legs × 6,) [rad].
        matched: pairs with their disparities, (height, width) [px].
        encoder_sd: standard deviation of the encoders [rad].
        sag: the most that a loaded leg's wheel comes nearer to the chassis [m].

    Returns:
        The posture, and how much of each leg was found.
    """
    errors = encoder_and_sag_errors(robot, encoded, encoder_sd, sag)
    priors = [_prior(error) for error in errors]
    surfaces = _Surfaces(robot)
    # one order of the sums, whatever the order of the pairs
    ordered = sorted(matched, key=lambda one: one[0].name)
    points = Points(*(np.concatenate(layer) for layer in zip(*(_points(*one) for one in ordered), strict=True)))
    near = surfaces.nearest(encoded, points)[0] >= 0
    points = Points(*(layer[near] for layer in points))

    start = np.stack([prior.mean for prior in priors])
    moved, covariances = start.copy(), np.stack([_inverse(prior.information) for prior in priors])
    for _ in range(STEPS):
        found = surfaces.residuals(encoded + moved.ravel(), points)
        for leg, prior in enumerate(priors):
            moved[leg], covariances[leg] = _step(found, leg, prior, moved[leg], covariances[leg])
    before, after = (
        surfaces.residuals(encoded + start.ravel(), points),
        surfaces.residuals(encoded + moved.ravel(), points),
    )
    counts = []
    for leg, prior in enumerate(priors):
        seen = (before.leg == leg) | (after.leg == leg)
        away = moved[leg] - prior.mean
        better = _cost(after, leg, seen) < _cost(before, leg, seen)
        if better and away @ prior.information @ away <= PLAUSIBLE:
            errors[leg] = LegError(np.linalg.cholesky(covariances[leg]).astype(float), np.zeros(6), fitted=True)
            counts.append(int((after.leg == leg).sum()))
        else:
            moved[leg] = 0.0
            counts.append(0)
    posture = encoded + moved.ravel()
    wheels = np.linalg.norm(wheel_centers(robot, posture) - wheel_centers(robot, encoded), axis=1)
    return PostureFit(posture, tuple(errors), tuple(counts), tuple(float(way) for way in wheels))


def _prior(error: LegError) -> Prior:
    """Sag between none and its bound: half of it, give or take as much."""
    half = 0.5 * error.bend
    return Prior(half, _inverse(error.factor @ error.factor.T + np.outer(half, half)))


def _step(
    found: Residuals, leg: int, prior: Prior, moved: NDArray[np.float64], covariance: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """One Gauss–Newton step of one leg: angles beyond those encoded (6,) and their covariance.

    How far points may lie off counts what is not known of the leg yet, so that the first steps take in more.
    """
    mine = found.leg == leg
    g, distance, variance = found.gradient[mine], found.distance[mine], found.variance[mine]
    unsure = variance + np.einsum("ni,ij,nj->n", g, covariance, g)
    fits = 1.0 / np.square(1.0 + np.square(distance) / (TOLERANCE**2 * unsure))
    weight = fits / (TOGETHER * variance)
    information = prior.information + np.einsum("n,ni,nj->ij", weight, g, g)
    pull = prior.information @ prior.mean + np.einsum(
        "n,ni->i", weight * (distance + np.einsum("ni,i->n", g, moved)), g
    )
    covariance = _inverse(information)
    return covariance @ pull, covariance


def _inverse(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of a symmetric matrix, symmetric to the last bit."""
    inverse = np.linalg.inv(matrix).astype(np.float64)
    return 0.5 * (inverse + inverse.T)


def _cost(found: Residuals, leg: int, seen: NDArray[np.bool_]) -> float:
    """Robust cost of the points ``seen``; those not on the leg cost the most."""
    u = np.square(found.distance[seen]) / (TOLERANCE**2 * found.variance[seen])
    return float(np.where(found.leg[seen] == leg, u / (1.0 + u), 1.0).sum())


def _points(pair: ImagePair, disparity: NDArray[np.float32]) -> Points:
    """Every few pixels a point where the surface is smooth."""
    camera = pair.camera_left
    shifted = disparity + np.float32(stereo.offset(pair))
    # −1e3 beside an unknown pixel makes the range too wide
    whole = np.where(np.isfinite(shifted), shifted, np.float32(-1e3))
    block = np.ones((5, 5), np.uint8)
    smooth = (cv2.dilate(whole, block) - cv2.erode(whole, block) <= SMOOTH) & (whole > 1.0)
    every = max(1, round(camera.width / 160))
    part = np.zeros(smooth.shape, bool)
    part[2:-2:every, 2:-2:every] = True
    rows, cols = np.nonzero(smooth & part)
    d = shifted[rows, cols].astype(np.float64)
    # the disparity of a plane is linear in the image: its gradient is the plane's normal
    du = camera.fx * (shifted[rows, cols + 2] - shifted[rows, cols - 2]) / 4.0
    dv = camera.fy * (shifted[rows + 2, cols] - shifted[rows - 2, cols]) / 4.0
    u, v = (cols - camera.cx) / camera.fx, (rows - camera.cy) / camera.fy
    normal = -np.stack([du, dv, d - u * du - v * dv], -1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    z = camera.fx * pair.baseline / d
    ray = np.stack([u, v, np.ones_like(u)], -1)
    ray, normal = (np.einsum("ij,nj->ni", camera.T_base_camera[:3, :3], one) for one in (ray, normal))
    return Points(
        ray * z[:, None] + camera.T_base_camera[:3, 3],
        normal,
        ray * (z * DISPARITY_SD / d)[:, None],
        EDGE_SD * z / camera.fx,
    )


class _Surfaces:
    """The meshes of the robot, to be placed by a posture; the chassis takes its points, so that no leg does."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        places = {
            name: (leg, k) for leg, spec in enumerate(robot.description.legs) for k, name in enumerate(spec.link_names)
        }
        meshes = robot.description.meshes
        self._names = list(meshes)
        sizes = [len(mesh.triangles) for mesh in meshes.values()]
        self._first = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
        of = np.array([places.get(name, (-1, 0)) for name in meshes])
        self._leg, self._place = np.repeat(of[:, 0], sizes), np.repeat(np.minimum(of[:, 1], 5), sizes)

    def nearest(self, posture: NDArray[np.float64], points: Points) -> tuple[NDArray[np.int64], NDArray, NDArray]:
        """Leg, nearest point (n, 3) and link number of each point."""
        poses = link_poses(self._robot, posture)
        meshes = self._robot.description.meshes
        corners = np.concatenate([frames.apply(poses[n], meshes[n].vertices)[meshes[n].triangles] for n in self._names])
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        triangle, at = nearest_triangles(points.position, points.normal, corners, normals, self._first, REACH, ALIKE)
        return np.where(triangle >= 0, self._leg[triangle], -1), at, self._place[triangle]

    def residuals(self, posture: NDArray[np.float64], points: Points) -> Residuals:
        leg, at, place = self.nearest(posture, points)
        apart = points.position - at
        distance = np.linalg.norm(apart, axis=1)
        direction = np.where(distance[:, None] > 1e-6, apart / np.maximum(distance, 1e-6)[:, None], points.normal)
        gradient = np.zeros((len(leg), 6))
        for i in self._robot.legs:
            mine = leg == i
            J = point_jacobians(*joint_axes(self._robot, posture[6 * i : 6 * i + 6], i), at[mine], place[mine])
            gradient[mine] = np.einsum("ni,nij->nj", direction[mine], J)
        variance = np.square(np.einsum("ni,ni->n", direction, points.along)) + np.square(points.across)
        return Residuals(leg, distance, gradient, variance)
