"""Under each attack of the benchmark a stop is answered, reaches the rover, and the attack ends as a refusal.

The attacks are those of benchmarks/attackers.py, smaller where size shows nothing, made again and again until the
stops have arrived.
"""

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial

import pytest
from websockets.exceptions import ConnectionClosed, WebSocketException
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from benchmarks import attackers
from benchmarks.attackers import ATTACKS
from footfall.api.door.limits import TOO_BIG
from footfall.core.errors import Conflict
from footfall.telemetry.link import AckMessage, HelloMessage, StopAckMessage, encode
from tests.support.server import Running
from tests.support.waiting import BOUND, joined, until

AT_ONCE = 2
HUNG_UP = 0
"""The server may hang up on who goes on sending, before its answer is read."""
NO_ROOM = 1013

# of the rover's messages by request: refused unread while a rover is linked
HOW: dict[str, tuple[attackers.Attack, set[int]]] = {
    "20 000 names at the login": (attackers.many_names, {413}),
    "60 MB of objects": (partial(attackers.many_lists, objects=100_000), {413}),
    "4 500 errors": (attackers.many_errors, {422}),
    "4 MiB of numbers": (attackers.telemetry, {409}),
    "3 MiB of objects": (partial(attackers.many_objects, objects=1000), {409}),
    "lists within lists": (attackers.deep, {422}),
    # 408: on a busy machine the first of ten bodies has waited longer than the server does before the last is there
    "bodies that do not end": (partial(attackers.unfinished, size=14 << 20, pause=0.1), {408, 503}),
    "uploads of 60 MB": (partial(attackers.uploads, words=10_000), {422}),
    "60 MiB on stop lines": (attackers.large_stops, {TOO_BIG}),
    "stops without end": (attackers.many_stops, set()),
    "all places to listen": (attackers.all_listeners, {NO_ROOM}),
    "messages that do not end": (partial(attackers.half_messages, pause=0.1), {TOO_BIG, NO_ROOM}),
    "blank images": (attackers.blank_images, {409}),
    "images just under the limits": (partial(attackers.large_images, side=100), {409}),
    "unread downloads": (partial(attackers.unread, pause=0.1), {200, 503}),
    "terrains just under the limits": (partial(attackers.large_terrain, side=200), {201}),
    "scans just under the limits": (partial(attackers.large_scan, points=1000), {202, 422}),
    "scans that unpack": (partial(attackers.unpacking_scan, side=500), {202, 422}),
    "bundles just under the limits": (partial(attackers.large_bundle, mib=1), {422}),
}


STOPPING = (attackers.large_stops, attackers.many_stops)
"""These stop the rover themselves: a message on a stop line stops it, however large it is."""


class Rover:
    """One that acknowledges every stop."""

    def __init__(self, server: Running) -> None:
        url = f"ws{server.api.removeprefix('http')}/rover"
        self.link = connect(url, subprotocols=[Subprotocol("footfall-rover-2")], proxy=None)
        self.stops: list[str] = []
        self.link.send(encode(HelloMessage("athlete", 6)))
        self.thread = threading.Thread(target=self._hear)
        self.thread.start()

    def _hear(self) -> None:
        try:
            for text in self.link:
                if (message := json.loads(text))["type"] == "stop":
                    self.stops.append(message["id"])
                    self.link.send(encode(StopAckMessage(message["id"], 1.0)))
        except ConnectionClosed:
            return

    def close(self) -> None:
        self.link.close()
        joined(self.thread)


@pytest.fixture
def rover(server):
    made = Rover(server)
    until(lambda: server.sessions.current.rover.link.connected, "the link")
    yield made
    cleared(server)
    made.close()
    server.until_rover_left()


@contextmanager
def attacked(server: Running, attack: attackers.Attack) -> Iterator[list[int]]:
    """How each attack ended, so far; the last ones end with this."""
    port, over, ends = int(server.url.rpartition(":")[2]), threading.Event(), []

    def again() -> None:
        while not over.is_set():
            try:
                ends.extend(attack(port) or [HUNG_UP])
            except (OSError, WebSocketException):
                ends.append(HUNG_UP)

    threads = [threading.Thread(target=again) for _ in range(AT_ONCE)]
    for thread in threads:
        thread.start()
    try:
        yield ends
    finally:
        over.set()
        for thread in threads:
            joined(thread)


def cleared(server: Running) -> None:
    """Clear the stop; one that comes in between, as of a line that was hung up on just now, is cleared after it."""
    live = server.sessions.current
    assert live is not None

    def could_be() -> bool:
        with suppress(Conflict):
            live.commands.clear_stop()
            return True
        return False

    until(could_be, "a stop that can be cleared")


def assert_stops_reach(server: Running, rover: Rover, clears: bool = True) -> None:
    """By request and by line: each is answered, and heard and acknowledged by the rover.

    clears: whether the first is cleared before the second; who stops meanwhile may let no stop be cleared.
    """
    live = server.sessions.current
    assert live is not None

    def arrives(before: int) -> None:
        until(lambda: len(rover.stops) > before, "the stop at the rover")
        until(lambda: live.commands.gate["stop_acknowledged"], "the rover's word")

    with server.client() as client:
        before = len(rover.stops)
        assert client.post("/stop").json()["stopped"] is True
        arrives(before)
    with connect(f"ws{server.api.removeprefix('http')}/stop/line", proxy=None) as line:
        before = len(rover.stops)
        if clears:
            cleared(server)
        line.send("{}")
        assert json.loads(line.recv(timeout=BOUND))["stopped"] is True
        arrives(before)


def test_every_attack_of_the_benchmark_is_here_or_has_its_own_test():
    assert set(ATTACKS) - set(HOW) == {"no attack", "a chatty rover"}


@pytest.mark.parametrize("told", HOW)
def test_a_stop_reaches_the_rover_while_others_attack(server, rover, told):
    attack, refusals = HOW[told]
    with attacked(server, attack) as ends:
        assert_stops_reach(server, rover, clears=attack not in STOPPING)
        until(lambda: ends, "the end of an attack")
    assert set(ends) <= refusals | {HUNG_UP}, told
    # and afterwards all is as before
    cleared(server)
    assert_stops_reach(server, rover)


def test_another_rover_is_turned_away(server, rover):
    with attacked(server, attackers.chatty_rover) as ends:
        until(lambda: ends, "a refusal")
        assert_stops_reach(server, rover)
    assert set(ends) == {403}


def test_a_stop_reaches_a_rover_that_talks_without_end(server):
    over, said = threading.Event(), []

    def talk(rover: Rover) -> None:
        while not over.is_set():
            for number in range(100):
                rover.link.send(encode(AckMessage(f"c{number % 7}", "started", "", 1.0)))
            said.append(100)

    rover = Rover(server)
    until(lambda: server.sessions.current.rover.link.connected, "the link")
    talking = threading.Thread(target=talk, args=(rover,))
    talking.start()
    try:
        until(lambda: said, "its first words")
        assert_stops_reach(server, rover)
    finally:
        over.set()
        joined(talking)
        cleared(server)
        rover.close()
        server.until_rover_left()
