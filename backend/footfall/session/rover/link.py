"""The server's end of the rover link: who is there, what it said last and how long ago."""

import json
import threading
import time
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from footfall.core.errors import Conflict
from footfall.session.answers.commands import LinkAnswer, OnItsWayAnswer
from footfall.session.rover.light_time import LightPath, LightTime
from footfall.telemetry.state import TelemetryFrame, counted_anew

Send = Callable[[str], None]


RESTART_AFTER = 5
"""So many frames on end with old numbers and times are no stragglers: the rover's counter and clock began anew."""
REPORTED_AGAIN_AFTER = 1.0
"""A rover that is wrong in ever new ways is told of once in so long for each kind; all of it is counted [s]."""
MOST_SHOWN = 20
"""Messages on their way that are told of; what went before them is on its way as well."""


@dataclass(frozen=True)
class OnItsWay:
    """A message down: when it arrives at the rover, and the earliest moment at which an answer can be here."""

    type: str
    id: str
    arrives_at: float
    answer_at: float

    def as_dict(self, now: float) -> OnItsWayAnswer:
        """Plain JSON, as seen ``now``."""
        arrives, answer = max(self.arrives_at - now, 0.0), max(self.answer_at - now, 0.0)
        return {"type": self.type, "id": self.id, "arrives_in_s": arrives, "answer_in_s": answer}


class RoverLink:
    """Holds the latest telemetry frame and both ways of the link. Thread-safe; never blocks for long.

    frames: how many came, and so the number of the latest by arrival; gaps: frames that were missing between them;
    restarts: how often counting began anew; late: frames that were dropped because they came again, after newer
    ones, or beside the link that there was by then; repeated: those of them that came again; clock_jumps: how often
    the rover's clock went back; acks_again: acknowledgements that told nothing new; lost_on_the_way: messages down
    that arrived where their rover was no longer; fault, faults, kinds: the latest complaint of the rover, or about
    what it sent, how many there were, and of what kind.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic, light_time: LightTime | None = None) -> None:
        self._clock = clock
        self._guard = threading.Lock()
        self._send: Send | None = None
        self._frame: TelemetryFrame | None = None
        self._taken_at = self._received_at = self._light = 0.0
        self._straggler: TelemetryFrame | None = None
        self._stragglers = 0
        # connections so far, that whose telemetry comes now, and that of the latest frame
        self._connections = self._telling = self._told_by = 0
        # storing images takes seconds, and telemetry must not wait for it
        self._paths = {name: LightPath(name, clock) for name in ("telemetry", "images", "commands", "stops")}
        self._on_way: deque[OnItsWay] = deque(maxlen=MOST_SHOWN)
        self.light_time = light_time or LightTime()
        self.frames = self.gaps = self.restarts = self.late = self.repeated = self.clock_jumps = self.faults = 0
        self.lost_on_the_way = self.acks_again = 0
        self.fault = ""
        self.kinds: Counter[str] = Counter()
        self._reported_at: dict[str, float] = {}

    def connect(self, send: Send) -> None:
        """A rover is there; ``send`` hands it one text frame, without blocking, from any thread.

        It raises where the connection has ended.
        """
        with self._guard:
            self._send = send
            self._connections += 1
            number = self._connections
        # behind what is still on its way from before
        self.hear(lambda _: self._may_begin_anew(number))

    def _may_begin_anew(self, connection: int) -> None:
        """What is there now may be another rover, or the same one after a restart."""
        with self._guard:
            self._straggler, self._stragglers = None, RESTART_AFTER
            self._telling = connection

    def close(self) -> None:
        """What is still on its way, up or down, does not arrive any more."""
        for path in self._paths.values():
            path.close()

    def disconnect(self, send: Send | None = None) -> bool:
        """The rover is gone. With ``send``: only if that is still the one in use. Whether anything changed."""
        with self._guard:
            if self._send is None or (send is not None and send is not self._send):
                return False
            self._send = None
            return True

    def hear(
        self,
        use: Callable[[float], Any],
        at: float | None = None,
        path: str = "telemetry",
        lost: Callable[[], None] | None = None,
    ) -> None:
        """Something comes from the rover ``at`` (None: now): ``use`` it when its light time is over.

        use: called with when it arrived, by this link's clock; raises to the caller only where there is no delay.
        path: "telemetry", "images" or "stops"; what comes on one is used in its order. lost: called instead of ``use``
        where the link is closed before that.
        Raises Conflict where too much is on its way already.
        """
        now, delay = self._clock() if at is None else at, self.light_time.telemetry
        self._paths[path].carry(lambda: use(now + delay), delay, now, lost)

    def take(
        self, frame: TelemetryFrame, at: float | None = None, light: float = 0.0, by_request: bool = False
    ) -> bool:
        """Keep a frame as the latest, unless it is older than that one; whether it was kept.

        at: when it came, by this link's clock; None: now. light: how long it was on its way [s].
        by_request: it came beside the link: it must not pass for news of a rover that is connected.
        """
        with self._guard:
            self.frames += 1
            latest = self._frame
            beside = by_request and self._send is not None
            if beside or (latest is not None and self._is_late(frame, latest)):
                self.late += 1
                return False
            if latest is not None:
                if counted_anew(latest.number, frame.number):
                    self.restarts += 1
                else:
                    self.gaps += frame.number - latest.number - 1
                self.clock_jumps += frame.state.time < latest.state.time
            self._told_by = self._telling
            self._frame, self._taken_at = frame, self._clock() if at is None else at
            self._light, self._received_at = light, time.time() - (self._clock() - self._taken_at)
            self._stragglers = 0
            return True

    def _is_late(self, frame: TelemetryFrame, latest: TelemetryFrame) -> bool:
        """Whether a frame is a straggler or a repetition: one of those must not pass for news."""
        repeated = frame.number == latest.number and frame.state.time <= latest.state.time
        if not repeated and not (frame.number < latest.number and frame.state.time < latest.state.time):
            return False
        self.repeated += repeated
        before, self._straggler = self._straggler, frame
        moves_on = before is None or frame.number > before.number
        self._stragglers = self._stragglers + 1 if moves_on else min(self._stragglers, RESTART_AFTER - 1)
        return self._stragglers <= RESTART_AFTER

    def complain(self, text: str, kind: str = "other") -> bool:
        """Keep what went wrong between server and rover, for the operator; whether it is to be told.

        It is where it differs from the last one, and its kind was not told a moment ago. kind: one of
        :data:`footfall.telemetry.fields.FAULTS`, or "recorder".
        """
        now = self._clock()
        with self._guard:
            self.faults += 1
            self.kinds[kind] += 1
            news = (
                text != self.fault and now - self._reported_at.get(kind, -REPORTED_AGAIN_AFTER) >= REPORTED_AGAIN_AFTER
            )
            self.fault = text
            if news:
                self._reported_at[kind] = now
            return news

    def said_again(self) -> None:
        """An acknowledgement told nothing new."""
        with self._guard:
            self.acks_again += 1

    def send(self, text: str) -> None:
        """Send one text frame on its way to the rover. Raises Conflict where none is connected, or it can't be reached.

        With a light time it can only be lost on the way after this: where another rover, or none, is there then.
        """
        with self._guard:
            send, light_time = self._send, self.light_time
        if send is None:
            raise Conflict("no rover is connected")
        arrives_at = self._paths["commands"].carry(lambda: self._hand_over(send, text), light_time.commands)
        if light_time.round_trip:
            message = json.loads(text)
            on_way = OnItsWay(message["type"], message.get("id", ""), arrives_at, arrives_at + light_time.telemetry)
            with self._guard:
                self._on_way.append(on_way)

    def _hand_over(self, send: Send, text: str) -> None:
        # to the connection that it was sent to, also where another session has taken over that connection since
        try:
            send(text)
        except Exception as err:
            with self._guard:
                self.lost_on_the_way += 1
            raise Conflict(f"the rover can't be reached: {err}") from err

    @property
    def on_the_way(self) -> list[OnItsWayAnswer]:
        """The latest messages down that can't have been answered yet, oldest first."""
        now = self._clock()
        with self._guard:
            return [one.as_dict(now) for one in self._on_way if one.answer_at > now]

    @property
    def connected(self) -> bool:
        """Whether a rover is connected."""
        return self._send is not None

    @property
    def frame(self) -> TelemetryFrame | None:
        """The latest frame."""
        return self._frame

    @property
    def age(self) -> float | None:
        """Seconds since the latest frame came; None before the first."""
        with self._guard:
            return None if self._frame is None else self._clock() - self._taken_at

    @property
    def age_since_connected(self) -> float | None:
        """As ``age``; None before the first frame of the connection that there is, or was last.

        A rover that comes back may stand otherwise than the latest frame has it, however new that is.
        """
        return self.age if self._told_by == self._connections else None

    @property
    def light(self) -> float:
        """How long the latest frame was on its way [s]: what it tells is older than ``age`` by this."""
        return self._light

    @property
    def received_at(self) -> float | None:
        """When the latest frame came, seconds since 1970-01-01 UTC."""
        return None if self._frame is None else self._received_at

    def as_dict(self) -> LinkAnswer:
        """Plain JSON for the interface."""
        age = self.age
        return {
            "connected": self.connected,
            "age_s": age,
            "measured_age_s": None if age is None else age + self._light,
            "received_at": self.received_at,
            "light_time": self.light_time.as_dict(),
            "on_the_way": self.on_the_way,
            "lost_on_the_way": self.lost_on_the_way,
            "frames": self.frames,
            "gaps": self.gaps,
            "restarts": self.restarts,
            "late": self.late,
            "repeated": self.repeated,
            "clock_jumps": self.clock_jumps,
            "acks_again": self.acks_again,
            "faults": self.faults,
            "faults_by_kind": dict(self.kinds),
            "fault": self.fault,
        }
