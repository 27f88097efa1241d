"""How time limits count: a replay waits longer than who asked first."""

from types import SimpleNamespace

import numba
import pytest

from footfall.planning import watch


def test_time_is_counted_slower_where_patience_is_had(monkeypatch):
    now = 100.0
    monkeypatch.setattr(watch, "time", SimpleNamespace(monotonic=lambda: now))
    assert watch.time_taken(60.0) == pytest.approx(40.0)
    with watch.patience(4.0):
        assert watch.time_taken(60.0) == pytest.approx(10.0)
        ticking = watch.Watch(time_limit=1.0)
        now += 3.9
        ticking.tick()
        now += 0.2
        with pytest.raises(watch.OutOfTime):
            ticking.tick()
    assert watch.time_taken(now - 1.0) == pytest.approx(1.0)


def test_time_in_which_kernels_are_compiled_does_not_count(monkeypatch):
    now, compiled = 100.0, 7.0
    monkeypatch.setattr(watch, "time", SimpleNamespace(monotonic=lambda: now))
    monkeypatch.setattr(watch, "_time_compiling", lambda: compiled)
    ticking = watch.Watch(time_limit=1.0)
    now, compiled = 160.0, 66.5
    ticking.tick()
    with ticking.uncounted():
        now, compiled = 200.0, 80.0
    now += 0.4
    ticking.tick()
    now += 0.2
    with pytest.raises(watch.OutOfTime):
        ticking.tick()


def test_a_kernel_that_is_compiled_takes_time_that_is_measured():
    @numba.njit
    def kernel(x):
        return x + 1.0

    before = watch._time_compiling()
    assert kernel(1.0) == 2.0
    compiled = watch._time_compiling()
    assert compiled > before
    assert kernel(2.0) == 3.0
    assert watch._time_compiling() == compiled
