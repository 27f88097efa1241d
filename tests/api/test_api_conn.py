"""The conn and the run over REST: two programs, one rover."""

import pytest

from footfall.terrain.generate import plane
from tests.support.problems import problem
from tests.support.server import running_server

CONN = "/sessions/current/conn"
RUN = "/sessions/current/run"
FIRST, SECOND = {"FootFall-Page": "first"}, {"FootFall-Page": "second"}


@pytest.fixture(scope="module")
def rest(tmp_path_factory):
    """A client of a server with a session on level ground; no rover."""

    def prepare(sessions):
        sessions.create("level").terrains.load(plane(size=10.0, resolution=0.1), "made for the tests")

    with running_server(tmp_path_factory.mktemp("sessions"), prepare=prepare) as running, running.client() as client:
        yield client


def act(rest, what, who):
    return rest.post(f"{CONN}/{what}", headers=who)


def test_one_holds_the_conn_and_hands_it_on(rest):
    assert rest.get(CONN).json() == {"number": 0, "holder": None, "expires_in": None, "request": None}
    taken = act(rest, "take", FIRST).json()
    assert (taken["number"], taken["holder"]["name"], taken["holder"]["page"]) == (1, "local", "first")
    assert 80 < taken["expires_in"] <= 90
    assert problem(act(rest, "take", SECOND), 409, "command-refused")["check"] == "conn"
    assert problem(act(rest, "heartbeat", SECOND), 409, "command-refused")["holder"] == "local"
    assert act(rest, "request", SECOND).json()["request"]["by"]["page"] == "second"
    assert rest.get("/sessions/current").json()["conn"]["request"]["granted_in"] <= 20
    assert act(rest, "grant", FIRST).json()["number"] == 2
    assert problem(act(rest, "release", FIRST), 409, "command-refused")["check"] == "conn"
    assert act(rest, "release", SECOND).json()["holder"] is None
    log = rest.get("/sessions/current/log").json()["events"]
    said = [(e["payload"]["act"], e["payload"]["conn"]) for e in log if e["type"] == "conn_changed"]
    assert said == [("taken", 1), ("requested", 1), ("granted", 2), ("released", 2)]
    by = next(e["payload"] for e in log if e["type"] == "act_refused")
    assert (by["act"], by["by"]["page"], by["by"]["client"]) == ("take", "second", "127.0.0.1")


def test_what_can_not_be_asked_is_refused_by_name(rest):
    problem(act(rest, "steal", FIRST), 422, "validation")
    problem(rest.post(f"{CONN}/take", headers={"FootFall-Page": "x" * 65}), 422, "validation")
    problem(rest.get(RUN), 404, "not-found")
    problem(rest.post(f"{RUN}/sideways"), 422, "validation")
    for what in ("hold", "resume", "next", "abort"):
        assert problem(rest.post(f"{RUN}/{what}", headers=FIRST), 409, "command-refused")["check"] == "run"


def test_how_late_stops_come_is_said_by_the_holder(rest):
    def far(who, seconds):
        return rest.patch("/rover/light-time", json={"commands_s": seconds}, headers=who)

    act(rest, "take", FIRST)
    assert problem(far(SECOND, 1500.0), 409, "command-refused")["check"] == "conn"
    assert rest.get("/rover/light-time").json()["commands_s"] == 0.0
    assert far(FIRST, 0.5).json()["commands_s"] == 0.5
    act(rest, "release", FIRST)
    assert far(SECOND, 0.0).json()["commands_s"] == 0.0


def test_anybody_stops_and_the_holder_clears(rest):
    act(rest, "take", FIRST)
    assert rest.post("/stop", headers=SECOND).json()["stopped"]
    assert rest.post("/stop", headers={"FootFall-Page": "?" * 99}).status_code == 200
    assert problem(rest.post("/stop/clear", headers=SECOND), 409, "command-refused")["check"] == "conn"
    assert not rest.post("/stop/clear", headers=FIRST).json()["stopped"]
    act(rest, "release", FIRST)
