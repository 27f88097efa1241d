"""Commands read from a file into a session: checked anew, undone, sent through the same gate, and replayed."""

import json

import pytest

from footfall import BodyShift, shifted_state
from footfall.core.errors import CommandRefused, Conflict, InvalidSequence
from footfall.io.exports import SUFFIXES
from footfall.sequence.commands import Sequence
from footfall.sequence.edit import Edit
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.session.replay.recompute import replay
from footfall.telemetry.state import RobotState, TelemetryFrame
from tests.support.chassis_ground import wavy
from tests.support.sequences import require_same_commands

READABLE = ("json", "csv", "seqjson", "fprime", "yamcs", "ros2")


@pytest.fixture
def made(live):
    """The session's commands: a move of the chassis, in rows that every format can hold."""
    move = live.stances.plan_body_move(BodyShift(dy=0.05, dz=-0.1)).finish()
    return live.get(live.sequences.make(move, as_commanded=True))


def exported(live, format: str) -> tuple[str, bytes]:
    """Name and content of the present commands' file."""
    return f"step{SUFFIXES[format]}", live.sequences.export(format=format)


def refused(live) -> str:
    """The check that arming fails."""
    with pytest.raises(CommandRefused) as caught:
        live.commands.arm()
    return caught.value.details["check"]


@pytest.mark.parametrize("format", READABLE)
def test_what_was_exported_comes_back_checked_and_is_sent(live, made, standing, format):
    file = exported(live, format)
    digest = live.sequences.import_file(*file, as_commanded=True)
    found = live.get(digest)
    assert live.state.sequence == digest != made.digest
    assert found.valid
    require_same_commands(found.commands, made.commands)
    assert {one.rule for one in found.rules} == {one.rule for one in made.rules}
    assert live.review.played == digest
    assert not live.review.commands_of_another_plan
    heard = []
    live.rover.connected(lambda text: heard.append(json.loads(text)))
    live.rover.take_telemetry(TelemetryFrame(0, standing, standing.posture))
    ids = live.commands.send(live.commands.arm()["token"])["commands"]
    for command_id in ids:
        live.rover.take_acknowledgement(command_id, "done")
    sent = [one["joints"] for one in heard if one["type"] == "command"]
    assert sent == [one.joints.tolist() for one in made.commands]


def test_it_takes_the_place_of_the_commands_and_undo_brings_them_back(live, made):
    file = exported(live, "json")
    edited = live.sequences.edit(made.digest, Edit("duration", 0, number=20.0))
    read = live.sequences.import_file(*file)
    changed = live.sequences.edit(read, Edit("duration", 0, number=30.0))
    for before in (read, edited, made.digest):
        live.sequences.undo()
        assert live.state.sequence == before
    with pytest.raises(Conflict, match="no edit"):
        live.sequences.undo()
    for after in (edited, read, changed):
        live.sequences.redo()
        assert live.state.sequence == after


def test_the_first_commands_of_a_session_may_come_from_a_file(live, made, tmp_path, athlete, dem, standing):
    file = exported(live, "csv")
    with Sessions(tmp_path / "others", jobs=InlineJobs(), robot=athlete) as opened:
        other = opened.create("another")
        with pytest.raises(Conflict, match="no terrain"):
            other.sequences.import_file(*file)
        other.terrains.load(dem)
        with pytest.raises(Conflict, match="state"):
            other.sequences.import_file(*file)
        other.stances.set(standing)
        digest = other.sequences.import_file(*file)
        assert other.state.sequence == digest
        read = other.get(digest)
        assert isinstance(read, Sequence)
        assert read.valid
        with pytest.raises(Conflict, match="no edit"):
            other.sequences.undo()
        other.sequences.edit(digest, Edit("duration", 0, number=20.0))
        other.sequences.undo()
        assert other.state.sequence == digest


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("step.csv", b"", r"^step\.csv: "),
        ("step.json", b"{", r"^step\.json: it is no JSON"),
        (
            "step.docx",
            b"PK",
            r"^step\.docx: .* from \.json, \.csv, \.seq, \.ycs, \.mcap, not from '\.docx'",
        ),
        ("step.mcap", b"\x89MCAP", r"^step\.mcap: it is no whole MCAP file"),
        ("step", b"", r"^step: sequences are read from"),
    ],
)
def test_a_file_that_cannot_be_used_changes_nothing(live, made, name, content, said):
    with pytest.raises(InvalidSequence, match=said):
        live.sequences.import_file(name, content)
    assert live.state.sequence == made.digest
    assert live.state.sequence_history == ()


def test_what_breaks_a_rule_is_read_and_not_armed(live, made, standing):
    name, content = exported(live, "json")
    document = json.loads(content)
    document["commands"][0]["duration"] = 0.01
    digest = live.sequences.import_file(name, json.dumps(document).encode())
    assert {(one.row, one.rule) for one in live.get(digest).failures} == {(0, "speed")}
    live.rover.connected(lambda text: None)
    live.rover.take_telemetry(TelemetryFrame(0, standing, standing.posture))
    assert refused(live) == "rules"


def test_commands_from_elsewhere_and_for_another_ground_are_not_armed(live, made, athlete, dem, standing):
    """What the file says of the start counts where it says it; the ground is the one that it was checked on."""
    named, silent = exported(live, "json"), exported(live, "csv")
    moved = shifted_state(athlete, dem, standing, BodyShift(dz=-0.05))
    assert isinstance(moved, RobotState)
    live.stances.set(moved)
    live.rover.connected(lambda text: None)
    live.rover.take_telemetry(TelemetryFrame(0, moved, moved.posture))
    live.sequences.import_file(*named)
    assert refused(live) == "start"
    read = live.get(live.sequences.import_file(*silent))
    assert read.provenance.parents["state"] == live.state.state
    assert (read.start == moved.posture).all()
    assert refused(live) == "rules"  # the same joints from a lower chassis: the feet would slide
    live.stances.set(standing)
    live.rover.take_telemetry(TelemetryFrame(1, standing, standing.posture))
    live.sequences.import_file(*silent)
    live.terrains.load(wavy(half=4.5))
    assert refused(live) == "terrain"


def test_a_session_with_it_replays(live, made):
    for format in READABLE:
        live.sequences.import_file(*exported(live, format))
    report = replay(live.export_bundle())
    assert report.ok, report.problems
    imports = [one for one in report.products if one.kind == "import"]
    assert [one.verdict for one in imports] == ["same"] * len(READABLE)
