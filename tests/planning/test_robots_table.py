"""The table of docs/robots.md says what its command prints: rows are computed anew, but for physics and times."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.legged_walks import Asked, rows
from footfall.planning.legged.problem import LeggedSettings
from tests.support.robot_data import described

TABLE = Path(__file__).parents[2] / "docs" / "robots.md"
HEAD = "| robot | ground | stands | green cells of each leg's map |"
NOT_RUN = "not run"


def cells(row: str) -> list[str]:
    return [one.strip() for one in row.strip("|\n").split("|")]


def table() -> list[list[str]]:
    lines = TABLE.read_text("utf-8").splitlines()
    first = next(at for at, line in enumerate(lines) if line.startswith(HEAD))
    last = next(at for at in range(first, len(lines)) if not lines[at].startswith("|"))
    return [cells(line) for line in lines[first + 2 : last]]


@pytest.mark.parametrize("ground", ["smooth", "rough"])
def test_a_row_is_as_it_is_computed(ground: str) -> None:
    described("B1")  # skips where the robots are not installed
    settings = LeggedSettings(time_limit=1e5)
    with np.errstate(all="ignore"):
        [row] = rows(["B1"], Asked(3.0, (ground,), ("steps", "walk"), settings))
    *told, _ = cells(row)
    [*expected, _] = next(one for one in table() if one[:2] == ["B1", ground])
    assert len(told) == len(expected)
    compared = [(mine, theirs) for mine, theirs in zip(told, expected, strict=True) if mine != NOT_RUN]
    assert len(compared) == 7
    assert [mine for mine, _ in compared] == [theirs for _, theirs in compared]


def test_every_robot_that_was_tried_has_its_rows_or_is_told_to_have_none() -> None:
    text = TABLE.read_text("utf-8")
    tried = text.partition("## Robots that were tried")[2].partition("## ")[0]
    missing = text.partition("Not measured: ")[2].partition("\n")[0]
    lines = [cells(line) for line in tried.splitlines() if line.startswith("| ")]
    walkers = {one[0] for one in lines[2:] if one[1] != "refused"}
    assert len(walkers) > 8
    for name in walkers:
        found = [one[1] for one in table() if one[0] == name]
        assert found in (["smooth", "rough"], ["–"]) or name in missing, name
