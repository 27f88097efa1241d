"""One iteration of a gait: it goes on from where the last one ended, or leaves the rover where it stands."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import MultiPoint

import footfall
from footfall.planning.choice.actions import OFFSET, TRIPOD, TRIPOD_ASIDE, WAVE
from footfall.planning.choice.choice_settings import ChoiceSettings
from footfall.planning.choice.iteration import iterate, mishap_of, onto_of, support_of
from footfall.planning.choice.reward import Came
from footfall.telemetry.state import RobotState
from footfall.terrain.from_arrays import from_heights

SETTINGS = ChoiceSettings()


def rolling():
    x, y = np.meshgrid(np.arange(-6, 6.05, 0.1), np.arange(-6, 6.05, 0.1))
    return from_heights((0.03 * np.sin(1.1 * x) * np.cos(0.9 * y)).astype(np.float32), 0.1, -6.0, -6.0, "made")


def resting() -> RobotState:
    return RobotState("athlete", 0.0, np.zeros(36), np.eye(4), np.zeros((6, 3)), np.zeros(36), "idle")


def test_mishaps_by_the_check_that_fails():
    assert [mishap_of(name) for name in ("balance", "torque", "collision of legs 1 and 2", "reach", "swing")] == [
        "tip",
        "torque",
        "collision",
        "",
        "",
    ]


def test_iterations_go_on_from_where_the_last_one_ended(athlete):
    dem = rolling()
    state, goal = footfall.stand(athlete, dem), np.array([1.0, 0.2])
    for action in (TRIPOD, WAVE):
        before, to = state, onto_of(state, goal, SETTINGS.ahead)
        done = iterate(athlete, dem, state, action, goal, SETTINGS)
        assert not done.came.refused, done.reason
        assert done.plan is not None
        state = done.state
        np.testing.assert_allclose(done.plan.waypoints[0], before.posture, atol=1e-9)
        np.testing.assert_allclose(done.state.T_site_base[:2, 3], to, atol=0.02)
        assert done.came.distance == pytest.approx(
            np.hypot(*(goal - before.T_site_base[:2, 3])) - np.hypot(*(goal - state.T_site_base[:2, 3]))
        )
        stances = [
            MultiPoint(np.delete(stance.contacts, group, axis=0)[:, :2]).convex_hull.area
            for stance, group in zip(done.plan.stances[:-1], done.plan.groups, strict=True)
        ]
        assert support_of(done.plan) == pytest.approx(np.mean(stances))
        # no joint goes faster than its share of its limit
        turned = np.abs(np.diff(done.plan.waypoints, axis=0)).max(axis=1).sum()
        least = turned / (SETTINGS.speed * athlete.speed_limits.max()) + SETTINGS.pause * done.came.foot_moves
        assert done.came.time >= least - 1e-9
    np.testing.assert_allclose(state.T_site_base[:2, 3], goal, atol=0.02)


def test_what_is_refused_leaves_the_rover_where_it_stands(athlete):
    dem = rolling()
    state = footfall.stand(athlete, dem)
    weak = replace(SETTINGS, gaits=replace(SETTINGS.gaits, most_torque=0.05))
    done = iterate(athlete, dem, state, TRIPOD, np.array([3.0, 0.0]), weak)
    assert done.came == Came(refused=True, mishap="torque")
    assert done.state is state
    assert done.plan is None
    assert "torque" in done.reason


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_iteration_aside_is_a_tripod_to_there_and_wins_less_way(side, athlete):
    dem = rolling()
    state, goal = footfall.stand(athlete, dem), np.array([3.0, 0.0])
    done = iterate(athlete, dem, state, TRIPOD_ASIDE, goal, SETTINGS, offset=side * OFFSET)
    assert done.plan is not None, done.reason
    assert all(len(group) == 3 for group in done.plan.groups if len(group) > 1)
    to = state.T_site_base[:2, 3] + 0.6 * np.array([np.cos(OFFSET), side * np.sin(OFFSET)])
    np.testing.assert_allclose(done.state.T_site_base[:2, 3], to, atol=0.02)
    assert 0.45 < done.came.distance < 0.6


@given(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), st.floats(0.2, 1.0), st.sampled_from([OFFSET, -OFFSET]))
def test_aside_is_turned_from_the_goal_and_never_farther_than_that(x, y, ahead, offset):
    """Second method: lengths and the angle between."""
    goal, state = np.array([x, y]), resting()
    away = np.hypot(x, y)
    onto = onto_of(state, goal, ahead, offset)
    assert np.hypot(*onto) == pytest.approx(min(ahead, away))
    if away > 1e-6:
        turned = np.arctan2(x * onto[1] - y * onto[0], onto @ goal)
        assert turned == pytest.approx(offset)


@given(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), st.floats(0.2, 1.0))
def test_iterations_are_about_as_long_as_asked(x, y, ahead):
    goal, state = np.array([x, y]), resting()
    onto = onto_of(state, goal, ahead)
    away, gone = np.hypot(x, y), np.hypot(*onto)
    assert gone <= 1.5 * ahead + 1e-9
    assert gone + np.hypot(*(goal - onto)) == pytest.approx(away)
    # either there, or what is left is at least half an iteration
    assert (onto == goal).all() or np.hypot(*(goal - onto)) >= 0.5 * ahead - 1e-9
