from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import maximum_filter

from footfall.core import frames
from footfall.core.errors import Cancelled, InvalidImages, InvalidInput
from footfall.core.mesh import Mesh
from footfall.core.progress import no_progress
from footfall.robot.kinematics import wheel_centers
from footfall.sim.raycast import RayScene
from footfall.sim.render import render_snapshot
from footfall.telemetry.images import ImagePair, Snapshot
from footfall.telemetry.state import RobotState
from footfall.terrain.build import AT_WHEEL, all_samples, build_terrain, grid_around
from footfall.terrain.dem import Dem
from footfall.terrain.generate import plane, step
from footfall.terrain.ground.surface import height_at
from footfall.terrain.ground.triangulate import triangulate
from footfall.terrain.matched import Matched
from footfall.terrain.photographs import terrain_from_pairs
from footfall.terrain.rover_mask.selfmask import robot_depths, robot_parts
from footfall.terrain.rover_mask.taken_out import APART, BESIDE, MAYBE, NEAR, SMEARED, without_robot
from footfall.terrain.terrain_settings import TerrainSettings


def errors(dem: Dem, world: Dem) -> np.ndarray:
    """Height of each cell above the true surface, NaN where unknown."""
    x, y = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    return dem.heights - height_at(world, x, y)


def distance_to(dem: Dem, state: RobotState) -> np.ndarray:
    x, y = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    return np.hypot(x - state.T_site_base[0, 3], y - state.T_site_base[1, 3])


def test_accuracy_on_a_rock_field(rock_dem, rocks, rock_state):
    error = errors(rock_dem, rocks)
    known = np.isfinite(error)
    near = known & (distance_to(rock_dem, rock_state) < 3.0)
    assert near.sum() > 0.85 * (distance_to(rock_dem, rock_state) < 3.0).sum()
    assert np.median(np.abs(error[near])) < 0.008
    assert np.quantile(np.abs(error[near]), 0.95) < 0.03
    assert (np.abs(error[known]) > 0.1).mean() < 0.005
    assert abs(np.median(error[known])) < 0.004


def test_small_rises_say_that_they_may_be_higher(athlete, rock_snapshot, rock_dem, rocks, monkeypatch):
    """Planes over windows flatten them, which no difference of the images tells: it shows in their variance."""
    cells = np.isfinite(rock_dem.heights)
    x, y = np.meshgrid(rock_dem.geometry.xs, rock_dem.geometry.ys)
    truth = height_at(rocks, x, y)
    rises = cells & (truth - np.median(truth) > 0.04)
    assert rises.sum() > 500

    def too_low(dem: Dem, where: np.ndarray) -> float:
        """Share of cells that are lower than the truth by more than three standard deviations."""
        assert dem.variance is not None
        return float((errors(dem, rocks) < -3.0 * np.sqrt(dem.variance))[where].mean())

    monkeypatch.setattr("footfall.terrain.build.off_plane", lambda disparity, along, down: np.zeros_like(disparity))
    without = build_terrain(athlete, rock_snapshot)
    assert too_low(rock_dem, rises) < 0.6 * too_low(without, rises)
    # elsewhere heights stay about as sure as they were
    assert np.nanmedian(rock_dem.variance / without.variance) < 1.3


def test_ground_that_no_camera_saw_stays_unknown(athlete, rock_dem, rocks, rock_snapshot):
    """Visibility by casting a ray from every camera to every cell, an independent method; rocks and legs hide."""
    x, y = np.meshgrid(rock_dem.geometry.xs, rock_dem.geometry.ys)
    points = np.stack([x, y, height_at(rocks, x, y) + 0.004], -1).reshape(-1, 3)
    state = rock_snapshot.state
    robot = [
        Mesh(frames.apply(state.T_site_base @ T_base_part, mesh.vertices), mesh.triangles)
        for mesh, T_base_part in robot_parts(athlete, state.posture)
    ]
    scene = RayScene([triangulate(rocks), *robot])
    seen = np.zeros(len(points), bool)
    for pair in rock_snapshot.pairs:
        camera = pair.camera_left
        T = pair.T_site_base @ camera.T_base_camera
        p = (points - T[:3, 3]) @ T[:3, :3]
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v = camera.fx * p[:, 0] / p[:, 2] + camera.cx, camera.fy * p[:, 1] / p[:, 2] + camera.cy
        inside = (p[:, 2] > 0) & (np.abs(2 * u - camera.width) < camera.width + 4)
        inside &= np.abs(2 * v - camera.height) < camera.height + 4
        hits = scene.first_hits(T[:3, 3], points - T[:3, 3])
        seen |= inside & ((hits.body < 0) | (hits.distance > 0.999))
    seen = seen.reshape(x.shape)
    wide = np.pad(seen, 4)
    n, m = seen.shape
    near_seen = np.any([wide[i : i + n, j : j + m] for i in range(9) for j in range(9)], axis=0)
    assert (~near_seen).sum() > 1000
    assert np.isfinite(rock_dem.heights[~near_seen]).mean() < 0.01


def test_a_cliff_hides_what_is_below_it(athlete, standing):
    world = step(12.0, 0.02, height=-0.8, edge=3.0)
    state = standing(athlete, step(12.0, 0.02, height=0.0, edge=3.0), yaw=0.0)
    snapshot = render_snapshot(athlete, state, world, scale=0.5, pairs=["nav0", "nav5"])
    dem = build_terrain(athlete, snapshot, TerrainSettings())
    x, y = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    known = np.isfinite(dem.heights)
    # the cameras at most 1.5 m from x = 0 and 1.7 m up see over the edge at a slope of 1.7 / 1.5 or flatter
    hidden = (x > 3.08) & (x < 3.35) & (np.abs(y) < 2.0)
    assert known[(x > 2.4) & (x < 2.9) & (np.abs(y) < 1.5)].mean() > 0.6
    assert known[hidden].mean() < 0.02


def test_nothing_of_the_legs_stands_in_the_terrain(athlete, standing):
    """On level ground every height above the noise would be the robot's own body."""
    ground = plane(14.0, 0.5)
    state = standing(athlete, ground)
    snapshot = render_snapshot(athlete, state, ground, pairs=["haz0", "haz1", "haz2", "nav0"])
    dem = build_terrain(athlete, snapshot, TerrainSettings())
    known = np.isfinite(dem.heights)
    assert known.mean() > 0.5
    assert np.abs(dem.heights[known]).max() < 0.1
    wheels = wheel_centers(athlete, state.posture) @ state.T_site_base[:3, :3].T + state.T_site_base[:3, 3]
    x, y = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    for wheel in wheels:
        around = known & (np.hypot(x - wheel[0], y - wheel[1]) < 0.6)
        assert around.any()
        assert np.abs(dem.heights[around]).max() < 0.08


def test_beside_a_leg_goes_what_is_as_near_as_it_and_the_ground_behind_stays(athlete, standing):
    """Matching carries a leg's disparity on over its mask."""
    ground = plane(14.0, 0.5)
    state = standing(athlete, ground)
    pair = render_snapshot(athlete, state, ground, scale=0.5, pairs=["haz0"]).pairs[0]
    camera = pair.camera_left
    in_left, in_right = (robot_depths(athlete, state, one, extra_px=2) for one in (camera, pair.camera_right))
    deepest = float(in_left[np.isfinite(in_left)].max())
    for depth, goes in ((0.5, True), (deepest + 0.5, False)):
        disparity = np.full(pair.left.shape, camera.fx * pair.baseline / depth, np.float32)
        kinds = without_robot(disparity, pair, athlete, state, TerrainSettings())
        rows, cols = np.indices(disparity.shape)
        partner = np.clip(np.rint(cols - camera.fx * pair.baseline / depth).astype(int), 0, camera.width - 1)
        drawn = np.isinf(in_left) | np.isinf(in_right[rows, partner])
        assert np.array_equal(np.isnan(disparity), drawn)
        rim = ~drawn & ((in_left > 0) | (in_right[rows, partner] > 0))
        assert rim.any()
        assert (kinds[rim] == MAYBE).all()
        next_to = ~drawn & ~rim & (np.roll(in_left, SMEARED, 1) > 0) & (cols >= SMEARED)
        assert next_to.any()
        assert (kinds[next_to] == (MAYBE if goes else BESIDE)).all()


def test_beside_the_robot_depths_have_to_be_surer_and_no_pixel_shows_ground_alone(athlete, standing):
    ground = plane(14.0, 0.5)
    state = standing(athlete, ground)
    pair = render_snapshot(athlete, state, ground, scale=0.5, pairs=["haz0"]).pairs[0]
    camera, shift = pair.camera_left, 20.0
    disparity = np.full(pair.left.shape, shift, np.float32)
    kinds = without_robot(disparity, pair, athlete, state, TerrainSettings())
    rims = [
        (depths > 0) & np.isfinite(depths)
        for depths in (robot_depths(athlete, state, one, extra_px=2) for one in (camera, pair.camera_right))
    ]
    near = [maximum_filter(rim, 2 * NEAR + 1) for rim in rims]
    rows, cols = np.indices(disparity.shape)
    beside = near[0] | near[1][rows, np.maximum(cols - int(shift), 0)]
    assert np.array_equal(kinds == APART, ~beside & (kinds != MAYBE))
    assert 0.1 < beside.mean() < 0.9

    def cells(deviation, gap, kind):
        """How many are known, surely and at all, of images that show the ground throughout, but for the middle of each
        nine pixels."""
        seen = np.full(disparity.shape, shift, np.float32)
        if gap:
            seen[1::3, 1::3] = np.nan
        flat = np.zeros_like(seen)
        one = Matched(pair, seen, np.full_like(seen, deviation), (flat, flat), np.full(seen.shape, kind, np.uint8))
        samples = all_samples([one], 1, np.eye(4), grid_around(0.0, 0.0, settings), settings, no_progress)
        sure, doubtful = (np.unique(which.cell) for which in samples[0])
        return len(sure), len(np.union1d(sure, doubtful))

    settings = replace(TerrainSettings(), max_edge=1.0, half_size=30.0, resolution=0.1)
    z = camera.fx * pair.baseline / shift
    unsure = 0.5 * (settings.max_deviation + settings.max_deviation_beside) / z**2 * camera.fx * pair.baseline
    every, in_all = cells(unsure, False, APART)
    assert every == in_all > 0
    for deviation, kind in ((unsure, BESIDE), (unsure, MAYBE), (0.01 * unsure, MAYBE)):
        surely, in_all = cells(deviation, False, kind)
        assert surely == 0
        assert in_all >= every
    every, _ = cells(0.01 * unsure, True, APART)
    surely, in_all = cells(0.01 * unsure, True, BESIDE)
    assert 0 < surely < 0.9 * every
    assert in_all >= every


def test_doubtful_pixels_fill_gaps_and_nothing_under_a_wheel(athlete, rock_snapshot, rock_dem, rocks):
    sure = build_terrain(athlete, rock_snapshot, TerrainSettings(doubtful_deviation=0.0))
    known = np.isfinite(sure.heights)
    # but for cells that the sure ones alone would not keep either
    assert np.mean(sure.heights[known] == rock_dem.heights[known]) > 0.99
    added = np.isfinite(rock_dem.heights) & ~known
    assert 0.01 < added.sum() / known.sum() < 0.1
    error = np.abs(errors(rock_dem, rocks)[added])
    assert np.nanmedian(error) < 0.01
    assert np.nanquantile(error, 0.95) < 0.08  # at half the resolution, rocks included
    # what was doubtful is said to be less sure
    assert np.median(rock_dem.variance[added]) > 1.5 * np.nanmedian(rock_dem.variance[known])
    state = rock_snapshot.state
    x, y = np.meshgrid(sure.geometry.xs, sure.geometry.ys)
    for wheel in frames.apply(state.T_site_base, wheel_centers(athlete, state.posture)):
        at = np.hypot(x - wheel[0], y - wheel[1])
        assert not (added & (at < AT_WHEEL - 0.05)).any()  # wheels are where the images show them, to centimetres
        assert (added & (at < 2.0 * AT_WHEEL)).any()


def test_without_the_self_filter_the_legs_would_stand_there(athlete, standing):
    """The test above can fail: with the robot thought to be folded elsewhere, its legs turn into ground."""
    ground = plane(14.0, 0.5)
    state = standing(athlete, ground)
    snapshot = render_snapshot(athlete, state, ground, scale=0.5, pairs=["haz0", "haz1", "haz2"])
    folded = RobotState(
        state.robot,
        state.time,
        np.tile([1.5, -1.5, 2.0, 0.0, 0.0, 0.0], 6),
        state.T_site_base,
        state.wheel_forces,
        state.joint_torques,
        state.mode,
    )
    dem = build_terrain(athlete, Snapshot(folded, snapshot.pairs), TerrainSettings())
    assert np.nanmax(dem.heights) > 0.3


def test_the_same_input_gives_the_same_terrain(athlete, rock_snapshot, rock_dem):
    again = build_terrain(athlete, rock_snapshot, TerrainSettings())
    assert again.digest == rock_dem.digest
    backwards = Snapshot(rock_snapshot.state, rock_snapshot.pairs[::-1])
    assert np.array_equal(build_terrain(athlete, backwards).heights, rock_dem.heights, equal_nan=True)


def test_provenance_names_what_it_came_from(athlete, rock_snapshot, rock_dem):
    assert dict(rock_dem.provenance.parents) == {"snapshot": rock_snapshot.digest, "robot": athlete.digest}
    assert rock_dem.provenance.settings.digest == TerrainSettings().digest
    assert rock_dem.name == "images, 9 pairs"


def test_texture_shows_the_ground(rock_dem):
    known = np.isfinite(rock_dem.heights)
    assert rock_dem.texture[known].min() > 0
    assert not rock_dem.texture[~known].any()
    assert rock_dem.texture[known].std() > 10


def blackened(pair: ImagePair) -> ImagePair:
    black = np.zeros_like(pair.left)
    return ImagePair(pair.name, pair.time, black, pair.right, pair.camera_left, pair.camera_right, pair.T_site_base)


def test_bad_pairs_are_left_out_and_named(athlete, rock_snapshot):
    good, bad, *_ = rock_snapshot.pairs
    dem = build_terrain(athlete, Snapshot(rock_snapshot.state, (good, blackened(bad))))
    only = build_terrain(athlete, Snapshot(rock_snapshot.state, (good,)))
    assert dem.name == f"images, 1 pair, without {bad.name} (the left image is black)"
    assert list(dem.left_out) == [bad.name]
    assert "can be used" in dem.left_out[bad.name]
    assert np.array_equal(dem.heights, only.heights, equal_nan=True)


def test_no_usable_pair_is_refused_with_each_reason(athlete, rock_snapshot):
    pairs = tuple(blackened(pair) for pair in rock_snapshot.pairs[:2])
    with pytest.raises(InvalidImages, match=r"nav0.*black.*nav1.*black") as caught:
        build_terrain(athlete, Snapshot(rock_snapshot.state, pairs))
    assert set(caught.value.details["pairs"]) == {"nav0", "nav1"}


def test_another_robots_snapshot_is_refused(athlete, rock_snapshot):
    s = rock_snapshot.state
    other = RobotState("spider", s.time, s.posture, s.T_site_base, s.wheel_forces, s.joint_torques, s.mode)
    with pytest.raises(InvalidImages, match="spider"):
        build_terrain(athlete, Snapshot(other, rock_snapshot.pairs))


def test_progress_grows_to_one_and_cancels(athlete, rock_snapshot):
    few = Snapshot(rock_snapshot.state, rock_snapshot.pairs[:2])
    seen: list[float] = []
    build_terrain(athlete, few, progress=lambda fraction, text: seen.append(fraction))
    assert seen == sorted(seen)
    assert (seen[0], seen[-1]) == (0.0, 1.0)

    def stop(fraction: float, text: str) -> None:
        if fraction > 0.3:
            raise Cancelled("stop")

    with pytest.raises(Cancelled):
        build_terrain(athlete, few, progress=stop)


def test_grid_lies_on_multiples_of_the_resolution():
    settings = TerrainSettings()
    for x, y in ((0.0, 0.0), (1.2345, -7.891), (-0.01, 0.01)):
        grid = grid_around(x, y, settings)
        assert grid.shape == (401, 401)
        for origin, center in ((grid.x0, x), (grid.y0, y)):
            assert origin / 0.02 == pytest.approx(round(origin / 0.02), abs=1e-6)
            assert abs(origin + 4.0 - center) <= 0.01 + 1e-9


def test_single_pair_straight_down(make_pair, speckle):
    """Everything 20 px apart: a level plane at depth f·B/20 = 2 m, thus at height 0."""
    pair = make_pair(np.ascontiguousarray(speckle[:, 40:200]), np.ascontiguousarray(speckle[:, 60:220]))
    dem = terrain_from_pairs([pair], TerrainSettings(min_range=1.0, half_size=1.0))
    known = np.isfinite(dem.heights)
    assert 0.2 < known.mean() < 0.9
    assert np.median(np.abs(dem.heights[known])) < 0.005
    assert dict(dem.provenance.parents) == {"down": pair.digest}
    row, col = dem.geometry.cell(0.0, 0.0)
    assert known[row, col]


def test_single_pair_out_of_range_is_refused(make_pair, speckle):
    pair = make_pair(np.ascontiguousarray(speckle[:, 40:200]), np.ascontiguousarray(speckle[:, 60:220]))
    with pytest.raises(InvalidImages, match="nothing lies within"):
        terrain_from_pairs([pair], TerrainSettings(min_range=1.0, max_range=1.5))
    with pytest.raises(InvalidImages, match="none of the matched points"):
        terrain_from_pairs([pair], TerrainSettings(min_range=1.0, half_size=1.0), center=(50.0, 0.0))


@pytest.mark.parametrize(
    "wrong",
    [
        {"matcher": "best"},
        {"resolution": 0.0},
        {"half_size": 1e6},
        {"block_size": 4},
        {"min_range": 9.0},
        {"max_jump": 0.0},
        {"mask_margin": -1.0},
        {"fitted_margin": -1.0},
        {"least_angle": 0.6},
        {"max_deviation": 0.0},
        {"max_deviation_beside": float("inf")},
    ],
)
def test_wrong_settings_are_refused(wrong):
    with pytest.raises(InvalidInput):
        TerrainSettings(**wrong)


def test_heights_are_not_biased(athlete, standing):
    """Errors of level ground cancel out: what is left of OpenCV's rounding is under a millimetre near the rover."""
    ground = plane(14.0, 0.5)
    state = standing(athlete, ground)
    dem = build_terrain(athlete, render_snapshot(athlete, state, ground, pairs=["nav0", "haz1"]))
    near = np.isfinite(dem.heights) & (distance_to(dem, state) < 3.0)
    assert abs(float(np.median(dem.heights[near]))) < 0.0008
