"""What a search for a walk asks again and again: tables of the rover, and of the ground where the search is."""

import math
from dataclasses import dataclass

import numpy as np

from footfall.balance.held import held_tables
from footfall.balance.held_kernel import HeldTables
from footfall.core.arrays import Array
from footfall.planning.latest_results import LatestResults
from footfall.planning.scene.ground import Nearby
from footfall.planning.scene.rover_tables import rover_tables
from footfall.planning.scene.tether_tables import tether_tables
from footfall.planning.walk.body_kernel import Checks
from footfall.planning.walk.hung import Hung
from footfall.planning.walk.legs_kernel import KNEE_ROLL_ON_THE_WAY, WRIST_ON_THE_WAY, LegsTables
from footfall.planning.walk.problem import WalkSettings
from footfall.planning.walk.transition_kernel import IGNORED, PREFERRED, REQUIRED, Balance
from footfall.robot.description import PARTS
from footfall.robot.leg_frames import leg_lengths
from footfall.robot.meshes.bvh import robot_meshes
from footfall.robot.model import Robot
from footfall.robot.proof.clearance import clearance_ground, leg_reach
from footfall.robot.proof.ground_tables import GroundTables

MOST_MOVED = 0.8
"""How far the chassis goes before one foot move, at most [m]."""
MOST_CELLS = 100_000_000
"""Of a piece's tables (800 MB, of which the machine gives what was asked about)."""
LATTICE = 2.0
"""Pieces of ground are made around the points of a lattice of this spacing [m]."""
LEAST_GAP = 0.002
"""How far anything may move between two samples where no clearance is asked for [m]."""
_KEPT = 6
_SUPPORT = {"ignored": IGNORED, "preferred": PREFERRED, "required": REQUIRED}


@dataclass(frozen=True, eq=False)
class Piece:
    """The ground around a place, and all that is checked with it."""

    checks: Checks
    ground: GroundTables


class World:
    """A robot over its ground, without holes. T_site_base: (4, 4) where it begins; first: the piece there.

    hung: of a rover on a tether, for which all of it is in the slope's frame.
    """

    def __init__(
        self, robot: Robot, ground: Nearby, settings: WalkSettings, T_site_base: Array, hung: Hung | None = None
    ) -> None:
        self.robot, self.ground, self.settings, self.hung = robot, ground, settings, hung
        legs = robot.description.legs
        self.legs = LegsTables(
            np.array([leg_lengths(leg) for leg in legs]),
            np.array([leg.T_base_hip[:3] for leg in legs]),
            robot.lower.reshape(-1, 6).copy(),
            robot.upper.reshape(-1, 6).copy(),
            settings.reach_reserve,
            settings.joint_reserve,
        )
        self.balance = Balance(_SUPPORT[settings.support], settings.least_margin)
        added = max(settings.clearance, LEAST_GAP)
        # the clearance is enlarged by what turned ground is off the site's: that much of it is not for samples
        self._gap = max(settings.clearance - (0.0 if hung is None else hung.frame.off), LEAST_GAP)
        tether = None if hung is None else hung.frame.tether(hung.tether)
        balance = settings.balance if hung is None else hung.balance(settings.balance)
        self._held: HeldTables = held_tables(robot, balance, tether)
        self._tether = tether_tables(robot, ground.dem, tether, added)
        meshes = robot_meshes(robot.description)
        reaches = [float(np.linalg.norm(np.asarray(meshes[part].vertices), axis=1).max()) for part in PARTS]
        self._reaches = np.tile(reaches, robot.leg_count)
        hip = float(np.hypot(*legs[0].T_base_hip[:2, 3]))
        self._within = hip + leg_reach(robot) + MOST_MOVED + LATTICE * math.sqrt(0.5)
        self._pieces: LatestResults[Piece] = LatestResults(_KEPT)
        self.first = self.around(T_site_base)

    def around(self, T_site_base: Array) -> Piece:
        """The ground around a chassis at a pose (4, 4)."""
        middle = LATTICE * np.rint(T_site_base[:2, 3] / LATTICE)
        return self._pieces.get(tuple(middle), lambda: self._piece(middle))

    def _piece(self, middle: Array) -> Piece:
        dem, clearance = self.ground.dem, self.settings.clearance
        heights, geometry = dem.heights, dem.geometry
        rover = rover_tables(self.robot, heights, geometry, clearance, middle, self._within, self.settings.balance)
        checks = Checks(
            self.legs._replace(wrist=WRIST_ON_THE_WAY, knee_roll=KNEE_ROLL_ON_THE_WAY),
            rover,
            self._held,
            self.balance,
            self.settings.most_torque,
            self._reaches,
            self._gap,
            self._tether,
        )
        return Piece(
            checks, clearance_ground(self.robot, heights, geometry, clearance, middle, self._within, MOST_CELLS)
        )
