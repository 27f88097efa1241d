"""A hexapod of which it is said how its joints give way, over REST: commands hold its pose, and its rover sags."""

import numpy as np
import pytest

from footfall.core.frames import apply
from footfall.io.imports import sequence_of
from footfall.planning.legged.measured import standing_state
from footfall.robot.legged.posture import placed
from footfall.sequence.commands import Sequence
from footfall.session.replay.recompute import replay
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.generate import fractal
from tests.support.described import robot_of, sprung
from tests.support.jobs import carried_out, finished, result, run_compared
from tests.support.sequences import require_same_commands
from tests.support.server import running_server
from tests.support.waiting import until

SESSION = "/sessions/current"
MOVED = 1


@pytest.fixture(scope="module")
def robot():
    return sprung(robot_of(6)[1], 900.0)


@pytest.fixture(scope="module")
def server(tmp_path_factory, robot):
    def prepare(sessions) -> None:
        live = sessions.create("hexapod", robot)
        live.terrains.load(fractal(2.4, 0.2, roughness=0.01, seed=3), "made for the tests")

    with running_server(tmp_path_factory.mktemp("sessions"), prepare=prepare) as running:
        yield running


def test_commands_hold_the_pose_and_the_rover_rests_where_they_are_predicted_to(server, robot):
    with server.client() as rest:
        told = rest.get("/robot").json()
        assert told["stiffness"] == [900.0] * 18
        server.rover.start()
        first = until(
            lambda: (now := rest.get(f"{SESSION}/telemetry")).status_code == 200 and now.json(), "the rover's telemetry"
        )
        ahead = np.array(first["commanded"]) - first["posture"]
        np.testing.assert_allclose(900.0 * ahead, first["joint_torques"], atol=1e-6)
        assert np.abs(ahead).max() > 1e-3, "its set points are not where its joints are"
        assert rest.post(f"{SESSION}/state", json={}).status_code in (200, 201)
        assert rest.get(SESSION).json()["way_of_commands"]["mode"] == "pose_held"
        live = rest.get(f"{SESSION}/state").json()
        sole = apply(np.array(live["T_site_base"]), placed(robot, live["posture"]).soles)[MOVED]
        order = {"leg": MOVED, "target": [sole[0] + 0.03, sole[1] + 0.02]}
        step = result(rest, finished(rest, rest.post(f"{SESSION}/described-steps", json=order)))
        assert step["status"] == "found", step["reason"]

        made = rest.post(f"{SESSION}/sequences", json={"plan": step["digest"]})
        assert made.status_code == 201, made.text
        sequence, address = made.json(), made.headers["location"].removeprefix("/api/v1")
        assert sequence["valid"], sequence["rules"]
        assert sequence["way"]["mode"] == "pose_held"
        assert [one["phase"] for one in sequence["commands"]].count("unload") == 1
        token = rest.post(f"{address}/arm").json()["token"]
        sent = rest.post(f"{address}/send", json={"arming": token})
        assert sent.status_code == 202, sent.text
        carried_out(rest, len(sequence["commands"]))
        goal = np.array(sequence["predicted"][-1])
        now = until(
            lambda: np.allclose((one := rest.get(f"{SESSION}/telemetry").json())["posture"], goal, atol=1e-9) and one,
            "the posture that is predicted",
        )
        np.testing.assert_allclose(now["T_site_base"], sequence["Ts_site_base"][-1], atol=1e-9)
        np.testing.assert_allclose(now["commanded"], sequence["commanded"][-1], atol=1e-12)
        np.testing.assert_allclose(now["T_site_base"], step["plan"]["Ts_site_base"][-1], atol=2e-4)
        came = run_compared(rest)
        assert (came["verdict"], came["rigid"]) == ("as_predicted", False), came
        assert came["reason"] == "touch-down, loads, drift and sink are as predicted"
        assert [one["quantity"] for one in came["differences"]] == ["touch-down", *["load"] * 6, "drift", "sink"]
        assert {one["verdict"] for one in came["differences"]} == {"as_predicted"}

        session = server.sessions.current
        kept = session.typed(Sequence, sequence["digest"])
        for name in ("json", "csv"):
            data = rest.get(f"{address}/export", params={"format": name}).content
            dem = session.typed(Dem, session.state.dem)
            state = standing_state(robot, dem, session.typed(RobotState, live["digest"]))
            read = sequence_of(f"step.{name}", data, robot, dem, state if name == "csv" else None)
            require_same_commands(read.commands, kept.commands)
            assert read.valid, read.failures
            np.testing.assert_allclose(read.predicted[-1], goal, atol=1e-6)
        # from where it stands now, with the set points that it has
        assert rest.post(f"{SESSION}/state", json={}).status_code in (200, 201)
        back = {"leg": MOVED, "target": [float(sole[0]), float(sole[1])]}
        step = result(rest, finished(rest, rest.post(f"{SESSION}/described-steps", json=back)))
        assert step["status"] == "found", step["reason"]
        made = rest.post(f"{SESSION}/sequences", json={"plan": step["digest"]})
        assert made.json()["valid"], made.text
        np.testing.assert_allclose(made.json()["set_points_before"], now["commanded"], atol=1e-9)
        address = made.headers["location"].removeprefix("/api/v1")
        sent = rest.post(f"{address}/send", json={"arming": rest.post(f"{address}/arm").json()["token"]})
        assert sent.status_code == 202, sent.text
        carried_out(rest, len(sequence["commands"]) + len(made.json()["commands"]))
        report = replay(session.export_bundle())
        assert report.ok, report.lines()
        assert {one.verdict for one in report.products} == {"same"}
