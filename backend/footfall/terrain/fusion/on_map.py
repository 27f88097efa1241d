"""Where the rover is on the map, and how sure that is: the one place that says.

It is where its odometry has it, moved as the map's newest images had to be. Odometry drifts, and what images took back
of that (see :mod:`footfall.terrain.fusion.align`) holds for where they were taken. From there on the pose gets less
sure with the way and the time, as a random walk.
"""

from dataclasses import dataclass, replace

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import apply, inverse, pose_difference, turn_of
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.terrain_settings import TerrainSettings

MOVES_NOTHING = 0.005
"""A correction that moves the chassis by less is within what a measurement may be off, whatever it is from [m]."""
LEAST_SURE = 0.05
"""A corrected pose whose standard deviation is larger is not counted on [m]."""
DEVIATIONS = 3.0
"""So many standard deviations of the odometry a correction may be large."""
WAY, TIME = 1.0, 3600.0
"""Between two snapshots odometry is expected to go this way [m], or to wait so long [s], for its expected deviation."""
TAKE_IMAGES = "take images here and build the map of them"


@dataclass(frozen=True)
class Looks:
    """The images by which a map's correction came to be.

    latest, first: the rover as its odometry had it when the newest of them were taken, and when the first were. count:
    how often images were laid onto the map. below: (4, 4) the correction of the map before the first of them. settings:
    of the newest, which say how far odometry is expected to be off from one to the next.
    """

    latest: RobotState
    first: RobotState
    count: int
    below: Array
    settings: TerrainSettings


@dataclass(frozen=True)
class OnMap:
    """A rover on the map.

    state: as it is on the map; by_odometry: as its odometry has it. corrected: how far the correction moves any point
    within 1 m of the chassis' origin, at most [m]. way, age: straight from where the images of the correction were
    taken [m], and since when [s]; deviation: of the pose since then [m]; None where there is no correction, or nobody
    knows where it is from. doubt: why the correction is not counted on, with the size, and what to do; "" where it is.
    """

    state: RobotState
    by_odometry: RobotState
    corrected: float = 0.0
    way: float | None = None
    age: float | None = None
    deviation: float | None = None
    doubt: str = ""

    @property
    def possible(self) -> tuple[RobotState, ...]:
        """How the rover may stand.

        Where the correction is in doubt what is asked of one has to hold of the other too, so that no correction lets
        pass what would be refused without it.
        """
        return (self.state, self.by_odometry) if self.doubt else (self.state,)


def on_map(state: RobotState, dem: Dem | None) -> RobotState:
    """A telemetered state with the pose that it has on the map: as the map's newest snapshot had to be moved."""
    if dem is None or dem.correction is None:
        return state
    return replace(
        state,
        T_site_base=dem.correction @ state.T_site_base,
        wheel_forces=state.wheel_forces @ dem.correction[:3, :3].T,
    )


def place_on_map(by_odometry: RobotState, dem: Dem | None, looks: Looks | None) -> OnMap:
    """A telemetered state on the map. looks: behind its correction, None where it is from no images of this rover."""
    state = on_map(by_odometry, dem)
    corrected = pose_difference(by_odometry.T_site_base, state.T_site_base)
    if dem is None or dem.correction is None or looks is None:
        doubt = f"the map's correction of {corrected:z.2f} m is from no images of this rover: {TAKE_IMAGES}"
        return OnMap(state, by_odometry, corrected, doubt=doubt if corrected > MOVES_NOTHING else "")
    way = float(np.linalg.norm(by_odometry.T_site_base[:3, 3] - looks.latest.T_site_base[:3, 3]))
    age = by_odometry.time - looks.latest.time
    sigma = float(np.hypot(looks.settings.pose_shift, looks.settings.pose_turn))  # of a point 1 m from the origin
    deviation = sigma * float(np.sqrt(way / WAY + max(age, 0.0) / TIME))
    found = OnMap(state, by_odometry, corrected, way, age, deviation)
    if corrected <= MOVES_NOTHING:
        return found
    return replace(found, doubt=_too_old(found) or _too_large(by_odometry, dem.correction, looks))


def _too_old(found: OnMap) -> str:
    if found.way is None or found.age is None or found.deviation is None:
        return ""
    if found.age < 0.0:
        return (
            f"the rover's clock is {-found.age:z.0f} s before the images by which its pose was corrected, so odometry "
            f"may have begun anew: {TAKE_IMAGES}"
        )
    if not found.deviation <= LEAST_SURE:
        return (
            f"the pose was corrected by {found.corrected:z.2f} m by images of {found.age / 60.0:z.0f} min ago and "
            f"{found.way:z.2f} m away, and is uncertain by {found.deviation:z.3f} m since, at most {LEAST_SURE:g} m "
            f"are accepted: {TAKE_IMAGES}"
        )
    return ""


def _too_large(by_odometry: RobotState, correction: Array, looks: Looks) -> str:
    """Odometry off by more than a random walk of its expected deviations, a turn early on having moved all since."""
    at, T = by_odometry.T_site_base[:3, 3], correction @ inverse(looks.below)
    shift = float(np.linalg.norm(apply(correction, at) - apply(looks.below, at)))
    turn = turn_of(T[:3, :3])
    far = float(np.linalg.norm(at - looks.first.T_site_base[:3, 3]))
    settings, most = looks.settings, DEVIATIONS * float(np.sqrt(looks.count))
    most_shift, most_turn = most * (settings.pose_shift + settings.pose_turn * far), most * settings.pose_turn
    if shift <= most_shift and turn <= most_turn:
        return ""
    return (
        f"images have moved the pose by {shift:z.2f} m and {np.degrees(turn):z.1f}° in {looks.count} looks, where "
        f"odometry is expected to be off by at most {most_shift:z.2f} m and {np.degrees(most_turn):z.1f}°: look "
        "whether map and odometry are right, and start a new map (keep = false), or say how far odometry is off "
        "(pose_shift, pose_turn)"
    )
