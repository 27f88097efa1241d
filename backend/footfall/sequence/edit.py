"""Edits by an operator: each gives a new sequence with every rule checked again.

An edit that breaks a rule still gives a sequence, invalid, so that the operator sees the failing row.
An edit that can't be carried out at all (no such row) raises InvalidSequence.
"""

from dataclasses import replace
from typing import TypeVar

import numpy as np

from footfall.core.errors import InvalidSequence
from footfall.core.value import Provenance, Value, value
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.model import Robot
from footfall.sequence.commands import LEG_JOINTS, Command, RuleResult, Sequence
from footfall.sequence.drum import on_tether
from footfall.sequence.from_rest import sequence_at_rest
from footfall.sequence.motion import MOTION_RULES
from footfall.sequence.of_legged import legged_sequence
from footfall.sequence.passage import passages, poses, postures
from footfall.sequence.rules import TERRAIN_GIVEN, check_rules
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.sequence.yielding import require_terrain
from footfall.telemetry.command_kinds import WAIT
from footfall.terrain.dem import Dem

_T = TypeVar("_T")

EDIT_KINDS = ("set", "joint", "duration", "insert", "delete", "move", "split")


@value
class Edit(Value):
    """One change of a sequence.

    ========  =============================================================================
    kind      what it does
    ========  =============================================================================
    set       row becomes ``command``
    joint     joint ``joint`` of row becomes ``number`` [rad, or m where it slides]: of those that the row moves,
              leg by leg from the hip outward
    duration  duration of row becomes ``number`` [s]
    insert    ``command`` comes before row; row = number of commands appends
    delete    row goes
    move      row goes to where row ``to`` is
    split     row becomes two, divided at the fraction ``number`` (one half when None)
    ========  =============================================================================

    Both halves of a LEG_LOWER wait for its force: where the first ends by it, the second presses on.

    Raises InvalidSequence where the kind is unknown or lacks what it needs.
    """

    kind: str
    row: int
    command: Command | None = None
    to: int | None = None
    joint: int | None = None
    number: float | None = None

    def check(self) -> None:
        """Raises InvalidSequence for an unknown kind of edit, and where a field that the kind needs is missing."""
        if self.kind not in EDIT_KINDS:
            raise InvalidSequence(f"an edit is one of {', '.join(EDIT_KINDS)}", kind=self.kind)
        needs = {
            "set": ("command",),
            "insert": ("command",),
            "joint": ("joint", "number"),
            "duration": ("number",),
            "move": ("to",),
        }.get(self.kind, ())
        missing = [name for name in needs if getattr(self, name) is None]
        if missing:
            raise InvalidSequence(f"the edit {self.kind!r} needs {' and '.join(missing)}", missing=missing)
        if self.joint is not None and self.joint < 0:
            raise InvalidSequence("joint counts from 0: " + ", ".join(LEG_JOINTS), joint=self.joint)


def apply_edit(
    robot: Robot | LeggedRobot,
    sequence: Sequence,
    edit: Edit,
    dem: Dem | None = None,
    settings: SequenceSettings | None = None,
) -> Sequence:
    """The sequence after one edit; its parents are the sequence and the edit.

    ``settings`` None: those of the sequence. With ``dem`` the motion rules are checked too; without it an edit
    that changes the motion, or keeps one that broke a rule, fails the rule terrain-given.

    Raises InvalidSequence where the edit can't be carried out, and without ``dem`` where a row is a POSTURE_MOVE, the
    rover sags, or others described the robot.
    """
    if sequence.robot != robot.name:
        raise InvalidSequence(f"the sequence is for {sequence.robot}, not for {robot.name}")
    made_with = sequence.provenance.settings
    if settings is None:
        settings = made_with if isinstance(made_with, SequenceSettings) else SequenceSettings()
    commands = edited(sequence, edit)
    parents = {"sequence": sequence.digest, "edit": edit.digest, "robot": robot.digest}
    if dem is not None:
        parents["dem"] = dem.digest
    if isinstance(robot, LeggedRobot):
        ground, start, T = require_terrain(dem), sequence.start, sequence.T_site_base
        before = None if sequence.at_rest is None else sequence.at_rest.set_points
        return legged_sequence(robot, commands, start, T, ground, settings, parents, before)
    if sequence.at_rest is not None:
        return sequence_at_rest(robot, sequence.at_rest, commands, require_terrain(dem), settings, parents)
    rules = check_rules(robot, commands, sequence.start, sequence.T_site_base, dem, settings)
    way = passages(robot, sequence.start, sequence.T_site_base, commands, dem)
    if dem is None:
        rules = (*_unchecked(sequence, edit, commands), *rules)
    made = Sequence(
        robot=sequence.robot,
        commands=commands,
        start=sequence.start,
        predicted=postures(way, sequence.start),
        T_site_base=sequence.T_site_base,
        rules=rules,
        provenance=Provenance(parents, settings),
        Ts_site_base=poses(way),
    )
    return on_tether(made, sequence.tether)


def _unchecked(sequence: Sequence, edit: Edit, commands: tuple[Command, ...]) -> list[RuleResult]:
    """What an edit without a terrain leaves open: nothing where the checked motion stays as it was."""
    if not _motion(commands):
        return []
    same = edit.kind == "split" or _motion(commands) == _motion(sequence.commands)
    broken = [result for result in sequence.failures if result.rule in (*MOTION_RULES, TERRAIN_GIVEN)]
    if same and not broken:
        return []
    text = "what the changed motion hits was not checked: give the terrain" if not broken else broken[0].text
    return [RuleResult(TERRAIN_GIVEN, -1, False, float("nan"), "", text)]


def _motion(commands: tuple[Command, ...]) -> list[tuple[str, int | None, bytes]]:
    return [(one.name, one.leg, one.joints.tobytes()) for one in commands if one.joints is not None]


def edited(sequence: Sequence, edit: Edit) -> tuple[Command, ...]:
    """The commands after an edit. Raises InvalidSequence where there is no such row."""
    rows = list(sequence.commands)
    _require_row(edit.row, len(rows) + (edit.kind == "insert"), "row")
    if edit.kind == "insert":
        rows.insert(edit.row, _given(edit.command, "command"))
        return tuple(rows)
    command = rows[edit.row]
    match edit.kind:
        case "set":
            rows[edit.row] = _given(edit.command, "command")
        case "joint":
            rows[edit.row] = _with_joint(sequence, edit)
        case "duration":
            seconds = _given(edit.number, "number")
            rows[edit.row] = replace(command, duration=seconds)
        case "delete":
            del rows[edit.row]
        case "move":
            to = _given(edit.to, "to")
            _require_row(to, len(rows), "to")
            rows.insert(to, rows.pop(edit.row))
        case "split":
            rows[edit.row : edit.row + 1] = _split(sequence, edit)
    return tuple(rows)


def _given(item: _T | None, name: str) -> _T:
    if item is None:
        raise InvalidSequence(f"the edit needs {name}", missing=[name])
    return item


def _require_row(row: int, count: int, name: str) -> None:
    if not 0 <= row < count:
        right = f"0…{count - 1}" if count else "none: the sequence is empty"
        raise InvalidSequence(f"{name} {row} does not exist; there is {right}", **{name: row, "rows": count})


def _with_joint(sequence: Sequence, edit: Edit) -> Command:
    command = sequence.commands[edit.row]
    own = sequence.layout.moved(command.kind, command.leg)
    if command.joints is None or not 0 < own.stop - own.start == len(command.joints):
        wanted = "six joints" if sequence.described is None else "joints that are its own"
        raise InvalidSequence(f"row {edit.row + 1} is a {command.name} without {wanted} to set", row=edit.row)
    joint, last = _given(edit.joint, "joint"), len(command.joints) - 1
    if joint > last:
        own_names = ", ".join(sequence.layout.joint_names[own])
        order = f"leg by leg {', '.join(LEG_JOINTS)}" if sequence.described is None else own_names
        raise InvalidSequence(f"joint of a {command.name} is 0…{last}, {order}", joint=joint, row=edit.row)
    joints = command.joints.copy()
    joints[joint] = _given(edit.number, "number")
    return replace(command, joints=joints)


def _split(sequence: Sequence, edit: Edit) -> list[Command]:
    fraction = 0.5 if edit.number is None else edit.number
    if not 0 < fraction < 1:
        raise InvalidSequence("a row is split at a fraction between 0 and 1", number=fraction)
    command = sequence.commands[edit.row]
    first = fraction * command.duration
    joints = command.joints
    if command.kind is not WAIT:
        own, end = sequence.layout.moved(command.kind, command.leg), joints
        if end is None or not 0 < own.stop - own.start == len(end) or not np.isfinite(end).all():
            raise InvalidSequence(f"row {edit.row + 1} moves no leg, so there is nothing to split", row=edit.row)
        begin = sequence.set_points_before(edit.row)[own]
        joints = begin + fraction * (end - begin)
    return [
        replace(command, joints=joints, duration=first),
        replace(command, duration=command.duration - first),
    ]
