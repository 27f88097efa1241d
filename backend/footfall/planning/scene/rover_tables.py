"""The tables of the compiled check of the whole rover, made once for a robot and the ground around it."""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.bounds import require_distances
from footfall.core.grid import GridGeometry
from footfall.planning.scene.rover_kernel import BEYOND, BODIES, CHASSIS, CLEAR, PAYLOAD, TERRAIN, RoverTables
from footfall.robot import bvh
from footfall.robot.clearance import SLACK, leg_covers, link_shells, radius_classes
from footfall.robot.cover import BallTree, ball_tree
from footfall.robot.description import PARTS, RobotDescription
from footfall.robot.ground_tables import ground_tables
from footfall.robot.leg_frames import PART_COUNT, leg_lengths
from footfall.robot.model import Robot
from footfall.robot.shells import CENTER

Array = NDArray[np.float64]

_EDGES = (0.7, 0.2, 0.1)
"""Longest edges of the cells that chassis and payload are covered in, level by level [m]."""

_SAME_TABLE = 0.05
"""Balls share a table of the ground where their radii differ by no more than this share."""

_MOST_CELLS = 100_000_000
"""Of all tables of the ground (800 MB, of which the machine gives what was asked about)."""

_WORDS = ("hip", "thigh", "knee", "shank", "ankle", "foot", "wheel")
_OTHERS = {CHASSIS: "chassis", PAYLOAD: "payload", TERRAIN: "the terrain", BEYOND: "ground that was not cut out"}


def rover_tables(
    robot: Robot,
    heights: ArrayLike,
    geometry: GridGeometry,
    clearance: float = 0.0,
    around: ArrayLike | None = None,
    within: float = np.inf,
) -> RoverTables:
    """What the functions of rover_kernel.py take.

    heights: (rows, cols) [m], NaN where unknown, which is no obstacle. clearance: added to every δ [m]. around,
    within: (x, y) and radius [m] of a circle outside of which nothing is called clear. Raises InvalidInput where heights
    and geometry don't fit together, and where the ground is too large for tables.
    """
    require_distances(clearance=clearance)
    description = robot.description
    deltas, shells, points = description.clearances, *link_shells(description)
    covers = _covers(robot)
    on_ground = [*(deltas.terrain[part] for part in PARTS), *[deltas.chassis_terrain] * (len(covers) - PART_COUNT)]
    radii = [cover.radii + delta + clearance + SLACK for cover, delta in zip(covers, on_ground, strict=True)]
    ground = ground_tables(
        heights, geometry, radius_classes(np.concatenate(radii), _SAME_TABLE), around, within, _MOST_CELLS
    )
    fixed = [[deltas.chassis.get(part) for part in PARTS], [deltas.payload] * PART_COUNT][: len(covers) - PART_COUNT]
    ends = np.cumsum([len(one) for one in radii])
    starts = ends - [len(one) for one in radii]
    return RoverTables(
        hips=np.array([leg.T_base_hip[:3] for leg in description.legs]),
        lengths=np.array([leg_lengths(leg) for leg in description.legs]),
        masses=_masses(robot),
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
        trees=np.column_stack([starts, ends]),
        sizes=np.array(
            [
                np.linalg.norm(cover.centers - shell[CENTER : CENTER + 3], axis=1).max()
                for cover, shell in zip(covers, shells, strict=True)
            ]
        ),
        ground=ground.cells,
        ground_layout=ground.layout,
        region=ground.region,
    )


def named(code: int) -> str:
    """The two bodies of a code in words: "leg 2 shank and leg 3 thigh"."""
    if code == CLEAR:
        return "nothing is too near"
    return " and ".join(_named(body) for body in divmod(code, BODIES))


def _named(body: int) -> str:
    return _OTHERS[body] if body in _OTHERS else f"leg {body // PART_COUNT} {_WORDS[body % PART_COUNT]}"


@lru_cache(maxsize=8)
def _covers(robot: Robot) -> list[BallTree]:
    """Covers of the leg's parts in order, of the chassis and the payload, if there is one."""
    meshes, legs = bvh.robot_meshes(robot.description), leg_covers(robot.description)
    solids = [meshes[name] for name in ("base", bvh.PAYLOAD) if name in meshes]
    return [*(legs[part] for part in PARTS), *(ball_tree(mesh, _EDGES) for mesh in solids)]


def _masses(robot: Robot) -> Array:
    """Rows of ``RoverTables.masses``."""
    description: RobotDescription = robot.description
    bodies = [robot.model.inertias[joint + 1] for joint in range(6 * robot.leg_count)]
    rows = [(body.mass, *body.lever) for body in bodies]
    chassis, payload = robot.model.inertias[0], description.payload
    mass, moment = chassis.mass, chassis.mass * chassis.lever
    if payload is not None:
        mass, moment = mass + payload.mass, moment + payload.mass * payload.position
    masses = np.array([*rows, (mass, *moment / mass)])
    masses[:, 0] /= robot.mass
    return masses
