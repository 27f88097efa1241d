"""Sequences from files: what ``io.exports`` wrote, or what others made in these formats. Every rule is checked anew."""

import hashlib
import os
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from footfall.balance.balance_settings import GRAVITY
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput, InvalidSequence, NotFound
from footfall.core.value import Provenance, digest
from footfall.io.imports import from_csv, from_fprime, from_joint_csv, from_json, from_ros2, from_seqjson, from_yamcs
from footfall.io.imports.parsed import ParsedSequence, json_of, text_of
from footfall.io.robot_files import load_robot, robot_names
from footfall.planning.legged.measured import set_points_told
from footfall.planning.legged.problem import LeggedState
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.model import Robot
from footfall.sequence.commands import AtRest, Command, RuleResult, Sequence
from footfall.sequence.from_rest import sequence_at_rest
from footfall.sequence.of_legged import legged_sequence
from footfall.sequence.passage import passages, poses, postures
from footfall.sequence.predict import FARTHEST
from footfall.sequence.rules import TERRAIN_GIVEN, check_rules, require_start
from footfall.sequence.sequence_settings import COARSEST, SequenceSettings
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

LARGEST = 16 * 2**20
"""Bytes; a thousand commands of all legs are 2 MB."""

MOST_COMMANDS = 2000
"""A step has some twenty; the rules of each take milliseconds."""
MOST_WEIGHTS = 10.0
"""No wheel of a rover at rest is pressed down with so many times its weight."""
MOST_OF_DESCRIBED = 20_000
"""A walk of 3 m of a robot that others described has some thousands: its feet go in small steps."""


def read_sequence(
    path: str | os.PathLike[str],
    robot: Robot | LeggedRobot | None = None,
    dem: Dem | None = None,
    state: RobotState | LeggedState | AtRest | None = None,
    settings: SequenceSettings | None = None,
) -> Sequence:
    """Read commands from a file and check every rule.

    Files are JSON, CSV, SeqJSON, F Prime text (.seq), Yamcs (.ycs), or MCAP. What one claims of predictions and rules
    is not read. A broken rule is no error: the sequence is then not valid.

    Args:
        path: the file; the ending of its name says which kind it is.
        robot: whose commands they are; None: the one of the file's name, where it ships with FootFall. A robot that
            others described must be given.
        dem: the ground, in site; without it what the motion hits isn't checked, and the rule terrain-given fails where
            anything moves. A robot that others described needs it.
        state: from where the commands start, instead of what the file says; CSV and Yamcs stacks don't say. An AtRest
            has the set points, too, and the motion is predicted as the rover sags; from a RobotState it is a rigid
            ATHLETE's.
        settings: with what the rules are checked; None: as delivered.

    Returns:
        The sequence with what each rule says of each row.

    Raises:
        NotFound: there is no such file.
        InvalidSequence: it can't be used; the message names file and place.
    """
    path = Path(path)
    if not path.is_file():
        raise NotFound(f"there is no file {path}", path=str(path))
    _require_small(path.name, path.stat().st_size)
    return sequence_of(path.name, path.read_bytes(), robot, dem, state, settings)


def sequence_of(
    name: str,
    data: bytes,
    robot: Robot | LeggedRobot | None = None,
    dem: Dem | None = None,
    state: RobotState | LeggedState | AtRest | None = None,
    settings: SequenceSettings | None = None,
    otherwise: RobotState | LeggedState | AtRest | None = None,
) -> Sequence:
    """As :func:`read_sequence`, from the content of a file of that name.

    otherwise: from where the commands start if neither the file nor ``state`` says. The state that was taken is a
    parent of the sequence. Raises InvalidSequence.
    """
    _require_small(name, len(data))
    try:
        parsed = _decoder(name, robot)(data)
        most = MOST_COMMANDS if parsed.described is None else MOST_OF_DESCRIBED
        if len(parsed.commands) > most:
            raise InvalidSequence(f"it has {len(parsed.commands)} commands; a sequence has at most {most}")
        if parsed.start is None and state is None:
            state = otherwise
        return _checked(parsed, hashlib.sha256(data).hexdigest()[:32], robot, dem, state, settings)
    except InvalidInput as error:
        raise InvalidSequence(f"{name}: {error.message}", file=name, **error.details) from error


def _require_small(name: str, size: int) -> None:
    if size > LARGEST:
        raise InvalidSequence(f"{name} has {size} bytes; a file of commands has at most {LARGEST}", file=name)


def _decoder(name: str, robot: Robot | LeggedRobot | None) -> Callable[[bytes], ParsedSequence]:
    known: dict[str, Callable[[bytes], ParsedSequence]] = {
        ".json": _of_json,
        ".csv": from_csv.decode,
        ".seq": from_fprime.decode,
        ".ycs": from_yamcs.decode,
        ".mcap": from_ros2.decode,
    }
    suffix = Path(name).suffix.lower()
    if suffix not in known:
        raise InvalidSequence(f"sequences are read from {', '.join(known)}, not from {suffix!r}")
    if suffix == ".csv" and isinstance(robot, LeggedRobot):
        return partial(from_joint_csv.decode, layout=robot.layout)
    return known[suffix]


def _of_json(data: bytes) -> ParsedSequence:
    """FootFall's own JSON or SeqJSON: the one says its format, the other has steps."""
    document = json_of(text_of(data))
    if isinstance(document, dict) and "steps" in document:
        return from_seqjson.of_document(document)
    return from_json.of_document(document)


def _set_points(robot: LeggedRobot, state: RobotState | LeggedState | None) -> Array | None:
    """Set points of the joints as a state tells them; None where it does not."""
    if isinstance(state, LeggedState):
        return state.set_points
    return None if state is None else set_points_told(robot, state)


def _robot_of(parsed: ParsedSequence, given: Robot | LeggedRobot | None) -> Robot | LeggedRobot:
    """The robot that the commands are for: ``given``, or of those that ship with FootFall, the one of that name.

    Raises InvalidSequence where that is another robot, or one with other legs and joints.
    """
    if given is None:
        if parsed.robot not in robot_names():  # a name from a file is never a path
            raise InvalidSequence(f"it is for {parsed.robot!r}, which doesn't ship with FootFall; give robot=")
        given = load_robot(parsed.robot)
    if given.name != parsed.robot:
        raise InvalidSequence(f"it is for {parsed.robot!r}, not for {given.name}")
    described = given.layout if isinstance(given, LeggedRobot) else None
    if digest(parsed.described) != digest(described):
        raise InvalidSequence(f"its legs and joints are not those of {given.name}")
    return given


def _checked(
    parsed: ParsedSequence,
    file: str,
    robot: Robot | LeggedRobot | None,
    dem: Dem | None,
    given: RobotState | LeggedState | AtRest | None,
    settings: SequenceSettings | None,
) -> Sequence:
    robot = _robot_of(parsed, robot)
    at_rest = parsed.at_rest if given is None else given if isinstance(given, AtRest) else None
    state = given.state if isinstance(given, AtRest) else given
    start, T_site_base = parsed.start, parsed.T_site_base
    if state is not None:
        start = state.q if isinstance(state, LeggedState) else state.posture
        T_site_base = state.T_site_base
    if start is None or T_site_base is None:
        raise InvalidSequence("it doesn't say from where the commands start; give state=")
    parents = {"file": file, "robot": robot.digest} | ({} if state is None else {"state": state.digest})
    if dem is not None:
        parents["dem"] = dem.digest
    if isinstance(robot, LeggedRobot):
        if dem is None:
            raise InvalidSequence(f"commands for {robot.name} need the terrain: its feet say where the chassis goes")
        settings = settings or SequenceSettings(sample=COARSEST)
        set_points = _set_points(robot, state) if at_rest is None else at_rest.set_points
        return legged_sequence(robot, parsed.commands, start, T_site_base, dem, settings, parents, set_points)
    settings = settings or SequenceSettings()
    if at_rest is None:
        made = _of_rigid(robot, parsed.commands, start, T_site_base, dem, settings, parents)
    else:
        require_start(robot, start, T_site_base)
        _require_rest(robot, at_rest)
        made = sequence_at_rest(robot, at_rest, parsed.commands, dem, settings, parents)
    if dem is not None or all(one.joints is None for one in parsed.commands):
        return made
    text = "what the motion hits was not checked: give the terrain"
    return replace(made, rules=(RuleResult(TERRAIN_GIVEN, -1, False, float("nan"), "", text), *made.rules))


def _of_rigid(
    robot: Robot,
    commands: tuple[Command, ...],
    start: Array,
    T_site_base: Array,
    dem: Dem | None,
    settings: SequenceSettings,
    parents: dict[str, str],
) -> Sequence:
    rules = check_rules(robot, commands, start, T_site_base, dem, settings)
    way = passages(robot, start, T_site_base, commands, dem)
    return Sequence(
        robot=robot.name,
        commands=commands,
        start=start,
        predicted=postures(way, start),
        T_site_base=T_site_base,
        rules=rules,
        provenance=Provenance(parents, settings),
        Ts_site_base=poses(way),
    )


def _require_rest(robot: Robot, at_rest: AtRest) -> None:
    """Raise InvalidSequence where no rover could stand at rest so: further checks are left to its prediction."""
    if at_rest.state.leg_count != robot.leg_count:
        raise InvalidSequence(f"at_rest is of {at_rest.state.leg_count} legs; {robot.name} has {robot.leg_count}")
    if (farthest := float(np.abs(at_rest.set_points).max())) > FARTHEST:
        raise InvalidSequence(f"at_rest has a set point of {farthest:z.6g} rad: were these degrees?")
    weight, most = robot.mass * GRAVITY, float(np.abs(at_rest.state.wheel_forces).max())
    if most > MOST_WEIGHTS * weight:
        raise InvalidSequence(f"at_rest has {most:z.6g} N on a wheel; the whole rover weighs {weight:z.0f} N on Earth")
