"""What it costs the chassis to be over a place, a metre of the way: 1 where walking is easy, more where it is not.

It tells from the footfalls near the feet of a rover at ease, what they cost, the plane through them, and the ground
under the belly.
It is an estimate, for guides; only ``may_stand`` is sure, and of the "no" alone.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt
from scipy.spatial import KDTree

from footfall.core.arrays import Array
from footfall.planning.walk.footfalls import Footfalls
from footfall.planning.walk.footprint import FOLLOWS_SLOPE, Footprint
from footfall.planning.walk.guide import spread
from footfall.robot.meshes.bvh import robot_meshes
from footfall.robot.model import Robot
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

CHOICE = 6
"""Places that a leg should have to choose from near where its foot would be."""
NEAR, NOWHERE = 1.6, 1.2
"""All of them within so many of their spacings is as good as there; farther than the other [m] as good as none."""
LACKING = 8.0
"""Cost of each metre that the farthest of them is farther than NEAR, for each leg."""
GENTLE, SLOPE = math.tan(math.radians(25.0)), 8.0
"""Tangent of a slope that costs nothing, and what each one above it costs."""
EVEN, UNEVEN = 0.3, 12.0
"""How far a foot may be off the plane through all and cost nothing [m], and what each metre above it costs."""
BELLY, BELLY_HIGH = 0.15, 40.0
"""Room under the belly that costs nothing [m], and what each metre less costs."""
TALL, BESIDE_FEET = 0.6, 0.3
"""Ground so far above the plane through the feet is in the legs' way, as far beyond the feet as the other [m]."""
TALL_COSTS = 4.0
"""What each metre above TALL costs, at most NOWHERE."""
HEADINGS = 24
"""Headings that are tried of a chassis that may face any way."""
LEANS = 0.25
"""How far a hip gets aside as the chassis leans [m]."""
_UNDER = 48


@dataclass(frozen=True, eq=False)
class TravelCost:
    """What it costs to travel from one place to another over footfalls.

    contacts: (n, 3) where feet may be put, about ``spacing`` apart [m], and costs: (n,) of that, in foot moves; begin,
    end: (3,) x, y, yaw of the chassis. Its heading goes evenly from the one to the other beside the straight way
    between them.
    """

    robot: Robot
    dem: Dem
    contacts: Array
    costs: Array
    tree: KDTree
    spacing: float
    footprint: Footprint
    begin: Array
    end: Array

    def at(self, xy: Array) -> Array:
        """Costs (n,) of a metre at places (n, 2) of the chassis, at least 1."""
        feet = self._feet(xy)
        away, nearest = self.tree.query(feet, np.arange(1, CHOICE + 1))
        lacking = np.clip(away[..., -1] - NEAR * self.spacing, 0.0, NOWHERE).sum(axis=1)
        nearest = np.minimum(nearest, len(self.contacts) - 1)
        z = self.contacts[nearest[..., 0], 2]
        dx, dy = feet[..., 0] - xy[:, :1], feet[..., 1] - xy[:, 1:]
        middle, east, north = plane_of(dx, dy, z)
        off = np.abs(z - middle[:, None] - east[:, None] * dx - north[:, None] * dy).max(axis=1)
        base = np.asarray(robot_meshes(self.robot.description)["base"].vertices)
        belly = self.footprint.height + float(base[:, 2].min())
        under = float(np.hypot(base[:, 0], base[:, 1]).max())
        leans = FOLLOWS_SLOPE * east, FOLLOWS_SLOPE * north
        room = belly - self._above(xy, middle, *leans, under)
        out = float(np.hypot(*self.footprint.feet.T).max()) + BESIDE_FEET
        tall = np.clip(self._above(xy, middle, east, north, out) - TALL, 0.0, NOWHERE)
        steep = np.maximum(np.hypot(east, north) - GENTLE, 0.0)
        return (
            1.0
            + LACKING * lacking
            + SLOPE * steep
            + UNEVEN * np.maximum(off - EVEN, 0.0)
            + BELLY_HIGH * np.maximum(BELLY - room, 0.0)
            + TALL_COSTS * tall
            + self.costs[nearest].min(axis=2).mean(axis=1)
        )

    def may_stand(self, grid_xy: Array, spacing: float) -> NDArray[np.bool_]:
        """Where on a grid (rows, cols, 2) of this spacing [m] all legs may have a footfall, the chassis about there.

        False is sure of every chassis within half a cell, whichever way it faces: some leg, stretched straight, finds
        none.
        """
        legs = self.robot.description.legs
        hips = np.array([leg.T_base_hip[:2, 3] for leg in legs])
        reach = max(self.robot.leg_length(leg) for leg in self.robot.legs)
        pad = math.ceil((reach + float(np.hypot(*hips.T).max())) / spacing) + 2
        rows, cols = grid_xy.shape[:2]
        # where the grid begins and how far each place is from it in cells
        cells = np.rint((self.contacts[:, :2] - grid_xy[0, 0]) / spacing).astype(int) + pad
        inside = ((cells >= 0) & (cells < (cols + 2 * pad, rows + 2 * pad))).all(axis=1)
        empty = np.ones((rows + 2 * pad, cols + 2 * pad), bool)
        empty[cells[inside, 1], cells[inside, 0]] = False
        if empty.all():
            return np.zeros((rows, cols), bool)
        away = np.asarray(distance_transform_edt(empty)) * spacing
        # the place, the hip and the chassis are each up to half a cell's diagonal from the middle of theirs
        turned = float(np.hypot(*hips.T).max()) * math.pi / HEADINGS
        far = reach + 3.0 * math.sqrt(0.5) * spacing + turned + LEANS
        may = np.zeros((rows, cols), bool)
        for heading in range(HEADINGS):
            c, s = math.cos(2 * math.pi * heading / HEADINGS), math.sin(2 * math.pi * heading / HEADINGS)
            every = np.ones((rows, cols), bool)
            for x, y in np.rint(hips @ np.array([[c, s], [-s, c]]) / spacing).astype(int):
                every &= away[pad + y : pad + y + rows, pad + x : pad + x + cols] <= far
            may |= every
        return may

    def _feet(self, xy: Array) -> Array:
        """Where the feet (n, legs, 2) would be of rovers at ease."""
        along = self.end[:2] - self.begin[:2]
        share = np.clip((xy - self.begin[:2]) @ along / max(float(along @ along), 1e-9), 0.0, 1.0)
        turn = (self.end[2] - self.begin[2] + math.pi) % (2 * math.pi) - math.pi
        yaw = self.begin[2] + share * turn
        c, s = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
        x, y = self.footprint.feet.T
        return np.stack([xy[:, :1] + c * x - s * y, xy[:, 1:] + s * x + c * y], axis=-1)

    def _above(self, xy: Array, middle: Array, east: Array, north: Array, radius: float) -> Array:
        """How high the ground that is known goes above a plane with these slopes, within a radius, (n,) [m]."""
        dx, dy = spread(radius, _UNDER)
        ground = height_at(self.dem, xy[:, :1] + dx, xy[:, 1:] + dy)
        above = ground - middle[:, None] - east[:, None] * dx - north[:, None] * dy
        return np.where(np.isfinite(above), above, -np.inf).max(axis=1)


def travel_cost(
    robot: Robot,
    dem: Dem,
    places: Footfalls,
    spacing: float,
    standing: Array,
    footprint: Footprint,
    begin: Array,
    end: Array,
) -> TravelCost:
    """What it costs to travel over footfalls.

    Args:
        robot: the rover.
        dem: the ground with its holes, in site.
        places: where feet may be put.
        spacing: about how far they are apart [m].
        standing: contacts where the feet are, (legs, 3) in site [m]; they count as places too.
        footprint: where feet are at ease, and how high the chassis is over them.
        begin: x, y [m] and yaw [rad] of the chassis, (3,).
        end: the same at the end, (3,).

    Returns:
        What tells the cost of any place.
    """
    contacts = np.concatenate([places.contacts, standing])
    costs = np.concatenate([places.costs, np.zeros(len(standing))])
    return TravelCost(robot, dem, contacts, costs, KDTree(contacts[:, :2]), spacing, footprint, begin, end)


def plane_of(dx: Array, dy: Array, z: Array) -> tuple[Array, Array, Array]:
    """Least squares planes through places that are spread evenly around (0, 0).

    Args:
        dx: east of the middle, (k,) [m].
        dy: north of it, (k,) [m].
        z: heights, (n, k) [m].

    Returns:
        Height at (0, 0) and slopes along x and y, (n,) each.
    """
    middle = z.mean(axis=1)
    away = z - middle[:, None]
    return middle, (away * dx).sum(axis=1) / (dx**2).sum(axis=1), (away * dy).sum(axis=1) / (dy**2).sum(axis=1)
