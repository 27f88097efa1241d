"""Text that no UTF-8 can hold is refused at every door, and a session of an older version that has some can be read."""

import hashlib
import io
import json
import zipfile

import pytest
from websockets.sync.client import connect

from footfall.core.errors import InvalidSequence
from footfall.io.imports import read_sequence
from tests.support.command_line import run
from tests.support.problems import problem
from tests.support.waiting import BOUND

JSON = {"content-type": "application/json"}
HALF = "cold \ud800 cameras"
SPELLED = r"cold \ud800 cameras"


@pytest.mark.parametrize(
    ("path", "body"),
    [
        ("/sessions/current/notes", {"text": HALF}),
        ("/sessions/current/notes", {HALF: "text"}),
        ("/sessions", {"name": HALF}),
        ("/sessions/current/plans", {"leg": 2, "target": [1, 2], "settings": {"planner": HALF}}),
        ("/sessions/current/maps", {"leg": 2, "settings": {HALF: {"deep": [HALF]}}}),
    ],
)
def test_a_body_with_one_is_refused_by_name(client, path, body):
    document = problem(client.post(path, content=json.dumps(body), headers=JSON), 422, "validation")
    assert f"lone surrogate, half a character: {SPELLED}" in document["detail"]


@pytest.mark.parametrize("body", [b'{"text": "a", "text": "b"}', b'{"text": "a", "look": {"x": 1, "x": 1}}'])
def test_a_body_that_gives_a_member_twice_is_refused_by_name(client, body):
    before = client.get("/sessions/current/notes").json()
    document = problem(client.post("/sessions/current/notes", content=body, headers=JSON), 422, "validation")
    assert "is given twice" in document["detail"]
    assert client.get("/sessions/current/notes").json() == before


def form(charset: str, *parts: str) -> dict:
    """A form's content and headers. parts: header parameters and text of each."""
    told = [one.replace("|", "\r\n\r\n", 1) for one in parts]
    content = "".join(f"--x\r\nContent-Disposition: form-data; {one}\r\n" for one in told) + "--x--\r\n"
    headers = {"content-type": f"multipart/form-data; boundary=x; charset={charset}"}
    return {"content": content.encode(), "headers": headers}


GRID = "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n0 0\n0 0\n"


@pytest.mark.parametrize(
    "parts",
    [
        (rf'name="file"; filename="{SPELLED}.asc"|{GRID}',),
        (f'name="file"; filename="a.asc"|{GRID}', f'name="options"|{{"name": "{SPELLED}"}}'),
        (f'name="file"; filename="a.asc"|{GRID}', f'name="{SPELLED}"|{{}}'),
    ],
)
def test_a_form_with_one_is_refused(client, parts):
    answer = client.post("/sessions/current/terrains", **form("raw_unicode_escape", *parts))
    assert "lone surrogate" in problem(answer, 422, "invalid-input")["detail"]


def test_a_form_that_gives_a_member_of_its_json_twice_is_refused(client):
    parts = f'name="file"; filename="a.asc"|{GRID}', 'name="options"|{"scale": 2.0, "scale": 1.0}'
    document = problem(client.post("/sessions/current/terrains", **form("utf-8", *parts)), 422, "validation")
    assert document["errors"][0] == {"where": "options", "what": "the member 'scale' is given twice", "got": None}


def test_a_stop_with_one_stops(client):
    answer = client.post("/stop", content=json.dumps({"reason": HALF}), headers=JSON)
    assert answer.json()["stopped"] is True
    assert client.post("/stop/clear").json()["stopped"] is False


def test_a_sequence_file_with_one_is_refused(tmp_path):
    path = tmp_path / "half.json"
    path.write_text(json.dumps({"format": "footfall-sequence", "robot": HALF}))
    with pytest.raises(InvalidSequence, match="lone surrogate"):
        read_sequence(path)


def as_older_versions_wrote_it(bundle: bytes) -> bytes:
    """The zip with half a character wherever it says HALF, its chain made anew, as versions did that let them in."""
    with zipfile.ZipFile(io.BytesIO(bundle)) as old:
        files = {name: old.read(name) for name in old.namelist()}
    for name in ("events.jsonl", "session.json"):
        files[name] = files[name].replace(b"HALF", SPELLED.encode())
    files["events.jsonl"], head = chained(files["events.jsonl"])
    about = json.loads(files["session.json"])
    files["session.json"] = json.dumps({**about, "head": {**about["head"], "hash": head}}).encode()
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as new:
        for name, content in files.items():
            new.writestr(name, content)
    return out.getvalue()


def chained(lines: bytes) -> tuple[bytes, str]:
    previous, out = "0" * 32, []
    for text in lines.splitlines():
        body = {**json.loads(text), "previous": previous}
        del body["hash"]
        told = json.dumps(body, sort_keys=True, separators=(",", ":")).encode()
        previous = hashlib.sha256(told).hexdigest()[:32]
        out.append(json.dumps({**body, "hash": previous}).encode() + b"\n")
    return b"".join(out), previous


@pytest.fixture(scope="module")
def older(server):
    """Id of a session that an older version wrote: its name, a note and a fault of the link have half a character."""
    with server.client() as client:
        client.post("/sessions", json={"name": "HALF"})
        client.post("/sessions/current/notes", json={"text": "HALF"})
        server.sessions.current.rover.take_complaint("HALF", about_rover="other")
        bundle = client.get(f"/recordings/{server.sessions.current.id}.zip").content
        made = client.post(
            "/recordings", content=as_older_versions_wrote_it(bundle), headers={"content-type": "application/zip"}
        )
        assert made.status_code == 201, made.text
        live = server.sessions.current
        assert [note.text for note in live.state.notes] == [HALF]  # else this shows nothing
        return live.id


def test_an_older_session_with_one_is_told_all_the_same(server, client, older):
    at = f"/sessions/{older}"
    events = client.get(f"{at}/log").json()["events"]
    assert SPELLED in [one["payload"].get("text") for one in events]
    assert SPELLED in [one["payload"].get("reason") for one in events]
    assert client.get(f"{at}/notes").json()["notes"][0]["text"] == SPELLED
    assert client.get(at).json()["name"] == SPELLED
    assert SPELLED in [one["name"] for one in client.get("/sessions").json()["sessions"]]
    with connect(f"ws{server.api.removeprefix('http')}{at}/events/line?since=-1", proxy=None) as line:
        assert [json.loads(line.recv(timeout=BOUND))["data"] for _ in events] == events
    with client.stream("GET", f"{at}/events", params={"since": -1}) as stream:
        lines = (text.removeprefix("data: ") for text in stream.iter_lines() if text.startswith("data: "))
        assert [json.loads(next(lines)) for _ in events] == events


def test_an_older_session_with_one_is_exported_and_verified(server, client, older, tmp_path):
    page = client.get(f"/recordings/{older}.html")
    assert page.status_code == 200
    assert SPELLED.encode() in page.content
    bundle = client.get(f"/recordings/{older}.zip")
    again = client.post("/recordings", content=bundle.content, headers={"content-type": "application/zip"})
    assert again.status_code == 201
    path = tmp_path / "older.zip"
    path.write_bytes(bundle.content)
    assert SPELLED in run("replay", path, "--json").output.replace("\\\\", "\\")
