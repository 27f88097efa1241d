"""The samples that a first run sends: the rover in physics stands where they start, and gets to where they say."""

import numpy as np
import pytest

from footfall.cli.recorded import RecordedSession
from footfall.resources import sample_sessions_folder
from footfall.sequence.commands import Sequence
from footfall.sequence.foretold import outcome
from footfall.sim.physics.referee import referee
from footfall.sim.physics.rover import PhysicalRover
from footfall.sim.physics.verdict import RefereeSettings
from footfall.terrain.dem import Dem

STANDING = ("rock-step", "rock-walk", "fractal-step")


def parts(name: str) -> tuple[RecordedSession, Dem, Sequence]:
    """A sample, the ground that its rover is put on, and its commands."""
    session = RecordedSession(sample_sessions_folder() / name)
    return session, session.world(), session.sequence()


@pytest.mark.parametrize("name", STANDING)
def test_the_rover_in_physics_stays_where_a_sample_starts(name: str) -> None:
    session, world, sequence = parts(name)
    at_rest = sequence.at_rest
    assert at_rest is not None
    rover = PhysicalRover(session.robot(), world, at_rest.state)
    assert np.linalg.norm(rover.settled.moved) < 5e-4
    assert rover.commanded == pytest.approx(at_rest.set_points, abs=1e-3)
    forces, _ = rover.wheel_forces()
    assert forces[:, 2] == pytest.approx(at_rest.state.wheel_forces[:, 2], abs=30.0)


@pytest.mark.parametrize("name", ["rock-step", "fractal-step"])
def test_a_first_run_ends_as_predicted(name: str) -> None:
    session, world, sequence = parts(name)
    robot = session.robot()
    assert sequence.at_rest is not None
    rover = PhysicalRover(robot, world, sequence.at_rest.state)
    report = referee(robot, sequence, world, RefereeSettings(physics=rover.settings), rover=rover)
    assert not report.failures
    known = session.typed(Dem, sequence.provenance.parents["dem"])
    rows = len(sequence.commands)
    came = outcome(robot, known, sequence, rover.state(), rover.commanded, run=1, rows=rows)
    assert came.verdict == "as_predicted", [one.text for one in came.differences if one.verdict != "as_predicted"]
