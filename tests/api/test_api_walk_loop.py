"""A walk in a closed loop over REST: begun, watched, held and ended; what it decides is told as events."""

from typing import get_args

import pytest

from footfall.api.bodies.walk_schemas import WalkLoopOrder
from footfall.core.errors import InvalidBundle
from footfall.io.artifacts import encode
from footfall.planning.body.stand import stand
from footfall.planning.choice.actions import ACTIONS, WALK
from footfall.planning.choice.choice_settings import ChoiceSettings
from footfall.planning.choice.mdp import SeenTransition
from footfall.planning.choice.onward import CHOOSERS
from footfall.planning.choice.policy import learned
from footfall.planning.walk.problem import WalkGoal
from footfall.session import loop_ways
from footfall.session.registry import Sessions
from footfall.telemetry.state import TelemetryFrame
from footfall.terrain.generate import plane
from footfall_ui.app import serve
from tests.support.problems import problem
from tests.support.server import running_server
from tests.support.waiting import until

LOOP = "/sessions/current/walk-loop"
GOAL = {"goal": {"x": 2.0, "y": 0.5}, "limits": {"look_every": 2}}


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    def prepare(sessions: Sessions) -> None:
        sessions.create("closed loop")

    with running_server(tmp_path_factory.mktemp("sessions"), prepare=prepare) as running:
        yield running


@pytest.fixture(scope="module")
def client(server):
    with server.client() as made:
        yield made


@pytest.fixture
def asked(server):
    """What a rover that stands, and never answers, is asked for."""
    live, asked = server.sessions.current, []
    live.rover.connected(asked.append)
    live.rover.take_telemetry(
        TelemetryFrame(0, stand(live.robot, plane(size=8.0, resolution=0.1)), live.robot.posture("stand"))
    )
    yield asked
    live.rover.disconnected()


def test_without_a_rover_or_a_walk_nothing_begins(client):
    assert "no walk in a closed loop" in problem(client.get(LOOP), 404, "not-found")["detail"]
    problem(client.post(f"{LOOP}/hold"), 404, "not-found")
    assert "no rover" in problem(client.post(LOOP, json=GOAL), 409, "conflict")["detail"]
    problem(client.post(LOOP, json={**GOAL, "limits": {"foot_moves": 0}}), 422, "invalid-input")
    problem(client.post(LOOP, json={**GOAL, "route": {"resolution": 0.0}}), 422, "invalid-input")
    problem(client.post(LOOP, json={**GOAL, "route": {"hurry": 1}}), 422, "validation")
    assert "no rover" in problem(client.post(LOOP, json={**GOAL, "route": {}}), 409, "conflict")["detail"]
    # of no cameras no images would ever come
    for pairs in ([], [""], ["chassis_0"] * 65):
        problem(client.post(LOOP, json={**GOAL, "pairs": pairs}), 422, "validation")


def test_it_looks_first_is_held_goes_on_and_is_ended(client, asked):
    begun = client.post(LOOP, json=GOAL)
    assert begun.status_code == 202, begun.text
    assert "already" in problem(client.post(LOOP, json=GOAL), 409, "conflict")["detail"]
    until(lambda: any('"image_request"' in text for text in asked), "a request for images")
    told = client.get(LOOP).json()
    assert (told["state"], told["act"], told["reason"]) == ("going", "look", "no ground is known yet")
    assert told["goal"] == {"x": 2.0, "y": 0.5, "yaw": None}
    assert told["part"] == ""
    assert (told["choose_by"], told["planners"], told["chosen"]) == ("planner", {}, None)
    until(lambda: client.get(LOOP).json()["waits_for"] == "images", "what it waits for")
    assert (told["limits"]["look_every"], told["limits"]["most_torque"], told["farthest"]) == (2, 0.9, 3.0)
    assert client.post(f"{LOOP}/hold").json()["state"] == "held"
    assert client.post(f"{LOOP}/resume").json()["state"] == "going"
    assert client.post(f"{LOOP}/cancel").status_code == 200
    until(lambda: client.get(LOOP).json()["state"] == "ended", "the end")
    ended = client.get(LOOP).json()
    assert (ended["outcome"], ended["decided"]) == ("cancelled", {"look": 1})
    problem(client.post(f"{LOOP}/resume"), 409, "conflict")


@pytest.mark.parametrize("said", [{}, {"keep": False}])
def test_settings_of_its_maps_that_are_not_said_stay_as_delivered(server, client, asked, said):
    begun = client.post(LOOP, json={**GOAL, "terrain": {"resolution": 0.05, **said}})
    assert begun.status_code == 202, begun.text
    terrain = server.sessions.current.walk_loop._settings.terrain
    client.post(f"{LOOP}/cancel")
    assert (terrain.resolution, terrain.keep) == (0.05, said.get("keep", True))


def test_every_chooser_can_be_asked_for():
    assert get_args(WalkLoopOrder.model_fields["choose_by"].annotation) == tuple(CHOOSERS)


def test_a_learned_table_chooses_the_server_s_own_or_the_robot_s(server, client, asked, monkeypatch):
    by_table = {**GOAL, "choose_by": "table"}
    problem(client.post(LOOP, json={**GOAL, "choose_by": "whim"}), 422, "validation")
    with monkeypatch.context() as without:
        without.setattr(loop_ways, "shipped_policy", lambda _: None)
        assert "--policy" in problem(client.post(LOOP, json=by_table), 422, "invalid-input")["detail"]
    seen = [SeenTransition(0, ACTIONS.index(WALK), 1.0, 0)]
    try:
        server.sessions.policy = learned(seen, ChoiceSettings(), "0" * 32, 1)
        assert "learned for robot 00000000" in problem(client.post(LOOP, json=by_table), 422, "invalid-input")["detail"]
        for policy in (learned(seen, ChoiceSettings(), server.sessions.current.robot_digest, 1), None):
            server.sessions.policy = policy
            begun = client.post(LOOP, json=by_table)
            assert (begun.status_code, begun.json()["choose_by"]) == (202, "table"), begun.text
            assert client.post(f"{LOOP}/cancel").status_code == 200
            until(lambda: client.get(LOOP).json()["state"] == "ended", "the end")
    finally:
        server.sessions.policy = None


def test_a_file_without_a_table_starts_no_server(tmp_path):
    path = tmp_path / "gaits.npz"
    path.write_bytes(encode(WalkGoal(1.0, 0.0)))
    with pytest.raises(InvalidBundle, match=r"gaits\.npz holds WalkGoal, no policy"):
        serve(port=0, folder=tmp_path / "sessions", sample=None, sim=False, policy=path)


def test_who_only_plans_may_not_begin_one():
    from footfall.api.auth.roles import needed
    from footfall.session.access.identity import Role

    assert needed("POST", "/sessions/{session}/walk-loop") is Role.COMMANDER
    assert needed("POST", "/sessions/{session}/walk-loop/{act}") is Role.COMMANDER
    assert needed("GET", "/sessions/{session}/walk-loop") is Role.VIEWER
