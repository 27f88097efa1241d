"""What the rover said in the last minutes, over REST: as a page that is loaded asks for it."""

import time

import numpy as np
import pytest

from tests.support.frames import moving_frames
from tests.support.problems import problem
from tests.support.spoken import current

PAST = "/sessions/current/telemetry/past"


@pytest.fixture(scope="module")
def frames(server):
    """Forty frames, the first 100 s ago, with a pause of 40 s after the twentieth."""
    made, now = moving_frames(40), time.monotonic()
    for number, frame in enumerate(made):
        current(server).rover.take_telemetry(frame, now - 100 + number + (40 if number >= 20 else 0))
    return made


def test_channels_of_a_quantity_are_told_with_their_ages(client, frames):
    told = client.get(PAST, params={"quantity": "torque", "first": 12, "count": 3, "parts": 1000}).json()
    assert len(told["numbers"]) == 3
    ages = np.array(told["ages"])
    assert len(ages) == 40
    steps = -np.diff(ages)
    assert steps[19] == pytest.approx(41, abs=0.01)
    assert np.delete(steps, 19) == pytest.approx(1, abs=0.01)
    expected = np.array([frame.state.joint_torques[12:15] for frame in frames]).T
    assert np.array(told["numbers"]) == pytest.approx(expected, rel=1e-6)


def test_few_parts_keep_the_extremes(client, frames):
    told = client.get(PAST, params={"quantity": "error", "parts": 3}).json()
    assert len(told["ages"]) <= 6
    errors = [frame.commanded[0] - frame.state.posture[0] for frame in frames]
    assert [min(told["numbers"][0]), max(told["numbers"][0])] == pytest.approx([min(errors), max(errors)], rel=1e-5)


def test_questions_that_are_none(client):
    assert "torque" in problem(client.get(PAST, params={"quantity": "speed"}), 422, "invalid-input")["detail"]
    problem(client.get(PAST, params={"quantity": "torque", "since": 5, "until": 6}), 422, "invalid-input")
    problem(client.get(PAST, params={"quantity": "torque", "since": 601}), 422, "validation")
    problem(client.get(PAST), 422, "validation")
