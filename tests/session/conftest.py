"""Sessions over tiny recipes: the machinery is under test here, not the numbers."""

import importlib
from pathlib import Path

import numpy as np
import pytest

from footfall.planning.body.stand import stand
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.session.storage.databases import bind
from footfall.telemetry.state import RobotState, TelemetryFrame
from tests.support.chassis_ground import wavy
from tests.support.remembered import Made, RememberedJobs


@pytest.fixture(autouse=True)
def tiny(monkeypatch):
    """The module of tiny recipes, importable by name here and in workers."""
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    return importlib.import_module("tiny_recipes")


@pytest.fixture(params=["sqlite", "postgres"])
def store_in(request):
    """store_in(folder) → the folder, as a new one whose logs are in the database of the test's kind."""
    if request.param == "sqlite":
        return lambda folder: folder
    server = request.getfixturevalue("postgres")

    def bound(folder):
        bind(folder, server.fresh())
        return folder

    return bound


@pytest.fixture
def work(store_in, tmp_path):
    """A working folder, once with each kind of database."""
    return store_in(tmp_path / "work")


@pytest.fixture
def state_of(athlete):
    """state_of(offset=0.0, mode="idle", time=0.0) → RobotState near the standing posture."""

    def make(offset=0.0, mode="idle", time=0.0):
        posture = athlete.posture("stand").copy()
        posture[7] += offset
        return RobotState(athlete.name, time, posture, np.eye(4), np.zeros((6, 3)), np.zeros(36), mode)

    return make


@pytest.fixture
def frame_of(state_of):
    """frame_of(number, **state_of arguments) → TelemetryFrame."""

    def make(number=0, **about):
        state = state_of(**about)
        return TelemetryFrame(number, state, state.posture)

    return make


@pytest.fixture
def sessions(tmp_path, tiny, athlete):
    with Sessions(tmp_path / "sessions", jobs=InlineJobs("tiny_recipes"), robot=athlete) as opened:
        yield opened


@pytest.fixture
def session(sessions, tiny, state_of):
    """A session with terrain and state."""
    live = sessions.create("test")
    live.terrains.load(tiny.dem(), "test")
    live.stances.set(state_of())
    return live


@pytest.fixture(scope="session")
def dem():
    """Gentle waves."""
    return wavy(half=4.0)


@pytest.fixture(scope="session")
def standing(athlete, dem):
    """The state of a rover that stands on them."""
    return stand(athlete, dem)


@pytest.fixture(scope="module")
def remembered() -> Made:
    """What the jobs of a file's tests have made; those tests plan the same walk."""
    return {}


@pytest.fixture
def forgotten(remembered):
    """Nothing is made yet; for a test that changes how it is made. No other is given what is made here."""
    kept = dict(remembered)
    remembered.clear()
    yield
    remembered.clear()
    remembered.update(kept)


@pytest.fixture
def live(tmp_path, athlete, dem, standing, remembered):
    """A session with the real recipes, the rover frozen as it stands."""
    with Sessions(tmp_path / "sessions", jobs=RememberedJobs(remembered), robot=athlete) as opened:
        made = opened.create("on waves")
        made.terrains.load(dem)
        made.stances.set(standing)
        yield made
