"""A rover standing still on the ground: chassis level, every wheel on the terrain."""

from dataclasses import dataclass

import numpy as np

from footfall.balance.forces import distribute
from footfall.balance.torques import holding_torques
from footfall.core.arrays import Array
from footfall.core.beside import beside
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, rotation, transform
from footfall.planning.scene.under_links import ground_near_links
from footfall.robot.description import link_name
from footfall.robot.ik import contact_point, leg_azimuth, solve_leg, wheel_pose_for_contact
from footfall.robot.kinematics import center_of_mass
from footfall.robot.meshes.collision import TERRAIN, Collision, posture_collisions
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.extent import spans
from footfall.terrain.ground.surface import height_at, normal_at

HEIGHT_STEP = 0.05
HEIGHT_RANGE = 0.6
"""Chassis heights tried: this far below and above that of the posture on the mean ground [m]."""

RADIAL = (0.0, -0.1, 0.1, -0.2, 0.2, -0.3, 0.3, -0.45)
SIDEWAYS = (0.0, -0.15, 0.15, -0.3, 0.3)
"""Places tried for a wheel: so far outward and to the left of where the posture has it [m]."""

_ATTEMPTS = 16
"""Stances considered, best first, until one is free of collisions and held."""


@dataclass(frozen=True)
class _Stances:
    """One stance for every chassis height, h of them.

    postures (h, legs, 6), NaN for a leg without a solution; contacts and normals (h, legs, 3); shifts (h, legs), how
    far each wheel is from where the posture has it [m].
    """

    postures: Array
    contacts: Array
    normals: Array
    shifts: Array


def stand(
    robot: Robot, dem: Dem, x: float = 0.0, y: float = 0.0, yaw: float = 0.0, posture: str = "stand"
) -> RobotState:
    """Stand a rover at (x, y) with heading yaw, its chassis level.

    Seen from above, a wheel touches the ground where that of the named posture would, or at the nearest of some places
    around it that the leg can reach; it stands upright on the local surface and heads radially outward. Of the chassis
    heights at which every leg reaches the ground, the stance is taken that is free of collisions, held by friction, and
    nearest to the posture: least change of height plus mean shift of the wheels. Of a leg's inverse-kinematics
    solutions it is the one nearest to the posture. Wheel forces are those of least norm inside friction, joint torques
    those that hold.

    Args:
        robot: the rover.
        dem: the ground, in site.
        x: east, of the chassis' origin in site [m].
        y: north, of the chassis' origin in site [m].
        yaw: heading of the chassis in site [rad].
        posture: name of the posture that the stance is to come near.

    Returns:
        The state of the rover at rest, at time 0.

    Raises:
        InvalidInput: the ground under a wheel is unknown, a leg can't reach it, the rover would collide, or no contact
            forces hold it.
        NotFound: the robot has no posture of that name.
    """
    if not np.isfinite([x, y, yaw]).all():
        raise InvalidInput("a place to stand needs finite x and y [m] and yaw [rad]", x=x, y=y, yaw=yaw)
    nominal = robot.posture(posture)
    T_site_ground = transform(rotation("z", yaw), [x, y, 0.0])
    wanted = np.array([contact_point(robot, nominal, leg, T_site_ground) for leg in robot.legs])
    places = [_places(robot, dem, leg, wanted[leg], T_site_ground) for leg in robot.legs]
    _require_ground(dem, wanted, places)
    usual = float(np.mean([contacts[0, 2] for contacts, _, _ in places] - wanted[:, 2]))
    steps = round(HEIGHT_RANGE / HEIGHT_STEP)
    lifts = HEIGHT_STEP * np.arange(-steps, steps + 1, dtype=np.float64)
    stances = _stances(robot, nominal, T_site_ground, usual + lifts, places)
    complete = np.isfinite(stances.shifts.sum(axis=1))
    if not complete.any():
        raise _unreached(robot, stances.postures, wanted, usual + lifts)

    change = np.abs(lifts) + stances.shifts.mean(axis=1)
    order = [i for i in np.argsort(change, kind="stable") if complete[i]]
    refusal, grounded = "", -np.inf
    cutting: set[tuple[float, ...]] = set()
    for chosen in order[:_ATTEMPTS]:
        contacts, normals = stances.contacts[chosen], stances.normals[chosen]
        # an upright wheel on the same spot cuts the ground alike, however high the chassis is
        if lifts[chosen] <= grounded or cutting & {(leg, *contacts[leg]) for leg in robot.legs}:
            continue
        q = stances.postures[chosen].ravel()
        T_site_base = transform(rotation("z", yaw), (x, y, float(usual + lifts[chosen])))
        collisions = posture_collisions(robot, q, T_site_base, ground_near_links(robot, dem, q, T_site_base))
        if collisions:
            first = collisions[0]
            if any({"base", TERRAIN} == {c.link_a, c.link_b} for c in collisions):
                # a level chassis that touches the ground touches it all the more lower down
                grounded = lifts[chosen]
            cut = {c.link_a for c in collisions if c.link_b == TERRAIN}
            cutting |= {(leg, *contacts[leg]) for leg in robot.legs if link_name(leg, "wheel") in cut}
            refusal = refusal or _cramped(robot, first)
            continue
        com = apply(T_site_base, center_of_mass(robot, q))
        forces = distribute(contacts, normals, com, robot.mass)
        if forces is None:
            refusal = refusal or "no contact forces inside friction hold it"
            continue
        torques = holding_torques(robot, q, T_site_base, robot.legs, contacts, forces)
        return RobotState(robot.name, 0.0, q, T_site_base, forces, torques, "idle")
    raise InvalidInput(
        f"{robot.name} can't stand at ({x:g}, {y:g}): {refusal}; choose another place, heading or posture",
        x=x,
        y=y,
        yaw=yaw,
    )


def _cramped(robot: Robot, hit: Collision) -> str:
    if hit.distance < 0:
        return f"{hit.link_a} would be {-hit.distance:z.3f} m below {hit.link_b}"
    if hit.required == 0:
        sink = robot.description.clearances.wheel_sink
        return f"{hit.link_a} would cut more than the allowed {sink:z.3f} m into {hit.link_b}"
    apart, needed = beside(hit.distance, hit.required)
    return f"{hit.link_a} and {hit.link_b} would be {apart} m apart, {needed} m is needed"


def _places(robot: Robot, dem: Dem, leg: int, wanted: Array, T_site_ground: Array) -> tuple[Array, Array, Array]:
    """Contacts (n, 3), normals (n, 3) and shifts (n,) where the ground is known, nearest to ``wanted`` first."""
    radial, sideways = (a.ravel() for a in np.meshgrid(RADIAL, SIDEWAYS))
    shifts = np.hypot(radial, sideways)
    azimuth = leg_azimuth(robot, leg, T_site_ground)
    c, s = np.cos(azimuth), np.sin(azimuth)
    xy = wanted[:2] + np.column_stack([c * radial - s * sideways, s * radial + c * sideways])
    heights = height_at(dem, xy[:, 0], xy[:, 1])
    normals = normal_at(dem, xy[:, 0], xy[:, 1], robot.wheel_radius)
    known = np.isfinite(heights) & np.isfinite(normals[:, 2])
    order = [i for i in np.argsort(shifts, kind="stable") if known[i]]
    return np.column_stack([xy, heights])[order], normals[order], shifts[order]


def _require_ground(dem: Dem, wanted: Array, places: list[tuple[Array, Array, Array]]) -> None:
    unknown = [leg for leg, (contacts, _, _) in enumerate(places) if not len(contacts)]
    if unknown:
        where = ", ".join(f"leg {leg} at ({wanted[leg, 0]:z.2f}, {wanted[leg, 1]:z.2f})" for leg in unknown)
        raise InvalidInput(f"the ground is unknown under {where}; {spans(dem.geometry)}", unknown_under=unknown)


def _stances(
    robot: Robot, nominal: Array, T_site_ground: Array, heights: Array, places: list[tuple[Array, Array, Array]]
) -> _Stances:
    """For every chassis height and leg the first of its places that the leg reaches."""
    shape = (len(heights), robot.leg_count)
    found = _Stances(
        np.full((*shape, 6), np.nan), np.full((*shape, 3), np.nan), np.full((*shape, 3), np.nan), np.full(shape, np.nan)
    )
    for leg, (contacts, normals, shifts) in enumerate(places):
        azimuth = leg_azimuth(robot, leg, T_site_ground)
        Ts_ground_wheel = wheel_pose_for_contact(robot, contacts, normals, azimuth, T_site_ground)
        Ts_base_wheel = np.tile(Ts_ground_wheel, (len(heights), 1, 1, 1))
        # the chassis stays level, so raising it only lowers the wheel in base
        Ts_base_wheel[:, :, 2, 3] -= heights[:, None]
        solutions = solve_leg(robot, leg, Ts_base_wheel.reshape(-1, 4, 4))
        away = np.square(solutions.q - nominal[6 * leg : 6 * leg + 6]).sum(axis=2)
        away[~solutions.valid] = np.inf
        nearest = solutions.q[np.arange(len(away)), np.argmin(away, axis=1)].reshape(len(heights), len(contacts), 6)
        reached = solutions.valid.any(axis=1).reshape(len(heights), len(contacts))
        first = np.argmax(reached, axis=1)
        for height in np.flatnonzero(reached.any(axis=1)):
            place = first[height]
            found.postures[height, leg] = nearest[height, place]
            found.contacts[height, leg], found.normals[height, leg] = contacts[place], normals[place]
            found.shifts[height, leg] = shifts[place]
    return found


def _unreached(robot: Robot, postures: Array, wanted: Array, heights: Array) -> InvalidInput:
    """The refusal that names the legs that keep the rover from standing."""
    reached = np.isfinite(postures[:, :, 0])
    low, high = heights.min(), heights.max()
    never = np.flatnonzero(~reached.any(axis=0))
    if len(never):
        where = ", ".join(f"leg {leg} at ({wanted[leg, 0]:z.2f}, {wanted[leg, 1]:z.2f})" for leg in never)
        return InvalidInput(
            f"no joint angles put {where}, or up to {max(np.abs(RADIAL)):z.2f} m around, on the ground with the level "
            f"chassis at any height from {low:z.2f} to {high:z.2f} m; choose another place or heading",
            legs=never.tolist(),
        )
    spans = "; ".join(
        f"leg {leg} from {heights[reached[:, leg]].min():z.2f} to {heights[reached[:, leg]].max():z.2f} m"
        for leg in robot.legs
    )
    return InvalidInput(
        f"no one height of the level chassis lets all legs reach the ground: {spans}; choose another place or heading",
        legs=list(robot.legs),
    )
