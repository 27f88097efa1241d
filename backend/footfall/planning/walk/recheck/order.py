"""What a walk must be before anything of it is measured: phases and stances in their order, its start and its end."""

from itertools import groupby

import numpy as np

from footfall.planning.answers import Check
from footfall.planning.motion import BODY, Motion
from footfall.planning.walk.problem import LIFT, LOWER, SWING, CheckedMotion, Place, WalkSettings, part_name
from footfall.robot.model import Robot
from footfall.robot.tolerance import JOINT_TOLERANCE
from footfall.telemetry.state import RobotState

STILL = 1e-6
"""What does not move may move by so much, by rounding [m], [rad]."""


def phases(robot: Robot, plan: CheckedMotion) -> Check:
    """Foot moves one after the other, each of body, lift, swing and lower; what is to keep still does."""
    fault = _disordered(plan) or _unstill(robot, plan.motion)
    return Check("phases", not fault, float("nan"), "", fault or "in order")


def _disordered(plan: CheckedMotion) -> str:
    count = len(plan.groups)

    def in_words(one: tuple[int, str]) -> str:
        return f"{one[1]} of {part_name(one[0], count)}"

    parts = [(int(move), phase) for move, phase in zip(plan.moves, plan.phases, strict=True)]
    if not parts:
        return "there are no waypoints"
    # the first waypoint only says where the motion begins
    found = [key for key, _ in groupby(parts[1:])]
    wanted = [(move, phase) for move in range(count) for phase in (BODY, LIFT, SWING, LOWER)] + [(count, BODY)]
    at = 0
    for one in found:
        while at < len(wanted) and wanted[at] != one and wanted[at][1] == BODY:
            at += 1  # the chassis may stay where it is
        if at == len(wanted) or wanted[at] != one:
            due = f"{in_words(wanted[at])} is due" if at < len(wanted) else "the walk is over"
            return f"{in_words(one)} where {due}"
        at += 1
    left = [one for one in wanted[at:] if one[1] != BODY]
    return f"{in_words(left[0])} is missing" if left else ""


def _unstill(robot: Robot, motion: Motion) -> str:
    for i in range(1, len(motion.phases)):
        if motion.phases[i] == BODY:
            continue
        changed = np.abs(motion.waypoints[i] - motion.waypoints[i - 1]).reshape(robot.leg_count, 6).max(axis=1)
        changed[~motion.stays[i]] = 0.0
        if changed.max() > STILL:
            return f"leg {int(np.argmax(changed))} moves too, to waypoint {i} ({motion.phases[i]})"
        if np.abs(motion.Ts_site_base[i] - motion.Ts_site_base[i - 1]).max() > STILL:
            return f"the chassis moves to waypoint {i} ({motion.phases[i]})"
    return ""


def stances(robot: Robot, plan: CheckedMotion) -> Check:
    """Each stance differs from the one before by the feet that were moved."""
    for number, (group, one, other) in enumerate(zip(plan.groups, plan.stances, plan.stances[1:], strict=False)):
        for standing in robot.legs:
            same = all(
                np.allclose(a[standing], b[standing], rtol=0.0, atol=STILL)
                for a, b in (
                    (one.contacts, other.contacts),
                    (one.normals, other.normals),
                    (one.Ts_site_wheel, other.Ts_site_wheel),
                )
            )
            if standing not in group and not (same and one.branches[standing] == other.branches[standing]):
                moved = _legs_in_words(group)
                where = f"foot move {number + 1} moves {moved}, but that of leg {standing} stands elsewhere after it"
                return Check("stances", False, float("nan"), "", where)
    return Check("stances", True, float("nan"), "", "each differs from the next by the feet that move")


def _legs_in_words(group: tuple[int, ...]) -> str:
    return f"leg {group[0]}" if len(group) == 1 else f"legs {', '.join(str(leg) for leg in group)}"


def start(plan: CheckedMotion, state: RobotState) -> Check:
    """How far the first waypoint is from the rover's posture; the chassis must be where the state says."""
    away = np.abs(plan.waypoints[0] - state.posture)
    joint = int(np.argmax(away))
    moved = float(np.abs(plan.Ts_site_base[0] - state.T_site_base).max())
    holds = float(away[joint]) <= JOINT_TOLERANCE + STILL and moved <= STILL
    where = f"the chassis is {moved:.3g} m off" if moved > STILL else f"joint {joint} of the start"
    return Check("start", holds, JOINT_TOLERANCE - float(away[joint]), "rad", where)


def goal(plan: CheckedMotion) -> Check:
    """How far the chassis is within the goal's tolerance at the end; where only the heading fails, by how much that."""
    T, asked = plan.Ts_site_base[-1], plan.goal
    spare = asked.within - float(np.hypot(T[0, 3] - asked.x, T[1, 3] - asked.y))
    if spare >= 0 and asked.yaw is not None:
        turn = np.arctan2(T[1, 0], T[0, 0]) - asked.yaw
        turned = abs(float(np.arctan2(np.sin(turn), np.cos(turn))))
        if turned > asked.turned:
            return Check("goal", False, asked.turned - turned, "rad", "the heading at the last waypoint")
    return Check("goal", spare >= 0, spare, "m", "the last waypoint")


def footfalls(plan: CheckedMotion, settings: WalkSettings) -> Check:
    """Feet are put on ground that is allowed, and on every place that is asked for."""
    moved = list(enumerate(zip(plan.groups, plan.stances[1:], strict=True)))
    put = [(number, leg, stance.contacts[leg]) for number, (group, stance) in moved for leg in group]
    for number, leg, contact in put:
        for place in settings.forbidden:
            if _on(place, leg, contact):
                return Check("footfalls", False, float("nan"), "", f"foot move {number + 1} ends on forbidden ground")
    for place in settings.pinned:
        if not any(_on(place, leg, contact) for _, leg, contact in put):
            where = f"no foot is put on ({place.x:g}, {place.y:g})"
            return Check("footfalls", False, float("nan"), "", where)
    return Check("footfalls", True, float("nan"), "", "as asked")


def _on(place: Place, leg: int, contact: np.ndarray) -> bool:
    here = float(np.hypot(contact[0] - place.x, contact[1] - place.y)) <= place.radius
    return here and place.leg in (None, leg)
