"""Every limit at its border: what just fits is taken, one more is refused by name, and stop is never held back."""

import math
from dataclasses import fields
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.api.access import BASE
from footfall.api.assemble import assemble
from footfall.api.door.limits import IN_FILES, MAX_IMAGE_BYTES, MAX_IMAGES, PAGE_ITEMS, Limits
from footfall.api.door.pace import MOST_CLIENTS, Buckets
from footfall.core.errors import Busy, InvalidBundle, InvalidImages, InvalidInput, InvalidTerrain
from footfall.io import bundles
from footfall.io.image_files import MAX_PIXELS, decode_image
from footfall.io.terrain_files import decode_terrain
from footfall.session.jobs.local import InlineJobs, Jobs
from footfall.session.registry import Sessions
from footfall.terrain.dem import MAX_CELLS
from tests.support.hostile import png_that_claims, tiff_that_claims, zip_of
from tests.support.local import Local
from tests.support.problems import problem


@pytest.fixture(scope="module")
def sessions(tmp_path_factory):
    with Sessions(tmp_path_factory.mktemp("sessions"), InlineJobs()) as made:
        made.create("limits")
        yield made


def _client(sessions: Sessions, **limits: Any) -> Local:
    return Local(assemble(sessions, limits=Limits(**limits)))


def test_all_limits_are_told(sessions):
    told = _client(sessions).get("info").json()["limits"]
    assert {one.name for one in fields(Limits)} | set(IN_FILES) | {"jobs_waiting"} == set(told)
    assert told["request_bytes"] == Limits().request_bytes
    with Jobs(workers=0, queue_limit=7) as jobs:
        assert _client(Sessions(sessions.folder, jobs)).get("info").json()["limits"]["jobs_waiting"] == 7


@pytest.mark.parametrize(
    "wrong", [{"request_bytes": 0}, {"request_burst": 0}, {"requests_per_second": 0.0}, {"header_bytes": 0}]
)
def test_limits_that_let_nothing_through_are_refused(wrong):
    with pytest.raises(InvalidInput):
        Limits(**wrong)


def test_bodies(sessions):
    client = _client(sessions, request_bytes=100)
    body = '{"text": "' + "x" * 88 + '"}'
    assert len(body) == 100
    json = {"content-type": "application/json"}
    assert client.post("sessions/current/notes", content=body, headers=json).status_code == 201
    refused = problem(client.post("sessions/current/notes", content=body + " ", headers=json), 413, "too-large")
    assert refused["limit"] == 100


def test_headers(sessions):
    client = _client(sessions, header_bytes=1000)
    sent = sum(len(name) + len(text) for name, text in client.get("info").request.headers.items())
    fits = "x" * (1000 - sent - len("x-filling"))
    assert client.get("info", headers={"x-filling": fits}).status_code == 200
    assert problem(client.get("info", headers={"x-filling": fits + "x"}), 431, "headers-too-large")["limit"] == 1000
    assert client.post("stop", headers={"x-filling": fits * 2}).status_code == 200


def test_pace_and_that_stop_is_exempt(sessions):
    client = _client(sessions, request_burst=5, requests_per_second=0.01)
    assert [client.get("info").status_code for _ in range(5)] == [200] * 5
    refused = client.get("info")
    problem(refused, 429, "too-many-requests")
    assert 0 < int(refused.headers["retry-after"]) <= 100
    assert [client.post("stop").status_code for _ in range(20)] == [200] * 20


@given(
    rate=st.floats(0.1, 100),
    burst=st.integers(1, 20),
    gaps=st.lists(st.floats(0, 5), min_size=1, max_size=60),
)
def test_no_client_gets_more_than_its_rate(rate, burst, gaps):
    now = 0.0
    buckets = Buckets(rate, burst, lambda: now)
    taken = 0
    for gap in gaps:
        now += gap
        wait = buckets.take("one")
        taken += wait == 0
        assert taken <= burst + rate * now + 1e-6
        if wait:
            now += wait * (1 + 1e-9) + 1e-9
            assert buckets.take("one") == 0  # who waits as long as told is served
            taken += 1
        assert math.isfinite(wait)


def test_clients_do_not_share_and_are_forgotten_in_order():
    buckets = Buckets(1.0, 1, lambda: 0.0)
    assert buckets.take("one") == 0 < buckets.take("one")
    assert buckets.take("two") == 0
    for i in range(MOST_CLIENTS):
        buckets.take(f"client {i}")
    assert buckets.take("one") == 0


def test_full_queue_says_when_to_ask_again(sessions):
    with Jobs(workers=0, queue_limit=1) as jobs:
        jobs.submit("plan", {}, None)
        with pytest.raises(Busy):
            jobs.submit("plan", {}, None)
        app = assemble(sessions)

        @app.get(f"{BASE}/full")
        def full() -> None:
            jobs.submit("plan", {}, None)

        refused = Local(app).get("full")
        assert problem(refused, 503, "busy")["limit"] == 1
        assert int(refused.headers["retry-after"]) > 0


def test_pages(sessions):
    client = _client(sessions)
    assert client.get("sessions", params={"limit": PAGE_ITEMS}).status_code == 200
    problem(client.get("sessions", params={"limit": PAGE_ITEMS + 1}), 422, "validation")
    problem(client.get("sessions", params={"limit": 0}), 422, "validation")


def _photographs(client: Local, images: list[bytes]) -> str:
    files = [("calibration", ("c.yaml", b"version: 0"))]
    files += [("images", (f"p{i}_left.png", content)) for i, content in enumerate(images)]
    return client.post("sessions/current/terrains/photographs", files=files).json()["detail"]


def test_photographs(sessions):
    client = _client(sessions)
    assert f"may have {MAX_IMAGES}" not in _photographs(client, [b"x"] * MAX_IMAGES)
    assert f"may have {MAX_IMAGES}" in _photographs(client, [b"x"] * (MAX_IMAGES + 1))
    assert "larger than" not in _photographs(client, [bytes(MAX_IMAGE_BYTES)])
    assert f"p0_left.png is larger than {MAX_IMAGE_BYTES}" in _photographs(client, [bytes(MAX_IMAGE_BYTES + 1)])


def test_pixels():
    side = 5000
    assert side * (MAX_PIXELS // side) == MAX_PIXELS
    with pytest.raises(InvalidImages, match="damaged"):
        decode_image(png_that_claims(side, MAX_PIXELS // side))
    with pytest.raises(InvalidImages, match="the limit is"):
        decode_image(png_that_claims(side, MAX_PIXELS // side + 1))


def test_cells():
    assert MAX_CELLS == 4000 * 4000
    with pytest.raises(InvalidTerrain, match="corrupt"):
        decode_terrain(tiff_that_claims(4000, 4000), "t.tif")
    with pytest.raises(InvalidTerrain, match="cells"):
        decode_terrain(tiff_that_claims(4000, 4001), "t.tif")


def test_bundles(monkeypatch):
    monkeypatch.setattr(bundles, "MAX_FILES", 3)
    files = {"session.json": b"{}", "events.jsonl": b"", "one": b""}
    with pytest.raises(InvalidBundle, match="format"):
        bundles.read_bundle(zip_of(files))
    with pytest.raises(InvalidBundle, match="too large: 4 files"):
        bundles.read_bundle(zip_of(files | {"two": b""}))
    monkeypatch.setattr(bundles, "MAX_ZIP_BYTES", 10)
    with pytest.raises(InvalidBundle, match="format"):
        bundles.read_bundle(zip_of({"session.json": b"{}", "events.jsonl": b"x" * 8}))
    with pytest.raises(InvalidBundle, match="too large"):
        bundles.read_bundle(zip_of({"session.json": b"{}", "events.jsonl": b"x" * 9}))
