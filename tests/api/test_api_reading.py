"""Reading changes nothing: every GET of the interface leaves events, files and what is open as they were."""

from contextlib import closing, contextmanager

import pytest

from footfall.api.access import BASE
from footfall.maps.layers import MapStack
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.session.storage.databases import open_log
from footfall.session.storage.sqlite_log import DATABASE
from tests.support.server import running_server

SETS_A_COOKIE = (f"{BASE}/login/oidc", f"{BASE}/login/oidc/back")
"""Ways to a provider of accounts and back, which begin and end a login; refused where there is none."""
LEAST_ANSWERED = 45
"""GETs that find what they ask for; of other things, such as a route or a job, the sample has none."""


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """A folder with two sessions that nobody has open, and what they hold."""
    folder = tmp_path_factory.mktemp("sessions")
    with Sessions(folder, InlineJobs()) as sessions:
        other = sessions.open_sample("edited-export")
        live = sessions.open_sample("rock-step")
        state = live.state
        maps = next(iter(state.maps.values()))
        stack = live.get(maps)
        assert isinstance(stack, MapStack)
        sequence = (*state.sequence_history, state.sequence)[0]
        known = {
            "session": live.id,
            "other": other.id,
            "pair": "nav0",
            "side": "left",
            "layer": next(iter(stack.layers)),
            "sequence": f"{live.id}.{str(sequence)[:12]}",
            "job": "none",
            "name": "none.mcap",
            "maps": maps,
            "plans": str(state.plan),
            "terrains": str(state.dem),
        }
    return folder, known


def contents(folder):
    """Every file of the folder, and how many events each session has: none is ever changed. What lies in the files of
    the database may be moved about."""
    files = {
        path.relative_to(folder).as_posix(): (path.stat().st_mtime_ns, path.stat().st_ino, path.stat().st_size)
        for path in folder.rglob("*")
        if path.is_file() and not path.name.startswith(DATABASE)
    }
    with closing(open_log(folder, create=False)) as log:
        return files, log.sessions()


def gets(document, known, session):
    """(template, path with its parameters, query) of every GET of the document."""
    for template, methods in document["paths"].items():
        if "get" not in methods:
            continue
        asked = methods["get"].get("parameters", [])
        values = {**known, "session": session}
        if "digest" in template:
            values["digest"] = known.get(template.split("/")[5], "none")
        for one in asked:
            if "enum" in one["schema"]:
                values.setdefault(one["name"], one["schema"]["enum"][0])
        yield (
            template,
            template.format(**values),
            {one["name"]: 1.0 for one in asked if one["in"] == "query" and one.get("required")},
        )


@contextmanager
def reading(folder):
    with running_server(folder) as running, running.client() as client:
        running.app.state.streams.close()  # event streams end after what is recorded
        client.base_url = running.url
        yield running.sessions, client, running.app.openapi()


def test_no_get_changes_anything(stored):
    folder, known = stored
    with reading(folder) as (sessions, client, document):

        def read_all(session):
            before, open_before = contents(folder), sessions.opened()
            statuses = {}
            for template, path, query in gets(document, known, session):
                answer = client.get(path, params=query, follow_redirects=False)
                statuses[template] = answer.status_code
                assert answer.status_code < 500, (path, answer.text)
                assert sessions.opened() == open_before, f"GET {path} opened a session"
                assert contents(folder) == before, f"GET {path} changed what is stored"
            return statuses

        looked_at = read_all(known["session"])
        assert list(looked_at.values()).count(200) >= LEAST_ANSWERED, looked_at
        assert {looked_at[template] for template in SETS_A_COOKIE} == {409}
        sessions.open(known["session"])
        holding = read_all("current")
        # what is told of a session that is only looked at is told of it when it is open, too
        assert {one for one, status in looked_at.items() if status == 200} <= {
            one for one, status in holding.items() if status == 200
        }


def test_what_is_looked_at_is_as_fresh_as_what_is_written(stored):
    folder, known = stored
    with reading(folder) as (sessions, client, _):
        path = f"{BASE}/sessions/{known['session']}"
        looked = client.get(path).json()
        assert client.get(path).json() == looked
        # somebody else, as another server on the same folder would be
        with Sessions(folder, InlineJobs()) as others:
            others.get(known["session"]).add_note("by others")
            again = client.get(path).json()
        assert again["events"] == looked["events"] + 2  # opened there, and noted
        assert client.get(f"{path}/notes").json()["notes"][-1]["text"] == "by others"
        # whoever changes it opens it, and from then on that one is shown
        assert client.post(f"{path}/notes", json={"text": "here"}).status_code == 201
        assert [live.id for live in sessions.opened()] == [known["session"]]
        assert client.get(path).json()["events"] == again["events"] + 2


def test_nothing_is_to_be_heard_of_a_session_that_is_not_open(stored):
    folder, known = stored
    with reading(folder) as (_, client, _):
        answer = client.get(f"{BASE}/sessions/{known['session']}/events")
        assert (answer.status_code, answer.json()["type"]) == (409, "/problems/conflict")
        assert "open it" in answer.json()["detail"]
