"""What a page reads when it opens, and when a frozen state is kept."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import footfall
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.telemetry.state import TelemetryFrame
from footfall.terrain.generate import plane


@pytest.fixture
def session(tmp_path: Path):
    with Sessions(tmp_path, jobs=InlineJobs()) as sessions:
        yield sessions.create("summary")


def test_the_summary_tells_of_ground_and_footfall(session, athlete) -> None:
    assert session.summary()["terrain"] is None
    session.terrains.load(plane(size=8.0, resolution=0.05), "a plane")
    terrain = session.summary()["terrain"]
    assert (terrain["rows"], terrain["cols"], terrain["known"]) == (161, 161, 1.0)
    assert session.summary()["footfall_answer"] is None
    session.maps.choose_footfall(2, 0.5, 1.5)
    assert session.summary()["footfall_answer"]["known"]
    assert session.summary()["pairs"] == []


def test_a_standing_rover_keeps_its_frozen_state(session, athlete) -> None:
    ground = plane(size=8.0, resolution=0.05)
    session.terrains.load(ground)
    state = footfall.stand(athlete, ground)
    session.rover.take_telemetry(TelemetryFrame(1, state, state.posture))
    frozen = session.stances.freeze()
    noisy = replace(state, time=5.0, posture=state.posture + 1e-6, wheel_forces=state.wheel_forces + 1.0)
    session.rover.take_telemetry(TelemetryFrame(2, noisy, noisy.posture))
    assert session.stances.freeze() == frozen
    moved = replace(state, time=6.0, posture=state.posture + np.eye(36)[7] * 1e-3)
    session.rover.take_telemetry(TelemetryFrame(3, moved, moved.posture))
    assert session.stances.freeze() != frozen
