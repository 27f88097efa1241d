"""What happened, written down: the one lock of a session, its log, what the log folds to, and who is told."""

import logging
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

from footfall.core.errors import Conflict
from footfall.io.event_log import as_read
from footfall.session.access.acting import said_by
from footfall.session.clock import ClockWatch, Reading
from footfall.session.log.event import Event, next_event
from footfall.session.log.fold import SessionState, fold, fold_all
from footfall.session.storage.interface import TurnedUp
from footfall.session.storage.store import SessionStore

LOCK_PATIENCE = 1.0
"""How long what must not wait, such as a stop, waits to be recorded before it is kept for later [s]."""

TRY_AGAIN_AFTER = 1.0
"""What could not be written is tried again after this long, or after three times as long as a try takes [s]."""

Listener = Callable[[dict[str, Any]], None]


class FoldedLog:
    """Log, state and listeners of one session. Thread-safe; ``lock`` also guards the session's other parts.

    An event is folded first, written second, told third: one that does not fold or can't be written is none.
    """

    def __init__(self, store: SessionStore) -> None:
        """Raises InvalidBundle where the log does not fold."""
        self.lock = threading.RLock()
        self._store = store
        self._events = list(store.events)
        self._state = fold_all(self._events)
        self._clock = ClockWatch(self._events[-1].time if self._events else None)
        self._listeners: list[Listener] = []
        self._unrecorded: list[tuple[str, dict[str, Any]]] = []
        self._closed = False
        self._closing = threading.Event()
        self._trying: threading.Thread | None = None
        self.appended = 0, 0.0
        """How many events were written so far, and how long that took in all [s]."""

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

    @property
    def listened_to(self) -> bool:
        """Whether anybody is told what happens."""
        return bool(self._listeners)

    def listen(self, callback: Listener) -> Callable[[], None]:
        """Tell ``callback`` every message from now on; returns what ends it."""
        with self.lock:
            self._listeners.append(callback)

        def unlisten() -> None:
            with self.lock, suppress(ValueError):
                self._listeners.remove(callback)

        return unlisten

    def record(self, type: str, payload: Mapping[str, Any]) -> Event:
        """Write one event, with who acts where that is known.

        Raises StoreRefused where the store can't take it, Conflict once closed.
        """
        with self.lock:
            if self._closed:
                raise Conflict("the session is closed")
            self._record_pending()
            return self._write(type, {**said_by(), **payload})

    def record_anyway(self, type: str, payload: Mapping[str, Any]) -> None:
        """As :meth:`record`, but what can't be written now is written once it can be, before any other event.

        Listeners hear so: a message "store" with ``unrecorded``, and the ``problem``; None when all is written.
        """
        if not self.lock.acquire(timeout=LOCK_PATIENCE):
            self._unrecorded.append((type, dict(payload)))
            self._try_again()
            return
        try:
            self.record(type, payload)
        except (OSError, Conflict) as err:
            logging.getLogger(__name__).error("event %s is kept for later: %s", type, err)
            self._unrecorded.append((type, dict(payload)))
            self._try_again()
            self._tell_of_store(err.message if isinstance(err, Conflict) else str(err.strerror or err))
        finally:
            self.lock.release()

    def tell(self, type: str, **content: Any) -> None:
        """Tell the listeners what is not logged: ``{"type": type, **content}``."""
        with self.lock:
            self._notify({"type": type, **content})

    def close(self) -> None:
        """Write what is pending and close the store; harmless when done twice.

        What the database can't take even now is kept in the session's folder, and moved there by the next opening.
        """
        self._closing.set()
        if self._trying is not None and self._trying is not threading.current_thread():
            self._trying.join()
        with self.lock:
            if not self._closed:
                try:
                    self._record_pending()
                except (OSError, Conflict) as err:
                    self._keep_pending(err)
                self._closed = True
                self._store.close()

    def _keep_pending(self, reason: Exception) -> None:
        doubtful = self._store.take_doubtful()
        if doubtful is not None:
            self._adopt(doubtful)
            if self._unrecorded and _same(doubtful, *self._unrecorded[0]):
                del self._unrecorded[0]
        pending: list[Event] = []
        for type, payload in self._unrecorded:
            last = pending[-1] if pending else self._events[-1] if self._events else None
            pending.append(next_event(last, self._clock.read().wall, type, payload))
        log = logging.getLogger(__name__)
        try:
            self._store.keep_beside(pending)
        except OSError as err:
            log.error("%d events are lost: %s, and %s", len(pending), reason, err)
        else:
            log.error("%d events are kept beside the database until the next opening: %s", len(pending), reason)

    def _record_pending(self) -> None:
        while self._unrecorded:
            self._write(*self._unrecorded[0])
            del self._unrecorded[0]
            if not self._unrecorded:
                self._tell_of_store(None)

    def _try_again(self) -> None:
        """Go on trying to write what is pending, in a thread of its own, until it is written."""
        if self._closing.is_set() or (self._trying is not None and self._trying.is_alive()):
            return
        with suppress(RuntimeError):  # no thread can be started: the next event takes it along
            trying = threading.Thread(target=self._keep_trying, name="footfall-write-again", daemon=True)
            trying.start()
            self._trying = trying

    def _keep_trying(self) -> None:
        pause = TRY_AGAIN_AFTER
        while self._unrecorded and not self._closing.wait(pause):
            began = time.monotonic()
            with self.lock, suppress(OSError, Conflict):
                # one that is just being put back is left alone until it is asked for something
                if not self._closed and not self._store.displaced:
                    self._record_pending()
            pause = max(TRY_AGAIN_AFTER, 3.0 * (time.monotonic() - began))

    def _tell_of_store(self, problem: str | None) -> None:
        self._notify({"type": "store", "store": {"unrecorded": len(self._unrecorded), "problem": problem}})

    def _write(self, type: str, payload: Mapping[str, Any]) -> Event:
        reading = self._clock.read()
        if reading.jump:
            way, size = "forward" if reading.jump > 0 else "back", abs(reading.jump)
            text = f"the clock of this computer jumped {way} by {size:z.1f} s: times before and after don't compare"
            self._write_at(reading, "clock_jumped", {"by": reading.jump, "text": text})
        return self._write_at(reading, type, payload)

    def _write_at(self, reading: Reading, type: str, payload: Mapping[str, Any]) -> Event:
        event = next_event(self._events[-1] if self._events else None, reading.wall, type, payload)
        state = fold(self._state, event)
        began = time.perf_counter()
        try:
            self._store.append(event)
        except TurnedUp as found:
            self._adopt(found.event)
            return found.event if _same(found.event, type, event.payload) else self._write_at(reading, type, payload)
        self.appended = self.appended[0] + 1, self.appended[1] + time.perf_counter() - began
        self._clock.accept(reading)
        self._take(event, state)
        return event

    def _adopt(self, event: Event) -> None:
        """An event that was refused because nobody knew whether it was written, and that was."""
        self._take(event, fold(self._state, event))

    def _take(self, event: Event, state: SessionState) -> None:
        self._events.append(event)
        self._state = state
        self._notify({"type": "event", "event": event.as_dict()})

    def _notify(self, message: dict[str, Any]) -> None:
        for listener in list(self._listeners):
            try:
                listener(message)
            except Exception:
                logging.getLogger(__name__).exception("a listener failed on a %s message", message["type"])


def _same(event: Event, type: str, payload: Mapping[str, Any]) -> bool:
    return event.type == type and dict(event.payload) == as_read(dict(payload))
