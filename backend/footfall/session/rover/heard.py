"""What the rover says of commands, as far as it is news: what is said again is counted, not written down."""

import threading

ENDED = ("done", "refused")
"""States of a command that nothing changes any more."""

_ORDER = {"": 0, "sent": 0, "received": 1, "started": 2, "done": 3, "refused": 3}


class HeardStates:
    """Of one session. A rover that says the same, or this and that, without end fills no log. Thread-safe."""

    def __init__(self) -> None:
        self._guard = threading.Lock()
        self._latest: dict[str, str] = {}
        self._asked: set[str] = set()
        self._of_unknown: dict[str, set[str]] = {}

    def asked(self, command_id: str) -> None:
        """The rover was asked what became of a command: its answer counts once, also that it knows of none."""
        with self._guard:
            self._asked.add(command_id)
            self._of_unknown.pop(command_id, None)

    def is_news(self, command_id: str, known: str, state: str) -> bool:
        """Whether ``state`` tells more of a command than is ``known`` by the log, or was said since."""
        with self._guard:
            latest = self._latest.get(command_id, known)
            if latest in ENDED:
                return False
            if state == "unknown":
                news = command_id in self._asked
                self._asked.discard(command_id)
                return news
            if known == "unknown":
                # it may still turn out to be anything, once since it was asked for: the log may be behind
                said = self._of_unknown.setdefault(command_id, set())
                news = state not in said
                said.add(state)
            else:
                news = _ORDER[state] > _ORDER[latest]
            if news:
                self._latest[command_id] = state
            return news
