"""What happened, written down: the one lock of a session, its log, what the log folds to, and who is told."""

import logging
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

from footfall.core.errors import Conflict
from footfall.session.event import Event, next_event
from footfall.session.fold import SessionState, fold, fold_all
from footfall.session.store import SessionStore

LOCK_PATIENCE = 1.0
"""How long what must not wait, such as a stop, waits to be recorded before it is kept for later [s]."""

Listener = Callable[[dict[str, Any]], None]


class Journal:
    """Log, state and listeners of one session. Thread-safe; ``lock`` also guards the session's other parts.

    An event is folded first, written second, told third: one that does not fold or can't be written is none.
    """

    def __init__(self, store: SessionStore) -> None:
        self.lock = threading.RLock()
        self._store = store
        self._events = list(store.events)
        self._state = fold_all(self._events)
        self._listeners: list[Listener] = []
        self._unrecorded: list[tuple[str, dict[str, Any]]] = []
        self._closed = False

    @property
    def state(self) -> SessionState:
        """What the log folds to."""
        return self._state

    @property
    def closed(self) -> bool:
        """Whether nothing can be recorded any more."""
        return self._closed

    @property
    def unrecorded(self) -> int:
        """Events that could not be written yet."""
        return len(self._unrecorded)

    def __len__(self) -> int:
        return len(self._events)

    def events(self, since: int = 0) -> list[Event]:
        """Events with ``seq`` ≥ ``since``."""
        with self.lock:
            return self._events[max(since, 0) :]

    def listen(self, callback: Listener) -> Callable[[], None]:
        """Tell ``callback`` every message from now on; returns what ends it."""
        with self.lock:
            self._listeners.append(callback)

        def unlisten() -> None:
            with self.lock, suppress(ValueError):
                self._listeners.remove(callback)

        return unlisten

    def record(self, type: str, payload: Mapping[str, Any]) -> Event:
        """Write one event. Raises OSError where the disk can't take it, Conflict once closed."""
        with self.lock:
            if self._closed:
                raise Conflict("the session is closed")
            self._record_pending()
            return self._write(type, payload)

    def record_anyway(self, type: str, payload: Mapping[str, Any]) -> None:
        """As :meth:`record`, but what can't be written now is written before the next event that can."""
        if not self.lock.acquire(timeout=LOCK_PATIENCE):
            self._unrecorded.append((type, dict(payload)))
            return
        try:
            self.record(type, payload)
        except (OSError, Conflict) as err:
            logging.getLogger(__name__).error("event %s is kept for later: %s", type, err)
            self._unrecorded.append((type, dict(payload)))
        finally:
            self.lock.release()

    def tell(self, type: str, **content: Any) -> None:
        """Tell the listeners what is not logged: ``{"type": type, **content}``."""
        with self.lock:
            self._notify({"type": type, **content})

    def close(self) -> None:
        """Write what is pending and close the store; harmless when done twice."""
        with self.lock:
            if not self._closed:
                with suppress(OSError):
                    self._record_pending()
                self._closed = True
                self._store.close()

    def _record_pending(self) -> None:
        while self._unrecorded:
            self._write(*self._unrecorded[0])
            del self._unrecorded[0]

    def _write(self, type: str, payload: Mapping[str, Any]) -> Event:
        event = next_event(self._events[-1] if self._events else None, time.time(), type, payload)
        state = fold(self._state, event)
        self._store.append(event)
        self._events.append(event)
        self._state = state
        self._notify({"type": "event", "event": event.as_dict()})
        return event

    def _notify(self, message: dict[str, Any]) -> None:
        for listener in list(self._listeners):
            try:
                listener(message)
            except Exception:
                logging.getLogger(__name__).exception("a listener failed on a %s message", message["type"])
