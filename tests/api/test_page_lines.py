"""The page opens its lines again a second after they closed: a server that gives up a line is not asked at once."""

import json

import pytest

from footfall.resources import static_folder
from tests.support.node import run


@pytest.fixture(scope="module")
def told():
    return json.loads(run("lines.mjs", str(static_folder())))


def test_the_line_of_stops_is_opened_again_after_a_second_each_time(told):
    assert [one["after"] for one in told["stops"]] == [[1000], [1000]]
    assert all(one["opened"] == ["ws://127.0.0.1:1/api/v1/stop/line"] for one in told["stops"])


def test_the_line_of_events_is_opened_again_after_a_second_and_later_where_there_is_no_room(told):
    assert (told["events"]["after"], told["full"]["after"]) == ([1000], [10_000])
    for one in (told["events"], told["full"]):
        (address,) = one["opened"]
        assert address.startswith("ws://127.0.0.1:1/api/v1/sessions/current/events/line?since=4")
