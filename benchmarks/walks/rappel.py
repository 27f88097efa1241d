"""Where a rover hangs on a tether over a generated slope, and where it is to go."""

import math

import numpy as np

from benchmarks.scenes import robot
from benchmarks.walks.terrains import FAMILIES, start_of
from footfall.balance.tether import Tether
from footfall.core.arrays import Array
from footfall.planning.walk.footprint import footprint
from footfall.planning.walk.slope_frame import SlopeFrame
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

ABOVE, HIGH = 4.0, 1.2
"""How far the anchor is up the slope from the rover, and above it along its normal: the top of a post [m]."""
TURNED = math.radians(30.0)
"""Between fall line and heading: the tether leaves between two legs [rad]."""
ATTACHMENT = np.array([-1.05, 0.615, -0.1])
"""The middle of the chassis' edge between two legs, on the side of the anchor [m]."""


def hanging(dem: Dem, family: str, metres: float) -> tuple[Tether, tuple[float, float], tuple[float, float], float]:
    """The tether, x and y of the start and of the goal so many metres down the slope, and the heading in site [rad]."""
    incline = FAMILIES[family].incline
    frame, height, first = SlopeFrame(incline, 0.0, dem), footprint(robot()).height, start_of(metres)[0]
    anchor = _over(frame, first - ABOVE, HIGH)
    begin, end = (_over(frame, along, height) for along in (first, first + metres))
    yaw = math.atan2(math.sin(TURNED), math.cos(incline) * math.cos(TURNED))
    return Tether(anchor, ATTACHMENT), (begin[0], begin[1]), (end[0], end[1]), yaw


def _over(frame: SlopeFrame, along: float, above: float) -> Array:
    """A point (3,) in site, so far along the mean slope and above its ground along the normal [m]."""
    return frame.to_site(np.array([along, 0.0, float(height_at(frame.ground, along, 0.0)) + above]))
