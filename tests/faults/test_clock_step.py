"""The computer's clock is stepped under a running server: conn, arming, freshness and order go by another clock."""

import time
from random import Random

import pytest

from benchmarks.soak.ledger import Ledger
from benchmarks.soak.script import Script
from footfall.io.terrain_files import write_terrain
from footfall.planning.body.stand import stand
from footfall.robot.ik import contact_point
from footfall.session import folded_log
from footfall.session.clock import ClockWatch
from footfall.session.storage.verify import verify
from footfall.terrain.generate import plane
from tests.support.server import running_server
from tests.support.waiting import until

SESSION = "/sessions/current"


class WallClock:
    """The time of day, as it is, and ``ahead`` of it [s]."""

    def __init__(self):
        self._true, self.ahead = time.time, 0.0

    def __call__(self):
        return self._true() + self.ahead


@pytest.fixture
def wall(monkeypatch):
    clock = WallClock()
    monkeypatch.setattr(time, "time", clock)
    monkeypatch.setattr(folded_log, "ClockWatch", lambda last: ClockWatch(last, clock))
    return clock


def test_a_step_of_the_clock_ends_no_lease_run_or_arming_and_keeps_the_order(wall, tmp_path, athlete):
    dem = plane(size=8.0, resolution=0.1)
    write_terrain(dem, tmp_path / "world.npz")
    state = stand(athlete, dem)
    points = [contact_point(athlete, state.posture, leg, state.T_site_base) for leg in range(6)]

    def prepare(sessions):
        live = sessions.create("stepped clock")
        live.terrains.load(dem, "made for the tests")
        live.stances.set(state)

    homes = [(float(x), float(y)) for x, y, _ in points]
    with running_server(tmp_path / "data", prepare=prepare) as server:
        live = server.sessions.current
        assert live is not None
        script = Script(server.url, Ledger(), Random(20081), homes, tmp_path / "world.npz")
        server.rover.start()
        until(script.linked, "the rover's link")
        script.wait_on_rover()
        holder = script.client.get(f"{SESSION}/conn").json()
        sequence = script.client.get(SESSION).json()["sequence"]
        due: list[float] = []

        def step_in_the_run(message):
            if message["type"] == "event" and message["event"]["type"] == "command_sent" and due:
                wall.ahead += due.pop()

        live.listen(step_in_the_run)
        for by in (3600.0, -7200.0, 1800.0):
            told = len(live.events())
            due.append(by)
            script.wait_on_rover()  # the run ends well
            assert not due
            (jump,) = [event for event in live.events()[told:] if event.type == "clock_jumped"]
            assert jump.payload["by"] == pytest.approx(by, abs=1.0)
            # armed before the next step, sent after it
            token = until(lambda: armed(script.client, sequence), "the arming")
            wall.ahead += 60.0
            sent = script.client.post(f"/sequences/{sequence}/send", json={"arming": token})
            assert sent.status_code == 202, sent.text
            until(lambda: script.client.get(f"{SESSION}/run").json()["ended"], "the end of the run")
            # nobody lost the conn, and what is fresh is still fresh
            assert script.client.get(f"{SESSION}/conn").json()["number"] == holder["number"]
            until(script.linked, "fresh telemetry")
        wall.ahead -= 1e6
        script.stop()
        until(lambda: script.client.get("/stop").json()["stop_acknowledged"], "the rover's word")
        script.clear_stop()
        script.wait_on_rover()
        script.client.close()
        events = live.events()
    assert [event.seq for event in events] == list(range(len(events)))
    assert [one for one in verify(tmp_path / "data") if one.harmful] == []


def armed(client, sequence):
    """A token, once the gate gives one: on a busy machine telemetry may be too old for a moment."""
    answer = client.post(f"/sequences/{sequence}/arm")
    return answer.json()["token"] if answer.status_code == 200 else None
