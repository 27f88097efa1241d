"""Where commands bring a robot that others described: feet that stand carry the chassis, a leg moves its own foot.

A foot rolls on the ground where it was put, as in the planner. A robot of which it is known how its joints give way
sags: its commands are set points. Any other is taken as rigid.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.planning.legged.footing import FEET_OFF, rest
from footfall.planning.legged.rolling import ROUNDS, Stood, foot_turns, rested, ways_rolled
from footfall.planning.legged.sagging import SprungRest, gives_way_to
from footfall.planning.legged.whole_check import Feet
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall.sequence.commands import AtRest, Command
from footfall.sequence.passage import fitted
from footfall.sequence.predict import FARTHEST
from footfall.terrain.dem import Dem

FEWEST_FEET = 3
"""Fewer don't say where the chassis is."""


@dataclass(frozen=True)
class LeggedPassage:
    """One row. before, after: postures (joints,); T_before, T_after: T_site_base (4, 4).

    set_points: (joints,) when it begins; asked: when it ends; of a rigid robot they are the postures. stood: (legs, 3)
    soles' centres in site where they stand when it begins; NaN for legs in the air. feet: those that stand through it,
    with contacts and normals of the ground. fell: whether nothing holds the robot any more; it is left as before.
    forces: of the ground on the feet when it ends, (legs, 3) in site [N]; None of a rigid robot.
    """

    set_points: Array
    asked: Array
    before: Array
    after: Array
    T_before: Array
    T_after: Array
    stood: Array
    feet: Feet
    fell: bool = False
    forces: Array | None = None


def asked_for(robot: LeggedRobot, posture: Array, command: Command) -> Array:
    """The posture that a command asks for.

    Args:
        robot: the robot.
        posture: before, (joints,) [rad or m].
        command: of one leg, or of all.

    Returns:
        (joints,) [rad or m]; unchanged where it moves nothing or is not well formed.
    """
    own = robot.layout.moved(command.kind, command.leg)
    joints = command.joints
    if joints is None or len(joints) != own.stop - own.start or not np.isfinite(joints).all():
        return posture
    asked = posture.copy()
    asked[own] = joints
    return asked


def legged_passages(
    robot: LeggedRobot,
    start: Array,
    T_site_base: Array,
    commands: tuple[Command, ...],
    dem: Dem,
    at_rest: AtRest | None = None,
) -> list[LeggedPassage]:
    """How each row goes.

    Args:
        robot: the robot.
        start: posture before the first, (joints,) [rad or m].
        T_site_base: pose of the chassis before the first, (4, 4).
        commands: the rows.
        dem: the ground, in site.
        at_rest: how it stands before the first, where it sags; None: it is rigid.

    Returns:
        One for each row; a robot that sags stays where it is in one that goes farther than FARTHEST.
    """
    rows: list[LeggedPassage] = []
    posture, T = np.asarray(start, float), np.asarray(T_site_base, float)
    stood = Stood(*(np.full((len(robot.legs), 3), np.nan) for _ in range(3)))
    set_points = posture if at_rest is None else at_rest.set_points
    sprung = None if at_rest is None else SprungRest(set_points, posture, T, at_rest.state.wheel_forces)

    def put_down(legs: list[int]) -> None:
        for leg, foot in zip(legs, landed(robot, dem, posture, T, legs), strict=True):
            for part, place in zip(stood, foot, strict=True):
                part[leg] = place

    put_down(list(robot.legs))
    for command in commands:
        asked = asked_for(robot, set_points, command)
        down = [leg for leg in robot.legs if np.isfinite(stood.soles[leg]).all() and leg != command.leg]
        feet = Feet(tuple(down), stood.contacts.copy(), stood.normals.copy())
        began, after, T_after, fell = stood.soles.copy(), asked, T, False
        if sprung is not None and np.abs(asked - sprung.set_points).max() > FARTHEST:
            after = posture  # springs are followed in small steps, which would have no end
        elif sprung is not None:
            found = None if rows and rows[-1].fell else gives_way_to(robot, dem, asked, sprung, stood, down)
            fell = found is None
            if found is not None:
                sprung, stood = found
            after, T_after = sprung.q, sprung.T_site_base
        elif command.kind.moves_all:
            T_after, stood = carried(robot, dem, (posture, T), after, stood, down)
        forces = None if sprung is None else sprung.forces
        rows.append(LeggedPassage(set_points, asked, posture, after, T, T_after, began, feet, fell, forces))
        set_points, posture, T = asked, after, T_after
        put_down([leg for leg in robot.legs if leg == command.leg or (command.kind.moves_all and leg not in down)])
    return rows


def landed(
    robot: LeggedRobot, dem: Dem, posture: Array, T_site_base: Array, legs: Sequence[int]
) -> list[tuple[Array, Array, Array]]:
    """Whether feet stand on the ground as the robot is.

    Args:
        robot: the robot.
        dem: the ground, in site.
        posture: now, (joints,) [rad or m].
        T_site_base: pose of the chassis, (4, 4).
        legs: numbers of the legs that are asked about.

    Returns:
        For each leg the centre of its sole, NaN where that is farther than FEET_OFF from the ground; contact and normal
        of the ground under it; (3,) each, in site [m].
    """
    soles = apply(T_site_base, placed(robot, posture).soles)
    found: list[tuple[Array, Array, Array]] = []
    for leg in legs:
        x, y, z = (float(part) for part in soles[leg])
        down = rest(dem, x, y, float(robot.radii[leg]))
        stands = abs(z - down.center[2]) <= FEET_OFF
        found.append((soles[leg] if stands else np.full(3, np.nan), down.contact, down.normal))
    return found


def carried(
    robot: LeggedRobot, dem: Dem, before: tuple[Array, Array], posture: Array, stood: Stood, down: Sequence[int]
) -> tuple[Array, Stood]:
    """Where feet that stand, and roll, carry the chassis while all legs move together.

    Args:
        robot: the robot.
        dem: the ground, in site.
        before: posture (joints,) [rad or m] and T_site_base (4, 4) a little earlier.
        posture: now, (joints,) [rad or m].
        stood: where the feet stood a little earlier.
        down: numbers of the legs that stand.

    Returns:
        T_site_base (4, 4) that leaves the soles nearest to where they rolled to, and where they stand then; as before
        where fewer than three stand.
    """
    q, T = before
    if len(down) < FEWEST_FEET:
        return T, stood
    there = placed(robot, posture)
    T_now = fitted(there.soles, stood.soles, down)[0]
    if not robot.rolls:
        return T_now, stood
    turns, soles = foot_turns(robot, placed(robot, q), T), stood.soles
    for _ in range(ROUNDS):
        soles = stood.soles + ways_rolled(robot, stood.normals, turns, foot_turns(robot, there, T_now))
        T_now = fitted(there.soles, soles, down)[0]
    now = rested(robot, dem, stood, soles, down)
    standing = [leg for leg in down if np.isfinite(now.soles[leg]).all()]
    return (fitted(there.soles, now.soles, standing)[0] if len(standing) >= FEWEST_FEET else T_now), now
