"""Walks made by hand of single moves of the chassis and single steps, for what is to be asked of a whole walk."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from footfall.balance.support import margins
from footfall.balance.torques import torque_margin
from footfall.core.frames import apply
from footfall.core.value import Provenance
from footfall.maps.standing import contacts
from footfall.planning.body.after import state_after
from footfall.planning.body.body_move import plan_body_move
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.motion import BODY
from footfall.planning.step.plan import plan_step
from footfall.planning.walk.problem import Stance, WalkGoal, WalkPlan, WalkSettings
from footfall.robot.kinematics import center_of_mass, wheel_pose
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

Array = NDArray[np.float64]

BY_HAND = WalkSettings(support="ignored", least_margin=0.0, most_torque=1.0)
"""What single moves and steps are checked against unless asked for more."""


@dataclass(frozen=True)
class FootMove:
    """The chassis shifts (None: it stays), then a leg steps by so much, site [m]; leg None: the walk ends."""

    shift: BodyShift | None
    leg: int | None = None
    by: tuple[float, float] = (0.0, 0.0)


def walk_by_hand(
    robot: Robot, dem: Dem, state: RobotState, moves: Sequence[FootMove], settings: WalkSettings = BY_HAND
) -> WalkPlan:
    """The moves one after the other, as a walk to where they lead; a refusal fails the test with its reason."""
    first = state
    stances = [stance_of(robot, dem, state)]
    waypoints, poses = [np.asarray(state.posture)], [np.asarray(state.T_site_base)]
    numbers, phases, legs = [0], [BODY], []
    for number, move in enumerate(moves):
        if move.shift is not None:
            moved = plan_body_move(robot, dem, state, move.shift)
            assert moved.plan is not None, moved.reason
            waypoints += list(moved.plan.waypoints[1:])
            poses += list(moved.plan.Ts_site_base[1:])
            phases += [BODY] * (len(moved.plan.waypoints) - 1)
            state = state_after(robot, dem, state, waypoints[-1], poses[-1], moved.plan.digest)
        if move.leg is not None:
            contact = stances[-1].contacts[move.leg]
            step = plan_step(robot, dem, state, move.leg, (contact[0] + move.by[0], contact[1] + move.by[1]))
            assert step.plan is not None, step.reason
            waypoints += list(step.plan.waypoints[1:])
            poses += [np.asarray(step.plan.T_site_base)] * (len(step.plan.waypoints) - 1)
            phases += step.plan.phases[1:]
            state = state_after(robot, dem, state, waypoints[-1], poses[-1], step.plan.digest)
            legs.append(move.leg)
            stances.append(_with_foot_of(stances[-1], stance_of(robot, dem, state), move.leg))
        numbers += [number] * (len(waypoints) - len(numbers))
    T = poses[-1]
    goal = WalkGoal(float(T[0, 3]), float(T[1, 3]), float(np.arctan2(T[1, 0], T[0, 0])))
    margin, torque = _balance(robot, stances, waypoints, poses, numbers, phases, legs, settings)
    parents = {"dem": dem.digest, "state": first.digest, "robot": robot.digest}
    return WalkPlan(
        goal=goal,
        legs=tuple(legs),
        stances=tuple(stances),
        waypoints=np.array(waypoints),
        Ts_site_base=np.array(poses),
        moves=np.array(numbers),
        phases=tuple(phases),
        margins=margin,
        torques=torque,
        provenance=Provenance(parents, settings, settings.seed),
    )


def stance_of(robot: Robot, dem: Dem, state: RobotState) -> Stance:
    """All wheels where they are in a state."""
    feet = contacts(robot, dem, state.posture, state.T_site_base, robot.legs)
    wheels = np.array([state.T_site_base @ wheel_pose(robot, state.posture, leg) for leg in robot.legs])
    branches = [_branch(robot, leg, state.leg(leg)) for leg in robot.legs]
    return Stance(feet.points, feet.normals, wheels, np.array(branches))


def _branch(robot: Robot, leg: int, q: Array) -> int:
    spec = robot.description.legs[leg]
    out = spec.hip_offset[0] + spec.thigh * np.cos(q[1]) + spec.shank * np.cos(q[1] + q[2])
    return 4 * int(out < 0) + 2 * int(q[2] < 0) + int(q[4] < 0)


def _with_foot_of(stance: Stance, other: Stance, leg: int) -> Stance:
    def replaced(name: str) -> NDArray:
        array = np.array(getattr(stance, name))
        array[leg] = getattr(other, name)[leg]
        return array

    return Stance(*(replaced(name) for name in ("contacts", "normals", "Ts_site_wheel", "branches")))


def _balance(
    robot: Robot,
    stances: Sequence[Stance],
    waypoints: Sequence[Array],
    poses: Sequence[Array],
    numbers: Sequence[int],
    phases: Sequence[str],
    legs: Sequence[int],
    settings: WalkSettings,
) -> tuple[Array, Array]:
    found = []
    for q, T, number, phase in zip(waypoints, poses, numbers, phases, strict=True):
        stance = stances[number]
        feet = [leg for leg in robot.legs if phase == BODY or leg != legs[number]]
        com = apply(T, center_of_mass(robot, q))[None, :2]
        margin = margins(stance.contacts[feet], com, settings.support == "required")[0]
        held = torque_margin(robot, q, T, feet, stance.normals[feet], settings.friction)
        found.append((margin, held.ratio))
    both = np.array(found)
    return both[:, 0], both[:, 1]
