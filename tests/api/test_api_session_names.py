"""A session gets another name over REST: listed at once, refused with why, told to who listens."""

import pytest


def test_a_session_is_renamed_and_listed_so(server, client):
    session = client.get("/sessions/current").json()["id"]
    answer = client.patch(f"/sessions/{session}", json={"name": " north slope "})
    assert answer.status_code == 200
    assert answer.json()["name"] == client.get("/sessions/current").json()["name"] == "north slope"
    listed = {one["id"]: one for one in client.get("/sessions").json()["sessions"]}
    assert listed[session]["name"] == "north slope"
    event = client.get("/sessions/current/log").json()["events"][-1]
    assert (event["type"], event["payload"]["name"]) == ("session_renamed", "north slope")
    assert event["payload"]["by"]["name"] == "local"
    assert listed[session]["latest"] == event["time"]


def test_a_session_that_is_not_the_current_one_is_renamed_without_taking_the_rover(server, client):
    before = client.get("/sessions/current").json()["id"]
    other = client.post("/sessions", json={"name": "other"}).json()["id"]
    client.post("/sessions", json={"session": before}).raise_for_status()
    assert client.patch(f"/sessions/{other}", json={"name": "the other one"}).json()["name"] == "the other one"
    assert client.get("/sessions/current").json()["id"] == before


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("", "empty"),
        ("n" * 81, "has 81 characters, at most 80 are kept: leave out 1"),
        ("up\u202edown", "character 3 of the name (U+202E) can't be printed"),
        ("two\nlines", "character 4 of the name (U+000A)"),
    ],
)
def test_a_name_that_is_none_is_refused_with_why_of_new_sessions_and_of_old_ones(client, name, why):
    before, listed = client.get("/sessions/current").json(), client.get("/sessions").json()["sessions"]
    renamed = client.patch("/sessions/current", json={"name": name})
    begun = client.post("/sessions", json={"name": name})
    assert renamed.status_code == begun.status_code == 422
    assert why in renamed.json()["detail"]
    assert begun.json()["detail"] == renamed.json()["detail"]
    after = client.get("/sessions/current").json()
    assert (after["id"], after["name"], after["events"]) == (before["id"], before["name"], before["events"])
    assert len(client.get("/sessions").json()["sessions"]) == len(listed)


def test_a_session_begins_with_the_longest_name_without_the_blanks_around_it(client):
    assert client.post("/sessions", json={"name": f" {'n' * 80} "}).json()["name"] == "n" * 80
