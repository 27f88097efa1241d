"""`footfall plan gait`: what it prints and writes, found and refused; what it wrote, exported."""

import json

import pytest

from footfall.io.artifacts import decode
from footfall.io.scripting import make_sequence
from footfall.io.terrain_files import write_terrain
from footfall.planning.gait.problem import TRIPOD, WAVE, GaitResult
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


def test_a_wave_is_exported_and_feet_that_move_together_are_not(waves, tmp_path):
    out = {gait: tmp_path / f"{gait}.npz" for gait in (WAVE, TRIPOD)}
    for gait, path in out.items():
        run("plan", "gait", waves, *SHORT, "--gait", gait, "--out", path)
    stored = decode(out[WAVE].read_bytes())
    assert isinstance(stored, GaitResult)
    assert stored.plan is not None
    told = json.loads(run("export", out[WAVE], "--out", tmp_path / "wave.json", "--json").stdout)
    assert told["sequence"] == make_sequence(stored.plan.walk).digest
    assert json.loads((tmp_path / "wave.json").read_text())["steps"]
    refused = run("export", out[TRIPOD], "--out", tmp_path / "tripod.json", code=2)
    assert "this gait moves several: ask for a wave" in refused.stderr
    assert not (tmp_path / "tripod.json").exists()


def test_a_gait_that_fails_says_where_and_by_how_much(tmp_path):
    path = tmp_path / "waves.npz"
    write_terrain(wavy(half=4.0), path)
    refused = run("plan", "gait", path, "--goal", 3.5, 0.0, "--gait", "wave", code=1)
    assert refused.stdout.startswith("no_path: step ")
    assert "fails footfall: no place to stand within the tolerance of leg " in refused.stdout
    assert "as far as it comes: steps " in refused.stdout
