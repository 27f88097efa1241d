"""From a plan to a rover that has done it: what was predicted, row by row and bit for bit."""

import numpy as np
import pytest

import footfall
from footfall.robot.ik import contact_point
from footfall.sequence.make import make_sequence
from footfall.sim.rover import SimulatedRover
from footfall.telemetry.link import CommandMessage, decode, encode
from footfall.terrain.generate import fractal, plane


@pytest.mark.parametrize("dem", [plane(12.0), fractal(12.0, roughness=0.1, seed=3)], ids=["plane", "fractal"])
def test_a_planned_step_is_carried_out_as_predicted(athlete, dem):
    state = footfall.stand(athlete, dem, x=0.0, y=0.0, yaw=0.1)
    foot = contact_point(athlete, state.posture, 0, state.T_site_base)
    result = footfall.plan_step(athlete, dem, state, 0, (0.97 * foot[0], 0.97 * foot[1] + 0.25), seed=1)
    assert result.plan is not None, result.reason
    sequence = make_sequence(result.plan, athlete, dem)
    assert sequence.valid, sequence.failures
    assert footfall.make_sequence(result.plan).commands[0].digest == sequence.commands[0].digest
    rover = SimulatedRover(athlete, dem, state)
    assert np.array_equal(rover.posture, sequence.start)
    for row, command in enumerate(sequence.commands):
        # through the link's text, as on the way to the real one
        message = decode(
            encode(
                CommandMessage(
                    f"c{row}", sequence.digest, row, command.name, command.leg, command.joints, command.duration
                )
            )
        )
        assert isinstance(message, CommandMessage)
        began = rover.time
        assert rover.command(message)[-1].state == "started"
        while rover.mode == "moving":
            rover.step(0.02)
        assert rover.mode == "idle"
        assert rover.time - began == pytest.approx(command.duration, abs=0.021)
        assert np.array_equal(rover.posture, sequence.predicted[row])
    assert (rover.state().wheel_forces[:, 2] > 0).all()
    landed = contact_point(athlete, rover.posture, 0, state.T_site_base, result.plan.normal)
    assert np.linalg.norm(landed - result.plan.contact) < 1e-6
