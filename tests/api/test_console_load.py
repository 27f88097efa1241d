"""How late telemetry is at its listeners, as the benchmark of the console counts it."""

import pytest

from benchmarks.console.load import delays


class Fed:
    """A listener that gets another frame whenever somebody looks, as one that still listens does. lag: of each [s]."""

    def __init__(self, lag, numbers):
        self._lag, self._numbers = lag, list(numbers)

    @property
    def heard(self):
        self._numbers.append(self._numbers[-1] + 1)
        return [(number, 0.1 * number, 0.1 * number + self._lag) for number in self._numbers]


def test_each_listener_is_as_late_as_its_frames():
    assert delays([Fed(0.05, range(50)), Fed(0.3, range(80))], 1.0) == pytest.approx([0.05, 0.3])


def test_a_frame_that_was_left_out_counts_until_a_newer_one_comes():
    whole, halved = Fed(0.01, range(100)), Fed(0.01, range(0, 100, 3))
    assert delays([whole, halved], 1.0) == pytest.approx([0.01, 0.21])
