"""What a walk costs, of the motions that it is made of: the sum over its foot moves and the chassis' last way."""

from dataclasses import dataclass, replace

import numpy as np

from footfall.core.arrays import Array
from footfall.planning.scene.rover_tables import RoverTables
from footfall.planning.walk.body_kernel import Checks
from footfall.planning.walk.body_way import At, BodyWay, feet_of
from footfall.planning.walk.foot_move import Moved, move_of, nobody
from footfall.planning.walk.footprint import height_above_feet
from footfall.planning.walk.problem import Stance
from footfall.planning.walk.smooth_kernel import (
    METRES_A_RADIAN,
    ROOMY,
    ROOMY_MARGIN,
    Weights,
    off_height,
    short_of,
    tightness,
)
from footfall.planning.walk.smoothing import WalkFigures
from footfall.planning.walk.transition_kernel import vector_of
from footfall.planning.walk.world import World


@dataclass(frozen=True, eq=False)
class Way:
    """A walk as its motions: foot moves from ``start``, then the chassis' way over the last stance."""

    start: At
    moves: tuple[Moved, ...]
    closing: BodyWay

    def at(self, number: int) -> At:
        """The rover before the chassis moves for foot move ``number``, or for the last time."""
        return self.moves[number - 1].to if number else self.start

    def pose(self, number: int) -> Array:
        """T_site_base (4, 4) of foot move ``number``, or at the end; −1: at the start."""
        if number == len(self.moves):
            return self.closing.Ts_site_base[-1]
        return self.at(number + 1).T_site_base

    def vector(self, number: int) -> Array:
        """The same, (6,): x, y, z [m], roll, pitch, yaw [rad]."""
        return vector_of(np.ascontiguousarray(self.pose(number)[:3]))

    def with_move(self, number: int, moved: Moved, then: BodyWay) -> "Way":
        """With another foot move ``number``, and the chassis' way after it; the next foot move's swing is as before."""
        moves = [*self.moves[:number], moved, *self.moves[number + 1 :]]
        if number + 1 == len(moves):
            return replace(self, moves=tuple(moves), closing=then)
        moves[number + 1] = replace(moves[number + 1], body=then)
        return replace(self, moves=tuple(moves))


class Cost:
    """Of a walk in a world; height: of the chassis above its feet that is wanted, where no posture was asked for."""

    def __init__(self, world: World, height: float) -> None:
        self._world, self._asked = world, world.settings.smoothing
        posture = self._asked.posture
        self._height = height if posture is None else height_above_feet(world.robot, world.robot.posture(posture))

    def weights(self, checks: Checks) -> Weights:
        """What the kernels weigh by, with what is enough room for this rover."""
        asked = self._asked
        return Weights(
            asked.way,
            asked.torque,
            asked.margin,
            asked.clearance,
            asked.nominal,
            self._height,
            _roomy(checks.rover),
        )

    def height_above(self, stance: Stance) -> float:
        """Height in site that is wanted of the chassis over some feet [m]."""
        return float(np.mean(stance.contacts[:, 2])) + self._height

    def of(self, way: Way, number: int) -> float:
        """What foot move ``number`` costs, or what is after the last."""
        asked, at, vector = self._asked, way.at(number), way.vector(number)
        margin, torque = _tightest(way, number)
        body, turning, move = way.closing, 0.0, nobody(at.stance)
        if number < len(way.moves):
            moved = way.moves[number]
            body, turning = moved.body, _turning(moved.swing.waypoints)
            move = move_of(self._world, at.stance, moved.leg, moved.to.stance)
        checks = self._world.around(at.T_site_base).checks
        feet, normals = feet_of(at.stance), at.stance.normals
        room = tightness(vector, feet, normals, move, self._world.legs, checks, self.weights(checks).roomy)[2]
        return (
            asked.foot_move * (move.leg >= 0)
            + asked.way * _length(body.Ts_site_base)
            + asked.turning * (turning + _turning(body.postures))
            + asked.torque * torque**4
            + asked.margin * short_of(margin - checks.balance.least, ROOMY_MARGIN)
            + asked.clearance * short_of(room, ROOMY)
            + asked.nominal * off_height(vector, move.contacts, self._height)
        )

    def figures(self, way: Way) -> WalkFigures:
        """What a way costs, and the figures that this comes of."""
        bodies = [*(moved.body for moved in way.moves), way.closing]
        numbers = range(len(bodies))
        margins, torques = zip(*(_tightest(way, number) for number in numbers), strict=True)
        turning = sum(_turning(body.postures) for body in bodies)
        return WalkFigures(
            foot_moves=len(way.moves),
            chassis_way=float(sum(_far(body.Ts_site_base) for body in bodies)),
            turning=turning + sum(_turning(moved.swing.waypoints) for moved in way.moves),
            largest_torque=max(torques),
            mean_torque=float(np.mean(torques)),
            least_margin=min(margins),
            cost=sum(self.of(way, number) for number in numbers),
        )


def _tightest(way: Way, number: int) -> tuple[float, float]:
    """Least margin [m] and largest torque of a foot move, or of what is after the last, at the walk's waypoints."""
    # ways and swings begin with the waypoint before, which is the walk's only at its start
    first = min(number, 1)
    if number == len(way.moves):
        return float(way.closing.margins[first:].min()), float(way.closing.torques[first:].max())
    moved = way.moves[number]
    margins = np.concatenate([moved.body.margins[first:], moved.margins[1:]])
    return float(margins.min()), float(max(moved.body.torques[first:].max(), moved.torques[1:].max()))


def _roomy(rover: RoverTables) -> RoverTables:
    own = rover.own.copy()
    own[:, 2] += ROOMY
    fixed = np.where(rover.fixed < 0.0, rover.fixed, rover.fixed + ROOMY)
    return rover._replace(own=own, fixed=fixed, between=rover.between + ROOMY)


def _far(Ts_site_base: Array) -> float:
    """How far a chassis' origin goes [m]."""
    return float(np.linalg.norm(np.diff(Ts_site_base[:, :3, 3], axis=0), axis=1).sum())


def _length(Ts_site_base: Array) -> float:
    """The same with turns [m]: a rotation's change has the size √2 of its angle, where that is small."""
    turned = np.linalg.norm(np.diff(Ts_site_base[:, :3, :3], axis=0), axis=(1, 2)).sum() / np.sqrt(2.0)
    return _far(Ts_site_base) + METRES_A_RADIAN * float(turned)


def _turning(postures: Array) -> float:
    """How far the joints that turn farthest turn over rows of postures [rad]."""
    return float(np.abs(np.diff(postures, axis=0)).max(axis=1).sum())
