"""What the cameras of a robot that others described would show, and what its refusals say of ground that nobody saw."""

import numpy as np
import pytest

from footfall.planning.answers import Status
from footfall.planning.legged import walk
from footfall.planning.legged.measured import measured_at_rest
from footfall.planning.legged.problem import LeggedSettings
from footfall.planning.legged.stand import stand
from footfall.planning.legged.step import plan_step
from footfall.planning.legged.walk import plan_walk
from footfall.planning.looking.in_view import in_view
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import fractal
from footfall.terrain.ground.surface import height_at
from footfall.terrain.terrain_settings import terrain_settings_by_leg
from tests.support.cast_in_view import cast_in_view
from tests.support.described import robot_of, seeing

WORLD = fractal(4.0, 0.02, roughness=0.02, seed=3)
HERE, ELSEWHERE = (
    "take images: from here they show it",
    "images from here would hardly show it: take them from elsewhere",
)


@pytest.fixture(scope="module")
def blind():
    return robot_of(6)[1]


@pytest.fixture(scope="module")
def robot(blind):
    return seeing(blind)


def level(*holes):
    """Level ground on which discs (x, y, radius) are unknown."""
    at = np.arange(-200, 201) * 0.01
    heights = np.zeros((len(at), len(at)), np.float32)
    for x, y, radius in holes:
        heights[np.hypot(at - x, (at - y)[:, None]) <= radius] = np.nan
    return from_heights(heights, 0.01, float(at[0]), float(at[0]), "level")


@pytest.fixture(scope="module")
def state(robot):
    return stand(robot, level())


def asked(robot, state, leg, hole):
    return plan_step(robot, level((*hole, 0.03)), state, leg, (float(hole[0]), float(hole[1])))


def test_it_shows_what_rays_of_the_real_cameras_reach(robot):
    settings, state = terrain_settings_by_leg(robot.length), measured_at_rest(robot, WORLD)
    x, y = (one.ravel() for one in np.meshgrid(*[np.arange(-0.49, 0.5, 0.02)] * 2))
    points = np.column_stack([x, y, height_at(WORLD, x, y)])
    found = in_view(robot, WORLD, state, points, settings)
    cast = cast_in_view(robot, WORLD, state, points, settings)
    assert 0.5 < cast.mean() < 0.999
    assert cast[found].mean() >= 0.98
    assert found[cast].mean() >= 0.4  # outlines are widened by what may be wrong with them


def test_ground_in_the_open_is_shown_from_here(robot, state):
    leg = 0
    sole = state.soles[leg, :2]
    away = np.linalg.norm(sole)
    turn = np.pi / len(robot.legs)
    way = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ (sole / away)
    refused = asked(robot, state, leg, away * way)
    assert refused.status is Status.UNKNOWN_GROUND
    assert refused.reason.endswith(f"is not known; {HERE}, or choose a place on ground that is")


def test_ground_beside_a_foot_is_not_promised(robot, state):
    """A leg hides it, and what may be wrong with the leg's outline is left out of maps."""
    for leg in robot.legs:
        sole = state.soles[leg, :2]
        refused = asked(robot, state, leg, sole * (1 + 0.1 / np.linalg.norm(sole)))
        assert refused.status is Status.UNKNOWN_GROUND
        assert f"is not known; {ELSEWHERE}, or choose" in refused.reason


def test_far_ground_is_shown_from_elsewhere(robot, state):
    at = np.arange(-20, 400) * 0.05
    heights = np.zeros((len(at), len(at)), np.float32)
    heights[300:310, 300:310] = np.nan
    dem = from_heights(heights, 0.05, float(at[0]), float(at[0]), "level")
    refused = plan_walk(robot, dem, state, (float(at[304]), float(at[304])))
    assert refused.status is Status.UNKNOWN_GROUND
    assert refused.reason.endswith(f"is not known; {ELSEWHERE}, or choose a place on ground that is")


def test_a_robot_without_cameras_is_told_of_another_place_alone(blind, state):
    refused = asked(blind, state, 0, (0.5, 0.0))
    assert refused.status is Status.UNKNOWN_GROUND
    assert refused.reason.endswith("is not known; choose a place on ground that is")


def test_a_walk_that_ends_where_nobody_saw_says_what_shows_it(robot, blind, state, monkeypatch):
    monkeypatch.setattr(walk, "BACK", 1)
    dem = level(*((x, y, 0.16) for x in (0.7, 0.9) for y in np.arange(-0.9, 1.0, 0.1)))
    settings = LeggedSettings(least_margin=walk.THIN)
    refused = plan_walk(robot, dem, state, (1.3, 0.0), settings)
    assert refused.status is Status.NO_PATH
    assert f"m is not known: {HERE}" in refused.reason
    assert "m is not known" not in plan_walk(blind, dem, state, (1.3, 0.0), settings).reason
