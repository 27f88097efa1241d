"""Two sessions, one rover; a rover that dies, falls silent or complains; a stop that must reach it."""

import json
import os
import signal
import threading
from contextlib import contextmanager
from dataclasses import replace

import httpx
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from footfall.api.auth.who import PAGE_HEADER
from footfall.api.routes import rover as link_end
from footfall.core.errors import InvalidImages
from footfall.planning.body.stand import stand
from footfall.robot.ik import contact_point
from footfall.session.rover.linked import LinkedRover
from footfall.session.storage.store import SessionStore
from footfall.telemetry.link import AckMessage, ErrorMessage, HelloMessage, encode
from footfall.telemetry.state import TelemetryFrame
from footfall.terrain.generate import plane
from tests.support.problems import problem
from tests.support.server import running_server
from tests.support.waiting import BOUND, a_while, until


@pytest.fixture(scope="module")
def quiet(tmp_path_factory):
    """A server with a session on level ground; no rover."""

    def prepare(sessions):
        sessions.create("level").terrains.load(plane(size=10.0, resolution=0.1), "made for the tests")

    with running_server(tmp_path_factory.mktemp("sessions"), prepare=prepare) as running:
        yield running


@pytest.fixture
def client(quiet):
    with quiet.client() as made:
        yield made
        quiet.until_rover_left()  # while it is there, a stop that it has not acknowledged is not cleared
        made.post("/stop/clear").raise_for_status()


@contextmanager
def rover_of(server):
    url = "ws" + server.api.removeprefix("http") + "/rover"
    with connect(url, subprotocols=[Subprotocol("footfall-rover-2")], proxy=None) as socket:
        socket.send(encode(HelloMessage("athlete", 6)))
        yield socket


def next_of(link, kind: str) -> dict:
    while (message := json.loads(link.recv(timeout=BOUND)))["type"] != kind:
        pass
    return message


def current(client) -> dict:
    return client.get("/sessions/current").json()


def linked(client) -> None:
    until(lambda: current(client)["link"]["connected"], "the rover on the link")


def test_reading_an_old_session_moves_nothing(quiet, client):
    first = current(client)["id"]
    second = client.post("/sessions", json={"name": "second"}).json()["id"]
    old = quiet.sessions._open.pop(first)
    old.close()
    with rover_of(quiet):
        linked(client)
        for path in ("", "/log", "/notes", "/view"):
            assert client.get(f"/sessions/{first}{path}").status_code == 200
        assert client.get(f"/recordings/{first}.zip").status_code == 200
        assert current(client)["id"] == second
        assert current(client)["link"]["connected"]
        assert not client.get(f"/sessions/{first}").json()["link"]["connected"]
        again = client.post("/sessions", json={"session": first})
        assert again.status_code == 201
        assert current(client)["id"] == first
    problem(client.post("/sessions", json={"session": "none-such"}), 404, "not-found")
    problem(client.post("/sessions", json={"session": first, "name": "both"}), 422, "invalid-input")


def test_a_question_about_an_old_session_changes_nothing_of_it(quiet, client):
    """Viewers may ask it: it neither opens the session nor writes into its log."""
    asked = quiet.sessions.create("asked")
    asked.terrains.load(plane(size=10.0, resolution=0.1), "made for the tests")
    client.post("/sessions", json={"name": "after it"}).raise_for_status()
    quiet.sessions._open.pop(asked.id).close()
    path = f"/sessions/{asked.id}"
    before = client.get(f"{path}/log").json()
    down = client.post(f"{path}/pick", json={"origin": [0.5, 0.5, 5.0], "direction": [0.0, 0.0, -1.0]})
    assert down.json()["point"] == pytest.approx([0.5, 0.5, 0.0])
    assert "no maps" in problem(client.post(f"{path}/suggestions", json={"leg": 2}), 409, "conflict")["detail"]
    assert client.get(f"{path}/log").json() == before
    assert asked.id not in quiet.sessions._open


def test_a_stop_goes_out_while_a_session_is_being_made(quiet, client, monkeypatch):
    begun, let_go = threading.Event(), threading.Event()
    create = SessionStore.create

    def slowly(*about):
        begun.set()
        assert let_go.wait(BOUND)
        return create(*about)

    with rover_of(quiet) as link:
        linked(client)
        monkeypatch.setattr(SessionStore, "create", slowly)
        order = {"url": quiet.api + "/sessions", "json": {"name": "slow"}, "timeout": 90, "trust_env": False}
        making = threading.Thread(target=httpx.post, kwargs=order)
        making.start()
        try:
            assert begun.wait(BOUND)
            assert client.post("/stop", timeout=BOUND).json()["stopped"]
            assert (
                httpx.get(
                    quiet.api.removesuffix("/api/v1") + "/health/live", timeout=BOUND, trust_env=False, verify=False
                ).status_code
                == 200
            )
            assert making.is_alive()
            assert next_of(link, "stop")["id"]
        finally:
            let_go.set()
            making.join()
        assert current(client)["name"] == "slow"
        assert current(client)["gate"]["stopped"]


def test_a_stop_says_which_page_asked_for_it(quiet, client):
    live = quiet.sessions.current

    def pages(type="stop_requested"):
        return [event.payload["by"]["page"] for event in live.events() if event.type == type]

    client.post("/stop", headers={PAGE_HEADER: "page-a"})
    until(lambda: pages()[-1:] == ["page-a"], "the stop in the log")  # other events may follow it
    client.post("/stop/clear").raise_for_status()
    url = "ws" + quiet.api.removeprefix("http") + "/stop/line"
    with connect(url, proxy=None) as line:
        line.send(json.dumps({"page": "page-b"}))
        assert json.loads(line.recv(timeout=BOUND))["stopped"]
    until(lambda: pages()[-1:] == ["page-b"], "the stop in the log")
    client.post("/stop", headers={PAGE_HEADER: "page-a"})
    until(lambda: pages("stop_repeated") == ["page-a"], "who else asked for it, in the log")
    client.post("/stop/clear").raise_for_status()


def test_another_page_takes_no_rover_from_who_holds_the_conn(quiet, client):
    mary, john = {PAGE_HEADER: "page-a"}, {PAGE_HEADER: "page-b"}
    first = current(client)["id"]
    assert client.post("/sessions/current/conn/take", headers=mary).status_code == 200
    refused = client.post("/sessions", json={"name": "john's"}, headers=john)
    assert "holds the conn" in problem(refused, 409, "command-refused")["detail"]
    assert current(client)["id"] == first
    assert client.post("/sessions", json={"name": "mary's"}, headers=mary).status_code == 201


def test_a_silent_rover_follows_and_hears_the_stop_of_the_new_session(quiet, client):
    with rover_of(quiet) as link:
        linked(client)
        client.post("/sessions", json={"name": "third"})
        client.post("/stop")  # the rover has said nothing since
        assert next_of(link, "stop")["id"]
        linked(client)


def test_a_rover_that_leaves_while_it_is_handed_over_has_left(quiet, client, monkeypatch):
    handed_over = LinkedRover.connected

    def slowly(live, *said):
        handed_over(live, *said)
        a_while(1.0)  # a slow disk

    with rover_of(quiet):
        linked(client)
        monkeypatch.setattr(LinkedRover, "connected", slowly)
        client.post("/sessions", json={"name": "fourth"})
        linked(client)
    until(lambda: not current(client)["link"]["connected"], "the leaving of the rover")


def test_a_stop_needs_no_sensible_body(client):
    for body in (b"{", b'{"reason": 3}', b'{"reason": "' + b"x" * 100_000 + b'"}', b"\xff", b"[]"):
        answer = client.post("/stop", content=body, headers={"content-type": "application/json"})
        assert answer.status_code == 200, answer.text
        assert answer.json()["stopped"] is True
        assert client.post("/stop/clear").json()["stopped"] is False


def test_a_stop_without_rover_reaches_the_one_that_comes(quiet, client):
    client.post("/stop")
    with rover_of(quiet) as link:
        stop = next_of(link, "stop")
        assert not client.get("/stop").json()["stop_acknowledged"]
        problem(client.post("/stop/clear"), 409, "conflict")
        link.send(json.dumps({"type": "stop_ack", "id": stop["id"], "time": 1.0}))
        until(lambda: client.get("/stop").json()["stop_acknowledged"], "the acknowledgement")
        assert client.post("/stop/clear").json()["stopped"] is False
        assert next_of(link, "clear_stop")


def test_the_acknowledgement_of_a_stop_waits_behind_nothing_that_the_rover_says(quiet, client, monkeypatch):
    """Its thread is held up by the first of many acknowledgements, until the stop's has arrived."""
    go_on, used = threading.Event(), []

    def slowly(live, command_id, *told):
        assert go_on.wait(BOUND)
        used.append(command_id)

    monkeypatch.setattr(LinkedRover, "take_acknowledgement", slowly)
    with rover_of(quiet) as link:
        linked(client)
        stop = client.post("/stop").json()
        assert stop["stop_acknowledged"] is False
        for number in range(500):
            link.send(encode(AckMessage(f"c{number}", "received", "", 1.0)))
        link.send(json.dumps({"type": "stop_ack", "id": next_of(link, "stop")["id"], "time": 1.0}))
        until(lambda: client.get("/stop").json()["stop_acknowledged"], "the acknowledgement")
        assert not used
        go_on.set()
        until(lambda: len(used) == 500, "the others")
        assert used == [f"c{number}" for number in range(500)]  # in their order, none lost


def test_what_the_rover_complains_about_reaches_the_operator(quiet, client):
    with rover_of(quiet) as link:
        linked(client)
        link.send(encode(ErrorMessage("images-1", "the cameras are cold")))
        until(lambda: current(client)["link"]["fault"] == "the cameras are cold", "the complaint")
        log = client.get("/sessions/current/log").json()["events"]
        assert [e["payload"]["id"] for e in log if e["type"] == "link_fault"] == ["images-1"]
        link.send("no JSON")
        until(lambda: "JSON" in current(client)["link"]["fault"], "the server's own complaint")


def test_old_telemetry_is_not_shown_as_fresh(quiet, client, athlete):
    state = stand(athlete, plane())
    with rover_of(quiet) as link:
        for number in (1, 2, 4, 3, 3, 3):
            link.send(encode(TelemetryFrame(number, at_time(state, number), state.posture)))
        until(lambda: current(client)["link"]["late"] == 3, "the stragglers")
        assert client.get("/sessions/current/telemetry").json()["number"] == 4


def at_time(state, time):
    return replace(state, time=float(time))


def test_a_second_rover_is_refused_until_the_first_is_silent(quiet, client, monkeypatch):
    with rover_of(quiet) as first:
        linked(client)
        with pytest.raises(InvalidStatus), rover_of(quiet):
            pass
        monkeypatch.setattr(link_end, "GIVEN_UP_AFTER", 0.0)
        client.post("/stop")
        with rover_of(quiet) as second:
            assert next_of(second, "stop")
            assert {json.loads(text)["type"] for text in first} == {"epoch", "stop"}  # and then it was closed
            linked(client)
            assert client.get("/info").json()["rover_link"]["linked"] is True


def test_a_rover_killed_in_mid_command(tmp_path, athlete):
    dem = plane(size=10.0, resolution=0.1)

    def prepare(sessions):
        sessions.create("killed").terrains.load(dem, "made for the tests")

    state = stand(athlete, dem)
    x, y, _ = contact_point(athlete, state.posture, 2, state.T_site_base)
    with running_server(tmp_path, prepare=prepare) as server, server.client() as client:
        server.rover.start()
        until(lambda: client.get("/sessions/current/telemetry").status_code == 200, "telemetry")
        job = client.post("/sessions/current/plans", json={"leg": 2, "target": [x + 0.1, y + 0.1]}).json()
        until(lambda: client.get(f"/jobs/{job['id']}").json()["state"] == "done", "the plan")
        sequence = client.post("/sessions/current/sequences", json={}).json()
        path = f"/sequences/{sequence['digest']}"
        token = client.post(f"{path}/arm").json()["token"]
        ids = client.post(f"{path}/send", json={"arming": token}).json()["commands"]
        until(lambda: current(client)["commands"][0]["state"] == "started", "the first command under way")
        problem(client.post("/sessions", json={"name": "elsewhere"}), 409, "conflict")
        os.kill(client.get("/info").json()["simulated_rover"]["pid"], signal.SIGKILL)
        until(lambda: current(client)["gate"]["state"] == "idle", "the end of the run")
        about = current(client)
        assert [c["id"] for c in about["commands"]] == ids[: len(about["commands"])]
        assert about["commands"][-1]["state"] == "unknown"
        assert "disconnected" in about["commands"][-1]["reason"]
        types = [e["type"] for e in client.get("/sessions/current/log").json()["events"]]
        assert "run_ended" in types
        assert "link_lost" in types
        # the rover comes back; what was not sent stays unsent
        until(lambda: current(client)["link"]["connected"], "the rover again")
        assert len(current(client)["commands"]) == len(about["commands"])


def test_the_stop_line_stops_as_the_request_does(quiet, client):
    with connect(f"{quiet.api.replace('http', 'ws')}/stop/line", proxy=None) as line:
        for text in ("{}", '{"reason": "wheel 3 is sinking"}', "no JSON at all"):
            line.send(text)
            assert json.loads(line.recv(timeout=BOUND))["stopped"] is True
    assert client.get("/sessions/current").json()["stop"]["latched"]
    assert client.post("/stop/clear").json()["stopped"] is False


def test_the_line_of_events_says_what_the_stream_says(quiet, client):
    address = f"{quiet.api.replace('http', 'ws')}/sessions"
    recorded = client.get("/sessions/current/log").json()["events"]
    with connect(f"{address}/current/events/line?since=0", proxy=None) as line:
        told = [json.loads(line.recv(timeout=BOUND)) for _ in recorded[1:]]
        assert [one["data"] for one in told] == recorded[1:]
        assert [one["id"] for one in told] == [one["seq"] for one in recorded[1:]]
        assert json.loads(line.recv(timeout=BOUND))["type"] == "link"
        client.post("/sessions/current/notes", json={"text": "heard on the line"})
        while (news := json.loads(line.recv(timeout=BOUND)))["type"] == "telemetry":
            pass  # how the rover was that an earlier test had here
        assert (news["type"], news["data"]["payload"]["text"]) == ("event", "heard on the line")
    with pytest.raises(InvalidStatus, match="403"):  # closed before it was accepted
        connect(f"{address}/no-such-session/events/line", proxy=None)


def test_pictures_that_come_faster_than_they_are_stored_are_dropped_and_told(quiet, client, monkeypatch):
    go_on, used = threading.Event(), []

    def slowly(content, legs, unpacks, described):
        assert go_on.wait(BOUND)
        used.append(len(content))
        raise InvalidImages("no pictures")

    monkeypatch.setattr(link_end, "decode_images", slowly)
    monkeypatch.setattr(link_end, "MOST_PICTURES", 2500)
    with rover_of(quiet) as link:
        linked(client)
        for _ in range(3):
            link.send(bytes(1000))
        while "images came while 2000 bytes of others wait" not in next_of(link, "error")["text"]:
            pass
        client.post("/stop")
        assert current(client)["stop"]["latched"]
        go_on.set()
        until(lambda: used == [1000, 1000], "those that there was room for")
