"""Pixels of images from outside are held within a budget, and given back in all the ways that a request can end."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import Busy, Conflict, InvalidImages, InvalidTelemetry
from footfall.core.frames import transform
from footfall.session import value_store
from footfall.session.jobs.local import InlineJobs
from footfall.session.pixels import IN_ALL, OF_ONE, PixelBudget
from footfall.session.registry import Sessions
from footfall.session.rover import light_time
from footfall.session.rover.light_time import LightPath, LightTime
from footfall.telemetry.images import Camera, ImagePair, Snapshot
from footfall.terrain.dem import Dem
from footfall.terrain.generate import plane
from tests.support.frames import moving_frames
from tests.support.waiting import until

SIDE = 4
PIXELS = 2 * SIDE * SIDE


def snapshot(value: int = 0) -> Snapshot:
    image = np.full((SIDE, SIDE), value, np.uint8)
    left, right = (
        Camera(name, SIDE, SIDE, 5.0, 5.0, 2.0, 2.0, transform(translation=(x, 0.0, 0.0)))
        for name, x in (("l", 0.0), ("r", 0.3))
    )
    return Snapshot(moving_frames(1)[0].state, (ImagePair("p", 1.0, image, image, left, right, np.eye(4)),))


@given(st.lists(st.tuples(st.sampled_from("abc"), st.integers(0, 60), st.booleans()), max_size=40))
def test_what_is_held_never_exceeds_a_share_and_is_what_was_taken_and_not_given_back(acts):
    budget, open_, own = PixelBudget(50, 100), [], Counter()
    for client, pixels, ends in acts:
        if ends and open_:
            whose, size, held = open_.pop(0)
            with held:
                pass
            with held:  # a second end gives nothing back
                pass
            own[whose] -= size
            continue
        held = budget.of(client)
        fits = own[client] + pixels <= 50 and own.total() + pixels <= 100
        if fits:
            held.take(pixels)
            open_.append((client, pixels, held))
            own[client] += pixels
        else:
            with pytest.raises(InvalidImages if pixels > 50 else Busy):
                held.take(pixels)
        assert budget.held == own.total()


def test_a_refusal_says_which_how_much_and_what_to_try():
    budget = PixelBudget(50, 80)
    with pytest.raises(InvalidImages, match=r"51 pixels; of one client at most 50 .* send fewer, or smaller") as never:
        budget.of("a").take(51)
    assert never.value.details == {"pixels": 51, "limit": 50}
    with budget.of("a") as held:
        held.take(45)
        with pytest.raises(Busy, match=r"10 pixels, and 45 of this client .* at most 50 .* send them again") as own:
            budget.of("a").take(10)
        with pytest.raises(Busy, match=r"40 pixels, and 45 of all .* at most 80"):
            budget.of("b").take(40)
    assert own.value.details["retry_after"] > 0
    assert budget.held == 0
    assert OF_ONE < IN_ALL


def test_what_is_handed_on_is_held_until_it_is_given_back_once():
    budget = PixelBudget(50, 80)
    with budget.of("a") as held:
        held.take(30)
        give_back = held.hand_on()
    assert budget.held == 30
    give_back()
    assert budget.held == 0


@pytest.fixture
def sessions(tmp_path):
    with Sessions(tmp_path, InlineJobs(), recording=None) as made:
        yield made


def sent(sessions: Sessions, value: int = 0) -> str:
    live = sessions.current
    assert live is not None
    with sessions.pixels.of("rover") as held:
        held.take(PIXELS)
        return live.rover.take_images(snapshot(value), held)


def test_without_a_light_time_they_are_given_back_when_stored(sessions):
    live = sessions.create("near")
    assert sent(sessions) == live.state.snapshot
    assert sessions.pixels.held == 0


def test_what_can_not_be_stored_gives_them_back(sessions, monkeypatch):
    live = sessions.create("near")

    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(live, "put", full)
    with pytest.raises(OSError, match="No space"):
        sent(sessions)
    assert sessions.pixels.held == 0


def test_of_another_robot_they_are_given_back(sessions):
    live, one = sessions.create("near"), snapshot()
    another = replace(one, state=replace(one.state, robot="another"))
    with sessions.pixels.of("rover") as held:
        held.take(PIXELS)
        with pytest.raises(InvalidTelemetry):
            live.rover.take_images(another, held)
    assert sessions.pixels.held == 0


def test_they_are_held_while_the_light_time_lasts_and_no_more_than_may_be(sessions):
    sessions.pixels = PixelBudget(2 * PIXELS, 3 * PIXELS)
    sessions.set_light_time(LightTime(telemetry=1000.0))
    live = sessions.create("far")
    for value in (1, 2):
        sent(sessions, value)
    assert (live.state.snapshot, sessions.pixels.held) == (None, 2 * PIXELS)
    with pytest.raises(Busy, match="on their way while the light time lasts"):
        sent(sessions, 3)
    # they never arrive where the session is closed
    sessions.close()
    assert sessions.pixels.held == 0
    # nor what is said to it afterwards
    with sessions.pixels.of("rover") as held:
        held.take(PIXELS)
        live.rover.take_images(snapshot(4), held)
    assert sessions.pixels.held == 0


def test_when_the_light_time_is_over_they_are_given_back(sessions):
    sessions.set_light_time(LightTime(telemetry=0.1))
    live = sessions.create("not so far")
    digest = sent(sessions)
    until(lambda: live.state.snapshot == digest, "the arrival")
    until(lambda: sessions.pixels.held == 0, "room")


def test_where_too_much_is_on_the_way_they_are_given_back(sessions, monkeypatch):
    monkeypatch.setattr(light_time, "MOST_ON_THE_WAY", 1)
    sessions.set_light_time(LightTime(telemetry=1000.0))
    sessions.create("far")
    sent(sessions, 1)
    with pytest.raises(Conflict, match="on their way already"):
        sent(sessions, 2)
    assert sessions.pixels.held == PIXELS


def test_what_is_lost_on_the_way_is_told_once_and_never_arrives():
    told = []
    path = LightPath("images", lambda: 0.0)
    path.carry(lambda: told.append("arrived"), 5.0, lost=lambda: told.append("lost"))
    path.carry(lambda: told.append("arrived"), 5.0)
    path.close()
    path.close()
    assert told == ["lost"]


def test_images_that_are_kept_in_memory_are_counted_by_their_pixels(sessions, monkeypatch):
    monkeypatch.setattr(value_store, "CACHED_PIXELS", 2 * PIXELS)
    live = sessions.create("looked at")
    digests = [sent(sessions, value) for value in range(4)]
    values = live.value_store._values
    assert [digest in values for digest in digests] == [False, False, True, True]
    # what went is read from its file, and takes the place of the oldest
    assert isinstance(live.get(digests[0]), Snapshot)
    assert [digest in values for digest in digests] == [True, False, False, True]
    # values without images stay
    assert snapshot().state.digest in values


def test_large_values_that_are_kept_in_memory_are_few_and_the_latest(sessions, monkeypatch):
    live = sessions.create("large maps")
    grounds = [plane(size=2.0, resolution=0.1 + 0.01 * number) for number in range(value_store.CACHED_ANYWAY + 2)]
    monkeypatch.setattr(value_store, "CACHED_BYTES", grounds[-1].heights.nbytes)
    for ground in grounds:
        live.put(ground)
    values = live.value_store._values
    assert list(values) == [ground.digest for ground in grounds[-value_store.CACHED_ANYWAY :]]
    found = live.get(grounds[0].digest)
    assert isinstance(found, Dem)
    assert found.heights.tobytes() == grounds[0].heights.tobytes()
    assert list(values)[-1] == grounds[0].digest
    # in what is small, many are kept
    monkeypatch.setattr(value_store, "CACHED_BYTES", 1 << 30)
    for ground in grounds:
        live.get(ground.digest)
    assert {ground.digest for ground in grounds} <= set(values)
