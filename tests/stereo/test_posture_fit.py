"""Joint errors planted in rendered pairs and found again."""

import numpy as np
import pytest

from footfall.core import frames
from footfall.robot.kinematics import wheel_centers
from footfall.sim.render import RenderScene, render_pair, render_snapshot
from footfall.telemetry.images import Snapshot
from footfall.telemetry.state import RobotState
from footfall.terrain.build import build_terrain
from footfall.terrain.generate import plane
from footfall.terrain.ground.triangulate import triangulate
from footfall.terrain.pairs import stereo
from footfall.terrain.rover_mask.leg_errors import ENCODER_SD, SAG, encoder_and_sag_errors
from footfall.terrain.rover_mask.posture_fit import fit_posture
from footfall.terrain.terrain_settings import TerrainSettings


def with_posture(state: RobotState, posture: np.ndarray) -> RobotState:
    zeros = np.zeros((6, 3)), np.zeros(36)
    return RobotState(state.robot, state.time, posture, state.T_site_base, *zeros, state.mode)


@pytest.fixture(scope="module")
def true_state(athlete, standing) -> RobotState:
    rng = np.random.default_rng(11)
    state = standing(athlete, plane(14.0, 0.5))
    return with_posture(state, state.posture + rng.uniform(-0.06, 0.06, 36))


@pytest.fixture(scope="module")
def told(athlete, true_state) -> np.ndarray:
    """What encoders with errors say of legs that sag."""
    posture = true_state.posture + np.random.default_rng(12).normal(0.0, ENCODER_SD, 36)
    bends = [error.bend for error in encoder_and_sag_errors(athlete, true_state.posture)]
    return posture - np.concatenate(bends)


@pytest.fixture(scope="module")
def snapshot(athlete, true_state, told) -> Snapshot:
    """On level ground: every height above the noise is the robot's own body."""
    images = render_snapshot(athlete, true_state, plane(14.0, 0.5), pairs=["haz0", "haz1", "haz2"], seed=4)
    return Snapshot(with_posture(true_state, told), images.pairs)


@pytest.fixture(scope="module")
def matched(snapshot):
    return [(pair, stereo.disparity(pair, TerrainSettings())) for pair in snapshot.pairs]


def wheel_errors(athlete, posture, true_state) -> np.ndarray:
    return np.linalg.norm(wheel_centers(athlete, posture) - wheel_centers(athlete, true_state.posture), axis=1)


def test_planted_errors_are_found(athlete, told, true_state, matched):
    fit = fit_posture(athlete, told, matched)
    before, after = (wheel_errors(athlete, q, true_state) for q in (told, fit.posture))
    assert sum(count > 0 for count in fit.points) >= 5
    assert np.median(after) < 0.4 * np.median(before)
    assert fit.moved == pytest.approx(
        np.linalg.norm(wheel_centers(athlete, fit.posture) - wheel_centers(athlete, told), axis=1)
    )
    assert f"up to {max(fit.moved):.3f} m" in fit.text


def test_what_remains_wrong_is_within_what_the_fit_says(athlete, told, true_state, matched):
    """Squared errors over their covariance are χ² of six: below 27.9 in all but 0.01 % if the covariance is right."""
    fit = fit_posture(athlete, told, matched)
    for leg, error in enumerate(fit.errors):
        if not error.fitted:
            continue
        off = (fit.posture - true_state.posture)[6 * leg : 6 * leg + 6]
        assert np.square(np.linalg.solve(error.factor, off)).sum() < 27.9
        prior = encoder_and_sag_errors(athlete, told)[leg]
        wide = prior.factor @ prior.factor.T + 0.25 * np.outer(prior.bend, prior.bend)
        assert np.linalg.eigvalsh(wide - error.factor @ error.factor.T).min() > -1e-12


def test_without_evidence_the_legs_stay_as_told(athlete, told, matched):
    nothing = [(pair, np.full_like(disparity, np.nan)) for pair, disparity in matched]
    fit = fit_posture(athlete, told, nothing)
    assert np.array_equal(fit.posture, told)
    assert fit.points == (0,) * 6
    for error, prior in zip(fit.errors, encoder_and_sag_errors(athlete, told), strict=True):
        assert not error.fitted
        assert np.array_equal(error.factor, prior.factor)
        assert np.array_equal(error.bend, prior.bend)
    assert "no leg" in fit.text


def test_ground_alone_is_no_evidence(athlete, told, true_state):
    """Pairs that show the ground and no robot at all."""
    scene = RenderScene(triangulate(plane(14.0, 0.5)))
    pairs = [
        render_pair(scene, true_state, athlete.description.camera_pair(name), scale=0.5) for name in ("haz0", "haz1")
    ]
    fit = fit_posture(athlete, told, [(pair, stereo.disparity(pair, TerrainSettings())) for pair in pairs])
    assert np.array_equal(fit.posture, told)
    assert not any(error.fitted for error in fit.errors)


def test_a_leg_told_far_off_moves_no_further_than_its_errors_may(athlete, told, matched):
    wrong = told.copy()
    wrong[0] += np.deg2rad(8.0)  # hip yaw, sixteen standard deviations
    fit, right = fit_posture(athlete, wrong, matched), fit_posture(athlete, told, matched)
    prior = encoder_and_sag_errors(athlete, wrong)[0]
    mean, covariance = 0.5 * prior.bend, prior.factor @ prior.factor.T + 0.25 * np.outer(prior.bend, prior.bend)
    away = fit.posture[:6] - wrong[:6] - mean
    assert not fit.errors[0].fitted or away @ np.linalg.solve(covariance, away) < 20.1
    for leg in range(1, 6):
        assert np.allclose(fit.posture[6 * leg : 6 * leg + 6], right.posture[6 * leg : 6 * leg + 6], atol=2e-3)


def test_the_order_of_the_pairs_does_not_matter(athlete, told, matched):
    one, other = fit_posture(athlete, told, matched), fit_posture(athlete, told, matched[::-1])
    assert np.array_equal(one.posture, other.posture)
    assert all(np.array_equal(a.factor, b.factor) for a, b in zip(one.errors, other.errors, strict=True))


def test_more_ground_is_known_and_still_nothing_of_the_legs(athlete, snapshot, true_state):
    said = []
    fitted = build_terrain(athlete, snapshot, progress=lambda share, text: said.append(text))
    as_encoded = build_terrain(athlete, snapshot, TerrainSettings(fit_legs=False))
    assert any("legs found in the images" in text for text in said)
    wheels = frames.apply(true_state.T_site_base, wheel_centers(athlete, true_state.posture))
    x, y = np.meshgrid(fitted.geometry.xs, fitted.geometry.ys)
    around = np.any([np.hypot(x - w[0], y - w[1]) < 0.6 for w in wheels], axis=0)
    assert np.isfinite(fitted.heights[around]).sum() > 1.1 * np.isfinite(as_encoded.heights[around]).sum()
    assert np.nanmax(fitted.heights[around]) < 0.05


def test_a_sagging_leg_bends_as_far_as_the_bound_says(athlete):
    posture = athlete.posture("stand")
    error = encoder_and_sag_errors(athlete, posture)[0]
    moved = np.r_[posture[:6] + error.bend, posture[6:]]
    rise = wheel_centers(athlete, moved)[0] - wheel_centers(athlete, posture)[0]
    assert rise[2] == pytest.approx(SAG, rel=0.05)
