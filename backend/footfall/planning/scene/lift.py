"""Straight vertical moves of a wheel in task space, the joints followed continuously.

The inverse kinematics is solved along the line and each solution is the one nearest to the last. So the branch id
stays, save where two branches meet: on level ground the wrist straightens when the shank gets vertical, and the
leg passes from wrist 0 to wrist 1 without a jump. On other ground the wheel must lean a little for that.
"""

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import inverse
from footfall.planning.scene.lean_kernel import lean_each
from footfall.planning.scene.lift_kernel import followed, nearest_branch, off_line
from footfall.planning.scene.solids import leg_chain
from footfall.robot.ik import IkSolutions, solve_leg
from footfall.robot.kinematics import leg_wheel_pose
from footfall.robot.limits import farthest_past
from footfall.robot.model import Robot

STRAIGHT = 0.001
"""How far the wheel centre may leave the line between two waypoints [m]; half of what is promised."""
LARGEST_STEP = 0.2
"""Largest change of a joint from one waypoint to the next [rad]; more is taken for a break of continuity."""
LEANING = 0.05
"""Height over which a wheel leans into its leg's plane, where it has to [m]."""
_FIRST_PARTS, _MOST_PARTS = 8, 64


def branch_of(robot: Robot, leg: int, q: Array) -> int:
    """Id of the branch that a leg posture belongs to.

    Args:
        robot: the rover.
        leg: number of the leg, from 0.
        q: the posture, (6,) [rad].

    Returns:
        The id.
    """
    return nearest_branch(solve_leg(robot, leg, leg_wheel_pose(robot, q, leg)[None]).q[0], np.asarray(q, float))


def raised_poses(T_site_base: Array, T_base_wheel: Array, heights: Array) -> Array:
    """Wheel poses lifted along the site's vertical, orientation kept.

    Args:
        T_site_base: pose of the chassis, (4, 4).
        T_base_wheel: pose of the wheel at the bottom, (4, 4).
        heights: (n,) [m].

    Returns:
        (n, 4, 4) in base.
    """
    Ts = np.empty((len(heights), 4, 4))
    Ts[:] = T_base_wheel
    up_base = inverse(T_site_base)[:3, 2]
    Ts[:, :3, 3] += heights[:, None] * up_base
    return Ts


def leaned(robot: Robot, leg: int, Ts_base_wheel: Array, share: Array) -> Array:
    """Wheel poses leaned towards the plane of the leg; their centres stay.

    At share 1 the wheel's x lies in the vertical plane through hip axis and ankle, where the wrist can pass its
    straight (singular) position without turning; how far that leans the wheel is the part of its tilt that points out
    of the plane, a few degrees on walkable ground.

    Args:
        robot: the rover.
        leg: number of the leg, from 0.
        Ts_base_wheel: poses of the wheel, (n, 4, 4).
        share: of each, (n,) 0…1.

    Returns:
        (n, 4, 4).
    """
    spec = robot.description.legs[leg]
    return lean_each(np.ascontiguousarray(Ts_base_wheel, float), share, spec.T_base_hip, spec.foot)


def vertical(robot: Robot, leg: int, T_site_base: Array, q_bottom: Array, height: float) -> Array | str:
    """Leg postures from one to a height straight above it.

    So many that the straight joint-space moves between them keep the wheel centre on the line within ``STRAIGHT``. The
    wheel keeps its orientation; where that is impossible, it leans into the leg's plane (see :func:`leaned`) over the
    first ``LEANING`` and stays so.

    Args:
        robot: the rover.
        leg: number of the leg, from 0.
        T_site_base: pose of the chassis, (4, 4).
        q_bottom: where it begins, (6,) [rad].
        height: how far up it goes [m].

    Returns:
        (n, 6) [rad], the first ``q_bottom`` itself, bit for bit; or what prevents it.
    """
    kept = _vertical(robot, leg, T_site_base, q_bottom, height, lean=False)
    if not isinstance(kept, str):
        return kept
    leaning = _vertical(robot, leg, T_site_base, q_bottom, height, lean=True)
    return kept if isinstance(leaning, str) else leaning


def _vertical(robot: Robot, leg: int, T_site_base: Array, q_bottom: Array, height: float, lean: bool) -> Array | str:
    T_base_wheel = leg_wheel_pose(robot, q_bottom, leg)
    origin, up_base = T_base_wheel[:3, 3], inverse(T_site_base)[:3, 2]
    parts = _FIRST_PARTS
    while True:
        heights = np.linspace(0.0, height, parts + 1)
        Ts = raised_poses(T_site_base, T_base_wheel, heights)
        if lean:
            Ts = leaned(robot, leg, Ts, np.minimum(heights / LEANING, 1.0))
        solved = solve_leg(robot, leg, Ts)
        found = followed(np.asarray(q_bottom, float), solved.q, solved.valid, LARGEST_STEP)
        if len(found) == parts + 1 and off_line(*leg_chain(robot, leg), found, origin, up_base) <= STRAIGHT:
            return found
        if parts >= _MOST_PARTS:
            return _why_not(robot, leg, found, solved, heights)
        parts *= 2


def _why_not(robot: Robot, leg: int, found: Array, solved: IkSolutions, heights: Array) -> str:
    if len(found) == len(heights):
        return "the wheel would leave the straight line near a singular posture"
    reached = f"{heights[len(found) - 1]:z.2f} m above it"
    q, exists = solved.q[len(found)], np.isfinite(solved.q[len(found)]).all(axis=1)
    if not exists.any():
        return f"the leg can't reach farther than {reached} with the wheel's tilt kept"
    nearest = q[int(np.nanargmin(np.abs(q - found[-1]).max(axis=1)))]
    if np.abs(nearest - found[-1]).max() > LARGEST_STEP:
        return f"the leg meets a singular posture {reached}, where joints would have to jump"
    own = slice(6 * leg, 6 * leg + 6)
    return f"{farthest_past(robot, nearest, own).name} meets its limit {reached}"
