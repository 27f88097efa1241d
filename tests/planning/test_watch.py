"""How time limits count: a replay waits longer than who asked first."""

from types import SimpleNamespace

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
