"""What cameras see of a robot that others described, and how wrong its joints may have that.

The shapes are those of its collisions: what has none is taken for ground. Nobody measured the errors: ENCODER_SD,
SLIDE_SD and SAG_SHARE are assumed.
"""

import numpy as np

from footfall.core import frames
from footfall.core.arrays import Array
from footfall.core.mesh import Mesh
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import Placed, placed
from footfall.robot.meshes.shapes import merged
from footfall.terrain.rover_mask.leg_errors import ENCODER_SD, point_jacobians

SLIDE_SD = 0.003
"""Standard deviation of a joint that slides [m]."""
SAG_SHARE = 0.015
"""A loaded leg brings its foot up to this much nearer to the chassis than its joints say, as a share of the leg."""


def legged_parts(robot: LeggedRobot, posture: Array) -> list[tuple[Mesh, Array]]:
    """All that a camera can see of the robot.

    Args:
        robot: the robot.
        posture: (joints,) [rad or m].

    Returns:
        The shapes of each body that has some, with its T_base_body, (4, 4).
    """
    Ts = placed(robot, posture).Ts_base_body
    return [(merged(list(shapes)), T) for shapes, T in zip(robot.shapes, Ts, strict=True) if shapes]


def legged_displacements(robot: LeggedRobot, posture: Array) -> list[tuple[Array, Array, bool]]:
    """How far the vertices of every part of :func:`legged_parts`, in that order, may be from where they are drawn.

    The chassis stays: cameras ride on it.

    Args:
        robot: the robot.
        posture: (joints,) [rad or m].

    Returns:
        For each part: ``spread`` (n, 3, k), what each independent error of its leg of k joints moves a vertex by at one
        standard deviation, ``bend`` (n, 3), what the sag does [m], both in base, and that no image showed its leg.
    """
    where = placed(robot, posture)
    found: list[tuple[Array, Array, bool]] = []
    if robot.shapes[0]:
        found.append((np.zeros((1, 3, 1)), np.zeros((1, 3)), False))
    for leg in robot.legs:
        errors, bends = _errors(robot, leg, where)
        own = robot.slices[leg]
        for place, body in enumerate(range(1 + own.start, 1 + own.stop)):
            if robot.shapes[body]:
                corners = merged(list(robot.shapes[body])).vertices
                points = frames.apply(where.Ts_base_body[body], corners)
                J = _moved(robot, leg, where, points, place)
                found.append((J * errors, J @ bends, False))
    return found


def _errors(robot: LeggedRobot, leg: int, where: Placed) -> tuple[Array, Array]:
    """One standard deviation of each joint of a leg (k,), and by how much it bends under its load (k,) [rad or m]."""
    own = robot.slices[leg]
    slides = _slides(robot, leg)
    lift = _moved(robot, leg, where, where.soles[leg][None], own.stop - own.start - 1)[0, 2]
    stiffness = robot.stiffness[own]
    bent = lift / stiffness if np.isfinite(stiffness).all() else lift
    effect = float(lift @ bent)
    sag = SAG_SHARE * robot.length
    # straight below its hip a leg of stiff joints can't sag
    bends = bent * (sag / effect) if effect > 1e-12 else np.zeros(len(lift))
    return np.where(slides, SLIDE_SD, ENCODER_SD), bends


def _moved(robot: LeggedRobot, leg: int, where: Placed, points: Array, place: int) -> Array:
    """Derivatives (n, 3, k) of points (n, 3) in base that the leg's joints 0…place move."""
    own = robot.slices[leg]
    Ts = where.Ts_base_body[1 + own.start : 1 + own.stop]
    axes = np.einsum("kij,kj->ki", Ts[:, :3, :3], robot.axes[own])
    return point_jacobians(axes, Ts[:, :3, 3], points, np.full(len(points), place), _slides(robot, leg))


def _slides(robot: LeggedRobot, leg: int) -> np.ndarray:
    sliding = robot.layout.sliding
    return np.array([name in sliding for name in robot.joint_names[robot.slices[leg]]])
