"""How much energy it takes to tip a standing rover over: the energy stability margin.

The rover, stiff, is turned about an edge of its support polygon until its centre of mass is highest, straight above
that edge; the energy is its weight times that rise. On a slope the edges downhill take less. Friction is taken to hold.

References:
----------
D. A. Messuri, C. A. Klein, "Automatic body regulation for maintaining stability of a legged vehicle during
rough-terrain locomotion", IEEE Journal of Robotics and Automation 1, 1985.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from footfall.balance.balance_settings import GRAVITY
from footfall.balance.forces import require_masses
from footfall.balance.support import edges
from footfall.core.arrays import Array


@dataclass(frozen=True)
class TipOver:
    """energy [J]: least that tips the rover over, 0 where it tips by itself. rise: of its centre of mass [m].

    feet: the rows of the two feet about which it would tip, None where there is no support polygon; edge: (2, 3), where
    they are [m]. reason: why the energy is 0; else empty.
    """

    energy: float
    rise: float
    feet: tuple[int, int] | None
    edge: Array | None
    reason: str


def tip_over(contacts: ArrayLike, com: ArrayLike, mass: float, gravity: float = GRAVITY) -> TipOver:
    """The least energy over the edges of the support polygon that tips the rover.

    Args:
        contacts: (k, 3) [m], z against gravity.
        com: centre of mass (3,) [m].
        mass: of the rover [kg].
        gravity: [m/s²].

    Returns:
        That energy [J], and the edge.

    Raises:
        InvalidInput: shapes don't fit, or numbers are not finite or not positive.
    """
    points, center = require_masses(contacts, com, mass, gravity)
    found = edges(points, conservative=False)
    if len(found.offsets) == 0:
        return TipOver(0.0, 0.0, None, None, f"{len(points)} feet, of which no three span an area")
    begin, end = points[found.start], points[found.end]
    axis = (end - begin) / np.linalg.norm(end - begin, axis=1, keepdims=True)
    arm = center - begin
    arm = arm - np.einsum("ij,ij->i", arm, axis)[:, None] * axis
    # the highest point of the circle about a tilted axis lies |arm| · cos(tilt) above the axis
    rises = np.linalg.norm(arm, axis=1) * np.hypot(axis[:, 0], axis[:, 1]) - arm[:, 2]
    spare = found.offsets - found.normals @ center[:2]
    rises = np.where(spare > 0, np.maximum(rises, 0.0), 0.0)
    # where it tips by itself, it does so over the edge that it is farthest beyond
    at = int(np.argmin(rises)) if spare.min() > 0 else int(np.argmin(spare))
    feet = int(found.start[at]), int(found.end[at])
    reason = "" if spare.min() > 0 else "the centre of mass is not above the support polygon"
    rise = float(rises[at])
    return TipOver(mass * gravity * rise, rise, feet, points[list(feet)], reason)
