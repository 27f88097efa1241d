"""What is shown of matching and masking is what a build uses, and the rover's pixels are the rover."""

from dataclasses import replace

import numpy as np
import pytest

from footfall.core import frames
from footfall.core.errors import InvalidImages, InvalidInput, NotFound
from footfall.core.mesh import Mesh
from footfall.sim.raycast import RayScene
from footfall.telemetry.images import Snapshot
from footfall.telemetry.projection import sight
from footfall.terrain.build import build_terrain
from footfall.terrain.matched import match_pairs
from footfall.terrain.pair_views import (
    FREE,
    RIM,
    RIM_RGB,
    ROBOT,
    ROBOT_RGB,
    UNMATCHED_RGB,
    disparity_picture,
    mask_picture,
    ramp,
    silhouette,
    snapshot_views,
)
from footfall.terrain.rover_mask.selfmask import robot_parts
from footfall.terrain.terrain_settings import TerrainSettings


@pytest.fixture(scope="module")
def some(rock_snapshot) -> Snapshot:
    """Three of the pairs, one of which can't be used."""
    front, side, dark = rock_snapshot.pairs[6], rock_snapshot.pairs[0], rock_snapshot.pairs[1]
    return Snapshot(rock_snapshot.state, (front, side, replace(dark, left=np.zeros_like(dark.left))))


@pytest.fixture(scope="module")
def views(athlete, some):
    return snapshot_views(athlete, some)


def shows_robot(robot, state, camera) -> np.ndarray:
    """Pixels whose ray hits a part of the robot: the second, independent method."""
    T = frames.inverse(camera.T_base_camera)
    parts = robot_parts(robot, state.posture)
    scene = RayScene([Mesh(frames.apply(T @ T_part, mesh.vertices), mesh.triangles) for mesh, T_part in parts])
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    hits = scene.first_hits(np.zeros(3), sight(camera, u, v).reshape(-1, 3))
    return ((hits.body >= 0) & (hits.distance > 0.051)).reshape(u.shape)


def test_disparities_are_those_of_a_build(views, some):
    matched = {one.pair.name: one.disparity for one in match_pairs(some.pairs, TerrainSettings())[0]}
    for view in views.pairs[:2]:
        assert view.disparity is not None
        assert np.array_equal(view.disparity, matched[view.name], equal_nan=True)
        known = view.disparity[np.isfinite(view.disparity)]
        low, high = view.ends
        assert (known < low).mean() == pytest.approx(0.01, abs=0.002)
        assert (known > high).mean() == pytest.approx(0.01, abs=0.002)
        camera, baseline = some.pairs[0].camera_left, some.pairs[0].baseline
        if view.name == some.pairs[0].name:
            assert view.ranges == pytest.approx([camera.fx * baseline / low, camera.fx * baseline / high], rel=1e-5)
        assert 0 < view.used <= np.isfinite(view.disparity).mean()
    assert views.pairs[0].used < np.isfinite(views.pairs[0].disparity).mean()  # it shows legs


def test_the_mask_is_the_rover_as_rays_see_it(athlete, some, views):
    pair, view = some.pairs[0], views.of(some.pairs[0].name)
    truth = shows_robot(athlete, some.state, pair.camera_left)
    assert truth.mean() > 0.05
    assert (view.mask[truth] != FREE).all()
    # what counts as the rover for sure is it, but for the pixels that its outline crosses and what the fit moved
    assert truth[view.mask == ROBOT].mean() > 0.9
    told = silhouette(athlete, some.state, pair.camera_left)
    assert not (truth & ~told).any()
    assert truth[told].mean() > 0.95
    assert (view.mask == RIM).any()


def test_a_pair_that_cannot_be_used_says_why(athlete, some, views):
    dark = views.of(some.pairs[2].name)
    assert dark.disparity is None
    assert dark.used == 0
    assert "black" in dark.reason
    with pytest.raises(InvalidImages, match="black"):
        disparity_picture(dark)
    assert mask_picture(dark, some.pairs[2]).shape == (*dark.mask.shape, 3)
    with pytest.raises(NotFound, match="haz0"):
        views.of("other")
    none = snapshot_views(athlete, Snapshot(some.state, some.pairs[2:]))
    assert "black" in none.pairs[0].reason
    assert "encoders" in none.legs


def test_pictures_have_their_own_colour_for_the_unknown_and_the_rover(some, views):
    view, pair = views.pairs[0], some.pairs[0]
    picture, colours = disparity_picture(view), ramp()
    assert colours.shape == (256, 3)
    unknown = np.isnan(view.disparity)
    assert (picture[unknown] == UNMATCHED_RGB).all()
    assert not (picture[~unknown] == UNMATCHED_RGB).all(axis=1).any()
    order = np.argsort(view.disparity[~unknown])
    green = picture[~unknown][order][:, 1].astype(int)  # viridis: the larger, the greener
    assert (np.diff(green) >= 0).all()
    assert (green[0], green[-1]) == (colours[0, 1], colours[-1, 1])
    mask = mask_picture(view, pair)
    free = view.mask == FREE
    assert np.array_equal(mask[free], np.repeat(pair.left[free][:, None], 3, axis=1))
    grey = pair.left[..., None].astype(float)
    for kind, colour, share in ((ROBOT, ROBOT_RGB, 1.0), (RIM, RIM_RGB, 0.5)):
        tinted = np.abs(mask - (0.45 * grey + 0.55 * np.array(colour))).max(axis=-1) <= 1
        assert tinted[view.mask == kind].mean() == pytest.approx(share, abs=0.15)


def test_a_terrain_is_built_from_the_chosen_pairs_alone(athlete, some):
    front = some.pairs[0].name
    chosen = build_terrain(athlete, some, TerrainSettings(pairs=(front,)))
    alone = build_terrain(athlete, Snapshot(some.state, some.pairs[:1]))
    assert np.array_equal(chosen.heights, alone.heights, equal_nan=True)
    assert chosen.sources == (front,)
    assert set(chosen.left_out) == {pair.name for pair in some.pairs[1:]}
    assert all("not chosen" in reason for reason in chosen.left_out.values())
    assert "not chosen" in chosen.name
    with pytest.raises(InvalidInput, match="no pair elsewhere"):
        build_terrain(athlete, some, TerrainSettings(pairs=("elsewhere",)))


def test_settings_without_a_choice_are_what_they_were():
    before = TerrainSettings(view="common")
    assert before.digest == "aa810adba5b189f8097a90b9dcf9b9cd"  # of the recorded samples
    assert TerrainSettings(pairs=("nav0",)).digest != TerrainSettings().digest
