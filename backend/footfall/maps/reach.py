"""Where one leg can put its wheel: inverse kinematics at every cell within the leg's length."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from footfall.core.frames import apply
from footfall.core.grid import GridGeometry
from footfall.core.progress import Progress, no_progress
from footfall.maps.normals import cell_normals
from footfall.robot.ik import BRANCHES, solve_leg, wheel_pose_for_contact
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

Array = NDArray[np.float64]

LEAST_KNOWN = 1.0
"""Share of the ground within a wheel's radius that must be known; the step planner asks for the same."""

_CELLS_AT_ONCE = 8192


@dataclass(frozen=True)
class Reach:
    """Answers for the n known cells within the leg's length of its hip.

    rows, cols: (n,) indices into the grid; contacts, normals: (n, 3) in site.
    solutions: (n,) inverse-kinematics solutions inside the joint limits, 0…8.
    postures: (n, 6) the solution nearest to the leg's present angles [rad], NaN where there is none.
    unknown: (m, 2) row and column of cells in range whose height is known, but not enough of the ground
    within a wheel's radius (LEAST_KNOWN).
    """

    rows: NDArray[np.int64]
    cols: NDArray[np.int64]
    contacts: Array
    normals: Array
    solutions: NDArray[np.int64]
    postures: Array
    unknown: NDArray[np.int64]


def leg_length(robot: Robot, leg: int) -> float:
    """Farthest that a contact can be from the hip-yaw joint [m]: the leg stretched straight."""
    spec = robot.description.legs[robot.require_leg(leg)]
    return float(np.linalg.norm(spec.hip_offset) + spec.thigh + spec.shank + spec.foot + robot.wheel_radius)


def reach(robot: Robot, dem: Dem, state: RobotState, leg: int, progress: Progress = no_progress) -> Reach:
    """Solve the leg for a wheel standing upright on every known cell within the leg's length.

    The contact is the cell's centre at its height, the normal that of the surface in a disc of the wheel's
    radius, which must be known (LEAST_KNOWN). The wheel's heading only turns the last joint, about the normal: a
    branch counts as a solution where it is inside the limits with the wheel heading from the hip to the
    cell or straight back. Collisions are not considered.
    """
    hip = apply(state.T_site_base, robot.description.legs[leg].T_base_hip[:3, 3])
    length = leg_length(robot, leg)
    rows, cols = _box(dem.geometry, hip, length)
    if rows.start >= rows.stop or cols.start >= cols.stop:
        none = np.zeros(0, np.int64)
        empty = np.zeros((0, 3))
        return Reach(none, none, empty, empty, none, np.zeros((0, 6)), np.zeros((0, 2), np.int64))
    x, y = np.meshgrid(dem.geometry.xs[cols], dem.geometry.ys[rows])
    points = np.stack([x, y, dem.heights[rows, cols].astype(np.float64)], axis=-1)
    # a distance to an unknown height is NaN and never in range
    in_range = np.linalg.norm(points - hip, axis=-1) <= length
    upright, share = cell_normals(dem, robot.wheel_radius, rows, cols)
    known = (share >= LEAST_KNOWN) & np.isfinite(upright).all(axis=-1)
    progress(0.2, "normals fitted")
    contacts, normals = points[in_range & known], upright[in_range & known]
    headings = np.arctan2(contacts[:, 1] - hip[1], contacts[:, 0] - hip[0])
    count = np.zeros(len(contacts), np.int64)
    postures = np.full((len(contacts), 6), np.nan)
    for start in range(0, len(contacts), _CELLS_AT_ONCE):
        part = slice(start, start + _CELLS_AT_ONCE)
        count[part], postures[part] = _solve(robot, state, leg, contacts[part], normals[part], headings[part])
        progress(0.2 + 0.8 * min(1.0, part.stop / len(contacts)), "inverse kinematics")
    first = np.array([rows.start, cols.start])
    row, col = (np.argwhere(in_range & known) + first).T
    return Reach(row, col, contacts, normals, count, postures, np.argwhere(in_range & ~known) + first)


def _solve(
    robot: Robot, state: RobotState, leg: int, contacts: Array, normals: Array, headings: Array
) -> tuple[NDArray[np.int64], Array]:
    """Number of solutions (n,) and the one nearest to the leg's present angles (n, 6), NaN for none."""
    valid = np.zeros((len(contacts), BRANCHES), bool)
    least = np.full(len(contacts), np.inf)
    postures = np.full((len(contacts), 6), np.nan)
    for turn in (0.0, np.pi):
        Ts_base_wheel = wheel_pose_for_contact(robot, contacts, normals, headings + turn, state.T_site_base)
        found = solve_leg(robot, leg, Ts_base_wheel)
        valid |= found.valid
        away = np.square(found.q - state.leg(leg)).sum(axis=2)
        away[~found.valid] = np.inf
        branch = np.argmin(away, axis=1)
        distance = np.take_along_axis(away, branch[:, None], axis=1)[:, 0]
        nearer = distance < least
        postures[nearer] = found.q[nearer, branch[nearer]]
        least = np.minimum(least, distance)
    return valid.sum(axis=1), postures


def _box(grid: GridGeometry, hip: Array, length: float) -> tuple[slice, slice]:
    """Rows and columns of the grid that a square of ``length`` about the hip covers; may be empty."""
    first_row, first_col = grid.cell(hip[0] - length, hip[1] - length)
    last_row, last_col = grid.cell(hip[0] + length, hip[1] + length)
    rows = slice(max(int(first_row), 0), min(int(last_row) + 1, grid.rows))
    cols = slice(max(int(first_col), 0), min(int(last_col) + 1, grid.cols))
    return rows, cols
