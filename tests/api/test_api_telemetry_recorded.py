"""What the rover said in a whole session, over REST: as the page's plots ask for it."""

import time

import numpy as np
import pytest

from tests.support.frames import moving_frames
from tests.support.problems import problem
from tests.support.spoken import current
from tests.support.waiting import until

RECORDED = "/sessions/current/telemetry/recorded"


@pytest.fixture(scope="module")
def frames(server):
    made, now = moving_frames(40), time.monotonic()
    for number, frame in enumerate(made):
        current(server).rover.take_telemetry(frame, now - 100 + number + (40 if number >= 20 else 0))
    return made


def asked(client, **params):
    return client.get(RECORDED, params=params).raise_for_status().json()


def test_channels_of_several_quantities_are_told_together(client, frames):
    until(lambda: len(asked(client, channel="torque.13", parts=1000)["times"]) == 40, "the recorder's chunks")
    told = asked(client, channel=["torque.13", "share.2"], parts=1000)
    up = np.array([frame.state.wheel_forces[:, 2] for frame in frames])
    weight = up.sum(axis=1)
    expected = [
        [frame.state.joint_torques[13] for frame in frames],
        np.where(weight > 0, up[:, 2] / weight, 0.0),
    ]
    assert np.array(told["numbers"]) == pytest.approx(np.array(expected), rel=1e-5)
    assert told["silences"] == [pytest.approx([told["times"][19], told["times"][20]])]
    assert told["end"] - told["begin"] == pytest.approx(79, abs=0.01)
    assert told["now"] - told["begin"] >= 100 - 0.1
    assert told["unread"] == 0


def test_a_part_of_it_can_be_asked_for(client, frames):
    until(lambda: len(asked(client, channel="torque.13", parts=1000)["times"]) == 40, "the recorder's chunks")
    begin = asked(client, channel="torque.13")["begin"]
    told = asked(client, channel="torque.13", begin=begin + 4.5, end=begin + 9.5, parts=1000)
    assert told["numbers"][0] == pytest.approx([one.state.joint_torques[13] for one in frames[4:11]], rel=1e-6)


def test_questions_that_are_none(client, frames):
    until(lambda: asked(client, channel="torque.13")["times"], "the recorder's first chunk")
    assert "torque" in problem(client.get(RECORDED, params={"channel": "speed.0"}), 422, "invalid-input")["detail"]
    assert "35" in problem(client.get(RECORDED, params={"channel": "torque.36"}), 422, "invalid-input")["detail"]
    problem(client.get(RECORDED, params={"channel": "torque.1", "begin": 6, "end": 5}), 422, "invalid-input")
    problem(client.get(RECORDED, params={"channel": "torque"}), 422, "validation")
    problem(client.get(RECORDED), 422, "validation")
