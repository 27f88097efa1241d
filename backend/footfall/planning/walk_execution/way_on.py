"""What a rover that walks to a goal does next: go on, look, plan anew, or stop; by walk, stance and ground."""

import numpy as np

from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.payload import loaded
from footfall.balance.support import margin
from footfall.core.arrays import Array
from footfall.core.frames import apply, heading
from footfall.maps.standing import contacts
from footfall.maps.support_outlines import bearing
from footfall.planning.looking.lift_to_look import leg_to_lift
from footfall.planning.walk.excerpt import parts_count, start_of
from footfall.planning.walk.problem import Place, WalkGoal, WalkPlan, part_name
from footfall.planning.walk_execution.decision import Act, SoFar, WayOn, WayOnSettings
from footfall.planning.walk_execution.ground_ahead import moved_ground, remembered_ground, unknown_ground
from footfall.planning.walk_execution.off_walk import off_walk
from footfall.robot.kinematics import center_of_mass
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

VAIN = 2
"""So many plans on a map with a new look are in vain before a leg is lifted to look."""
MOST_LIFTED = 2
"""Legs that are lifted to look, one after the other, with no foot move between."""


def way_on(
    robot: Robot,
    dem: Dem | None,
    state: RobotState,
    goal: WalkGoal,
    walk: WalkPlan | None,
    number: int,
    so_far: SoFar,
    settings: WayOnSettings,
    doubt: str = "",
    balance: BalanceSettings | None = None,
) -> WayOn:
    """The next act of a rover that was measured to stand as ``state`` says, ``number`` foot moves into ``walk``.

    dem: the ground as it is known now, which need not be that of the walk; None: none is known yet. Where looking or
    planning anew was tried in vain, what is left is to stop. It has not arrived before pinned places have had their
    feet. doubt: why it is not sure where on the map it stands,
    which only looking can change; empty where it is sure. balance: whose payload the rover carries; None: that of
    its description. Raises InvalidInput where the walk has no such foot move.
    """
    if dem is None:
        return _look("no ground is known yet", so_far, settings)
    if doubt:
        return WayOn(Act.STOP, f"a look did not help: {doubt}") if so_far.looked else WayOn(Act.LOOK, doubt)
    if unsteady := _unsteady(robot, dem, state, settings, balance or BalanceSettings()):
        return WayOn(Act.STOP, unsteady)
    there = arrived(goal, state.T_site_base)
    if there and not so_far.unmet:
        return WayOn(Act.ARRIVED, "the chassis is at the goal")
    if 0 < settings.look_every <= so_far.moved:
        return WayOn(Act.LOOK, f"{so_far.moved} of {settings.look_every} foot moves since the latest look")
    if so_far.nearest is not None and so_far.anew < settings.most_anew:
        at = f"({so_far.nearest.x:z.2f}, {so_far.nearest.y:z.2f})"
        return WayOn(Act.REPLAN, f"first to {at}, where the latest search came nearest: {so_far.refused}")
    if so_far.refused:
        lift = _lift(robot, dem, state, so_far)
        return lift or _look(so_far.refused, so_far, settings)
    if walk is None:
        return _replan("there is no walk yet", so_far, settings)
    if number >= parts_count(walk):
        lacks = f"no foot is on {_in_words(so_far.unmet)} yet" if there else "the goal is not reached"
        return _replan(f"the walk is over, {lacks}", so_far, settings)
    if off := off_walk(robot, state, *start_of(walk, number)):
        return _replan(f"the rover is off its walk: {off}", so_far, settings)
    last = min(number + settings.foot_moves, parts_count(walk))
    if unknown := unknown_ground(robot, dem, walk, number, last):
        return _look(unknown, so_far, settings)
    # on the map that it was planned on another plan puts the feet that stand no nearer to the ground
    if walk.parents.get("dem") != dem.digest and (moved := moved_ground(dem, walk, number)):
        return _replan(moved, so_far, settings)
    if weak := _beyond(walk, number, last, settings):
        return _replan(weak, so_far, settings)
    reasons = [f"the walk fits: {part_name(number, walk.foot_moves)} of {walk.foot_moves} is next"]
    reasons += [so_far.short] if so_far.short and number == 0 else []
    reasons += [old] if (old := remembered_ground(robot, dem, walk, number, last)) else []
    return WayOn(Act.GO, "; ".join(reasons))


def arrived(goal: WalkGoal, T_site_base: Array) -> bool:
    """Whether a chassis is at a goal, within what that allows."""
    if not np.hypot(T_site_base[0, 3] - goal.x, T_site_base[1, 3] - goal.y) <= goal.within:
        return False
    if goal.yaw is None:
        return True
    turn = heading(T_site_base) - goal.yaw
    return bool(abs(np.remainder(turn + np.pi, 2.0 * np.pi) - np.pi) <= goal.turned)


def _in_words(pinned: tuple[Place, ...]) -> str:
    places = ", ".join(f"({pin.x:g}, {pin.y:g})" for pin in pinned)
    return f"the pinned place{'s' if len(pinned) > 1 else ''} {places}"


def _look(reason: str, so_far: SoFar, settings: WayOnSettings) -> WayOn:
    return _replan(reason, so_far, settings) if so_far.looked else WayOn(Act.LOOK, reason)


def _lift(robot: Robot, dem: Dem, state: RobotState, so_far: SoFar) -> WayOn | None:
    """A look with a leg lifted, which takes the rover a minute: where a look and plans were in vain before."""
    if not so_far.looked or so_far.anew < VAIN or len(so_far.lifted) >= MOST_LIFTED:
        return None
    hidden = leg_to_lift(robot, dem, state, so_far.lifted)
    return None if hidden is None else WayOn(Act.LIFT, f"{hidden}; before: {so_far.refused}", hidden.leg)


def _replan(reason: str, so_far: SoFar, settings: WayOnSettings) -> WayOn:
    if so_far.anew < settings.most_anew:
        return WayOn(Act.REPLAN, reason)
    return WayOn(Act.STOP, f"planned anew {so_far.anew} times with no foot move between: {reason}")


def _unsteady(robot: Robot, dem: Dem, state: RobotState, settings: WayOnSettings, balance: BalanceSettings) -> str:
    """Why the rover does not stand steadily enough to move at all; empty where it does."""
    feet = contacts(robot, dem, state.posture, state.T_site_base, bearing(robot, state))
    _, com_base = loaded(robot, center_of_mass(robot, state.posture), balance)
    com = apply(state.T_site_base, com_base)
    inside = margin(feet.points, com[:2])
    if inside >= settings.least_margin:
        return ""
    return (
        f"the centre of mass is {inside:z.3f} m inside the polygon of the feet that bear, "
        f"at least {settings.least_margin:g} m are asked for"
    )


def _beyond(walk: WalkPlan, number: int, last: int, settings: WayOnSettings) -> str:
    """Which limit the foot moves ``number`` … ``last − 1`` pass, by what was planned; empty where none."""
    rows = (walk.moves >= number) & (walk.moves < last)
    margin_, torque = float(walk.margins[rows].min()), float(walk.torques[rows].max())
    if not margin_ >= settings.least_margin:
        return f"a margin of the next foot move is {margin_:z.3f} m, at least {settings.least_margin:g} m are asked for"
    if not torque <= settings.most_torque:
        return f"a joint takes {torque:.0%} of its torque limit next, at most {settings.most_torque:.0%} are allowed"
    return ""
