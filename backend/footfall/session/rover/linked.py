"""A session with its rover: both ways of the link, what comes over it, and what is recorded of that.

What the rover says is used when its light time is over; what is wrong with a message is seen at once, by this end.
"""

import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import replace

from footfall.core.errors import Conflict, InvalidTelemetry, NotFound
from footfall.planning.compliance.seen_yield import gives_way
from footfall.session.commanding import Commanding
from footfall.session.core import SessionCore
from footfall.session.pixels import HeldPixels
from footfall.session.rover.heard import ENDED
from footfall.session.rover.light_time import LightTime
from footfall.session.rover.link import Send
from footfall.session.rover.past import Past
from footfall.session.rover.recorder import (
    DEFAULT_LIMITS,
    RecordedLink,
    RecordedRobot,
    Recorder,
    RecordingLimits,
    acknowledgement,
)
from footfall.telemetry.images import Snapshot
from footfall.telemetry.link import EPOCHS_AHEAD, ErrorMessage, HelloMessage, ImageRequestMessage, encode
from footfall.telemetry.state import TelemetryFrame, counted_anew


class LinkedRover:
    """The rover of a session: both ways of its link. Every method may be called from any thread."""

    seen_to_give_way: bool | None = None
    """Whether the rover's joints give way, by the latest telemetry at rest that tells it."""

    def __init__(
        self,
        core: SessionCore,
        recording: RecordingLimits | None = DEFAULT_LIMITS,
        light_time: LightTime | None = None,
    ) -> None:
        self._core = core
        self._requests = 0
        self._follow: list[Callable[[TelemetryFrame], None]] = []
        self.recorder = Recorder(core.store.folder, self._recorded_robot, self._recording_failed, recording)
        self.past = Past()
        self.link = RecordedLink(self.recorder, light_time)
        folded_log = core.folded_log
        self.commanding = Commanding(self.link, folded_log.record, folded_log.record_anyway, lambda: folded_log.state)

    def _recorded_robot(self) -> RecordedRobot:
        core = self._core
        return RecordedRobot(core.state.robot_name, core.layout, core.described is not None)

    def close(self) -> None:
        """End the link, the run and the recording; harmless when done twice."""
        self.link.close()
        self.commanding.close()
        self.recorder.close()

    def follow(self, callback: Callable[[TelemetryFrame], None]) -> None:
        """Call ``callback`` with each frame that is the latest one, as soon as it is."""
        self._follow.append(callback)

    @property
    def conn_seat(self) -> str:
        """Of the page that holds the conn; "" where none does."""
        holder = self.commanding.gate.conn_holder
        return "" if holder is None else holder.seat

    @property
    def frame(self) -> TelemetryFrame | None:
        """The latest telemetry frame."""
        return self.link.frame

    @property
    def telemetry_age(self) -> float | None:
        """Seconds since it came."""
        return self.link.age

    @property
    def stops(self) -> int:
        """How often a stop was asked for since the session was opened."""
        return self.commanding.gate.stops()

    def connected(self, send: Send, hello: HelloMessage | None = None) -> None:
        """A rover is on the link. ``send``: hands it a text frame; thread-safe, does not block.

        hello: what it said of itself; without, it is not told of epochs. An epoch that can't be counts for nothing: the
        rover can be stopped all the same.
        """
        if hello is not None and not self._may_have_heard(hello.epoch or 0):
            hello = replace(hello, epoch=None)
        self.link.connect(send)
        # a stop in force goes first: the log may be slow
        epoch = self.commanding.connected(hello)
        self._core.folded_log.record_anyway("link_connected", {"epoch": epoch})
        self._core.folded_log.tell("link", link=self.link.as_dict())

    def disconnected(self, send: Send | None = None) -> None:
        """The rover is gone. With ``send``: only if that is the one in use."""
        if self.link.disconnect(send):
            self.commanding.lost("the rover disconnected")
            self._core.folded_log.record_anyway("link_lost", {})
            self._core.folded_log.tell("link", link=self.link.as_dict())

    def take_telemetry(self, frame: TelemetryFrame, at: float | None = None, by_request: bool = False) -> None:
        """``at``: when it came, time.monotonic() [s]. Raises InvalidTelemetry where the frame is of another robot.

        by_request: it did not come over the link, and counts for nothing where a rover is linked when it arrives.
        """
        self._core.require_robot(frame.state)
        light = self.link.light_time.telemetry
        self.link.hear(lambda came: self._telemetry_arrived(frame, came, light, by_request), at)

    def _telemetry_arrived(self, frame: TelemetryFrame, at: float, light: float, by_request: bool) -> None:
        before = self.link.frame
        if self.link.take(frame, at, light, by_request):
            if before is not None:
                self._tell_what_is_odd(before, frame)
            if frame.state.mode == "idle" and self._core.described is None:
                gave_way = gives_way(frame.state, frame.commanded, self._core.description.stiffness)
                self.seen_to_give_way = self.seen_to_give_way if gave_way is None else gave_way
            self.recorder.take(frame, at)
            self.past.take(frame, at)
            self._core.folded_log.tell("telemetry", frame=frame, age=self.link.age, light=light)
            for callback in self._follow:
                callback(frame)

    def _tell_what_is_odd(self, before: TelemetryFrame, frame: TelemetryFrame) -> None:
        """The frame is kept all the same: telemetry with a wrong time or number is worth more than none."""
        if frame.number <= before.number:
            return
        back = before.state.time - frame.state.time
        if back > 0:
            text = f"the rover's clock went back by {back:z.3f} s; time never runs backwards while the rover runs"
            self._tell_both("time-backwards", text)
        if counted_anew(before.number, frame.number):
            text = f"the rover's frames jumped from number {before.number} to {frame.number}; counted as a restart"
            self._tell_both("number-jump", text)

    def _tell_both(self, kind: str, text: str) -> None:
        self._complained(text, "", "server", kind)
        with suppress(Conflict):
            self.link.send(encode(ErrorMessage("", text)))

    def take_images(self, snapshot: Snapshot, held: HeldPixels | None = None) -> str:
        """Keep a snapshot; its state becomes the planning state. Returns its digest, before its light time is over.

        held: its pixels, which are given back when it is stored, or can't be any more.
        """
        self._core.require_robot(snapshot.state)
        digest = snapshot.digest
        over = ExitStack()
        if held is not None:
            over.callback(held.hand_on())

        def arrived(at: float) -> None:
            with over:
                self._images_arrived(snapshot, at)

        try:
            self.link.hear(arrived, path="images", lost=over.close)
        except BaseException:
            over.close()
            raise
        return digest

    def _images_arrived(self, snapshot: Snapshot, at: float) -> None:
        self.recorder.take(snapshot, at)
        # packing nine pairs takes long; telemetry and acknowledgements must not wait for it
        digest, state = self._core.put(snapshot), self._core.put(snapshot.state)
        payload = {"digest": digest, "state": state, "pairs": [pair.name for pair in snapshot.pairs]}
        if snapshot.left_out:
            payload["left_out"] = dict(snapshot.left_out)
        self._core.folded_log.record("snapshot_taken", payload)

    def take_complaint(self, text: str, *, message_id: str = "", about_rover: str | None = None) -> None:
        """The rover could not use a message, or the server one of its: the operator is told.

        about_rover: the kind of what was wrong with the rover's message. The same text again is counted, not logged.
        """
        if about_rover is None:
            self.link.hear(lambda _: self._complained(text, message_id, "rover", "refused-by-rover"))
        else:
            self._complained(text, message_id, "server", about_rover)

    def _complained(self, text: str, message_id: str, source: str, kind: str) -> None:
        if self.link.complain(text, kind):
            self._core.folded_log.record_anyway("link_fault", {"id": message_id, "reason": text, "source": source})
        self._core.folded_log.tell("link", link=self.link.as_dict())

    def take_acknowledgement(self, command_id: str, state: str, reason: str = "", time: float | None = None) -> None:
        """The rover "received", "started", has "done" or "refused" a command. Unknown ids change nothing.

        time: rover clock [s].
        """
        self.link.hear(lambda came: self._acknowledged(command_id, state, reason, time, came))

    def _acknowledged(self, command_id: str, state: str, reason: str, time: float | None, at: float) -> None:
        self.recorder.take(acknowledgement("ack", command_id, state, reason, time), at)
        outdated = state == "outdated"
        if outdated:
            # also of another session: something on the way holds commands back
            text = f"command {command_id} came to the rover too late and was not carried out: {reason}"
            self._complained(text, command_id, "rover", "outdated-command")
            state, reason = "refused", f"outdated: {reason}"
        known = next((command.state for command in self._core.state.commands if command.id == command_id), None)
        if known in ENDED and state in ENDED and state != known and not outdated:
            text = (
                f"the rover says of command {command_id} that it is {state}, and had said that it is {known}: {reason}"
            )
            self._complained(text, command_id, "rover", "contradiction")
        elif known is not None:
            self.commanding.heard(command_id, state, reason)

    def take_epoch(self, about: str, epoch: int) -> None:
        """The rover has heard of ``epoch``, and says so about the message called ``about``. Raises InvalidTelemetry."""
        self.require_epoch(epoch)
        self.link.hear(lambda _: self._epoch_heard(about, epoch))

    def _epoch_heard(self, about: str, epoch: int) -> None:
        self.commanding.epoch_heard(about, epoch)
        # whether anything can be armed may be another answer now
        self._core.folded_log.tell("link", link=self.link.as_dict())

    def require_epoch(self, epoch: int) -> None:
        """Raises InvalidTelemetry where no ground can have told the rover of ``epoch``."""
        if not self._may_have_heard(epoch):
            text = (
                f"the rover has heard of epoch {epoch}, which no ground can have told it; "
                "commands go when its software was started anew, stops at any time"
            )
            raise InvalidTelemetry(text, epoch=epoch)

    def _may_have_heard(self, epoch: int) -> bool:
        """Of another ground, whose clock may be wrong; counting beyond an epoch out of reach would leave none."""
        return epoch <= max(self.epoch, int(time.time()) + EPOCHS_AHEAD)

    def take_stop_acknowledgement(self, stop_id: str | None = None, time: float | None = None) -> None:
        """The rover stands still because of the stop ``stop_id`` (None: the latest). time: rover clock [s].

        It waits behind nothing else that the rover says.
        """
        self.link.hear(lambda came: self._stop_acknowledged(stop_id, time, came), path="stops")

    def _stop_acknowledged(self, stop_id: str | None, time: float | None, at: float) -> None:
        self.commanding.stop_acknowledged(stop_id)
        self.recorder.take(acknowledgement("stop_ack", stop_id or "", time=time), at)

    def set_light_time(self, light_time: LightTime) -> None:
        """How long messages are on their way from now on; what is on its way already keeps its time."""
        with self._core.folded_log.lock:
            if light_time != self.link.light_time:
                self._core.folded_log.record_anyway("light_time_set", light_time.as_dict())
                self.link.light_time = light_time
                self._core.folded_log.tell("link", link=self.link.as_dict())

    @property
    def epoch(self) -> int:
        """In which commands are released now; it only grows."""
        return self.commanding.gate.epoch

    def superseded(self, by: str) -> None:
        """Tell whoever listens that session ``by`` holds the rover from now on."""
        self._core.folded_log.tell("session", session={"current": by})

    def _recording_failed(self, type: str, text: str) -> None:
        """A fault of the recorder, or what it saved of a recording that was cut short."""
        if type == "link_fault":
            self.link.complain(text, "recorder")
            self._core.folded_log.record_anyway(type, {"id": "", "reason": text, "source": "recorder"})
            self._core.folded_log.tell("link", link=self.link.as_dict())
        else:
            self._core.folded_log.record_anyway(type, {"text": text})

    def request_images(self, pairs: tuple[str, ...] | list[str] | None = None) -> None:
        """Ask the rover for images of the named camera pairs (None: all). Raises Conflict, NotFound."""
        about = self._core.described or self._core.description
        known = [camera.name for camera in about.cameras]
        if not known:
            raise Conflict(f"{about.name} has no cameras: its description names none")
        for name in pairs or ():
            if name not in known:
                raise NotFound(f"there is no camera pair {name!r}; there are {', '.join(known)}", pair=name)
        with self._core.folded_log.lock:
            self._requests += 1
            request = ImageRequestMessage(f"images-{self._requests}", None if pairs is None else tuple(pairs))
        self.link.send(encode(request))
