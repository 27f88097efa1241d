"""`footfall plan walk`: what it prints and writes, found and refused, and how a goal is said."""

import json
from pathlib import Path

import pytest

from footfall.cli.plan_walk import yaw_apart
from footfall.io.artifacts import decode
from footfall.io.terrain_files import write_terrain
from footfall.planning.walk.problem import WalkResult
from footfall.planning.walk_execution.problem import WalkExecutionResult
from tests.support.chassis_ground import wavy
from tests.support.command_line import run

SHORT = ("--goal", 0.4, 0.1, 0.0)
SAMPLE = Path(__file__).resolve().parents[2] / "sample_sessions" / "rock-step"


@pytest.fixture
def waves(tmp_path):
    path = tmp_path / "waves.npz"
    write_terrain(wavy(half=4.0), path)
    return path


def test_a_walk_is_planned_told_and_written(waves, tmp_path):
    out = tmp_path / "walk.npz"
    asked = ["plan", "walk", waves, *SHORT, "--seed", 3, "--out", out]
    answer = json.loads(run(*asked, "--json").stdout)
    assert (answer["status"], answer["goal"]["yaw"]) == ("found", 0.0)
    assert answer["provenance"]["settings"]["seed"] == 3
    stored = decode(out.read_bytes())
    assert isinstance(stored, WalkResult)
    assert stored.digest == answer["digest"]
    plan, figures = stored.plan, answer["figures"]
    assert plan is not None
    assert figures["foot_moves"] == len(plan.legs) == figures["steps"] / 2
    assert figures["chassis_way"] == pytest.approx(plan.chassis_way)
    assert figures["least_margin"] == pytest.approx(min(plan.margins))
    assert figures["largest_torque"] == pytest.approx(max(plan.torques))
    said = run(*asked).stdout
    assert decode(out.read_bytes()).digest == answer["digest"], "the same seed gives the same walk"
    assert f"{figures['foot_moves']} foot move" in said
    assert f" ({figures['steps']} steps), the chassis" in said
    assert f"the chassis goes {figures['chassis_way']:.2f} m" in said
    assert f"least margin {figures['least_margin']:.3f} m" in said
    assert f"largest torque {figures['largest_torque']:.0%} of its limit" in said
    assert "planned in " in said
    smoothed = answer["smoothed"]
    old, new = smoothed["before"], smoothed["after"]
    assert new["cost"] < old["cost"]
    assert f"smoothed: foot moves {old['foot_moves']} → {new['foot_moves']}, the chassis' way" in said
    assert f"largest torque {old['largest_torque']:.0%} → {new['largest_torque']:.0%}" in said
    assert said.startswith("found\n")
    steps = json.loads(run("export", out, "--format", "seqjson").stdout)["steps"]
    assert len(steps) == len(plan.waypoints) - 1
    assert {one["stem"] for one in steps} >= {"POSTURE_MOVE", "LEG_MOVE"}


def test_a_walk_is_commanded_for_sag_where_a_mode_is_asked_for(waves, tmp_path):
    out = tmp_path / "walk.npz"
    asked = ["plan", "walk", waves, *SHORT, "--seed", 3, "--out", out]
    rigid = json.loads(run(*asked, "--json").stdout)
    assert rigid["commands"] == {"mode": "rigid", "status": "found", "reason": "", "digest": None}
    answer = json.loads(run(*asked, "--mode", "pose_held", "--json").stdout)
    assert answer["digest"] == rigid["digest"]
    commands = answer["commands"]
    assert (commands["mode"], commands["status"], commands["reason"]) == ("pose_held", "found", "")
    assert all(check["holds"] for check in commands["checks"])
    stored = decode(out.read_bytes())
    assert isinstance(stored, WalkExecutionResult)
    assert stored.digest == commands["digest"]
    assert stored.execution is not None
    steps = json.loads(run("export", out, "--format", "seqjson").stdout)["steps"]
    assert sum(one["stem"] == "LEG_LOWER" for one in steps) == rigid["figures"]["foot_moves"]
    said = run(*asked, "--mode", "droop_aware").stdout
    assert "droop-aware: The leg is commanded" in said
    refused = run(*asked, "--mode", "as_commanded", code=2)
    assert "pose_held, droop_aware" in refused.stderr


def test_a_walk_as_it_was_found_and_one_near_a_posture(waves):
    found = json.loads(run("plan", "walk", waves, *SHORT, "--seed", 3, "--rounds", 0, "--json").stdout)
    tall = json.loads(run("plan", "walk", waves, *SHORT, "--seed", 3, "--posture", "tall", "--json").stdout)
    assert found["smoothed"] is None
    assert found["figures"]["chassis_way"] == pytest.approx(tall["smoothed"]["before"]["chassis_way"])
    assert tall["plan"]["Ts_site_base"][-1][2][3] > found["plan"]["Ts_site_base"][-1][2][3]
    assert "no posture 'kneel'" in run("plan", "walk", waves, *SHORT, "--posture", "kneel", code=2).stderr


def test_a_refusal_is_an_answer_with_its_reason(waves, tmp_path):
    out = tmp_path / "walk.npz"
    refused = run("plan", "walk", waves, "--goal", 90, 90, "--out", out, code=1)
    stored = decode(out.read_bytes())
    assert isinstance(stored, WalkResult)
    assert "a plan that was refused" in run("export", out, code=2).stderr
    assert refused.stdout.startswith(f"{stored.status.value}: {stored.reason}")
    told = json.loads(run("plan", "walk", waves, "--goal", 90, 90, "--json", code=1).stdout)
    assert (told["status"], told["plan"], told["figures"]) == (stored.status.value, None, None)
    assert told["reason"]


def test_a_payload_that_can_t_be_held_is_refused_with_its_mass_and_place(waves):
    load = ("--payload", 300, "--payload-at", 0, 9, 0.3)
    told = run("plan", "walk", waves, "--goal", 0.5, 0, *load, "--json", code=1).stdout
    assert "300 kg at (0, 9, 0.3) m" in json.loads(told)["reason"]
    assert "payload" in run("plan", "walk", waves, "--goal", 0.5, 0, "--payload-at", 0, 0, 0.3, code=2).stderr


def test_what_stopped_a_walk_and_how_far_it_comes_are_told(waves, monkeypatch, athlete):
    from footfall.planning.answers import Check, Status
    from footfall.planning.body.stand import stand
    from footfall.planning.walk.problem import Blocked
    from tests.support.short_walks import short_walk

    def as_far_as_it_comes(robot, dem, state, goal, **about):
        partial = short_walk(robot, dem, state)
        blocked = (Blocked("reach", 3, 1.25, -0.5, 7), Blocked("torque", None, float("nan"), float("nan"), 2))
        checks = (Check("reach", False, -0.04, "m", "leg 3"),)
        return WalkResult(
            Status.NO_PATH, None, "leg 3 is too short", checks, goal, partial.provenance, partial, blocked
        )

    monkeypatch.setattr("footfall.planning.walk.plan.plan_walk", as_far_as_it_comes)
    dem = wavy(half=4.0)
    partial = short_walk(athlete, dem, stand(athlete, dem, x=0.5, y=0.2, yaw=0.1))
    away = ((partial.Ts_site_base[-1, 0, 3] - 3.0) ** 2 + (partial.Ts_site_base[-1, 1, 3] - 1.0) ** 2) ** 0.5
    placed = ["--at", 0.5, 0.2, 0.1], ["--x", 0.5, "--y", 0.2, "--yaw", 0.1]
    for start in placed:
        said = run("plan", "walk", waves, "--goal", 3, 1, *start, code=1).stdout
        assert "no_path: leg 3 is too short" in said
        assert "NO  reach" in said
        assert "blocked 7 times by reach of leg 3 at (1.25, -0.50) m" in said
        assert "blocked 2 times by torque\n" in said
        assert f"as far as it comes, {away:.2f} m from the goal: 1 foot move (2 steps)" in said
    told = json.loads(run("plan", "walk", waves, "--goal", 3, 1, "--json", code=1).stdout)
    assert (told["figures"], told["partial_figures"]["foot_moves"]) == (None, 1)


def test_misuse_is_exit_code_2(waves):
    run("plan", "walk", waves, code=2)
    run("plan", "walk", waves, "--goal", 1, code=2)
    assert "time_limit" in run("plan", "walk", waves, "--goal", 1, 1, "--time-limit", 0, code=2).stderr
    assert "finite" in run("plan", "walk", waves, "--goal", 1, "nan", code=2).stderr
    run("plan", "walk", "no-such-terrain.npz", "--goal", 1, 1, code=2)


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        (["--goal", "1", "2", "0.5", "a.npz"], ["--goal", "1", "2", "--goal-yaw", "0.5", "a.npz"]),
        (["a.npz", "--goal", "1", "-2", "-.5"], ["a.npz", "--goal", "1", "-2", "--goal-yaw", "-.5"]),
        (["--goal", "1", "2", "a.npz"], ["--goal", "1", "2", "a.npz"]),
        (["a.npz", "--goal", "1", "2"], ["a.npz", "--goal", "1", "2"]),
        (["a.npz"], ["a.npz"]),
    ],
)
def test_a_goal_is_two_numbers_or_three(given, meant):
    assert yaw_apart(given) == meant


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["--at", 0, 0, 0, "--x", 1, "--yaw", 0.1], "--x, --yaw can't go with --at"),
        (["--tether-length", 5], "--tether-length say more of a tether, and there is none: give --tether"),
        (["--posture", "tall", "--rounds", 0], "--posture is come near by smoothing: give --rounds above 0"),
        (["--mode", "pose_held", "--tether", -3, 0, 4], "--mode can't go with --tether: how a rover sags on one"),
        (["--goal-yaw", 1], "the heading is said twice, by --goal-yaw and by the third number of --goal"),
        (["--goal-yaw=1"], "the heading is said twice"),
    ],
)
def test_an_option_that_would_say_nothing_is_refused(waves, given, said):
    assert said in run("plan", "walk", waves, *SHORT, *given, code=2).stderr


def test_plans_and_sessions_need_no_robot_or_terrain_to_be_exported(waves, tmp_path):
    out = tmp_path / "walk.npz"
    run("plan", "walk", waves, *SHORT, "--seed", 3, "--rounds", 0, "--out", out)
    assert "no plan of a robot of your own" in run("export", out, "--terrain", waves, code=2).stderr
    assert "--terrain are for plans" in run("export", SAMPLE, "--terrain", waves, code=2).stderr
    assert "--format can't go with --page" in run("export", SAMPLE, "--page", "--format", "csv", code=2).stderr


def test_a_rover_that_has_no_physics_has_no_gravity(waves):
    assert (
        "--gravity is of the world in physics" in run("sim", waves, "--kinematic", "--gravity", "moon", code=2).stderr
    )
