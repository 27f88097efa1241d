"""Handles of what is in hand: dragged by viser's own messages through the proxy, by two operators with accounts."""

import contextlib
import json
import threading
from collections import deque
from contextlib import closing

import msgspec
import numpy as np
import pytest
import zstandard
from argon2 import PasswordHasher
from hypothesis import given
from hypothesis import strategies as st
from viser._messages import (
    TransformControlsDragEndMessage,
    TransformControlsDragStartMessage,
    TransformControlsUpdateMessage,
)
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Origin

from footfall.core.frames import quat_wxyz
from footfall.io.account_store import FILE
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.body.stand import stand
from footfall.session.access.accounts import Accounts
from footfall.session.access.identity import LOCAL, Identity, Role
from footfall.session.answers.choices import ReadOutAnswer, What
from footfall.session.choosing.hand import Held
from footfall_ui.scene.handles import Drag, Drags, place_of, pose_of
from tests.support.chassis_ground import wavy
from tests.support.drawing import say, scene_page
from tests.support.server import running_server
from tests.support.waiting import BOUND, until

BOSS = Identity("boss", Role.ADMIN, "command line")
HERE = "/sessions/current"
HANDLE, TAPE = "/hand/handle", "/tape/text"
START = (1.0, 2.6)


def _prepare(sessions):
    live = sessions.create("two operators")
    dem = wavy(half=4.0)
    live.terrains.load(dem, "made for the tests")
    live.stances.set(stand(live.robot, dem))
    live.maps.choose_footfall(2, *START)


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    path = tmp_path_factory.mktemp("accounts") / FILE
    with closing(Accounts(path, hasher=PasswordHasher(time_cost=1, memory_cost=8, parallelism=1))) as accounts:
        for name, role in (("root", Role.ADMIN), ("ada", Role.PLANNER), ("bob", Role.PLANNER), ("vic", Role.VIEWER)):
            accounts.add(name, role, f"a long password of {name}", BOSS)
        tokens = {name: accounts.add_token(f"of-{name}", name, BOSS) for name in ("ada", "bob", "vic")}
        with running_server(
            tmp_path_factory.mktemp("sessions"), scene=True, accounts=accounts, prepare=_prepare
        ) as running:
            yield running, {name: {"Authorization": f"Bearer {token}"} for name, token in tokens.items()}


class ScenePage:
    """viser's page of somebody: what it was sent of the handle, and drags."""

    def __init__(self, socket):
        self._socket = socket
        self.handles, self.texts = deque(), deque()
        threading.Thread(target=self._hear, daemon=True).start()

    def _hear(self):
        with contextlib.suppress(ConnectionClosed):
            for batch in self._socket:
                for one in _messages(batch):
                    if one["type"] == "TransformControlsMessage" and one["name"] == HANDLE:
                        self.handles.append(one)
                    elif one["type"] == "LabelMessage" and one["name"] == TAPE:
                        self.texts.append(one["props"]["text"])

    def drag(self, *poses):
        self._send(TransformControlsDragStartMessage(HANDLE))
        for T in poses:
            self._send(TransformControlsUpdateMessage(HANDLE, tuple(quat_wxyz(T[:3, :3])), tuple(T[:3, 3])))

    def has(self, what):
        """Whether the newest handle is of the footfall or of the chassis, which alone can be turned."""
        return bool(self.handles) and self.handles[-1]["props"]["disable_rotations"] == (what != "chassis")

    def let_go(self):
        self._send(TransformControlsDragEndMessage(HANDLE))

    def _send(self, message):
        message.owner = self.handles[-1]["owner"]  # each page has a handle of its own
        say(self._socket, message)


def _messages(batch):
    """What a batch of viser's messages (sizes, then zstandard over MessagePack) brings."""
    size, packed = (int.from_bytes(batch[at : at + 8], "little") for at in (0, 8))
    return msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(batch[16 : 16 + packed], size))["messages"]


@contextlib.contextmanager
def scene_of(server, name, page=""):
    running, tokens = server
    with scene_page(running.url, page, tokens[name]) as socket:
        yield ScenePage(socket)


@contextlib.contextmanager
def client_of(server, name):
    running, tokens = server
    with running.client() as client:
        client.headers.update(tokens[name])
        yield client


def at(x, y, z=0.3):
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


def test_a_drag_is_heard_by_all_and_chosen_when_it_is_let_go(server):
    running, tokens = server
    with client_of(server, "bob") as bob, scene_of(server, "ada") as ada:
        held = bob.put(f"{HERE}/hand", json={"what": "footfall"}).json()["hand"]
        assert held["by"]["name"] == "bob"
        before = len(bob.get(f"{HERE}/log").json()["events"])
        until(lambda: ada.has("footfall"), "the handle in ada's scene")
        url = "ws" + running.api.removeprefix("http") + f"{HERE}/events/line"
        with connect(url, additional_headers=tokens["bob"], origin=Origin(running.url), proxy=None) as line:
            ada.drag(*(at(START[0] + 0.01 * i, START[1]) for i in range(1, 11)))
            x = START[0] + 0.1
            told = None
            while told is None or told["place"][0] != pytest.approx(x):
                message = json.loads(line.recv(timeout=BOUND))
                told = message["data"] if message["type"] == "hand" else told
                assert message["type"] != "event", message
        assert told["by"] == {**told["by"], "name": "ada", "page": "scene"}
        assert "m from where it was" in told["read"]["text"]
        assert len(bob.get(f"{HERE}/log").json()["events"]) == before
        assert bob.get(HERE).json()["footfall"]["x"] == START[0]
        # it is ada's now: bob can't set it
        assert bob.post(f"{HERE}/hand/commit").status_code == 409
        ada.let_go()
        until(lambda: bob.get(HERE).json()["footfall"]["x"] == pytest.approx(x), "the footfall let go")
        made = bob.get(f"{HERE}/log").json()["events"][before:]
        assert [event["type"] for event in made] == ["footfall_chosen"]
        assert made[0]["payload"]["by"]["name"] == "ada"
        # and anybody takes it back, by name
        undo = bob.get(HERE).json()["undo"]
        assert (undo["by"], undo["choice"]) == ("ada", made[0]["seq"])
        bob.post(f"{HERE}/undo", json={"choice": undo["choice"]}).raise_for_status()
        assert bob.get(HERE).json()["footfall"]["x"] == START[0]
        assert bob.get(f"{HERE}/log").json()["events"][-1]["payload"]["by"]["name"] == "bob"
        # what is in hand goes back with it
        assert bob.get(f"{HERE}/hand").json()["hand"]["place"] == list(START)


def test_what_a_page_drags_in_its_own_scene_it_sets_itself(server):
    with client_of(server, "ada") as client, scene_of(server, "ada", "ada-1") as scene:
        client.headers["FootFall-Page"] = "ada-1"
        client.put(f"{HERE}/hand", json={"what": "footfall"}).raise_for_status()
        until(lambda: scene.has("footfall"), "the handle")
        scene.drag(at(START[0] + 0.05, START[1]))
        until(lambda: client.get(f"{HERE}/hand").json()["hand"]["moved"], "the drag")
        assert client.get(f"{HERE}/hand").json()["hand"]["by"]["page"] == "ada-1"
        client.post(f"{HERE}/hand/commit").raise_for_status()
        assert client.get(HERE).json()["footfall"]["x"] == pytest.approx(START[0] + 0.05)
        client.post(f"{HERE}/undo", json={}).raise_for_status()
        client.delete(f"{HERE}/hand").raise_for_status()


def test_the_chassis_is_dragged_and_turned_and_refused_with_the_reason(server):
    with client_of(server, "ada") as client, scene_of(server, "ada") as scene:
        client.put(f"{HERE}/hand", json={"what": "chassis"}).raise_for_status()
        until(lambda: scene.has("chassis"), "the handle")
        live = server[0].sessions.current
        T = live.get(live.state.state).T_site_base
        shift = BodyShift(0.05, 0.02, -0.04, 0.0, 0.0, 0.05)
        scene.drag(shift.applied(T))
        scene.let_go()
        until(lambda: client.get(HERE).json()["what_if"], "the what-if")
        found = client.get(HERE).json()["what_if"]
        assert np.allclose(BodyShift(**found).vector, shift.vector, atol=1e-9)
        scene.drag(BodyShift(dz=1.9).applied(T))
        scene.let_go()
        until(lambda: client.get(f"{HERE}/hand").json()["hand"]["refused"], "the refusal")
        held = client.get(f"{HERE}/hand").json()["hand"]
        assert "leg" in held["refused"]
        assert held["place"] == pytest.approx(list(shift.vector), abs=1e-9)
        assert client.get(HERE).json()["what_if"] == found
        client.delete(f"{HERE}/hand").raise_for_status()
        client.delete(f"{HERE}/what-if").raise_for_status()


def test_what_one_page_shows_is_drawn_on_it_alone(server):
    with (
        client_of(server, "ada") as client,
        scene_of(server, "ada", "ada-1") as first,
        scene_of(server, "ada", "ada-2") as second,
    ):
        for page in ("ada-1", "ada-2"):
            client.get(HERE, headers={"FootFall-Page": page}).raise_for_status()  # from here on it has its own
        for page, scene, length in (("ada-1", first, 3.0), ("ada-2", second, 5.0)):
            tape = {"shown": {"tape": True}, "tape": [[0.0, 0.0, 0.5], [length, 0.0, 0.5]]}
            client.put(f"{HERE}/view", json=tape, headers={"FootFall-Page": page}).raise_for_status()
            until(lambda s=scene: s.texts, f"the tape of {page}")
        assert "3.0" in first.texts[0]
        assert all("5.0" in text for text in second.texts)
        assert all("3.0" in text for text in first.texts)


def test_a_viewer_drags_nothing(server):
    with client_of(server, "ada") as ada, scene_of(server, "vic") as vic, scene_of(server, "ada") as scene:
        ada.put(f"{HERE}/hand", json={"what": "footfall"}).raise_for_status()
        until(lambda: vic.has("footfall") and scene.has("footfall"), "the handle")
        chosen = ada.get(HERE).json()["footfall"]
        vic.drag(at(0.0, 0.0))
        vic.let_go()
        # what came after it was heard, so what came before would have been
        scene.drag(at(START[0], START[1] + 0.05))
        until(lambda: ada.get(f"{HERE}/hand").json()["hand"]["moved"], "ada's drag")
        assert ada.get(f"{HERE}/hand").json()["hand"]["place"] == pytest.approx([START[0], START[1] + 0.05])
        assert ada.get(HERE).json()["footfall"] == chosen
        with client_of(server, "vic") as client:
            for way in ("undo", "redo"):
                assert client.post(f"{HERE}/{way}", json={}).status_code == 403
            assert client.put(f"{HERE}/hand", json={"what": "footfall"}).status_code == 403
        ada.delete(f"{HERE}/hand").raise_for_status()


@given(st.tuples(*[st.floats(-3, 3)] * 2), st.floats(-2, 2), st.tuples(*[st.floats(-0.4, 0.4)] * 6))
def test_where_a_handle_is_and_what_that_means_are_inverse(xy, z, shift):
    dem = GROUND
    T_site_base = BodyShift(0.3, -0.2, 1.1, 0.02, -0.03, 0.7).applied(np.eye(4))
    places: dict[What, tuple[float, ...]] = {"footfall": xy, "point": (*xy, z), "chassis": shift}
    for what, place in places.items():
        held = Held(what, 0, None, place, place, LOCAL, NOTHING_READ)
        assert place_of(what, pose_of(held, dem, T_site_base), T_site_base) == pytest.approx(place, abs=1e-9)


NOTHING_READ: ReadOutAnswer = {"good": None, "brief": "", "text": "", "reasons": [], "lines": []}
GROUND = wavy(half=4.0)


@given(st.lists(st.sampled_from(["drag", "let go", "tell"]), max_size=30))
def test_of_drags_the_newest_is_told_and_letting_go_always(acts):
    jobs, told, put = deque(), [], []
    drags = Drags(jobs.append, told.append)
    for act in acts:
        if act == "tell":
            if jobs:
                jobs.popleft()()
            continue
        put.append(Drag("footfall", 0, at(len(put), 0.0), act == "let go", 1))
        drags.put(put[-1])
    while jobs:
        jobs.popleft()()
    # in order, nothing twice, no letting go lost, and where it ended is told
    order = [next(i for i, one in enumerate(put) if one is drag) for drag in told]
    assert order == sorted(set(order))
    assert [put[i].over for i in order].count(True) == [one.over for one in put].count(True)
    assert order[-1:] == ([len(put) - 1] if put else [])
