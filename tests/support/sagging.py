"""A rover that gives way otherwise than was predicted, told to a session."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from footfall.sequence.commands import Sequence
from footfall.session.live import LiveSession
from footfall.telemetry.state import RobotState, TelemetryFrame


def stepped(live: LiveSession, state: RobotState, set_points: NDArray[np.float64], times: float) -> Sequence:
    """The planned step, commanded for sag, sent, and done row by row; returns what was sent.

    state, set_points: of the rover at rest, where it starts. times: how far its joints give way over what was
    predicted.
    """
    number = len(live.events())
    live.rover.take_telemetry(TelemetryFrame(number, state, set_points))
    sequence = live.get(live.sequences.make(live.executions.plan().finish()))
    assert isinstance(sequence, Sequence)
    assert sequence.at_rest is not None
    assert sequence.commanded is not None
    live.rover.take_telemetry(TelemetryFrame(number + 1, state, set_points))
    ids = live.commands.send(live.commands.arm()["token"])["commands"]
    start = sequence.start - sequence.at_rest.set_points
    for row, command_id in enumerate(ids):
        yielded = sequence.predicted[row] - sequence.commanded[row] - start
        told = replace(state, posture=sequence.commanded[row] + start + times * yielded)
        live.rover.take_telemetry(TelemetryFrame(number + 2 + row, told, sequence.commanded[row]))
        live.rover.take_acknowledgement(command_id, "done")
    return sequence
