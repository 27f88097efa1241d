"""The command line: results, JSON, exit codes 0, 1 and 2."""

import json
import re
import signal
import subprocess
import sys

import httpx
import pytest
from typer.testing import CliRunner

from footfall.cli import app
from footfall.io.terrain_files import read_terrain
from footfall.terrain.generate import plane
from tests.support.browsers import command_line
from tests.support.command_line import FOOTFALL, run
from tests.support.waiting import BOUND, until


def test_help_and_version():
    assert "replay" in run("--help").output
    assert run("--version").stdout.startswith("footfall 0.")
    run("no-such-command", code=2)
    run("map", code=2)


def test_it_runs_as_a_module_where_it_is_on_no_path():
    done = subprocess.run(
        [sys.executable, "-m", "footfall", "--version"], capture_output=True, text=True, timeout=BOUND
    )
    assert (done.returncode, done.stdout) == (0, run("--version").stdout)


@pytest.mark.parametrize(
    ("kind", "numbers"), [("walk", "X Y [YAW]"), ("gait", "X Y [YAW]"), ("route", "X Y"), ("step", "X Y")]
)
def test_help_shows_numbers_as_they_are_typed(kind, numbers):
    (said,) = [line for line in run("plan", kind, "--help").output.splitlines() if re.search("--(goal|target) ", line)]
    assert f" {numbers} " in said


def test_terrain_info_and_convert(level, tmp_path):
    about = json.loads(run("terrain", "info", level, "--json").stdout)
    assert (about["rows"], about["known"]) == (101, 1.0)
    assert "101 × 101" in run("terrain", "info", level).stdout
    run("terrain", "convert", level, tmp_path / "level.tif", "--scale", 2)
    assert read_terrain(tmp_path / "level.tif").geometry.resolution == pytest.approx(0.2)


def test_errors_are_one_line_and_exit_code_2(tmp_path):
    for arguments in (
        ["terrain", "info", tmp_path / "missing.tif"],
        ["terrain", "convert", __file__, tmp_path / "a.tif"],
        ["replay", tmp_path / "missing"],
        ["export", tmp_path],
        ["export", tmp_path / "missing.npz"],
        ["bench", "cooking"],
        ["serve", "--host", "0.0.0.0", "--data", tmp_path],
        ["serve", "--sample", "none-such", "--port", "0", "--data", tmp_path],
    ):
        result = run(*arguments, code=2)
        assert result.stdout == ""
        assert result.stderr.startswith("footfall: ")
        assert "Traceback" not in result.output
    error = json.loads(run("terrain", "info", tmp_path / "missing.tif", "--json", code=2).stdout)["error"]
    assert "missing.tif" in error["message"]


def test_a_sample_beside_a_session_is_refused(tmp_path):
    result = run("serve", "--sample", "rappel", "--session", "none-such", "--port", 0, "--data", tmp_path, code=2)
    assert "--sample opens a copy of a sample" in result.stderr


def test_serve_says_why_it_stays_on_this_computer(tmp_path):
    result = run("serve", "--host", "0.0.0.0", "--data", tmp_path, code=2)
    assert "without accounts FootFall serves this computer alone" in result.stderr


def test_map(level, tmp_path):
    answer = json.loads(run("map", level, "--leg", 2, "--out", tmp_path / "footing.png", "--json").stdout)
    assert answer["area_m2"]["stable"] > 0.1
    assert (tmp_path / "footing.png").read_bytes().startswith(b"\x89PNG")
    run("map", level, "--leg", 2, "--layer", "beauty", "--out", tmp_path / "a.png", code=2)
    run("map", level, "--leg", 9, code=2)


def test_plan_step_and_export(level, tmp_path):
    from footfall.io.robot_files import load_robot
    from footfall.planning.body.stand import stand
    from footfall.robot.ik import contact_point

    robot, dem = load_robot("athlete"), read_terrain(level)
    state = stand(robot, dem)
    x, y, _ = contact_point(robot, state.posture, 2, state.T_site_base)
    plan = tmp_path / "plan.npz"
    asked = ["plan", "step", level, "--leg", 2, "--target", x + 0.1, y + 0.1, "--seed", 1, "--out", plan, "--json"]
    answer = json.loads(run(*asked).stdout)
    assert answer["status"] == "found"
    again = json.loads(run(*asked).stdout)
    assert again["digest"] == answer["digest"]
    assert again["commands"] == answer["commands"]
    assert (answer["commands"]["mode"], answer["commands"]["status"]) == ("pose_held", "found")
    sequence = json.loads(run("export", plan, "--format", "seqjson").stdout)
    assert {one["stem"] for one in sequence["steps"]} >= {"POSTURE_MOVE", "LEG_LOWER"}
    rigid = json.loads(run(*asked, "--as-commanded").stdout)
    assert (rigid["digest"], rigid["commands"]["mode"]) == (answer["digest"], "rigid")
    steps = json.loads(run("export", plan, "--format", "seqjson").stdout)["steps"]
    assert {one["stem"] for one in steps} == {"LEG_MOVE"}
    said = run(*asked[:-1], "--as-commanded").stdout
    assert "as commanded: the rover sags; touch-down is not predicted" in said
    assert "pose held: " in run(*asked[:-1]).stdout
    raced = json.loads(run(*asked, "--planner", "race", "--goals", "clearance").stdout)
    assert raced["status"] == "found"
    assert raced["digest"] != answer["digest"]
    assert "motion, clearance" in run(*asked, "--goals", "prettiest", code=2).stderr
    run("export", plan, "--format", "csv", "--out", tmp_path / "steps.csv")
    run("export", plan, "--format", "docx", code=2)

    refused = run("plan", "step", level, "--leg", 2, "--target", 90, 90, "--out", plan, code=1)
    assert refused.stdout.startswith("off_map")
    run("export", plan, code=2)


def test_sessions_are_listed(tmp_path):
    assert json.loads(run("sessions", "--data", tmp_path, "--json").stdout)["sessions"] == []


def test_doctor_names_what_it_looked_at():
    result = CliRunner().invoke(app, ["doctor", "--json"])
    findings = {one["what"]: one for one in json.loads(result.stdout)["findings"]}
    assert findings["robot"]["ok"]
    assert findings["pin"]["ok"]
    assert result.exit_code == (0 if all(one["ok"] for one in findings.values()) else 1)


def test_bench_says_when_it_is_not_installed(monkeypatch):
    monkeypatch.setitem(sys.modules, "benchmarks.run", None)
    assert "source tree" in run("bench", code=2).stderr


def children_of(pid: int) -> list[int]:
    listed = subprocess.run(["ps", "-o", "pid=", "--ppid", str(pid)], capture_output=True, text=True, check=False)
    return [int(one) for one in listed.stdout.split()]


def runs(pid: int) -> bool:
    """Whether a process is there and has not ended; one that ended may wait long for init to take note."""
    listed = subprocess.run(["ps", "-o", "stat=", "-p", str(pid)], capture_output=True, text=True, check=False)
    return listed.stdout.strip()[:1] not in ("", "Z")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_serve_answers_and_leaves_nothing_behind(number, tmp_path):
    from footfall.session.registry import Sessions

    with Sessions(tmp_path) as sessions:
        live = sessions.create("served")
        live.terrains.load(plane(size=10.0, resolution=0.1))
        name = live.id
    command = [*FOOTFALL, "serve", "--port", "0", "--session", name, "--data", str(tmp_path), "--workers", "1"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        try:
            line = server.stdout.readline()
            assert line.startswith("FootFall answers on http://127.0.0.1:"), line
            url = line.split()[-1]
            current = f"{url}/api/v1/sessions/current"
            until(
                lambda: httpx.get(current, trust_env=False, verify=False).json()["link"]["connected"],
                "the rover on the link",
            )
            taken = subprocess.run(
                [*FOOTFALL, "serve", "--port", url.rsplit(":", 1)[1], "--data", str(tmp_path)],
                capture_output=True,
                text=True,
                check=False,
            )
            assert taken.returncode == 2
            assert "--port" in taken.stderr
            children = children_of(server.pid)
            assert len([one for one in children if "spawn_main" in command_line(one)]) == 1, "the worker asked for"
            with httpx.stream("GET", f"{url}/api/v1/sessions/current/events", trust_env=False, verify=False) as stream:
                next(stream.iter_lines())
                server.send_signal(number)
                assert server.wait(BOUND) == 0
            assert server.stderr is not None
            assert "Traceback" not in server.stderr.read()
        finally:
            server.kill()
    until(lambda: not [child for child in children if runs(child)], "the end of its processes")
