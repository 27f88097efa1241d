"""Files from outside, read in a process apart: their parsers hold up no stop, and take no memory of the server.

A parser may hold its interpreter for seconds, unpack a small file to gigabytes, or crash. What it does so happens to
a process that is ended and started anew.
"""

import resource
import signal
import threading
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, ParamSpec, Protocol, TypeVar, cast

from footfall.core.collector import none_while_loading
from footfall.core.errors import FootFallError, InvalidInput
from footfall.session.jobs.local import WorkerProcess
from footfall.session.jobs.worker import end_with_server

_P = ParamSpec("_P")
_T = TypeVar("_T")

MOST_MEMORY = 640 << 20
"""What reading one file may take [bytes]."""
MOST_SECONDS = 120.0
"""How long it may take."""
_READERS = ("footfall.io.terrain_files", "footfall.io.photograph_files", "footfall.session.storage.carried_in")
"""What reads files from outside."""


class Read(Protocol):
    """How a file is read: ``read(work, *args)`` returns what ``work(*args)`` does, and raises what it raises."""

    def __call__(self, work: Callable[_P, _T], /, *args: _P.args, **kwargs: _P.kwargs) -> _T: ...


def read_here(work: Callable[_P, _T], /, *args: _P.args, **kwargs: _P.kwargs) -> _T:
    """In this process, at once: for scripts, whose files are their own."""
    return work(*args, **kwargs)


class ReadingProcess:
    """Reads one file at a time in a process that starts with the first. Close it. Thread-safe.

    most_memory: what reading one may take beside what is loaded [bytes]. most_seconds: how long it may take.
    readers: the modules that are loaded first.
    """

    def __init__(
        self,
        most_memory: int = MOST_MEMORY,
        most_seconds: float = MOST_SECONDS,
        readers: tuple[str, ...] = _READERS,
    ) -> None:
        self._most_memory, self._most_seconds = most_memory, most_seconds
        self._process = WorkerProcess(_serve, most_memory, readers)
        self._one_at_a_time = threading.Lock()
        self._closed = False

    def __call__(self, work: Callable[_P, _T], /, *args: _P.args, **kwargs: _P.kwargs) -> _T:
        """What ``work`` returns, which must be a function of a module; arguments and result cross a pipe.

        Raises what it raises, and InvalidInput where it takes too much memory or time, or ends its process.
        """
        with self._one_at_a_time:
            if self._closed:
                raise InvalidInput("the server ends, it reads no more files; send it again when it is back")
            try:
                pipe = self._process.start()
                pipe.send((work, args, kwargs))
                if not pipe.poll(self._most_seconds):
                    self._process.stop()
                    text = f"the file was not read within {self._most_seconds:z.0f} s; send a smaller one"
                    raise InvalidInput(text, limit=self._most_seconds)
                found, error = pipe.recv()
            except (EOFError, OSError):
                code = self._process.stop()
                raise InvalidInput(
                    f"reading the file ended the process that read it (exit code {code}): it is damaged, or takes more "
                    f"than {self._most_memory >> 20} MiB of memory; check it, or send a smaller one",
                    exit_code=code,
                ) from None
        if error is not None:
            raise error
        return cast(_T, found)

    def close(self) -> None:
        """End the process, whatever it reads."""
        self._closed = True
        self._process.kill()
        with self._one_at_a_time:
            self._process.stop()


def _serve(pipe: Connection, most_memory: int, readers: tuple[str, ...]) -> None:
    """Read what comes through the pipe until it closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the server decides when this ends
    threading.Thread(target=end_with_server, daemon=True).start()
    with none_while_loading():
        for reader in readers:
            import_module(reader)
    _take_at_most(most_memory)
    with pipe, suppress(EOFError, BrokenPipeError, ConnectionResetError):
        while True:
            pipe.send(_answer(most_memory, *pipe.recv()))


def _answer(
    most_memory: int, work: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any]
) -> tuple[Any, FootFallError | None]:
    try:
        return work(*args, **kwargs), None
    except FootFallError as error:
        return None, error
    except MemoryError:
        text = f"reading the file takes more than {most_memory >> 20} MiB of memory; send a smaller or coarser one"
        return None, InvalidInput(text, limit=most_memory)
    except Exception as error:  # its type may not be known where it goes
        return None, FootFallError(f"the file can't be read: {type(error).__name__}: {error}")


def _take_at_most(more: int) -> None:
    """Let this process have so much memory more than it has [bytes]; beyond that allocating fails."""
    status = Path("/proc/self/status").read_text()
    taken = next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmData:")) << 10
    resource.setrlimit(resource.RLIMIT_DATA, (taken + more, taken + more))
