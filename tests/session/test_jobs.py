"""The worker pool with real processes: progress, cancel, kill, and recovery from a dead worker."""

import os
import signal
import threading
from types import SimpleNamespace

import pytest

from footfall.core.errors import Cancelled, Conflict, FootFallError, InvalidInput, NotFound, WorkerLost
from footfall.session.jobs.local import InlineJobs, Jobs
from tests.support.waiting import BOUND, a_while, until


@pytest.fixture
def pool(tiny):
    before = set(threading.enumerate())  # another test's server may be running
    with Jobs("tiny_recipes", workers=1) as jobs:
        yield jobs
    assert not [t for t in set(threading.enumerate()) - before if t.name.startswith("footfall-worker")]


def worker_pid(pool):
    found = []
    pool.submit("pid", {}, None, lambda job, product: found.append(int(product)) or "x").finish(BOUND)
    return found[0]


def alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_values_cross_and_come_back_under_their_digest(pool, tiny):
    dem = tiny.dem(1.5)
    got = []
    job = pool.submit("quick", {"dem": dem}, None, lambda job, product: got.append(product) or product.digest)
    assert job.finish(BOUND) == dem.digest
    assert job.state == "done"
    assert job.fraction == 1.0
    assert isinstance(job.as_dict()["ended"], float)
    assert not got[0].heights.flags.writeable
    assert pool.get(job.id) is job
    with pytest.raises(NotFound):
        pool.get("nothing")


def test_errors_keep_their_kind_and_details(pool):
    with pytest.raises(InvalidInput, match="this is wrong") as caught:
        pool.submit("raises", {}, None).finish(BOUND)
    assert caught.value.details == {"what": 3}
    with pytest.raises(FootFallError, match="ZeroDivisionError: a bug"):
        pool.submit("breaks", {}, None).finish(BOUND)
    with pytest.raises(InvalidInput, match="no recipe"):
        pool.submit("unheard", {}, None).finish(BOUND)


def test_progress_then_a_polite_cancel_keeps_the_worker(pool):
    pid = worker_pid(pool)
    changes = []
    job = pool.submit("polite", {}, None, None, lambda job: changes.append((job.state, job.text)))
    until(lambda: job.text == "running", "the work")
    job.cancel()
    assert job.wait(BOUND)
    assert job.state == "cancelled"
    assert ("running", "running") in changes
    with pytest.raises(Cancelled):
        job.finish()
    assert worker_pid(pool) == pid


def test_a_deaf_job_is_killed_after_its_grace_and_the_pool_goes_on(pool):
    pid = worker_pid(pool)
    job = pool.submit("deaf", {}, None)
    until(lambda: job.text == "deaf", "the deaf work")
    job.cancel()
    assert job.wait(BOUND)
    assert job.state == "cancelled"
    assert not alive(pid)
    assert worker_pid(pool) != pid


def test_a_worker_that_dies_fails_its_job_only(pool):
    job = pool.submit("dies", {}, None)
    with pytest.raises(WorkerLost, match="died") as caught:
        job.finish(BOUND)
    assert caught.value.details["exit_code"] == 7
    pid = worker_pid(pool)
    running = pool.submit("deaf", {}, None)
    until(lambda: running.text == "deaf", "the deaf work")
    os.kill(pid, signal.SIGKILL)
    with pytest.raises(WorkerLost):
        running.finish(BOUND)


def test_a_job_whose_worker_ends_before_it_takes_it_up_goes_to_another(pool):
    pid = worker_pid(pool)
    os.kill(pid, signal.SIGSTOP)  # it is there when the job is handed over, and never reads it
    job = pool.submit("pid", {}, None, lambda job, product: product.decode())
    until(lambda: job.text == "starting", "the start")
    os.kill(pid, signal.SIGKILL)
    other = int(job.finish(BOUND))
    assert other != pid
    assert not alive(pid)
    for _ in range(5):  # nor does it matter how far the end of a worker has come
        killed = worker_pid(pool)
        os.kill(killed, signal.SIGKILL)
        assert worker_pid(pool) != killed


def test_a_job_that_no_worker_can_take_up_ends_with_the_second(pool):
    class Deadly:
        def __reduce__(self):
            return os._exit, (9,)

    with pytest.raises(WorkerLost, match="exit code 9"):
        pool.submit("quick", {"dem": SimpleNamespace(digest="x", value=Deadly())}, None).finish(BOUND)
    assert worker_pid(pool)


def test_the_queue_is_bounded_ordered_and_cancellable(tiny):
    with Jobs("tiny_recipes", workers=1, queue_limit=3) as pool:
        blocker = pool.submit("polite", {}, None)
        until(lambda: blocker.state == "running", "the work")
        order = []
        first = pool.submit("pid", {}, None, lambda job, _: order.append("first") or "x")
        urgent = pool.submit("pid", {}, None, lambda job, _: order.append("urgent") or "x", urgent=True)
        dropped = pool.submit("pid", {}, None)
        with pytest.raises(Conflict, match="waiting already"):
            pool.submit("pid", {}, None)
        dropped.cancel()
        assert dropped.state == "cancelled"  # at once, though the worker is busy
        blocker.cancel()
        first.finish(BOUND)
        urgent.finish(BOUND)
        assert order == ["urgent", "first"]


def test_closing_ends_what_runs_and_what_waits(tiny):
    pool = Jobs("tiny_recipes", workers=1)
    running, waiting = pool.submit("polite", {}, None), pool.submit("pid", {}, None)
    until(lambda: running.text == "running", "the work")
    pool.close()
    assert running.state == waiting.state == "cancelled"
    with pytest.raises(Conflict, match="closed"):
        pool.submit("pid", {}, None)


def test_a_product_that_can_not_be_recorded_fails_the_job(tiny, caplog):
    def full(job, product):
        raise OSError("disk full")

    job = InlineJobs("tiny_recipes").submit("pid", {}, None, full)
    assert job.state == "failed"
    with pytest.raises(FootFallError, match="disk full"):
        job.finish()
    assert "could not be recorded" in caplog.text


def test_newer_maps_cancel_older_ones_of_the_same_leg(tmp_path, tiny, athlete, state_of):
    from dataclasses import replace

    from footfall.session.registry import Sessions

    with Sessions(tmp_path, jobs=Jobs("tiny_recipes", workers=2), robot=athlete) as sessions:
        session = sessions.create("maps")
        session.stances.set(state_of())
        session.terrains.load(replace(tiny.dem(), name="slow"))
        older, other = session.maps.compute(1), session.maps.compute(2)
        until(lambda: older.state == "running", "the work")
        session.terrains.load(tiny.dem())
        newer = session.maps.compute(1)
        assert older.wait(BOUND)
        assert older.state == "cancelled"
        other.cancel()
        newer.finish(BOUND)
        assert session.fits.of_maps(1).fits


def test_a_worker_warms_up_while_no_job_waits(tiny):
    told = []
    with Jobs("warm_recipes", workers=1, warm=True) as pool:
        until(
            lambda: (
                pool.submit("told", {}, None, lambda job, product: told.append(product) or "x").finish(BOUND) and told
            ),
            "the first answer",
        )
        a_while(0.6)
        for kind in ("told", "passed_over"):
            pool.submit(kind, {}, None, lambda job, product: told.append(product) or "x").finish(BOUND)
    # the libraries alone are so many objects, which no collection of garbage goes through in a job
    assert int(told.pop()) > 10_000
    # one that fails harms nothing, and a job that waits goes first
    assert told[-1] == b"first broken slow"
    assert b"first broken slow".startswith(told[0])
