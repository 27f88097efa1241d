"""The table of docs/robots.md is what FootFall says of those robots."""

from collections import Counter
from pathlib import Path

import pytest

from footfall.core.errors import InvalidRobot
from footfall.io.urdf.examine import examine
from footfall.io.urdf.read import read_urdf
from footfall.robot.legged.find_legs import legged_model
from footfall.robot.legged.finding import Grade
from tests.support.robot_data import OTHERS, QUADRUPEDS, described

PAGE = Path(__file__).resolve().parents[2] / "docs" / "robots.md"


def row(name: str) -> str:
    """The row of one robot: legs, soles, mass, findings of each grade, what is doubtful or unusable."""
    path = described(name)
    tree, findings = read_urdf(path), examine(path)
    try:
        model = legged_model(tree)
        legs = " + ".join(f"{len(group)} × {len(group[0].joints)} joints" for group in model.groups())
        soles = ", ".join(sorted({leg.sole.kind for leg in model.legs}))
    except InvalidRobot:
        legs, soles = "refused", "–"
    counts = [str(sum(one.grade is grade for one in findings)) for grade in Grade]
    about = Counter(one.check_name for one in findings if one.grade is not Grade.GOOD)
    told = ", ".join(f"{check} {count}" for check, count in about.items()) or "–"
    return f"| {name} | {legs} | {soles} | {tree.mass:.1f} | {' | '.join(counts)} | {told} |"


@pytest.mark.parametrize("name", [*QUADRUPEDS, *OTHERS])
def test_the_table_of_robots_is_what_they_are(name):
    assert row(name) in PAGE.read_text("utf-8").splitlines()


def test_the_table_has_no_other_robots():
    rows = [line for line in PAGE.read_text("utf-8").splitlines() if line.count(" | ") == 7]
    assert len(rows) == len(QUADRUPEDS) + len(OTHERS) + 2, "and two rows of its head"
