"""A link that cuts, delays, repeats, reorders, loses half of all, holds back: at most once, nothing after a stop."""

import asyncio
import json
import threading
from contextlib import contextmanager

import pytest

from benchmarks.soak.bad_link import BAD, BadLink, Badness
from footfall.planning.body.stand import stand
from footfall.robot.ik import contact_point
from footfall.sequence.commands import Command
from footfall.sequence.edit import Edit
from footfall.session.gate_notices import AGAIN_AFTER
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.sim.imager import Imager
from footfall.sim.process import RoverClient
from footfall.sim.rover import SimulatedRover
from footfall.telemetry.link import PATH
from footfall.terrain.generate import plane
from tests.support.server import running_server
from tests.support.waiting import BOUND, a_while, until

SESSION = "/sessions/current"


class WatchedRover(SimulatedRover):
    """A simulated rover that remembers what it set out on."""

    def __init__(self, *about):
        super().__init__(*about)
        self.begun = []

    def _begin(self, command):
        self.begun.append(command.id)
        return super()._begin(command)


@pytest.fixture(scope="module")
def served(tmp_path_factory, athlete):
    """A server with a sequence of three waits, and where the rover stands."""
    dem = plane(size=8.0, resolution=0.1)
    state = stand(athlete, dem)

    def prepare(sessions):
        live = sessions.create("bad link")
        live.terrains.load(dem, "made for the tests")
        live.stances.set(state)
        x, y, _ = contact_point(athlete, state.posture, 2, state.T_site_base)
        live.plans.step(2, (float(x), float(y) + 0.05)).finish(BOUND)
        digest = live.sequences.make(as_commanded=True)
        rows = len(live.get(digest).commands)
        for _ in range(3):
            digest = live.sequences.edit(digest, Edit("insert", 0, Command("WAIT", None, None, 0.15)))
        for _ in range(rows):
            digest = live.sequences.edit(digest, Edit("delete", 3))

    with running_server(tmp_path_factory.mktemp("sessions"), prepare=prepare) as server, server.client() as client:
        yield server, client, dem, state


@contextmanager
def rover_over(server, badness, rover, imager):
    """The rover's client and the bad link, in a thread and a loop of their own."""
    ended, loop, links = threading.Event(), asyncio.new_event_loop(), []

    async def run():
        async with BadLink(f"ws{server.url.removeprefix('http')}{PATH}", badness, 20081) as link:
            links.append(link)
            client = asyncio.create_task(RoverClient(link.url, rover, imager).run())
            await asyncio.to_thread(ended.wait)
            client.cancel()
            await asyncio.gather(client, return_exceptions=True)

    thread = threading.Thread(target=loop.run_until_complete, args=(run(),))
    thread.start()
    try:
        until(lambda: links, "the link")
        yield links[0]
    finally:
        ended.set()
        thread.join(BOUND)
        loop.close()


def sent_run(client):
    """Arm and send as soon as the link lets it; the number of the run."""
    digest = client.get(SESSION).json()["sequence"]

    def sent():
        armed = client.post(f"/sequences/{digest}/arm")
        if armed.status_code != 200:
            return None
        answer = client.post(f"/sequences/{digest}/send", json={"arming": armed.json()["token"]})
        return answer.json()["run"] if answer.status_code == 202 else None

    return until(sent, "a run sent")


def run_of(client, number):
    run = client.get(f"{SESSION}/run").json()
    return run if run["number"] == number else None


@pytest.mark.parametrize("name", BAD)
def test_at_most_once_and_nothing_after_a_stop(served, athlete, name):
    server, client, dem, state = served
    rover = WatchedRover(athlete, dem, state)
    link_before = client.get(SESSION).json()["link"]
    with rover_over(server, BAD[name], rover, Imager(athlete, dem, 0)) as link:
        until(lambda: client.get(SESSION).json()["link"]["connected"], "the link")
        # a run has an end that the log tells, whatever the line does
        first = sent_run(client)
        ended = until(lambda: (run := run_of(client, first)) and run["ended"] and run, "the end of the run")
        assert ended["outcome"] in ("done", "overdue", "link_lost", "refused")
        assert {row["state"] for row in ended["rows"]} <= {"done", "refused", "unknown", "unsent"}
        log = client.get(f"{SESSION}/log?limit=1000").json()["events"]
        assert [e["payload"]["outcome"] for e in log if e["type"] == "run_ended"][-1] == ended["outcome"]
        until(lambda: link.done["cut"] or not BAD[name].cut_every, "the first cut")
        # a stop in the middle of another one: it gets through, and nothing begins after the rover's word
        sent_run(client)
        assert client.post("/stop").json()["stopped"]
        until(lambda: client.get("/stop").json()["stop_acknowledged"], "the acknowledgement of the stop")
        begun = list(rover.begun)
        assert rover.mode == "stopped"
        a_while(0.6)  # whatever was delayed arrives
        assert rover.begun == begun
        # cleared: the operator clears again where the line lost it
        until(lambda: client.post("/stop/clear").status_code == 200 and rover.mode == "idle", "clearing", period=0.5)
        assert rover.begun == begun
        until(lambda: link.done["carried"] > 20, "enough messages for the counts below")
    assert len(set(rover.begun)) == len(rover.begun)
    told = [
        e["payload"] for e in client.get(f"{SESSION}/log?limit=1000").json()["events"] if e["type"] == "command_sent"
    ]
    assert set(rover.begun) <= {one["id"] for one in told}
    assert len({one["id"] for one in told}) == len(told)
    link_now = client.get(SESSION).json()["link"]
    counted = {kind: link_now[kind] - link_before[kind] for kind in ("gaps", "late", "repeated")}
    assert (counted["gaps"] > 0) >= (BAD[name].lose > 0), counted
    assert (counted["repeated"] > 0) >= (BAD[name].repeat > 0 and not BAD[name].reorder), counted
    assert (counted["late"] > 0) >= BAD[name].reorder, counted
    assert (link.done["lost"] > 0) == (BAD[name].lose > 0)
    assert (link.done["cut"] > 0) == (BAD[name].cut_every > 0)


def stop_and_clear(client, rover):
    assert client.post("/stop").json()["stopped"]
    until(lambda: client.get("/stop").json()["stop_acknowledged"], "the acknowledgement of the stop")
    assert client.post("/stop/clear").status_code == 200
    until(lambda: rover.mode == "idle", "clearing")


def refused_too_late(client, command_id):
    """Why, as the log tells it of a command; None while it does not."""
    log = client.get(f"{SESSION}/log?limit=1000").json()["events"]
    refused = (e["payload"] for e in log if e["type"] == "command_refused")
    return next((one["reason"] for one in refused if one["id"] == command_id), None)


@pytest.mark.parametrize("over", ["a stop and its clearing", "another connection", "a restart of the rover"])
def test_what_was_held_back_too_long_is_not_carried_out_and_the_operator_hears_of_it(served, athlete, over):
    server, client, dem, state = served
    rover, imager = WatchedRover(athlete, dem, state), Imager(athlete, dem, 0)
    counted = client.get(SESSION).json()["link"]["faults_by_kind"].get("outdated-command", 0)
    with rover_over(server, Badness(), rover, imager) as link:
        until(lambda: client.get(SESSION).json()["link"]["connected"], "the link")
        link.holding = True
        number = sent_run(client)
        until(lambda: link.held, "a command held back")
        held = list(link.held)
        late = json.loads(held[0])["id"]
        if over == "a stop and its clearing":
            stop_and_clear(client, rover)
            link.let_go()
            reason = until(lambda: refused_too_late(client, late), "the refusal")
            assert not rover.begun
            assert sent_run(client)  # and all goes on
            until(lambda: len(rover.begun) == 3 and rover.mode == "idle", "the next run carried out")
    if over != "a stop and its clearing":
        until(lambda: not client.get(SESSION).json()["link"]["connected"], "the end of the link")
        rover = WatchedRover(athlete, dem, state) if over == "a restart of the rover" else rover
        with rover_over(server, Badness(), rover, imager) as link:
            until(lambda: client.get(SESSION).json()["link"]["connected"], "the link")
            link.held = list(held)
            link.let_go()
            reason = until(lambda: refused_too_late(client, late), "the refusal")
            assert not rover.begun
    assert reason.startswith("outdated: ")
    told = client.get(SESSION).json()["link"]
    assert told["faults_by_kind"]["outdated-command"] == counted + 1
    assert told["fault"].startswith(f"command {late} came to the rover too late")
    if (run := run_of(client, number)) is not None:
        assert run["rows"][0]["state"] == "refused"


def test_a_stop_is_told_again_until_it_is_acknowledged(tmp_path):
    sent = []
    with Sessions(tmp_path, jobs=InlineJobs()) as sessions:
        live = sessions.create("lost stops")
        live.rover.connected(sent.append)
        live.commands.stop("lost on the way")
        until(lambda: len(sent) >= 3, "the stop told again")
        (told,) = {json.loads(text)["id"] for text in sent}
        assert {json.loads(text)["type"] for text in sent} == {"stop"}
        live.rover.take_stop_acknowledgement(told)
        count = len(sent)
        a_while(1.5 * AGAIN_AFTER)
        assert len(sent) == count
        assert [event.type for event in live.events()].count("stop_requested") == 1


def test_a_clearing_is_told_again_while_the_rover_says_that_it_is_stopped(served, athlete):
    server, client, dem, state = served
    rover = WatchedRover(athlete, dem, state)
    with rover_over(server, Badness(), rover, Imager(athlete, dem, 0)) as link:
        until(lambda: client.get(SESSION).json()["link"]["connected"], "the link")
        assert client.post("/stop").json()["stopped"]
        until(lambda: client.get("/stop").json()["stop_acknowledged"], "the acknowledgement of the stop")
        link.badness = Badness(lose=1.0)
        assert client.post("/stop/clear").status_code == 200
        a_while(1.5 * AGAIN_AFTER)  # telemetry is lost as well, and old news speak of before the clearing
        assert rover.mode == "stopped"
        link.badness = Badness()
        until(lambda: rover.mode == "idle", "the clearing told again")
        until(lambda: client.get(f"{SESSION}/telemetry").json()["mode"] == "idle", "telemetry after the clearing")
        a_while(1.5 * AGAIN_AFTER)
        rover.stop()  # somebody else's: what was cleared before it has no part in it
        a_while(3 * AGAIN_AFTER)
        assert rover.mode == "stopped"
        rover.clear_stop(rover.epoch or 0)
