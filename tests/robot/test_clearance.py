"""The compiled clearance check against the exact one: never free where that says no, seldom unsure else."""

import numpy as np
import pytest

from footfall.core.errors import InvalidInput
from footfall.core.frames import rotation_rpy, transform
from footfall.robot import kinematics
from footfall.robot.description import with_payload
from footfall.robot.meshes.collision import GROUND_MODES, CollisionScene
from footfall.robot.model import Robot
from footfall.robot.proof.clearance import MODES, LegClearance, clearance_ground, leg_reach
from footfall.robot.proof.leg_clearance_kernel import RAISED_GROUND, leg_is_clear
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import fractal, plane, slope
from footfall.terrain.ground.triangulate import triangulate
from footfall.terrain.rocks import add_rocks

RAISED = 0.15


def rocky(resolution, seed, size=7.0):
    """Rolling ground with rocks of up to 0.6 m, unknown in patches."""
    rng = np.random.default_rng(seed)
    ground = fractal(size=size, resolution=resolution, roughness=0.1, hurst=0.8, seed=seed)
    rocks = rng.uniform((-size / 2, -size / 2, 0.1, 0.05), (size / 2, size / 2, 0.6, 0.4), (60, 4))
    heights = np.array(add_rocks(ground, rocks).heights)
    x, y = np.moveaxis(ground.geometry.centers(), -1, 0)
    for at, radius in zip(rng.uniform(-size / 2, size / 2, (30, 2)), rng.uniform(0.05, 0.4, 30), strict=True):
        heights[np.hypot(x - at[0], y - at[1]) < radius] = np.nan
    return from_heights(heights, resolution, ground.geometry.x0, ground.geometry.y0)


def standing(robot, rng, tilt=0.1, bend=0.1):
    """A posture near "stand" and a pose of the base that has its wheels about z = 0."""
    nominal = robot.posture("stand")
    posture = np.clip(nominal + bend * rng.normal(size=36), robot.lower, robot.upper)
    height = robot.wheel_radius - kinematics.wheel_centers(robot, nominal)[0, 2]
    roll, pitch = rng.uniform(-tilt, tilt, 2)
    R = rotation_rpy(roll, pitch, rng.uniform(-3, 3))
    return posture, transform(R, (*rng.uniform(-0.5, 0.5, 2), height + rng.uniform(-0.1, 0.2)))


def limits(robot, leg):
    return robot.lower[6 * leg : 6 * leg + 6], robot.upper[6 * leg : 6 * leg + 6]


def near(robot, posture, leg, rng, count, spread=0.3):
    """Joint vectors near the stance with the leg lifted, (count, 6)."""
    lifted = posture[6 * leg : 6 * leg + 6] - (0, 0.35, 0, 0, 0, 0)
    return np.clip(lifted + spread * rng.normal(size=(count, 6)), *limits(robot, leg))


def at_the_edge(check, certain, pool, rng, count):
    """Certified joint vectors next to ones that are not, by bisection: where the proof has least to spare."""
    inside, outside = (rng.choice(pool[which], count) for which in (certain, ~certain))
    for _ in range(30):
        middle = (inside + outside) / 2
        yes = check(middle)[:, None]
        inside, outside = np.where(yes, middle, inside), np.where(yes, outside, middle)
    return inside


CASES = [
    # seed, resolution, leg, payload, clearance
    (1, 0.04, 0, 0.0, 0.0),
    (2, 0.04, 3, 200.0, 0.03),
    (3, 0.10, 5, 0.0, 0.01),
    (4, 0.02, 2, 200.0, 0.0),
]


@pytest.mark.parametrize(("seed", "resolution", "leg", "payload", "clearance"), CASES)
def test_nothing_is_called_free_that_collides(athlete, seed, resolution, leg, payload, clearance):
    rng = np.random.default_rng(seed)
    # the box hangs under the chassis, where the legs can reach it
    robot = Robot(with_payload(athlete.description, payload, (1.0, 1.0, 0.5), (0.0, 0.0, -0.5)))
    dem = rocky(resolution, seed, 6.0)
    posture, T_site_base = standing(robot, rng)
    ground = clearance_ground(robot, dem.heights, dem.geometry, clearance)
    compiled = LegClearance(robot, posture, leg, T_site_base, ground, clearance, RAISED)
    exact = CollisionScene(robot, posture, leg, T_site_base, triangulate(dem), clearance, RAISED)
    pool = np.concatenate([rng.uniform(*limits(robot, leg), (2000, 6)), near(robot, posture, leg, rng, 2000)])
    for mode in GROUND_MODES:
        certain = compiled.certified(pool, mode)
        assert 0.05 < certain.mean() < 0.99
        edge = at_the_edge(lambda qs, mode=mode: compiled.certified(qs, mode), certain, pool, rng, 600)
        for q in np.concatenate([rng.permutation(pool[certain])[:600], edge]):
            assert not exact.collides(q, mode), (mode, q.tolist(), exact.contacts(q, mode))


@pytest.mark.parametrize("mode", GROUND_MODES)
def test_most_of_what_is_free_is_certified(athlete, mode):
    rng = np.random.default_rng(11)
    dem = rocky(0.04, 12)
    posture, T_site_base = standing(athlete, rng, tilt=0.02)
    compiled = LegClearance(
        athlete, posture, 1, T_site_base, clearance_ground(athlete, dem.heights, dem.geometry), 0.0, RAISED
    )
    exact = CollisionScene(athlete, posture, 1, T_site_base, triangulate(dem), 0.0, RAISED)
    qs = np.concatenate([rng.uniform(*limits(athlete, 1), (400, 6)), near(athlete, posture, 1, rng, 400)])
    free = np.array([not exact.collides(q, mode) for q in qs])
    assert 0.1 < free.mean() < 0.95
    assert compiled.certified(qs[free], mode).mean() > 0.9


@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_bodies_wholly_under_the_ground_are_never_certified(athlete, angle):
    # the surface touches nothing, so only the second argument of the proof can refuse
    rng = np.random.default_rng(5)
    posture, T_site_base = standing(athlete, rng)
    dem = slope(12.0, 0.05, angle) if angle else plane(12.0, 0.05)
    buried = transform(translation=(0.0, 0.0, -6.0)) @ T_site_base
    ground = clearance_ground(athlete, dem.heights, dem.geometry)
    compiled = LegClearance(athlete, posture, 2, buried, ground, 0.0, RAISED)
    qs = near(athlete, posture, 2, rng, 500)
    assert not compiled.certified(qs, "raised").any()
    assert not compiled.certified(qs, "true").any()
    assert compiled.certified(qs, "none").mean() > 0.9


def test_a_lifted_wheel_over_level_ground_is_certified_to_the_millimetres(athlete):
    # what a step begins and ends with
    q = athlete.posture("stand")
    height = athlete.wheel_radius - kinematics.wheel_centers(athlete, q)[0, 2]
    dem = plane(8.0, 0.02)
    ground = clearance_ground(athlete, dem.heights, dem.geometry)
    needed = RAISED + athlete.description.clearances.terrain["wheel"]
    for extra, want in ((-0.001, False), (0.006, True)):
        T_site_base = transform(translation=(0.0, 0.0, height + needed + extra))
        leg = LegClearance(athlete, q, 0, T_site_base, ground, 0.0, RAISED)
        assert leg.certified(q[None, :6], "raised")[0] == want
    touching = LegClearance(athlete, q, 0, transform(translation=(0.0, 0.0, height)), ground)
    assert touching.certified(q[None, :6], "true")[0]
    assert not touching.certified(q[None, :6], "raised")[0]


def test_more_clearance_never_certifies_more(athlete):
    rng = np.random.default_rng(8)
    posture, T_site_base = standing(athlete, rng)
    qs = near(athlete, posture, 4, rng, 4000, 0.5)
    few = np.ones(len(qs), bool)
    for clearance in (0.0, 0.01, 0.05):
        yes = LegClearance(athlete, posture, 4, T_site_base, None, clearance).certified(qs, "none")
        assert not (yes & ~few).any()
        few = yes
    assert 0 < few.mean() < 1


def test_unknown_ground_is_no_obstacle(athlete):
    rng = np.random.default_rng(9)
    posture, T_site_base = standing(athlete, rng)
    qs = near(athlete, posture, 0, rng, 1000)
    none = LegClearance(athlete, posture, 0, T_site_base).certified(qs, "raised")
    dem = plane(8.0, 0.05, height=0.5)
    all_unknown = np.full(dem.geometry.shape, np.nan)
    mostly = np.where(np.arange(161) < 2, np.asarray(dem.heights, float), np.nan)
    for heights in (all_unknown, mostly):
        ground = clearance_ground(athlete, heights, dem.geometry)
        compiled = LegClearance(athlete, posture, 0, T_site_base, ground, 0.0, RAISED)
        for mode in GROUND_MODES:
            assert np.array_equal(compiled.certified(qs, mode), none)


def test_answers_do_not_depend_on_how_they_are_asked(athlete):
    rng = np.random.default_rng(10)
    dem = rocky(0.04, 3)
    posture, T_site_base = standing(athlete, rng)
    whole = clearance_ground(athlete, dem.heights, dem.geometry)
    again = clearance_ground(athlete, np.asarray(dem.heights, float), dem.geometry)
    assert whole.cells.tobytes() == again.cells.tobytes()
    qs = near(athlete, posture, 3, rng, 3000)
    compiled = LegClearance(athlete, posture, 3, T_site_base, whole, 0.0, RAISED)
    answers = compiled.certified(qs)
    assert np.array_equal(answers, compiled.certified(qs))
    assert np.array_equal(answers[::-1], compiled.certified(qs[::-1]))
    assert np.array_equal(answers, compiled.certified(qs.tolist()))
    one_by_one = [leg_is_clear(q, compiled.tables, RAISED_GROUND) for q in qs[:200]]
    assert np.array_equal(answers[:200], one_by_one)
    # the site may be turned and shifted as a whole, in steps that the grid does not notice
    moved = transform(translation=(40 * 0.04, -25 * 0.04, 2.0))
    elsewhere = from_heights(
        np.asarray(dem.heights, float) + 2.0, 0.04, dem.geometry.x0 + 40 * 0.04, dem.geometry.y0 - 25 * 0.04
    )
    ground = clearance_ground(athlete, elsewhere.heights, elsewhere.geometry)
    there = LegClearance(athlete, posture, 3, moved @ T_site_base, ground, 0.0, RAISED).certified(qs)
    assert (there != answers).mean() < 0.002


def test_a_cut_out_ground_serves_its_leg_only(athlete):
    rng = np.random.default_rng(12)
    dem = rocky(0.04, 5)
    posture, T_site_base = standing(athlete, rng)
    hips = [(T_site_base @ leg.T_base_hip)[:2, 3] for leg in athlete.description.legs]
    part = clearance_ground(athlete, dem.heights, dem.geometry, 0.0, hips[2], leg_reach(athlete))
    whole = clearance_ground(athlete, dem.heights, dem.geometry)
    assert part.cells.size < whole.cells.size
    qs = np.concatenate([near(athlete, posture, 2, rng, 2000), rng.uniform(*limits(athlete, 2), (2000, 6))])
    a, b = (LegClearance(athlete, posture, 2, T_site_base, g, 0.0, RAISED).certified(qs) for g in (whole, part))
    # coarse tables may begin at another cell
    assert (a != b).mean() < 0.005
    with pytest.raises(InvalidInput, match="another place"):
        LegClearance(athlete, posture, 5, T_site_base, part)


def test_no_ball_gets_farther_than_the_reach(athlete):
    rng = np.random.default_rng(13)
    for q in rng.uniform(*limits(athlete, 0), (300, 6)):
        poses = kinematics.leg_link_poses(athlete, q, 0)
        hip = athlete.description.legs[0].T_base_hip[:3, 3]
        assert max(np.linalg.norm(T[:3, 3] - hip) for T in poses.values()) < leg_reach(athlete)


def test_misuse_is_refused(athlete):
    posture, T_site_base = standing(athlete, np.random.default_rng(0))
    dem = plane(4.0, 0.1)
    ground = clearance_ground(athlete, dem.heights, dem.geometry)
    scene = LegClearance(athlete, posture, 0, T_site_base, ground)
    assert set(MODES) == set(GROUND_MODES)
    with pytest.raises(InvalidInput, match="none, true, raised"):
        scene.certified(posture[None, :6], "soft")
    with pytest.raises(InvalidInput, match="n × 6"):
        scene.certified(posture[:6])
    with pytest.raises(InvalidInput, match="n × 6"):
        scene.certified(posture[None])
    with pytest.raises(InvalidInput, match="clearance"):
        LegClearance(athlete, posture, 0, T_site_base, clearance=-0.1)
    with pytest.raises(InvalidInput, match="raise_terrain"):
        LegClearance(athlete, posture, 0, T_site_base, raise_terrain=np.nan)
    with pytest.raises(InvalidInput, match="smaller clearance"):
        LegClearance(athlete, posture, 0, T_site_base, ground, clearance=0.1)
    with pytest.raises(InvalidInput, match="legs 0 to 5"):
        LegClearance(athlete, posture, 6, T_site_base)
    with pytest.raises(InvalidInput, match="shape"):
        clearance_ground(athlete, dem.heights[1:], dem.geometry)
    for nonsense in (np.nan, np.inf):
        for joint in range(6):
            q = np.array(posture[:6])
            q[joint] = nonsense
            for mode in GROUND_MODES:
                assert not scene.certified(q[None], mode)[0]
    assert scene.certified(np.empty((0, 6))).shape == (0,)
