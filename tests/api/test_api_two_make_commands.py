"""Two operators make commands of one session: each is answered about their own."""

import pytest

from footfall.sequence.edit import Edit
from tests.support.server import running_server


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    """A running server with a sample open; no rover."""
    with running_server(tmp_path_factory.mktemp("sessions"), prepare=lambda s: s.open_sample("edited-export")) as made:
        yield made


def edits(live, digest):
    live.sequences.edit(digest, Edit("duration", 0, number=60.0))


def makes(live, digest):
    live.sequences.make(live.state.plan)


@pytest.mark.parametrize("other", [edits, makes])
def test_who_makes_commands_is_answered_about_those(server, client, monkeypatch, other):
    live, made = server.sessions.current, []
    make = live.sequences.make

    def make_beside(*order, **how):
        made.append(make(*order, **how))
        monkeypatch.undo()
        other(live, made[0])
        return made[0]

    monkeypatch.setattr(live.sequences, "make", make_beside)
    answer = client.post("/sessions/current/sequences", json={"plan": live.state.plan, "as_commanded": True})
    assert answer.status_code == 201, answer.text
    told = answer.json()
    assert told["digest"] == made[0] != live.state.sequence
    assert (told["current"], told["can_undo"]) == (False, False)
    assert told["id"] == f"{live.id}.{made[0][:12]}"
    assert answer.headers["etag"] == f'"{made[0]}"'
