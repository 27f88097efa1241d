"""Which smallest shift of the chassis makes a footfall reachable and stable, and how to get there."""

from dataclasses import dataclass

import numpy as np

from footfall.balance.support import half_planes
from footfall.core.arrays import Array
from footfall.core.beside import beside
from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, no_progress
from footfall.core.value import Provenance
from footfall.planning.answers import No, Status
from footfall.planning.body.body_move import CheckedMove, StandingRover, checked, followed, plan_of, stance_of
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.body.find_problem import FindShiftSettings, ShiftResult
from footfall.planning.body.follow import Obstacle
from footfall.planning.body.reserve import reserves
from footfall.planning.body.shift import obstacle_in_words, require_same_robot
from footfall.planning.body.shift_search import Ranked, search
from footfall.planning.body.step_ends import StepEnds
from footfall.planning.body.violations import StepViolations, largest
from footfall.planning.scene.ground import footfall_contact
from footfall.planning.step.problem import Footfall
from footfall.planning.watch import OutOfTime, Watch
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

ATTEMPTS = 6
"""Shifts without violations that are looked at exactly, cheapest first."""
NEARLY = 0.03
"""A shift that falls short by no more than what is asked for in reserve is still worth the exact checks."""
DIGITS = 4
"""Decimals of a shift, in metres and radians."""
GROUND_BEYOND = 0.5
"""Ground that is looked at beyond feet and chassis [m]."""


@dataclass(frozen=True)
class _Found:
    """The shift, and the move to it; None where no shift is needed."""

    stance: StandingRover
    shift: BodyShift
    move: CheckedMove | None


def find_shift(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    leg: int,
    target_xy: tuple[float, float],
    settings: FindShiftSettings | None = None,
    progress: Progress = no_progress,
) -> ShiftResult:
    """Find the smallest shift of the chassis from which ``leg`` can step onto a target, and the move to it.

    "Can" is what the step planner asks of start and goal: the leg lifted straight up from its place, and lowered
    straight onto the footfall, free of collisions, held by the other feet with ``least_margin`` and by the motors. The
    swing between is not planned. Smallest in the cost of ShiftResult, as far as the search finds it: it is heuristic,
    so there may be a smaller shift, or one where it found none. Where none keeps the reserves of the settings one
    without is given, and the reason says so. It is deterministic, nothing is random, unless the time limit cuts it
    short.

    Args:
        robot: the rover.
        dem: the ground, in site.
        state: how the rover stands.
        leg: number of the leg that is to step, from 0.
        target_xy: where its wheel is to touch, (x, y) in site [m].
        settings: how far to look, and what is kept; None: as delivered.
        progress: called with a fraction 0…1 and a text; may raise Cancelled.

    Returns:
        The answer; where no shift is found it says what limits, by how much.

    Raises:
        InvalidInput: leg, target or settings make no sense, or the state is of another robot.
        Cancelled: ``progress`` raised it.
    """
    leg = robot.require_leg(leg)
    settings = settings or FindShiftSettings()
    if not isinstance(settings, FindShiftSettings):
        raise InvalidInput("a search for a shift takes FindShiftSettings")
    require_same_robot(robot, state)
    if len(target_xy) != 2:
        raise InvalidInput("a target needs x and y [m] in the site frame")
    footfall = Footfall(leg, float(target_xy[0]), float(target_xy[1]))
    provenance = Provenance({"dem": dem.digest, "state": state.digest, "robot": robot.digest}, settings)
    watch = Watch(progress, settings.time_limit)
    watch.phase(0.0, "looking at the ground")
    reason = ""
    try:
        found = _found(robot, dem, state, footfall, settings, watch)
        if isinstance(found, No) and found.status is Status.NO_PATH and settings is not settings.bare:
            bare = _found(robot, dem, state, footfall, settings.bare, watch)
            if isinstance(bare, _Found):
                found, settings, reason = bare, settings.bare, _unreserved(robot, bare, settings)
    except OutOfTime:
        found = No(Status.TIME_LIMIT, f"{settings.time_limit:g} s passed while {watch.text}; raise time_limit")
    if isinstance(found, No):
        return ShiftResult(found.status, None, None, float("nan"), found.reason, found.checks, footfall, provenance)
    watch.phase(1.0, "done")
    cost = float(np.linalg.norm(_scale(settings) * found.shift.vector))
    if found.move is None:
        reason = "no shift is needed: the footfall is possible as the rover stands"
        return ShiftResult(Status.FOUND, found.shift, None, cost, reason, (), footfall, provenance)
    # the plan is the one that plan_body_move gives for this shift, settings and parents included
    plan = plan_of(found.stance, found.shift, found.move, Provenance(provenance.parents, settings.move))
    return ShiftResult(Status.FOUND, found.shift, plan, cost, reason, found.move.checks, footfall, provenance)


def _found(
    robot: Robot, dem: Dem, state: RobotState, footfall: Footfall, settings: FindShiftSettings, watch: Watch
) -> _Found | No:
    contact = footfall_contact(robot, dem, footfall.x, footfall.y)
    if isinstance(contact, No):
        return contact
    away = float(np.hypot(*(contact.point[:2] - np.asarray(state.T_site_base)[:2, 3])))
    mount = float(np.linalg.norm(robot.description.legs[footfall.leg].T_base_hip[:2, 3]))
    farthest = mount + robot.leg_length(footfall.leg) + np.sqrt(2) * settings.most_shift
    if away > farthest:
        shown, bound = beside(away, farthest, 2)
        reason = (
            f"the footfall is {shown} m from the middle of the chassis; shifted by up to {settings.most_shift:g} m "
            f"along each axis, leg {footfall.leg} reaches no farther than {bound} m; choose a nearer one"
        )
        return No(Status.GOAL_INVALID, reason)
    stance = stance_of(robot, dem, state, settings.clearance, GROUND_BEYOND)
    if isinstance(stance, No):
        return stance
    lifted = [other for other in robot.legs if other != footfall.leg and other not in stance.standing]
    if lifted:
        reason = f"leg {lifted[0]} is in the air while leg {footfall.leg} is to step; put it down first"
        return No(Status.START_INVALID, reason)
    others = [i for i, other in enumerate(stance.standing) if other != footfall.leg]
    if not len(half_planes(stance.feet.points[others], settings.conservative)[1]):
        kind = "conservative support polygon" if settings.conservative else "support polygon"
        return No(Status.START_INVALID, f"the {len(others)} feet that stay have no {kind}, wherever the chassis is")
    ends = StepEnds(stance, footfall.leg, contact, settings)
    if not ends.objection(np.asarray(stance.state.posture), np.asarray(stance.state.T_site_base)):
        return _Found(stance, BodyShift(), None)
    rough = ends.rough()
    if rough:
        return No(Status.GOAL_INVALID, f"{rough}; choose another footfall")
    watch.phase(0.1, "searching for a shift of the chassis")
    short = StepViolations(stance, footfall.leg, contact, settings)
    bounds = np.array([settings.most_shift] * 3 + [settings.most_tilt] * 2 + [settings.most_turn])
    ranked = search(
        lambda shifts: short.of(shifts).sum(axis=1), _scale(settings), bounds, _starts(stance, footfall), watch.tick
    )
    miss = _nearest_miss(short, ranked, footfall)
    if ranked.short[0] > NEARLY:
        return miss
    found = _tried(stance, ends, ranked, settings, watch)
    return miss if isinstance(found, No) and ranked.short[0] > 0 else found


def _unreserved(robot: Robot, found: _Found, settings: FindShiftSettings) -> str:
    """What the shift leaves less of than was asked for: those that leave more do not make the footfall possible."""
    if found.move is None:
        return ""
    start, goal = found.move.waypoints[[0, -1]]
    lacking = [one for one in reserves(robot, start, goal, found.stance.standing, settings.move) if not one.check.holds]
    where = " and ".join(one.check.where for one in lacking)
    return f"▲ No shift was found that keeps a reserve: with this one {where}; the next shift may be refused."


def _tried(
    stance: StandingRover, ends: StepEnds, ranked: Ranked, settings: FindShiftSettings, watch: Watch
) -> _Found | No:
    """The cheapest of some shifts that passes all exact checks, or why the cheapest does not."""
    first: No | None = None
    # where none has all the reserve, those with the least lack of it
    lack = NEARLY if ranked.short[0] > 0 else 0.0
    for number, vector in enumerate(ranked.alternatives(_scale(settings), ATTEMPTS, lack)):
        watch.phase(0.5 + 0.5 * number / ATTEMPTS, "checking a shift of the chassis")
        shift = BodyShift(*(float(c) for c in np.round(vector, DIGITS)))
        legs = followed(stance, shift)
        if isinstance(legs, Obstacle):
            first = first or No(Status.NO_PATH, obstacle_in_words(legs))
            continue
        objection = ends.objection(legs.postures[-1], legs.Ts_site_base[-1])
        if objection:
            first = first or No(Status.NO_PATH, objection)
            continue
        found = checked(stance, legs, settings.move, watch)
        if isinstance(found, CheckedMove):
            return _Found(stance, shift, found)
        if found.status is Status.START_INVALID:
            return found
        first = first or found
    why = first.reason if first is not None else "none was tried"
    reason = (
        f"shifts of the chassis put the footfall within reach, the smallest by {ranked.cost[0]:z.2f} m, but none that "
        f"was tried is allowed; with the smallest, {why}; choose another footfall, or move the chassis by hand first"
    )
    return No(Status.NO_PATH, reason, first.checks if first is not None else ())


def _nearest_miss(short: StepViolations, ranked: Ranked, footfall: Footfall) -> No:
    dx, dy, dz, droll, dpitch, dyaw = ranked.shifts[0]
    worst = largest(short.names, short.of(ranked.shifts[:1])[0])
    reason = (
        f"no shift of the chassis was found from which leg {footfall.leg} can step onto ({footfall.x:z.2f}, "
        f"{footfall.y:z.2f}); the best, by ({dx:z.2f}, {dy:z.2f}, {dz:z.2f}) m and ({droll:z.2f}, {dpitch:z.2f}, "
        f"{dyaw:z.2f}) rad, falls short: {worst}; choose a nearer footfall, or move another leg first"
    )
    return No(Status.NO_PATH, reason)


def _scale(settings: FindShiftSettings) -> Array:
    return np.array([1.0, 1.0, 1.0, settings.lever, settings.lever, settings.lever])


def _starts(stance: StandingRover, footfall: Footfall) -> Array:
    """Shifts that are worth a look: none, up and down, and towards the footfall from the leg's hip, (k, 6)."""
    T = np.asarray(stance.state.T_site_base)
    hip = (T @ stance.robot.description.legs[footfall.leg].T_base_hip)[:2, 3]
    towards = np.array([footfall.x, footfall.y]) - hip
    towards /= max(float(np.linalg.norm(towards)), 1e-9)
    along, down = (a.ravel() for a in np.meshgrid(np.linspace(-0.6, 0.6, 13), np.linspace(0.1, -0.6, 8)))
    starts = np.zeros((len(along) + 1, 6))
    starts[1:, :2], starts[1:, 2] = along[:, None] * towards, down
    return starts
