"""Where commands lead a rover that sags: its rest at samples of every row, from how it stood when the first began.

The prediction is that of :mod:`footfall.planning.compliance.predict`: set points go in straight lines, joints and
wheels give way. A LEG_LOWER ends as the rover ends it, where the force on its wheel has risen enough.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidSequence
from footfall.core.frames import apply
from footfall.maps.standing import contacts
from footfall.planning.answers import No
from footfall.planning.compliance.compliant_rover import CompliantRover, RestingRover
from footfall.planning.compliance.from_telemetry import measured
from footfall.planning.compliance.predict import STRIDE, advanced
from footfall.planning.execution.course import FALL
from footfall.planning.scene.ground import Nearby, nearby, touch_radius
from footfall.robot.kinematics import wheel_centers
from footfall.robot.limits import room_to_limits
from footfall.robot.model import Robot
from footfall.sequence.commands import AtRest, Command
from footfall.sequence.predict import after, target
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.terrain.dem import Dem

BASELINE = 4.0
"""The rover compares the force on a wheel that it lowers with the least one of so many seconds before."""


@dataclass(frozen=True, eq=False)
class YieldingRow:
    """rests: before the row, at samples of it, and after it, two or more where it moves anything.

    reason: why it is not predicted to its end, else empty; ``rests`` then ends before that.
    """

    rests: tuple[RestingRover, ...]
    reason: str = ""


@dataclass(frozen=True, eq=False)
class Yielding:
    """rows: one for each command, up to the first that is not predicted to its end.

    postures: (commands, legs × 6) [rad] after each command; Ts_site_base: (commands, 4, 4). Where nothing is predicted
    any more they stay as they were. commanded: set points, (commands, legs × 6) [rad], there those that are asked for.
    """

    rover: CompliantRover
    ground: Nearby | No
    rows: tuple[YieldingRow, ...]
    postures: Array
    Ts_site_base: Array
    commanded: Array


def follow(
    robot: Robot,
    at_rest: AtRest,
    commands: tuple[Command, ...],
    dem: Dem,
    settings: SequenceSettings,
    fitted: bool = True,
) -> Yielding:
    """How a rover that stands as ``at_rest`` says goes through commands.

    fitted: whether how it stands says how stiff its joints are; else they are as the settings say.
    Raises InvalidInput where it is of another robot, or where fewer than three of its wheels are pressed down.
    """
    state = at_rest.state
    feet = contacts(robot, dem, state.posture, state.T_site_base, list(robot.legs)).points
    # the chassis goes no farther than its legs reach
    ground = nearby(dem, state.T_site_base[:2, 3], 2 * touch_radius(robot), feet)
    whole, unseen = (dem, None) if isinstance(ground, No) else (ground.dem, ground.filled)
    rover = CompliantRover(robot, whole, settings.compliance, unseen)
    rest = measured(rover, state, at_rest.set_points, fitted)
    rows: list[YieldingRow] = []
    ends: list[RestingRover] = []
    set_points: list[Array] = []
    for command in commands:
        if not (rows and rows[-1].reason):
            rows.append(_row(rover, rest, command))
            rest = rows[-1].rests[-1]
        reached = after(set_points[-1] if set_points else rest.commanded, command)
        set_points.append(reached if rows[-1].reason else rest.commanded)
        ends.append(rest)
    n = len(at_rest.set_points)
    return Yielding(
        rover=rover,
        ground=ground,
        rows=tuple(rows),
        postures=np.array([one.posture for one in ends]).reshape(-1, n),
        Ts_site_base=np.array([one.T_site_base for one in ends]).reshape(-1, 4, 4),
        commanded=np.array(set_points).reshape(-1, n),
    )


def require_terrain(dem: Dem | None) -> Dem:
    """Raises InvalidSequence where there is none."""
    if dem is None:
        raise InvalidSequence("how a rover sags depends on the ground under its wheels: give the terrain")
    return dem


def _row(rover: CompliantRover, rest: RestingRover, command: Command) -> YieldingRow:
    robot = rover.robot
    moved = target(command, robot.leg_count)
    if moved is None:
        return YieldingRow((rest,))
    origin, asked = rest.commanded, after(rest.commanded, command)
    own, joints = moved
    if not (room_to_limits(robot, joints, own) >= 0).all():
        return YieldingRow((rest,), "set points beyond the limits of the joints are not followed")
    lowering = command.kind.ends_by_force and command.leg is not None and command.force is not None
    count = max(1, int(np.ceil(np.abs(asked - origin).max() / STRIDE)))
    if lowering:
        ends = [apply(rest.T_site_base, wheel_centers(robot, q)[command.leg])[2] for q in (origin, asked)]
        count = max(2, int(np.ceil((ends[0] - ends[1]) / FALL)))
    rests = [rest]
    for part in range(1, count + 1):
        here = advanced(rover, rests[-1], asked if part == count else origin + part / count * (asked - origin))
        if not here.settled:
            share = (part - 1) / count
            return YieldingRow(
                tuple(rests),
                f"from {share:.0%} of the row on nothing holds the rover: it would tip over, slide or sit down",
            )
        rests.append(here)
        if lowering and _touched(rests, command, count):
            break
    return YieldingRow(tuple(rests))


def _touched(rests: Sequence[RestingRover], command: Command, count: int) -> bool:
    """Whether the force along the site's up has risen by what ends a LEG_LOWER, of ``count`` samples on all its way."""
    seconds = command.duration / count if np.isfinite(command.duration) else 0.0
    times = np.arange(len(rests)) * seconds
    forces = np.array([one.forces[command.leg, 2] for one in rests])
    since = times[-1] - BASELINE
    baseline = min(forces[times >= since].min(), np.interp(since, times, forces)) if seconds > 0 else forces.min()
    return command.force is not None and bool(forces[-1] - baseline >= command.force)
