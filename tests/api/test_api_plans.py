"""Plans over REST: what can be asked for, bad input, alternatives, points to pass, going on, a dead worker."""

import multiprocessing
import os
import re
import signal
from dataclasses import replace

import numpy as np
import pytest

from footfall.core.frames import apply
from footfall.io.robot_files import load_robot
from footfall.planning.body.stand import stand
from footfall.planning.step.problem import GOAL_ORDERS, PLANNERS, StepSettings
from footfall.robot.kinematics import wheel_centers
from footfall.terrain.from_arrays import from_heights
from tests.support.chassis_ground import wavy
from tests.support.jobs import finished, result
from tests.support.kept_workers import end_spare
from tests.support.problems import problem
from tests.support.server import Running, running_server
from tests.support.waiting import until

LEG = 2
SESSION = "/sessions/current"
PLANS = f"{SESSION}/plans"


@pytest.fixture
def target(standing):
    """A footfall a little beside the wheel; a what-if that a test leaves is ended."""
    state = standing.get(f"{SESSION}/state").json()
    x, y = wheel(standing, state)
    yield [float(x) + 0.2, float(y) + 0.05]
    if standing.get(SESSION).json()["what_if"] is not None:
        standing.delete(f"{SESSION}/what-if")


def wheel(client, state):
    robot = load_robot(client.get("/robot").json()["name"])
    return apply(np.array(state["T_site_base"]), wheel_centers(robot, np.array(state["posture"])))[LEG, :2]


def planned(client, target, **more):
    return result(client, finished(client, client.post(PLANS, json={"leg": LEG, "target": target, **more})))


def test_what_can_be_asked_for_is_served(standing):
    served = standing.get("/planners").json()
    assert served["planners"] == dict(PLANNERS)
    assert served["settings"]["lift"] == StepSettings().lift
    assert served["settings"]["branch"] is None
    assert served["goals"] == dict(GOAL_ORDERS)
    assert served["settings"]["goals"] in served["goals"]
    # every name that is served is taken, and so are the defaults
    for name in served["planners"]:
        StepSettings(**{**served["settings"], "planner": name})
    assert list(served["alternatives"]) == ["higher_lift", "other_knee", "more_clearance"]


def test_a_plan_says_what_was_tried_and_taken(standing, target):
    answer = planned(standing, target)
    assert answer["status"] == "found", answer["reason"]
    assert {(one["about"], one["taken"]) for one in answer["decisions"]} >= {("goal", True), ("planner", True)}


def test_planners_race_to_the_posture_with_the_most_room_where_that_is_asked_for(standing, target):
    answer = planned(standing, target, settings={"planner": "race", "goals": "clearance"})
    assert answer["status"] == "found", answer["reason"]
    used = answer["provenance"]["settings"]
    assert (used["planner"], used["goals"]) == ("race", "clearance")
    assert answer["plan"]["planner"] not in ("auto", "race")
    taken = {one["about"]: one["text"] for one in answer["decisions"] if one["taken"]}
    assert "by clearance" in taken["goal"]
    assert taken["planner"] == f"{answer['plan']['planner']} found the swing in turn 1 of the race"


@pytest.mark.parametrize(
    ("body", "kind", "said"),
    [
        ({"settings": {"time_limit": 0}}, "invalid-input", "time_limit must be above zero"),
        ({"settings": {"time_limit": 0.0}}, "invalid-input", "time_limit must be above zero"),
        ({"settings": {"time_limit": -1.0}}, "invalid-input", "time_limit must be above zero"),
        ({"settings": {"planner": "teleport"}}, "invalid-input", "planner is one of auto, line"),
        ({"settings": {"planner": "races"}}, "invalid-input", "bitstar, race"),
        ({"settings": {"goals": "prettiest"}}, "invalid-input", "goals is one of motion, clearance"),
        ({"settings": {"goals": None}}, "validation", "goals"),
        ({"settings": {"branch": 8}}, "invalid-input", "branch is 0…7"),
        ({"settings": {"branch": 1.5}}, "validation", "branch"),
        ({"through": [[1.0, 2.0]]}, "validation", "through"),
        ({"through": [[0.0, 0.0, 1.0]] * 21}, "validation", "through"),
        ({"after": 3}, "validation", "after"),
    ],
)
def test_what_makes_no_sense_is_refused_and_nothing_is_lost(standing, target, body, kind, said):
    kept = planned(standing, target)["digest"]
    events = standing.get(SESSION).json()["events"]
    document = problem(standing.post(PLANS, json={"leg": LEG, "target": target, **body}), 422, kind)
    assert said in document["detail"]
    after = standing.get(SESSION).json()
    assert (after["plan"]["digest"], after["events"]) == (kept, events)


def test_targets_off_the_map_and_on_unknown_ground_are_answers(standing, standing_server: Running, target):
    off = planned(standing, [90.0, 0.0])
    assert off["status"] == "off_map"
    assert "m off the map; the map spans x -4.0" in off["reason"]
    live = standing_server.sessions.current
    assert live is not None
    dem = live.get(live.state.dem or "")
    heights = np.array(dem.heights)  # type: ignore[union-attr]
    grid = dem.geometry  # type: ignore[union-attr]
    row, col = grid.cell(*target)
    heights[row, col] = np.nan
    live.terrains.load(from_heights(heights, grid.resolution, grid.x0, grid.y0, "hole"), "a hole at the target")
    try:
        unknown = planned(standing, target)
        assert unknown["status"] == "unknown_ground"
        assert "is unknown; take images that show it, or choose a place" in unknown["reason"]
    finally:
        live.terrains.undo()


def test_starts_that_can_not_be_say_the_way_out(standing, standing_server: Running, target):
    live = standing_server.sessions.current
    assert live is not None
    real = live.get(live.state.state or "")
    try:
        sunk = np.array(real.posture)  # type: ignore[union-attr]
        sunk[6 * LEG + 1] += 0.15
        live.stances.set(replace(real, posture=sunk))  # type: ignore[type-var]
        answer = planned(standing, target)
        assert answer["status"] == "start_invalid"
        assert re.search(r"leg2_wheel cuts 0\.\d{3} m into terrain \(0\.030 m is allowed\)", answer["reason"])
        assert "the smallest way out found: lift the wheel straight up by 0." in answer["reason"]
        beyond = np.array(real.posture)  # type: ignore[union-attr]
        beyond[8] = live.robot.upper[8] + 0.1
        live.stances.set(replace(real, posture=beyond))  # type: ignore[type-var]
        answer = planned(standing, target)
        assert answer["status"] == "start_invalid"
        assert f"{live.robot.joint_names[8]} is 0.1 rad outside its limits" in answer["reason"]
        assert "turn it down to" in answer["reason"]
    finally:
        live.stances.set(real)  # type: ignore[arg-type]


def test_alternatives_are_compared_and_chosen(standing, target):
    first = planned(standing, target)["digest"]
    assert [one["digest"] for one in standing.get(PLANS).json()] == [first]
    asked = standing.post(f"{PLANS}/current/alternatives", json={})
    assert asked.status_code == 202
    ids = [job["id"] for job in asked.json()["jobs"]]
    until(lambda: all(standing.get(f"/jobs/{one}").json()["state"] == "done" for one in ids), "the alternatives")
    listed = standing.get(PLANS).json()
    assert sorted(one["kind"] for one in listed) == ["asked", "higher_lift", "more_clearance", "other_knee"]
    by_kind = {one["kind"]: one for one in listed}
    for one in listed:
        answer = standing.get(f"{PLANS}/{one['digest']}").json()
        checks, extra = answer["checks"], answer["provenance"]["settings"]["clearance"]
        if one["figures"] is None:
            assert one["reason"]
            continue
        told = [check["margin"] for check in checks if "collision" in check["name"] and check["margin"] is not None]
        assert one["figures"]["clearance"] == pytest.approx(min(told) + extra)
        assert 0 < one["figures"]["duration"] < 300
    higher = by_kind["higher_lift"]
    assert higher["figures"]["length"] > by_kind["asked"]["figures"]["length"] + 0.15
    chosen = standing.put(f"{PLANS}/current", json={"plan": higher["digest"]}).json()
    assert [one["digest"] for one in chosen if one["chosen"]] == [higher["digest"]]
    assert standing.get(f"{PLANS}/current").json()["digest"] == higher["digest"]
    problem(standing.put(f"{PLANS}/current", json={"plan": "nothing"}), 404, "not-found")
    document = problem(standing.post(f"{PLANS}/current/alternatives", json={"kinds": ["nicer"]}), 422, "invalid-input")
    assert "higher_lift, other_knee, more_clearance" in document["detail"]


def test_the_wheel_is_led_through_a_point(standing, target):
    planned(standing, target)
    path = standing.get(f"{PLANS}/current/wheel-path").json()
    assert len(path["points"]) == len(path["phases"])
    swing = [point for point, phase in zip(path["points"], path["phases"], strict=True) if phase == "swing"]
    point = [swing[0][0], swing[0][1], swing[0][2] + 0.12]
    answer = planned(standing, target, through=[point])
    assert answer["status"] == "found", answer["reason"]
    assert answer["through"] == [point]
    points = np.array(standing.get(f"{PLANS}/current/wheel-path").json()["points"])
    assert np.linalg.norm(points - point, axis=1).min() < 1e-9
    assert all(check["holds"] for check in answer["checks"])


def test_a_step_is_planned_from_the_end_of_another(standing, target):
    first = planned(standing, target)
    before = standing.get(SESSION).json()["state"]
    second = planned(standing, [target[0] - 0.1, target[1] - 0.1], after=first["digest"])
    assert second["status"] == "found", second["reason"]
    assert second["plan"]["waypoints"][0] == first["plan"]["waypoints"][-1]
    about = standing.get(SESSION).json()
    assert about["after"] == first["digest"]
    assert about["state"] == second["provenance"]["parents"]["state"] != before
    assert standing.delete(f"{SESSION}/what-if").json() == {"state": before}
    # the same, first going there and then looking around
    assert standing.put(f"{SESSION}/what-if/after", json={"after": first["digest"]}).json()["state"] == about["state"]
    problem(standing.put(f"{SESSION}/what-if/after", json={"after": "nothing"}), 404, "not-found")


def _stand(sessions):
    live = sessions.create("killed")
    dem = wavy(half=4.0)
    live.terrains.load(dem, "made for the test")
    live.stances.set(stand(live.robot, dem))


def test_a_worker_killed_under_a_real_plan(tmp_path):
    """The server says so, keeps what it had, and plans the next step."""
    end_spare()  # so that those of this server are new
    others = set(multiprocessing.active_children())
    with running_server(tmp_path, prepare=_stand) as running, running.client() as client:
        x, y = wheel(client, client.get(f"{SESSION}/state").json())
        target = [float(x) + 0.2, float(y) + 0.05]
        kept = planned(client, target)["digest"]
        endless = {"planner": "sbl", "milestones": 10**9, "radius": 1e-6, "time_limit": 600.0}
        job = client.post(PLANS, json={"leg": LEG, "target": target, "settings": endless}).json()

        def searching():
            return "planning the swing" in client.get(f"/jobs/{job['id']}").json()["text"]

        def ended():
            now = client.get(f"/jobs/{job['id']}").json()
            return now if now["state"] not in ("queued", "running") else None

        until(searching, "the search")
        for worker in set(multiprocessing.active_children()) - others:
            if worker.pid is not None:
                os.kill(worker.pid, signal.SIGKILL)
        failed = until(ended, "the end of the job")
        assert failed["state"] == "failed"
        assert failed["error"]["kind"] == "worker-lost"
        assert "died while it made the plan" in failed["error"]["message"]
        assert client.get(SESSION).json()["plan"]["digest"] == kept
        assert planned(client, target)["digest"] == kept


def test_a_refusal_for_unknown_ground_names_a_place_that_can_be_planned(standing, target):
    x, y = target
    hole = {"center": [x + 0.05, y], "radius": 0.08}
    assert standing.post(f"{SESSION}/terrains/clear", json=hole).status_code < 300
    try:
        refused = planned(standing, target)
        assert refused["status"] == "unknown_ground"
        instead = refused["instead"]
        assert instead["of"] in ("ground", "maps")
        assert f"at ({instead['x']:.3f}, {instead['y']:.3f})" in refused["reason"]
        assert planned(standing, [instead["x"], instead["y"]])["instead"] is None
        assert planned(standing, [instead["x"], instead["y"]])["status"] != "unknown_ground"
    finally:
        standing.post(f"{SESSION}/terrains/undo", json={})
