"""F Prime: NASA's compiler takes the text and the dictionary, and its binary holds every argument bit for bit.

The compiler takes missing and surplus arguments with exit code 0, so the comparison is the check.
"""

import json
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from footfall.core.errors import InvalidSequence
from footfall.io.exports import export
from footfall.sequence.commands import Sequence
from tests.support.sequences import HOSTILE, any_commands, four_kinds, recorded, require_arguments, unchecked
from tests.support.waiting import BOUND

COMPILER = Path(sys.executable).with_name("fprime-seqgen")


def compiled(sequence: Sequence, folder: Path, text: bytes | None = None) -> bytes:
    """The binary that the compiler makes of an export (or of ``text``)."""
    (folder / "step.seq").write_bytes(text or export(sequence, "fprime"))
    (folder / "step.json").write_bytes(export(sequence, "fprime-dictionary"))
    done = subprocess.run(
        [COMPILER, "--dictionary", folder / "step.json", folder / "step.seq", folder / "step.bin"],
        capture_output=True,
        text=True,
        timeout=BOUND,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return (folder / "step.bin").read_bytes()


def decoded(binary: bytes, dictionary: dict) -> list[tuple[str, dict]]:
    """The commands of a binary sequence: Svc/CmdSequencer's format, read with the dictionary's types."""
    size, count, timebase, context = struct.unpack_from(">IIHB", binary)
    assert size + 11 == len(binary)
    assert (timebase, context) == (0xFFFF, 0xFF)
    assert zlib.crc32(binary[:-4]) == struct.unpack(">I", binary[-4:])[0]
    sizes = {one["qualifiedName"]: one["size"] for one in dictionary["typeDefinitions"]}
    commands = {one["opcode"]: one for one in dictionary["commands"]}
    found, at = [], 11
    for _ in range(count):
        relative, s, us, length, packet, opcode = struct.unpack_from(">BIIIHI", binary, at)
        assert (relative, s, us, packet) == (1, 0, 0, 0)
        told, end = {}, at + 13 + length
        at += 19
        for param in commands[opcode]["formalParams"]:
            kind = param["type"]["name"]
            form = {"U8": ">B", "F64": ">d"}.get(kind) or f">{sizes[kind]}d"
            numbers = struct.unpack_from(form, binary, at)
            told[param["name"]] = list(numbers) if kind in sizes else numbers[0]
            at += struct.calcsize(form)
        assert at == end
        found.append((commands[opcode]["name"], told))
    assert at == len(binary) - 4
    return found


def require_compiles(sequence: Sequence, folder: Path) -> None:
    require_same(compiled(sequence, folder), sequence)


def require_same(binary: bytes, sequence: Sequence) -> None:
    found = decoded(binary, json.loads(export(sequence, "fprime-dictionary")))
    assert len(found) == len(sequence.commands)
    for (name, told), command in zip(found, sequence.commands, strict=True):
        assert name == f"FootFall.{command.name}"
        require_arguments(told, command)


@pytest.mark.parametrize("name", ["rock-step", "edited-export"])
def test_a_recorded_step_compiles(name, tmp_path):
    require_compiles(recorded(name), tmp_path)


@settings(max_examples=6)
@given(commands=any_commands(least=8, most=24))
def test_any_numbers_compile(commands, tmp_path_factory):
    require_compiles(unchecked(commands), tmp_path_factory.mktemp("seq"))


def test_names_from_files_stay_comments(tmp_path):
    hostile = "".join(HOSTILE)
    sequence = four_kinds(robot=hostile, phase=hostile)
    require_compiles(sequence, tmp_path)
    text = export(sequence, "fprime").decode("ascii")
    assert len(text.splitlines()) == 3 + len(sequence.commands)


@pytest.mark.parametrize(
    ("there", "changed"), [(b", 4.25 ;", b" ;"), (b", 4.25 ;", b", 4.5 ;"), (b"MOVE 2,", b"MOVE 3,")]
)
def test_the_comparison_sees_what_the_compiler_lets_pass(there, changed, tmp_path):
    sequence = four_kinds()
    text = export(sequence, "fprime")
    assert text.count(there) == 1
    binary = compiled(sequence, tmp_path, text.replace(there, changed))  # exit code 0, a missing argument too
    with pytest.raises((AssertionError, KeyError, struct.error)):
        require_same(binary, sequence)


def test_the_dictionary_fits_the_number_of_legs():
    four = unchecked(four_kinds().commands[:1], start=np.zeros(24))
    types = json.loads(export(four, "fprime-dictionary"))["typeDefinitions"]
    assert [one["size"] for one in types] == [6, 24]


@pytest.mark.parametrize("format", ["fprime", "fprime-dictionary"])
def test_a_broken_rule_is_not_exported(format):
    empty = unchecked(())
    with pytest.raises(InvalidSequence, match="no commands"):
        export(empty, format)
