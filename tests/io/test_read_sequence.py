"""Sequences read from files: every rule asked anew, whatever the file claims, and clear words for what is wrong."""

import json
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from footfall.cli.recorded import RecordedSession
from footfall.core.errors import InvalidSequence, NotFound
from footfall.io.exports import SUFFIXES, export
from footfall.io.exports.as_fprime import HEADER
from footfall.io.imports import LARGEST, MOST_COMMANDS, read_sequence, sequence_of
from footfall.sequence.commands import Command
from footfall.sequence.edit import Edit, apply_edit
from footfall.terrain.dem import Dem
from tests.support.sequences import SAMPLES, bits, four_kinds, require_same_commands, unchecked

FORMATS = ("json", "csv", "seqjson", "fprime", "yamcs", "ros2")
SILENT = ("csv", "yamcs")
"""Formats that don't say from where the commands start."""


@pytest.fixture(scope="module")
def step():
    """A recorded step with the pose held, its terrain, and the rest that it starts from."""
    session = RecordedSession(SAMPLES / "fractal-step")
    sequence = session.sequence()
    dem = session.get(sequence.provenance.parents["dem"], Dem, "terrain")
    return sequence, dem, sequence.at_rest


def written(folder: Path, sequence, format: str) -> Path:
    path = folder / f"step{SUFFIXES[format]}"
    export(sequence, format, path)
    return path


@pytest.mark.parametrize("format", FORMATS)
def test_the_rules_are_asked_anew(format, step, athlete, tmp_path):
    sequence, dem, rest = step
    settings = sequence.provenance.settings
    path = written(tmp_path, sequence, format)
    found = read_sequence(path, athlete, dem, rest if format in SILENT else None, settings)
    assert found.valid
    require_same_commands(found.commands, sequence.commands)
    assert bits(found.predicted.ravel()) == bits(sequence.predicted.ravel())
    ours, theirs = ([(one.row, one.rule, one.holds) for one in s.rules] for s in (found, sequence))
    assert sorted(ours) == sorted(theirs)
    assert found.provenance.parents.keys() - {"state"} == {"file", "robot", "dem"}
    assert found.provenance.parents.get("state") == (rest.state.digest if format in SILENT else None)
    assert found.at_rest is not None
    assert found.commanded is not None
    assert found.at_rest.digest == rest.digest
    assert bits(found.commanded.ravel()) == bits(sequence.commanded.ravel())


def test_a_broken_command_is_read_and_fails_its_rule(step, athlete, tmp_path):
    sequence, dem, _ = step
    path = written(tmp_path, sequence, "json")
    document = json.loads(path.read_text())
    document["commands"][3]["duration"] = 0.01
    for rule in document["rules"]:
        rule["holds"] = True
    path.write_text(json.dumps(document))
    found = read_sequence(path, athlete, dem)
    assert {(one.row, one.rule) for one in found.failures} == {(3, "speed")}
    with pytest.raises(InvalidSequence, match="row 4 breaks speed"):
        export(found, "json")


def test_from_a_state_alone_commands_are_those_of_a_rigid_rover(step, athlete, tmp_path):
    """Set points that press wheels down would drag them then: that is told, not guessed away."""
    sequence, dem, rest = step
    found = read_sequence(written(tmp_path, sequence, "csv"), athlete, dem, rest.state)
    assert found.at_rest is None
    assert "no-drag" in {one.rule for one in found.failures}


def test_a_rest_is_edited_as_what_was_exported(step, athlete, tmp_path):
    sequence, dem, _ = step
    found = read_sequence(written(tmp_path, sequence, "json"), athlete, dem, None, sequence.provenance.settings)
    slower = Edit("duration", 2, number=sequence.commands[2].duration + 1.0)
    ours, theirs = (apply_edit(athlete, one, slower, dem) for one in (sequence, found))
    assert bits(ours.predicted.ravel()) == bits(theirs.predicted.ravel())
    assert ours.valid
    assert theirs.valid


BAD_REST = {
    "a foot too few": (lambda rest: rest["wheel_forces"].pop(), "wheel_forces needs 6 × 3 finite numbers"),
    "two numbers of a force": (lambda rest: rest["wheel_forces"][2].pop(), "must have three numbers for each leg"),
    "a set point too few": (lambda rest: rest["set_points"].pop(), "set_points needs as many finite angles"),
    "no torques": (lambda rest: rest.pop("joint_torques"), "lacks 'joint_torques'"),
    "more than is known": (lambda rest: rest.update(springs=[]), "has 'springs', which FootFall doesn't know"),
    "a huge force": (
        lambda rest: rest["wheel_forces"][0].__setitem__(2, 1e300),
        r"1e\+300 N on a wheel; the whole rover weighs 8339 N",
    ),
    "degrees": (lambda rest: rest["set_points"].__setitem__(4, 90.0), "a set point of 90 rad: were these degrees"),
    "two feet": (
        lambda rest: rest.update(wheel_forces=[[0, 0, 1000.0]] * 2 + [[0, 0, 0]] * 4),
        "three legs must be pressed on the ground for the rover to stand; here: 0, 1",
    ),
}


@pytest.mark.parametrize(("change", "message"), BAD_REST.values(), ids=BAD_REST)
@pytest.mark.parametrize("format", ["json", "seqjson", "fprime"])
def test_a_rest_that_no_rover_has_is_refused(change, message, format, step, athlete, tmp_path):
    sequence, dem, _ = step
    text = written(tmp_path, sequence, format).read_text()
    before = text if format != "fprime" else next(line for line in text.split("\n") if line.startswith(HEADER))
    document = json.loads(before.removeprefix(HEADER))
    holder = document["metadata"] if format == "seqjson" else document
    change(holder["at_rest"])
    after = HEADER + json.dumps(document) if format == "fprime" else json.dumps(document)
    name = f"step{SUFFIXES[format]}"
    with pytest.raises(InvalidSequence, match=message):
        sequence_of(name, text.replace(before, after).encode(), athlete, dem)


@pytest.mark.parametrize("name", ["rock-step", "fractal-step"])
def test_without_a_terrain_nothing_that_moves_is_valid(name, athlete, tmp_path):
    found = read_sequence(written(tmp_path, RecordedSession(SAMPLES / name).sequence(), "json"), athlete)
    assert [one.rule for one in found.failures] == ["terrain-given"]


@pytest.mark.parametrize("name", ["rock-step", "fractal-step"])
def test_without_a_terrain_a_wheel_is_lowered_all_the_way(name, athlete, tmp_path):
    """From there the next row, halved in time, is too fast; from where the wheel touches the ground it is not."""
    session = RecordedSession(SAMPLES / name)
    sequence = session.sequence()
    dem = session.get(sequence.provenance.parents["dem"], Dem, "terrain")
    path = written(tmp_path, sequence, "json")
    document = json.loads(path.read_text())
    after = [one["name"] for one in document["commands"]].index("LEG_LOWER") + 2
    document["commands"][after]["duration"] /= 2
    path.write_text(json.dumps(document))
    assert read_sequence(path, athlete, dem).valid
    failures = read_sequence(path, athlete).failures
    assert [one.rule for one in failures] == ["terrain-given", "speed"]
    assert failures[1].row == after


def test_what_cannot_be_used_is_named(step, athlete, tmp_path):
    sequence, dem, _ = step
    with pytest.raises(NotFound, match="no file"):
        read_sequence(tmp_path / "absent.json")
    for format in SILENT:
        with pytest.raises(InvalidSequence, match=r"it doesn't say from where the commands start; give state="):
            read_sequence(written(tmp_path, sequence, format), athlete, dem)
    with pytest.raises(InvalidSequence, match=r"not from '\.html'"):
        read_sequence(written(tmp_path, sequence, "html"))
    other = written(tmp_path, four_kinds(robot="../../etc/passwd"), "json")
    with pytest.raises(InvalidSequence, match="doesn't ship with FootFall; give robot="):
        read_sequence(other)
    with pytest.raises(InvalidSequence, match="not for athlete"):
        read_sequence(other, athlete)
    (tmp_path / "posture.json").write_bytes(export(unchecked(four_kinds().commands, start=np.zeros(24)), "json"))
    with pytest.raises(InvalidSequence, match=r"posture\.json: the start posture needs 36 finite joint angles"):
        read_sequence(tmp_path / "posture.json", athlete, dem)


def test_too_many_commands_and_too_large_files_are_refused_before_any_rule(step, athlete, tmp_path):
    sequence, dem, _ = step
    wait = Command("WAIT", None, None, 1.0)
    most = unchecked((wait,) * MOST_COMMANDS, start=sequence.start)
    more = unchecked((wait,) * (MOST_COMMANDS + 1), start=sequence.start)
    for format in ("json", "csv"):
        assert len(read_sequence(written(tmp_path, most, format), athlete, dem, step[2]).commands) == MOST_COMMANDS
        with pytest.raises(InvalidSequence, match=f"it has {MOST_COMMANDS + 1} commands; a sequence has at most"):
            read_sequence(written(tmp_path, more, format), athlete, dem, step[2])
    large = tmp_path / "large.json"
    large.write_bytes(b" " * (LARGEST + 1))
    for read in (lambda: read_sequence(large), lambda: sequence_of(large.name, large.read_bytes())):
        with pytest.raises(InvalidSequence, match=rf"^large\.json has {LARGEST + 1} bytes; a file of"):
            read()


def changed(change):
    """The JSON of four commands with a change."""
    document = json.loads(export(four_kinds(), "json"))
    change(document)
    return json.dumps(document)


BAD_JSON = {
    "": "it is no JSON",
    "[" * 100_000: "it is no JSON",
    '{"format": "footfall-sequence", "format": 1}': "is given twice",
    changed(lambda d: d.update(format="other")): "its format must be 'footfall-sequence'",
    changed(lambda d: d.update(version=2)): "reads version 1",
    changed(lambda d: d.pop("start")): "the file lacks 'start'",
    changed(lambda d: d["start"].__setitem__(3, True)): r"start\[3\] must be a number, not a truth value",
    changed(lambda d: d["commands"].pop(1)): r"commands\[1\] says that it is row 3",
    changed(lambda d: d["commands"][0].update(leg=1.5)): r"commands\[0\], leg must be a whole number, not 1\.5",
    changed(lambda d: d["commands"][0]["joints"].__setitem__(2, None)): r"joints\[2\] must be a number, not null",
    changed(lambda d: d["commands"][1].update(duration=10**400)): r"commands\[1\], duration is too large",
    changed(lambda d: d["commands"][1].update(phase=3)): r"commands\[1\], phase must be a text, not a number",
    changed(lambda d: d["T_site_base"].pop()): "T_site_base must have four rows of four",
    changed(lambda d: d["commands"][1].update(duration=float("nan"))): "NaN is no number of JSON",
    changed(lambda d: d.update(commands={})): "commands must be a list, not an object",
}


@pytest.mark.parametrize(("text", "message"), BAD_JSON.items(), ids=BAD_JSON.values())
def test_bad_json_is_told(text, message, tmp_path):
    path = tmp_path / "bad.json"
    path.write_text(text)
    with pytest.raises(InvalidSequence, match=rf"^bad\.json: .*{message}"):
        read_sequence(path)


@pytest.mark.parametrize("about", [None, 7, [], "x"])
def test_what_a_seqjson_says_of_itself_is_an_object(about, step, athlete, tmp_path):
    sequence, dem, _ = step
    document = json.loads(written(tmp_path, sequence, "seqjson").read_text())
    document["metadata"] = about
    with pytest.raises(InvalidSequence, match="metadata must be an object"):
        sequence_of("a.seq.json", json.dumps(document).encode(), athlete, dem)


@settings(max_examples=30)
@given(data=st.data())
@pytest.mark.parametrize("format", FORMATS)
def test_damaged_files_are_refused_or_read_and_never_a_raw_error(format, data, athlete, tmp_path_factory):
    """Cut short, or a byte changed: InvalidSequence, or a sequence (of other numbers) that the rules look at."""
    move, wait, _, lower = four_kinds().commands
    content = bytearray(export(unchecked((move, wait, lower)), format))
    at = data.draw(st.integers(0, len(content) - 1))
    if data.draw(st.booleans()):
        del content[at:]
    else:
        content[at] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.mktemp("damaged") / f"step{SUFFIXES[format]}"
    path.write_bytes(bytes(content))
    with suppress(InvalidSequence):
        assert not read_sequence(path, athlete).valid
