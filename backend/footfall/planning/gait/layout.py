"""Where a gait puts its feet: each as near to its ideal footfall as the ground and its leg allow.

Height of the chassis and tread are those at which the legs have most to spare on this ground, over all that their feet
stand; of such as leave enough room, the ones nearest to the rover at ease.
"""

from dataclasses import dataclass, replace

import numpy as np

from footfall.core.arrays import Array, Ints
from footfall.planning.gait.rhythm import Rhythm
from footfall.planning.gait.step import Lack
from footfall.planning.gait.stride_kernel import spares_of
from footfall.planning.walk.footfalls import standable
from footfall.planning.walk.footprint import Footprint
from footfall.planning.walk.guide import Guide
from footfall.planning.walk.legs_kernel import UNREACHED
from footfall.planning.walk.problem import Stance
from footfall.planning.walk.spans_kernel import poses_of
from footfall.planning.walk.transition_kernel import ROOM
from footfall.planning.walk.world import World
from footfall.robot.ik import wheel_pose_for_contact
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at, normal_at

HIGHER = np.array([0.0, -0.1, 0.1, -0.15, -0.2, -0.25, -0.3])
"""Heights of the chassis that are looked at, above that at ease [m]."""
WIDER = np.array([0.0, -0.05, 0.05, -0.1, -0.15, -0.2, -0.25])
"""How much farther out the feet are then [m]."""
AT_EASE = 0.0005
"""What a metre of these costs beside the squares of what legs have less than ROOM to spare."""
ENOUGH = 0.04
"""What a leg is to have to spare, so that it also lifts and lowers its wheel without turning fast [m or rad]."""
LOOKED_THROUGH = 60
"""Footfalls that height and tread are chosen for, about; they are spread over all there are."""
APART = 0.05
"""Between places that are looked at in place of an ideal footfall [m]."""
BEYOND = 0.4
"""How far beyond the tolerance they are, to tell how far the nearest place is [m]."""


@dataclass(frozen=True, eq=False)
class Layout:
    """Where feet are put, one row for each of the rhythm's: contacts, normals (m, 3), wheels (m, 4, 4) in site.

    Ts: (n + 1, 3, 4) the chassis before each foot move and after the last. spares: (m,) what the leg has to spare
    while its foot stands there [m or rad]. away: (m,) from the ideal footfall [m]; inf where no wheel can stand near.
    height: of the chassis above its feet, tread: of the feet from its middle, at ease [m].
    """

    contacts: Array
    normals: Array
    wheels: Array
    Ts: Array
    spares: Array
    away: Array
    height: float
    tread: float


def laid_out(world: World, dem: Dem, beat: Rhythm, way: Guide, ease: Footprint, tolerance: float) -> Layout:
    """The footfalls of a gait along a way.

    Args:
        world: rover, ground and settings of the walk.
        dem: the ground without holes, in site.
        beat: which legs move together, and when.
        way: of the chassis.
        ease: where feet are at ease, and how high the chassis is over them.
        tolerance: how far a footfall may be from its ideal place [m], see GaitSettings.

    Returns:
        Footfalls by row of the rhythm.

    Raises:
        ValueError: no footprint was looked at, which is a defect.
    """
    best: tuple[Array, Array, Array, Array, float, float] | None = None
    least = np.inf
    some = np.arange(0, len(beat.legs), 1 + len(beat.legs) // LOOKED_THROUGH)
    level = np.column_stack([np.interp(beat.ways, way.ways, column) for column in way.vectors.T])
    for wider in WIDER:
        out = ease.feet * (1.0 + wider / np.hypot(ease.feet[:, 0], ease.feet[:, 1]))[:, None]
        contacts, normals, wheels = _on_ground(world, dem, beat, way, out)
        for higher in HIGHER if world.settings.height is None else (0.0,):
            Ts = _poses(level, higher)
            spares = _spares(world, beat, Ts, wheels[some], some)
            short = np.clip(ROOM - spares, 0.0, UNREACHED)
            costs = float((short**2).mean()) + AT_EASE * (abs(higher) + abs(wider))
            if costs < least:
                tread = float(np.hypot(out[0, 0], out[0, 1]))
                least, height = costs, ease.height + float(higher)
                best = contacts, normals, wheels, Ts, height, tread
    if best is None:
        raise ValueError("no footprint was looked at")
    contacts, normals, wheels, Ts, height, tread = best
    spares = _spares(world, beat, Ts, wheels, np.arange(len(wheels)))
    ideal = Layout(contacts, normals, wheels, Ts, spares, np.zeros(len(wheels)), height, tread)
    return _adapted(world, dem, beat, way, ideal, tolerance)


def _poses(level: Array, higher: float) -> Array:
    """Chassis poses (n, 3, 4) so much higher than vectors (n, 6) [m]."""
    vectors = level.copy()
    vectors[:, 2] += higher
    Ts = np.empty((len(vectors), 3, 4))
    poses_of(vectors, Ts)
    return Ts


def _on_ground(world: World, dem: Dem, beat: Rhythm, way: Guide, feet: Array) -> tuple[Array, Array, Array]:
    """Contacts, normals and wheels on the ideal footfalls; NaN where the ground is unknown."""
    x, y, yaw = (np.interp(beat.ideal, way.ways, way.vectors[:, column]) for column in (0, 1, 5))
    c, s = np.cos(yaw), np.sin(yaw)
    out = feet[beat.legs]
    xy = np.column_stack([x + c * out[:, 0] - s * out[:, 1], y + s * out[:, 0] + c * out[:, 1]])
    contacts = np.column_stack([xy, height_at(dem, xy[:, 0], xy[:, 1])])
    normals = normal_at(dem, xy[:, 0], xy[:, 1], world.robot.wheel_radius)
    return contacts, normals, _wheels(world, beat, yaw, contacts, normals, np.arange(len(xy)))


def _wheels(world: World, beat: Rhythm, yaws: Array, contacts: Array, normals: Array, rows: Ints) -> Array:
    """T_site_wheel (k, 4, 4) of wheels that head outward from the chassis; rows: (k,) of the rhythm."""
    hips = world.legs.Ts_base_hip[beat.legs[rows]]
    headings = yaws + np.arctan2(hips[:, 1, 0], hips[:, 0, 0])
    return wheel_pose_for_contact(world.robot, contacts, normals, headings, np.eye(4))


def _spares(world: World, beat: Rhythm, Ts: Array, wheels: Array, rows: Ints) -> Array:
    """What legs have to spare (k,), −inf where the wheel's pose is unknown; rows: (k,) of the rhythm."""
    spares, three = np.empty(len(rows)), wheels[:, :3].copy()
    which, first, last = beat.legs[rows], beat.first[rows], beat.last[rows]
    spares_of(Ts, three, which, first, last, world.settings.lift, world.legs, spares)
    return np.where(np.isfinite(wheels).all(axis=(1, 2)), spares, -np.inf)


def _adapted(world: World, dem: Dem, beat: Rhythm, way: Guide, ideal: Layout, tolerance: float) -> Layout:
    """The same with every footfall that can't be stood on, or not all the time, moved to the nearest that can.

    Where none has enough to spare it is the one that has most; where no wheel can stand at all, ``away`` is inf.
    """
    good = np.zeros(len(ideal.contacts), bool)
    good[standable(world.robot, dem, ideal.contacts[:, :2], world.settings)[2]] = True
    bad = np.flatnonzero(~(good & (ideal.spares >= ENOUGH)))
    if not len(bad):
        return ideal
    beside = _beside(tolerance)
    xy = (ideal.contacts[bad, None, :2] + beside).reshape(-1, 2)
    contacts, normals, chosen = standable(world.robot, dem, xy, world.settings)
    rows, away = bad[chosen // len(beside)], np.hypot(*beside[chosen % len(beside)].T)
    yaws = np.interp(beat.ideal[rows], way.ways, way.vectors[:, 5])
    wheels = _wheels(world, beat, yaws, contacts, normals, rows)
    spares = _spares(world, beat, ideal.Ts, wheels, rows)
    new = replace(ideal, **{name: getattr(ideal, name).copy() for name in ("contacts", "normals", "wheels", "spares")})
    farther = np.zeros(len(ideal.contacts))
    for row in bad:
        own = np.flatnonzero(rows == row)
        near = own[away[own] <= tolerance + 1e-9]
        if not len(near):
            farther[row] = away[own].min() if len(own) else np.inf
            continue
        at = near[np.lexsort((away[near], -np.minimum(spares[near], ENOUGH)))[0]]
        new.contacts[row], new.normals[row], new.wheels[row] = contacts[at], normals[at], wheels[at]
        new.spares[row], farther[row] = spares[at], away[at]
    return replace(new, away=farther)


def _beside(tolerance: float) -> Array:
    """Places (k, 2) around an ideal footfall, itself the first."""
    far = tolerance + BEYOND
    count = int(np.ceil(far / APART))
    steps = np.asarray(APART * np.arange(-count, count + 1), np.float64)
    places = np.column_stack([one.ravel() for one in np.meshgrid(steps, steps)])
    away = np.hypot(places[:, 0], places[:, 1])
    order = np.argsort(away, kind="stable")
    near = order[away[order] <= far + 1e-9]
    return np.asarray(places[near], np.float64)


def placed(stance: Stance, beat: Rhythm, layout: Layout, rows: range, tolerance: float) -> Stance | Lack:
    """The stance with feet put where rows of a layout have them.

    Args:
        stance: before.
        beat: which legs move together, and when.
        layout: footfalls of the gait.
        rows: those that are gone.
        tolerance: how far a footfall may be from its ideal place [m].

    Returns:
        The stance after them, or for which leg there is no place to stand within the tolerance.
    """
    after = {name: getattr(stance, name).copy() for name in ("contacts", "normals", "Ts_site_wheel", "branches")}
    for row in rows:
        leg = int(beat.legs[row])
        if layout.away[row] > tolerance + 1e-9:
            return Lack("footfall: no place to stand within the tolerance", leg, layout.away[row] - tolerance, "m")
        after["contacts"][leg], after["normals"][leg] = layout.contacts[row], layout.normals[row]
        after["Ts_site_wheel"][leg], after["branches"][leg] = layout.wheels[row], 0
    return Stance(**after)
