"""What a step must not take for granted: the state it is given, where feet touch, settings that mean nothing."""

import itertools
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from footfall.core.errors import InvalidInput
from footfall.core.frames import rotation, transform
from footfall.maps.layers import NO_SOLUTION, OUT_OF_RANGE, UNKNOWN, MapSettings
from footfall.maps.standing import contacts, standing, wheel_gaps
from footfall.planning.answers import Status
from footfall.planning.body.stand import stand
from footfall.planning.scene.ground import Contact, footfall_contact
from footfall.planning.step.leg_maps import compute_maps
from footfall.planning.step.plan import plan_step
from footfall.planning.step.problem import StepSettings
from footfall.planning.step.search.edges import Space
from footfall.planning.step.target import candidates
from footfall.robot.ik import leg_azimuth, solve_leg, wheel_pose_for_contact
from footfall.robot.kinematics import center_of_mass, wheel_pose
from footfall.telemetry.state import RobotState
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import plane, slope
from footfall.terrain.ground.surface import height_at, normal_at

TARGET = (2.05, 0.45)


@pytest.fixture(scope="module")
def level(athlete):
    dem = plane(8.0, 0.1)
    return dem, stand(athlete, dem)


def rolling(east=0.0, north=0.0):
    """Smooth hills at 10 cm, with the map's middle at (east, north)."""
    x = np.linspace(-4, 4, 81)
    X, Y = np.meshgrid(x, x)
    heights = 0.08 * np.sin(1.9 * X + 0.3) * np.cos(1.4 * Y) + 0.05 * np.sin(2.6 * Y - X)
    return from_heights(heights.astype(np.float32), 0.1, east - 4.0, north - 4.0, "rolling")


def with_joint(state: RobotState, joint: int, angle: float) -> RobotState:
    posture = np.array(state.posture)
    posture[joint] = angle
    return replace(state, posture=posture)


def lifted(state: RobotState, height: float) -> RobotState:
    return replace(state, T_site_base=transform(translation=(0, 0, height)) @ state.T_site_base)


def test_a_foot_in_the_air_carries_nothing(athlete, level):
    dem, state = level
    raised = with_joint(state, 19, state.posture[19] - 0.15)
    result = plan_step(athlete, dem, raised, 0, TARGET)
    gap = wheel_pose(athlete, raised.posture, 3)[2, 3] - wheel_pose(athlete, state.posture, 3)[2, 3]
    assert result.status is Status.START_INVALID
    told = re.search(r"leg 3 is to carry the rover but is ([0-9.]+) m above", result.reason)
    assert told is not None, result.reason
    assert float(told[1]) == pytest.approx(gap, abs=0.01)
    assert "leg 2" not in result.reason


def test_a_rover_that_floats_or_is_sunk_is_a_fiction(athlete, level):
    dem, state = level
    floating = plan_step(athlete, dem, lifted(state, 0.1), 0, TARGET)
    assert floating.status is Status.START_INVALID
    assert "leg 5 is to carry the rover but is 0.10 m above the ground" in floating.reason
    sunk = plan_step(athlete, dem, lifted(state, -0.1), 0, TARGET)
    assert sunk.status is Status.START_INVALID
    assert "leg 5 is 0.10 m in the ground" in sunk.reason


def test_a_leg_in_the_air_may_still_be_the_one_that_moves(athlete, level):
    dem, state = level
    result = plan_step(athlete, dem, with_joint(state, 1, state.posture[1] - 0.1), 0, TARGET)
    assert result.status is Status.FOUND, result.reason


def test_over_unseen_ground_a_foot_is_believed(athlete, level):
    dem, state = level
    heights = np.array(dem.heights)
    grid = dem.geometry
    foot = state.T_site_base @ wheel_pose(athlete, state.posture, 3)
    heights[np.hypot(*(grid.centers() - foot[:2, 3]).transpose(2, 0, 1)) < 0.6] = np.nan
    holed = from_heights(heights, grid.resolution, grid.x0, grid.y0, "hole")
    assert np.isnan(wheel_gaps(athlete, holed, state.posture, state.T_site_base, [3])).all()
    result = plan_step(athlete, holed, state, 0, TARGET)
    assert result.status is Status.FOUND, result.reason
    assert any("taken as level under legs 3" in check.where for check in result.checks)


def test_a_standing_leg_through_a_rock_is_told(athlete, level):
    dem, state = level
    heights = np.array(dem.heights)
    knee = state.T_site_base @ wheel_pose(athlete, state.posture, 3)
    inward = 0.45 * knee[:2, 3] / np.linalg.norm(knee[:2, 3])
    centers = dem.geometry.centers()
    heights[np.hypot(*(centers - (knee[:2, 3] - inward)).transpose(2, 0, 1)) < 0.12] = 1.5
    pillar = from_heights(heights, dem.geometry.resolution, dem.geometry.x0, dem.geometry.y0, "pillar")
    result = plan_step(athlete, pillar, state, 0, TARGET)
    assert result.status is Status.START_INVALID
    assert "leg3_" in result.reason
    assert "below the ground" in result.reason


@pytest.mark.parametrize(("joint", "excess"), [(5, 1.5e-3), (23, 1.5e-3), (23, 0.5)])
def test_any_joint_outside_its_limits_is_named_with_a_size(athlete, level, joint, excess):
    dem, state = level
    result = plan_step(athlete, dem, with_joint(state, joint, athlete.upper[joint] + excess), 0, TARGET)
    assert result.status is Status.START_INVALID
    assert f"{athlete.joint_names[joint]} is {excess:.2g} rad outside" in result.reason


@pytest.mark.parametrize("least", [-5.0, -1e-6, float("nan"), float("inf")])
def test_a_margin_that_allows_falling_is_refused(least):
    with pytest.raises(InvalidInput, match="least_margin"):
        StepSettings(least_margin=least)
    with pytest.raises(InvalidInput, match="stable_margin"):
        MapSettings(stable_margin=least)


def tilted_stance(robot, dem, base: RobotState, roll: float, pitch: float) -> RobotState:
    """The same contacts with the chassis turned."""
    T = np.array(base.T_site_base)
    T[:3, :3] = T[:3, :3] @ rotation("y", pitch) @ rotation("x", roll)
    T[2, 3] -= 0.05
    feet = contacts(robot, dem, base.posture, base.T_site_base, list(robot.legs)).points
    posture = np.array(base.posture)
    for leg, (x, y, _) in enumerate(feet):
        point, normal = np.array([x, y, height_at(dem, x, y)]), normal_at(dem, x, y, robot.wheel_radius)
        wheel = wheel_pose_for_contact(robot, point, normal, leg_azimuth(robot, leg, T), T)
        found = solve_leg(robot, leg, wheel[None])
        own = slice(6 * leg, 6 * leg + 6)
        away = np.where(found.valid[0], np.abs(found.q[0] - posture[own]).max(axis=1), np.inf)
        assert away.min() < np.inf
        posture[own] = found.q[0][int(np.argmin(away))]
    return replace(base, posture=posture, T_site_base=T)


def touching(robot, state: RobotState, leg: int, normal: np.ndarray) -> np.ndarray:
    """The rim's lowest point along a normal, by trying all around the rim."""
    T = state.T_site_base @ wheel_pose(robot, state.posture, leg)
    angle = np.linspace(0, 2 * np.pi, 200_001)
    rim = T[:3, 3] + robot.wheel_radius * (np.cos(angle)[:, None] * T[:3, 0] + np.sin(angle)[:, None] * T[:3, 2])
    return rim[int(np.argmin(rim @ normal))]


def test_on_a_slope_feet_touch_uphill_of_their_lowest_point(athlete):
    angle = np.deg2rad(12)
    dem = slope(10.0, 0.1, angle=float(angle), uphill=0.5)
    state = stand(athlete, dem, yaw=0.3)
    normal = np.array([-np.sin(angle) * np.cos(0.5), -np.sin(angle) * np.sin(0.5), np.cos(angle)])
    found = contacts(athlete, dem, state.posture, state.T_site_base, list(athlete.legs))
    assert np.allclose(found.normals, normal, atol=1e-5)
    expected = np.array([touching(athlete, state, leg, normal) for leg in athlete.legs])
    assert np.allclose(found.points, expected, atol=2e-5)
    assert np.allclose(found.points[:, 2], height_at(dem, *found.points[:, :2].T), atol=1e-4)
    lowest = np.array([touching(athlete, state, leg, np.array([0, 0, 1.0])) for leg in athlete.legs])
    uphill = np.array([np.cos(0.5), np.sin(0.5)])
    assert ((found.points - lowest)[:, :2] @ uphill > 0.01).any()


def test_the_balance_of_a_tilted_rover_on_a_slope_by_a_second_method(athlete):
    dem = slope(10.0, 0.1, angle=0.2, uphill=1.0)
    state = tilted_stance(athlete, dem, stand(athlete, dem, yaw=0.4), 0.08, -0.12)
    normal = normal_at(dem, 0.0, 0.0, 0.2)
    feet = np.array([touching(athlete, state, leg, normal)[:2] for leg in range(1, 6)])
    hull = ConvexHull(feet)
    start = touching(athlete, state, 0, normal)
    target = (float(start[0] + 0.15), float(start[1] - 0.2))
    result = plan_step(athlete, dem, state, 0, target)
    assert result.plan is not None, result.reason
    least = np.inf
    q = result.plan.waypoints
    for a, b in itertools.pairwise(q):
        for t in np.linspace(0, 1, 60):
            com = state.T_site_base[:3] @ np.append(center_of_mass(athlete, a + t * (b - a)), 1.0)
            least = min(least, -(hull.equations[:, :2] @ com[:2] + hull.equations[:, 2]).max())
    balance = next(check for check in result.checks if check.name.startswith("balance"))
    assert balance.margin == pytest.approx(least, abs=5e-5)
    # the lift goes along the site's vertical, not the chassis'
    tops = {q.tobytes() for q in q[: result.plan.phases.index("swing")]}
    centers = np.array(
        [(state.T_site_base @ wheel_pose(athlete, np.frombuffer(one), 0))[:3, 3] for one in sorted(tops)]
    )
    assert np.ptp(centers[:, :2], axis=0).max() < 1e-6
    assert np.ptp(centers[:, 2]) == pytest.approx(0.2, abs=1e-9)


def test_a_map_does_not_stand_on_a_foot_in_the_air(athlete, level):
    dem, state = level
    raised = state
    for leg in (1, 2, 3):
        raised = with_joint(raised, 6 * leg + 1, state.posture[6 * leg + 1] - 0.2)
    assert standing(athlete, dem, raised.posture, raised.T_site_base, list(athlete.legs)) == [0, 4, 5]
    margins = np.asarray(compute_maps(athlete, dem, raised, 0).layers["margin"], float)
    # legs 4, 5 and 0 alone can't hold the middle of the hexagon wherever leg 0 stands
    assert np.nanmax(margins) < 0


@pytest.mark.parametrize("tilt", [0.0, 0.03])
def test_the_reach_map_and_the_goals_agree(athlete, rng, tilt):
    dem = rolling()
    state = stand(athlete, dem, yaw=0.4)
    if tilt:
        state = tilted_stance(athlete, dem, state, tilt, -tilt / 2)
    leg = 3
    footing = compute_maps(athlete, dem, state, leg).layers["footing"]
    wheel = state.T_site_base @ wheel_pose(athlete, state.posture, leg)
    rows, cols = np.nonzero(np.hypot(*(dem.geometry.centers() - wheel[:2, 3]).transpose(2, 0, 1)) < 1.5)
    seen = {True: 0, False: 0}
    for i in rng.permutation(len(rows))[:250]:
        x, y = float(dem.geometry.xs[cols[i]]), float(dem.geometry.ys[rows[i]])
        contact = footfall_contact(athlete, dem, x, y)
        if not isinstance(contact, Contact):
            assert footing[rows[i], cols[i]] == UNKNOWN
            continue
        possible = bool(candidates(athlete, leg, contact, state.T_site_base, np.array(state.leg(leg)), 0))
        assert possible == (footing[rows[i], cols[i]] not in (NO_SOLUTION, OUT_OF_RANGE)), (x, y)
        seen[possible] += 1
    assert min(seen.values()) > 20


def test_the_first_blocked_place_is_one_that_the_edge_check_looked_at():
    # thinner than a step: whether it is met depends on where one looks, so both must look at the same places
    a, b = np.zeros(2), np.array([0.9, 0.0])
    for wall in np.linspace(0.05, 0.85, 81):
        space = Space(-np.ones(2), np.ones(2), lambda q, wall=wall: abs(q[0] - wall) > 0.001, 0.1)
        assert space.edge_is_free(a, b) == (space.first_blocked(a, b) is None)


def test_utm_coordinates_cost_no_precision(athlete):
    answers = []
    for east, north in ((0.0, 0.0), (5e5, 4e6)):
        dem = rolling(east, north)
        state = stand(athlete, dem, x=east, y=north)
        result = plan_step(athlete, dem, state, 0, (east + 1.95, north + 0.3))
        assert result.plan is not None, result.reason
        answers.append((result, compute_maps(athlete, dem, state, 0)))
    (near, near_maps), (far, far_maps) = answers
    # the swing may take a waypoint more: searches compare lengths that are equal but for rounding
    for end in (0, -1):
        assert np.allclose(near.plan.waypoints[end], far.plan.waypoints[end], atol=1e-7)
    for a, b in zip(near.checks, far.checks, strict=True):
        if a.name.startswith(("balance", "torque")):
            assert a.margin == pytest.approx(b.margin, abs=1e-3)
    assert np.array_equal(near_maps.layers["footing"], far_maps.layers["footing"])
    assert np.allclose(near_maps.layers["margin"], far_maps.layers["margin"], atol=1e-6, equal_nan=True)
