"""The compiled check of one step's moving leg: its clearance, its limits and the balance of the feet that stay.

What depends on the ground alone is made once for a ground and kept, where the ground is small enough.
"""

from copy import copy
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.payload import loaded
from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.planning.latest_results import LatestResults
from footfall.planning.scene.ground import Nearby
from footfall.planning.scene.leg_free_kernel import SURE, BodyTables, edges_are_sure, first_unsure
from footfall.robot.description import PARTS, link_name
from footfall.robot.kinematics import center_of_mass, leg_link_poses
from footfall.robot.leg_frames import PART_COUNT
from footfall.robot.meshes.bvh import mesh_reach
from footfall.robot.model import Robot
from footfall.robot.proof.clearance import MODES, LegClearance, clearance_ground, leg_reach, wheel_drums
from footfall.robot.proof.ground_tables import GroundTables
from footfall.robot.proof.leg_clearance_kernel import path_is_clear
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

WHOLE = 100.0
"""Ground of at most this area is prepared as a whole, for every leg and stance; of more, what one leg needs [m²]."""


_whole: LatestResults[GroundTables] = LatestResults(4)


class Certificate:
    """One leg of a state over its ground; answers "sure" or "unsure", never wrongly "sure".

    world: the map; ground: what is near the leg, without holes; normals (k, 2), offsets (k,): see BodyTables.
    clearance: added to every clearance of the robot; raise_terrain: by how much the ground is raised for a swing;
    least_margin: of the centre of mass [m].
    """

    def __init__(
        self,
        robot: Robot,
        state: RobotState,
        leg: int,
        world: Dem,
        ground: Nearby,
        normals: Array,
        offsets: Array,
        *,
        clearance: float,
        raise_terrain: float,
        least_margin: float,
    ) -> None:
        T_site_base = np.asarray(state.T_site_base)
        tables = _tables(robot, T_site_base, leg, world, ground, clearance)
        self.clearance = LegClearance(robot, state.posture, leg, T_site_base, tables, clearance, raise_terrain).tables
        self._asked_of_drum = robot.description, tables, clearance
        self.body = body_tables(robot, np.asarray(state.posture), T_site_base, leg, normals, offsets, least_margin)

    @cached_property
    def of_drum(self) -> "Certificate":
        """The same with a look at the wheel's own shape, a drum, where the balls around it leave the ground unsure."""
        other = copy(self)
        other.clearance = self.clearance._replace(drums=wheel_drums(*self._asked_of_drum))
        return other

    def first_unsure(self, qs: Array, terrain: str) -> int:
        """The first of n postures (n, 6) that is not surely allowed, or n; terrain: "none", "true" or "raised"."""
        found = first_unsure(np.array(qs, order="C"), self.clearance, self.body, MODES[terrain])
        return len(qs) if found == SURE else found

    def edges_sure(self, path: Array, epsilon: float, terrain: str) -> bool:
        """Whether all between waypoints (n, 6), themselves allowed, is surely allowed at ε or proven in one piece."""
        return edges_are_sure(np.ascontiguousarray(path), epsilon, self.clearance, self.body, MODES[terrain])

    def clear(self, qs: Array, terrain: str) -> NDArray[np.bool_]:
        """Which samples of a path, n postures (n, 6), surely keep all clearances, (n,); limits and balance aside."""
        return path_is_clear(np.ascontiguousarray(qs), self.clearance, MODES[terrain])


def body_tables(
    robot: Robot,
    posture: Array,
    T_site_base: Array,
    leg: int,
    normals: Array,
    offsets: Array,
    least_margin: float,
    balance: BalanceSettings | None = None,
) -> BodyTables:
    """What decides, besides clearance, of one leg that moves while the rover else keeps its posture.

    Args:
        robot: the rover.
        posture: joint angles, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).
        leg: number of the leg, from 0.
        normals: (m, 2) outward, of the polygon that the centre of mass must stay in.
        offsets: (m,) of its edges [m].
        least_margin: to that polygon [m].
        balance: whose payload the rover carries; None: that of its description.

    Returns:
        The tables.
    """
    mass, com = loaded(robot, center_of_mass(robot, posture), balance or BalanceSettings())
    own = slice(6 * leg, 6 * leg + 6)
    moments = np.zeros((PART_COUNT, 4))
    for i in range(6):
        # the wheel is fixed to the last joint's body, which carries its mass
        body = robot.model.inertias[6 * leg + i + 1]
        moments[i] = *(body.mass * np.asarray(body.lever)), body.mass
    moments /= mass
    tables = BodyTables(
        lower=np.array(robot.lower[own], float),
        upper=np.array(robot.upper[own], float),
        moments=moments,
        rest=np.zeros(2),
        normals=np.array(normals, float).reshape(-1, 2),
        offsets=np.array(offsets, float),
        least=float(least_margin),
    )
    return tables._replace(rest=_rest(robot, posture, T_site_base, leg, tables.moments, com))


def _rest(robot: Robot, posture: Array, T_site_base: Array, leg: int, moments: Array, com: Array) -> Array:
    """Where the centre of mass, com (3,) in base, is in x and y of site, less the leg's share of it."""
    poses = leg_link_poses(robot, posture[6 * leg : 6 * leg + 6], leg)
    own = sum(
        (poses[link_name(leg, part)] @ np.append(moment[:3], moment[3]))[:3]
        for part, moment in zip(PARTS, moments, strict=True)
    )
    share = moments[:, 3].sum()
    return (T_site_base[:3, :3] @ (com - own) + (1.0 - share) * T_site_base[:3, 3])[:2]


def _tables(robot: Robot, T_site_base: Array, leg: int, world: Dem, ground: Nearby, clearance: float) -> GroundTables:
    """Tables of ground that is nowhere lower than the one the meshes know."""
    hip = apply(T_site_base, robot.description.legs[leg].T_base_hip[:3, 3])
    west, south, east, north = world.geometry.bounds
    seen = not _reaches_filled(robot, hip, ground, clearance)
    if seen and (east - west) * (north - south) <= WHOLE:
        return _whole.get(
            (robot.digest, world.digest, clearance),
            lambda: clearance_ground(robot, world.heights, world.geometry, clearance),
        )
    return clearance_ground(robot, ground.dem.heights, ground.dem.geometry, clearance, hip[:2], leg_reach(robot))


def _reaches_filled(robot: Robot, hip: Array, ground: Nearby, clearance: float) -> bool:
    """Whether ground that was not seen, but filled in, is within a leg's reach."""
    grid = ground.dem.geometry
    # a filled cell is a corner of blocks that reach one cell farther
    largest_delta = max(robot.description.clearances.terrain.values()) + clearance
    needed = mesh_reach(robot.description) + largest_delta + 2 * grid.resolution
    rows, cols = np.nonzero(ground.filled)
    return bool((np.hypot(grid.xs[cols] - hip[0], grid.ys[rows] - hip[1]) <= needed).any())
