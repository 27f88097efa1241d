"""The compiled check of the whole rover in one configuration, for searches that ask it very often.

What is called clear keeps every distance that :class:`~footfall.planning.scene.whole_body.WholeBody` measures. The
proof is that of proof/clearance.py, with nothing frozen: links are inside convex shells that a direction separates,
surfaces are covered by balls that the tables of the ground let pass, or the wheel is a drum above it. Chassis and
payload are bodies like the links. What is not proven is told as too near, and may be free.

Most parts are far above the ground. A part whose middle is at z, with h its shell's half height, lies above z − h; its
points are within its reach r of the middle. Let no ground within r + δ of the middle, seen from above, be higher than
z − h − δ. Then all ground nearer than r + δ is at least δ below the part, the rest is at least δ beside it, and none
is above it. That is asked first, of a table small enough to stay in the processor's cache.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array, Ints, Mask
from footfall.robot.leg_frames import PART_COUNT
from footfall.robot.proof.drum_kernel import RADIUS as DRUM_RADIUS
from footfall.robot.proof.drum_kernel import REQUIRED, drum_above
from footfall.robot.proof.ground_tables import needed_height
from footfall.robot.proof.leg_clearance_kernel import RAISED_GROUND, TRUE_GROUND, coordinate, place_leg, within
from footfall.robot.proof.separation import SCRATCH, apart_by
from footfall.robot.proof.shells import CENTER, EXTENT, REACH

Feet = Mask | Ints

CLEAR = -1
"""The code where nothing is too near; any other names two bodies, first · BODIES + second."""

WHEEL = PART_COUNT - 1

BODIES = 256
CHASSIS, PAYLOAD, TERRAIN, BEYOND = 252, 253, 254, 255
"""Numbers of bodies that are no links; a link is 7 · leg + part. BEYOND: where the ground was not cut out."""

LIFTED, STANDING, TOUCHING = 0, 1, 2
"""How a foot is, in an array of whole numbers in place of one that only says which feet stand. TOUCHING: on its way up
or down, so that the wheel may touch the ground and sink in by ``wheel_sink``; the ground is not raised for that leg."""

X, Y, Z, RADIUS = range(4)
"""Columns of a ball around a body in site [m]."""


class RoverTables(NamedTuple):
    """A robot over some ground; positions in site [m].

    Bodies of ``shells`` (see shells.py), ``balls`` and ``sizes``: the seven parts of a leg, the chassis, the payload if
    there is one. hips: (legs, 3, 4) T_base_hip; lengths: (legs, 5), see leg_frames.py.
    masses: (legs × 6 + 1, 4), of each joint's link, leg by leg, and of all that is fixed to the base: share of the
    rover's mass, centre in the link's frame. own: (p, 3) two parts of a leg, and how far they must be apart. fixed:
    (1 or 2, 7) how far each part must be from chassis and payload, negative where unchecked. between: (1,) how far
    links of two legs must be apart.
    balls: (b, 5) middle in the body's frame, number of its table of the ground, next ball when clear. trees: (bodies
    + 1, 2) first ball and the one after the last, in the last row of the touching wheel; drums: (2, 7) the wheel by
    ground mode, see drum_kernel.py. sizes: (bodies,) how far the middles of a body's balls get from its
    shell's. ground, ground_layout: see ground_tables.py; region: (3,) x, y and radius of the circle that was cut out.
    deltas: (7,) how far each part must be from the ground. highest: (rows, cols) of squares, what no ground is above
    that is nearer to the square, seen from above, than a part with its δ reaches from its middle; highest_at: (3,) x,
    y of its south-west corner, squares in a metre.
    """

    hips: Array
    lengths: Array
    masses: Array
    shells: Array
    points: Array
    own: Array
    fixed: Array
    between: Array
    balls: Array
    trees: NDArray[np.int64]
    drums: Array
    sizes: Array
    deltas: Array
    highest: Array
    highest_at: Array
    ground: Array
    ground_layout: Array
    region: Array


@njit()
def place_rover(q: Array, T_site_base: Array, tables: RoverTables, poses: Array) -> None:
    """Write T_site_link, (legs × 7, 3, 4), of the legs' parts at q (legs × 6,) [rad]; T_site_base: (3, 4)."""
    T = np.empty((3, 4))
    for leg in range(tables.hips.shape[0]):
        for row in range(3):
            for k in range(4):
                T[row, k] = T_site_base[row, 3] if k == 3 else 0.0
                for m in range(3):
                    T[row, k] += T_site_base[row, m] * tables.hips[leg, m, k]
        first = PART_COUNT * leg
        place_leg(q[6 * leg : 6 * leg + 6], T, tables.lengths[leg], poses[first : first + PART_COUNT])


@njit()
def center_of_mass(poses: Array, T_site_base: Array, tables: RoverTables) -> tuple[float, float, float]:
    """Of rover and payload, in site [m]; poses: of :func:`place_rover`."""
    x = y = z = 0.0
    masses = tables.masses
    last = masses.shape[0] - 1
    for i in range(last):
        # six of a leg's seven parts carry mass, the wheel's is its last joint's
        link = i + i // 6
        share = masses[i, 0]
        x += share * coordinate(poses, link, masses, i, 1, 0)
        y += share * coordinate(poses, link, masses, i, 1, 1)
        z += share * coordinate(poses, link, masses, i, 1, 2)
    base = T_site_base.reshape(1, 3, 4)
    share = masses[last, 0]
    x += share * coordinate(base, 0, masses, last, 1, 0)
    y += share * coordinate(base, 0, masses, last, 1, 1)
    z += share * coordinate(base, 0, masses, last, 1, 2)
    return x, y, z


@njit()
def first_too_near(
    poses: Array, T_site_base: Array, standing: Feet, raised: float, tables: RoverTables
) -> tuple[int, float]:
    """The first two bodies found that are not proven to be as far apart as they must: their code, and the spare room.

    poses: of :func:`place_rover`; standing: (legs,), or how each foot is, see LIFTED. The ground is raised by
    ``raised`` [m] for legs that are lifted; of those that stand, wheel and ankle roll are not asked about the ground,
    as they don't move. The spare room is by how much what is proven falls short [m], below zero; infinite where the
    code is CLEAR.
    """
    links, legs = poses.shape[0], standing.size
    base = T_site_base.reshape(1, 3, 4)
    around = np.empty((links, 4))
    fixed = np.empty((tables.fixed.shape[0], 4))
    for link in range(links):
        part = link % PART_COUNT
        _put_around(poses, link, tables.shells, part, around)
        if not _inside(around, link, tables.sizes[part], tables.region):
            return link * BODIES + BEYOND, -np.inf
    for k in range(fixed.shape[0]):
        _put_around(base, 0, tables.shells, PART_COUNT + k, fixed[k : k + 1])
        if not _inside(fixed, k, tables.sizes[PART_COUNT + k], tables.region):
            return (CHASSIS + k) * BODIES + BEYOND, -np.inf
    code, spare = _near_ground(poses, around, base, standing, raised, tables)
    if code != CLEAR:
        return code, spare
    scratch = np.empty((SCRATCH, 3))
    for leg in range(legs):
        code, spare = _near_itself(poses, around, base, fixed, leg, tables, scratch)
        if code != CLEAR:
            return code, spare
    return _near_each_other(poses, around, tables, scratch)


@njit()
def wheel_cuts(T_site_wheel: Array, tables: RoverTables) -> float:
    """How deep a wheel on the ground cuts deeper than it may, as far as is proven [m], below zero; else infinite.

    T_site_wheel: (3, 4).
    """
    pose, touching = T_site_wheel.reshape(1, 3, 4), tables.trees.shape[0] - 1
    cells, layout = tables.ground, tables.ground_layout
    room = _room_above_ground(pose, 0, touching, 0.0, tables.balls, tables.trees, cells, layout)
    if room < 0.0 and tables.drums[TRUE_GROUND, DRUM_RADIUS] > 0.0:
        least = tables.drums[TRUE_GROUND, REQUIRED]
        if drum_above(pose, 0, tables.drums, TRUE_GROUND, least, least, 0.0, cells, layout) >= least:
            return np.inf
    return room


@njit()
def leg_too_near_itself(q: Array, leg: int, T_site_base: Array, tables: RoverTables, poses: Array) -> float:
    """What parts of one leg at q (6,), or it and the chassis or payload, lack for sure [m], below zero; else infinite.

    poses: (legs × 7, 3, 4), of which the leg's are written.
    """
    T = np.empty((3, 4))
    for row in range(3):
        for k in range(4):
            T[row, k] = T_site_base[row, 3] if k == 3 else 0.0
            for m in range(3):
                T[row, k] += T_site_base[row, m] * tables.hips[leg, m, k]
    first = PART_COUNT * leg
    place_leg(q, T, tables.lengths[leg], poses[first : first + PART_COUNT])
    base, around = T_site_base.reshape(1, 3, 4), np.empty((len(poses), 4))
    fixed = np.empty((tables.fixed.shape[0], 4))
    for part in range(PART_COUNT):
        _put_around(poses, first + part, tables.shells, part, around)
    for k in range(len(fixed)):
        _put_around(base, 0, tables.shells, PART_COUNT + k, fixed[k : k + 1])
    return _near_itself(poses, around, base, fixed, leg, tables, np.empty((SCRATCH, 3)))[1]


@njit()
def rovers_are_clear(
    qs: Array, Ts_site_base: Array, standing: Feet, raised: float, tables: RoverTables
) -> NDArray[np.int64]:
    """The codes (n,) of configurations: qs (n, legs × 6) [rad], Ts_site_base (n, 4, 4), standing (n, legs)."""
    codes = np.empty(qs.shape[0], np.int64)
    poses, T = np.empty((PART_COUNT * tables.hips.shape[0], 3, 4)), np.empty((3, 4))
    for i in range(qs.shape[0]):
        T[:] = Ts_site_base[i, :3]
        place_rover(qs[i], T, tables, poses)
        codes[i] = first_too_near(poses, T, standing[i], raised, tables)[0]
    return codes


@njit(inline="always")
def _put_around(poses: Array, at: int, shells: Array, shell: int, around: Array) -> None:
    """Write the ball around a body into the row of its pose."""
    for axis in range(3):
        around[at, axis] = coordinate(poses, at, shells, shell, CENTER, axis)
    around[at, RADIUS] = shells[shell, REACH]


@njit(inline="always")
def _inside(around: Array, at: int, size: float, region: Array) -> bool:
    """Whether all that is asked about the body is in the circle whose ground is known; NaN is not."""
    x, y, room = around[at, X] - region[0], around[at, Y] - region[1], region[2] - size
    return room >= 0.0 and x * x + y * y <= room * room and math.isfinite(x + y + around[at, Z])


@njit()
def _near_ground(
    poses: Array, around: Array, base: Array, standing: Feet, raised: float, tables: RoverTables
) -> tuple[int, float]:
    """The first body found that is not clear of the ground: see :func:`first_too_near`."""
    balls, trees, cells, layout = tables.balls, tables.trees, tables.ground, tables.ground_layout
    shells, highest, place, deltas = tables.shells, tables.highest, tables.highest_at, tables.deltas
    drums, touching = tables.drums, trees.shape[0] - 1
    for leg in range(standing.size):
        lift = raised if standing[leg] == LIFTED else 0.0
        for part in range(PART_COUNT - 3 if standing[leg] == STANDING else WHEEL, -1, -1):
            link = PART_COUNT * leg + part
            top = _highest_near(around[link, X], around[link, Y], highest, place) + lift
            if around[link, Z] - _half_height(poses, link, shells, part) - top >= deltas[part]:
                continue
            body, mode = part, RAISED_GROUND
            if part == WHEEL and standing[leg] == TOUCHING:
                body, mode = touching, TRUE_GROUND
            room = _room_above_ground(poses, link, body, lift, balls, trees, cells, layout)
            if room < 0.0 and part == WHEEL and drums[mode, DRUM_RADIUS] > 0.0:
                least = drums[mode, REQUIRED]
                if drum_above(poses, link, drums, mode, least, least, lift, cells, layout) >= least:
                    continue
            if room < 0.0:
                return link * BODIES + TERRAIN, room
    for body in range(PART_COUNT, touching):
        room = _room_above_ground(base, 0, body, 0.0, balls, trees, cells, layout)
        if room < 0.0:
            return (CHASSIS + body - PART_COUNT) * BODIES + TERRAIN, room
    return CLEAR, np.inf


@njit(inline="always")
def _half_height(poses: Array, at: int, shells: Array, shell: int) -> float:
    """Of the box around a shell [m]."""
    return (
        abs(poses[at, 2, 0]) * shells[shell, EXTENT]
        + abs(poses[at, 2, 1]) * shells[shell, EXTENT + 1]
        + abs(poses[at, 2, 2]) * shells[shell, EXTENT + 2]
    )


@njit(inline="always")
def _highest_near(x: float, y: float, highest: Array, place: Array) -> float:
    """What no ground near (x, y) is above [m]; infinite where that was not worked out."""
    column, row = (x - place[0]) * place[2], (y - place[1]) * place[2]
    if column >= 0.0 and row >= 0.0 and column < highest.shape[1] and row < highest.shape[0]:
        return highest[int(row), int(column)]
    return np.inf


@njit(inline="always")
def _room_above_ground(
    poses: Array, at: int, body: int, lift: float, balls: Array, trees: NDArray[np.int64], cells: Array, layout: Array
) -> float:
    """By how much the first small ball that is not clear of the ground is too low [m], below zero; else infinite."""
    ball, end, lacks = trees[body, 0], trees[body, 1], np.inf
    while ball < end:
        x = coordinate(poses, at, balls, ball, 0, 0)
        y = coordinate(poses, at, balls, ball, 0, 1)
        z = coordinate(poses, at, balls, ball, 0, 2)
        following = int(balls[ball, 4])
        room = z - lift - needed_height(cells, layout, int(balls[ball, 3]), x, y)
        if room >= 0.0:
            ball = following
        elif following == ball + 1:
            lacks = room
            break
        else:
            ball += 1
    return lacks


@njit()
def _near_itself(
    poses: Array, around: Array, base: Array, fixed: Array, leg: int, tables: RoverTables, scratch: Array
) -> tuple[int, float]:
    """The first breach between parts of one leg, or of one with chassis or payload: see :func:`first_too_near`."""
    shells, points, first = tables.shells, tables.points, PART_COUNT * leg
    for k in range(fixed.shape[0]):
        for part in range(PART_COUNT):
            least = tables.fixed[k, part]
            if least >= 0.0 and _near(around, first + part, fixed, k, least):
                shell = PART_COUNT + k
                spare = (
                    apart_by(shells, points, part, poses, first + part, shell, base, 0, least, least, scratch) - least
                )
                if spare < 0.0:
                    return (first + part) * BODIES + CHASSIS + k, spare
    for k in range(tables.own.shape[0]):
        a, b, least = int(tables.own[k, 0]), int(tables.own[k, 1]), tables.own[k, 2]
        if _near(around, first + a, around, first + b, least):
            spare = apart_by(shells, points, a, poses, first + a, b, poses, first + b, least, least, scratch) - least
            if spare < 0.0:
                return (first + a) * BODIES + first + b, spare
    return CLEAR, np.inf


@njit()
def _near_each_other(poses: Array, around: Array, tables: RoverTables, scratch: Array) -> tuple[int, float]:
    """The first breach between two legs: see :func:`first_too_near`."""
    shells, points, least, legs = tables.shells, tables.points, tables.between[0], tables.hips.shape[0]
    balls = np.empty((legs, 4))
    for leg in range(legs):
        _put_around_leg(around, leg, balls)
    for one in range(legs):
        for other in range(one + 1, legs):
            if not _near(balls, one, balls, other, least):
                continue
            for a in range(PART_COUNT - 1, -1, -1):
                i = PART_COUNT * one + a
                if not _near(around, i, balls, other, least):
                    continue
                for b in range(PART_COUNT - 1, -1, -1):
                    j = PART_COUNT * other + b
                    if _near(around, i, around, j, least):
                        spare = apart_by(shells, points, a, poses, i, b, poses, j, least, least, scratch) - least
                        if spare < 0.0:
                            return i * BODIES + j, spare
    return CLEAR, np.inf


@njit()
def _put_around_leg(around: Array, leg: int, balls: Array) -> None:
    """Write a ball around all parts of a leg."""
    first = PART_COUNT * leg
    for axis in range(3):
        low = high = around[first, axis]
        for link in range(first + 1, first + PART_COUNT):
            low, high = min(low, around[link, axis]), max(high, around[link, axis])
        balls[leg, axis] = 0.5 * (low + high)
    farthest = 0.0
    for link in range(first, first + PART_COUNT):
        x, y, z = (
            around[link, X] - balls[leg, X],
            around[link, Y] - balls[leg, Y],
            around[link, Z] - balls[leg, Z],
        )
        farthest = max(farthest, math.sqrt(x * x + y * y + z * z) + around[link, RADIUS])
    balls[leg, RADIUS] = farthest


@njit(inline="always")
def _near(a: Array, i: int, b: Array, j: int, least: float) -> bool:
    """Whether two balls are nearer than ``least``."""
    return within(a[i, X], a[i, Y], a[i, Z], b, j, 0, a[i, RADIUS] + least)
