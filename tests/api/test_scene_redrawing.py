"""The scene goes on where drawing fails: what failed is drawn again, and nothing else waits for it."""

import asyncio
import logging
import threading
from contextlib import closing, suppress

import pytest
import viser

from footfall.planning.body.stand import stand
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall_ui.scene import Scene
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.redrawing import Redrawing
from footfall_ui.scene.terrain import TerrainDrawing
from footfall_ui.scene.wakeup import LoopEvent, wake_in_loop
from tests.support.chassis_ground import wavy
from tests.support.waiting import BOUND, a_while, until

MESSAGES = 7
"""For a first terrain: each of the two frames above it, and it, made and hidden or shown; then shown."""


@pytest.fixture
def server():
    made = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield made
    made.stop()


def test_what_fails_is_drawn_again_and_logged_once(caplog):
    drawn, failures = [], [RuntimeError("deque mutated during iteration")] * 4

    def fail():
        if failures:
            raise failures.pop()
        drawn.append("late")

    redrawing = Redrawing({"fails": fail, "works": lambda: drawn.append("at once")})
    with caplog.at_level(logging.ERROR):
        redrawing.mark()
        until(lambda: "late" in drawn, "the part that failed")
    redrawing.close()
    assert drawn == ["at once", "late"]
    assert [record.message.split(":")[0] for record in caplog.records] == ["fails"]


def test_other_parts_that_keep_coming_do_not_keep_it_waiting():
    tries, marked = [], []

    def fail():
        tries.append(len(marked))
        if len(tries) < 4:
            raise OSError("not yet")

    redrawing = Redrawing({"fails": fail, "works": lambda: None})
    redrawing.mark("fails")

    def another():
        marked.append(1)
        redrawing.mark("works")
        return len(tries) == 4

    until(another, "the fourth try", period=0.01)
    redrawing.close()
    # each pause is twice the one before: others came meanwhile
    assert tries[3] - tries[2] > 1


def test_the_ground_is_drawn_in_the_end(server, tmp_path, monkeypatch, athlete, caplog):
    """viser's buffer fails as it does where its loop and this thread meet: after it took the message."""
    buffer = server._websock_server._broadcast_buffer
    push, failed = type(buffer).push, []

    def failing(self, message):
        push(self, message)
        name = getattr(message, "name", "")
        if threading.current_thread().name == "scene" and name and len(failed) < 60 and name not in failed:
            failed.append(name)
            raise RuntimeError("deque mutated during iteration")

    monkeypatch.setattr(type(buffer), "push", failing)
    with Sessions(tmp_path, jobs=InlineJobs()) as sessions:
        live = sessions.create("failing")
        dem = wavy(half=3.0)
        live.terrains.load(dem, "made for the test")
        live.stances.set(stand(athlete, dem))
        with closing(Scene(server)) as scene, caplog.at_level(logging.CRITICAL):
            scene.follow(live)
            ground = until(lambda: server.scene.get_handle_by_name(f"/terrain/{dem.digest}/texture"), "the ground")
            until(lambda: ground.visible, "the ground to be shown")
            assert f"/terrain/{dem.digest}/texture" in failed
            # another terrain: the older one's colours must not stay
            after = wavy(half=2.0)
            failed.clear()
            live.terrains.load(after, "made for the test")
            until(lambda: server.scene.get_handle_by_name(f"/terrain/{after.digest}/texture"), "the ground")
            until(lambda: not server.scene.get_handle_by_name(f"/terrain/{dem.digest}/texture"), "the old one's end")
    kept = [getattr(message, "name", "") for message in buffer.message_from_id.values()]
    assert f"/terrain/{after.digest}/texture" in kept


@pytest.mark.parametrize("at", range(MESSAGES + 1))
def test_a_terrain_that_was_drawn_half_leaves_with_the_others(server, monkeypatch, at):
    """Drawing fails at one message, whichever; before it is tried again the terrain has changed."""
    buffer, pushed = server._websock_server._broadcast_buffer, []
    push, before, after = type(buffer).push, wavy(half=1.0), wavy(half=0.5)

    def failing(self, message):
        push(self, message)
        pushed.append(message)
        if len(pushed) == at + 1:
            raise RuntimeError("deque mutated during iteration")

    drawing = TerrainDrawing(server)
    with monkeypatch.context() as patched:
        patched.setattr(type(buffer), "push", failing)
        with suppress(RuntimeError):
            drawing.show(before, None, None)
    assert len(pushed) == min(at + 1, MESSAGES)
    drawing.show(after, None, None)
    assert server.scene.get_handle_by_name(f"/terrain/{before.digest}/texture") is None
    assert server.scene.get_handle_by_name(f"/terrain/{after.digest}/texture").visible
    made = [message for message in buffer.message_from_id.values() if message.lifecycle_phase == "create"]
    left = {message.name for message in made if message.name.endswith("/texture")}
    assert left == {f"/terrain/{after.digest}/texture"}


def test_what_is_gone_already_is_not_taken_away_again(server):
    drawn = Drawn(server)
    parent = drawn.add(server.scene.add_frame, "/parent")
    drawn.add(server.scene.add_frame, "/parent/child")
    drawn.add(server.scene.add_frame, "/other")
    parent.remove()
    drawn.only({"/other"})  # viser warns where something is removed twice, and warnings are errors here
    newer = server.scene.add_frame("/other")
    drawn.clear()
    assert server.scene.get_handle_by_name("/other") is newer


def test_drawing_wakes_the_loop_without_touching_its_waiters(server):
    buffer = server._websock_server._broadcast_buffer
    wake_in_loop(server)
    event = buffer.message_event
    assert isinstance(event, LoopEvent)
    event.set()
    assert not event.is_set()
    woken = asyncio.run_coroutine_threadsafe(event.wait(), server.get_event_loop())
    a_while(0.05)
    assert not woken.done()
    server.scene.add_frame("/anything")
    assert woken.result(timeout=BOUND)
