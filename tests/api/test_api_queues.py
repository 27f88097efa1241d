"""The queue over the interface: plans join it, it is read, shortened, and becomes commands with their foot moves."""

import pytest

from footfall.api.assemble import assemble
from footfall.planning.body.stand import stand
from footfall.robot.ik import contact_point
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from tests.support.chassis_ground import wavy
from tests.support.local import Local

SESSION = "sessions/current"


@pytest.fixture
def served(tmp_path, athlete):
    """A session about a rover that stands on waves, in this process."""
    with Sessions(tmp_path, InlineJobs(), robot=athlete) as sessions:
        live, dem = sessions.create("queued"), wavy(half=4.0)
        live.terrains.load(dem)
        live.stances.set(stand(athlete, dem))
        yield Local(assemble(sessions)), live


def queued(local, plan):
    """The answer to one more plan at the end of the queue."""
    told = local.post(f"{SESSION}/queues", json={"plan": plan})
    assert told.status_code == 202, told.text
    job = local.get(told.headers["location"]).json()
    assert job["state"] == "done", job
    return local.get(f"{SESSION}/queues/{job['result']}").json()


def test_a_step_and_a_move_join_become_commands_and_are_taken_away(served):
    local, live = served
    state = live.get(live.state.state)
    x, y, _ = contact_point(live.robot, state.posture, 2, state.T_site_base)
    live.plans.step(2, (float(x + 0.1), float(y + 0.1))).finish()
    first = queued(local, None)
    assert first["status"] == "found", first["reason"]
    move = local.post(f"{SESSION}/body-moves", json={"shift": {"dz": -0.08}, "after": first["digest"]})
    digest = local.get(move.headers["location"]).json()["result"]
    assert queued(local, digest)["status"] == "found"
    refused = queued(local, digest)
    assert (refused["status"], refused["plan"]) == ("start_invalid", None)
    assert "entry 2 of the queue ends" in refused["reason"]

    told = local.get(SESSION).json()["queue"]
    assert [one["what"] for one in told["entries"]] == ["leg 2", "chassis"]
    assert local.get(f"{SESSION}/queues/current").json()["digest"] == told["digest"]
    made = local.post(f"{SESSION}/sequences", json={"plan": told["digest"], "as_commanded": True}).json()
    assert made["valid"], made["rules"]
    assert [one["text"] for one in made["foot_moves"]] == ["entry 1 of 2: leg 2", "entry 2 of 2: chassis"]
    assert made["way"]["mode"] == "rigid"

    left = local.request("PUT", f"{SESSION}/queues/current", json={"to": told["entries"][1]["before"]}).json()
    assert [one["what"] for one in left["entries"]] == ["leg 2"]
    assert left["goes_on"] is True
    stale = local.request("PUT", f"{SESSION}/queues/current", json={"to": told["digest"]})
    assert (stale.status_code, "changed since" in stale.text) == (409, True)
    assert local.request("PUT", f"{SESSION}/queues/current", json={"to": None}).json() is None
    assert local.get(SESSION).json()["queue"] is None
    assert local.post(f"{SESSION}/queues", json={"plan": "0" * 32}).status_code == 404
