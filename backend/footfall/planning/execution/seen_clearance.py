"""The clearance of a wheel in the air as telemetry shows it, how sure that is, and what was predicted.

All clearances are those of :mod:`footfall.planning.execution.rim`, so that they can be compared.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply
from footfall.planning.compliance.from_telemetry import UNEXPLAINED
from footfall.planning.execution.problem import Execution
from footfall.planning.execution.rim import ground_known, rim_clearance, touching_place
from footfall.robot.kinematics import wheel_centers, wheel_jacobian
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

NORMAL_95 = 1.96
"""Standard deviations on either side that hold 95 % of a normal distribution."""
LEAST_STANDING = 3
"""So many standing wheels over known ground tell how sure the pose of the chassis is."""
BELOW = 0.5
"""Of a wheel's radius: ground that is known so far to each side holds what it stands on, on slopes up to 30°."""
ON_THE_WAY = 0.05
"""A joint's set point may be so far from those that were predicted with: more, and it is another motion [rad]."""


@dataclass(frozen=True)
class SeenClearance:
    """clearance [m] with its standard deviation, and what that is made of: joints, pose, ground, each one σ [m].

    pose, ground: None where nothing tells it; ``sigma`` is then too small, and 0 stands for what is not known.
    whole: whether all ground below the wheel is known; else it may be higher where it is not.
    """

    clearance: float
    joints: float
    pose: float | None
    ground: float | None
    whole: bool

    @property
    def sigma(self) -> float:
        """One standard deviation [m]: the parts are taken to be independent."""
        return float(np.sqrt(sum(part * part for part in (self.joints, self.pose or 0.0, self.ground or 0.0))))

    @property
    def uncertainty(self) -> float:
        """By how much the true clearance may be more or less, in 95 of 100 cases [m]."""
        return NORMAL_95 * self.sigma


@dataclass(frozen=True)
class Foreseen:
    """A clearance [m] that was predicted for some set points.

    less: by how much less with springs softer by the tolerance of the prediction, None where that rover would not
    stand.
    """

    clearance: float
    less: float | None


def seen_clearance(
    robot: Robot, dem: Dem, state: RobotState, leg: int, standing: list[int], wheel_scale: float = 1.0
) -> SeenClearance | None:
    """How far the wheel of a leg in the air is from the ground, and how sure that is.

    Assumed, one standard deviation each, independent of each other:

    - joints: each angle errs by UNEXPLAINED, as the prediction of sag has it, alone of all joints. The encoders are
      behind the joints' springs: what these yield is measured. That links bend is left out: a leg in the air bears
      itself alone.
    - pose: telemetry says nothing of its own errors. The standing wheels do: with the telemetered pose each should be
      in the ground by force / stiffness; the root mean square of how far it is not is the pose's share. Joints of
      standing legs and the map there err in it too, so it is rather too large. None with fewer than LEAST_STANDING
      wheels over known ground: cameras seldom see what is under a wheel.
    - ground: the largest variance of the cells around the place that the wheel would touch first; None where the map
      has none.

    Args:
        robot: the rover.
        dem: the ground, in site.
        state: telemetered, its pose on the map.
        leg: number of the leg in the air, from 0.
        standing: numbers of the legs that bear load.
        wheel_scale: factor on the wheels' stiffness.

    Returns:
        The clearance [m] with its shares of doubt; None where no ground is known below the wheel.
    """
    radius = robot.wheel_radius
    hubs = apply(state.T_site_base, wheel_centers(robot, state.posture))
    clearances = rim_clearance(dem, hubs, radius)
    place = touching_place(dem, hubs[leg], radius)
    if place is None:
        return None
    up = (state.T_site_base[:3, :3] @ wheel_jacobian(robot, state.posture, leg))[2]
    pressed = np.linalg.norm(state.wheel_forces, axis=1) / (wheel_scale * robot.description.wheel_stiffness)
    # over unknown ground the sides of the ball would pass for its lowest point
    surely = ground_known(dem, hubs, BELOW * radius)
    off = (clearances + pressed)[[one for one in standing if one != leg and surely[one]]]
    return SeenClearance(
        clearance=float(clearances[leg]),
        joints=float(UNEXPLAINED * np.linalg.norm(up)),
        pose=float(np.sqrt(np.mean(off * off))) if len(off) >= LEAST_STANDING else None,
        ground=height_deviation(dem, place),
        whole=bool(ground_known(dem, hubs[leg][None], radius)[0]),
    )


def clearance_of(robot: Robot, dem: Dem, posture: ArrayLike, T_site_base: Array, leg: int) -> float | None:
    """How far a leg's wheel is from the ground.

    Args:
        robot: the rover.
        dem: the ground, in site.
        posture: joint angles, (legs × 6,) [rad].
        T_site_base: pose of the chassis, (4, 4).
        leg: number of the leg, from 0.

    Returns:
        The distance that it can fall [m]; None over unknown ground.
    """
    hub = apply(T_site_base, wheel_centers(robot, robot.require_posture(posture))[leg])
    found = float(rim_clearance(dem, hub[None], robot.wheel_radius)[0])
    return found if np.isfinite(found) else None


def foreseen(execution: Execution, set_points: Array) -> Foreseen | None:
    """What an execution predicts for set points (legs × 6,) [rad]; None where they are not on its way.

    Between two waypoints clearances go straight.
    """
    found = along(execution.commanded, set_points)
    if found is None:
        return None
    at, share = found
    clearance, less = (
        float((1 - share) * row[at] + share * row[min(at + 1, len(row) - 1)])
        for row in (execution.clearance, execution.clearance_uncertainty)
    )
    return Foreseen(clearance, less if np.isfinite(less) else None) if np.isfinite(clearance) else None


def along(way: Array, point: Array) -> tuple[int, float] | None:
    """Where on a way (n, k), n ≥ 2, of straight lines a point (k,) is nearest: waypoint, and 0…1 to the next.

    None where a joint is farther than ON_THE_WAY from there. Raises InvalidInput where the sizes don't fit.
    """
    if way.ndim != 2 or len(way) < 2 or way.shape[1:] != point.shape:
        raise InvalidInput("a way needs two waypoints or more, of as many joints as the point")
    steps, ahead = np.diff(way, axis=0), point - way[:-1]
    lengths = np.sum(steps * steps, axis=1)
    shares = np.clip(np.sum(ahead * steps, axis=1) / np.where(lengths > 0, lengths, 1.0), 0.0, 1.0)
    off = ahead - shares[:, None] * steps
    at = int(np.argmin(np.sum(off * off, axis=1)))
    if np.abs(off[at]).max() > ON_THE_WAY:
        return None
    return at, float(shares[at])


def height_deviation(dem: Dem, place: Array) -> float | None:
    """One σ of the height at a place (2,) [m]: the largest of the known cells around; None: the map says nothing."""
    if dem.variance is None:
        return None
    grid = dem.geometry
    col, row = np.floor((place - (grid.x0, grid.y0)) / grid.resolution).astype(int).tolist()
    cells = dem.variance[max(row, 0) : row + 2, max(col, 0) : col + 2]
    return float(np.sqrt(np.nanmax(cells))) if np.isfinite(cells).any() else None
