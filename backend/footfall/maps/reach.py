"""Where one leg can put its wheel, and why not elsewhere: every closed-form solution at every cell in range.

The wheel stands upright on the ground's normal; its heading is free, for it only turns the last joint about that
normal. What the planner will be asked is asked here in the same way: the contact is the cell's centre, the normal is
fitted in a disc of the wheel's radius that must be known, the leg must be free of collision on the contact and
with the wheel raised straight above it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.bounds import require_above_zero
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, inverse
from footfall.core.grid import GridGeometry
from footfall.core.progress import Progress, no_progress, part
from footfall.maps.layers import LIFT
from footfall.maps.leg_collisions import LegCollisions
from footfall.maps.leg_postures import LegFrame, Postures, choose_postures
from footfall.maps.normals import cell_normals
from footfall.maps.reach_classes import JOINT_LIMIT, NO_GEOMETRY, OUT_OF_RANGE, UNKNOWN, explained
from footfall.maps.wheel_seat import wheel_seat
from footfall.robot import ik_kernel
from footfall.robot.ik import leg_azimuth
from footfall.robot.leg_branches import BRANCHES
from footfall.robot.leg_frames import leg_lengths, wheel_axles
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

LEAST_KNOWN = 1.0
"""Share of the ground within a wheel's radius that must be known; the step planner asks for the same."""

_CELLS_AT_ONCE = 32768


@dataclass(frozen=True)
class Reach:
    """Answers for the n known cells within the leg's length of its hip, row by row.

    rows, cols: (n,) indices into the grid; contacts, normals: (n, 3) in site.
    reason: (n,) class, see :mod:`footfall.maps.reach_classes`. blame: (n,) the joint 0…5 of JOINT_LIMIT, what is hit in
    a collision (robot.proof.obstacles); link: (n,) index into PARTS of what hits.
    solutions: (n,) inverse-kinematics solutions inside the joint limits with some heading, 0…8.
    postures: (n, 6) [rad] the free one, if one is known, else the one that gets farthest; NaN where there is none.
    above: (n, 6) [rad] the same wheel raised by ``lift`` [m], NaN where the limits forbid it.
    limit_margin: (n,) distance to the joint limits [rad] of the solution that has most, the last joint at its middle;
    where none is inside, minus how far the nearest is outside; NaN where there is none.
    manipulability: (n,) of that solution, √det(J Jᵀ) [m³]; NaN where none is inside.
    seat [m], support (0…1): (n,) of the wheel in that heading (maps.wheel_seat), NaN without a posture.
    unknown: (m, 2) row and column of cells in range whose height is known, but not enough of the ground
    within a wheel's radius (LEAST_KNOWN).
    checks: exact collision checks that were made.
    """

    rows: NDArray[np.int64]
    cols: NDArray[np.int64]
    contacts: Array
    normals: Array
    reason: NDArray[np.uint8]
    blame: NDArray[np.uint8]
    link: NDArray[np.uint8]
    solutions: NDArray[np.int64]
    postures: Array
    above: Array
    limit_margin: Array
    manipulability: Array
    seat: Array
    support: Array
    unknown: NDArray[np.int64]
    checks: int
    lift: float
    sink: float

    def text(self, index: int) -> str:
        """The answer for one of the n cells, for a person."""
        return explained(
            int(self.reason[index]),
            int(self.blame[index]),
            int(self.link[index]),
            float(self.seat[index]),
            self.sink,
            self.lift,
        )

    def classes(self, dem: Dem) -> NDArray[np.uint8]:
        """The class of every cell of the map, (rows, cols); cells of a coarser lattice stand for themselves only."""
        out = np.where(np.isfinite(dem.heights), OUT_OF_RANGE, UNKNOWN).astype(np.uint8)
        out[self.rows, self.cols] = self.reason
        out[tuple(self.unknown.T)] = UNKNOWN
        return out


def reach(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    leg: int,
    progress: Progress = no_progress,
    collisions: LegCollisions | None = None,
    lift: float = LIFT,
    stride: int = 1,
) -> Reach:
    """Solve the leg for a wheel standing upright on every known cell within the leg's length.

    Args:
        robot: the rover.
        dem: the ground, in site.
        state: how the rover stands.
        leg: number of the leg, from 0.
        progress: called with a fraction 0…1 and a text; what it raises ends the work.
        collisions: checks for this robot, state and leg; without them no cell is FREE: those with a solution are
            UNSURE.
        lift: how far above the footfall the leg must be free too [m].
        stride: only cells whose row and column are multiples of it are looked at.

    Returns:
        Class, solution and margins of each cell.

    Raises:
        InvalidInput: the stride is below 1.
    """
    leg = robot.require_leg(leg)
    if stride < 1:
        raise InvalidInput("stride must be 1 or more", stride=stride)
    require_above_zero("m", lift=lift)
    rows, cols, contacts, normals, unknown = _ground(robot, dem, state, leg, stride)
    progress(0.2, "normals fitted")
    found = _solved(robot, state, leg, contacts, normals)
    progress(0.3, "inverse kinematics")
    stands = _stands(robot, state, leg, found, normals, lift, collisions, part(progress, 0.3, 0.95))
    spec = robot.description.legs[leg]
    T_site_hip = np.asarray(state.T_site_base) @ spec.T_base_hip
    axles = wheel_axles(leg_lengths(spec), stands.q) @ T_site_hip[:3, :3].T
    seat, support = wheel_seat(robot, dem, contacts, normals, axles)
    progress(1.0, "reach")
    return Reach(
        rows=rows,
        cols=cols,
        contacts=contacts,
        normals=normals,
        reason=stands.reason,
        blame=stands.blame,
        link=stands.link,
        solutions=np.bincount(found.cell, minlength=len(contacts)),
        postures=stands.q,
        above=stands.above,
        limit_margin=np.where(found.excess > 0, -found.excess, found.margin),
        manipulability=found.dexterity,
        seat=seat,
        support=support,
        unknown=unknown,
        checks=stands.checks,
        lift=lift,
        sink=robot.description.clearances.wheel_sink,
    )


@dataclass(frozen=True)
class _Solved:
    """For n cells margin (NaN: none), joint, excess and dexterity, (n,) each, as ``ik_kernel.solve_upright`` has them.

    cell, branch: (m,) and q: (m, 6) the solutions inside the limits, by cell, each cell's by falling margin.
    """

    margin: Array
    joint: NDArray[np.uint8]
    excess: Array
    dexterity: Array
    cell: NDArray[np.int64]
    branch: NDArray[np.int64]
    q: Array


def _solved(robot: Robot, state: RobotState, leg: int, contacts: Array, normals: Array) -> _Solved:
    n = len(contacts)
    spec, own = robot.description.legs[leg], slice(6 * leg, 6 * leg + 6)
    T_hip_site = inverse(np.asarray(state.T_site_base) @ spec.T_base_hip)
    lengths, present = leg_lengths(spec), np.array(state.leg(leg))
    largest, joint, excess, dexterity = np.empty(n), np.empty(n, np.uint8), np.empty(n), np.empty(n)
    cells, branches, qs = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)], [np.zeros((0, 6))]
    for start in range(0, n, _CELLS_AT_ONCE):
        some = slice(start, min(start + _CELLS_AT_ONCE, n))
        q, margin = np.empty((some.stop - start, BRANCHES, 6)), np.empty((some.stop - start, BRANCHES))
        ik_kernel.solve_upright(
            lengths,
            robot.wheel_radius,
            T_hip_site,
            contacts[some],
            normals[some],
            robot.lower[own],
            robot.upper[own],
            present,
            ik_kernel.UprightLegs(q, margin, joint[some], excess[some], dexterity[some]),
        )
        order = np.argsort(-margin, axis=1, kind="stable")
        cell, rank = np.nonzero(np.isfinite(np.take_along_axis(margin, order, axis=1)))
        branch = order[cell, rank]
        best = margin.max(axis=1)
        largest[some] = np.where(np.isfinite(best), best, np.nan)
        cells.append(cell + start)
        branches.append(branch)
        qs.append(q[cell, branch])
    return _Solved(
        largest, joint, excess, dexterity, np.concatenate(cells), np.concatenate(branches), np.concatenate(qs)
    )


def _stands(
    robot: Robot,
    state: RobotState,
    leg: int,
    found: _Solved,
    normals: Array,
    lift: float,
    collisions: LegCollisions | None,
    progress: Progress,
) -> Postures:
    """For every cell the posture that the leg takes there, NaN where it can take none, and why."""
    n = len(normals)
    reason = np.where(np.isnan(found.excess), NO_GEOMETRY, JOINT_LIMIT).astype(np.uint8)
    blame, link = np.where(reason == JOINT_LIMIT, found.joint, 0).astype(np.uint8), np.zeros(n, np.uint8)
    posture, raised = np.full((n, 6), np.nan), np.full((n, 6), np.nan)
    spec, own = robot.description.legs[leg], slice(6 * leg, 6 * leg + 6)
    R_hip_site = inverse(np.asarray(state.T_site_base) @ spec.T_base_hip)[:3, :3]
    azimuth = leg_azimuth(robot, leg, state.T_site_base)
    frame = LegFrame(
        leg_lengths(spec), robot.lower[own], robot.upper[own], R_hip_site, azimuth, R_hip_site[:3, 2] * lift
    )
    there, number = np.unique(found.cell, return_inverse=True)
    chosen = choose_postures(frame, number, found.branch, found.q, normals[found.cell], collisions, progress)
    reason[there], blame[there], link[there] = chosen.reason, chosen.blame, chosen.link
    posture[there], raised[there] = chosen.q, chosen.above
    return Postures(reason, blame, link, posture, raised, chosen.checks)


def _ground(
    robot: Robot, dem: Dem, state: RobotState, leg: int, stride: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], Array, Array, NDArray[np.int64]]:
    """rows, cols, contacts and normals of the known cells in range that are asked for, and the unknown ones (m, 2)."""
    hip = apply(state.T_site_base, robot.description.legs[leg].T_base_hip[:3, 3])
    length = robot.leg_length(leg)
    rows, cols = _box(dem.geometry, hip, length)
    if rows.start >= rows.stop or cols.start >= cols.stop:
        none = np.zeros(0, np.int64)
        return none, none, np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 2), np.int64)
    x, y = np.meshgrid(dem.geometry.xs[cols], dem.geometry.ys[rows])
    points = np.stack([x, y, dem.heights[rows, cols].astype(np.float64)], axis=-1)
    row, col = np.arange(rows.start, rows.stop)[:, None], np.arange(cols.start, cols.stop)
    asked = (row % stride == 0) & (col % stride == 0)
    # a distance to an unknown height is NaN and never in range
    asked &= np.linalg.norm(points - hip, axis=-1) <= length
    upright, share = cell_normals(dem, robot.wheel_radius, rows, cols)
    known = (share >= LEAST_KNOWN) & np.isfinite(upright).all(axis=-1)
    first = np.array([rows.start, cols.start])
    at_row, at_col = (np.argwhere(asked & known) + first).T
    return at_row, at_col, points[asked & known], upright[asked & known], np.argwhere(asked & ~known) + first


def _box(grid: GridGeometry, hip: Array, length: float) -> tuple[slice, slice]:
    """Rows and columns of the grid that a square of ``length`` about the hip covers; may be empty."""
    first_row, first_col = grid.cell(hip[0] - length, hip[1] - length)
    last_row, last_col = grid.cell(hip[0] + length, hip[1] + length)
    rows = slice(max(int(first_row), 0), min(int(last_row) + 1, grid.rows))
    cols = slice(max(int(first_col), 0), min(int(last_col) + 1, grid.cols))
    return rows, cols
