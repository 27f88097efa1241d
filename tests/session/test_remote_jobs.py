"""Jobs through the database: the same as in local processes, and workers that come, go and die."""

import os
import subprocess
import sys
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path

import psycopg
import pytest

from footfall.core.errors import Busy, Cancelled, Conflict, FootFallError, InvalidInput, WorkerLost
from footfall.session.registry import Sessions
from footfall.session.remote import job_board
from footfall.session.remote.remote_jobs import RemoteJobs
from footfall.session.storage.databases import bind, binding
from footfall.session.storage.interface import StoreRefused
from footfall.session.storage.verify import verify
from tests.support.waiting import until

PATIENCE = 120.0
"""Longest wait for anything, also on a busy machine [s]."""

SERVE = """
import sys
from pathlib import Path
from footfall.session.remote.worker_service import serve_jobs
if __name__ == "__main__":
    sys.path.insert(0, sys.argv[2])
    serve_jobs(Path(sys.argv[1]), 1, "tiny_recipes", lambda: print("ready", flush=True))
"""


@contextmanager
def worker(data):
    """A ``footfall worker`` of the tiny recipes, in a process of its own."""
    here = str(Path(__file__).parent)
    environment = {**os.environ, "PYTHONPATH": here}
    command = [sys.executable, "-c", SERVE, str(data), here]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        try:
            yield process
        finally:
            process.terminate()


def url_of(folder):
    """Address of a folder's database."""
    bound = binding(folder)
    assert bound is not None
    return bound.url


@pytest.fixture(scope="module")
def data(postgres, tmp_path_factory):
    folder = tmp_path_factory.mktemp("data")
    bind(folder, postgres.fresh())
    return folder


@pytest.fixture(scope="module")
def served(data):
    """A data folder for which a worker works."""
    with worker(data):
        yield data


@pytest.fixture
def pool(served):
    with RemoteJobs(url_of(served), served) as jobs:
        yield jobs


@pytest.fixture
def alone(postgres, tmp_path):
    """A pool without workers, in a folder of its own."""
    bind(tmp_path, postgres.fresh())
    with RemoteJobs(url_of(tmp_path), tmp_path, queue_limit=3) as jobs:
        yield jobs


def worker_pid(pool):
    found = []
    pool.submit("pid", {}, None, lambda job, product: found.append(int(product)) or "x").finish(PATIENCE)
    return found[0]


def test_values_cross_and_come_back_under_their_digest(pool, served, tiny):
    dem, got = tiny.dem(1.5), []
    job = pool.submit("quick", {"dem": dem}, None, lambda job, product: got.append(product) or product.digest)
    assert job.finish(PATIENCE) == dem.digest
    assert (job.state, job.fraction) == ("done", 1.0)
    assert got[0].digest == dem.digest
    assert pool.get(job.id) is job
    assert pool.ready
    until(lambda: not list((served / "jobs").iterdir()), "the job's folder is removed")


def test_errors_keep_their_kind_and_details(pool):
    with pytest.raises(InvalidInput, match="this is wrong") as caught:
        pool.submit("raises", {}, None).finish(PATIENCE)
    assert caught.value.details == {"what": 3}
    with pytest.raises(FootFallError, match="ZeroDivisionError: a bug"):
        pool.submit("breaks", {}, None).finish(PATIENCE)
    with pytest.raises(WorkerLost, match="died") as caught:
        pool.submit("dies", {}, None).finish(PATIENCE)
    assert caught.value.details["exit_code"] == 7


@pytest.mark.parametrize("kind", ["polite", "deaf"])
def test_progress_then_a_cancel(pool, kind):
    pid, changes = worker_pid(pool), []
    job = pool.submit(kind, {}, None, None, lambda job: changes.append((job.state, job.fraction)))
    until(lambda: job.fraction == 0.5, "it is half done")
    job.cancel()
    with pytest.raises(Cancelled):
        job.finish(PATIENCE)
    assert ("running", 0.5) in changes
    assert (worker_pid(pool) == pid) == (kind == "polite")


def test_a_session_works_as_with_its_own_processes(pool, served, tiny, athlete, state_of):
    with Sessions(served, pool, athlete) as sessions:
        session, previews = sessions.create("remote"), []
        session.listen(lambda message: previews.append(message) if message["type"] == "preview" else None)
        session.stances.set(state_of())
        session.terrains.load(replace(tiny.dem(), name="slow"))
        slow = session.maps.compute(2)
        until(lambda: previews, "coarse maps are shown")
        slow.cancel()
        assert slow.wait(PATIENCE)
        session.terrains.load(tiny.dem())
        digest = session.maps.compute(2).finish(PATIENCE)
        assert session.fits.of_maps(2).fits
        assert session.get(digest).digest == digest
        session.plans.step(2, (1.0, 0.0)).finish(PATIENCE)
        session.sequences.make()
        assert session.state.sequence is not None
        assert verify(served, [session.id]) == []  # nothing of the work is left over


def test_the_queue_is_bounded_ordered_and_cancellable(alone):
    first = alone.submit("pid", {}, None)
    until(lambda: "no worker is connected" in first.text, "it is told that nobody is there")
    assert not alone.ready
    order = []
    urgent = alone.submit("pid", {}, None, lambda job, _: order.append("urgent") or "x", urgent=True)
    last = alone.submit("pid", {}, None, lambda job, _: order.append("last") or "x")
    with pytest.raises(Busy, match="waiting already"):
        alone.submit("pid", {}, None)
    first.cancel()
    with pytest.raises(Cancelled, match="before it started"):
        first.finish(PATIENCE)
    with worker(alone._data):
        last.finish(PATIENCE)
        urgent.finish(PATIENCE)
    assert order == ["urgent", "last"]


def test_a_worker_that_is_killed_fails_its_job_and_the_next_one_goes_on(alone, monkeypatch):
    with worker(alone._data) as process:
        job = alone.submit("polite", {}, None)
        until(lambda: job.text == "running", "the job runs")
        process.kill()
        with monkeypatch.context() as patched:
            patched.setattr(job_board, "SILENCE", 2.0)
            with pytest.raises(WorkerLost, match="nothing was heard"):
                job.finish(PATIENCE)
    with worker(alone._data) as process:
        job = alone.submit("polite", {}, None)
        until(lambda: job.text == "running", "the job runs")
        process.terminate()
        with pytest.raises(WorkerLost, match="was ended"):
            job.finish(PATIENCE)
        assert process.wait(PATIENCE) == 0


def test_nobody_works_for_a_server_that_is_gone(alone):
    data, url = alone._data, url_of(alone._data)
    gone = RemoteJobs(url, data)
    gone._closing.set()  # as if killed: nothing is cancelled or taken back
    gone._watching.join()
    gone._app.configure_task(job_board.TASK, queue=job_board.QUEUE).defer(
        job="forgotten", kind="deaf", session="", parents={}, settings=None, server=gone._name
    )
    gone._board.close()
    gone._app.close()
    with worker(data):
        assert worker_pid(alone)
    with RemoteJobs(url, data) as another:
        assert another._board.known() == set()


def test_what_a_worker_did_for_a_server_is_removed_when_both_were_killed(alone):
    data, url = alone._data, url_of(alone._data)
    gone = RemoteJobs(url, data)
    with worker(data) as process:
        job = gone.submit("deaf", {}, None)
        until(lambda: job.state == "running", "the job under way")
        process.kill()
        process.wait()
    gone._closing.set()  # as if killed: nothing is cancelled or taken back
    gone._watching.join()
    gone._board.close()
    gone._app.close()
    folder = data / "jobs" / job.id
    assert folder.is_dir()
    with psycopg.connect(url, autocommit=True) as database:

        def left_after(heard: str) -> set[str]:
            """Jobs once another server has come, where the worker was last heard then."""
            database.execute(f"UPDATE procrastinate_workers SET last_heartbeat = now() {heard}".encode())
            with RemoteJobs(url, data) as another:
                return another._board.known()

        assert left_after("+ interval '1 hour'") == {job.id}
        os.utime(folder, (0, 0))
        assert left_after("- interval '1 hour'") == set()
    assert not folder.exists()


def test_closing_takes_back_what_waits(alone):
    job = alone.submit("pid", {}, None)
    alone.close()
    assert job.state == "cancelled"
    with pytest.raises(Conflict, match="closed"):
        alone.submit("pid", {}, None)
    assert not list((alone._data / "jobs").iterdir())


def test_a_database_that_goes_away_and_comes_back(alone, postgres):
    with worker(alone._data):
        before = alone.submit("polite", {}, None)
        until(lambda: before.text == "running", "the job runs")
        postgres.stop("fast")
        try:
            with pytest.raises(StoreRefused, match="can't be reached"):
                alone.submit("pid", {}, None)
            assert not alone.ready
            before.cancel()  # its worker may outlive the loss, and is told once it can be
        finally:
            postgres.start()
        with pytest.raises((Cancelled, WorkerLost)):
            before.finish(PATIENCE)
        assert worker_pid(alone)


@contextmanager
def refusing(url, **changes):
    """A database that refuses some changes of tables; yields how many it has refused so far."""
    with closing(psycopg.connect(url, autocommit=True)) as database:
        database.execute("CREATE SEQUENCE refused MINVALUE 0")  # counts on where all else is rolled back
        database.execute(
            """CREATE FUNCTION refuse() RETURNS trigger LANGUAGE plpgsql AS
            $$ BEGIN PERFORM nextval('refused'); RAISE EXCEPTION 'not now'; END $$"""
        )
        for table, what in changes.items():
            database.execute(
                f"""CREATE TRIGGER refuse BEFORE INSERT OR UPDATE ON {table} FOR EACH ROW WHEN ({what})
                EXECUTE FUNCTION refuse()""".encode()
            )
        try:
            yield lambda: sum(*database.execute("SELECT last_value, is_called::int FROM refused"))
        finally:
            database.execute("DROP FUNCTION refuse CASCADE; DROP SEQUENCE refused")


def test_the_end_of_a_job_is_told_once_it_can_be(alone):
    url, got = url_of(alone._data), []
    with worker(alone._data):
        with refusing(url, job_reports="NEW.result IS NOT NULL") as refused:
            job = alone.submit("pid", {}, None, lambda job, product: got.append(product) or "x")
            until(lambda: refused() >= 1, "the job has ended, and its worker could not say so")
            assert not job.ended
        assert job.finish(PATIENCE) == "x"
        assert int(got[0]) == worker_pid(alone)


def test_a_worker_that_cannot_say_how_a_job_ended_gives_itself_up(alone):
    """Its server hears of it all the time, and would wait for ever."""
    with worker(alone._data):
        ended = {"job_reports": "NEW.result IS NOT NULL", "procrastinate_jobs": "NEW.status NOT IN ('todo', 'doing')"}
        with refusing(url_of(alone._data), **ended):
            job = alone.submit("pid", {}, None)
            with pytest.raises(WorkerLost, match="nothing was heard"):
                job.finish(PATIENCE)
        assert worker_pid(alone)


def test_a_server_is_back_before_the_database_knows_that_its_connection_is_lost(alone):
    url = url_of(alone._data)
    bounded = f"{url}%20-clock_timeout%3D10s"
    with closing(job_board.JobBoard(bounded, alone._name)) as again, closing(job_board.JobBoard(url)) as other:
        assert again.workers() == 0  # connected, though the one before is
        assert other.is_there(alone._name)
        alone.close()
        assert other.is_there(alone._name)
