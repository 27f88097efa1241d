"""The foot moves before the first step of a gait: feet go one by one to where the gait has them, as in a walk."""

from dataclasses import dataclass

import numpy as np

from footfall.planning.gait.layout import ENOUGH, Layout, placed
from footfall.planning.gait.rhythm import Rhythm
from footfall.planning.gait.step import Lack
from footfall.planning.gait.stride_kernel import spares_of
from footfall.planning.walk.body_way import At
from footfall.planning.walk.foot_move import Moved, foot_move
from footfall.planning.walk.transition_kernel import vector_of
from footfall.planning.walk.world import World

SEED = 0
"""Of the search of chassis poses for these foot moves."""
TRIES = 3
"""That each foot has before none can be moved: the search has some chance in it."""


@dataclass(frozen=True, eq=False)
class SettledFeet:
    """The foot moves that were made; lack: why no more were, with the leg of the next."""

    moves: list[Moved]
    leg: tuple[int, ...] = ()
    lack: Lack | None = None


def settled(world: World, start: At, beat: Rhythm, layout: Layout, tolerance: float) -> SettledFeet:
    """Leave feet where they are that can stay as long as the gait wants, and move the others first.

    Feet can stay that are within the tolerance of where the gait has them.

    Args:
        world: rover, ground and settings of the walk.
        start: where the rover is.
        beat: which legs move together, and when.
        layout: footfalls of the gait.
        tolerance: how far a foot may be from its ideal place [m].

    Returns:
        The foot moves that were made, and why no more were.
    """
    left = [row for row in beat.begins if not _stays(world, start, beat, layout, row, tolerance)]
    rng, aim, at = np.random.default_rng(SEED), vector_of(layout.Ts[0]), start
    moves: list[Moved] = []
    while left:
        lack: tuple[tuple[int, ...], Lack] | None = None
        for row in TRIES * left:
            leg = int(beat.legs[row])
            to = placed(at.stance, beat, layout, range(row, row + 1), tolerance)
            moved = to if isinstance(to, Lack) else foot_move(world, at, leg, to, aim, rng)
            if isinstance(moved, Moved):
                moves.append(moved)
                left.remove(row)
                at = moved.to
                break
            unit = moved.unit if isinstance(moved, Lack) else "m or rad"
            lack = lack or ((leg,), Lack(moved.check, moved.leg, moved.lacks, unit))
        else:
            return SettledFeet(moves, *(lack or ((), None)))
    return SettledFeet(moves)


def _stays(world: World, start: At, beat: Rhythm, layout: Layout, row: int, tolerance: float) -> bool:
    """Whether the foot of a row may stand where it does until it is moved in the gait."""
    leg, spares = int(beat.legs[row]), np.empty(1)
    off = np.hypot(*(start.stance.contacts[leg] - layout.contacts[row])[:2])
    if off > tolerance or start.stance.branches[leg] != 0:
        return False
    wheel = start.stance.Ts_site_wheel[leg : leg + 1, :3].copy()
    own = slice(row, row + 1)
    lift = world.settings.lift
    spares_of(layout.Ts, wheel, beat.legs[own], beat.first[own], beat.last[own], lift, world.legs, spares)
    return bool(spares[0] >= ENOUGH)
