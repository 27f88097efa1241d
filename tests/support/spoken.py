"""Telemetry that a test says itself, in place of a rover."""

from dataclasses import replace
from typing import Any, cast

import numpy as np

from footfall.sequence.commands import Sequence
from footfall.session.live import LiveSession
from footfall.telemetry.state import RobotState, TelemetryFrame
from tests.support.server import Running


def current(served: Running) -> LiveSession:
    live = served.sessions.current
    assert live is not None
    return live


def say(served: Running, number: int, **changes: Any) -> RobotState:
    """Telemetry as of the state that the session plans from, but for ``changes`` of it.

    Set points are those that the present commands start from, where these hold the pose.
    """
    return say_at(None, served, number, **changes)


def say_at(at: float | None, served: Running, number: int, **changes: Any) -> RobotState:
    """As :func:`say`; at: when it came, time.monotonic() [s], None: now."""
    live = current(served)
    assert live.state.state is not None
    before = cast(RobotState, live.get(live.state.state))
    state = replace(before, **{name: np.asarray(item, float) for name, item in changes.items()})
    commands = live.get(live.state.sequence) if live.state.sequence else None
    rest = commands.at_rest if isinstance(commands, Sequence) else None
    live.rover.take_telemetry(TelemetryFrame(number, state, before.posture if rest is None else rest.set_points), at)
    return state
