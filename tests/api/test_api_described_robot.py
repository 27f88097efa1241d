"""A hexapod that others described, over REST: stance, maps, step, commands, files, rover, walk, stop, replay."""

import csv
import io
import json

import httpx
import numpy as np
import pytest

from footfall.core.frames import apply
from footfall.maps import refusals
from footfall.maps.layers import REACHABLE_STABLE, MapStack
from footfall.planning.legged.measured import standing_state
from footfall.robot.legged.posture import placed
from footfall.session.replay.recompute import replay
from footfall.telemetry.link import HelloMessage, message_object
from footfall.telemetry.state import RobotState, TelemetryFrame
from footfall.terrain.dem import Dem
from footfall.terrain.generate import fractal
from tests.support.described import robot_of
from tests.support.jobs import carried_out, finished, result, run_compared
from tests.support.problems import problem
from tests.support.server import Running, running_server
from tests.support.waiting import until

SESSION = "/sessions/current"
LEGS = 6
MOVED = 1


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    def prepare(sessions) -> None:
        live = sessions.create("hexapod", robot_of(LEGS)[1])
        live.terrains.load(fractal(2.4, 0.2, roughness=0.01, seed=3), "made for the tests")

    with running_server(tmp_path_factory.mktemp("sessions"), prepare=prepare) as running:
        yield running


@pytest.fixture(scope="module")
def rest(server: Running):
    with server.client() as client:
        yield client


@pytest.fixture(scope="module")
def step(rest: httpx.Client):
    """The answer to a step from the stance at ease."""
    assert rest.post(f"{SESSION}/state", json={"stand": {}}).status_code == 201
    stands = rest.get(f"{SESSION}/state").json()
    _, robot = robot_of(LEGS)
    assert len(stands["posture"]) == len(robot.joint_names) == 18
    assert stands["described"]["legs"] == list(robot.leg_names)
    return _stepped(rest)


def _stepped(rest: httpx.Client) -> dict:
    live = rest.get(f"{SESSION}/state").json()
    _, robot = robot_of(LEGS)
    sole = _soles(robot, live)[MOVED]
    order = {"leg": MOVED, "target": [sole[0] + 0.03, sole[1] + 0.02]}
    answer = result(rest, finished(rest, rest.post(f"{SESSION}/described-steps", json=order)))
    assert answer["status"] == "found", answer["reason"]
    return answer


def _soles(robot, state: dict) -> np.ndarray:
    return apply(np.array(state["T_site_base"]), placed(robot, state["posture"]).soles)


def _made(rest: httpx.Client, plan: str) -> tuple[dict, str]:
    made = rest.post(f"{SESSION}/sequences", json={"plan": plan})
    assert made.status_code == 201, made.text
    assert made.json()["valid"], made.json()["rules"]
    return made.json(), made.headers["location"].removeprefix("/api/v1")


def test_a_session_is_about_it(server, rest, step):
    told = rest.get(SESSION).json()
    _, robot = robot_of(LEGS)
    assert told["robot"] == {"name": "ring", "digest": robot.digest}
    assert told["described_step"] == step["digest"]
    assert told["way_of_commands"]["mode"] == "rigid"
    assert "does not say how its joints give way" in told["way_of_commands"]["reason"]
    assert told["played"] == step["digest"]
    offered = told["to_command"]
    assert (offered["kind"], offered["plan"], offered["leg"]) == ("described_step", step["digest"], MOVED)
    assert offered["text"] == f"leg {MOVED}"
    assert (told["planned_for"]["footfall"]["leg"], told["planned_for"]["goal"]) == (MOVED, None)


def test_its_legs_and_joints_are_told_as_far_as_anybody_says(server, rest):
    told, (_, robot) = rest.get("/robot").json(), robot_of(LEGS)
    assert (told["name"], told["digest"]) == (robot.name, robot.digest)
    assert (told["athletes_build"], told["legs"]) == (False, LEGS)
    assert told["leg_names"] == list(robot.leg_names)
    assert told["joint_names"] == list(robot.joint_names)
    assert told["leg_joints"] == [[3 * leg, 3 * leg + 1, 3 * leg + 2] for leg in range(LEGS)]
    assert set(told["joint_units"]) == {"rad"}
    assert (told["lower"], told["upper"]) == (robot.lower.tolist(), robot.upper.tolist())
    assert told["torque_limits"] == [60.0] * 18
    assert told["foot_radii"] == [0.02] * LEGS
    assert told["mass"] == robot.mass
    assert told["planned_by"] == {
        "step": {"kind": "described_step", "folder": "described-steps"},
        "walk": {"kind": "described_walk", "folder": "described-walks"},
    }
    unsaid = {name for name, one in told.items() if one is None or one in ([], {})}
    assert unsaid == {"wheel_radius", "stiffness", "leg_lengths", "T_base_hips", "postures", "cameras", "assumed"}


def test_maps_are_green_where_a_step_leads(server, rest, step):
    made = finished(rest, rest.post(f"{SESSION}/maps", json={"leg": MOVED}))
    live = server.sessions.current
    maps = live.typed(MapStack, made["result"])
    assert rest.get(SESSION).json()["maps"] == {str(MOVED): maps.digest}
    rows, cols = np.nonzero(maps.layers["footing"] == REACHABLE_STABLE)
    assert len(rows)
    x, y = maps.geometry.xs[cols[0]], maps.geometry.ys[rows[0]]
    chosen = rest.post(f"{SESSION}/footfalls", json={"leg": MOVED, "x": x, "y": y})
    assert chosen.status_code == 200, chosen.text
    answer = result(rest, finished(rest, rest.post(f"{SESSION}/described-steps", json={"leg": MOVED})))
    assert answer["status"] == "found", answer["reason"]
    settings = problem(rest.post(f"{SESSION}/maps", json={"leg": 0, "settings": {"window": 0.5}}), 422, "invalid-input")
    assert "ATHLETE's legs" in settings["detail"]


def test_every_refused_cell_says_why(server, rest, step):
    made = finished(rest, rest.post(f"{SESSION}/maps", json={"leg": MOVED}))
    maps = server.sessions.current.typed(MapStack, made["result"])
    refused = maps.layers["refused_by"]
    for code in np.unique(refused[refused != refusals.NOTHING]):
        row, col = np.argwhere(refused == code)[0]
        chosen = {"leg": MOVED, "x": float(maps.geometry.xs[col]), "y": float(maps.geometry.ys[row])}
        answer = rest.post(f"{SESSION}/footfalls", json=chosen)
        assert answer.status_code == 200, answer.text
        assert not answer.json()["acceptable"]
        assert any(refusals.REFUSALS[int(code)].text in reason for reason in answer.json()["reasons"])


def test_every_file_names_its_joints(rest, step):
    _, robot = robot_of(LEGS)
    _, address = _made(rest, step["digest"])
    texts = {
        name: rest.get(f"{address}/export", params={"format": name}) for name in ("json", "csv", "seqjson", "fprime")
    }
    assert {answer.status_code for answer in texts.values()} == {200}
    for name in ("json", "seqjson"):
        assert all(f'"{joint}"' in texts[name].text for joint in robot.joint_names), name
    table = csv.DictReader(io.StringIO(texts["csv"].text))
    columns = table.fieldnames or []
    assert [one for one in columns if one.removesuffix("_rad") in robot.joint_names] == [
        f"{one}_rad" for one in robot.joint_names
    ]
    assert {row["leg"] for row in table} <= {"", *robot.leg_names}
    recorded = rest.get(f"{address}/export", params={"format": "ros2"})
    assert recorded.status_code == 200
    assert all(joint.encode() in recorded.content for joint in robot.joint_names[3:6])
    assert json.loads(texts["json"].text)["layout"]["legs"]
    for name, why in (("yamcs", "names no joints"), ("html", "pictures are of ATHLETE's legs")):
        refused = problem(rest.get(f"{address}/export", params={"format": name}), 422, "invalid-sequence")
        assert why in refused["detail"], refused


def test_its_commands_are_edited_row_by_row_and_undone(server, rest, step):
    before, address = _made(rest, step["digest"])

    def edited(**edit) -> dict:
        tag = {"if-match": rest.get(address).headers["etag"]}
        answer = rest.patch(address, json={"edit": edit}, headers=tag)
        assert answer.status_code == 200, answer.text
        return answer.json()

    rows = before["commands"]
    moves = [row for row, one in enumerate(rows) if one["name"] == "LEG_MOVE"]
    waits = edited(kind="insert", row=1, command={"name": "WAIT", "duration": 2.0})
    assert waits["valid"], waits["rules"]
    assert [one["name"] for one in waits["commands"][:2]] == [rows[0]["name"], "WAIT"]
    assert waits["predicted"][-1] == before["predicted"][-1]
    slower = edited(kind="duration", row=0, number=rows[0]["duration"] + 1.5)
    assert slower["commands"][0]["duration"] == rows[0]["duration"] + 1.5
    halves = edited(kind="split", row=moves[1] + 1)
    assert halves["valid"], halves["rules"]
    assert len(halves["commands"]) == len(rows) + 2
    assert halves["predicted"][-1] == before["predicted"][-1]

    down = moves[-1] + 2
    joints = halves["commands"][down]["joints"]
    assert len(joints) == 3
    lower = edited(kind="joint", row=down, joint=1, number=joints[1] + 0.1)
    assert not lower["valid"]
    broken = {one["rule"] for one in lower["rules"] if not one["holds"]}
    assert broken & {"ends-on-ground", "terrain-collision", "no-drag"}, broken
    tag = {"if-match": rest.get(address).headers["etag"]}
    fourth = {"kind": "joint", "row": down, "joint": 3, "number": 0.1}
    refused = problem(rest.patch(address, json={"edit": fourth}, headers=tag), 422, "invalid-sequence")
    assert "joint of a LEG_MOVE is 0…2, l1_yaw, l1_hip, l1_knee" in refused["detail"]
    fewer = {"name": "LEG_MOVE", "leg": MOVED, "joints": [0.1, 0.2], "duration": 2.0}
    short = edited(kind="set", row=down, command=fewer)
    assert "own-joints" in {one["rule"] for one in short["rules"] if not one["holds"]}
    for _ in range(5):
        tag = {"if-match": rest.get(address).headers["etag"]}
        assert rest.post(f"{address}/undo", headers=tag).status_code == 200
    assert rest.get(address).json()["commands"] == rows
    report = replay(server.sessions.current.export_bundle())
    assert report.ok, report.lines()
    assert [one.kind for one in report.products].count("edit") == 5
    assert {one.verdict for one in report.products} == {"same"}


def test_what_is_athletes_alone_is_refused_by_name(rest, step):
    orders = {
        "plans": {"leg": 0, "target": [0.3, 0.1]},
        "walks": {"goal": {"x": 0.2, "y": 0.0}},
        "gaits": {"goal": {"x": 0.2, "y": 0.0}},
        "body-moves": {"shift": {"dz": 0.01}},
    }
    for folder, order in orders.items():
        refused = problem(rest.post(f"{SESSION}/{folder}", json=order), 422, "invalid-input")
        assert "ATHLETE's legs alone" in refused["detail"], folder
    maps = rest.get(SESSION).json()["maps"][str(MOVED)]
    asked = rest.get(f"{SESSION}/maps/{maps}/at", params={"x": 0.3, "y": 0.2})
    assert "ATHLETE's legs alone" in problem(asked, 422, "invalid-input")["detail"]
    footfall = {"leg": MOVED, "x": 0.3, "y": 0.2}
    assert rest.post(f"{SESSION}/footfalls", json=footfall).status_code == 200
    held = rest.put(f"{SESSION}/hand", json={"what": "footfall", "index": 0}).json()["hand"]
    assert f"leg {MOVED} at" in held["read"]["text"]
    assert rest.delete(f"{SESSION}/hand").status_code == 200
    loop = rest.post(f"{SESSION}/walk-loop", json={"goal": {"x": 0.2, "y": 0.0}})
    assert "ATHLETE's legs alone" in problem(loop, 422, "invalid-input")["detail"]
    pairs = rest.post(f"{SESSION}/images", json={})
    assert "no cameras" in pairs.json()["detail"]
    unnamed = rest.post(f"{SESSION}/sequences", json={})
    assert "give its digest as plan" in problem(unnamed, 409, "conflict")["detail"]


def test_a_rover_of_other_joints_is_turned_away(server, rest, step):
    _, robot = robot_of(LEGS)
    state = RobotState("ring", 1.0, *_still(robot), "idle", described=robot.layout)
    frame = message_object(TelemetryFrame(0, state, state.posture))
    hello = message_object(HelloMessage("ring", LEGS, described=robot.layout))
    hello = {name: one for name, one in hello.items() if name not in ("type", "id", "epoch")}

    def told(**other) -> str:
        return problem(
            rest.post("/rover/telemetry", json={**hello, **other, "frames": [frame]}), 422, "invalid-telemetry"
        )["detail"]

    renamed = json.loads(json.dumps(named := hello["joints"]).replace("l3_knee", "l3_shank"))
    assert "one of them alone has l3_knee, l3_shank" in told(joints=renamed)
    del hello["joints"]
    assert "ring has to name its joints" in told()
    hello["joints"] = named
    frame["posture"] = state.posture[:-1].tolist()
    assert "posture needs 18 numbers, not 17" in told()


def _still(robot) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    joints = len(robot.joint_names)
    return np.zeros(joints), np.eye(4), np.zeros((len(robot.legs), 3)), np.zeros(joints)


def test_the_rover_makes_the_step_walks_and_stops_and_all_of_it_replays(server, rest, step):
    server.rover.start()
    until(lambda: rest.get(f"{SESSION}/telemetry").status_code == 200, "the rover's telemetry")
    assert rest.post(f"{SESSION}/state", json={}).status_code in (200, 201)
    answer = _stepped(rest)
    sequence, address = _made(rest, answer["digest"])
    token = rest.post(f"{address}/arm").json()["token"]
    assert rest.post(f"{address}/send", json={"arming": token}).status_code == 202

    carried_out(rest, len(sequence["commands"]))
    goal = sequence["predicted"][-1]
    told = until(
        lambda: (now := rest.get(f"{SESSION}/telemetry").json())["posture"] == goal and now, "the posture of its end"
    )
    np.testing.assert_allclose(told["T_site_base"], sequence["Ts_site_base"][-1], atol=1e-9)
    assert min(force[2] for force in told["wheel_forces"]) > 0
    came = run_compared(rest)
    assert (came["verdict"], came["rigid"], came["reason"]) == ("as_predicted", True, "it moved as commanded"), came
    assert {one["verdict"] for one in came["differences"] if one["quantity"] == "load"} == {"not_told"}

    live = server.sessions.current
    digest = rest.post(f"{SESSION}/state", json={}).json()["digest"]
    robot, dem = robot_of(LEGS)[1], live.typed(Dem, live.state.dem)
    x, y, _ = standing_state(robot, dem, live.typed(RobotState, digest)).T_site_base[:3, 3]
    order = {"goal": {"x": x + 0.05, "y": y}}
    walk = result(rest, finished(rest, rest.post(f"{SESSION}/described-walks", json=order)))
    assert walk["status"] == "found", walk["reason"]
    assert len(walk["plan"]["moves"]) >= LEGS
    now = rest.get(SESSION).json()
    assert now["played"] == now["to_command"]["plan"] == walk["digest"]
    assert (now["to_command"]["text"], now["to_command"]["leg"]) == ("the walk", None)
    assert now["planned_for"]["goal"] == {**order["goal"], "yaw": None}
    assert now["commands_carried_out"]
    assert now["plan_matches_rover"]["ok"], now["plan_matches_rover"]
    commands, address = _made(rest, walk["digest"])
    now = rest.get(SESSION).json()
    assert now["played"] == commands["digest"]
    assert not now["commands_of_another_plan"]
    token = rest.post(f"{address}/arm").json()["token"]
    assert rest.post(f"{address}/send", json={"arming": token}).status_code == 202
    until(lambda: rest.get(f"{SESSION}/telemetry").json()["mode"] == "moving", "the walk")
    assert rest.post("/stop").status_code == 200
    until(lambda: rest.get("/stop").json()["stop_acknowledged"], "the stop")
    stopped = until(
        lambda: (now := rest.get(f"{SESSION}/telemetry").json())["mode"] == "stopped" and now, "a rover at rest"
    )
    assert stopped["posture"] != commands["predicted"][-1]
    assert problem(rest.post(f"{address}/arm"), 409, "command-refused")["check"] == "stop"

    report = replay(live.export_bundle())
    assert report.ok, report.lines()
    assert {one.verdict for one in report.products} == {"same"}
    kinds = {one.kind for one in report.products}
    assert kinds >= {"described_step", "described_walk", "sequence", "outcome"}
