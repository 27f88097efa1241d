"""What the cameras of a rover would show, against rays cast at every body, and against maps made of images."""

from dataclasses import replace

import numpy as np
import pytest

import footfall
from footfall.core.frames import apply
from footfall.planning.answers import Status
from footfall.planning.looking.how_to_see import LIFTED, how_to_see, unknown_around
from footfall.planning.looking.in_view import in_view
from footfall.robot.kinematics import wheel_centers
from footfall.sim.render import render_snapshot
from footfall.terrain.build import build_terrain
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import rock_field
from footfall.terrain.ground.surface import height_at
from footfall.terrain.terrain_settings import TerrainSettings
from tests.support.cast_in_view import cast_in_view

SETTINGS = TerrainSettings(resolution=0.05)


@pytest.fixture(scope="module")
def rocks():
    return rock_field(size=12.0, resolution=0.05, abundance=0.03, smallest=0.1, largest=0.4, seed=3)


@pytest.fixture(scope="module")
def state(athlete, rocks):
    return footfall.stand(athlete, rocks, 0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def points(rocks):
    """Ground every 10 cm, as far as a map reaches."""
    x, y = (one.ravel() for one in np.meshgrid(*[np.arange(-3.95, 4.0, 0.1)] * 2))
    return np.column_stack([x, y, height_at(rocks, x, y)])


def test_it_shows_what_rays_of_the_real_cameras_reach(athlete, rocks, state, points):
    found, cast = (shows(athlete, rocks, state, points, SETTINGS) for shows in (in_view, cast_in_view))
    assert 0.5 < cast.mean() < 0.99
    assert cast[found].mean() >= 0.98  # the ground is looked at once a cell
    assert found[cast].mean() >= 0.93  # the rover's outline is widened by what may be wrong with it


def test_a_map_made_of_images_knows_what_is_in_view_and_hardly_more(athlete, rocks, state, points):
    images = render_snapshot(athlete, state, rocks, seed=1, scale=0.5)
    built = build_terrain(athlete, images, SETTINGS)
    known, found = np.isfinite(height_at(built, *points[:, :2].T)), in_view(athlete, rocks, state, points, SETTINGS)
    assert known[found].mean() >= 0.93
    assert known[~found].mean() <= 0.5


def test_cameras_that_are_not_asked_show_nothing(athlete, rocks, state, points):
    name = athlete.description.cameras[0].name
    one, all_of_them = (in_view(athlete, rocks, state, points, SETTINGS, pairs) for pairs in ([name], None))
    assert 0 < one.sum() < all_of_them.sum()
    assert all_of_them[one].all()
    assert not in_view(athlete, rocks, state, points, SETTINGS, []).any()
    assert (in_view(athlete, rocks, state, points, replace(SETTINGS, pairs=(name,))) == one).all()


def level(hole):
    """Level ground on which a disc (x, y, radius) is unknown."""
    at = np.arange(-600, 601) * 0.02
    heights = np.zeros((len(at), len(at)), np.float32)
    heights[np.hypot(at - hole[0], (at - hole[1])[:, None]) <= hole[2]] = np.nan
    return from_heights(heights, 0.02, float(at[0]), float(at[0]), "level")


@pytest.fixture(scope="module")
def stands(athlete):
    return footfall.stand(athlete, level((50.0, 50.0, 0.1)))


@pytest.mark.parametrize("leg", range(6))
def test_ground_around_a_wheel_is_hidden_by_its_leg(athlete, stands, leg):
    wheel = apply(stands.T_site_base, wheel_centers(athlete, stands.posture))[leg]
    out = wheel[:2] / np.linalg.norm(wheel[:2])
    behind = wheel[:2] + 0.1 * out
    dem = level((*behind, 0.08))
    assert how_to_see(athlete, dem, stands, behind, 0.24).startswith(f"leg {leg} hides it")
    hidden = unknown_around(dem, behind, 0.24)
    assert len(hidden)
    assert not in_view(athlete, dem, stands, hidden).any()
    refused = footfall.plan_step(athlete, dem, stands, leg, target=tuple(behind))
    assert refused.status is Status.UNKNOWN_GROUND
    assert f"leg {leg} hides it: take images while that leg is {LIFTED:g} m up" in refused.reason


def test_ground_in_the_open_is_shown_from_here_and_far_ground_from_elsewhere(athlete, stands):
    between = np.array([2.2 * np.cos(np.pi / 6), 2.2 * np.sin(np.pi / 6)])
    assert how_to_see(athlete, level((*between, 0.1)), stands, between, 0.24) == "take images: from here they show it"
    far = np.array([11.0, 0.0])
    assert how_to_see(athlete, level((*far, 0.1)), stands, far, 0.24).startswith("no camera sees it from here")
    assert how_to_see(athlete, level((*far, 0.1)), stands, between, 0.24) == ""
    assert how_to_see(athlete, level((5.0, 5.0, 1.0)), stands, (5.0, 5.0), 0.24) == ""  # nothing is known there
