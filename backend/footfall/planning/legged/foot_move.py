"""One foot move of a legged robot: the chassis goes where the other feet carry it, then the foot is lifted over."""

from collections.abc import Callable, Iterable, Iterator
from itertools import tee
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from footfall.core.arrays import Array
from footfall.core.frames import apply, transform
from footfall.planning.legged.chassis_poses import poses
from footfall.planning.legged.footing import Rest, rest_heights
from footfall.planning.legged.problem import LeggedPlan, LeggedState
from footfall.planning.legged.rolling import Stood, legs_rolled_to
from footfall.planning.legged.stance import Ground, all_standing
from footfall.planning.legged.whole_check import Feet, Refusal, Tally
from footfall.robot.legged.posture import leg_to, placed

FootLine = Callable[[Ground, int, Array, Array], Iterator[tuple[str, Array]]]
"""Phase and centre of the sole all the way from one centre (3,) to another, of a leg."""
LEAP = 0.5
"""Between two samples no joint goes farther [rad or m]: it would be another posture of the leg."""


class Sample(NamedTuple):
    """A configuration on the way: posture, T_site_base (4, 4), its phase, and the leg in the air or −1."""

    q: Array
    T_site_base: Array
    phase: str
    leg: int


class ReadyToLift(NamedTuple):
    """Where a foot can be lifted. sample: the configuration; state: how the robot stands there, all feet down."""

    sample: Sample
    state: LeggedState


class ChassisWay(NamedTuple):
    """The chassis' way over all feet. samples: the first is the state that it begins from; end: the state after it."""

    samples: list[Sample]
    end: LeggedState


class FootMove(NamedTuple):
    """samples: the way, the first is the state it begins from; end: the state after; tally: its margins."""

    samples: list[Sample]
    end: LeggedState
    tally: Tally


def foot_moves(
    ground: Ground, state: LeggedState, leg: int, targets: Iterable[Rest], x: float, y: float, yaw: float
) -> Iterator[FootMove | Refusal]:
    """Move a leg to rests, the chassis wanted at a place with a heading; each try is made when it is asked for.

    Args:
        ground: robot, terrain and settings.
        state: how the robot stands.
        leg: number of the leg, from 0.
        targets: where the sole may rest.
        x: east, of the chassis in site [m].
        y: north, of the chassis in site [m].
        yaw: heading of the chassis in site [rad].

    Yields:
        For each rest in its turn what refused poses, and a foot move where one is found.
    """
    # where the foot is lifted is the same for all rests, and looked at once
    ready = _lifting(ground, state, leg, x, y, yaw)
    for target in targets:
        ready, each = tee(ready)
        for began, free in each:
            found = began if isinstance(began, Refusal) else _move_from(ground, state, leg, target, began, free)
            yield found
            if isinstance(found, FootMove):
                break


def _lifting(
    ground: Ground, state: LeggedState, leg: int, x: float, y: float, yaw: float
) -> Iterator[tuple[ReadyToLift | Refusal, Tally]]:
    """Where the foot may be lifted, or what refuses it there; and the margins."""
    standing = [one for one in ground.robot.legs if one != leg]
    for T in poses(ground, state.soles, state.contacts, standing, x, y, yaw, state.q):
        own = Tally()
        yield foot_free(ground, state, leg, T, own), own


def move_at(
    ground: Ground, state: LeggedState, leg: int, target: Rest, T: Array, over: FootLine | None = None
) -> FootMove | Refusal:
    """The foot move with the chassis at a pose.

    Args:
        ground: robot, terrain and settings.
        state: how the robot stands.
        leg: number of the leg, from 0.
        target: where the sole is to rest.
        T: pose of the chassis, (4, 4).
        over: the foot's line; None: a straight one.

    Returns:
        The foot move, or what refuses it.
    """
    own = Tally()
    began = foot_free(ground, state, leg, T, own)
    return began if isinstance(began, Refusal) else _move_from(ground, state, leg, target, began, own, over)


def _move_from(
    ground: Ground,
    state: LeggedState,
    leg: int,
    target: Rest,
    began: ReadyToLift,
    free: Tally,
    over: FootLine | None = None,
) -> FootMove | Refusal:
    """The foot move from where the foot bears nothing any more; free: the margins there."""
    own = Tally()
    own.merge(free)
    way = _judged_way(ground, leg, target, began, own, over)
    if isinstance(way, Refusal):
        return way
    ahead = way_ahead(ground, state, began.sample, own)
    if isinstance(ahead, Refusal):
        return ahead
    if ground.robot.rolls:
        # only the way tells to a hair where the other feet roll to
        way = _judged_way(ground, leg, target, ReadyToLift(ahead.samples[-1], ahead.end), own, over)
        if isinstance(way, Refusal):
            return way
    end = set_down(ground, ahead.end, leg, target, way[-1])
    settled = ground.check.margins(end.q, end.T_site_base, all_standing(end))
    if isinstance(settled, Refusal):
        return settled
    own.take(settled, f"leg {ground.robot.leg_names[leg]} down")
    return FootMove([*ahead.samples, *way], end, own)


def _judged_way(
    ground: Ground, leg: int, target: Rest, began: ReadyToLift, tally: Tally, over: FootLine | None
) -> list[Sample] | Refusal:
    """Samples of the foot's way from where it is lifted, or what refuses one."""
    way: list[Sample] = []
    for sample in foot_way(ground, leg, target, began.sample, over):
        held = sample if isinstance(sample, Refusal) else judged(ground, sample, began.state, leg, tally)
        if isinstance(held, Refusal):
            return held
        way.append(held)
    return way


def foot_free(ground: Ground, state: LeggedState, leg: int, T_site_base: Array, tally: Tally) -> ReadyToLift | Refusal:
    """The chassis at a pose over all feet, one leg bearing nothing any more.

    Args:
        ground: robot, terrain and settings.
        state: how the robot stands.
        leg: number of the leg, from 0.
        T_site_base: pose of the chassis, (4, 4).
        tally: takes what held.

    Returns:
        How it stands there, or what refuses it.
    """
    stood = Stood(state.soles, state.contacts, state.normals)
    q, stood = legs_rolled_to(ground.robot, ground.dem, state.q, state.T_site_base, T_site_base, stood)
    off = _off_known(ground, stood)
    if off is not None:
        return off
    there = ground.state(q, T_site_base, *stood) if np.isfinite(q).all() else state
    held = judged(ground, Sample(q, T_site_base, "body", -1), there, leg, tally)
    return held if isinstance(held, Refusal) else ReadyToLift(held, there)


def way_ahead(ground: Ground, state: LeggedState, began: Sample, tally: Tally) -> ChassisWay | Refusal:
    """The chassis' way to where a foot move begins, which must come to the same angles of the legs."""
    ahead = chassis_way(ground, state, began.T_site_base, tally)
    if isinstance(ahead, Refusal):
        return ahead
    # step by step the legs may have come to other angles than at once
    return _leaps(ahead.samples[-1].q, began.q) or ahead


def set_down(ground: Ground, state: LeggedState, leg: int, target: Rest, last: Sample) -> LeggedState:
    """The state with the leg's foot at its target, after the last sample of its way."""
    soles, contacts, normals = (part.copy() for part in (state.soles, state.contacts, state.normals))
    soles[leg], contacts[leg], normals[leg] = target
    return ground.state(last.q, last.T_site_base, soles, contacts, normals)


def chassis_way(ground: Ground, state: LeggedState, T_site_base: Array, tally: Tally) -> ChassisWay | Refusal:
    """The chassis' straight way to a pose over all feet, which roll along; each sample is checked.

    Args:
        ground: robot, terrain and settings.
        state: how the robot stands.
        T_site_base: where the way ends, (4, 4).
        tally: takes what held.

    Returns:
        The way, or what refuses a sample of it.
    """
    robot, start = ground.robot, state.T_site_base
    turn = Rotation.from_matrix(start[:3, :3].T @ T_site_base[:3, :3]).as_rotvec()
    shift = T_site_base[:3, 3] - start[:3, 3]
    far = float(np.linalg.norm(shift)) + float(np.linalg.norm(turn)) * robot.length
    count = max(int(np.ceil(far / step_length(ground))), 1)
    samples = [Sample(state.q, start, "body", -1)]
    stood = Stood(state.soles, state.contacts, state.normals)
    for share in np.arange(1, count + 1) / count:
        R = start[:3, :3] @ Rotation.from_rotvec(share * turn).as_matrix()
        T = transform(R, start[:3, 3] + share * shift)
        q, T_before = samples[-1].q, samples[-1].T_site_base
        there, stood = legs_rolled_to(robot, ground.dem, q, T_before, T, stood)
        refused = _off_known(ground, stood) or _leaps(q, there)
        answer = refused or ground.check.margins(there, T, Feet(robot.legs, stood.contacts, stood.normals))
        if isinstance(answer, Refusal):
            return answer
        tally.take(answer, "chassis")
        samples.append(Sample(there, T, "body", -1))
    return ChassisWay(samples, ground.state(samples[-1].q, T_site_base, *stood))


def plan_of(samples: list[Sample], moves: list[int], start: LeggedState, end: LeggedState) -> LeggedPlan:
    """The plan of samples in order; moves: the leg of each foot move; start, end: the states before and after."""
    return LeggedPlan(
        np.array([one.q for one in samples]),
        np.array([one.T_site_base for one in samples]),
        tuple(one.phase for one in samples),
        np.array([one.leg for one in samples], np.int64),
        tuple(moves),
        start,
        end,
    )


def judged(ground: Ground, sample: Sample, state: LeggedState, leg: int, tally: Tally) -> Sample | Refusal:
    """The sample, where the robot holds without that foot."""
    standing = [one for one in ground.robot.legs if one != leg]
    answer = ground.check.margins(sample.q, sample.T_site_base, Feet(standing, state.contacts, state.normals))
    if isinstance(answer, Refusal):
        return answer
    tally.take(answer, f"leg {ground.robot.leg_names[leg]} {sample.phase}")
    return sample


def foot_way(
    ground: Ground, leg: int, target: Rest, began: Sample, over: FootLine | None = None
) -> Iterator[Sample | Refusal]:
    """Samples of the foot's way up, over and down, the chassis still; none is judged.

    It ends where the leg would jump, and where it does not reach: there its angles are NaN.
    """
    T, q = began.T_site_base, began.q
    start = apply(T, placed(ground.robot, q).soles[leg])
    for phase, center in (over or raised_line)(ground, leg, start, target.center):
        there = q.copy()
        there[ground.robot.slices[leg]] = leg_to(ground.robot, leg, T, center, q)
        leap = _leaps(q, there)
        if leap is not None:
            yield leap
            return
        yield Sample(there, T, phase, leg)
        if not np.isfinite(there).all():
            return
        q = there


def raised_line(ground: Ground, leg: int, start: Array, end: Array) -> Iterator[tuple[str, Array]]:
    """A foot's line: straight up, straight across above the ground between, straight down.

    Args:
        ground: robot, terrain and settings.
        leg: number of the leg, from 0.
        start: centre of the sole, (3,) in site [m].
        end: the same at the end, (3,) in site [m].

    Yields:
        Phase and centre of the sole, (3,) in site [m].
    """
    across = max(int(np.ceil(np.linalg.norm(end[:2] - start[:2]) / step_length(ground))), 1)
    shares = np.arange(across + 1) / across
    yield from raised(ground, leg, start, end, start[:2] + shares[:, None] * (end - start)[:2])


def raised(ground: Ground, leg: int, start: Array, end: Array, between: Array) -> Iterator[tuple[str, Array]]:
    """A foot's line straight up, over places above the ground, and straight down.

    Args:
        ground: robot, terrain and settings.
        leg: number of the leg, from 0.
        start: centre of the sole, (3,) in site [m].
        end: the same at the end, (3,) in site [m].
        between: places (n, 2) in a row, the first over the start, the last over the end [m].

    Yields:
        Phase and centre of the sole, (3,) in site [m].
    """
    step, radius = step_length(ground), float(ground.robot.radii[leg])
    heights = rest_heights(ground.dem, between, radius)
    top = float(np.nanmax([start[2], end[2], *heights])) + ground.settings.lift * ground.robot.length
    for z in _line(float(start[2]), top, step):
        yield "lift", np.array([start[0], start[1], z])
    for x, y in between[1:]:
        yield "swing", np.array([x, y, top])
    for z in _line(top, float(end[2]), step):
        yield "lower", np.array([end[0], end[1], z])


def _line(start: float, end: float, step: float) -> Array:
    """Even places between, the start left out."""
    count = max(int(np.ceil(abs(end - start) / step)), 1)
    return start + np.arange(1, count + 1) / count * (end - start)


def step_length(ground: Ground) -> float:
    """How far feet and chassis go between samples [m]: no farther than what bodies keep apart."""
    return max(min(ground.robot.clearances.values()), 0.01 * ground.robot.length)


def _off_known(ground: Ground, stood: Stood) -> Refusal | None:
    """What refuses feet that roll onto ground that nobody saw."""
    unknown = ~np.isfinite(stood.soles).all(axis=1)
    if not unknown.any():
        return None
    return Refusal(
        "foot", float("nan"), f"leg {ground.robot.leg_names[int(unknown.argmax())]} rolls onto unknown ground"
    )


def _leaps(q: Array, there: Array) -> Refusal | None:
    if np.isfinite(there).all() and np.abs(there - q).max() > LEAP:
        return Refusal("limits", LEAP - float(np.abs(there - q).max()), "a leg would jump to another posture")
    return None
