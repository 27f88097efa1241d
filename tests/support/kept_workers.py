"""Worker processes that one server of a test leaves to the next: each takes seconds of a core to load its libraries."""

import atexit
from functools import cache

from footfall.session.jobs.local import Jobs, WorkerProcess
from footfall.session.reading import ReadingProcess

_spare: list[WorkerProcess] = []


class KeptWorkers(Jobs):
    """The pool that a server has without being told, but for where its workers come from and go to.

    A worker that was killed, or died, starts anew with its next job, as in any pool.
    """

    def _hired(self) -> WorkerProcess:
        try:
            return _spare.pop()
        except IndexError:
            return super()._hired()

    def _dismiss(self, process: WorkerProcess) -> None:
        _spare.append(process)


@cache
def kept_reading() -> ReadingProcess:
    """One process that reads files for all servers of this process of tests; a server has one of its own.

    It ends with the tests: closed, it reads no more for any of them.
    """
    reading = ReadingProcess()
    atexit.register(reading.close)
    return reading


@atexit.register
def end_spare() -> None:
    """End those that nobody took."""
    while _spare:
        _spare.pop().stop()
