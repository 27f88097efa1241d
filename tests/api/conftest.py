"""Servers for the tests of the REST interface: with a small terrain, with a simulated rover on it, standing."""

import pytest

from footfall.planning.body.stand import stand
from footfall.session.registry import Sessions
from footfall.terrain.generate import rock_field
from tests.support.chassis_ground import wavy
from tests.support.server import Running, running_server


def _prepare(sessions: Sessions) -> None:
    sessions.create("field test").terrains.load(rock_field(size=10.0, resolution=0.1, seed=3), "made for the tests")


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    """A running server whose current session has a terrain; no rover. One a file: what one file does to it, another
    would find there."""
    with running_server(tmp_path_factory.mktemp("sessions"), prepare=_prepare) as running:
        yield running


@pytest.fixture
def client(server: Running):
    with server.client() as made:
        yield made


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """A running server with an empty session, for one file's tests of the rover link."""
    with running_server(tmp_path_factory.mktemp("sessions"), prepare=lambda s: s.create("first")) as running:
        yield running


@pytest.fixture(scope="module")
def ground(plain):
    """A client of that server."""
    with plain.client() as client:
        yield client


@pytest.fixture(scope="module")
def rover_server(tmp_path_factory):
    """A running server with a simulated rover, for the whole job."""
    with running_server(tmp_path_factory.mktemp("sessions"), prepare=_prepare) as running:
        running.rover.start()
        yield running


def _stand(sessions: Sessions) -> None:
    live = sessions.create("standing")
    dem = wavy(half=4.0)
    live.terrains.load(dem, "made for the tests")
    live.stances.set(stand(live.robot, dem))


@pytest.fixture(scope="module")
def standing_server(tmp_path_factory):
    """A running server whose current session has gentle waves and a state that stands on them; no rover."""
    with running_server(tmp_path_factory.mktemp("sessions"), prepare=_stand) as running:
        yield running


@pytest.fixture(scope="module")
def standing(standing_server: Running):
    """A client of it."""
    with standing_server.client() as made:
        yield made
