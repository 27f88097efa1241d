"""A hexapod of one's own that sees: images over the link, ground built of them, a step and a walk on what it saw."""

import io

import numpy as np
import pytest
from PIL import Image

from footfall.core.frames import apply
from footfall.robot.legged.posture import placed
from footfall.sequence.commands import Sequence
from footfall.session.replay.recompute import replay
from footfall.telemetry.images import Snapshot
from footfall.terrain.dem import Dem
from footfall.terrain.generate import fractal
from footfall.terrain.ground.surface import height_at
from tests.support.described import robot_of, seeing
from tests.support.jobs import carried_out, finished, result
from tests.support.problems import problem
from tests.support.server import running_server
from tests.support.waiting import until

SESSION = "/sessions/current"
WORLD = fractal(2.4, 0.03, roughness=0.01, seed=3)
SETTINGS = {"half_size": 0.9, "min_range": 0.1, "keep": True}
MOVED = 1


@pytest.fixture(scope="module")
def robot():
    return seeing(robot_of(6)[1], side=180)


@pytest.fixture(scope="module")
def server(tmp_path_factory, robot):
    def prepare(sessions) -> None:
        sessions.create("hexapod", robot).terrains.load(WORLD, "made for the tests")

    with running_server(tmp_path_factory.mktemp("sessions"), prepare=prepare) as running:
        yield running


def looked(rest, pairs=None) -> dict:
    before = rest.get(f"{SESSION}/images").json()["snapshot"]
    asked = rest.post(f"{SESSION}/images", json={} if pairs is None else {"pairs": pairs})
    assert asked.status_code == 202, asked.text
    return until(
        lambda: (now := rest.get(f"{SESSION}/images").json())["snapshot"] not in (None, before) and now, "images"
    )


def built(rest, **settings) -> str:
    return finished(rest, rest.post(f"{SESSION}/terrains", json={"settings": SETTINGS | settings}))["result"]


def made(rest, plan: str) -> tuple[dict, str]:
    """The commands of a plan, and where they are."""
    answer = rest.post(f"{SESSION}/sequences", json={"plan": plan})
    assert answer.status_code == 201, answer.text
    assert answer.json()["valid"], [one for one in answer.json()["rules"] if not one["holds"]]
    return answer.json(), answer.headers["location"].removeprefix("/api/v1")


def sent(rest, plan: str) -> dict:
    """The commands of a plan, on their way."""
    commands, address = made(rest, plan)
    armed = rest.post(f"{address}/arm")
    assert armed.status_code in (200, 201), armed.text
    answer = rest.post(f"{address}/send", json={"arming": armed.json()["token"]})
    assert answer.status_code == 202, answer.text
    return commands


def foot_is_drawn(rest, session, step: dict) -> None:
    """The way of a planned step's foot lies in the images where its camera has the foot."""
    plan, robot, drawn = step["plan"], session.any_robot, 0
    phases, legs = [*plan["phases"], ""], [*plan["legs"], -1]
    at = [k for k in range(len(plan["legs"])) if phases[k + 1] != phases[k] and MOVED in (legs[k], legs[k + 1])]
    ends = [apply(np.array(plan["Ts_site_base"][k]), placed(robot, plan["waypoints"][k]).soles[MOVED]) for k in at]
    for pair in session.typed(Snapshot, session.state.snapshot).pairs:
        overlay = rest.get(f"{SESSION}/images/{pair.name}/left/overlay").json()
        assert overlay["plan"] == step["digest"]
        assert {one["phase"] for one in overlay["path"]} <= {"lift", "swing", "lower"}
        camera = pair.camera_left
        x, y, depth = apply(np.linalg.inv(pair.T_site_base @ camera.T_base_camera), np.array(ends)).T
        pixels = np.column_stack([camera.fx * x / depth + camera.cx, camera.fy * y / depth + camera.cy])[depth > 0]
        for point in overlay["waypoints"]:
            assert np.linalg.norm(pixels - point, axis=1).min() <= 0.1
            drawn += 1
    assert drawn >= 3


def test_it_walks_over_ground_that_it_saw_itself(server, robot):
    with server.client() as rest:
        names = [pair.name for pair in robot.description.cameras]
        assert rest.get("/robot").json()["cameras"] == names
        server.rover.start()
        until(lambda: rest.get(f"{SESSION}/telemetry").status_code == 200, "the rover's telemetry")
        rear = problem(rest.post(f"{SESSION}/images", json={"pairs": ["rear"]}), 404, "not-found")
        assert rear["detail"] == f"there is no camera pair 'rear'; there are {', '.join(names)}"

        one = looked(rest, ["belly"])
        assert [pair["name"] for pair in one["pairs"]] == ["belly"]
        seen = looked(rest)
        assert [pair["name"] for pair in seen["pairs"]] == names
        session = server.sessions.current
        assert session.typed(Snapshot, seen["snapshot"]).state.described.digest == robot.layout.digest
        picture = Image.open(io.BytesIO(rest.get(f"{SESSION}/images/out0/left.png").content))
        assert picture.size == (240, 180)
        mask = rest.get(f"{SESSION}/images/out0/mask.png")
        assert mask.status_code == 200, mask.text

        terrain = built(rest)
        dem = session.typed(Dem, terrain)
        assert session.state.dem == terrain
        x, y = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
        off = np.abs(dem.heights - height_at(WORLD, x, y))
        assert np.nanquantile(off, 0.9) < 0.01

        sole = apply(np.array(rest.get(f"{SESSION}/state").json()["T_site_base"]), soles(rest, robot))[MOVED]
        chosen = {"leg": MOVED, "x": 0.25, "y": 0.43}  # straight before one pair
        answered = rest.post(f"{SESSION}/footfalls", json=chosen)
        assert answered.json()["known"], answered.text
        overlay = rest.get(f"{SESSION}/images/out1/left/overlay")
        assert overlay.status_code == 200, overlay.text
        assert overlay.json()["grid"]
        shown = overlay.json()["footfall"]
        assert (shown["leg"], shown["seen"]) == (MOVED, "in sight")
        assert "out1" in shown["seen_by"]
        assert "out4" not in shown["seen_by"]
        at = rest.get(f"{SESSION}/images/out0/left/at", params={"u": 120, "v": 90}).json()
        assert abs(height_at(WORLD, *at["point"][:2]) - at["point"][2]) < 0.02

        order = {"leg": MOVED, "target": [float(sole[0] + 0.03), float(sole[1] + 0.02)]}
        answer = result(rest, finished(rest, rest.post(f"{SESSION}/described-steps", json=order)))
        assert answer["status"] == "found", answer["reason"]
        assert answer["provenance"]["parents"]["terrain"] == terrain
        foot_is_drawn(rest, session, answer)
        commands = sent(rest, answer["digest"])
        carried_out(rest, len(commands["commands"]))
        told = until(
            lambda: (now := rest.get(f"{SESSION}/telemetry").json())["mode"] == "idle" and now, "a rover at rest"
        )
        # the ground is where the images had it, to the millimetres that they are off
        np.testing.assert_allclose(told["T_site_base"], commands["Ts_site_base"][-1], atol=0.006)
        np.testing.assert_allclose(told["posture"], commands["predicted"][-1], atol=1e-9)
        assert min(force[2] for force in told["wheel_forces"]) > 0

        # the ground that it stood on is seen now, and the map keeps what is hidden
        looked(rest)
        newer = built(rest)
        assert newer != terrain
        assert np.isfinite(session.typed(Dem, newer).heights).sum() >= np.isfinite(dem.heights).sum()
        goal = {"x": told["T_site_base"][0][3] + 0.06, "y": told["T_site_base"][1][3]}
        walk = result(rest, finished(rest, rest.post(f"{SESSION}/described-walks", json={"goal": goal})))
        assert walk["status"] == "found", walk["reason"]
        assert len(walk["plan"]["moves"]) >= len(robot.legs)
        commands, _ = made(rest, walk["digest"])
        assert session.typed(Sequence, commands["digest"]).provenance.parents["dem"] == newer

        report = replay(session.export_bundle())
        assert report.ok, report.lines()
        assert {one.verdict for one in report.products} == {"same"}
        assert {one.kind for one in report.products} >= {"terrain", "described_step", "described_walk", "sequence"}


def soles(rest, robot) -> np.ndarray:
    return placed(robot, rest.get(f"{SESSION}/state").json()["posture"]).soles
