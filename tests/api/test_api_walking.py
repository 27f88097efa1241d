"""A walk that is carried out over REST: commands of its foot moves, how far it is, the way on, and who sees it."""

from dataclasses import replace

import numpy as np
import pytest

from footfall.planning.body.stand import stand
from footfall.session.registry import Sessions
from tests.support.chassis_ground import wavy
from tests.support.jobs import finished, result
from tests.support.problems import problem
from tests.support.server import running_server
from tests.support.yielding_rover import YieldingRover

SESSION = "/sessions/current"
WALKS, WALKING = f"{SESSION}/walks", f"{SESSION}/walking"
NEXT, AGAIN = f"{WALKS}/current/sequence", f"{WALKS}/current/again"
GOAL = {"goal": {"x": 0.4, "y": 0.1}, "settings": {"seed": 1}}


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    def prepare(sessions: Sessions) -> None:
        live = sessions.create("walking")
        live.terrains.load(wavy(half=4.0), "made for the tests")

    with running_server(tmp_path_factory.mktemp("sessions"), prepare=prepare) as running:
        yield running


@pytest.fixture(scope="module")
def rover(server):
    """That of the session, which gives way."""
    live = server.sessions.current
    made = YieldingRover(live, stand(live.robot, live.get(live.state.dem)))
    live.stances.freeze()
    return made


@pytest.fixture(scope="module")
def client(server):
    with server.client() as made:
        yield made


@pytest.fixture(scope="module")
def second(server):
    """Another client of the same server."""
    with server.client() as made:
        yield made


@pytest.fixture(scope="module")
def walk(client, rover):
    """The walk, found."""
    made = result(client, finished(client, client.post(WALKS, json=GOAL)))
    assert made["status"] == "found", made["reason"]
    return made


@pytest.fixture
def listening(rover):
    """The rover, heard just now."""
    rover.tells()
    return rover


def test_without_a_walk_there_is_nothing_to_command(client, rover):
    assert client.get(WALKING).json() is None
    assert client.get(SESSION).json()["walking"] is None
    for route, body in ((NEXT, {"first": 0}), (AGAIN, {})):
        assert "there is no walk yet" in problem(client.post(route, json=body), 409, "conflict")["detail"]


def test_of_a_walk_that_was_refused_there_is_nothing_to_command(client, rover):
    refused = finished(client, client.post(WALKS, json={"goal": {"x": 90.0, "y": 0.0}}))["result"]
    assert client.get(WALKING).json() is None
    detail = problem(client.post(f"{WALKS}/{refused}/sequence", json={"first": 0}), 409, "conflict")["detail"]
    assert "no walk was found there" in detail


@pytest.mark.parametrize(
    ("order", "status", "kind", "said"),
    [
        ({}, 422, "validation", "first"),
        ({"first": -1}, 422, "validation", "first"),
        ({"first": 1.5}, 422, "validation", "first"),
        ({"first": True}, 422, "validation", "first"),
        ({"first": 0, "count": 0}, 422, "validation", "count"),
        ({"first": 0, "leg": 2}, 422, "validation", "leg"),
        ({"first": 0, "settings": {"speed": 1.0}}, 422, "validation", "speed"),
        ({"first": 0, "settings": {"mode": "slowly"}}, 422, "invalid-input", "mode is one of pose_held"),
        ({"first": 0, "settings": {"mode": "as_commanded"}}, 422, "invalid-input", "pose_held, droop_aware"),
        ({"first": 0, "settings": {}, "as_commanded": True}, 422, "invalid-input", "leave out one of them"),
        ({"first": 0, "settings": {"least_load": 3000.0}}, 422, "invalid-input", "can't be commanded pose held"),
        ({"first": 99999}, 422, "invalid-input", "counted from 0"),
        ({"first": 1}, 409, "conflict", "does not stand where foot move 2"),
    ],
)
def test_what_makes_no_sense_is_refused_and_makes_nothing(client, walk, listening, order, status, kind, said):
    before = client.get(SESSION).json()["sequence"]
    assert said in str(problem(client.post(NEXT, json=order), status, kind))
    assert client.get(SESSION).json()["sequence"] == before


def test_other_walks_and_digests_are_refused(client, walk, listening):
    state = client.get(SESSION).json()["state"]
    for digest in ("0" * 32, state):
        for route, body in (("sequence", {"first": 0}), ("again", {})):
            detail = problem(client.post(f"{WALKS}/{digest}/{route}", json=body), 404, "not-found")["detail"]
            assert f"holds no walk {digest}" in detail
    problem(client.post("/sessions/none/walks/current/sequence", json={"first": 0}), 404, "not-found")
    problem(client.get("/sessions/none/walking"), 404, "not-found")
    problem(client.post("/sessions/none/walks/current/again", json={}), 404, "not-found")


def test_the_mode_is_told_and_can_be_asked_for(client, walk, listening):
    for order, mode in (
        ({}, "pose_held"),
        ({"settings": {"mode": "droop_aware"}}, "droop_aware"),
        ({"as_commanded": True}, "rigid"),
    ):
        answer = client.post(NEXT, json={"first": 0, **order})
        assert answer.status_code == 201, answer.text
        told = answer.json()
        assert told["way"]["mode"] == mode
        assert answer.headers["location"].endswith(f"/sequences/{told['id']}")
        assert answer.headers["etag"] == f'"{told["digest"]}"'
        assert (told["set_points_before"] is None) == (mode == "rigid")
        [move] = told["foot_moves"]
        assert (move["first_row"], move["rows"]) == (0, len(told["commands"]))
        if mode == "rigid":
            assert move["rest"] is None
        else:
            assert 0.0 < move["rest"]["torque"] < 1.0
            assert abs(move["rest"]["sag"]) <= move["rest"]["off"] < 0.1
            assert move["rest"]["T_site_base"] == told["Ts_site_base"][-1]


def test_a_foot_move_is_carried_out_and_a_second_client_sees_it(client, second, walk, listening):
    of = len(walk["plan"]["legs"])
    assert client.get(WALKING).json() == second.get(WALKING).json()
    before = second.get(WALKING).json()
    assert (before["walk"], before["done"], before["next"], before["against"]) == (walk["digest"], 0, 0, "")
    assert before["leg"] == walk["plan"]["legs"][0]
    made = client.post(NEXT, json={"first": 0, "count": 1}).json()
    # the commands are the session's, not the client's
    assert second.get(SESSION).json()["sequence"] == made["digest"]
    assert second.get(f"/sequences/{made['digest']}").json() == made
    rover = listening
    rover.carries_out_all()
    for one in (client, second):
        told = one.get(WALKING).json()
        assert (told["done"], told["next"], told["against"]) == (1, 1, "")
        assert told["text"] == f"foot move 1 of {of}: leg {walk['plan']['legs'][0]} done; next: " + (
            f"foot move 2 of {of}: leg {walk['plan']['legs'][1]}"
        )
        assert one.get(SESSION).json()["walking"] == told
    # what is done does not begin again from here
    detail = problem(client.post(NEXT, json={"first": 0}), 409, "conflict")["detail"]
    assert "does not stand where foot move 1" in detail
    # more than there are: all that are left
    rest = second.post(NEXT, json={"first": 1, "count": 1000}).json()
    assert len(rest["foot_moves"]) == before["of"] - 1


def test_the_rest_is_planned_anew_from_where_the_rover_is(client, second, walk, listening):
    answer = second.post(AGAIN, json={})
    assert answer.status_code == 202, answer.text
    again = result(client, finished(client, answer))
    assert again["status"] == "found", again["reason"]
    assert again["goal"] == walk["goal"]
    assert again["provenance"]["settings"] == walk["provenance"]["settings"]
    assert again["digest"] != walk["digest"]
    told = client.get(WALKING).json()
    assert (told["walk"], told["done"], told["against"]) == (again["digest"], 0, "")
    # an older walk goes on from where it stands, too
    assert client.post(f"{WALKS}/{walk['digest']}/sequence", json={"first": 1}).status_code == 201


def test_a_walk_of_another_terrain_is_refused(client, server, walk, listening):
    live = server.sessions.current
    ground = wavy(half=4.0)
    live.terrains.load(replace(ground, heights=ground.heights + np.float32(0.05)), "another")
    told = client.get(WALKING).json()
    assert "the terrain has changed since the walk was planned" in told["against"]
    next_one = {"first": told["next"]}
    assert "the terrain has changed" in problem(client.post(NEXT, json=next_one), 409, "conflict")["detail"]
