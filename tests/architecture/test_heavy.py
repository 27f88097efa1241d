"""What ``make quick`` leaves out is there, and leaves something of every pure layer in."""

from pathlib import Path

import pytest

from tests.architecture.test_structure import PURE
from tests.support.heavy import HEAVY

TESTS = Path(__file__).resolve().parents[1]


def test_every_heavy_file_is_there():
    assert [name for name in sorted(HEAVY) if not (TESTS / name).is_file()] == []


@pytest.mark.parametrize("layer", PURE)
def test_something_of_every_pure_layer_is_quick(layer):
    files = {f"{layer}/{path.name}" for path in (TESTS / layer).glob("test_*.py")}
    assert len(files - HEAVY) >= 3


def test_quick_is_about_the_pure_layers():
    makefile = (TESTS.parent / "Makefile").read_text("utf-8")
    (line,) = [one for one in makefile.splitlines() if one.startswith("PURE := ")]
    assert set(line.removeprefix("PURE := ").split()) == set(PURE)
