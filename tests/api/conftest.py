"""One server for the tests of the REST interface, with a small terrain and a simulated rover on it."""

import pytest

from footfall.session.registry import Sessions
from footfall.terrain.generate import rock_field
from tests.support.server import Running, running_server


def _prepare(sessions: Sessions) -> None:
    sessions.create("field test").load_terrain(rock_field(size=10.0, resolution=0.1, seed=3), "made for the tests")


@pytest.fixture(scope="session")
def server(tmp_path_factory):
    """A running server whose current session has a terrain; no rover."""
    with running_server(tmp_path_factory.mktemp("sessions"), prepare=_prepare) as running:
        yield running


@pytest.fixture
def client(server: Running):
    with server.client() as made:
        yield made


@pytest.fixture(scope="session")
def rover_server(tmp_path_factory):
    """A running server with a simulated rover, for the whole job."""
    with running_server(tmp_path_factory.mktemp("sessions"), prepare=_prepare) as running:
        running.rover.start()
        yield running
