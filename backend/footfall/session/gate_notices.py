"""What the rover has to know whatever is sent: the stop, its clearing, the epoch. Told again until it has answered.

A new epoch makes what is on its way too late. One begins with every rover that comes, every stop, and every command
that is given up. The rover learns it by a message of its own, which answers its hello and follows a stop, and which it
confirms.
"""

import contextlib
import time
from collections.abc import Callable

from footfall.core.errors import Conflict
from footfall.session.gate.gate import Gate
from footfall.session.gate.runs import Run
from footfall.session.rover.link import RoverLink
from footfall.telemetry.link import (
    ClearStopMessage,
    CommandMessage,
    EpochMessage,
    HelloMessage,
    Message,
    QueryMessage,
    StopMessage,
    encode,
)

AGAIN_AFTER = 1.0
"""What the rover has not acknowledged is told again so long after it could have been answered [s]."""


class GateNotices:
    """Tells the rover of one session what holds at its gate. clock: one that never jumps [s]."""

    def __init__(self, link: RoverLink, gate: Gate, clock: Callable[[], float]) -> None:
        self._link, self._gate, self._clock = link, gate, clock
        self._greeting: str | None = None
        self._stop_at = self._epoch_at = 0.0
        self._clear_at: float | None = None

    def rover_came(self, hello: HelloMessage | None, untold: bool = False) -> bool:
        """Another epoch begins for it. Whether a stop is in force. hello: None: it is not told of epochs.

        untold: the latest stop was cleared, perhaps without its knowing: where it says that it is stopped, it is told.

        The time of day makes the epoch later than those of other sessions, also where neither the rover nor this
        session knows of them.
        """
        known = 0 if hello is None else hello.epoch or 0
        stopped = self._gate.rover_changed(max(known, int(time.time())), hears_epochs=hello is not None)
        self._greeting = None if hello is None else hello.id
        if stopped:
            self.stop()
        else:
            self.epoch()
            self._clear_at = self._clock() if untold else self._clear_at
        return stopped

    def epoch_heard(self, about: str, epoch: int) -> bool:
        """The rover knows of ``epoch``. Whether another session had told it that, and so a later one began here."""
        later = self._gate.epoch_heard(epoch, about == self._greeting)
        if later:
            self._clear_at = None  # the rover may have been stopped by that other session since
            self.epoch()
        return later

    def epoch(self) -> None:
        """In which epoch commands are released now."""
        if self._greeting is not None:
            self._epoch_at = self._clock()
            self._send(EpochMessage(self._greeting, self._gate.epoch))

    def stop(self) -> bool:
        """Stop; whether it went to a rover. That it knows the epoch of the stop has to be confirmed by itself."""
        self._stop_at, self._clear_at = self._clock(), None
        reached = self._send(StopMessage(self._gate.stop_id, self._gate.epoch))
        self.epoch()
        return reached

    def clear(self) -> None:
        """The stop is cleared."""
        self._clear_at = self._clock()
        self._send(ClearStopMessage("clear-stop", self._gate.epoch))

    def ask(self, command_id: str) -> None:
        """What became of a command?"""
        self._send(QueryMessage(command_id))

    def remind(self) -> None:
        """Tell again what the rover has not acknowledged: a gateway may have lost it, and twice harms nobody."""
        now = self._clock() - self._link.light_time.round_trip
        if now - self._stop_at > AGAIN_AFTER:
            self._gate.remind(self.stop)
        if self._link.connected and not self._gate.epoch_known and now - self._epoch_at > AGAIN_AFTER:
            self.epoch()
        if self._clear_at is not None and self._clear_at < now - AGAIN_AFTER:
            self._remind_of_clearing(self._clear_at + self._link.light_time.round_trip)

    def _remind_of_clearing(self, answered_from: float) -> None:
        """Clear again where the rover says that it is stopped and could have heard that it is not."""
        frame, age = self._link.frame, self._link.age
        if frame is None or age is None or self._clock() - age <= answered_from:
            return
        if frame.state.mode != "stopped":
            self._clear_at = None
        elif self._link.connected:
            self._gate.remind_of_clearing(self.clear)

    def _send(self, message: Message) -> bool:
        with contextlib.suppress(Conflict):
            self._link.send(encode(message))
            return True
        return False


def message_of(run: Run, epoch: int) -> CommandMessage:
    """The message that releases the present row of ``run``."""
    command = run.command
    return CommandMessage(
        id=run.command_id,
        sequence=run.digest,
        row=run.row,
        name=command.name,
        leg=command.leg,
        joints=command.joints,
        duration=command.duration,
        force=command.force,
        epoch=epoch,
    )
