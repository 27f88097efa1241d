"""Examples of files in the documents are taken by the readers of such files; tables of names are those of the code."""

import json
import re
from itertools import takewhile
from pathlib import Path

import cv2
import numpy as np
import pytest

from footfall.io.any_robot import load_legged
from footfall.io.exports import TITLES
from footfall.io.pair_files import read_calibrated_pair
from footfall.io.sign_on_file import FILE, read_sign_on
from footfall.maps.refusals import NOTHING, OF_CHECK, REFUSALS
from footfall.planning.choice.onward import CHOOSERS
from footfall.planning.gait.problem import GAITS
from footfall.planning.step.problem import PLANNERS
from footfall.planning.walk_execution.decision import Act
from footfall.telemetry.command_kinds import KINDS
from footfall.telemetry.fields import FAULTS
from tests.support.command_line import run
from tests.support.documents import ROOT, SPAN
from tests.support.urdf import written
from tests.support.walkers import ring


def page(name: str) -> str:
    return (ROOT / "docs" / name).read_text("utf-8")


def examples(name: str, language: str) -> list[str]:
    """The fenced blocks of a language in a document."""
    return re.findall(rf"^```{language}\n(.*?)^```", page(name), re.M | re.S)


def rows(name: str, heading: str) -> list[str]:
    """The first cells of the table under a heading row."""
    under = page(name).partition(f"\n{heading}\n")[2].splitlines()[1:]
    return [line.split("|")[1].strip() for line in takewhile(lambda line: line.startswith("|"), under)]


def test_tables_of_a_robot_toml_are_read(tmp_path: Path) -> None:
    run("robot", "init", written(tmp_path, ring(4)), "--samples", 5)
    parts = examples("robots.md", "toml")
    assert [part.splitlines()[0] for part in parts] == ['[joints."front_left_knee"]', "[[payload]]", "[[cameras]]"]
    path = tmp_path / "robot.toml"
    path.write_text("\n".join([path.read_text("utf-8"), *parts]).replace("front_left_knee", "l0_yaw"), "utf-8")
    robot = load_legged(path)
    assert [camera.name for camera in robot.description.cameras] == ["front"]
    assert robot.efforts[robot.joint_names.index("l0_yaw")] == 30.0


def test_the_file_of_a_provider_is_read(tmp_path: Path) -> None:
    (example,) = examples("accounts.md", "toml")
    path = tmp_path / FILE
    path.write_text(example, "utf-8")
    path.chmod(0o600)
    found = read_sign_on(tmp_path)
    assert found is not None
    assert found.roles == {"viewer": ("staff",), "commander": ("rover-drivers",)}


def test_the_calibration_of_one_pair_is_read(tmp_path: Path) -> None:
    (example,) = examples("calibration.md", "json")
    assert set(json.loads(example)) == {"focal_length", "cx", "cy", "baseline", "doffs"}
    (tmp_path / "pair.json").write_text(example, "utf-8")
    for side in ("left", "right"):
        cv2.imwrite(str(tmp_path / f"{side}.png"), np.zeros((500, 740), np.uint8))
    pair = read_calibrated_pair(*(tmp_path / one for one in ("left.png", "right.png", "pair.json")))
    assert pair.baseline == pytest.approx(0.193)


@pytest.mark.parametrize(
    ("document", "heading", "names"),
    [
        ("rover-link.md", "| kind | what |", FAULTS),
        ("rover-link.md", "| name | leg, joints, force | what it does |", KINDS),
        ("exports.md", "| command | arguments | what it does |", KINDS),
        ("gaits.md", "| gait | feet in the air | duty factor |", GAITS),
        ("choosing-gaits.md", "| `choose_by` | each piece is gone by |", CHOOSERS),
        ("walking.md", "| decision | because |", [act.value for act in Act]),
        ("robots.md", "| check | how |", OF_CHECK),
    ],
)
def test_a_table_names_all_that_there_are(document: str, heading: str, names) -> None:
    told = [name for cell in rows(document, heading) for name in SPAN.findall(cell) or [cell]]
    assert sorted(told) == sorted(names)


def test_formats_of_exports_are_all_told() -> None:
    heading = "| format | extension | what proves it (in the tests) | numbers | what it can't say |"
    assert sorted(name.strip("`") for name in rows("exports.md", heading)) == sorted(TITLES)


def test_classes_of_maps_of_robots_of_ones_own_are_all_told() -> None:
    told = {*rows("robots.md", "| class | the cell |"), *OF_CHECK}
    assert told == {one.name for code, one in REFUSALS.items() if code != NOTHING}


def test_planners_are_all_told() -> None:
    listed = page("planners.md").partition("## The planners\n")[2].partition("\n## ")[0]
    told = {
        name for line in listed.splitlines() if line.startswith("- ") for name in SPAN.findall(line.partition(":")[0])
    }
    assert told == set(PLANNERS)
