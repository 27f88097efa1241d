"""The way of the wheel is where forward kinematics has it while the joints turn evenly."""

import numpy as np
import pytest

from footfall.core import frames
from footfall.core.value import Provenance
from footfall.planning.step.problem import StepPlan
from footfall.planning.step.wheel_way import TURN, wheel_way
from footfall.robot.kinematics import leg_wheel_pose

LEG = 4


@pytest.fixture(scope="module")
def plan(athlete) -> StepPlan:
    rng = np.random.default_rng(4)
    waypoints = np.tile(athlete.posture("stand"), (4, 1))
    waypoints[1:, 6 * LEG : 6 * LEG + 6] += np.cumsum(rng.uniform(-0.4, 0.4, (3, 6)), axis=0)
    T = frames.transform(frames.rotation_rpy(0.1, -0.05, 1.2), (3.0, -2.0, 1.4))
    phases = ("lift", "lift", "swing", "lower")
    return StepPlan(LEG, waypoints, phases, T, np.zeros(3), np.array([0.0, 0.0, 1.0]), 0, "line", Provenance({}))


def wheel(robot, plan, posture) -> np.ndarray:
    """By the model of the leg alone, where the way is by that of the whole robot."""
    T_base_wheel = leg_wheel_pose(robot, posture[6 * LEG : 6 * LEG + 6], LEG)
    return frames.apply(plan.T_site_base, T_base_wheel[:3, 3])


def test_it_goes_from_waypoint_to_waypoint_along_even_turns(athlete, plan):
    way = wheel_way(athlete, plan)
    assert [phase for phase, _ in way] == ["lift", "swing", "lower"]
    for (_, points), start, end in zip(way, plan.waypoints[:-1], plan.waypoints[1:], strict=True):
        assert len(points) - 1 == np.ceil(np.abs(end - start).max() / TURN)
        for share, point in zip(np.linspace(0.0, 1.0, len(points)), points, strict=True):
            assert point == pytest.approx(wheel(athlete, plan, start + share * (end - start)), abs=1e-9)
    joined = np.concatenate([points for _, points in way])
    assert np.linalg.norm(np.diff(joined, axis=0), axis=1).max() < 0.1


def test_a_waypoint_said_twice_is_no_gap(athlete, plan):
    still = StepPlan(
        LEG,
        plan.waypoints[[0, 0]],
        ("lift", "lift"),
        plan.T_site_base,
        plan.contact,
        plan.normal,
        0,
        "line",
        Provenance({}),
    )
    ((phase, points),) = wheel_way(athlete, still)
    assert phase == "lift"
    assert points == pytest.approx(np.tile(wheel(athlete, plan, plan.waypoints[0]), (2, 1)))
