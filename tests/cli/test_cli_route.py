"""`footfall plan route`: what it prints and writes, found and refused."""

import json
import math

import pytest

from footfall.io.artifacts import decode
from footfall.io.terrain_files import write_terrain
from footfall.planning.route.problem import RouteResult
from tests.support.chassis_ground import wavy
from tests.support.command_line import run


@pytest.fixture
def waves(tmp_path):
    path = tmp_path / "waves.npz"
    write_terrain(wavy(half=8.0), path)
    return path


def test_a_route_is_planned_told_and_written(waves, tmp_path):
    out = tmp_path / "route.npz"
    asked = ["plan", "route", waves, "--goal", 4, 1, "--out", out]
    answer = json.loads(run(*asked, "--json").stdout)
    stored = decode(out.read_bytes())
    assert isinstance(stored, RouteResult)
    assert (answer["status"], answer["digest"]) == ("found", stored.digest)
    assert stored.plan is not None
    assert stored.plan.length >= math.hypot(4, 1) - 1e-9
    said = run(*asked).stdout
    assert said.startswith("found\n")
    assert f"{stored.plan.length:.2f} m in {len(stored.plan.points) - 1} straight part" in said
    assert "    4.00     1.00\n" in said


def test_where_turning_costs_it_says_how_the_chassis_faces(waves, tmp_path):
    out = tmp_path / "route.npz"
    asked = ["plan", "route", waves, "--goal", 4, 1, "--cost", "feasible", "--turning", 0.5, "--out", out]
    said = run(*asked).stdout
    stored = decode(out.read_bytes())
    assert isinstance(stored, RouteResult)
    assert stored.plan is not None
    assert stored.plan.headings is not None
    facing = [line.split("facing ")[1] for line in said.splitlines() if "facing" in line]
    assert facing == [f"{math.degrees(heading):.0f}°" for heading in stored.plan.headings]


def test_a_refusal_is_an_answer_with_its_reason(waves):
    refused = run("plan", "route", waves, "--goal", 90, 90, code=1)
    assert refused.stdout.startswith("off_map: the goal (90, 90) lies off the map: the map spans x ")
