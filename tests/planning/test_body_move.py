"""A move of the chassis: found plans are good by other means, refusals say why."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation, Slerp

import footfall
from footfall.core.errors import Cancelled, InvalidInput
from footfall.io.artifacts import decode, encode
from footfall.maps.standing import contacts
from footfall.planning.answers import Status
from footfall.planning.body.body_move import plan_body_move
from footfall.planning.body.body_shift import BodyShift, PredictedState
from footfall.planning.body.move import BodyMoveSettings
from footfall.planning.body.shift import shifted_state
from footfall.robot.kinematics import center_of_mass, link_poses
from footfall.robot.meshes.collision import posture_collisions
from footfall.telemetry.state import RobotState
from footfall.terrain.ground.triangulate import crop, triangulate
from tests.support.chassis_ground import lifted, wavy
from tests.support.shifts import back

SHIFT = BodyShift(dx=0.15, dy=-0.1, dz=-0.5, droll=0.03, dpitch=-0.05, dyaw=0.1)


@pytest.fixture(scope="module")
def scene(athlete):
    dem = wavy([(1.0, 1.2, 0.3, 0.2)])
    return dem, footfall.stand(athlete, dem)


@pytest.fixture(scope="module")
def found(athlete, scene):
    dem, state = scene
    return plan_body_move(athlete, dem, state, SHIFT)


def plan_in(result):
    """The result's plan; the test fails with the reason where there is none."""
    assert result.status is Status.FOUND, result.reason
    assert result.plan is not None
    return result.plan


def by_name(result, name):
    return next(check for check in result.checks if check.name.startswith(name))


def between(plan, i, t):
    """Posture and chassis pose between waypoints, by another interpolation."""
    T = np.eye(4)
    T[:3, 3] = (1 - t) * plan.Ts_site_base[i][:3, 3] + t * plan.Ts_site_base[i + 1][:3, 3]
    T[:3, :3] = Slerp([0, 1], Rotation.from_matrix(plan.Ts_site_base[i : i + 2, :3, :3]))(t).as_matrix()
    return (1 - t) * plan.waypoints[i] + t * plan.waypoints[i + 1], T


def test_a_found_move_is_good_by_other_means(athlete, scene, found):
    dem, state = scene
    plan = plan_in(found)
    assert np.array_equal(plan.waypoints[0], state.posture)
    assert np.array_equal(plan.Ts_site_base[0], state.T_site_base)
    assert np.array_equal(plan.Ts_site_base[-1], SHIFT.applied(state.T_site_base))
    assert plan.standing == tuple(athlete.legs)
    names = [f"leg{leg}_wheel" for leg in athlete.legs]
    poses = link_poses(athlete, state.posture)
    wheels = np.array([state.T_site_base @ poses[name] for name in names])
    feet = contacts(athlete, dem, state.posture, state.T_site_base, athlete.legs).points
    assert np.allclose(plan.contacts, feet)
    local = np.array([np.linalg.inv(T)[:3, :3] @ (p - T[:3, 3]) for T, p in zip(wheels, feet, strict=True)])
    hull = ConvexHull(feet[:, :2]).equations
    worst, least = 0.0, np.inf
    for i in range(len(plan.waypoints) - 1):
        for t in np.linspace(0, 1, 9):
            q, T = between(plan, i, t)
            assert (q >= athlete.lower).all()
            assert (q <= athlete.upper).all()
            now = link_poses(athlete, q)
            Ts = np.array([T @ now[name] for name in names])
            moved = np.einsum("nij,nj->ni", Ts[:, :3, :3], local) + Ts[:, :3, 3] - feet
            worst = max(worst, float(np.linalg.norm(moved, axis=1).max()))
            if t in (0.0, 1.0):
                assert np.abs(Ts - wheels).max() < 1e-9
            com = T[:3, :3] @ center_of_mass(athlete, q) + T[:3, 3]
            least = min(least, float(-(hull @ (*com[:2], 1.0)).max()))
    assert worst <= 0.002
    assert by_name(found, "contact drift").margin == pytest.approx(0.002 - worst, abs=2e-4)
    assert by_name(found, "balance").margin == pytest.approx(least, abs=1e-3)
    assert all(check.holds for check in found.checks)
    near = triangulate(dem)
    for i in range(0, len(plan.waypoints) - 1, 4):
        assert posture_collisions(athlete, *between(plan, i, 0.5), near) == []


def test_the_move_ends_where_the_what_if_is(athlete, scene, found):
    dem, state = scene
    there = shifted_state(athlete, dem, state, SHIFT)
    assert isinstance(there, PredictedState)
    assert np.array_equal(found.plan.waypoints[-1], there.posture)
    again = plan_body_move(athlete, dem, there, back(SHIFT))
    assert np.abs(plan_in(again).waypoints[-1] - state.posture).max() < 1e-6


def test_a_plan_names_its_parents_and_is_the_same_every_time(athlete, scene, found):
    dem, state = scene
    parents = {"dem": dem.digest, "state": state.digest, "robot": athlete.digest}
    assert found.plan.parents == parents
    assert found.plan.provenance.settings.digest == BodyMoveSettings().digest
    assert plan_body_move(athlete, dem, state, SHIFT).digest == found.digest
    assert decode(encode(found)).digest == found.digest


def test_no_shift_moves_nothing(athlete, scene):
    dem, state = scene
    plan = plan_in(plan_body_move(athlete, dem, state, BodyShift()))
    assert (plan.waypoints == state.posture).all()
    assert (plan.Ts_site_base == state.T_site_base).all()


def test_a_rock_under_the_chassis_stops_it(athlete):
    dem = wavy([(0.1, 0.2, 0.5, 0.75)])
    state = footfall.stand(athlete, dem)
    low = BodyShift(dz=-1.0)
    result = plan_body_move(athlete, dem, state, low)
    assert result.status is Status.GOAL_INVALID
    assert result.plan is None
    assert "base and the terrain" in result.reason
    assert by_name(result, "terrain").margin < 0
    there = shifted_state(athlete, dem, state, low)
    assert isinstance(there, PredictedState)
    near = crop(dem, (0, 0), 4.0)
    hits = posture_collisions(athlete, there.posture, there.T_site_base, near)
    assert ("base", "terrain") in {(hit.link_a, hit.link_b) for hit in hits}
    # the margin above the rock's top is what a lower one leaves
    above = BodyShift(dz=-0.7)
    result = plan_body_move(athlete, dem, state, above)
    assert result.status is Status.FOUND, result.reason
    there = shifted_state(athlete, dem, state, above)
    assert isinstance(there, PredictedState)
    top = np.nanmax(dem.heights)
    bottom = there.T_site_base[2, 3] + athlete.description.meshes["base"].vertices[:, 2].min()
    expected = bottom - top - athlete.description.clearances.chassis_terrain
    assert by_name(result, "terrain").margin == pytest.approx(min(expected, 0.2), abs=2e-3)


def test_a_clearance_is_taken_off_every_distance(athlete, scene):
    dem, state = scene
    plain = plan_body_move(athlete, dem, state, BodyShift(dz=-0.4))
    wider = plan_body_move(athlete, dem, state, BodyShift(dz=-0.4), BodyMoveSettings(clearance=0.05))
    assert by_name(wider, "self").margin == pytest.approx(by_name(plain, "self").margin - 0.05, abs=1e-6)
    result = plan_body_move(athlete, dem, state, BodyShift(dz=-0.4), BodyMoveSettings(clearance=0.15))
    assert result.status is Status.START_INVALID
    assert "self collision" in result.reason
    assert "less clearance" in result.reason


def test_unknown_ground_is_filled_and_told(athlete):
    dem = wavy(hole=(0.0, 0.0, 0.8))
    state = footfall.stand(athlete, dem)
    result = plan_body_move(athlete, dem, state, BodyShift(dz=-0.3))
    assert result.status is Status.FOUND, result.reason
    assert "cells, taken as high" in by_name(result, "unknown").where


def test_what_cannot_be_is_told_with_status_and_size(athlete, scene):
    dem, state = scene
    result = plan_body_move(athlete, dem, state, BodyShift(dx=0.8))
    assert result.status is Status.GOAL_INVALID
    assert "m too short" in result.reason
    result = plan_body_move(athlete, dem, lifted(athlete, state, [2, 3, 4]), BodyShift(dz=-0.05))
    assert result.status is Status.START_INVALID
    assert "balance (support polygon)" in result.reason
    result = plan_body_move(athlete, dem, lifted(athlete, state, [1, 2, 3, 4]), BodyShift(dz=-0.05))
    assert result.status is Status.START_INVALID
    assert "2 wheels are on the ground" in result.reason
    result = plan_body_move(athlete, dem, state, SHIFT, BodyMoveSettings(least_margin=5.0))
    assert result.status is Status.START_INVALID
    assert "balance" in result.reason
    sunk = np.array(state.T_site_base)
    sunk[2, 3] -= 0.3
    buried = RobotState(state.robot, 0.0, state.posture, sunk, state.wheel_forces, state.joint_torques, "idle")
    result = plan_body_move(athlete, dem, buried, SHIFT)
    assert result.status is Status.START_INVALID
    assert "in the ground" in result.reason


def test_conservative_asks_for_more(athlete, scene):
    dem, state = scene
    plain = plan_body_move(athlete, dem, state, BodyShift(dz=-0.3))
    strict = plan_body_move(athlete, dem, state, BodyShift(dz=-0.3), BodyMoveSettings(conservative=True))
    assert strict.status is Status.FOUND, strict.reason
    assert by_name(strict, "balance (cons").margin < by_name(plain, "balance (supp").margin


def test_a_leg_in_the_air_is_carried_along(athlete, scene):
    dem, state = scene
    up = lifted(athlete, state, [1])
    plan = plan_in(plan_body_move(athlete, dem, up, BodyShift(dz=-0.2)))
    assert plan.standing == (0, 2, 3, 4, 5)
    assert (plan.waypoints[:, 6:12] == up.leg(1)).all()
    # carried down by more than its height over the ground it meets the ground
    result = plan_body_move(athlete, dem, up, BodyShift(dz=-0.5))
    assert result.status is Status.GOAL_INVALID
    assert "leg1_wheel and the terrain" in result.reason


def test_the_caller_can_stop_it_and_time_can_run_out(athlete, scene):
    dem, state = scene
    seen = []

    def stop(fraction, text):
        seen.append(fraction)
        if fraction > 0.3:
            raise Cancelled("enough")

    with pytest.raises(Cancelled):
        plan_body_move(athlete, dem, state, SHIFT, progress=stop)
    assert seen == sorted(seen)
    result = plan_body_move(athlete, dem, state, SHIFT, BodyMoveSettings(time_limit=1e-6))
    assert result.status is Status.TIME_LIMIT
    assert "raise time_limit" in result.reason


@pytest.mark.parametrize("bad", [{"friction": 0.0}, {"clearance": -1.0}, {"least_margin": np.nan}, {"time_limit": 0}])
def test_senseless_settings_are_refused(bad):
    with pytest.raises(InvalidInput, match=next(iter(bad))):
        BodyMoveSettings(**bad)  # pyright: ignore[reportArgumentType]


def test_another_robots_state_is_refused(athlete, scene):
    dem, s = scene
    other = RobotState("spider", 0.0, s.posture, s.T_site_base, s.wheel_forces, s.joint_torques, "idle")
    with pytest.raises(InvalidInput, match="spider"):
        plan_body_move(athlete, dem, other, SHIFT)
