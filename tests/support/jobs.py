"""Waiting for jobs over REST."""

import httpx

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
