"""How a robot that others described gives way: each joint is a spring between its set point and where it is.

At rest its effort, stiffness × (set point − place), holds the weight against the forces of the ground, and feet that
stand roll, but do not slip. Two questions: which set points hold a posture, and where set points lead. The pose and
the forces on the feet are found together, by Newton's method; how the weight moves with the pose follows in its rounds.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from footfall.balance.balance_settings import GRAVITY
from footfall.balance.legged_effort import moves_at, statics_of
from footfall.core.arrays import Array
from footfall.core.frames import apply, transform
from footfall.planning.legged.measured import as_measured, set_points_of
from footfall.planning.legged.rolling import Stood, foot_turns, rested, ways_rolled
from footfall.planning.legged.whole_check import Feet
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import Placed, placed
from footfall.terrain.dem import Dem

FEWEST_FEET = 3
"""Fewer can't hold a robot at rest."""
MOST_ROUNDS, CLOSE = 40, 1e-8
"""Newton's method ends when nothing goes farther than this [m, rad] in a round; if it does not, nothing holds it."""
STRIDE = 0.05
"""No set point goes farther between two rests that are looked at [rad or m]."""
SUNK = 1e-6
"""A foot that came off and would be deeper in the ground than this stands again [m]."""
PULLED = 1e-6
"""A foot that the ground would have to pull by this share of the weight comes off."""


class SprungRest(NamedTuple):
    """A robot at rest on its springs.

    set_points, q: (joints,) [rad or m]; T_site_base: (4, 4). forces: of the ground on the feet, (legs, 3) in site [N],
    zero for those in the air.
    """

    set_points: Array
    q: Array
    T_site_base: Array
    forces: Array


def held_set_points(robot: LeggedRobot, q: Array, T_site_base: Array, feet: Feet) -> Array:
    """Set points that hold a robot in a posture, its weight on its feet by forces of least norm.

    Args:
        robot: the robot, of which every joint's stiffness is known.
        q: the posture, (joints,) [rad or m].
        T_site_base: pose of the chassis, (4, 4).
        feet: those that stand.

    Returns:
        (joints,) [rad or m].

    Raises:
        InvalidInput: no forces inside friction hold the robot on these feet.
    """
    return set_points_of(robot, as_measured(robot, q, T_site_base, feet))


def gives_way_to(
    robot: LeggedRobot, dem: Dem, set_points: Array, before: SprungRest, stood: Stood, down: Sequence[int]
) -> tuple[SprungRest, Stood] | None:
    """Where set points lead that go straight from those before.

    Args:
        robot: the robot.
        dem: the ground, in site.
        set_points: (joints,) [rad or m].
        before: how it rested.
        stood: where its feet stood then.
        down: numbers of the legs that stand.

    Returns:
        How it rests, and where its feet stand; None where nothing holds it.
    """
    way = set_points - before.set_points
    parts = max(1, int(np.ceil(float(np.abs(way).max()) / STRIDE)))
    rest, feet = before, stood
    for part in range(1, parts + 1):
        asked = set_points if part == parts else before.set_points + part / parts * way
        found = _a_little_on(robot, dem, asked, rest, feet, down)
        if found is None:
            return None
        rest, feet = found
    return rest, feet


def _a_little_on(
    robot: LeggedRobot, dem: Dem, set_points: Array, before: SprungRest, stood: Stood, down: Sequence[int]
) -> tuple[SprungRest, Stood] | None:
    """The same for a part of the way."""
    turns = foot_turns(robot, placed(robot, before.q), before.T_site_base)
    found = _at_rest(robot, set_points, before, stood, down, turns)
    if found is None:
        return None
    soles = _places(robot, stood, turns, placed(robot, found.q), found.T_site_base)
    # the ground under a foot that rolled is higher or lower than its tangent
    now = rested(robot, dem, stood, soles, down)
    found = _at_rest(robot, set_points, found, now, down, None)
    return None if found is None else (found, now)


def _at_rest(
    robot: LeggedRobot, set_points: Array, near: SprungRest, stood: Stood, down: Sequence[int], turns: Array | None
) -> SprungRest | None:
    """The rest with feet at ``stood``, or, with how they were turned there (legs, 3, 3), where they roll to."""
    feet = [leg for leg in down if np.isfinite(stood.soles[leg]).all()]
    standing, again = list(feet), set[int]()
    while True:
        if len(standing) < FEWEST_FEET:
            return None
        found = _balanced(robot, set_points, near, stood, standing, turns)
        if found is None:
            return None
        pulls = (found.forces * stood.normals).sum(axis=1)[standing]
        if pulls.min() < -PULLED * robot.mass * GRAVITY:
            standing.pop(int(np.argmin(pulls)))
            continue
        # one that is pulled again would slide along the ground, and bear next to nothing
        off = [leg for leg in feet if leg not in standing and leg not in again]
        where = placed(robot, found.q)
        deeper = _places(robot, stood, turns, where, found.T_site_base) - apply(found.T_site_base, where.soles)
        deep = {leg: float(deeper[leg] @ stood.normals[leg]) for leg in off}
        sunk = max(deep, key=lambda leg: deep[leg], default=-1)
        if sunk < 0 or deep[sunk] <= SUNK:
            return found
        again.add(sunk)
        standing = sorted([*standing, sunk])


def _places(robot: LeggedRobot, stood: Stood, turns: Array | None, where: Placed, T_site_base: Array) -> Array:
    """Where the ground has the centres of soles, (legs, 3) in site [m]."""
    if turns is None:
        return stood.soles
    return stood.soles + ways_rolled(robot, stood.normals, turns, foot_turns(robot, where, T_site_base))


def _balanced(
    robot: LeggedRobot, set_points: Array, near: SprungRest, stood: Stood, standing: list[int], turns: Array | None
) -> SprungRest | None:
    """The same for feet that the ground holds whatever it has to do for it."""
    q, T, forces = near.q.copy(), near.T_site_base.copy(), np.zeros_like(near.forces)
    forces[standing] = near.forces[standing]
    weight = np.array([0.0, 0.0, robot.mass * GRAVITY])
    for _ in range(MOST_ROUNDS):
        where, R = placed(robot, q), T[:3, :3]
        gravity, axes, origins, com = statics_of(robot, q, R)
        wanted = _places(robot, stood, turns, where, T)
        soles = apply(T, where.soles)
        arms = soles + stood.contacts - stood.soles - T[:3, 3]
        moves = {leg: moves_at(robot, leg, arms[leg] @ R, axes, origins) @ R.T for leg in standing}
        efforts = gravity.copy()
        for leg, move in moves.items():
            efforts[robot.slices[leg]] -= move @ forces[leg]
        going = set_points - efforts / robot.stiffness - q
        n = len(standing)
        matrix, lacking = np.zeros((6 + 3 * n, 6 + 3 * n)), np.zeros(6 + 3 * n)
        for k, leg in enumerate(standing):
            rows, own = slice(3 * k, 3 * k + 3), robot.slices[leg]
            columns, arm = slice(6 + 3 * k, 9 + 3 * k), arms[leg]
            across = np.array([[0.0, -arm[2], arm[1]], [arm[2], 0.0, -arm[0]], [-arm[1], arm[0], 0.0]])
            matrix[rows, :3], matrix[rows, 3:6] = np.eye(3), -across
            matrix[rows, columns] = moves[leg].T @ (moves[leg] / robot.stiffness[own, None])
            matrix[3 * n : 3 * n + 3, columns], matrix[3 * n + 3 :, columns] = np.eye(3), across
            lacking[rows] = wanted[leg] - soles[leg] - moves[leg].T @ going[own]
            lacking[3 * n : 3 * n + 3] -= forces[leg]
            lacking[3 * n + 3 :] -= across @ forces[leg]
        lacking[3 * n : 3 * n + 3] += weight
        lacking[3 * n + 3 :] += np.cross(apply(T, com) - T[:3, 3], weight)
        try:
            change = np.linalg.solve(matrix, lacking)
        except np.linalg.LinAlgError:
            return None
        for k, leg in enumerate(standing):
            more = change[6 + 3 * k : 9 + 3 * k]
            forces[leg] += more
            going[robot.slices[leg]] += moves[leg] @ more / robot.stiffness[robot.slices[leg]]
        q = q + going
        T = transform(Rotation.from_rotvec(change[3:6]).as_matrix() @ R, T[:3, 3] + change[:3])
        if not np.isfinite(q).all() or not np.isfinite(T).all():
            return None
        if max(float(np.abs(change[:6]).max()), float(np.abs(going).max())) < CLOSE:
            return SprungRest(set_points, q, T, forces)
    return None
