"""The stance at ease: where a robot's feet stand under its level chassis so that each has the longest stroke.

It is searched for once for each robot, on level ground, and no posture is asked for but one named "stand".
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from footfall.balance.support import margin
from footfall.core.arrays import Array
from footfall.core.errors import InvalidRobot
from footfall.planning.legged.over_ground import NEAR_SOLE
from footfall.robot.legged.apart import BodyPairs
from footfall.robot.legged.legged_model import STAND
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall.robot.limits import farthest_past

STROKES = (0.06, 0.1, 0.14, 0.18)
"""Half strokes that are tried, shares of the leg."""
LIFTED, LOWERED = 0.15, 0.06
"""How far a foot must get up and down from its place, shares of the leg."""
HEIGHTS = (0.9, 0.85, 0.8, 0.75, 0.7, 0.6, 0.5)
OUTWARD = (0.15, 0.3, 0.0, 0.5)
ASIDE = (0.0, -0.12, 0.12, -0.24, 0.24, -0.4, 0.4)
"""Places that are tried under a hip: height of the base, offsets outward and across that; shares of the leg. The first
offsets are the best ones: they widen the stance."""
GIVEN_UP = 0.04
"""Share of the leg of its longest stroke that is given up for a wider stance."""
NARROW = 0.4
"""How much stroke a foot is worth that stands this much nearer to its best place."""
SPARE, SPARE_OF_SLIDE = 0.1, 0.1
"""Joints are at least this far inside their limits at ease: those that turn [rad], those that slide by a share of their
way."""


class Ease(NamedTuple):
    """A robot that stands at ease.

    q: (joints,); soles: (legs, 3) their centres in base [m]; stroke: half of how far each foot gets [m]; apart: pairs
    of bodies with the clearances that this stance allows.
    """

    q: Array
    soles: Array
    stroke: float
    apart: BodyPairs

    def height(self, robot: LeggedRobot) -> float:
        """Of the base over level ground [m]."""
        return float(-(self.soles[:, 2] - robot.radii).min())


class _Choice(NamedTuple):
    """A place of one foot.

    q: posture of the leg; stroke: its stroke as a share of the leg; off: how far from the best place [m]; turned: how
    far the joints are from the middle [rad].
    """

    q: Array
    stroke: float
    off: float
    turned: float


@lru_cache(maxsize=8)
def at_ease(robot: LeggedRobot) -> Ease:
    """How a robot stands at ease on level ground: in the posture named "stand", or as high as suits its feet best.

    Raises InvalidRobot where that posture, or without one every height of the chassis, leaves a foot without a stroke
    or bodies touching.
    """
    apart = BodyPairs(robot)
    if STAND in robot.postures:
        q = robot.posture(STAND)
        strokes = [float(_strokes(robot, leg, q[None, robot.slices[leg]])[0]) for leg in robot.legs]
        if min(strokes) == 0:
            _require_inside(robot, q)
            leg = robot.leg_names[int(np.argmin(strokes))]
            least = f"{STROKES[0] * robot.length:z.3f} m to all sides or not {LIFTED * robot.length:z.3f} m up"
            raise InvalidRobot(f"{robot.name}: in its posture {STAND!r} the foot of leg {leg} does not get {least}")
        return _ease(robot, apart, q, min(strokes) * robot.length)
    plans = []
    for share in _heights(robot):
        sole_height = -share * robot.length
        choices = [_choices(robot, leg, sole_height) for leg in robot.legs]
        if all(choices):
            stroke = min(max(one.stroke for one in each) for each in choices)
            wide = max(min(one.off for one in each if one.stroke >= stroke - GIVEN_UP) for each in choices)
            plans.append((stroke - NARROW * wide / robot.length, stroke, share, choices))
    # the higher of equal ones, as there the motors bear least
    for _, stroke, share, choices in sorted(plans, key=lambda plan: (-plan[0], -plan[2])):
        found = _apart_from_each_other(robot, apart, choices, stroke - GIVEN_UP, -share * robot.length)
        if found is not None:
            q, least = found
            return _ease(robot, apart, q, least * robot.length)
    raise InvalidRobot(
        f"{robot.name}: no stance was found from which every foot gets {STROKES[0] * robot.length:z.3f} m to all sides "
        f"and {LIFTED * robot.length:z.3f} m up; name a posture {STAND!r} in its robot.toml",
        heights=[share for _, _, share, _ in plans],
    )


def _require_inside(robot: LeggedRobot, q: Array) -> None:
    """Raises InvalidRobot where the posture "stand" (joints,) has a joint outside its limits."""
    worst = farthest_past(robot, q)
    if worst.excess > 0:
        limits = f"{robot.lower[worst.joint]:g} … {robot.upper[worst.joint]:g}"
        where = f"{worst.name} at {q[worst.joint]:g}, outside of {limits}"
        raise InvalidRobot(f"{robot.name}: its posture {STAND!r} has {where}")


def _heights(robot: LeggedRobot) -> tuple[float, ...]:
    """Shares of the leg that are tried.

    Where joints slide, first that at which they are in the middle of their way, then those of legs that are as long.
    """
    limbs = [solver.limb for solver in robot.limbs]
    slides = np.concatenate([limb.slides for limb in limbs])
    if not slides.any():
        return HEIGHTS
    q = np.where(slides, (robot.lower + robot.upper) / 2, np.clip(0.0, robot.lower, robot.upper))
    lowest = float((placed(robot, q).soles[:, 2] - robot.radii).min())
    out = max(float(np.abs(q[own][limb.slides]).sum()) for own, limb in zip(robot.slices, limbs, strict=True))
    return (-lowest / robot.length, *(share * (1 + out / robot.length) for share in HEIGHTS))


def _ease(robot: LeggedRobot, apart: BodyPairs, q: Array, stroke: float) -> Ease:
    where, wanted = placed(robot, q), apart.least
    apart.at_ease(where.Ts_base_body)
    spare = margin(where.soles, where.com[:2])
    if not (apart.least > 0).all():
        at = int(np.argmin(apart.least))
        why = (
            "touch in the stance at ease"
            if wanted[at] > 0
            else "have a clearance of 0 in the robot.toml, by which what touches can't be told: say 0.001 m or more"
        )
        raise InvalidRobot(f"{robot.name}: {apart.pair_names(at)} {why}")
    if spare <= 0:
        raise InvalidRobot(
            f"{robot.name}: its centre of mass is {-spare:z.3f} m outside of its feet in the stance at ease"
        )
    return Ease(q, where.soles, stroke, apart)


def _choices(robot: LeggedRobot, leg: int, height: float) -> list[_Choice]:
    """Places of a foot at a height of its sole's lowest point in base [m] that leave it a stroke."""
    limb, solver, length = robot.limbs[leg].limb, robot.limbs[leg], robot.length
    hip = limb.placements[0, :3, 3]
    outward = hip[:2] / max(float(np.linalg.norm(hip[:2])), 1e-9)
    # beside a body that is longer than wide feet go out sideways
    if _in_rows(robot):
        outward = np.array([0.0, np.sign(hip[1])])
    aside = np.array([-outward[1], outward[0]])
    xy = np.array([hip[:2] + length * (out * outward + to * aside) for out in OUTWARD for to in ASIDE])
    found = solver.solve(np.column_stack([xy, np.full(len(xy), height + robot.radii[leg])]))
    q = found.q[np.isfinite(found.left)]
    place = np.nonzero(np.isfinite(found.left))[0]
    spare = np.where(limb.slides, SPARE_OF_SLIDE * (limb.upper - limb.lower), SPARE)
    inside = (np.minimum(q - limb.lower, limb.upper - q) >= spare).all(axis=1)
    strokes = np.zeros(len(q))
    if inside.any():
        strokes[inside] = _strokes(robot, leg, q[inside])
    off = np.linalg.norm(xy[place] - xy[0], axis=1)
    middle = np.clip(0.0, limb.lower, limb.upper)
    turned = np.abs(q - middle).sum(axis=1)
    return [_Choice(*one) for one in zip(q, strokes, np.round(off, 6), turned, strict=True) if one[1] > 0]


def _in_rows(robot: LeggedRobot) -> bool:
    """Whether the hips stand in two rows along x, not in a ring."""
    hips = np.array([solver.limb.placements[0, :2, 3] for solver in robot.limbs])
    return float(np.ptp(hips[:, 0])) > 1.2 * float(np.ptp(hips[:, 1]))


def _strokes(robot: LeggedRobot, leg: int, q: Array) -> Array:
    """For each posture (n, joints) the longest of STROKES by which the foot gets to all sides, up and down; else 0."""
    length = robot.length
    upright = np.array([(0.0, 0.0, LIFTED), (0.0, 0.0, -LOWERED)]) * length
    gets, longest = _reaches(robot, leg, upright, q), np.zeros(len(q))
    for share in STROKES:
        sides = share * length * np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)], float)
        gets &= _reaches(robot, leg, np.concatenate([sides, sides + upright[0]]), q)
        longest[gets] = share
    return longest


def _reaches(robot: LeggedRobot, leg: int, ways: Array, q: Array) -> NDArray[np.bool_]:
    """Whether a leg gets from postures (n, joints) along all of the ways (k, 3), joints short of a quarter turn."""
    start = robot.limbs[leg].feet(q)[:, :3, 3]
    there = robot.limbs[leg].solve_from((start[:, None] + ways).reshape(-1, 3), np.repeat(q, len(ways), axis=0))
    off = np.abs(there.reshape(len(q), len(ways), -1) - q[:, None])
    return np.asarray((off < np.pi / 2).all(axis=(1, 2)))  # NaN is not


def _above(robot: LeggedRobot, leg: int, q: Array, ground: float) -> bool:
    """Whether the leg's bodies keep their clearance from level ground, all but where the foot stands."""
    posture = np.clip(np.zeros(len(robot.joint_names)), robot.lower, robot.upper)
    posture[robot.slices[leg]] = q
    where = placed(robot, posture)
    clearance = robot.clearances["ground"]
    near = robot.radii[leg] + NEAR_SOLE * clearance
    for body in range(robot.slices[leg].start + 1, robot.slices[leg].stop + 1):
        T_base_body = where.Ts_base_body[body]
        points = robot.corners[body] @ T_base_body[:3, :3].T + T_base_body[:3, 3]
        far = np.linalg.norm(points - where.soles[leg], axis=1) > near
        if (points[far, 2] < ground + clearance).any():
            return False
    return True


def _apart_from_each_other(
    robot: LeggedRobot, apart: BodyPairs, choices: list[list[_Choice]], stroke: float, height: float
) -> tuple[Array, float] | None:
    """One choice for each leg, of those with that stroke the nearest to its best place that keeps the bodies apart.

    Answers the posture and the least stroke. Legs before it keep their choice: nothing is taken back; None where a leg
    then has none.
    """
    q, least = np.clip(np.zeros(len(robot.joint_names)), robot.lower, robot.upper), np.inf
    for leg in robot.legs:
        wanted = [one for one in choices[leg] if one.stroke >= max(stroke, STROKES[0]) - 1e-9]
        for choice in sorted(wanted, key=lambda one: (one.off, one.turned)):
            q[robot.slices[leg]] = choice.q
            if _above(robot, leg, choice.q, height) and _is_free(robot, apart, q, leg):
                least = min(least, choice.stroke)
                break
        else:
            return None
    return q, least


def _is_free(robot: LeggedRobot, apart: BodyPairs, q: Array, last: int) -> bool:
    """Whether bodies of the base and of legs up to the last keep their clearances, or half of them near the base."""
    bodies = robot.slices[last].stop + 1
    placed_pairs = (apart.pairs < bodies).all(axis=1)
    distances = apart.distances(placed(robot, q).Ts_base_body)
    least = np.where(apart.pairs[:, 0] == 0, 1e-3, apart.least)
    return bool((distances >= least)[placed_pairs].all())
