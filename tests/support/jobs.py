"""Waiting over REST: for jobs, and for commands that were sent; what happens while a job is worked on."""

from collections.abc import Callable

import httpx

from footfall.session.jobs.local import InlineJobs
from footfall.session.live import LiveSession
from footfall.session.products.kinds import Kind
from tests.support.waiting import until


def finished(client: httpx.Client, accepted: httpx.Response, state: str = "done") -> dict:
    """The job of a 202 answer when it has ended, in the state that is expected."""
    assert accepted.status_code == 202, accepted.text
    location = accepted.headers["location"].removeprefix("/api/v1")

    def ended() -> dict | None:
        job = client.get(location).json()
        return job if job["state"] not in ("queued", "running") else None

    job = until(ended, f"the end of {location}")
    assert job["state"] == state, job
    return job


def result(client: httpx.Client, job: dict) -> dict:
    """What the job made, read from the address that it names."""
    answer = client.get(job["result_url"].removeprefix("/api/v1"))
    assert answer.status_code == 200, answer.text
    assert answer.json()["digest"] == job["result"]
    return answer.json()


def carried_out(client: httpx.Client, commands: int) -> None:
    """Wait until all commands of the current session's run are done; none may be refused, aborted or unknown."""

    def done() -> bool:
        states = [one["state"] for one in client.get("/sessions/current").json()["commands"]]
        assert not {"refused", "aborted", "unknown"} & set(states), states
        return len(states) == commands and set(states) == {"done"}

    until(done, f"{commands} commands carried out")


def run_compared(client: httpx.Client) -> dict:
    """What came of the run that has ended, once the rover is at rest."""
    return until(
        lambda: (now := client.get("/sessions/current/run").json()["compared"])["state"] == "compared" and now,
        "the run compared with its prediction",
    )


def meanwhile(live: LiveSession, kind: Kind, act: Callable[[], object]) -> None:
    """Have something done while the next product of a kind is made, of a session whose jobs run at once."""
    pool = live.product_jobs.pool
    assert isinstance(pool, InlineJobs)
    kept = pool._recipes
    recipe = kept[kind.name]

    def later(*about):
        pool._recipes = kept
        act()
        return recipe(*about)

    pool._recipes = {**kept, kind.name: later}
