"""Alignment with the map, and the map of a moving rover whose pose is wrong."""

# What is optional is there by construction; where it is not, the test fails on its own.
# pyright: reportArgumentType=false
# pyright: reportCallIssue=false
# pyright: reportOptionalMemberAccess=false
# pyright: reportOptionalSubscript=false

from dataclasses import replace

import numpy as np
import pytest

from footfall.core import frames
from footfall.core.errors import InvalidImages
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.sim.render import render_snapshot
from footfall.telemetry.images import Snapshot
from footfall.terrain.build import build_terrain
from footfall.terrain.dem import Dem
from footfall.terrain.fusion import align as alignment
from footfall.terrain.fusion.align import SURPRISING, align
from footfall.terrain.generate import plane
from footfall.terrain.ground.surface import height_at
from footfall.terrain.terrain_settings import TerrainSettings

CENTER = np.array([0.5, -0.2, 1.0])


def hills(x, y):
    return 0.15 * np.sin(2.1 * x) * np.cos(1.7 * y) + 0.05 * np.sin(5.0 * x + 3.0 * y)


def hilly_map(noise=0.0, rng=None) -> Dem:
    grid = GridGeometry(-3.0, -3.0, 0.02, 301, 301)
    heights = hills(*np.meshgrid(grid.xs, grid.ys))
    if rng is not None:
        heights = heights + rng.normal(0, noise, heights.shape)
    return Dem(heights.astype(np.float32), grid, "hills", Provenance({}))


def wrong_by(shift, rpy_deg) -> np.ndarray:
    """The transform that a wrong pose does to points."""
    R = frames.rotation_rpy(*np.radians(rpy_deg))
    return frames.transform(R, CENTER + shift - R @ CENTER)


def points_on_hills(rng, n=8000, noise=0.003):
    xy = rng.uniform(-2.5, 2.5, (n, 2))
    return np.column_stack([xy, hills(*xy.T) + rng.normal(0, noise, n)]), np.full(n, 0.01)


@pytest.mark.parametrize(
    ("shift", "turn"),
    [((0.03, -0.02, 0.015), (0.8, -0.6, 1.0)), ((-0.05, 0.04, 0.03), (-1.0, 0.9, -1.4)), ((0, 0, 0), (0, 0, 0))],
)
def test_recovers_a_planted_pose_error(rng, shift, turn):
    points, deviation = points_on_hills(rng)
    wrong = wrong_by(shift, turn)
    found = align(hilly_map(0.003, rng), frames.apply(wrong, points), deviation, CENTER)
    left = found.correction @ wrong
    assert np.linalg.norm(frames.apply(left, CENTER) - CENTER) < 0.002
    assert np.degrees(np.arccos(min(1.0, (np.trace(left[:3, :3]) - 1) / 2))) < 0.05
    assert found.after < 0.004
    assert found.shift == pytest.approx(np.linalg.norm(shift), abs=0.003)
    # the identity's rotation measured another way: by the angle that quaternions say
    w = frames.quat_wxyz(found.correction[:3, :3])[0]
    assert found.turn == pytest.approx(2 * np.arccos(min(1.0, w)), abs=1e-6)


def test_outliers_do_not_pull(rng):
    points, deviation = points_on_hills(rng)
    points[:2000, 2] += rng.uniform(0.1, 0.6, 2000)
    wrong = wrong_by((0.03, 0.02, -0.02), (0.5, 0.7, -0.8))
    found = align(hilly_map(), frames.apply(wrong, points), deviation, CENTER)
    assert np.abs(found.correction @ wrong - np.eye(4)).max() < 0.003


def test_what_a_plane_does_not_tell_stays(rng):
    ground = plane(6.0, 0.02)
    xy = rng.uniform(-2, 2, (5000, 2))
    points = np.column_stack([xy, rng.normal(0.02, 0.003, 5000)])
    found = align(ground, points, np.full(5000, 0.01), np.zeros(3))
    assert found.correction[2, 3] == pytest.approx(-0.02, abs=1e-3)
    assert np.abs(found.correction[:2, 3]).max() < 1e-3
    assert abs(found.correction[1, 0]) < 1e-4


def test_a_jump_is_refused(rng):
    points, deviation = points_on_hills(rng)
    with pytest.raises(InvalidImages, match=r"moved by 0\.2\d m"):
        align(hilly_map(), frames.apply(wrong_by((0.0, 0.0, 0.22), (0, 0, 0)), points), deviation, CENTER)
    with pytest.raises(InvalidImages, match=r"°; at most") as caught:
        align(hilly_map(), frames.apply(wrong_by((0, 0, 0), (4.5, 0, 0)), points), deviation, CENTER)
    assert np.degrees(caught.value.details["turn"]) == pytest.approx(4.5, abs=0.2)
    elsewhere = points + np.array([0.0, 0.0, 2.0])
    with pytest.raises(InvalidImages, match="lie within"):
        align(hilly_map(), elsewhere, deviation, CENTER)


def test_no_common_ground_moves_nothing(rng):
    points, deviation = points_on_hills(rng)
    found = align(hilly_map(), points + np.array([50.0, 0.0, 0.0]), deviation, CENTER)
    assert np.array_equal(found.correction, np.eye(4))
    assert "not aligned" in found.text


def test_is_the_same_in_any_order_of_the_points(rng):
    points, deviation = points_on_hills(rng)
    wrong = frames.apply(wrong_by((0.02, 0.01, 0.01), (0.3, 0.2, 0.5)), points)
    first = align(hilly_map(), wrong, deviation, CENTER)
    order = rng.permutation(len(points))
    assert np.array_equal(first.correction, align(hilly_map(), wrong[order], deviation, CENTER).correction)


def absolute_errors(dem: Dem, world: Dem) -> np.ndarray:
    error = np.abs(dem.heights - height_at(world, *np.meshgrid(dem.geometry.xs, dem.geometry.ys)))
    return error[np.isfinite(error)]


def test_six_snapshots_with_wrong_poses_do_not_blur_the_map(athlete, rocks, standing):
    """Of each pose after the first, position and rotation are wrong by 3 cm and 1° in a random direction."""
    rng = np.random.default_rng(7)
    map, alone = None, np.empty(0)
    for i in range(6):
        state = standing(athlete, rocks, yaw=0.3 + 0.1 * i)
        T_site_base = state.T_site_base.copy()
        T_site_base[:2, 3] += 0.2 * i, 0.1 * i
        snapshot = render_snapshot(
            athlete, replace(state, T_site_base=T_site_base), rocks, seed=i, scale=0.5, pairs=["nav0", "nav2", "nav4"]
        )
        told = T_site_base.copy()
        if i:
            shift, axis = rng.normal(size=3), rng.normal(size=3)
            told[:3, 3] += 0.03 * shift / np.linalg.norm(shift)
            told[:3, :3] = frames.rotation_rpy(*np.radians(axis / np.linalg.norm(axis))) @ told[:3, :3]
        wrong = Snapshot(
            replace(state, T_site_base=told, time=60.0 * i),
            tuple(replace(pair, T_site_base=told, time=60.0 * i) for pair in snapshot.pairs),
        )
        map = build_terrain(athlete, wrong, TerrainSettings(keep=True), map=map)
        if i == 0:
            alone = absolute_errors(build_terrain(athlete, snapshot), rocks)
        else:
            left = map.correction @ told @ frames.inverse(T_site_base)
            assert np.linalg.norm(frames.apply(left, T_site_base[:3, 3]) - T_site_base[:3, 3]) < 0.02
    final = absolute_errors(map, rocks)
    assert np.median(final) < np.median(alone)
    assert np.quantile(final, 0.95) < np.quantile(alone, 0.95) + 0.005
    assert len(final) > 1.2 * len(alone)
    assert (map.time[np.isfinite(map.time)] == 300.0).any()
    assert (map.time[np.isfinite(map.time)] == 0.0).any()
    assert map.sources == ("nav0", "nav2", "nav4")
    assert "onto the map" in map.name
    assert set(map.provenance.parents) == {"snapshot", "robot", "map"}


def test_starting_anew_forgets_the_map(athlete, rock_snapshot, rock_dem):
    few = Snapshot(rock_snapshot.state, rock_snapshot.pairs[:1])
    anew = build_terrain(athlete, few, TerrainSettings(keep=False), map=rock_dem)
    assert np.array_equal(anew.heights, build_terrain(athlete, few).heights, equal_nan=True)
    assert anew.correction is None


def test_variance_tells_the_error(rock_dem, rocks):
    """Errors in the standard deviations that the map claims: honest, and not more than three times too wide."""
    error = rock_dem.heights - height_at(rocks, *np.meshgrid(rock_dem.geometry.xs, rock_dem.geometry.ys))
    known = np.isfinite(error)
    deviations = np.abs(error[known]) / np.sqrt(rock_dem.variance[known])
    assert (deviations < 2.0).mean() > 0.93
    assert np.median(deviations) > 0.67 / 3
    assert np.median(rock_dem.variance[known & (rock_dem.count >= 2)]) < np.median(rock_dem.variance[known])


def ripples(rng):
    """Ground that is flat but for waves of a few millimetres."""
    ways = rng.uniform(0.0, 2.0 * np.pi, 6)
    waves = [(rng.uniform(1.0, 5.0), way, rng.uniform(0.0, 2.0 * np.pi)) for way in ways]
    return lambda x, y: sum(0.0008 * np.sin(k * (np.cos(a) * x + np.sin(a) * y) + phase) for k, a, phase in waves)


def seen_twice(seed, rocks=(), shift=(0.0, 0.0)):
    """A map of almost flat ground, and points whose errors are half those of the map, but moved with the rover.

    rocks: (x, y, height) of rocks half a metre wide on both; shift: of all points by the pose's error.
    """
    rng = np.random.default_rng(seed)
    own, other, grid = ripples(rng), ripples(rng), GridGeometry(-3.0, -3.0, 0.02, 301, 301)

    def ground(x, y):
        return sum(h * np.exp(-((x - at) ** 2 + (y - on) ** 2) / 0.25**2) for at, on, h in rocks) + 0.0 * x

    x, y = np.meshgrid(grid.xs, grid.ys)
    map = Dem((ground(x, y) + own(x, y)).astype(np.float32), grid, "ripples", Provenance({}))
    xy = rng.uniform(-2.5, 2.5, (8000, 2))
    heights = ground(*xy.T) + 0.55 * own(*(xy - (0.1, 0.03)).T) + 0.45 * other(*xy.T) + rng.normal(0, 0.001, 8000)
    return map, np.column_stack([xy + shift, heights]), np.full(8000, 0.001)


def test_ripples_of_millimetres_do_not_move_the_rover_far(monkeypatch):
    scenes = [seen_twice(seed) for seed in range(8)]
    most = SURPRISING * TerrainSettings().pose_shift
    shifts = np.array([align(*scene, CENTER).shift for scene in scenes])
    assert shifts.max() <= most
    # by the least squares alone most of them would
    monkeypatch.setattr(alignment, "CLEARLY", -np.inf)
    misled = np.array([align(*scene, CENTER).shift for scene in scenes])
    assert (misled > most).sum() > len(scenes) / 2
    assert np.array_equal(shifts, np.where(misled > most, 0.0, misled))


def test_a_surprising_shift_that_the_ground_tells_is_believed():
    rocks = [(-1.5, 1.0, 0.2), (0.4, -1.2, 0.3), (1.6, 0.8, 0.15), (-0.6, -0.3, 0.1), (0.9, 1.7, 0.25)]
    found = align(*seen_twice(3, rocks, (0.12, -0.05)), CENTER)
    assert found.shift > SURPRISING * TerrainSettings().pose_shift
    assert np.linalg.norm(frames.apply(found.correction, CENTER + np.array([0.12, -0.05, 0.0])) - CENTER) < 0.02
