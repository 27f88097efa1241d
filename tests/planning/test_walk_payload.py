"""Payload of walks: judged alike by planner, recheck and the balance layer, and laws of what more of it does."""

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import footfall
from footfall.balance.balance_settings import PAYLOAD_LIMIT, BalanceSettings
from footfall.balance.forces import distribute
from footfall.balance.held import held_tables
from footfall.balance.payload import loaded
from footfall.balance.support import half_planes, margins
from footfall.balance.torques import torque_check
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, rotation_rpy, transform
from footfall.core.value import Provenance, flatten, unflatten
from footfall.planning.answers import Status
from footfall.planning.compliance.compliance_settings import ComplianceSettings
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.motion import BODY
from footfall.planning.scene.certificate import body_tables
from footfall.planning.scene.ground import Nearby
from footfall.planning.scene.rover_kernel import center_of_mass, place_rover
from footfall.planning.scene.rover_tables import rover_tables
from footfall.planning.walk.body_kernel import torque_of
from footfall.planning.walk.body_way import At
from footfall.planning.walk.plan import plan_walk
from footfall.planning.walk.problem import WalkGoal, WalkSettings
from footfall.planning.walk.recheck.recheck_settings import RecheckSettings
from footfall.planning.walk.recheck.walk import recheck_walk
from footfall.planning.walk.smoothing import Smoothing
from footfall.planning.walk.start import overloaded, start_of
from footfall.planning.walk.world import World
from footfall.planning.walk_execution.payload import with_load_of
from footfall.robot import kinematics
from footfall.robot.description import with_payload
from footfall.robot.model import Robot
from tests.support.chassis_ground import wavy

PLACE = np.array([0.5, 0.4, 0.3])
"""Off the chassis' middle."""
SETTINGS = WalkSettings(seed=2, time_limit=600.0, smoothing=Smoothing(rounds=0))
CARRYING = replace(SETTINGS, payload_mass=100.0, payload_position=PLACE)
FAR_OUT = replace(SETTINGS, seed=0, payload_mass=300.0, payload_position=np.array([0.79, 0.21, 0.3]), least_margin=0.9)
GOAL = WalkGoal(0.7, 0.0, 0.0)
COARSE = RecheckSettings(way=0.02, turn=0.02, hold=0.3, watched=0.01)
MASS = st.floats(0.0, PAYLOAD_LIMIT)
PLACES = st.tuples(*[st.floats(-1.0, 1.0)] * 3)


@pytest.fixture(scope="module")
def ground():
    return wavy(half=4.0)


@pytest.fixture(scope="module")
def start(athlete, ground):
    return footfall.stand(athlete, ground)


@pytest.fixture(scope="module")
def described(athlete):
    """The rover whose description carries what the settings say."""
    return Robot(with_payload(athlete.description, 100.0, position=PLACE))


@pytest.fixture(scope="module")
def at(athlete, ground, start):
    found = start_of(athlete, ground, start)
    assert isinstance(found, At), found
    return found


@pytest.fixture(scope="module")
def checks(athlete, ground, at):
    return checks_of(athlete, ground, at, SETTINGS)


@pytest.fixture(scope="module")
def walks(athlete, ground, start):
    """A walk of the bare rover, and one with the payload."""
    both = [plan_walk(athlete, ground, start, GOAL, settings=one) for one in (SETTINGS, CARRYING)]
    assert [one.status for one in both] == [Status.FOUND] * 2, [one.reason for one in both]
    return [one.plan for one in both]


def checks_of(robot, dem, at, settings):
    return World(robot, Nearby(dem, np.isnan(dem.heights)), settings, at.T_site_base).first.checks


def ratio(athlete, at, checks, balance, standing):
    """Largest share of a torque limit where the walk begins, by the planner's check."""
    T, poses = np.ascontiguousarray(at.T_site_base[:3]), np.empty((42, 3, 4))
    place_rover(at.posture, T, checks.rover, poses)
    # nothing is good enough for the cheap bound: the least that is possible is asked for
    strict = checks._replace(held=held_tables(athlete, balance), most_torque=0.0)
    return torque_of(poses, T, at.stance.contacts, at.stance.normals, np.array(standing), strict)


def on(com, mass):
    return BalanceSettings(payload_mass=mass, payload_position=com)


@given(MASS, PLACES, st.booleans(), st.integers(0, 2**32 - 1))
def test_the_centre_of_mass_is_that_of_the_balance_layer(athlete, described, ground, mass, place, own, seed):
    rng = np.random.default_rng(seed)
    robot = described if own else athlete
    posture = robot.posture("stand") + rng.uniform(-0.3, 0.3, 36)
    T = transform(rotation_rpy(*rng.uniform(-0.5, 0.5, 3)), rng.uniform(-1.0, 1.0, 3))
    balance = BalanceSettings(payload_mass=mass, payload_position=np.array(place))
    tables = rover_tables(robot, ground.heights, ground.geometry, around=(0.0, 0.0), within=0.3, balance=balance)
    poses, at = np.empty((42, 3, 4)), np.ascontiguousarray(T[:3])
    place_rover(posture, at, tables, poses)
    _, expected = loaded(robot, kinematics.center_of_mass(robot, posture), balance)
    np.testing.assert_allclose(center_of_mass(poses, at, tables), apply(T, expected), atol=1e-9)
    assert tables.masses[:, 0].sum() == pytest.approx(1.0)


def test_planner_judges_as_if_the_description_carried_it(athlete, described, ground, at):
    asked, same = checks_of(athlete, ground, at, CARRYING), checks_of(described, ground, at, SETTINGS)
    np.testing.assert_allclose(asked.rover.masses, same.rover.masses, atol=1e-12)
    for one, other in zip(asked.held, same.held, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)


def test_a_swing_is_judged_as_if_the_description_carried_it(athlete, described, at):
    polygon = half_planes(np.delete(np.array(at.stance.contacts), 0, axis=0), False)
    asked = at.posture, at.T_site_base, 0, *polygon, 0.05
    carrying, same = body_tables(athlete, *asked, CARRYING.balance), body_tables(described, *asked)
    for one, other in zip(carrying, same, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)
    assert np.linalg.norm(carrying.rest - body_tables(athlete, *asked).rest) > 0.03


def test_no_swing_leaves_less_margin_than_asked_for(athlete, ground, start):
    """The chassis stands where just so much is left: a leg that swings is not to take of it."""
    asked = replace(FAR_OUT, support="ignored")
    plan = plan_walk(athlete, ground, start, WalkGoal(0.7, 0.0), settings=asked).plan
    assert plan is not None
    assert plan.margins.min() >= FAR_OUT.least_margin - 1e-6
    support = recheck_walk(athlete, ground, plan, every=COARSE, state=start)
    assert all(one.holds for one in support), support


def test_a_payload_leads_to_another_walk_whose_margins_are_its_own(athlete, walks):
    bare, plan = walks
    assert plan.waypoints.shape != bare.waypoints.shape or np.abs(plan.waypoints - bare.waypoints).max() > 1e-3
    least = 0.0
    for row in range(len(plan.phases)):
        move, q, T = int(plan.moves[row]), plan.waypoints[row], plan.Ts_site_base[row]
        feet = [leg for leg in athlete.legs if plan.phases[row] == BODY or leg != plan.legs[move]]
        own = kinematics.center_of_mass(athlete, q)
        _, com = loaded(athlete, own, CARRYING.balance)
        stance = plan.stances[move]
        found = margins(stance.contacts[feet], apply(T, com)[None, :2], False)[0]
        assert plan.margins[row] <= found + 1e-6
        least = max(least, abs(margins(stance.contacts[feet], apply(T, own)[None, :2], False)[0] - found))
        held = torque_check(athlete, q, T, feet, stance.normals[feet], CARRYING.balance)
        assert held.ratio <= CARRYING.most_torque + 1e-6
    # with the payload left out margins are others
    assert least > 0.03


def test_the_recheck_knows_the_payload(athlete, described, ground, start, walks):
    bare, plan = walks
    found = {one.name: one for one in recheck_walk(athlete, ground, plan, every=COARSE, state=start)}
    assert all(one.holds for one in found.values()), found
    same = {one.name: one for one in recheck_walk(described, ground, plan, SETTINGS, COARSE)}
    for name in ("support", "friction", "torque"):
        assert found[name].margin == pytest.approx(same[name].margin, abs=1e-9)
    # far off to the left no feet hold it
    far = replace(SETTINGS, payload_mass=300.0, payload_position=np.array([0.0, 9.0, 0.3]))
    failed = {one.name for one in recheck_walk(athlete, ground, bare, far, COARSE) if not one.holds}
    assert {"support", "friction"} <= failed


def test_more_payload_never_leaves_more_torque_in_the_recheck(athlete, ground, walks):
    found = []
    for mass in (0.0, 100.0, 200.0, 300.0):
        settings = replace(SETTINGS, payload_mass=mass)
        told = {one.name: one for one in recheck_walk(athlete, ground, walks[0], settings, COARSE)}
        found.append(told["torque"].margin)
    # what a lifted leg takes does not depend on it
    assert all(later <= one + 1e-7 for one, later in pairwise(found)), found
    assert found[-1] < found[0] - 0.01, found


@given(MASS, MASS, st.integers(-1, 5))
def test_more_weight_at_the_centre_of_mass_never_takes_less_torque(athlete, at, checks, one, other, lifted):
    """The share is convex in the mass (below), and does not fall from no payload on: so it never falls."""
    light, heavy = sorted((one, other))
    com = kinematics.center_of_mass(athlete, at.posture)
    standing = [leg != lifted for leg in athlete.legs]
    less, more = (ratio(athlete, at, checks, on(com, mass), standing) for mass in (light, heavy))
    assert less <= more + 1e-7


@given(MASS, MASS, PLACES, st.integers(-1, 5))
def test_torque_is_a_convex_function_of_the_payload_wherever_it_is(athlete, at, checks, one, other, place, lifted):
    standing = [leg != lifted for leg in athlete.legs]
    found = [
        ratio(athlete, at, checks, on(np.array(place), mass), standing) for mass in (one, 0.5 * (one + other), other)
    ]
    assert found[1] <= 0.5 * (found[0] + found[2]) + 1e-7


def test_the_share_of_torque_is_that_of_the_linear_program(athlete, at, checks):
    for lifted in (-1, 2):
        standing = [leg != lifted for leg in athlete.legs]
        feet = [leg for leg in athlete.legs if standing[leg]]
        for mass in (0.0, 150.0, 300.0):
            balance = on(PLACE, mass)
            found = ratio(athlete, at, checks, balance, standing)
            held = torque_check(athlete, at.posture, at.T_site_base, feet, at.stance.normals[feet], balance)
            assert found == pytest.approx(held.ratio, abs=1e-4)


@pytest.mark.parametrize("mass", [0.0, 60.0, 300.0])
def test_what_can_t_be_held_where_the_walk_begins_is_refused_with_the_reason(athlete, ground, start, at, mass):
    far = replace(SETTINGS, payload_mass=mass, payload_position=np.array([0.0, 9.0, 0.3]))
    com = loaded(athlete, kinematics.center_of_mass(athlete, at.posture), far.balance)[1]
    held = distribute(at.stance.contacts, at.stance.normals, apply(at.T_site_base, com), athlete.mass + mass)
    assert (overloaded(athlete, at, far) == "") == (held is not None)
    if held is None:
        result = plan_walk(athlete, ground, start, GOAL, settings=far)
        assert result.status is Status.START_INVALID
        assert "300 kg at (0, 9, 0.3) m" in result.reason
        assert "take off payload" in result.reason


def test_a_joint_that_can_t_bear_it_is_named_with_its_share(athlete, at):
    bare = torque_check(athlete, at.posture, at.T_site_base, athlete.legs, at.stance.normals, SETTINGS.balance)
    weak = Robot(replace(athlete.description, torque_limits=1.05 * bare.ratio * np.array(athlete.torque_limits)))
    assert overloaded(weak, at, SETTINGS) == overloaded(weak, at, replace(SETTINGS, payload_mass=0.0)) == ""
    heavy = replace(SETTINGS, payload_mass=250.0)
    held = torque_check(weak, at.posture, at.T_site_base, weak.legs, at.stance.normals, heavy.balance)
    assert held.ratio > 1.0
    reason = overloaded(weak, at, heavy)
    assert f"{held.joint_name} would need {held.ratio:.2f} of its torque limit" in reason
    assert "250 kg at (0, 0, 0.3) m" in reason


def test_settings_from_before_there_was_payload_are_the_same():
    structure, _ = flatten(SETTINGS)
    assert not {"payload_mass", "payload_position"} & structure["of"].keys()
    again = unflatten(*flatten(CARRYING))
    assert isinstance(again, WalkSettings)
    assert again.digest == CARRYING.digest != SETTINGS.digest
    np.testing.assert_array_equal(again.balance.payload_position, PLACE)


@pytest.mark.parametrize("wrong", [{"payload_mass": -1.0}, {"payload_mass": 301.0}, {"payload_position": PLACE}])
def test_a_payload_that_makes_no_sense_is_misuse(wrong):
    with pytest.raises(InvalidInput, match="payload"):
        replace(SETTINGS, **wrong)


@pytest.mark.parametrize("own", [None, 0.0, 20.0])
def test_an_execution_carries_what_the_walk_does_unless_it_names_a_payload(own):
    def executed_as(planned):
        walk: Any = SimpleNamespace(provenance=Provenance({}, planned))
        return with_load_of(walk, asked)

    asked = ExecutionSettings(compliance=ComplianceSettings(balance=BalanceSettings(friction=0.7, payload_mass=own)))
    balance = executed_as(CARRYING).compliance.balance
    assert (balance.payload_mass, balance.friction) == (100.0 if own is None else own, 0.7)
    assert (balance.payload_position is None) == (own is not None)
    assert executed_as(SETTINGS).digest == executed_as(None).digest == asked.digest
