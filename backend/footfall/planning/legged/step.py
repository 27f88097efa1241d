"""One step of a legged robot: the chassis shifts, one foot goes to a chosen place."""

from dataclasses import replace

import numpy as np

from footfall.core.arrays import Array
from footfall.core.beside import roughly
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, heading
from footfall.core.value import Provenance
from footfall.planning.answers import Status
from footfall.planning.legged.foot_move import FootMove, foot_moves, plan_of
from footfall.planning.legged.footing import FEET_OFF, rest
from footfall.planning.legged.problem import LeggedPlan, LeggedResult, LeggedSettings, LeggedState
from footfall.planning.legged.stance import Ground, all_standing
from footfall.planning.legged.to_see import to_see
from footfall.planning.legged.whole_check import LIMIT_RESERVE, Refusal, Tally
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall.robot.tolerance import inside
from footfall.terrain.dem import Dem
from footfall.terrain.extent import outside, spans

LED_BACK = LIMIT_RESERVE + 1e-9
"""So far inside its limit a plan starts a joint: rounding must not put it back into the reserve [rad or m]."""

FOLLOWERS_OFF = 0.01
"""A joint that follows another is measured farther from where that one has it only where a rod is broken [rad or m]."""


def plan_step(
    robot: LeggedRobot,
    dem: Dem,
    state: LeggedState,
    leg: int,
    target: tuple[float, float],
    settings: LeggedSettings | None = None,
) -> LeggedResult:
    """Plan how ``leg`` goes onto ``target``; the chassis shifts as far as the other feet need it.

    Args:
        robot: the robot.
        dem: the ground, in site.
        state: how the robot stands.
        leg: number of the leg that steps, from 0.
        target: where its foot is to touch, (x, y) in site [m].
        settings: with what is planned and checked; None: as delivered.

    Returns:
        The answer; a step that can't be made is an answer with a reason.

    Raises:
        InvalidInput: the robot has no such leg, the target is not finite, or the state is of another robot.
    """
    settings = settings or LeggedSettings()
    robot.require_leg(leg)
    if len(target) != 2 or not np.isfinite(target).all():
        raise InvalidInput("a target needs finite x and y [m]")
    ground = Ground(robot, dem, settings)
    return of_measured(_plan(ground, begun(ground, state), leg, target), state)


def _plan(ground: Ground, state: LeggedState, leg: int, target: tuple[float, float]) -> LeggedResult:
    robot, dem, settings = ground.robot, ground.dem, ground.settings
    tally = Tally()
    refused = start_refused(ground, state)
    if refused is not None:
        return refused
    down = rest(dem, *target, float(robot.radii[leg]))
    refused = place_refused(ground, state, "the footfall", target, bool(np.isfinite(down.normal).all()))
    if refused is not None:
        return refused
    where = f"({target[0]:z.2f}, {target[1]:z.2f}) m"
    slope = float(np.arccos(down.normal[2]))
    if slope > settings.steepest:
        text = f"the ground at {where} is {slope:z.2f} rad steep, more than {settings.steepest:g}"
        return no_plan(ground, state, Status.GOAL_INVALID, text, tally)
    T = state.T_site_base
    found: FootMove | None = None
    for tried in foot_moves(ground, state, leg, [down], float(T[0, 3]), float(T[1, 3]), heading(T)):
        if isinstance(tried, FootMove):
            found = tried
        else:
            tally.refuse(tried)
    if found is None:
        text = f"leg {robot.leg_names[leg]} can't go to {where}: {tally_in_words(tally)}"
        return no_plan(ground, state, Status.NO_PATH, text, tally)
    plan = plan_of(found.samples, [leg], state, found.end)
    return LeggedResult(
        Status.FOUND,
        plan,
        "",
        found.tally.checks(),
        tally.most_refused(),
        not_judged(ground, plan),
        provenance(ground, state),
    )


def begun(ground: Ground, measured: LeggedState) -> LeggedState:
    """Where a plan starts: a joint beside its limit, or past it by what a measurement may be off, is where plans stay.

    Raises InvalidInput for another robot's.
    """
    if measured.robot != ground.robot.name or len(measured.soles) != len(ground.robot.legs):
        raise InvalidInput(f"the state is one of {measured.robot}, not of {ground.robot.name}")
    q = _led_back(ground.robot, measured.q)
    return measured if np.array_equal(q, measured.q) else replace(measured, q=q)


def _led_back(robot: LeggedRobot, measured: Array) -> Array:
    """The posture (joints,) inside limits, and followers where their leaders have them, but for those farther off."""
    q = inside(robot, measured, LED_BACK)
    if not robot.coupling.couples:
        return q
    right = robot.coupling.followed(q)
    return np.where(np.abs(right - q) <= FOLLOWERS_OFF, right, q)


def of_measured(result: LeggedResult, measured: LeggedState) -> LeggedResult:
    """The answer of a plan from where :func:`begun` has a state, as one that was made from the state itself."""
    parents = {**result.provenance.parents, "state": measured.digest}
    return replace(result, provenance=replace(result.provenance, parents=parents))


def start_refused(ground: Ground, state: LeggedState) -> LeggedResult | None:
    """The answer where a state can't be begun from; None where it can."""
    answer = _feet_off(ground, state) or ground.check.margins(state.q, state.T_site_base, all_standing(state))
    if not isinstance(answer, Refusal):
        return None
    text = f"it can't begin: {answer.name} {answer.margin:+.4g}, {answer.where}"
    return no_plan(ground, state, Status.START_INVALID, text, Tally())


def _feet_off(ground: Ground, state: LeggedState) -> Refusal | None:
    """What refuses a state whose feet are not where it says, or not on the ground."""
    robot = ground.robot
    soles = apply(state.T_site_base, placed(robot, state.q).soles)
    resting = [rest(ground.dem, x, y, float(r)).center for (x, y, _), r in zip(state.soles, robot.radii, strict=True)]
    off = np.maximum(np.linalg.norm(soles - state.soles, axis=1), np.linalg.norm(state.soles - resting, axis=1))
    at = int(np.argmax(off))  # NaN counts as most
    if off[at] <= FEET_OFF:
        return None
    return Refusal("feet", FEET_OFF - float(off[at]), f"leg {robot.leg_names[at]} is off the ground or its place")


def place_refused(
    ground: Ground, state: LeggedState, what: str, place: tuple[float, float], known: bool
) -> LeggedResult | None:
    """The answer to a place that is off the map or on unknown ground, with what to try; None where it is neither.

    Args:
        ground: that the plan is made on.
        state: how the robot stands.
        what: is to be there, as in "the goal".
        place: (x, y) in site [m].
        known: whether the ground there is.

    Returns:
        The answer.
    """
    grid, where = ground.dem.geometry, f"{what} ({place[0]:z.2f}, {place[1]:z.2f}) m"
    off = outside(grid, *place)
    if not off <= 0:
        text = f"{where} lies {roughly(off)} m off the map; {spans(grid)}; choose a place inside"
        return no_plan(ground, state, Status.OFF_MAP, text, Tally())
    if not known:
        way = to_see(ground, state, place)
        other = "choose a place on ground that is"
        text = f"the ground at {where} is not known; {f'{way}, or {other}' if way else other}"
        return no_plan(ground, state, Status.UNKNOWN_GROUND, text, Tally())
    return None


def no_plan(ground: Ground, state: LeggedState, status: Status, reason: str, tally: Tally) -> LeggedResult:
    """An answer that is no, with what refused it."""
    return LeggedResult(
        status, None, reason, (), tally.most_refused(), unchecked(ground.robot), provenance(ground, state)
    )


def tally_in_words(tally: Tally) -> str:
    """What refused tries, how often, and by how much at least."""
    parts = []
    for name, count in tally.most_refused():
        margin, where = tally.nearest[name]
        size = f" ({where})" if np.isnan(margin) else f" (at best {margin:+.4g}: {where})"
        parts.append(f"{name} refused {count} tries{size}")
    return "; ".join(parts) or "no pose of the chassis keeps the weight over the other feet"


def unchecked(robot: LeggedRobot) -> tuple[str, ...]:
    """What the description leaves nobody to judge."""
    limits = zip(robot.joint_names, robot.efforts, robot.coupling.free, strict=True)
    found = [f"effort of {name}: no limit is said" for name, most, free in limits if free and np.isinf(most)]
    bodies = robot.body_names
    found += [f"{name}: no collision shape" for name, shapes in zip(bodies, robot.shapes, strict=True) if not shapes]
    found += [f"{bodies[a]} and {bodies[b]} touch as they are built" for a, b in sorted(robot.touching)]
    return tuple(found)


def not_judged(ground: Ground, plan: LeggedPlan | None) -> tuple[str, ...]:
    """What the description leaves nobody to judge, and ground near the way of a plan's chassis that nobody saw."""
    return unchecked(ground.robot) + _unseen(ground, plan)


def _unseen(ground: Ground, plan: LeggedPlan | None) -> tuple[str, ...]:
    """That such ground is there, and what it was taken for."""
    grid, reach = ground.dem.geometry, ground.robot.length
    if plan is None:
        return ()
    rows, cols = np.nonzero(np.isnan(ground.dem.heights))
    for x, y in np.unique(plan.Ts_site_base[:, :2, 3].round(2), axis=0):
        if (np.hypot(grid.xs[cols] - x, grid.ys[rows] - y) <= reach).any():
            return ("ground that nobody saw: taken to be as high as the highest known beside it",)
    return ()


def provenance(ground: Ground, state: LeggedState) -> Provenance:
    """What an answer was made from."""
    parents = {"robot": ground.robot.digest, "terrain": ground.dem.digest, "state": state.digest}
    return Provenance(parents=parents, settings=ground.settings)
