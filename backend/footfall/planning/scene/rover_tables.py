"""The tables of the compiled check of the whole rover, made once for a robot and the ground around it."""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.payload import carried, loaded
from footfall.core.arrays import Array
from footfall.core.bounds import require_distances
from footfall.core.grid import GridGeometry
from footfall.planning.scene.rover_kernel import BEYOND, BODIES, CHASSIS, CLEAR, PAYLOAD, TERRAIN, RoverTables
from footfall.robot.description import PARTS
from footfall.robot.leg_frames import PART_COUNT, leg_lengths
from footfall.robot.meshes import bvh
from footfall.robot.model import Robot
from footfall.robot.proof.clearance import SLACK, leg_covers, link_shells, radius_classes, wheel_drums
from footfall.robot.proof.cover import BallTree, ball_tree
from footfall.robot.proof.ground_tables import ground_tables
from footfall.robot.proof.shells import CENTER, REACH

_AS_DESCRIBED = BalanceSettings()

_EDGES = (0.7, 0.25, (0.1, 0.1, 0.25))
"""Longest edges of the cells that chassis and payload are covered in, level by level [m]. A ball around a column that
reaches through a plate stands out of its faces by less than one around a cube."""

_SAME_TABLE = 0.05
"""Balls share a table of the ground where their radii differ by no more than this share."""

_MOST_CELLS = 100_000_000
"""Of all tables of the ground (800 MB, of which the machine gives what was asked about)."""

_SQUARE = 0.4
"""Side of the squares of which it is known how high the ground near them is [m]."""

_WORDS = ("hip", "thigh", "knee", "shank", "ankle", "foot", "wheel")
_OTHERS = {CHASSIS: "chassis", PAYLOAD: "payload", TERRAIN: "the terrain", BEYOND: "ground that was not cut out"}


def rover_tables(
    robot: Robot,
    heights: ArrayLike,
    geometry: GridGeometry,
    clearance: float = 0.0,
    around: ArrayLike | None = None,
    within: float = np.inf,
    balance: BalanceSettings = _AS_DESCRIBED,
) -> RoverTables:
    """What the functions of rover_kernel.py take.

    Args:
        robot: the rover.
        heights: (rows, cols) [m], NaN where unknown, which is no obstacle.
        geometry: the grid.
        clearance: added to every δ [m].
        around: middle (x, y) of a circle outside of which nothing is called clear [m]; None: there is none.
        within: radius of that circle [m].
        balance: whose payload counts in the centre of mass; its box stays that of the description.

    Returns:
        The tables.

    Raises:
        InvalidInput: heights and geometry don't fit together, or the ground is too large for tables.
    """
    require_distances(clearance=clearance)
    description = robot.description
    deltas, shells, points = description.clearances, *link_shells(description)
    covers, fixed = _covers(robot), [[deltas.chassis.get(part) for part in PARTS]]
    if description.payload is not None:
        fixed.append([deltas.payload] * PART_COUNT)
    on_ground = [*(deltas.terrain[part] for part in PARTS), *[deltas.chassis_terrain] * len(fixed)]
    required = np.array([*(delta + clearance for delta in on_ground), 0.0]) + SLACK
    radii = [cover.radii + least for cover, least in zip(covers, required, strict=True)]
    ground = ground_tables(
        heights, geometry, radius_classes(np.concatenate(radii), _SAME_TABLE), around, within, _MOST_CELLS
    )
    reach = float((shells[:PART_COUNT, REACH] + required[:PART_COUNT]).max())
    highest, highest_at = _highest(np.asarray(heights), geometry, reach, ground.region)
    ends = np.cumsum([len(one) for one in radii])
    starts = ends - [len(one) for one in radii]
    return RoverTables(
        hips=np.array([leg.T_base_hip[:3] for leg in description.legs]),
        lengths=np.array([leg_lengths(leg) for leg in description.legs]),
        masses=_masses(robot, balance),
        shells=shells,
        points=points,
        own=np.array(
            [(PARTS.index(p.part_a), PARTS.index(p.part_b), p.distance + clearance + SLACK) for p in deltas.own_leg]
        ).reshape(-1, 3),
        fixed=np.array([[-1.0 if delta is None else delta + clearance + SLACK for delta in row] for row in fixed]),
        between=np.array([deltas.other_leg + clearance + SLACK]),
        balls=np.concatenate(
            [
                np.column_stack([cover.centers, np.searchsorted(ground.radii, radii_of), cover.skip + start])
                for cover, radii_of, start in zip(covers, radii, starts, strict=True)
            ]
        ).astype(float),
        trees=np.column_stack([starts, ends]).astype(np.int64),
        drums=wheel_drums(description, ground, clearance),
        sizes=np.array(
            [
                np.linalg.norm(cover.centers - shell[CENTER : CENTER + 3], axis=1).max()
                for cover, shell in zip(covers, shells, strict=False)
            ]
        ),
        deltas=required[:PART_COUNT],
        highest=highest,
        highest_at=highest_at,
        ground=ground.cells,
        ground_layout=ground.layout,
        region=ground.region,
    )


def _highest(heights: NDArray, geometry: GridGeometry, reach: float, region: Array) -> tuple[Array, Array]:
    """``highest`` and ``highest_at`` of RoverTables, for parts that reach so far with their δ [m]."""
    first = np.array(geometry.bounds[:2])
    corner = np.maximum(first, region[:2] - region[2])
    opposite = np.minimum(geometry.bounds[2:], region[:2] + region[2])
    windows = []
    for axis in (1, 0):
        squares = np.arange(corner[axis], max(opposite[axis], corner[axis] + _SQUARE), _SQUARE) - first[axis]
        # a block of ground that comes so near has corners that are farther by its own size
        begin = np.floor((squares - reach) / geometry.resolution) - 1
        end = np.ceil((squares + _SQUARE + reach) / geometry.resolution) + 2
        windows.append(np.maximum(np.column_stack([begin, end]), 0).astype(int))
    rows, cols = windows
    west = cols[0, 0]
    near = heights[:, west : cols[-1, 1]]
    tops = np.array([np.fmax.reduce(near[one:other], axis=0, initial=-np.inf) for one, other in rows])
    tops = np.array(
        [np.fmax.reduce(tops[:, one - west : other - west], axis=1, initial=-np.inf) for one, other in cols]
    )
    return np.ascontiguousarray(tops.T, float), np.array([*corner, 1 / _SQUARE])


def named(code: int) -> str:
    """The two bodies of a code in words: "leg 2 shank and leg 3 thigh"."""
    if code == CLEAR:
        return "nothing is too near"
    return " and ".join(body_named(body) for body in divmod(code, BODIES))


def body_named(body: int) -> str:
    """A body's number in words."""
    return _OTHERS[body] if body in _OTHERS else f"leg {body // PART_COUNT} {_WORDS[body % PART_COUNT]}"


@lru_cache(maxsize=8)
def _covers(robot: Robot) -> list[BallTree]:
    """Covers of the leg's parts in order, of the chassis, the payload if there is one, and the touching wheel."""
    meshes, legs = bvh.robot_meshes(robot.description), leg_covers(robot.description)
    solids = [meshes[name] for name in ("base", bvh.PAYLOAD) if name in meshes]
    return [*(legs[part] for part in PARTS), *(ball_tree(mesh, _EDGES) for mesh in solids), legs[bvh.TOUCHING_WHEEL]]


def _masses(robot: Robot, balance: BalanceSettings) -> Array:
    """Rows of ``RoverTables.masses``."""
    bodies = [robot.model.inertias[joint + 1] for joint in range(6 * robot.leg_count)]
    rows = [(body.mass, *body.lever) for body in bodies]
    chassis, load = robot.model.inertias[0], carried(robot, balance)
    mass, moment = chassis.mass, chassis.mass * chassis.lever
    if load is not None:
        mass, moment = mass + load[0], moment + load[0] * load[1]
    masses = np.array([*rows, (mass, *moment / mass)])
    masses[:, 0] /= loaded(robot, np.zeros(3), balance)[0]
    return masses
