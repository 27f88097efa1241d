"""Which cells around the chassis each leg has a footfall on, by heading, and how deep it reaches there; body level.

The legs share the plane in sectors as seen from the middle of the chassis, so no two ever want the same cell.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.planning.body.move import JOINT_RESERVE, REACH_RESERVE
from footfall.planning.route.cost import reach
from footfall.planning.route.feasible_kernel import LegPlaces
from footfall.robot.description import link_name
from footfall.robot.ik import solve_leg, wheel_pose_for_contact
from footfall.robot.leg_branches import BRANCHES
from footfall.robot.model import Robot
from footfall.robot.reserve import joint_reserves, reach_reserves

LEGS = 6
"""The conservative support of five that is asked for is that of six legs, evenly around the chassis."""
FINE = 0.02
"""Distances and depths at which a leg is tried [m]."""
_EVEN = 1e-6


def leg_places(robot: Robot, resolution: float, headings: int) -> LegPlaces:
    """Places of a robot's legs on cells.

    Args:
        robot: the rover.
        resolution: side of the cells [m].
        headings: how many are looked at, a multiple of four.

    Returns:
        The cells of each leg at each heading.

    Raises:
        InvalidInput: the robot's legs aren't six evenly around the chassis, or the cells are too coarse for them.
    """
    azimuths = _azimuths(robot)
    room, away, deepest = _vertical_reach(robot)
    hip = math.hypot(*robot.description.legs[0].T_base_hip[:2, 3])
    radius = math.floor(reach(robot) / resolution)
    row, col = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    near = row**2 + col**2 <= radius**2
    row, col = row[near], col[near]
    quarter = headings // 4
    found: list[list[tuple[Array, ...]]] = []
    for heading in range(quarter):
        legs = []
        for leg in range(LEGS // 2):
            azimuth = azimuths[leg] + 2.0 * math.pi * heading / headings
            x, y = _turned(col * resolution, row * resolution, -azimuth)
            from_hip = np.hypot(x - hip, y)
            stroke = np.interp(from_hip, away, deepest, -math.inf, -math.inf) - room
            angle = np.arctan2(y, x)
            kept = (np.abs(angle) < math.pi / LEGS - _EVEN) & (x > hip) & (stroke > 0.0)
            if not kept.any():
                raise InvalidInput(f"cells of {resolution:g} m are too coarse for the footfalls of {robot.name}")
            order = np.argsort(angle[kept], kind="stable")
            legs.append(tuple(layer[kept][order] for layer in (row, col, stroke, angle)))
        # the opposite legs, and headings a quarter turn on, are the same cells turned: to the last one
        found.append(legs + [(-r, -c, stroke, angle) for r, c, stroke, angle in legs])
    found += [[(c, -r, stroke, angle) for r, c, stroke, angle in legs] for legs in found]
    return _stacked(found, radius, room)


def _stacked(found: list[list[tuple[Array, ...]]], radius: int, room: float) -> LegPlaces:
    count = np.array([[len(places[0]) for places in legs] for legs in found], np.int32)
    shape = (*count.shape, int(count.max()))
    rows, cols = (np.zeros(shape, np.int32) for _ in range(2))
    strokes = np.zeros(shape)
    for heading, legs in enumerate(found):
        for leg, (r, c, stroke, _) in enumerate(legs):
            at = (heading, leg, slice(len(r)))
            rows[at], cols[at], strokes[at] = r, c, stroke
    clockwise = np.array([[np.sum(angle < 0) for *_, angle in legs] for legs in found], np.int32)
    halves = [[_runs(r[own], c[own]) for r, c, _, angle in legs for own in (angle < 0, angle >= 0)] for legs in found]
    ends = np.cumsum([[len(own) for own in legs] for legs in halves]).reshape(len(found), -1)
    first_run = np.column_stack([np.append(0, ends[:-1, -1]), ends]).astype(np.int32)
    every = np.concatenate([own for legs in halves for own in legs])
    return LegPlaces(radius, room, rows, cols, strokes, count, clockwise, every, first_run)


def _runs(rows: Array, cols: Array) -> NDArray[np.int32]:
    """Runs of neighbours along a row, as LegPlaces has them."""
    if not len(rows):
        return np.empty((0, 4), np.int32)
    order = np.lexsort((cols, rows))
    row, col = rows[order], cols[order]
    ends = np.flatnonzero((np.diff(row) != 0) | (np.diff(col) != 1))
    first, last = np.append(0, ends + 1), np.append(ends, len(row) - 1)
    length = last - first + 1
    level = np.frexp(length)[1] - 1
    return np.column_stack([row[first], level, col[first], col[last] + 1 - (1 << level)]).astype(np.int32)


def _azimuths(robot: Robot) -> Array:
    """Of the legs, counter-clockwise [rad]. Raises InvalidInput where they aren't six evenly around, alike."""
    legs = robot.description.legs
    mounts = np.array([leg.T_base_hip[:3, 3] for leg in legs])
    azimuths = np.sort(np.arctan2(mounts[:, 1], mounts[:, 0]) % (2.0 * math.pi))
    out = np.hypot(mounts[:, 0], mounts[:, 1])
    even = len(legs) == LEGS and np.allclose(np.diff(azimuths), 2.0 * math.pi / LEGS, atol=_EVEN)
    alike = all(np.allclose(leg.reaches, legs[0].reaches, atol=_EVEN) for leg in legs)
    if not (even and alike and np.ptp(out) < _EVEN and np.ptp(mounts[:, 2]) < _EVEN):
        raise InvalidInput(f"feasible traversability needs {LEGS} legs that are alike, evenly around the chassis")
    return azimuths


@lru_cache(maxsize=8)
def _vertical_reach(robot: Robot) -> tuple[float, Array, Array]:
    """Room of the base over the highest ground, and distances from the hip with the deepest footfall below the base.

    At each of these distances a wheel reaches every depth from the room less its clearance, where it passes over the
    highest ground as it is swung, to that one. Reserves are those of moves of the chassis.
    """
    spec = robot.description.legs[0]
    length = robot.leg_length(0)
    away = np.arange(FINE, length, FINE)
    depth = np.arange(0.0, length + abs(float(spec.T_base_hip[2, 3])), FINE)
    out, up = spec.T_base_hip[:3, 0], np.array([0.0, 0.0, 1.0])
    contacts = spec.T_base_hip[:3, 3] * (1.0, 1.0, 0.0) + away[:, None, None] * out - depth[:, None] * up
    azimuth = math.atan2(out[1], out[0])
    poses = wheel_pose_for_contact(robot, contacts, up, azimuth, np.eye(4)).reshape(-1, 4, 4)
    solved = solve_leg(robot, 0, poses)
    postures = np.zeros((len(poses), BRANCHES, 6 * robot.leg_count))
    postures[..., :6] = np.nan_to_num(solved.q)
    spare = np.minimum(
        reach_reserves(robot, postures)[..., 0] - REACH_RESERVE,
        joint_reserves(robot, postures)[..., :6].min(axis=-1) - JOINT_RESERVE,
    )
    reached = (solved.valid & (spare >= 0.0)).any(axis=1).reshape(len(away), len(depth))
    clearances = robot.description.clearances.terrain
    meshes = robot.description.meshes
    hip_bottom = spec.T_base_hip[2, 3] + np.asarray(meshes[link_name(0, "hip_yaw")].vertices)[:, 2].min()
    base_bottom = np.asarray(meshes["base"].vertices)[:, 2].min()
    least = max(
        robot.description.clearances.chassis_terrain - float(base_bottom), clearances["hip_yaw"] - float(hip_bottom)
    )
    standing = reach(robot) - math.hypot(*spec.T_base_hip[:2, 3])
    first, last = _span(reached[int(np.argmin(np.abs(away - standing)))])
    room = max(least, float(depth[first]) + clearances["wheel"])
    deepest = np.full(len(away), -math.inf)
    for i, column in enumerate(reached):
        first, last = _span(column)
        if last >= 0 and depth[first] + clearances["wheel"] <= room:
            deepest[i] = depth[last]
    first, last = _span(np.isfinite(deepest))
    return room, away[first : last + 1], deepest[first : last + 1]


def _span(reached: NDArray[np.bool_]) -> tuple[int, int]:
    """First and last of the longest run; 0, −1 where there is none."""
    edges = np.diff(np.concatenate([[0], reached.astype(np.int8), [0]]))
    begins, ends = np.flatnonzero(edges > 0), np.flatnonzero(edges < 0)
    if not len(begins):
        return 0, -1
    longest = int(np.argmax(ends - begins))
    return int(begins[longest]), int(ends[longest]) - 1


def _turned(x: Array, y: Array, angle: float) -> tuple[Array, Array]:
    c, s = math.cos(angle), math.sin(angle)
    return c * x - s * y, s * x + c * y
