"""Which footfalls each leg reaches, and from which part of the guide."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from footfall.core.arrays import Array
from footfall.planning.walk.footfalls import Footfalls, barred_to
from footfall.planning.walk.guide import Guide
from footfall.planning.walk.problem import Stance, WalkSettings
from footfall.planning.walk.spans_kernel import Reaching, Spans, poses_of, spans
from footfall.planning.walk.world import World
from footfall.robot.ik import wheel_pose_for_contact

HEADING = math.radians(15.0)
"""Wheels head in whole multiples of this [rad]."""
LEAST = -0.02
"""What a leg may lack with the chassis on the guide: where it stands in the end is found by a search [m, rad]."""
WINDS = math.pi / 2
"""A guide around something is so much longer than the chord between its places that a leg reaches both from."""


@dataclass(frozen=True, eq=False)
class FootfallReach:
    """Of one leg and m footfalls: Ts_site_wheel (m, 4, 4), its wheel on each; low, high: (m,) the span [m].

    low is inf and high −inf where the leg never reaches it. best: (m,) most that it has to spare [m, rad].
    """

    Ts_site_wheel: Array
    low: Array
    high: Array
    best: Array


def reaches(world: World, way: Guide, places: Footfalls) -> tuple[FootfallReach, ...]:
    """Of every leg and all places; its wheel heads outward from the chassis beside the place."""
    yaws = way.vectors[_beside(way, places.contacts[:, :2]), 5]
    found = []
    for leg, spec in enumerate(world.robot.description.legs):
        headings = HEADING * np.rint((yaws + math.atan2(spec.T_base_hip[1, 0], spec.T_base_hip[0, 0])) / HEADING)
        wheels = wheel_pose_for_contact(world.robot, places.contacts, places.normals, headings, np.eye(4))
        found.append(_reach(world, way, leg, wheels, np.zeros(len(wheels), np.int64)))
    return tuple(found)


def steps_onto(
    leg: int, reach: FootfallReach, places: Footfalls, foot: Array, settings: WalkSettings
) -> NDArray[np.int64]:
    """Numbers of the footfalls that a leg may ever stand on.

    It reaches them, they are not barred to it, and its foot comes there by moves that are not too long.

    Args:
        leg: number of the leg, from 0.
        reach: from where on the way the leg reaches each footfall.
        places: the footfalls.
        foot: where its foot stands, (2,) in site [m].
        settings: how long a move may be, what is forbidden, and what is pinned for which leg.

    Returns:
        (k,).
    """
    xy = places.contacts[:, :2]
    rows = np.flatnonzero(np.isfinite(reach.low) & ~barred_to(leg, places, settings))
    return rows[come_to(xy[rows], foot, settings.longest)]


def come_to(xy: Array, begin: Array, longest: float) -> NDArray[np.bool_]:
    """Which places a foot comes to by moves that are not too long.

    Args:
        xy: places (n, 2) in site [m].
        begin: where it stands, (2,) in site [m].
        longest: a move is at most so long [m].

    Returns:
        (n,).
    """
    came = np.zeros(len(xy), bool)
    newest = begin[None]
    while len(newest) and not came.all():
        left = np.flatnonzero(~came)
        away = np.asarray(KDTree(newest).query(xy[left])[0])
        left = left[away <= longest]
        came[left] = True
        newest = xy[left]
    return came


def _beside(way: Guide, xy: Array) -> NDArray[np.int64]:
    """Which pose of the guide is nearest to places (n, 2)."""
    return np.asarray(KDTree(way.vectors[:, :2]).query(xy)[1], np.int64)


def reach_of(world: World, way: Guide, stance: Stance) -> tuple[Array, Array]:
    """Low and high of the spans (legs,) from which each leg reaches where it stands at the guide's beginning [m]."""
    found = [
        _reach(world, way, leg, stance.Ts_site_wheel[leg : leg + 1], stance.branches[leg : leg + 1])
        for leg in world.robot.legs
    ]
    # where the guide begins it does stand there, with the chassis somewhere else
    high = [one.high[0] if one.low[0] == 0.0 else 0.0 for one in found]
    return np.zeros(len(found)), np.array(high)


def _reach(world: World, way: Guide, leg: int, Ts_site_wheel: Array, branches: NDArray[np.int64]) -> FootfallReach:
    settings: WalkSettings = world.settings
    Ts = np.empty((len(way.ways), 3, 4))
    poses_of(way.vectors, Ts)
    count = len(Ts_site_wheel)
    first, last, best = np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count)
    wheels = Ts_site_wheel[:, :3].copy()
    far, rover, poses = world.robot.leg_length(leg), world.first.checks.rover, len(way.ways)
    beside = _beside(way, wheels[:, :2, 3])
    hip = float(np.hypot(*world.legs.Ts_base_hip[leg, :2, 3]))
    steps = np.hypot(*np.diff(way.vectors[:, :2], axis=0).T)
    near = poses if steps.max() < 1e-6 else int(WINDS * (far + hip) / float(steps.mean())) + 2
    asked = Reaching(settings.lift, LEAST, far, beside, near)
    spans(Ts, wheels, np.array(branches), leg, asked, world.legs, rover, Spans(first, last, best))
    reached = last >= 0
    low = np.where(reached, way.ways[np.minimum(first, len(way.ways) - 1)], np.inf)
    high = np.where(reached, way.ways[np.maximum(last, 0)], -np.inf)
    return FootfallReach(np.array(Ts_site_wheel), low, high, best)
