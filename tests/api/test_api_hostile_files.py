"""Hostile files at every door of a real server: each is refused by name, and the server goes on as before."""

import random
import warnings

import pytest

from footfall.api.door.body_limits import JSON_BYTES
from footfall.core.errors import InvalidInput
from footfall.io.bundles import MAX_FILES
from footfall.io.event_log import MAX_LINE
from tests.support.hostile import (
    ALIASES,
    DEEP,
    link,
    npz_of_objects,
    npz_that_claims,
    png_that_claims,
    tiff_that_claims,
    zip_of,
    zip_with,
)
from tests.support.problems import problem

ZIP = {"content-type": "application/zip"}
JSON = {"content-type": "application/json"}
PNG_OPTIONS = '{"size": [1.0, 1.0], "height_range": [0.0, 1.0]}'


ELSEWHERE = ("clock_jumped", "link_fault")
"""Events that come of themselves, or late from what another test did to the same server."""


@pytest.fixture(autouse=True)
def _goes_on(client):
    """Whatever was sent, the session is the same and the server answers."""
    before = client.get("/sessions/current").json()
    yield
    after = client.get("/sessions/current").json()
    assert (after["id"], after["dem"]) == (before["id"], before["dem"])
    said = client.get("/sessions/current/log", params={"since": before["events"] - 1}).json()["events"]
    assert [one["type"] for one in said if one["type"] not in ELSEWHERE] == []


TERRAINS = {
    "geotiff claims cells": ("t.tif", tiff_that_claims(2_000_000, 2_000_000), "cells"),
    "geotiff claims one row too many": ("t.tif", tiff_that_claims(4000, 4001), "cells"),
    "geotiff is cut": ("t.tif", tiff_that_claims(100, 100)[:60], "corrupt"),
    "grid claims cells": ("t.asc", b"ncols 1000000\nnrows 1000000\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2", "cells"),
    "grid of enormous numbers": ("t.asc", b"ncols 1e999\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2", "whole"),
    "grid of endless digits": (
        "t.asc",
        b"ncols " + b"9" * 5000 + b"\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2",
        "",
    ),
    "grid of enormous heights": ("t.asc", b"ncols 2\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\n1e300 2", ""),
    "picture claims pixels": ("t.png", png_that_claims(60_000, 60_000), "cells"),
    "picture is cut": ("t.png", png_that_claims(8, 8, bytes(72))[:44], "corrupt"),
    "picture holds too little": ("t.png", png_that_claims(8, 8, b""), "corrupt"),
    "pickled npz": ("t.npz", npz_of_objects(), "pickle"),
    "npz claims cells": ("t.npz", npz_that_claims(10**7, 10**7), "cells"),
    "npz is a plain zip": ("t.npz", zip_of({"heights.npy": b"not an array"}), "npz"),
    "ply claims vertices": (
        "t.ply",
        b"ply\nformat binary_little_endian 1.0\nelement vertex 999999999999\nproperty float x\nproperty float y\n"
        b"property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\0",
        "mesh",
    ),
    "stl claims triangles": ("t.stl", bytes(80) + b"\xff\xff\xff\xff" + bytes(50), "triangles"),
    "off claims faces": ("t.off", b"OFF\n3 999999999 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "cut"),
    "obj points past its vertices": ("t.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 999999999\n", ""),
    "obj of enormous numbers": ("t.obj", b"v 0 0 0\nv 1e308 0 0\nv 0 1e308 0\nf 1 2 3\n", "beyond"),
}


@pytest.mark.parametrize("case", TERRAINS)
def test_terrain_files(client, case):
    name, content, word = TERRAINS[case]
    options = {"options": PNG_OPTIONS} if name.endswith(".png") else None
    answer = client.post("/sessions/current/terrains", files={"file": (name, content)}, data=options)
    document = problem(answer, 422, "invalid-terrain")
    assert word in document["detail"]


def _with_session(extra: dict[str, bytes]) -> bytes:
    return zip_of({"session.json": b'{"format": "footfall-session", "version": 1}', "events.jsonl": b"", **extra})


def _twice() -> bytes:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return zip_with([("events.jsonl", b""), ("session.json", b"{}"), ("session.json", b"{}")])


def _text(length: int) -> bytes:
    """That no zip makes much smaller."""
    return random.Random(1).randbytes(length // 2).hex().encode()


# made when they are sent: some are large before they are packed
BUNDLES = {
    "no zip": (lambda: b"PK\x03\x04 not really", "no zip"),
    "bomb by ratio": (lambda: _with_session({f"artifacts/{'0' * 32}.npz": bytes(300 << 20)}), "unpack"),
    "too many files": (lambda: zip_of({f"artifacts/{i:032x}.npz": b"" for i in range(MAX_FILES + 1)}, False), "files"),
    "way out": (lambda: _with_session({"../../evil": b"x"}), "outside"),
    "way out from the root": (lambda: _with_session({"/etc/evil": b"x"}), "outside"),
    "way out by backslash": (lambda: _with_session({"..\\evil": b"x"}), "outside"),
    "link": (lambda: zip_with([("session.json", b"{}"), (link("events.jsonl"), b"/etc/passwd")]), "link"),
    "twice": (lambda: _twice(), "twice"),
    "deep JSON": (lambda: zip_of({"session.json": b"[" * DEEP, "events.jsonl": b""}), "JSON"),
    "deep JSON in the log": (lambda: _with_session({"events.jsonl": b"[" * DEEP + b"\n"}), ""),
    "a large session.json": (lambda: zip_of({"session.json": _text(2 << 20), "events.jsonl": b""}), "are refused"),
    "a long line": (lambda: _with_session({"events.jsonl": _text(MAX_LINE + 2) + b"\n"}), "line 1 has more than"),
    "what does not belong": (lambda: _with_session({"setup.py": b"import os"}), ""),
}


@pytest.mark.parametrize("case", BUNDLES)
def test_bundles(client, server, case):
    make, word = BUNDLES[case]
    listed = {one["id"] for one in client.get("/sessions").json()["sessions"]}
    document = problem(client.post("/recordings", content=make(), headers=ZIP), 422, "invalid-bundle")
    assert word in document["detail"]
    assert {one["id"] for one in client.get("/sessions").json()["sessions"]} == listed
    assert not list(server.sessions.folder.glob(".import-*"))


FILES = {
    "terrains": {"file": ("t.asc", b"ncols 2\nnrows 2\ncellsize 1\n0 0\n0 0\n")},
    "terrains/blend": {"file": ("t.asc", b"ncols 2\nnrows 2\ncellsize 1\n0 0\n0 0\n")},
    "terrains/scans": {"file": ("t.xyz", b"0 0 0\n1 1 1\n")},
}


@pytest.mark.parametrize("path", [*FILES, "terrains/photographs", "recordings"])
def test_files_are_read_by_what_the_sessions_read_with(client, server, monkeypatch, path):
    """A server's reads in a process apart, with little memory; tests/session/test_reading.py has what becomes there."""

    def refuse(work, /, *_, **__):
        raise InvalidInput(f"{work.__name__} takes more memory than there is")

    monkeypatch.setattr(server.sessions, "read", refuse)
    if path == "recordings":
        answer = client.post("/recordings", content=_with_session({}), headers=ZIP)
    elif path in FILES:
        answer = client.post(f"/sessions/current/{path}", files=FILES[path])
    else:
        pair = [("images", (f"a_{side}.png", b"\x89PNG\r\n")) for side in ("left", "right")]
        answer = client.post(f"/sessions/current/{path}", files=[("calibration", ("c.yaml", b"a: 1")), *pair])
    assert "takes more memory" in problem(answer, 422, "invalid-input")["detail"]


IMAGES = {
    "bomb": png_that_claims(30_000, 30_000, bytes(1 << 20)),
    "cut": png_that_claims(64, 64, bytes(65 * 64))[:60],
    "no image": b"GIF89a" + bytes(20),
}
CAMERA = (
    '{"width": 64, "height": 64, "fx": 60.0, "fy": 60.0, "cx": 32.0, "cy": 32.0, '
    '"T_base_camera": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}'
)


@pytest.mark.parametrize("case", IMAGES)
def test_pairs_of_images(standing, case):
    calibration = f'{{"camera_left": {CAMERA}, "camera_right": {CAMERA}}}'
    files = {"left": ("l.png", IMAGES[case]), "right": ("r.png", IMAGES[case])}
    answer = standing.post("/sessions/current/images/upload", files=files, data={"calibration": calibration})
    assert "l.png" in problem(answer, 422, "invalid-images")["detail"]


@pytest.mark.parametrize(
    ("calibration", "word"),
    [(ALIASES, "not read"), (b"a: " + b"[" * DEEP, "never ends"), (b"a: " + b"[" * 99 + b"]" * 99, "deeply")],
)
def test_calibration_files(client, calibration, word):
    left, right = png_that_claims(8, 8, bytes(72)), png_that_claims(8, 8, bytes(72))
    files = [
        ("calibration", ("c.yaml", calibration)),
        ("images", ("a_left.png", left)),
        ("images", ("a_right.png", right)),
    ]
    answer = client.post("/sessions/current/terrains/photographs", files=files)
    assert answer.status_code == 422, answer.text
    assert word in answer.json()["detail"]


@pytest.mark.parametrize("body", [b"[" * DEEP, b'{"leg":' * DEEP, b'{"leg": ' + b"9" * 5000 + b"}", b"\xff\xfe{}"])
def test_deep_and_endless_json(client, body):
    answer = client.post("/sessions/current/footfalls", content=body, headers=JSON)
    assert answer.status_code in (400, 413, 422)
    assert answer.headers["content-type"] == "application/problem+json"
    form = {"options": body.decode(errors="replace")}
    answer = client.post("/sessions/current/terrains", files={"file": ("t.asc", b"x")}, data=form)
    status, kind = (413, "too-large") if len(body) > JSON_BYTES else (422, "validation")
    problem(answer, status, kind)
