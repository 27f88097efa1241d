"""Walks on a tether: asked in the site, planned in the frame of the slope, told in the site again.

After Fig. 8 of Hauser, Bretl, Latombe & Wilcox, "Motion planning for a six-legged lunar robot" (2006), where a tether
is one more limb with which a rover goes down a slope of 60°.
"""

from dataclasses import dataclass, replace

import numpy as np

from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.tether import Tether
from footfall.balance.torques import torque_check
from footfall.core.value import Provenance
from footfall.planning.answers import Check, No, Status
from footfall.planning.motion import BODY
from footfall.planning.walk.body_way import At
from footfall.planning.walk.footprint import footprint
from footfall.planning.walk.hung import Hung
from footfall.planning.walk.problem import Place, Tethered, WalkGoal, WalkPlan, WalkResult, WalkSettings
from footfall.planning.walk.slope_frame import slope_between
from footfall.planning.walk.start import start_of
from footfall.planning.walk.tether_ground import unknown_under
from footfall.planning.walk.tether_refused import refused_before
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

AROUND = 3.0
"""The slope is that of the ground so far beside start and goal [m]."""
MOST_OFF = 0.05
"""Turned ground must be nowhere farther below the site's than this [m]: clearances are enlarged by it."""


@dataclass(frozen=True, eq=False)
class OnSlope:
    """A walk's problem in the slope's frame: its ground, goal, settings and start."""

    hung: Hung
    goal: WalkGoal
    settings: WalkSettings
    start: At


def on_slope(
    robot: Robot, dem: Dem, state: RobotState, goal: WalkGoal, settings: WalkSettings, tether: Tether
) -> OnSlope | No:
    """The problem in the slope's frame, or why there is none."""
    start = start_of(robot, dem, state)
    if isinstance(start, str):
        return No(Status.START_INVALID, start)
    here, there = np.asarray(start.T_site_base)[:2, 3], np.array([goal.x, goal.y])
    frame = slope_between(dem, here, there, AROUND, tether.anchor)
    hung = Hung(frame, tether, goal)
    if frame.off > MOST_OFF:
        reason = (
            f"the ground has edges that stand {frame.off:z.3f} m out of what is planned with, {MOST_OFF:g} m is "
            "accepted; give it in smaller cells"
        )
        return No(Status.START_INVALID, reason)
    at = frame.on_slope(goal.x, goal.y, footprint(robot, settings.height).height)
    if not np.isfinite(at).all():
        reason = "the ground below the goal, along the slope's normal, is unknown; choose another goal"
        return No(Status.UNKNOWN_GROUND, reason)
    refusal = refused_before(robot, dem, start, goal, frame.to_site(at), settings.balance, tether)
    if refusal is not None:
        return refusal
    for pin in settings.pinned:
        if not np.isfinite(height_at(dem, pin.x, pin.y)):
            return No(Status.GOAL_INVALID, unknown_pin_in_words(pin))
    yaw = None if goal.yaw is None else hung.heading(goal.yaw)
    turned = WalkGoal(float(at[0]), float(at[1]), yaw, goal.within, goal.turned)
    own = replace(
        settings,
        clearance=settings.clearance + frame.off,
        pinned=tuple(frame.place(one) for one in settings.pinned),
    )
    began = At(frame.stance(start.stance, False), frame.poses_to_slope(np.asarray(start.T_site_base)), start.posture)
    return OnSlope(hung, turned, own, began)


def unknown_pin_in_words(pin: Place) -> str:
    """Why no foot is put on a pinned place whose ground nobody knows."""
    return (
        f"no foot can stand on the pinned place ({pin.x:g}, {pin.y:g}): the ground there is unknown; pin another place"
    )


def in_site(robot: Robot, dem: Dem, asked: OnSlope, result: WalkResult) -> WalkResult:
    """A result of the slope's frame in the site, with what the tether does."""
    hung = asked.hung
    goal = hung.goal if hung.goal is not None else result.goal
    plan, partial = (
        None if one is None else plan_in_site(robot, hung, one, asked.settings.balance, goal)
        for one in (result.plan, result.partial)
    )
    checks = (*result.checks, *_checks(plan, dem)) if plan is not None else result.checks
    return replace(result, plan=plan, partial=partial, goal=goal, checks=checks, blocked=hung.blocked(result.blocked))


def plan_in_site(robot: Robot, hung: Hung, plan: WalkPlan, balance: BalanceSettings, goal: WalkGoal) -> WalkPlan:
    """A walk of the slope's frame in the site, with how long the tether is and how hard it pulls at each waypoint.

    The pull is that with which the largest share of a limit, of a joint or of the drum, is least.
    """
    frame = hung.frame
    stances = tuple(frame.stance(stance, True) for stance in plan.stances)
    Ts = frame.poses_to_site(np.asarray(plan.Ts_site_base))
    pulls = []
    for q, T, move, phase in zip(plan.waypoints, Ts, plan.moves, plan.phases, strict=True):
        feet = [leg for leg in robot.legs if phase == BODY or leg != plan.legs[move]]
        pulls.append(torque_check(robot, q, T, feet, stances[move].normals[feet], balance, hung.tether).pull)
    up = np.array(frame.R_site_slope[:, 2])
    tethered = Tethered(hung.tether, up, hung.tether.lengths(Ts), np.array(pulls))
    return replace(plan, goal=goal, stances=stances, Ts_site_base=Ts, tethered=tethered)


def _checks(plan: WalkPlan, dem: Dem) -> tuple[Check, ...]:
    """What the tether has to spare where that is least, and what it goes over that is not known."""
    if plan.tethered is None:
        return ()
    tether, lengths, pulls = plan.tethered.tether, plan.tethered.lengths, plan.tethered.pulls
    longest, hardest = int(np.argmax(lengths)), int(np.argmax(pulls))
    return (
        Check("tether", True, float("nan"), "", "free of ground, legs and chassis all the way, sizes are not told"),
        Check("tether length", True, tether.free_length - float(lengths[longest]), "m", f"waypoint {longest}"),
        Check("tether pull", True, tether.most_force - float(pulls[hardest]), "N", f"waypoint {hardest}"),
        *unknown_under(dem, tether, plan.Ts_site_base),
    )


def provenance_of(dem: Dem, state: RobotState, robot: Robot, settings: WalkSettings, tether: Tether) -> Provenance:
    """Of a walk on a tether."""
    parents = {"dem": dem.digest, "state": state.digest, "robot": robot.digest, "tether": tether.digest}
    return Provenance(parents, settings, settings.seed)
