"""A hand-made step on flat ground: lift leg 2, carry it 0.25 m sideways, set it down."""

import numpy as np
import pytest

from footfall.core.frames import transform
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.planning.step.problem import StepPlan, StepSettings
from footfall.robot.ik import contact_point, solve_leg, wheel_pose_for_contact
from footfall.robot.kinematics import wheel_centers
from footfall.terrain.dem import Dem

LEG = 2


@pytest.fixture(scope="session")
def flat() -> Dem:
    grid = GridGeometry(-6.0, -6.0, 0.1, 121, 121)
    return Dem(np.zeros(grid.shape, np.float32), grid, "flat", Provenance({}))


@pytest.fixture(scope="session")
def hand_plan(athlete, flat) -> StepPlan:
    posture = athlete.posture("stand")
    height = athlete.wheel_radius - wheel_centers(athlete, posture)[:, 2].min()
    T_site_base = transform(translation=(0.0, 0.0, height))
    foot = contact_point(athlete, posture, LEG, T_site_base)
    side = np.array([0.22, 0.12, 0.0])
    up = np.array([0.0, 0.0, 0.2])
    places = [foot, foot + up / 2, foot + up, foot + up + side / 2, foot + up + side, foot + up / 2 + side, foot + side]
    heading = np.arctan2(foot[1], foot[0])
    q_leg = posture[6 * LEG : 6 * LEG + 6]
    waypoints = [posture]
    for place in places[1:]:
        wheel = wheel_pose_for_contact(athlete, place, np.array([0.0, 0.0, 1.0]), heading, T_site_base)
        found = solve_leg(athlete, LEG, wheel[None])
        near = found.q[0][found.valid[0]]
        q_leg = near[np.argmin(np.abs(near - q_leg).max(axis=1))]
        waypoint = posture.copy()
        waypoint[6 * LEG : 6 * LEG + 6] = q_leg
        waypoints.append(waypoint)
    return StepPlan(
        leg=LEG,
        waypoints=np.array(waypoints),
        phases=("lift", "lift", "lift", "swing", "swing", "lower", "lower"),
        T_site_base=T_site_base,
        contact=places[-1],
        normal=np.array([0.0, 0.0, 1.0]),
        branch=0,
        planner="line",
        provenance=Provenance({"robot": athlete.digest, "dem": flat.digest}, StepSettings(least_margin=0.02)),
    )


@pytest.fixture(scope="session")
def sequence(athlete, hand_plan):
    from footfall.sequence.make import make_sequence

    return make_sequence(hand_plan, athlete)
