"""Who does the work of a server: processes of its own, or workers that take it from the database of its sessions."""

import contextlib
import multiprocessing
from collections.abc import Iterator
from pathlib import Path

from footfall.session.jobs.local import Jobs
from footfall.session.jobs.pool import JobPool
from footfall.session.storage.databases import binding

PATIENCE = 5.0
"""How long a worker may take to end [s]."""


@contextlib.contextmanager
def pool_of(folder: Path, workers: int = 2, worker_beside: bool = True) -> Iterator[JobPool]:
    """The pool for the sessions of a folder; ended with the context.

    workers: how many jobs at a time on this machine. worker_beside: where the work goes through a database, whether
    this machine takes some of it.
    Raises StoreRefused where that database can't be reached.
    """
    bound = binding(folder)
    if bound is None:
        with Jobs(workers=workers, warm=True) as jobs:
            yield jobs
        return
    from footfall.session.remote.remote_jobs import RemoteJobs
    from footfall.session.remote.worker_service import serve_jobs_beside

    with contextlib.ExitStack() as stack:
        if worker_beside:
            process = multiprocessing.get_context("spawn").Process(target=serve_jobs_beside, args=(folder, workers))
            process.start()
            stack.callback(process.kill)  # where the polite end below took too long
            stack.callback(process.join, PATIENCE)
            stack.callback(process.terminate)
        yield stack.enter_context(RemoteJobs(bound.url, folder))
