"""A short walk for tests of what is done with walks: one move of the chassis, one foot move, another move.

It is made of a checked move and a checked step; how walks are searched for is no part of it.
"""

from dataclasses import replace

import numpy as np

from footfall.core.value import Provenance
from footfall.planning.body.body_move import plan_body_move
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.body.move import BodyMovePlan, BodyMoveSettings
from footfall.planning.motion import BODY
from footfall.planning.step.plan import plan_step
from footfall.planning.step.problem import StepPlan, StepSettings
from footfall.planning.walk.problem import Stance, WalkGoal, WalkPlan, WalkSettings
from footfall.robot.ik import contact_point
from footfall.robot.kinematics import leg_wheel_pose

LEG = 2
PATIENT = 3600.0
"""Time limit of what is planned [s]: on a busy machine nothing fails by the clock."""
SETTINGS = WalkSettings(support="ignored", least_margin=0.02, clearance=0.0, seed=7)


def short_parts(robot, dem, state, by=(0.06, 0.02)) -> tuple[BodyMovePlan, StepPlan, BodyMovePlan]:
    """A move of the chassis ``by`` (x, y) [m] and down, a step of leg 2 after it, and a move on: three plans.

    A refusal fails the test with its reason.
    """
    move = BodyMoveSettings(least_margin=SETTINGS.least_margin, time_limit=PATIENT)
    step = StepSettings(
        lift=SETTINGS.lift,
        raise_terrain=SETTINGS.raise_terrain,
        least_margin=SETTINGS.least_margin,
        time_limit=PATIENT,
    )
    first = plan_body_move(robot, dem, state, BodyShift(dx=by[0], dy=by[1], dz=-0.3), move)
    assert first.plan is not None, first.reason
    moved = replace(state, posture=first.plan.waypoints[-1], T_site_base=first.plan.Ts_site_base[-1])
    x, y, _ = contact_point(robot, moved.posture, LEG, moved.T_site_base)
    swing = plan_step(robot, dem, moved, LEG, (float(x) + by[0], float(y) + by[1]), settings=step)
    assert swing.plan is not None, swing.reason
    stepped = replace(moved, posture=swing.plan.waypoints[-1])
    last = plan_body_move(robot, dem, stepped, BodyShift(dx=by[0], dy=by[1], dyaw=0.02), move)
    assert last.plan is not None, last.reason
    return first.plan, swing.plan, last.plan


def short_walk(robot, dem, state):
    """The WalkPlan of :func:`short_parts`."""
    first, swing, last = short_parts(robot, dem, state)
    held = np.repeat(swing.T_site_base[None], len(swing.waypoints) - 1, axis=0)
    waypoints = np.vstack([first.waypoints, swing.waypoints[1:], last.waypoints[1:]])
    count, ends = len(waypoints), len(last.waypoints) - 1
    return WalkPlan(
        goal=WalkGoal(*(float(one) for one in last.Ts_site_base[-1][:2, 3])),
        legs=(LEG,),
        stances=(stance(robot, first), stance(robot, last)),
        waypoints=waypoints,
        Ts_site_base=np.concatenate([first.Ts_site_base, held, last.Ts_site_base[1:]]),
        moves=np.repeat([0, 1], [count - ends, ends]),
        phases=(BODY,) * len(first.waypoints) + swing.phases[1:] + (BODY,) * ends,
        margins=np.full(count, 0.3),
        torques=np.full(count, 0.5),
        provenance=Provenance(
            {"dem": dem.digest, "state": state.digest, "robot": robot.digest}, SETTINGS, SETTINGS.seed
        ),
    )


def stance(robot, move):
    """The Stance over which a move of the chassis goes."""
    legs = np.reshape(move.waypoints[0], (robot.leg_count, 6))
    wheels = np.array([leg_wheel_pose(robot, one, leg) for leg, one in enumerate(legs)])
    return Stance(
        contacts=move.contacts,
        normals=np.repeat([[0.0, 0.0, 1.0]], robot.leg_count, axis=0),
        Ts_site_wheel=move.Ts_site_base[0] @ wheels,
        branches=np.zeros(robot.leg_count, np.int64),
    )
