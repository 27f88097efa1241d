"""What the start alone decides is refused before any search, once, with sizes that hold by other means."""

import re
from dataclasses import replace

import numpy as np
import pytest

from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.forces import distribute
from footfall.balance.torques import torque_check
from footfall.core.frames import apply
from footfall.planning.answers import Status
from footfall.planning.body.stand import stand
from footfall.planning.step import lift_off as lift_off_module
from footfall.planning.step.footing import LegStance, standing_feet
from footfall.planning.step.held import unheld, unheld_lift
from footfall.planning.step.plan import plan_step
from footfall.planning.step.problem import StepSettings
from footfall.robot.description import Payload
from footfall.robot.ik import contact_point
from footfall.robot.kinematics import center_of_mass
from footfall.robot.model import Robot
from footfall.terrain.from_arrays import from_heights

X = np.arange(-4, 4.01, 0.1)


def slope(grade):
    return from_heights((grade * np.meshgrid(X, X)[0]).astype(np.float32), 0.1, -4, -4, "slope")


def beside_the_foot(robot, state, leg):
    x, y, _ = contact_point(robot, state.posture, leg, state.T_site_base) - (0.1, 0.2, 0.0)
    return float(x), float(y)


def can_hold(robot, state, feet, q, friction):
    """Whether any forces hold the rover: a least-squares problem, where the product asks a linear program."""
    com = apply(state.T_site_base, center_of_mass(robot, q))
    return distribute(feet.points, feet.normals, com, robot.mass, friction=friction) is not None


@pytest.fixture
def no_search(monkeypatch):
    """Nothing beyond the start may be looked at."""

    def asked(*_args, **_more):
        raise AssertionError("the collision scene was built for a step that the start forbids")

    monkeypatch.setattr(lift_off_module, "Situation", asked)


@pytest.mark.parametrize("leg", [0, 2])
def test_too_little_friction_is_refused_at_once_with_how_much_would_do(athlete, no_search, leg):
    dem = slope(0.25)
    state = stand(athlete, dem)
    settings = StepSettings(friction=0.05)
    result = plan_step(athlete, dem, state, leg, beside_the_foot(athlete, state, leg), settings=settings)
    assert result.status is Status.START_INVALID
    assert [(check.name, check.holds) for check in result.checks] == [("torque", False)]
    assert "inf" not in result.reason.replace("inside", "")
    assert not np.isinf(result.checks[0].margin)
    assert result.reason.count("can't hold the rover") == 1
    told = re.search(r"friction of (\d\.\d\d) would do", result.reason)
    assert told is not None
    enough = float(told[1])
    feet = standing_feet(LegStance(athlete, dem, state, leg))
    q = np.array(state.posture)
    assert can_hold(athlete, state, feet, q, enough)
    assert not can_hold(athlete, state, feet, q, enough - 0.01)
    # tan of the slope, but for the pyramid's loss to the cone
    assert 0.25 <= enough <= 0.28


def test_a_load_over_one_side_is_refused_with_a_shift_that_helps(athlete, no_search):
    tail = Payload(2000.0, np.full(3, 0.2), np.array([2.4, 0.0, 0.4]))
    robot = Robot(replace(athlete.description, payload=tail))
    dem = slope(0.0)
    state = stand(athlete, dem)
    state = replace(state, robot=robot.name)
    leg = max(robot.legs, key=lambda one: contact_point(robot, state.posture, one, state.T_site_base)[0])
    result = plan_step(robot, dem, state, leg, beside_the_foot(robot, state, leg))
    assert result.status is Status.START_INVALID
    told = re.search(r"is (\d\.\d\d) m outside .* about \(([+-]\d\.\d\d), ([+-]\d\.\d\d)\) m", result.reason)
    assert told is not None, result.reason
    size, dx, dy = (float(one) for one in told.groups())
    assert np.hypot(dx, dy) == pytest.approx(size, abs=0.01)
    feet = standing_feet(LegStance(robot, dem, state, leg))
    for share, held in ((0.8, False), (1.2, True)):
        com = apply(state.T_site_base, center_of_mass(robot, state.posture)) + share * np.array([dx, dy, 0.0])
        assert (distribute(feet.points, feet.normals, com, robot.mass, friction=0.6) is not None) == held


def test_a_weak_motor_is_named_with_its_size_and_less_load_advised_where_it_helps(athlete, no_search):
    dem = slope(0.0)
    state = stand(athlete, dem)
    leg = 1
    others = [one for one in athlete.legs if one != leg]
    feet = standing_feet(LegStance(athlete, dem, state, leg))
    bare = torque_check(athlete, state.posture, state.T_site_base, others, feet.normals, BalanceSettings())
    # motors that just hold the rover alone
    limits = athlete.torque_limits * bare.ratio * 1.05
    load = Payload(200.0, np.full(3, 0.2), np.array([0.0, 0.0, 0.4]))
    loaded = Robot(replace(athlete.description, torque_limits=limits, payload=load))
    result = plan_step(loaded, dem, state, leg, beside_the_foot(athlete, state, leg))
    assert result.status is Status.START_INVALID
    told = re.search(r"(leg\d_\w+_joint) would need (\d\.\d\d) of its torque limit", result.reason)
    assert told is not None, result.reason
    assert told[1] in loaded.joint_names
    assert float(told[2]) > 1.0
    assert result.checks[0].margin == pytest.approx(1.0 - float(told[2]), abs=0.011)
    assert "take off payload (with none, 0.9" in result.reason
    # what carries nothing is not told to carry less
    weak = Robot(replace(athlete.description, torque_limits=0.9 * athlete.torque_limits * bare.ratio))
    alone = plan_step(weak, dem, state, leg, beside_the_foot(athlete, state, leg))
    assert alone.status is Status.START_INVALID
    assert "payload" not in alone.reason


def test_the_whole_lift_is_asked_not_its_beginning_alone(athlete):
    dem = slope(0.0)
    state = stand(athlete, dem)
    stance = LegStance(athlete, dem, state, 0)
    q = np.array(state.leg(0))
    out = q.copy()
    out[1] -= 0.6
    up = np.linspace(q, out, 9)
    ratios = [
        torque_check(
            athlete,
            stance.posture(one),
            state.T_site_base,
            stance.others,
            standing_feet(stance).normals,
            BalanceSettings(),
        ).ratio
        for one in up
    ]
    weak = Robot(replace(athlete.description, torque_limits=athlete.torque_limits * max(ratios) * 0.999))
    stance = LegStance(weak, dem, state, 0)
    told = unheld_lift(stance, 0.6, up)
    assert told is not None
    assert (int(np.argmax(ratios)) == 0) == ("of the way up" not in told[0])
    assert unheld(stance, 0.6, up[[int(np.argmax(ratios))]])
    assert not unheld(stance, 0.6, up[[int(np.argmin(ratios))]])


def test_a_stance_that_holds_is_not_refused(athlete):
    dem = slope(0.1)
    state = stand(athlete, dem)
    for leg in athlete.legs:
        assert unheld_lift(LegStance(athlete, dem, state, leg), 0.6, np.array(state.leg(leg))[None]) is None
