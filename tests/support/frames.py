"""Telemetry frames for tests of recordings: with any numbers, and of a rover that moves a little."""

import numpy as np
from hypothesis import strategies as st

from footfall.core.frames import rotation_rpy, transform
from footfall.telemetry.state import MODES, RobotState, TelemetryFrame
from tests.support.sequences import HOSTILE

JOINTS = tuple(f"joint{i}" for i in range(36))
ODD = [0.0, -0.0, 5e-324, -5e-324, 2.2250738585072014e-308, 1.7976931348623157e308, 0.1 + 0.2, 1e16, 16777217.0]
numbers = st.floats(allow_nan=False, allow_infinity=False) | st.sampled_from(ODD)
texts = st.sampled_from(["athlete", *HOSTILE])


@st.composite
def any_frames(draw, legs: int = 6) -> TelemetryFrame:
    """A valid frame of any finite numbers, among them -0 and subnormal ones."""

    def several(count: int) -> np.ndarray:
        few = draw(st.lists(numbers, min_size=1, max_size=6))
        return np.resize(np.array(few), count)

    angle = st.floats(-4, 4)
    turned = rotation_rpy(draw(angle), draw(angle), draw(angle))
    state = RobotState(
        robot=draw(texts),
        time=draw(numbers),
        posture=several(6 * legs),
        T_site_base=transform(turned, [draw(st.floats(-1e6, 1e6) | st.sampled_from(ODD[:5])) for _ in "xyz"]),
        wheel_forces=several(3 * legs).reshape(legs, 3),
        joint_torques=several(6 * legs),
        mode=draw(st.sampled_from(MODES)),
    )
    return TelemetryFrame(draw(st.integers(0, 2**64 - 1)), state, several(6 * legs))


def moving_frames(count: int, first: int = 0, robot: str = "athlete") -> list[TelemetryFrame]:
    """Frames of a rover with noisy encoders, ten a second."""
    rng = np.random.default_rng(first)
    frames: list[TelemetryFrame] = []
    for number in range(first, first + count):
        posture = rng.normal(size=36)
        T = transform(rotation_rpy(*rng.normal(size=3)), rng.normal(size=3))
        time = 1.7e9 + 0.1 * number
        state = RobotState(robot, time, posture, T, rng.normal(size=(6, 3)), rng.normal(size=36), MODES[number % 4])
        frames.append(TelemetryFrame(number, state, posture + 0.01))
    return frames


def digests(frames) -> list[str]:
    """Their content: frames with equal digests are equal bit for bit."""
    return [frame.digest for frame in frames]
