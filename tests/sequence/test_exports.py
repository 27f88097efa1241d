"""What is exported reads back bit for bit as what was checked."""

import csv
import io
import json
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput, InvalidSequence, NotFound
from footfall.core.value import Provenance
from footfall.io.exports import FORMATS, SUFFIXES, export
from footfall.sequence.commands import Command, Sequence
from footfall.sequence.edit import Edit, apply_edit
from footfall.sequence.predict import predict


def bits(numbers) -> list[bytes]:
    return [struct.pack("<d", float(number)) for number in numbers]


def with_wait(robot, sequence):
    return apply_edit(robot, sequence, Edit("insert", 2, command=Command("WAIT", None, None, 1 / 3)))


def from_json(data: bytes):
    return [(c["name"], c["leg"], c["joints"], c["duration"]) for c in json.loads(data)["commands"]]


def from_csv(data: bytes):
    rows = []
    for row in csv.reader(io.StringIO(data.decode(), newline="")):
        _, _, _, name, leg, _, duration, *joints = row
        rows.append((name, leg, joints, duration))
    return [
        (name, int(leg) if leg else None, [float(one) for one in joints] if joints[0] else None, float(duration))
        for name, leg, joints, duration in rows[1:]
    ]


def from_seqjson(data: bytes):
    out = []
    for step in json.loads(data)["steps"]:
        args = {arg["name"]: arg["value"] for arg in step["args"]}
        duration, leg = args.pop("duration"), args.pop("leg", None)
        out.append((step["stem"], leg, list(args.values()) or None, duration))
    return out


READERS = {"json": from_json, "csv": from_csv, "seqjson": from_seqjson}


def require_same(rows, commands) -> None:
    assert len(rows) == len(commands)
    for (name, leg, joints, duration), command in zip(rows, commands, strict=True):
        assert (name, leg) == (command.name, command.leg)
        assert bits([duration]) == bits([command.duration])
        assert (joints is None) == (command.joints is None)
        if joints is not None:
            assert bits(joints) == bits(command.joints)


@pytest.mark.parametrize("format", READERS)
def test_numbers_come_back_bit_for_bit(athlete, sequence, format, tmp_path):
    edited = with_wait(athlete, sequence)
    path = tmp_path / f"step{SUFFIXES[format]}"
    data = export(edited, format, path)
    assert path.read_bytes() == data
    assert list(tmp_path.iterdir()) == [path]
    require_same(READERS[format](data), edited.commands)
    assert edited.digest.encode() in data
    assert export(edited, format) == data


@given(
    angles=st.lists(st.floats(-1e3, 1e3) | st.sampled_from([-0.0, 5e-324, 1e-300, 0.1 + 0.2]), min_size=6, max_size=6),
    duration=st.floats(0, 1e6),
)
@pytest.mark.parametrize("format", READERS)
def test_any_finite_number_survives(format, angles, duration):
    commands = (Command("LEG_MOVE", 1, np.array(angles), duration, "swing"),)
    start = np.zeros(36)
    odd = Sequence("athlete", commands, start, predict(start, commands), np.eye(4), (), Provenance({}))
    require_same(READERS[format](export(odd, format)), commands)


def test_json_tells_the_whole_sequence(sequence):
    document = json.loads(export(sequence, "json"))
    assert document["digest"] == sequence.digest
    assert bits(document["start"]) == bits(sequence.start)
    assert bits(np.ravel(document["T_site_base"])) == bits(sequence.T_site_base.ravel())
    for row, command in enumerate(document["commands"]):
        assert bits(command["predicted"]) == bits(sequence.predicted[row])
    assert {rule["rule"] for rule in document["rules"]} == {rule.rule for rule in sequence.rules}
    assert all(rule["holds"] for rule in document["rules"])


def test_seqjson_keeps_its_schema_and_its_times(athlete, sequence, shared_data):
    import jsonschema

    schema = json.loads((shared_data / "seq-json-schema-1.3.1.schema.json").read_text())
    document = json.loads(export(with_wait(athlete, sequence), "seqjson"))
    jsonschema.Draft202012Validator(schema).validate(document)
    for step in document["steps"]:
        # the schema takes any text as a time tag, so none is used
        assert step["time"] == {"type": "COMMAND_COMPLETE"}
        numbers = [arg for arg in step["args"] if arg["type"] == "number"]
        assert len(numbers) == len(step["args"]) == (1 if step["stem"] == "WAIT" else 8)
    document["steps"][0]["surplus"] = 1
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.Draft202012Validator(schema).validate(document)


@pytest.mark.parametrize("format", FORMATS)
def test_an_invalid_sequence_is_not_exported(athlete, sequence, flat, format, tmp_path):
    broken = apply_edit(athlete, sequence, Edit("duration", 3, number=0.1), flat)
    with pytest.raises(InvalidSequence, match="row 4 breaks speed") as caught:
        export(broken, format, tmp_path / "no")
    assert caught.value.details["failures"][0]["row"] == 3
    assert list(tmp_path.iterdir()) == []


def test_unknown_formats_and_folders_are_named(sequence, tmp_path):
    with pytest.raises(NotFound, match="json, csv, seqjson"):
        export(sequence, "xml")
    with pytest.raises(NotFound, match="no folder"):
        export(sequence, "csv", tmp_path / "absent" / "step.csv")
    with pytest.raises(InvalidInput, match="is a folder"):
        export(sequence, "csv", tmp_path)
