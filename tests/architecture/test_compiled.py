"""Compiled functions are made anew when anything changed that they were compiled with, and only then."""

import os
import subprocess
import sys

import pytest

from tests.support.waiting import BOUND

FILES = {
    "__init__.py": "",
    "constants.py": "STEP = 1.0\n",
    "callee.py": """
from footfall.compiled import njit
from thing.constants import STEP

@njit()
def next_after(x):
    return x + STEP
""",
    "caller.py": """
from footfall.compiled import njit
from thing.callee import (
    next_after,
)

@njit()
def third(x):
    return next_after(next_after(next_after(x)))
""",
    "aside.py": "OTHER = 1\n",
}


@pytest.fixture
def package(tmp_path):
    folder = tmp_path / "thing"
    folder.mkdir()
    for name, text in FILES.items():
        (folder / name).write_text(text)
    return folder


def third_of_ten(package):
    """What a new process answers, and how often it found its code on the disk."""
    return answered(package, "from thing.caller import third; print(third(10.0), sum(third.stats.cache_hits.values()))")


def answered(package, program):
    """The two numbers that a program prints in a new process."""
    kept = {name: text for name, text in os.environ.items() if not name.startswith("NUMBA_")}
    # Python takes its own compiled module for the present one if it has the same size and second of change
    answer = subprocess.run(
        [sys.executable, "-B", "-c", program],
        env={**kept, "PYTHONPATH": str(package.parent)},
        capture_output=True,
        text=True,
        timeout=BOUND,
        check=True,
    )
    value, hits = answer.stdout.split()
    return float(value), int(hits)


def test_unchanged_it_is_kept(package):
    assert third_of_ten(package) == (13.0, 0)
    assert third_of_ten(package) == (13.0, 1)
    (package / "aside.py").write_text("OTHER = 2\n")  # nothing of it is in there
    assert third_of_ten(package) == (13.0, 1)


@pytest.mark.parametrize(
    ("file", "old", "new"), [("callee.py", "x + STEP", "x * STEP"), ("constants.py", "STEP = 1.0", "STEP = 2.0")]
)
def test_a_change_in_what_it_calls_or_uses_makes_it_anew(package, file, old, new):
    assert third_of_ten(package) == (13.0, 0)
    (package / file).write_text(FILES[file].replace(old, new))
    assert third_of_ten(package) == (10.0 if file == "callee.py" else 16.0, 0)
    assert third_of_ten(package)[1] == 1


TAKER = """
from typing import NamedTuple
from footfall.compiled import njit

class Two(NamedTuple):
    one: float
    other: float

@njit()
def added(two):
    return two.one + two.other
"""


def test_a_class_that_was_renamed_since_keeps_nothing_from_running(package):
    """As after an update in place: what is kept names the class, and is only looked at where it is still good."""
    taker = package / "taker.py"
    program = "from thing.taker import added, {0}; print(added({0}(1.0, 2.0)), sum(added.stats.cache_hits.values()))"
    taker.write_text(TAKER)
    assert answered(package, program.format("Two")) == (3.0, 0)
    assert answered(package, program.format("Two")) == (3.0, 1)
    taker.write_text(TAKER.replace("Two", "Pair"))
    assert answered(package, program.format("Pair")) == (3.0, 0)
    assert answered(package, program.format("Pair")) == (3.0, 1)
