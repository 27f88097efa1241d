"""Tasks made by several processes: of this machine, or of a cluster that others started (dask.distributed)."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path
from socket import create_connection
from tempfile import TemporaryDirectory
from typing import Any
from urllib.parse import urlsplit

from distributed import CancelledError, Client, KilledWorker, LocalCluster, as_completed

import footfall
import training
from footfall.core.errors import InvalidInput, WorkerLost

PATIENCE = 10.0
"""How long a cluster has to answer at first [s]."""


def made_by_many(
    tasks: Sequence[tuple[str, Any]],
    make: Callable[[tuple[str, Any]], tuple[str, Any]],
    processes: int,
    scheduler: str | None,
) -> Iterator[tuple[str, Any]]:
    """What ``make`` gives of each task, as they come.

    processes: of this machine, where there is no scheduler; scheduler: the address of a cluster's, tcp://host:port. A
    task whose worker dies is given to another one, a few times.
    Raises InvalidInput where no cluster answers there, or one of its workers has another program; WorkerLost where the
    scheduler goes away, or workers die of a task again and again.
    """
    with _client(processes, scheduler) as client:
        checked = partial(_made_by_same, program(), make)
        futures = client.map(checked, tasks, pure=False, retries=1)
        for future in as_completed(futures):
            try:
                yield future.result()
            except (CancelledError, KilledWorker) as err:
                raise WorkerLost(
                    f"the cluster {scheduler or 'of this machine'} was lost, or its workers died ({err}); what is "
                    "finished is kept, and the same command goes on with it once a cluster is there"
                ) from err


@cache
def program() -> str:
    """Digest of all modules of FootFall and of what learns, as they lie on the disk."""
    found = hashlib.sha256()
    for package in (footfall, training):
        folder = Path(package.__path__[0])
        for path in sorted(folder.rglob("*.py")):
            found.update(f"{path.relative_to(folder)}\0".encode() + path.read_bytes())
    return found.hexdigest()[:32]


@contextmanager
def _client(processes: int, scheduler: str | None) -> Iterator[Client]:
    if scheduler is not None:
        try:
            place = urlsplit(scheduler)
            # a Client that finds nobody leaves its thread behind
            create_connection((place.hostname or "", place.port or 0), PATIENCE).close()
            client = Client(scheduler, timeout=PATIENCE)
        except (OSError, ValueError) as err:
            raise InvalidInput(
                f"no scheduler answers at {scheduler}; start one with `dask scheduler`, and workers with `dask worker "
                "tcp://HOST:PORT --nthreads 1`, and name its address as it prints it"
            ) from err
        with client:
            yield client
        return
    with (
        TemporaryDirectory() as folder,
        LocalCluster(
            n_workers=processes,
            threads_per_worker=1,
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",
            local_directory=folder,
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client


def _made_by_same(
    wanted: str, make: Callable[[tuple[str, Any]], tuple[str, Any]], task: tuple[str, Any]
) -> tuple[str, Any]:
    """In a worker: what it makes counts only where its program is the one that asked."""
    if program() != wanted:
        raise InvalidInput(
            f"a worker has another FootFall ({program()}) than this one ({wanted}), so its routes may be others; "
            "install the same version everywhere, or stop that worker"
        )
    return make(task)
