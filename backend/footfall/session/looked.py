"""Sessions that are looked at and not open: the latest few are kept, and read anew once their logs have grown."""

import threading
from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path
from weakref import WeakValueDictionary

from footfall.io.bundles import EVENTS
from footfall.session.live import LiveSession
from footfall.session.storage.head import HEAD
from footfall.session.storage.looked import LookedStore

MOST_SESSIONS = 4
"""Sessions that are kept in memory; each with up to two dozen values."""


class Looked:
    """Thread-safe. Each is read by one thread at a time, whatever others ask for meanwhile."""

    def __init__(self, read: Callable[[LookedStore], LiveSession]) -> None:
        self._read = read
        self._guard = threading.Lock()
        self._kept: OrderedDict[Path, tuple[bytes, LiveSession]] = OrderedDict()
        self._reading: WeakValueDictionary[Path, threading.Lock] = WeakValueDictionary()

    def at(self, folder: Path) -> LiveSession:
        """The session in ``folder`` as it is on the disk now. Raises InvalidBundle, StoreRefused."""
        with self._guard:
            reading = self._reading.setdefault(folder, threading.Lock())
        with reading:
            # the mark first: what is written meanwhile is seen by who comes next
            mark = _mark(folder)
            with self._guard:
                kept = self._kept.get(folder)
            if kept is None or not mark or kept[0] != mark:
                # a long log takes seconds, which who looks at another session does not wait
                kept = mark, self._read(LookedStore(folder))
            with self._guard:
                self._kept[folder] = kept
                self._kept.move_to_end(folder)
                while len(self._kept) > MOST_SESSIONS:
                    self._kept.popitem(last=False)
            return kept[1]


def _mark(folder: Path) -> bytes:
    """What changes with every event that is written; empty where nothing tells."""
    if (folder / EVENTS).exists():
        return b""
    try:
        return (folder / HEAD).read_bytes()
    except OSError:
        return b""
