"""Points that the wheel's centre is to pass during the swing: postures of the leg there."""

from collections.abc import Sequence

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, inverse, rotation
from footfall.planning.scene.lift import leaned
from footfall.planning.scene.unreached import unreached
from footfall.planning.step.problem import MOST_THROUGH, Point
from footfall.planning.step.search.edges import Space
from footfall.planning.step.situation import RAISED, Situation
from footfall.planning.step.target import HEADINGS
from footfall.robot.ik import solve_leg


def require_points(through: Sequence[Point]) -> tuple[Point, ...]:
    """The points as they are recorded. Raises InvalidInput unless they are up to MOST_THROUGH of finite x, y, z."""
    points = [tuple(float(one) for one in point) for point in through]
    if len(points) > MOST_THROUGH or any(len(point) != 3 or not np.isfinite(point).all() for point in points):
        raise InvalidInput(
            f"the wheel can be led through up to {MOST_THROUGH} points of x, y and z [m] in the site frame",
            through=[list(point) for point in points],
        )
    return tuple((x, y, z) for x, y, z in points)


def via_postures(
    situation: Situation, space: Space, through: Sequence[Point], q_start: Array, q_goal: Array
) -> list[Array] | str:
    """A posture for each point that is allowed during a swing.

    The wheel keeps the tilt that it has at the start, leaned into the leg's plane or not, and may turn about the
    vertical. Of the postures that are allowed the one is taken from which the largest joint changes back to the point
    before and on to the goal are least.

    Args:
        situation: what the leg may do.
        space: what is free during the swing.
        through: points (x, y, z) in site that the wheel's centre passes, in order [m].
        q_start: posture where the swing begins, (6,) [rad].
        q_goal: posture where it ends, (6,) [rad].

    Returns:
        Postures (6,) [rad], or what forbids one.
    """
    found: list[Array] = []
    before = q_start
    for number, point in enumerate(through, 1):
        where = f"point {number} ({', '.join(f'{one:z.2f}' for one in point)})"
        possible = _postures(situation, point, q_start)
        if not len(possible):
            what = unreached(situation.robot, situation.leg, _poses(situation, point, q_start))
            return f"no joint angles inside the limits put the wheel's centre at {where}: {what}; move it"
        far = np.abs(possible - before).max(axis=1) + np.abs(possible - q_goal).max(axis=1)
        ranked = possible[np.argsort(far, kind="stable")]
        allowed = next((q for q in ranked if space.is_free(q)), None)
        if allowed is None:
            return f"the wheel can't be at {where}: {situation.objection(ranked[0], RAISED)}; move it"
        found.append(allowed)
        before = allowed
    return found


def _postures(situation: Situation, point: Point, q_start: Array) -> Array:
    """Postures (n, 6) inside the limits with the wheel's centre at a point of the site [m]."""
    solved = solve_leg(situation.robot, situation.leg, _poses(situation, point, q_start))
    return solved.q[solved.valid]


def _poses(situation: Situation, point: Point, q_start: Array) -> Array:
    """Wheel poses in base (n, 4, 4) that are tried there."""
    T_base_start = situation.wheel(q_start)
    R_site_base = situation.T_site_base[:3, :3]
    Ts = np.tile(T_base_start, (len(HEADINGS), 1, 1))
    for T, turn in zip(Ts, HEADINGS, strict=True):
        T[:3, :3] = R_site_base.T @ rotation("z", float(turn)) @ R_site_base @ T_base_start[:3, :3]
    Ts[:, :3, 3] = apply(inverse(situation.T_site_base), np.asarray(point, float))
    leaning = leaned(situation.robot, situation.leg, Ts, np.ones(len(Ts)))
    return np.concatenate([Ts, leaning])
