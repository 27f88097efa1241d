"""The wheel as a drum over steep ground: never free where the meshes collide, and sure where balls are not."""

import numpy as np
import pytest

import footfall
from benchmarks.clearance import clear_span
from footfall.core.frames import rotation_rpy, transform
from footfall.planning.step.situation import RAISED as RAISED_MODE
from footfall.robot.meshes.collision import CollisionScene
from footfall.robot.meshes.ground import surface_points
from footfall.robot.proof.clearance import MODES, LegClearance, clearance_ground, leg_reach
from footfall.robot.proof.drum_kernel import CENTER, HALF, MOST, NONE, RADIUS, REQUIRED, drum_above
from footfall.robot.proof.leg_clearance_kernel import leg_stays_clear
from footfall.robot.proof.leg_span_kernel import UNSURE
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import fractal, plane
from footfall.terrain.ground.triangulate import triangulate

RAISED = 0.15
WHEEL = 6

CASES = [
    # seed, resolution, roughness, leg, clearance
    (4, 0.03, 0.30, 0, 0.0),
    (6, 0.02, 0.25, 3, 0.01),
    (5, 0.05, 0.35, 5, 0.0),
    (2, 0.04, 0.20, 2, 0.02),
]


def stance(robot, seed, resolution, roughness, leg, clearance):
    """A leg over steep ground by both checks of the compiled kind, without and with the drum, and by meshes."""
    dem = fractal(size=6.0, resolution=resolution, roughness=roughness, hurst=0.8, seed=seed)
    state = footfall.stand(robot, dem)
    arguments = robot, state.posture, leg, state.T_site_base
    hip = (np.asarray(state.T_site_base) @ robot.description.legs[leg].T_base_hip)[:2, 3]
    ground = clearance_ground(robot, dem.heights, dem.geometry, clearance, hip, leg_reach(robot))
    balls, drum = (LegClearance(*arguments, ground, clearance, RAISED, one) for one in (False, True))
    exact = CollisionScene(*arguments, triangulate(dem), clearance, RAISED)
    return np.array(state.leg(leg)), balls, drum, exact


def near_the_ground(robot, leg, q, compiled, mode, rng, count):
    """Joint vectors at both sides of where the leg comes too near to the ground alone, by bisection, (count, 6)."""
    own = slice(6 * leg, 6 * leg + 6)
    pool = q - (0, 0.2, 0, 0, 0, 0) + rng.normal(0.0, 0.2, (8000, 6))
    pool = np.clip(pool, robot.lower[own], robot.upper[own])
    pool = pool[compiled.certified(pool, "none")]
    sure = compiled.certified(pool, mode)
    inside, outside = (rng.choice(pool[which], count // 2) for which in (sure, ~sure))
    for _ in range(25):
        middle = (inside + outside) / 2
        yes = compiled.certified(middle, mode)[:, None]
        inside, outside = np.where(yes, middle, inside), np.where(yes, outside, middle)
    return np.concatenate([inside, pool[rng.integers(len(pool), size=count - len(inside))]])


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("mode", ["true", "raised"])
def test_nothing_on_steep_ground_is_called_free_that_collides(athlete, case, mode):
    leg, rng = case[3], np.random.default_rng(case[0])
    q, balls, drum, exact = stance(athlete, *case)
    qs = near_the_ground(athlete, leg, q, drum, mode, rng, 2000)
    sure = drum.certified(qs, mode)
    before = balls.certified(qs, mode)
    assert not (before & ~sure).any()
    # of what balls leave unsure a good part is sure now: there it would be wrong
    assert (sure & ~before).mean() > 0.1
    for one in np.concatenate([qs[sure & ~before], qs[before][:100]]):
        assert not exact.collides(one, mode), (mode, one.tolist(), exact.contacts(one, mode))


@pytest.mark.parametrize("mode", ["true", "raised"])
def test_most_of_what_keeps_off_steep_ground_is_sure(athlete, mode):
    q, balls, drum, exact = stance(athlete, *CASES[0])
    rng = np.random.default_rng(8)
    qs = q - (0, 0.2, 0, 0, 0, 0) + rng.normal(0.0, 0.15, (1500, 6))
    qs = qs[drum.certified(qs, "none")]
    free = qs[[not exact.collides(one, mode) for one in qs]]
    assert len(free) > 200
    assert drum.certified(free, mode).mean() > 0.98 > balls.certified(free, mode).mean()


def test_ranges_and_lines_that_are_called_clear_hold_nothing_that_collides(athlete):
    case = CASES[0]
    q, balls, drum, exact = stance(athlete, *case)
    rng, ranges, lines, more = np.random.default_rng(9), 0, 0, 0
    for mode in ("true", "raised"):
        for one in near_the_ground(athlete, case[3], q, drum, mode, rng, 250):
            one = one - (0, rng.uniform(0.0, 0.03), 0, 0, 0, 0)
            turns = rng.uniform(0.0, rng.choice([0.001, 0.005, 0.02]), 6)
            if leg_stays_clear(one, turns, drum.tables, MODES[mode]):
                ranges += 1
                for corner in one + turns * rng.choice([-1.0, 1.0], (3, 6)):
                    assert not exact.collides(corner, mode)
            d = rng.uniform(-1.0, 1.0, 6)
            half = clear_span(one, d, 0.1, drum.tables, mode)
            assert half >= clear_span(one, d, 0.1, balls.tables, mode)
            if half != UNSURE:
                lines += 1
                more += clear_span(one, d, 0.1, balls.tables, mode) == UNSURE
                for at in (-half, half, rng.uniform(-half, half)):
                    assert not exact.collides(one + at * d, mode)
    assert min(ranges, lines, more) > 30


def over(dem, drum, T, least, enough):
    """drum_above of one drum, a row, over a whole ground, its pose (4, 4)."""
    surface = np.zeros((1, 11))
    grid = dem.geometry
    surface[0, :6] = grid.x0, grid.y0, 1 / grid.resolution, *grid.shape, 0
    poses = np.repeat(T[None, :3], 7, axis=0).copy()
    heights = np.array(dem.heights, float).ravel()
    return drum_above(poses, WHEEL, np.array([drum, drum]), 1, least, enough, 0.0, heights, surface)


def away(points, drum, T):
    """Distances of points (n, 3) from the drum, by its own axes."""
    seen = (points - T[:3, 3]) @ T[:3, :3] - drum[CENTER : CENTER + 3]
    out = np.maximum(np.hypot(seen[:, 0], seen[:, 2]) - drum[RADIUS], 0.0)
    return np.hypot(out, np.maximum(np.abs(seen[:, 1]) - drum[HALF], 0.0))


@pytest.mark.parametrize(("resolution", "holes"), [(0.03, 0.0), (0.03, 0.1), (0.08, 0.0)])
def test_what_is_told_is_below_every_point_of_the_ground_and_near_the_nearest(rng, resolution, holes):
    rough = fractal(size=2.0, resolution=resolution, roughness=0.2, hurst=0.8, seed=5)
    heights = np.array(rough.heights)
    heights[rng.uniform(size=heights.shape) < holes] = np.nan
    dem = from_heights(heights, resolution, rough.geometry.x0, rough.geometry.y0)
    everywhere = surface_points(triangulate(dem), 0.012)
    drum, enough = np.array([0.01, -0.02, 0.005, 0.24, 0.1, 0.02, 0.05]), 0.07
    slack, told = [], 0
    for _ in range(50):
        roll, pitch, yaw = rng.uniform((-0.6, -3, -3), (0.6, 3, 3))
        T = transform(rotation_rpy(roll, pitch, yaw), (*rng.uniform(-0.6, 0.6, 2), 3.0))
        samples = everywhere[np.hypot(*(everywhere[:, :2] - T[:2, 3]).T) < 0.5]
        for _ in range(12):
            T[2, 3] -= away(samples, drum, T).min()  # until it touches
        T[2, 3] += rng.uniform(0.0, 0.15)
        nearest = float(away(samples, drum, T).min())
        bound = over(dem, drum, T, drum[REQUIRED], enough)
        if bound == NONE:
            slack.append(max(nearest - drum[REQUIRED], 0.0))
        else:
            told += 1
            assert drum[REQUIRED] <= bound <= min(nearest + 1e-9, enough)
            slack.append(min(nearest, enough) - bound)
    assert 10 < told < 45
    assert np.median(slack) < 0.005
    assert np.percentile(slack, 95) < 0.025


def test_a_drum_under_the_ground_or_beside_a_wall_above_it_is_not_sure():
    dem, drum = plane(3.0, 0.04), np.array([0.0, 0.0, 0.0, 0.24, 0.1, 0.02, 0.05])
    for height, sure in ((0.27, True), (0.255, False), (0.0, False), (-0.5, False), (-5.0, False)):
        assert (over(dem, drum, transform(translation=(0.0, 0.0, height)), 0.02, 0.07) != NONE) == sure
    # far outside of the map there is no ground
    assert over(dem, drum, transform(translation=(9.0, 0.0, -5.0)), 0.02, 0.07) == pytest.approx(0.07)


def test_a_drum_is_asked_about_no_farther_than_its_ground_is_known(athlete):
    _, balls, drum, _ = stance(athlete, *CASES[0])
    assert not balls.tables.drums.any()
    for row in drum.tables.drums:
        reach = np.hypot(row[RADIUS], row[HALF])
        assert 0.0 <= row[MOST] <= drum.tables.radii[-1] - reach - row[REQUIRED] + 1e-12
    assert drum.tables.drums[MODES[RAISED_MODE], REQUIRED] > drum.tables.drums[MODES["true"], REQUIRED] > 0.0
