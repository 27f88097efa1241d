"""The kinds of commands: what is fixed for ever, what follows from their arguments, and what the documents say."""

import re
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from footfall.robot.description import athlete_layout
from footfall.sequence.commands import Command, by_leg, leg_lower, leg_move, posture_move, wait
from footfall.telemetry.command_kinds import (
    KINDS,
    LEG_LOWER,
    LEG_MOVE,
    POSTURE_MOVE,
    UNKNOWN,
    WAIT,
    CommandKind,
    kind_named,
)
from footfall.telemetry.link import CommandMessage
from tests.support.sequences import four_kinds

DOCS = Path(__file__).resolve().parents[2] / "docs"
SIX, ALL = np.linspace(0, 1, 6), np.linspace(-1, 1, 36)
KIND = pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)


def _rows(page: str) -> dict[str, str]:
    """The table rows of a document that begin with a name in capitals, by that name."""
    found = re.findall(r"^\| `?([A-Z_]{2,})`? \|(.*)\|$", (DOCS / page).read_text(), re.MULTILINE)
    return dict(found)


def test_names_and_codes_never_change():
    told = {name: (kind.code, kind.argument_names) for name, kind in KINDS.items()}
    assert told == {
        "LEG_MOVE": (0, ("leg", "joints", "duration")),
        "WAIT": (1, ("duration",)),
        "POSTURE_MOVE": (2, ("joints", "duration")),
        "LEG_LOWER": (3, ("leg", "joints", "duration", "force")),
    }


def test_there_is_a_kind_to_a_name_and_one_for_all_strangers():
    for name, kind in KINDS.items():
        assert kind_named(name) is kind
        assert kind.name == name
    assert {kind_named(name) for name in ("", "JUMP", "leg_move", "WAIT ")} == {UNKNOWN}
    assert not UNKNOWN.moves
    assert UNKNOWN.arguments == ()


@KIND
def test_what_it_takes_are_fields_of_commands_and_of_messages(kind: CommandKind):
    for value in (Command, CommandMessage):
        assert set(kind.argument_names) <= {field.name for field in fields(value)}
    assert len(set(kind.argument_names)) == len(kind.arguments)
    assert kind.moves == bool(kind.joint_count(4))


@pytest.mark.parametrize("legs", [4, 6])
def test_what_it_moves(legs: int):
    posture = np.arange(6 * legs)
    assert posture[LEG_MOVE.joints_of(2, legs)].tolist() == [12, 13, 14, 15, 16, 17]
    assert posture[LEG_LOWER.joints_of(0, legs)].tolist() == [0, 1, 2, 3, 4, 5]
    assert posture[POSTURE_MOVE.joints_of(None, legs)].tolist() == posture.tolist()
    assert posture[WAIT.joints_of(None, legs)].tolist() == posture[UNKNOWN.joints_of(3, legs)].tolist() == []


def test_making_a_command_of_a_kind_gives_what_its_fields_say():
    made = (leg_move(1, SIX, 2.0, "lift"), wait(3.0), posture_move(ALL, 4.0), leg_lower(5, SIX, 6.0, 70.0, "lower"))
    written = (
        Command("LEG_MOVE", 1, SIX, 2.0, "lift"),
        Command("WAIT", None, None, 3.0),
        Command("POSTURE_MOVE", None, ALL, 4.0),
        Command("LEG_LOWER", 5, SIX, 6.0, "lower", 70.0),
    )
    assert [one.digest for one in made] == [one.digest for one in written]
    assert [one.kind for one in made] == list(KINDS.values())


def test_arguments_are_told_in_order_with_their_values():
    told = [[(argument.name, given) for argument, given in one.arguments] for one in four_kinds().commands]
    for found, one in zip(told, four_kinds().commands, strict=True):
        assert found == [
            (name, given.tolist() if isinstance(given, np.ndarray) else given)
            for name in one.kind.argument_names
            for given in [getattr(one, name)]
        ]
    assert [name for name, _ in told[-1]] == ["leg", "joints", "duration", "force"]


def test_joints_are_told_leg_by_leg():
    layout = athlete_layout(6)
    whole = by_leg(posture_move(ALL, 1.0), layout)
    assert [leg for leg, _ in whole] == [0, 1, 2, 3, 4, 5]
    assert np.concatenate([angles for _, angles in whole]).tolist() == ALL.tolist()
    ((leg, angles),) = by_leg(leg_move(4, SIX, 1.0), layout)
    assert (leg, angles.tolist()) == (4, SIX.tolist())
    assert by_leg(wait(1.0), layout) == []


def test_the_sequences_that_tests_export_have_every_kind():
    assert {one.kind for one in four_kinds().commands} == set(KINDS.values())


def test_the_documents_tell_every_kind():
    exports, link = _rows("exports.md"), _rows("rover-link.md")
    assert set(link) == set(KINDS)
    assert set(exports) == set(KINDS)
    for name, kind in KINDS.items():
        takes = exports[name].split("|")[0].strip()
        assert [part.split()[0] for part in takes.replace("six joints", "joints").split(", ")] == list(
            kind.argument_names
        ), name
        assert link[name].split("|")[0].count("`null`") == 3 - len({*kind.argument_names} - {"duration"}), name
