"""Physics as the referee: a sequence is carried out by the rover in physics, and what came of it is judged."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.frames import inverse, pose_difference
from footfall.core.progress import Progress, no_progress
from footfall.robot.model import Robot
from footfall.sequence.commands import Sequence
from footfall.sequence.feet import feet
from footfall.sequence.moved_legs import moved_legs
from footfall.sim.physics.physics_settings import TIME_STEP
from footfall.sim.physics.rover import PhysicalRover
from footfall.sim.physics.run_observer import RunObserver
from footfall.sim.physics.verdict import RefereeReport, RefereeSettings, failures
from footfall.telemetry.link import AckMessage, CommandMessage
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

IN_AIR = ("lift", "swing")
"""Phases of a step in which its leg is to leave the ground and to be off it."""


def referee(
    robot: Robot,
    sequence: Sequence,
    dem: Dem,
    settings: RefereeSettings | None = None,
    *,
    goals: Mapping[int, ArrayLike] | None = None,
    poses: ArrayLike | None = None,
    rover: PhysicalRover | None = None,
    progress: Progress = no_progress,
) -> RefereeReport:
    """Carry a sequence out in physics, from a rover at rest in the posture that it starts from.

    rover: the one that carries it out, from how it stands now, with the strain in its legs; it is moved. None: one that
    is put down in the sequence's first posture.

    goals: leg → where its wheel is to come down, (2,) or (3,) site [m]; where they are not given, they are where its
    wheels would stand in the end by the posture and pose that the sequence predicts, unless it moves whole postures and
    does not say where the chassis goes. poses: (rows, 4, 4) T_site_base expected at the end of each row; None: as the
    sequence predicts it to move from where it stands before the first row, to nowhere where it predicts nothing.

    Raises InvalidInput where the parts don't fit together, or the rover does not stand where the sequence starts.
    """
    settings = settings or RefereeSettings()
    given = None if poses is None else np.asarray(poses, float)
    _require_fit(robot, sequence, settings, given, rover)
    if rover is None:
        rover = PhysicalRover(robot, dem, _start(sequence), settings.physics)
    aims = (
        _goals(robot, sequence, dem) if goals is None else {leg: np.asarray(goal, float) for leg, goal in goals.items()}
    )
    watch = RunObserver(rover, aims)
    moved = moved_legs(sequence)
    expected = _predicted(sequence, rover.T_site_base) if given is None else given
    done = _carry_out_all(rover, watch, sequence, moved, expected, progress)
    for _ in range(round(settings.rest / TIME_STEP)):
        rover.step(TIME_STEP)
        watch.look()
    in_air = {leg for leg, one in zip(moved, sequence.commands, strict=True) if leg is not None and one.phase in IN_AIR}
    report = RefereeReport(
        sequence=sequence.digest,
        settings=settings,
        failures=(),
        commands=len(done.ended) - bool(done.refused),
        ended=np.array(done.ended),
        postures=np.array(done.postures).reshape(-1, 6 * robot.leg_count),
        Ts_site_base=np.array(done.Ts_site_base).reshape(-1, 4, 4),
        settled=rover.settled.moved,
        events=tuple(watch.events),
        contacts=tuple(watch.contacts),
        touch=_touch(robot, watch, aims),
        clearance=float(watch.clearance),
        slip=watch.slip,
        drag=watch.drag,
        chassis=np.array(done.chassis),
        sag=np.array(done.sag),
        torque=watch.torque,
        tipped=rover.fault,
        least_load=watch.least_load,
    )
    return replace(report, failures=failures(report, sorted(in_air), done.refused))


def _require_fit(
    robot: Robot, sequence: Sequence, settings: RefereeSettings, poses: Array | None, rover: PhysicalRover | None
) -> None:
    if sequence.robot != robot.name:
        raise InvalidInput(f"the sequence is for {sequence.robot}, the robot is {robot.name}")
    if poses is not None and poses.shape != (len(sequence.commands), 4, 4):
        raise InvalidInput("poses needs one 4 × 4 transform for each command", shape=list(poses.shape))
    if rover is not None and (rover.robot.digest != robot.digest or rover.settings != settings.physics):
        raise InvalidInput("the rover that carries a sequence out needs the robot and the physics of the referee")


def _start(sequence: Sequence) -> RobotState:
    """The state that a sequence begins in; what the joints bear there is for physics to find."""
    if sequence.at_rest is not None:
        return sequence.at_rest.state
    legs = len(sequence.start) // 6
    return RobotState(
        robot=sequence.robot,
        time=0.0,
        posture=sequence.start,
        T_site_base=sequence.T_site_base,
        wheel_forces=np.zeros((legs, 3)),
        joint_torques=np.zeros(6 * legs),
        mode="idle",
    )


def _goals(robot: Robot, sequence: Sequence, dem: Dem) -> dict[int, Array]:
    """Where the moved wheels touch when the sequence has done what it predicts; none where it does not say where the
    chassis goes."""
    whole = any(command.kind.moves_all for command in sequence.commands)
    if not sequence.commands or (whole and sequence.Ts_site_base is None):
        return {}
    legs = {leg for leg in moved_legs(sequence) if leg is not None}
    points = feet(robot, dem, sequence.predicted[-1], sequence.poses[-1]).points
    return {leg: points[leg] for leg in sorted(legs)}


def _predicted(sequence: Sequence, T_site_base: Array) -> Array | None:
    """Where the sequence has the chassis after each row, (rows, 4, 4), from where it stands; None: it does not say."""
    if sequence.Ts_site_base is None:
        return None
    return T_site_base @ inverse(sequence.T_site_base) @ sequence.Ts_site_base


@dataclass
class _CarriedOut:
    """What came of the rows that were begun, one entry for each.

    ended: when it was done [s]. chassis: how far that was from its way, at most [m]. sag: how much too low it stood
    then [m]. postures, Ts_site_base: how the rover stood then. refused: why the last one was not done, else "".
    """

    ended: list[float] = field(default_factory=list)
    chassis: list[float] = field(default_factory=list)
    sag: list[float] = field(default_factory=list)
    postures: list[Array] = field(default_factory=list)
    Ts_site_base: list[Array] = field(default_factory=list)
    refused: str = ""


def _carry_out_all(
    rover: PhysicalRover,
    watch: RunObserver,
    sequence: Sequence,
    moved: list[int | None],
    expected: Array | None,
    progress: Progress,
) -> _CarriedOut:
    """One row after the other, up to the first that is refused. expected: T_site_base after each; None: it stays."""
    done, first = _CarriedOut(), rover.T_site_base
    for row, command in enumerate(sequence.commands):
        progress(row / len(sequence.commands), f"row {row + 1}")
        watch.row(row, moved[row], command.phase == "swing")
        begin, end = (first, first) if expected is None else (expected[row - 1] if row else first, expected[row])
        last, far = _carry_out(rover, watch, _message(sequence, row), begin, end)
        done.chassis.append(far)
        done.sag.append(end[2, 3] - rover.T_site_base[2, 3])
        done.ended.append(watch.now)
        done.postures.append(rover.posture)
        done.Ts_site_base.append(rover.T_site_base)
        if last.state != "done":
            done.refused = f"row {row + 1} was not carried out: {last.reason}"
            break
    return done


def _message(sequence: Sequence, row: int) -> CommandMessage:
    one = sequence.commands[row]
    return CommandMessage(
        # one rover may carry out several sequences, and does what an id says once
        id=f"{sequence.digest} {row}",
        sequence=sequence.digest,
        row=row,
        name=one.name,
        leg=one.leg,
        joints=one.joints,
        duration=one.duration,
        force=one.force,
    )


def _carry_out(
    rover: PhysicalRover, watch: RunObserver, message: CommandMessage, begin: Array, end: Array
) -> tuple[AckMessage, float]:
    """What became of a command, and how far the chassis was from going straight from ``begin`` to ``end`` [m]."""
    said = rover.command(message)
    far, start, duration = 0.0, rover.time, max(message.duration, TIME_STEP)
    while rover.mode == "moving":
        said += rover.step(TIME_STEP)
        watch.look()
        share = min(1.0, (rover.time - start) / duration)
        # the turns within a row are small: the nearer end's orientation stands for what lies between
        wanted = np.array(begin if share < 0.5 else end)
        wanted[:3, 3] = (1 - share) * begin[:3, 3] + share * end[:3, 3]
        far = max(far, pose_difference(wanted, rover.T_site_base))
    return said[-1], far


def _touch(robot: Robot, watch: RunObserver, goals: Mapping[int, Array]) -> Array:
    off = np.full(robot.leg_count, np.nan)
    for leg, goal in goals.items():
        place = watch.standing(leg)
        if place is not None:
            off[leg] = np.linalg.norm(place[:2] - goal[:2])
    return off
