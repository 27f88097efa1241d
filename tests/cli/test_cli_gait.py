"""`footfall plan gait`: what it prints and writes, found and refused."""

import json

import pytest

from footfall.io.artifacts import decode
from footfall.io.terrain_files import write_terrain
from footfall.planning.gait.problem import GaitResult
from tests.support.chassis_ground import wavy
from tests.support.command_line import run

SHORT = ("--goal", 0.3, 0.1, 0.0)


@pytest.fixture
def waves(tmp_path):
    path = tmp_path / "waves.npz"
    write_terrain(wavy(half=5.0), path)
    return path


def test_a_gait_is_planned_told_and_written(waves, tmp_path):
    out = tmp_path / "gait.npz"
    asked = ["plan", "gait", waves, *SHORT, "--gait", "ripple", "--out", out]
    answer = json.loads(run(*asked, "--json").stdout)
    assert (answer["status"], answer["goal"]["yaw"], answer["failure"]) == ("found", 0.0, None)
    stored = decode(out.read_bytes())
    assert isinstance(stored, GaitResult)
    assert stored.digest == answer["digest"]
    plan, figures = stored.plan, answer["figures"]
    assert plan is not None
    assert figures["steps"] == len(plan.groups)
    assert figures["feet_moved"] == sum(len(group) for group in plan.groups)
    assert figures["largest_torque"] == pytest.approx(max(plan.torques))
    said = run(*asked).stdout
    assert decode(out.read_bytes()).digest == answer["digest"]
    assert said.startswith("found\n")
    assert f"all the way: steps {figures['steps']}, feet moved {figures['feet_moved']}" in said
    assert "planned in " in said


def test_a_gait_that_fails_says_where_and_by_how_much(tmp_path):
    path = tmp_path / "waves.npz"
    write_terrain(wavy(half=4.0), path)
    refused = run("plan", "gait", path, "--goal", 3.5, 0.0, "--gait", "wave", code=1)
    assert refused.stdout.startswith("no_path: step ")
    assert "fails footfall: no place to stand within the tolerance of leg " in refused.stdout
    assert "as far as it comes: steps " in refused.stdout
