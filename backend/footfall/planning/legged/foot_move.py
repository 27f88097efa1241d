"""One foot move of a legged robot: the chassis goes where the other feet carry it, then the foot is lifted over."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from footfall.core.frames import apply, transform
from footfall.planning.legged.chassis_poses import poses
from footfall.planning.legged.footing import Rest, rest_heights
from footfall.planning.legged.problem import LeggedPlan, LeggedState
from footfall.planning.legged.stance import Ground, all_standing
from footfall.planning.legged.whole_check import Feet, Refusal, Tally
from footfall.robot.legged.posture import legs_to, placed

Array = NDArray[np.float64]

LEAP = 0.5
"""Between two samples no joint goes farther [rad or m]: it would be another posture of the leg."""


class Sample(NamedTuple):
    """A configuration on the way: posture, T_site_base (4, 4), its phase, and the leg in the air or −1."""

    q: Array
    T_site_base: Array
    phase: str
    leg: int


class FootMove(NamedTuple):
    """samples: the way, the first is the state it begins from; end: the state after; tally: its margins."""

    samples: list[Sample]
    end: LeggedState
    tally: Tally


def foot_move(
    ground: Ground, state: LeggedState, leg: int, target: Rest, x: float, y: float, yaw: float, tally: Tally
) -> FootMove | None:
    """The leg goes to a rest, the chassis wanted at (x, y) with a heading; None where every pose was refused.

    tally: takes the refusals.
    """
    robot, standing = ground.robot, [one for one in ground.robot.legs if one != leg]
    for T in poses(ground, state.soles, state.contacts, standing, x, y, yaw, state.q):
        own = Tally()
        began = _judged(ground, Sample(legs_to(robot, T, state.soles, state.q), T, "body", -1), state, leg, own)
        if isinstance(began, Refusal):
            tally.refuse(began)
            continue
        way = _swing(ground, state, leg, target, began, own)
        if isinstance(way, Refusal):
            tally.refuse(way)
            continue
        ahead = chassis_way(ground, state, T, own)
        if isinstance(ahead, Refusal):
            tally.refuse(ahead)
            continue
        # step by step the legs may have come to other angles than at once
        apart = _leaps(ahead[-1].q, began.q)
        if apart is not None:
            tally.refuse(apart)
            continue
        soles, contacts, normals = (part.copy() for part in (state.soles, state.contacts, state.normals))
        soles[leg], contacts[leg], normals[leg] = target
        end = ground.state(way[-1].q, T, soles, contacts, normals)
        settled = ground.check.margins(end.q, T, all_standing(end))
        if isinstance(settled, Refusal):
            tally.refuse(settled)
            continue
        own.take(settled, f"leg {robot.leg_names[leg]} down")
        return FootMove([*ahead, *way], end, own)
    return None


def chassis_way(ground: Ground, state: LeggedState, T_site_base: Array, tally: Tally) -> list[Sample] | Refusal:
    """Samples of the chassis' straight way to a pose over all feet, each checked; the first is the state itself."""
    robot, start = ground.robot, state.T_site_base
    turn = Rotation.from_matrix(start[:3, :3].T @ T_site_base[:3, :3]).as_rotvec()
    shift = T_site_base[:3, 3] - start[:3, 3]
    far = float(np.linalg.norm(shift)) + float(np.linalg.norm(turn)) * robot.length
    count = max(int(np.ceil(far / _step(ground))), 1)
    samples, q = [Sample(state.q, start, "body", -1)], state.q
    feet = all_standing(state)
    for share in np.arange(1, count + 1) / count:
        R = start[:3, :3] @ Rotation.from_rotvec(share * turn).as_matrix()
        T = transform(R, start[:3, 3] + share * shift)
        there = legs_to(robot, T, state.soles, q)
        answer = _leaps(q, there) or ground.check.margins(there, T, feet)
        if isinstance(answer, Refusal):
            return answer
        tally.take(answer, "chassis")
        q = there
        samples.append(Sample(q, T, "body", -1))
    return samples


def plan_of(samples: list[Sample], moves: list[int], start: LeggedState, end: LeggedState) -> LeggedPlan:
    return LeggedPlan(
        np.array([one.q for one in samples]),
        np.array([one.T_site_base for one in samples]),
        tuple(one.phase for one in samples),
        np.array([one.leg for one in samples], np.int64),
        tuple(moves),
        start,
        end,
    )


def _judged(ground: Ground, sample: Sample, state: LeggedState, leg: int, tally: Tally) -> Sample | Refusal:
    """The sample, where the robot holds without that foot."""
    standing = [one for one in ground.robot.legs if one != leg]
    answer = ground.check.margins(sample.q, sample.T_site_base, Feet(standing, state.contacts, state.normals))
    if isinstance(answer, Refusal):
        return answer
    tally.take(answer, f"leg {ground.robot.leg_names[leg]} {sample.phase}")
    return sample


def _swing(
    ground: Ground, state: LeggedState, leg: int, target: Rest, began: Sample, tally: Tally
) -> list[Sample] | Refusal:
    """Samples of the foot's way up, over and down, each checked, the chassis still."""
    samples, T, q = [], began.T_site_base, began.q
    for phase, center in _over(ground, leg, apply(T, placed(ground.robot, q).soles[leg]), target.center):
        soles = state.soles.copy()
        soles[leg] = center
        there = q.copy()
        part = ground.robot.slices[leg]
        there[part] = legs_to(ground.robot, T, soles, q)[part]
        judged = _leaps(q, there) or _judged(ground, Sample(there, T, phase, leg), state, leg, tally)
        if isinstance(judged, Refusal):
            return judged
        samples.append(judged)
        q = there
    return samples


def _over(ground: Ground, leg: int, start: Array, end: Array) -> Iterator[tuple[str, Array]]:
    """Phase and centre of the sole on a raised line: straight up, across above the ground between, straight down."""
    step, radius = _step(ground), float(ground.robot.radii[leg])
    across = max(int(np.ceil(np.linalg.norm(end[:2] - start[:2]) / step)), 1)
    shares = np.arange(across + 1) / across
    between = start[:2] + shares[:, None] * (end - start)[:2]
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


def _step(ground: Ground) -> float:
    """How far feet and chassis go between samples [m]: no farther than what bodies keep apart."""
    return max(min(ground.robot.clearances.values()), 0.01 * ground.robot.length)


def _leaps(q: Array, there: Array) -> Refusal | None:
    if np.isfinite(there).all() and np.abs(there - q).max() > LEAP:
        return Refusal("limits", LEAP - float(np.abs(there - q).max()), "a leg would jump to another posture")
    return None
