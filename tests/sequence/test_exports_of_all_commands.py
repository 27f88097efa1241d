"""JSON, CSV and SeqJSON carry every kind of command: what is read back is bit for bit what was checked."""

import csv
import io
import json
from itertools import groupby

import jsonschema
import numpy as np
import pytest
from hypothesis import given, settings

from footfall.core.value import Provenance
from footfall.io.exports import export
from footfall.sequence.commands import LEG_JOINTS, Sequence
from tests.support.sequences import any_commands, bits, four_kinds, require_arguments, unchecked


def read_json(data: bytes) -> list[tuple[str, dict]]:
    rows = []
    for told in json.loads(data)["commands"]:
        given = {name: told[name] for name in ("leg", "joints", "duration") if told[name] is not None}
        rows.append((told["name"], given | ({"force": told["force"]} if "force" in told else {})))
    return rows


def read_csv(data: bytes) -> list[tuple[str, dict]]:
    rows = []
    for _, lines in groupby(csv.DictReader(io.StringIO(data.decode(), newline="")), lambda line: int(line["row"])):
        legs = list(lines)
        first = legs[0]
        told: dict = {"duration": float(first["duration_s"])}
        if first["leg"]:
            told["joints"] = [float(line[f"{joint}_rad"]) for line in legs for joint in LEG_JOINTS]
            if first["name"] == "POSTURE_MOVE":
                assert [int(line["leg"]) for line in legs] == list(range(6))
            else:
                told["leg"] = int(first["leg"])
        if first.get("force_N"):
            told["force"] = float(first["force_N"])
        assert len({(line["name"], line["duration_s"], line["phase"]) for line in legs}) == 1
        rows.append((first["name"], told))
    return rows


def read_seqjson(data: bytes) -> list[tuple[str, dict]]:
    rows = []
    for step in json.loads(data)["steps"]:
        assert all(arg["type"] == "number" for arg in step["args"])
        args = {arg["name"]: arg["value"] for arg in step["args"]}
        assert len(args) == len(step["args"])
        told = {name: args.pop(name) for name in ("leg", "duration", "force") if name in args}
        if args:
            whole = [f"leg{leg}_{joint}" for leg in range(6) for joint in LEG_JOINTS]
            assert list(args) == (whole if step["stem"] == "POSTURE_MOVE" else list(LEG_JOINTS))
            told["joints"] = list(args.values())
        rows.append((step["stem"], told))
    return rows


READERS = {"json": read_json, "csv": read_csv, "seqjson": read_seqjson}


@settings(max_examples=25)
@given(commands=any_commands(most=6))
@pytest.mark.parametrize("format", READERS)
def test_every_command_comes_back_bit_for_bit(format, commands):
    rows = READERS[format](export(unchecked(commands), format))
    assert [name for name, _ in rows] == [command.name for command in commands]
    for (_, told), command in zip(rows, commands, strict=True):
        require_arguments(told, command)


def test_seqjson_of_all_commands_keeps_its_schema(shared_data):
    schema = json.loads((shared_data / "seq-json-schema-1.3.1.schema.json").read_text())
    document = json.loads(export(four_kinds(), "seqjson"))
    jsonschema.Draft202012Validator(schema).validate(document)
    assert {step["stem"]: len(step["args"]) for step in document["steps"]} == {
        "LEG_MOVE": 8,
        "WAIT": 1,
        "POSTURE_MOVE": 37,
        "LEG_LOWER": 9,
    }
    assert document["metadata"]["units"]["force"] == "N"


def test_where_the_chassis_goes_is_told_where_it_goes(sequence):
    made = four_kinds()
    poses = np.tile(np.eye(4), (4, 1, 1))
    poses[2:, 2, 3] = -0.1
    moving = Sequence(
        made.robot, made.commands, made.start, made.predicted, made.T_site_base, (), Provenance({}), poses
    )
    told = json.loads(export(moving, "json"))["commands"]
    assert bits(np.ravel([one["predicted_T_site_base"] for one in told])) == bits(poses.ravel())
    final = json.loads(export(moving, "seqjson"))["metadata"]["final_T_site_base"]
    assert bits(np.ravel(final)) == bits(poses[-1].ravel())


def test_a_sequence_of_steps_is_written_as_it_always_was(sequence):
    header = export(sequence, "csv").decode().splitlines()[0]
    assert header.endswith("ankle_roll_rad")
    for format in ("json", "seqjson"):
        data = export(sequence, format).decode()
        assert "force" not in data
        assert "final_T_site_base" not in data
        assert "predicted_T_site_base" not in data
