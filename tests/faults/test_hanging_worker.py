"""A worker that is stopped (SIGSTOP) or whose server was killed: neither keeps others waiting."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from footfall.session.jobs.local import Jobs
from footfall.terrain.generate import plane
from tests.support.waiting import BOUND, until

TINY = Path(__file__).parents[1] / "session"
SERVER = """
import sys, time
from footfall.session.jobs.local import Jobs
if __name__ == "__main__":
    pool = Jobs("tiny_recipes", workers=1)
    pool.submit("pid", {}, None, lambda job, product: print(int(product), flush=True) or "x").finish(60)
    job = pool.submit("deaf", {}, None)
    while job.text != "deaf":
        time.sleep(0.01)
    print("deaf", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def pool(monkeypatch):
    monkeypatch.syspath_prepend(str(TINY))
    with Jobs("tiny_recipes", workers=1) as jobs:
        yield jobs


def worker_pid(pool):
    found = []
    pool.submit("pid", {}, None, lambda job, product: found.append(int(product)) or "x").finish(BOUND)
    return found[0]


def test_a_job_whose_worker_hangs_can_be_cancelled_and_the_pool_goes_on(pool):
    pid = worker_pid(pool)
    hanging, waiting = pool.submit("polite", {}, None), pool.submit("pid", {}, None)
    until(lambda: hanging.text == "running", "the work")
    os.kill(pid, signal.SIGSTOP)
    hanging.cancel()
    assert hanging.wait(BOUND)
    assert hanging.state == "cancelled"
    assert hanging.error is not None
    assert "did not stop by itself" in hanging.error.message
    waiting.finish(BOUND)
    assert worker_pid(pool) != pid


def test_a_large_job_that_a_hanging_worker_does_not_take_can_be_cancelled(pool):
    pid = worker_pid(pool)
    os.kill(pid, signal.SIGSTOP)
    large = plane(size=40.0, resolution=0.05)  # more than the pipe holds
    job = pool.submit("quick", {"dem": large}, None)
    until(lambda: job.state == "running", "the handing over")
    job.cancel()
    assert job.wait(BOUND)
    assert job.state == "cancelled"
    assert job.error is not None
    assert "did not take it" in job.error.message
    pool.submit("quick", {"dem": large}, None, lambda job, product: product.digest).finish(BOUND)


def test_a_worker_at_work_ends_with_its_server(tmp_path):
    (tmp_path / "server.py").write_text(SERVER)
    surroundings = {**os.environ, "PYTHONPATH": str(TINY)}
    command = [sys.executable, str(tmp_path / "server.py")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=surroundings) as server:
        assert server.stdout is not None
        pid = int(server.stdout.readline())
        assert server.stdout.readline() == "deaf\n"
        server.kill()
    until(lambda: not at_work(pid), "the end of the worker")


def at_work(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
