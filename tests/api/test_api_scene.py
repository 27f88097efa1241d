"""viser's page and WebSocket through the server's own address, and no other way in."""

import subprocess
import sys
from functools import partial

import httpx
import pytest
import viser
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

import footfall_ui.scene_server
from footfall_ui.scene.look import ABOVE
from footfall_ui.viser_door import open_viser
from tests.support.drawing import PROTOCOL, Drawing, drawn, scene_page
from tests.support.server import running_server
from tests.support.waiting import BOUND, a_while, until


@pytest.fixture(scope="module")
def scene_server(tmp_path_factory):
    with running_server(tmp_path_factory.mktemp("sessions"), scene=True) as running:
        yield running


def test_page_and_messages_come_through_the_proxy(scene_server):
    info = httpx.get(scene_server.api + "/info", trust_env=False, verify=False).json()
    assert info["scene"] == {"available": True, "reason": "", "url": "/scene/"}
    to_folder = httpx.get(scene_server.url + "/scene?fixedDpr=0.5", trust_env=False, verify=False)
    assert to_folder.headers["location"].endswith("/scene/?fixedDpr=0.5")
    page = httpx.get(scene_server.url + "/scene/", trust_env=False, verify=False)
    assert page.status_code == 200
    assert "<html" in page.text
    # the page connects to its own address without the last slash
    url = "ws" + scene_server.url.removeprefix("http") + "/scene"
    for address in (url, url + "/"):
        with connect(
            address, subprotocols=[PROTOCOL], proxy=None, max_size=None, origin=Origin(scene_server.url)
        ) as socket:
            assert socket.subprotocol == PROTOCOL
            assert isinstance(socket.recv(timeout=BOUND), bytes)


def test_versions_that_differ_are_told_to_the_page(scene_server):
    url = "ws" + scene_server.url.removeprefix("http") + "/scene"
    with connect(url, subprotocols=[Subprotocol("viser-v0.0.1")], proxy=None) as socket:
        with pytest.raises(ConnectionClosed) as caught:
            socket.recv(timeout=BOUND)
        assert caught.value.rcvd is not None
        assert caught.value.rcvd.code == 1002


ASK = """
import sys, httpx
from websockets.sync.client import connect
from websockets.exceptions import InvalidStatus
from footfall_ui.viser_door import SECRET_HEADER
port, secret, protocol = sys.argv[1:]
for headers in ({}, {SECRET_HEADER: "a guess"}, {"Origin": f"http://127.0.0.1:{port}"}, {SECRET_HEADER: secret}):
    print(httpx.get(f"http://127.0.0.1:{port}/index.html", headers=headers, trust_env=False).status_code)
    try:
        connect(f"ws://127.0.0.1:{port}", subprotocols=[protocol], additional_headers=headers, proxy=None).close()
        print("open")
    except InvalidStatus as refused:
        print(refused.response.status_code)
"""


def test_viser_itself_answers_no_other_process():
    server, door = open_viser()
    try:
        command = [sys.executable, "-c", ASK, str(door.port), door.secret, PROTOCOL]
        answers = subprocess.run(command, capture_output=True, text=True, check=True, timeout=BOUND).stdout.split()
    finally:
        server.stop()
    assert answers == [*["403", "403"] * 3, "200", "open"]


def test_a_scene_that_fails_does_not_take_the_server_with_it(tmp_path, monkeypatch):
    def fail(*_, **__):
        raise OSError("no more ports")

    monkeypatch.setattr(viser, "ViserServer", fail)
    with running_server(tmp_path, scene=True) as running:
        scene = httpx.get(running.api + "/info", trust_env=False, verify=False).json()["scene"]
        assert scene["available"] is False
        assert "no more ports" in scene["reason"]
        assert "no more ports" in httpx.get(running.url + "/scene/", trust_env=False, verify=False).text


def test_a_page_that_is_dressed_has_another_sky_and_no_other_page_has(tmp_path, monkeypatch):
    drawing = Drawing()
    monkeypatch.setattr(footfall_ui.scene_server, "open_viser", drawing.open)

    def skies():
        pages = [page.scene.get_handle_by_name("/sky") for page in drawing.servers[0].get_clients().values()]
        return [one.glb_data for one in pages if isinstance(one, viser.GlbHandle)]

    def dress(client, theme):
        return client.put(f"{running.url}/scene/theme", json={"theme": theme}, headers={"FootFall-Page": "one"})

    with (
        running_server(tmp_path, scene=True, prepare=lambda s: s.open_sample("rock-step")) as running,
        scene_page(running.url, "one"),
        scene_page(running.url, "other"),
        running.client() as client,
    ):
        before = until(lambda: skies() if len(skies()) == 2 else None, "two skies")
        assert before[0] == before[1]
        assert dress(client, "light").status_code == 204
        until(lambda: skies()[0] != before[0] or skies()[1] != before[1], "the sky of its theme")
        assert len(set(skies())) == 2
        assert before[0] in skies()
        refused = dress(client, "plaid")
        assert refused.status_code == 422
        assert "dark, light, sunlight" in refused.json()["detail"]
        fit = partial(client.put, f"{running.url}/scene/size", headers={"FootFall-Page": "one"})
        assert fit(json={"width": 640.5, "height": 480}).status_code == 204
        for wrong in ({"width": 0, "height": 480}, {"width": 640}, {"width": 640, "height": 1e9}, {"width": "wide"}):
            assert fit(json=wrong).status_code == 422


def test_a_page_that_opens_looks_from_where_it_says(tmp_path, monkeypatch):
    """As after a reload: the button of the look is still pressed."""
    drawing = Drawing()
    monkeypatch.setattr(footfall_ui.scene_server, "open_viser", drawing.open)

    def heights():
        return [page.camera.position[2] for page in drawing.servers[0].get_clients().values()]

    with (
        running_server(tmp_path, scene=True, prepare=lambda s: s.open_sample("rock-step")) as running,
        running.client() as client,
    ):
        with scene_page(running.url, "one"):
            until(lambda: "/sky" in drawn(drawing.servers[0]), "the first scene")
            assert max(heights()) < ABOVE / 2
        view = "/sessions/current/view"
        client.put(view, json={"look": "top"}, headers={"FootFall-Page": "one"}).raise_for_status()
        with scene_page(running.url, "one"):
            until(lambda: len(heights()) == 1 and heights()[0] > ABOVE, "the view from above")


def test_one_page_looks_back_and_no_other_does(tmp_path, monkeypatch):
    drawing = Drawing()
    monkeypatch.setattr(footfall_ui.scene_server, "open_viser", drawing.open)

    def with_plan():
        pages = drawing.servers[0].get_clients().values()
        return sum(page.scene.get_handle_by_name("/plan/path") is not None for page in pages)

    def look_back(client, event):
        return client.put(f"{running.url}/scene/moment", json={"event": event}, headers={"FootFall-Page": "one"})

    with (
        running_server(tmp_path, scene=True, prepare=lambda s: s.open_sample("rock-step")) as running,
        scene_page(running.url, "one"),
        scene_page(running.url, "other"),
        running.client() as client,
    ):
        until(lambda: with_plan() == 2, "the plan in two scenes")
        assert look_back(client, 1).status_code == 204
        until(lambda: with_plan() == 1, "one scene of the past")
        refused = look_back(client, 10**6)
        assert refused.status_code == 404
        assert "no event 1000000" in refused.json()["detail"]
        assert look_back(client, None).status_code == 204
        until(lambda: with_plan() == 2, "the plan in two scenes again")


def test_a_scene_whose_connection_comes_back_shows_the_moment_that_it_did(tmp_path, monkeypatch):
    """Its page still says which."""
    drawing = Drawing()
    monkeypatch.setattr(footfall_ui.scene_server, "open_viser", drawing.open)

    def shown():
        scenes = [page.scene for page in drawing.servers[0].get_clients().values()]
        there = [one for one in scenes if one.get_handle_by_name("/sky") is not None]
        return [one.get_handle_by_name("/plan/path") is not None for one in there]

    def look_back(client, event):
        one = {"FootFall-Page": "one"}
        client.put(f"{running.url}/scene/moment", json={"event": event}, headers=one).raise_for_status()

    with (
        running_server(tmp_path, scene=True, prepare=lambda s: s.open_sample("rock-step")) as running,
        running.client() as client,
    ):
        with scene_page(running.url, "one"):
            until(lambda: shown() == [True], "the plan")
            look_back(client, 1)
            until(lambda: shown() == [False], "the past")
        with scene_page(running.url, "one"):
            until(lambda: len(shown()) == 1, "the scene again")
            a_while(1.0)
            assert shown() == [False]
            look_back(client, None)
            until(lambda: shown() == [True], "the plan again")


def test_a_scene_that_ended_is_opened_behind_another_door(tmp_path, monkeypatch):
    drawing = Drawing()
    monkeypatch.setattr(footfall_ui.scene_server, "open_viser", drawing.open)

    with running_server(tmp_path, scene=True, prepare=lambda s: s.open_sample("rock-step")) as running:
        with scene_page(running.url):
            until(lambda: len(drawn(drawing.servers[0])) > 10, "the first scene")
            before = drawn(drawing.servers[0])
        url = "ws" + running.url.removeprefix("http") + "/scene"
        with running.client() as client:

            def available():
                return client.get("/info").json()["scene"]["available"]

            # found out by a page that is asked for
            drawing.servers[0].stop()
            assert httpx.get(running.url + "/scene/", trust_env=False, verify=False).status_code == 502
            until(lambda: len(drawing.servers) == 2 and available(), "the second scene")
            assert httpx.get(running.url + "/scene/", trust_env=False, verify=False).status_code == 200
            # by one that wants its messages; and again, where it could not be opened at once
            drawing.servers[1].stop()
            drawing.refused = True
            with pytest.raises(InvalidStatus, match="403"):
                connect(url, subprotocols=[PROTOCOL], proxy=None, origin=Origin(running.url))
            until(lambda: not available(), "the failed try")
            assert "no more ports" in client.get("/info").json()["scene"]["reason"]
            drawing.refused = False
            until(available, "the third scene")
        with scene_page(running.url) as socket:
            assert isinstance(socket.recv(timeout=BOUND), bytes)
            until(lambda: drawn(drawing.servers[2]) >= before, "all of it drawn again")
