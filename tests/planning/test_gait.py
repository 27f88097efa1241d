"""Gaits: on level ground they hold, feet that stand don't move, and where ground breaks them the check is named."""

import numpy as np
import pytest
from shapely.geometry import MultiPoint, Point

import footfall
from footfall.planning.gait.problem import TRIPOD, WAVE
from footfall.planning.step.problem import Status
from footfall.planning.walk.recheck.stretches import Stretch
from footfall.robot.kinematics import wheel_pose
from footfall.terrain.from_arrays import from_heights

DUTY = {TRIPOD: 1 / 2, WAVE: 5 / 6}


def ground(change=None):
    x, _ = np.meshgrid(np.arange(-6, 6.05, 0.1), np.arange(-6, 6.05, 0.1))
    z = np.zeros(x.shape) if change is None else change(x)
    return from_heights(z.astype(np.float32), 0.1, -6.0, -6.0, "made")


@pytest.fixture(scope="module")
def level(athlete):
    dem = ground()
    return dem, footfall.stand(athlete, dem)


@pytest.mark.parametrize("gait", [TRIPOD, WAVE])
@pytest.mark.parametrize("azimuth", [0.0, 0.7, 2.5])
def test_level_ground(athlete, level, gait, azimuth):
    dem, state = level
    goal = (np.cos(azimuth), np.sin(azimuth))
    result = footfall.plan_gait(athlete, dem, state, goal, gait)
    assert result.status is Status.FOUND, result.reason
    plan = result.plan
    assert np.allclose(plan.Ts_site_base[-1, :2, 3], goal, atol=1e-6)
    assert plan.duty == pytest.approx(DUTY[gait])
    for leg in athlete.legs:
        assert np.mean([leg not in group for group in plan.groups]) == pytest.approx(plan.duty)
    for i in range(0, len(plan.steps), 17):
        stance = plan.stances[plan.steps[i]]
        for leg in np.flatnonzero(plan.standing[i]):
            T = plan.Ts_site_base[i] @ wheel_pose(athlete, plan.waypoints[i], int(leg))
            np.testing.assert_allclose(T, stance.Ts_site_wheel[leg], atol=1e-6)
    # margins by other means: centre of mass by pin, polygon by shapely
    i = int(np.argmin(plan.margins))
    one = slice(i, i + 1)
    still = Stretch(
        athlete, 0, None, plan.waypoints[one], plan.Ts_site_base[one], np.zeros(1, int), np.zeros(1), ("body",)
    )
    feet = MultiPoint(plan.stances[plan.steps[i]].contacts[plan.standing[i], :2]).convex_hull
    com = Point(still.coms_site[0, :2])
    assert feet.contains(com)
    assert plan.margins[i] == pytest.approx(feet.exterior.distance(com), abs=1e-6)
    assert result.digest == footfall.plan_gait(athlete, dem, state, goal, gait).digest


@pytest.mark.parametrize(
    ("change", "names"),
    [
        (lambda x: np.where(x > 2.9, 2.5, 0.0), {"reach", "terrain collision", "joint limits"}),
        (lambda x: np.where(x > 2.9, np.nan, 0.0), {"unknown ground"}),
    ],
    ids=["wall", "hole"],
)
def test_broken_ground(athlete, change, names):
    dem = ground(change)
    result = footfall.plan_gait(athlete, dem, footfall.stand(athlete, dem), (2.0, 0.0))
    assert result.status is Status.NO_PATH
    first = result.failures[0]
    assert first.check_name in names
    assert result.reason.startswith(first.told)
    assert result.walked < 2.0
    if result.failed is not None and first.check_name != "unknown ground":
        assert np.flatnonzero(result.failed.failing)[0] == first.sample
