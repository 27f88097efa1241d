"""Plan how the chassis moves while every wheel stays where it stands; check everything; say no with a reason."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, no_progress
from footfall.core.value import Provenance
from footfall.maps.standing import STANDING_GAP, Contacts, contacts, standing, wheel_gaps
from footfall.planning.answers import Check, No, Status
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.body.checked import MoveCheck
from footfall.planning.body.follow import Followed, Obstacle, follow
from footfall.planning.body.move import BodyMovePlan, BodyMoveResult, BodyMoveSettings
from footfall.planning.body.move_checks import recheck
from footfall.planning.body.shift import obstacle_in_words, require_same_robot, require_shift
from footfall.planning.scene.ground import nearby
from footfall.planning.scene.whole_body import FAR, WholeBody
from footfall.planning.watch import OutOfTime, Watch
from footfall.robot.kinematics import wheel_centers
from footfall.robot.model import Robot
from footfall.robot.tolerance import outside_in_words, state_inside
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

ADVICE = {
    Status.START_INVALID: "correct the state or the terrain, or ask for less clearance or margin",
    Status.GOAL_INVALID: "ask for a smaller shift or another direction, or for less clearance or margin",
    Status.NO_PATH: "go there by way of another pose of the chassis, or ask for less clearance or margin",
}
UNRESERVED = "or, with {} 0, for no reserve: then the next shift may be refused"
RESERVE_ADVICE = {
    "reach reserve": f"ask for a smaller shift, lower the chassis with it, {UNRESERVED.format('reach_reserve')}",
    "joint reserve": f"ask for a smaller shift, step with that leg first, {UNRESERVED.format('joint_reserve')}",
}


@dataclass(frozen=True)
class StandingRover:
    """The rover as it stands: legs ``standing`` on ``feet``; body.ground: the ground around, without holes."""

    robot: Robot
    state: RobotState
    standing: tuple[int, ...]
    feet: Contacts
    body: WholeBody


@dataclass(frozen=True)
class CheckedMove:
    """A move whose checks all hold: postures (n, legs × 6), chassis poses (n, 4, 4)."""

    waypoints: Array
    Ts_site_base: Array
    checks: tuple[Check, ...]


def plan_body_move(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    shift: BodyShift,
    settings: BodyMoveSettings | None = None,
    progress: Progress = no_progress,
) -> BodyMoveResult:
    """Plan how the chassis goes straight to where ``shift`` puts it: standing wheels locked, legs in the air unmoved.

    Nothing in it is random.

    Args:
        robot: the rover.
        dem: the ground, in site.
        state: how the rover stands at first.
        shift: how the chassis is to move, from where it is.
        settings: with what the move is checked; None: as delivered.
        progress: called with a fraction 0…1 and a text; may raise Cancelled.

    Returns:
        The answer; a move that can't be made is an answer with a reason.

    Raises:
        InvalidInput: shift or settings make no sense, or the state is of another robot.
        Cancelled: ``progress`` raised it.
    """
    require_same_robot(robot, state)
    require_shift(shift)
    settings = settings or BodyMoveSettings()
    if not isinstance(settings, BodyMoveSettings):
        raise InvalidInput("a move of the chassis takes BodyMoveSettings")
    provenance = Provenance({"dem": dem.digest, "state": state.digest, "robot": robot.digest}, settings)
    watch = Watch(progress, settings.time_limit)
    watch.phase(0.0, "looking at the ground")
    try:
        found = _planned(robot, dem, state, shift, settings, provenance, watch)
    except OutOfTime:
        found = No(Status.TIME_LIMIT, f"{settings.time_limit:g} s passed while {watch.text}; raise time_limit")
    if isinstance(found, No):
        return BodyMoveResult(found.status, None, found.reason, found.checks, shift, provenance)
    watch.phase(1.0, "done")
    plan, checks = found
    return BodyMoveResult(Status.FOUND, plan, "", checks, shift, provenance)


def _planned(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    shift: BodyShift,
    settings: BodyMoveSettings,
    provenance: Provenance,
    watch: Watch,
) -> tuple[BodyMovePlan, tuple[Check, ...]] | No:
    stance = stance_of(robot, dem, state, settings.clearance)
    if isinstance(stance, No):
        return stance
    found = move(stance, shift, settings, watch)
    return found if isinstance(found, No) else (plan_of(stance, shift, found, provenance), found.checks)


def stance_of(
    robot: Robot, dem: Dem, state: RobotState, clearance: float, reach_out: float = 0.0
) -> StandingRover | No:
    """The rover as it stands, or why it can't stand so.

    Args:
        robot: the rover.
        dem: the ground, in site.
        state: how the rover stands.
        clearance: added to what the description asks for [m].
        reach_out: ground is seen so far beyond feet and chassis [m].

    Returns:
        The rover over its ground, or the refusal.
    """
    state = state_inside(robot, state)
    q = np.asarray(state.posture)
    outside = outside_in_words(robot, q)
    if outside:
        return _no_start(outside)
    down = standing(robot, dem, q, state.T_site_base, robot.legs)
    if len(down) < 3:
        return _no_start(f"{len(down)} wheels are on the ground, three are needed")
    gaps = wheel_gaps(robot, dem, q, state.T_site_base, down)
    deepest = robot.description.clearances.wheel_sink + STANDING_GAP
    for leg, gap in zip(down, gaps, strict=True):
        if gap < -deepest:
            return _no_start(f"the wheel of leg {leg} is {-gap:z.2f} m in the ground")
    feet = contacts(robot, dem, q, state.T_site_base, down)
    center = np.asarray(state.T_site_base)[:2, 3]
    chassis = float(np.linalg.norm(robot.description.meshes["base"].vertices[:, :2], axis=1).max())
    wheels = float(np.linalg.norm(wheel_centers(robot, q)[:, :2], axis=1).max()) + robot.wheel_radius
    ground = nearby(dem, center, max(chassis, wheels) + FAR + reach_out, feet.points)
    if isinstance(ground, No):
        return ground
    return StandingRover(robot, state, tuple(down), feet, WholeBody(robot, ground, clearance))


def move(stance: StandingRover, shift: BodyShift, settings: BodyMoveSettings, watch: Watch) -> CheckedMove | No:
    """The move that ``shift`` asks for, every check of it holding, or what prevents it."""
    watch.phase(0.2, "following the chassis with the legs")
    found = followed(stance, shift)
    if isinstance(found, Obstacle):
        return No(Status.GOAL_INVALID if found.at_goal else Status.NO_PATH, obstacle_in_words(found))
    watch.phase(0.4, "checking the whole move")
    return checked(stance, found, settings, watch)


def followed(stance: StandingRover, shift: BodyShift) -> Followed | Obstacle:
    """How the legs follow the shift; nothing is checked yet but their limits."""
    T_from = np.asarray(stance.state.T_site_base)
    posture = np.asarray(stance.state.posture)
    return follow(stance.robot, posture, T_from, shift.applied(T_from), stance.standing)


def checked(stance: StandingRover, found: Followed, settings: BodyMoveSettings, watch: Watch) -> CheckedMove | No:
    """The move if all its checks hold, else the refusal."""
    results = recheck(
        stance.robot,
        found.postures,
        found.Ts_site_base,
        stance.standing,
        stance.feet,
        stance.body,
        settings,
        watch.tick,
    )
    checks = tuple(result.check for result in results)
    bad = [result for result in results if not result.check.holds]
    return _failed(bad, checks) if bad else CheckedMove(found.postures, found.Ts_site_base, checks)


def plan_of(stance: StandingRover, shift: BodyShift, found: CheckedMove, provenance: Provenance) -> BodyMovePlan:
    """The move as a plan."""
    return BodyMovePlan(
        shift=shift,
        waypoints=found.waypoints,
        Ts_site_base=found.Ts_site_base,
        standing=stance.standing,
        contacts=stance.feet.points,
        provenance=provenance,
    )


def _failed(bad: Sequence[MoveCheck], checks: tuple[Check, ...]) -> No:
    """The refusal for checks that don't hold: of the start, else of the goal, else of the way."""
    at_start, at_goal = [one for one in bad if one.at_start], [one for one in bad if one.at_goal]
    if at_start:
        status, what, chosen = Status.START_INVALID, "can't start from where it is", at_start
    elif at_goal:
        status, what, chosen = Status.GOAL_INVALID, "can't be there", at_goal
    else:
        status, what, chosen = Status.NO_PATH, "can't go straight there", bad
    check = chosen[0].check
    size = f" by {-check.margin:z.3f} {check.unit}" if check.margin < 0 else ""
    advice = RESERVE_ADVICE.get(check.name, ADVICE[status])
    told_as = f"the check of {check.name} fails{size} ({check.where})"
    return No(status, f"the chassis {what}: {told_as}; {advice}", checks)


def _no_start(objection: str) -> No:
    advice = "correct the state or the terrain, or put the legs down first"
    return No(Status.START_INVALID, f"the rover can't stand as its state says: {objection}; {advice}")
