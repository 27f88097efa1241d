"""A recording of a rover read again from beginning to end: what it holds, and whether it keeps the link's rules.

No server or rover is needed. Frames, images and messages are read as they were recorded; counted anew, not believed.
"""

import hashlib
import json
from collections import Counter
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from footfall.core.errors import FootFallError
from footfall.core.progress import Progress, no_progress
from footfall.io.link_images import decode_images
from footfall.io.recordings import ACKNOWLEDGEMENTS, DROPPED, IMAGES, TO_ROVER
from footfall.io.recordings.continuity import Continuity
from footfall.io.recordings.reading import Recording, Said
from footfall.robot.description import athlete_layout
from footfall.telemetry.joint_layout import JointLayout
from footfall.telemetry.state import TelemetryFrame

MOST_PROBLEMS = 20
"""Problems told one by one; the rest are counted."""
UNHEARD = "unheard"
"""What is known of a command that was never acknowledged."""
_EVERY = 100


@dataclass(frozen=True)
class RecordingReport:
    """What a recording holds.

    duration [s]; counts: frames, gaps (numbers missing between them), restarts, dropped (what the recorder could not
    take); images: sets of them; left_out: pairs of them that can't be used; commands: how many ended in which state;
    strangers: acknowledgements of commands that an earlier recording holds; cut: it was cut short, and what is whole of
    it was read; digest: SHA-256 of everything said, in order; problems: what must not be.
    """

    recording: str
    robot: str
    legs: int
    duration: float
    counts: dict[str, int]
    images: int
    left_out: int
    commands: dict[str, int]
    stops: int
    strangers: int
    cut: bool
    digest: str
    problems: tuple[str, ...]

    @property
    def ok(self) -> bool:
        """Whether nothing is wrong with it."""
        return not self.problems

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON."""
        return {**asdict(self), "ok": self.ok}

    def lines(self) -> list[str]:
        """What was found, for people."""
        cut = ["it was cut short; what is whole of it was read"] if self.cut else []
        return [*cut, *(f"problem: {text}" for text in self.problems)]

    def summary(self) -> str:
        """All of it in one line."""
        commands = ", ".join(f"{count} {state}" for state, count in self.commands.items()) or "none"
        return (
            f"{self.duration:z.1f} s of {self.robot}, {_words(self.counts)}, {self.images} sets of images, "
            f"commands: {commands}, {self.stops} stops; {'in order' if self.ok else 'NOT in order'}"
        )


def replay_recording(path: Path, progress: Progress = no_progress) -> RecordingReport:
    """Read a recording and judge it. One that is damaged gives a report of what comes before the damage.

    Raises InvalidInput where the file is no recording at all.
    """
    recording = Recording(path)
    heard = _Heard(recording.robot, recording.legs, recording.described)
    try:
        for i, said in enumerate(recording.said()):
            if i % _EVERY == 0:
                passed = (said.at - recording.start) / max(1, recording.end - recording.start)
                progress(min(1.0, passed), f"{heard.counted.frames} frames")
            heard.take(said)
    except FootFallError as err:
        heard.problem(err.message)
    miscounted = {name: count for name, count in recording.counts.items() if heard.counted.as_dict()[name] != count}
    if miscounted:
        found = {name: heard.counted.as_dict()[name] for name in miscounted}
        heard.problem(f"its end says {_words(miscounted)}, but it holds {_words(found)}")
    progress(1.0, "done")
    return RecordingReport(
        recording=recording.name,
        robot=recording.robot,
        legs=recording.legs,
        duration=recording.duration,
        counts=heard.counted.as_dict(),
        images=heard.images,
        left_out=heard.left_out,
        commands=dict(sorted(Counter(heard.commands.values()).items())),
        stops=len(heard.stops),
        strangers=len(heard.strangers),
        cut=not recording.whole,
        digest=heard.digest.hexdigest()[:32],
        problems=heard.listed(),
    )


def _words(counts: dict[str, int]) -> str:
    return ", ".join(f"{count} {name}" for name, count in counts.items())


@dataclass
class _Heard:
    """What was said so far."""

    robot: str
    legs: int
    described: JointLayout | None
    counted: Continuity = field(default_factory=Continuity)
    latest: TelemetryFrame | None = None
    images: int = 0
    left_out: int = 0
    commands: dict[str, str] = field(default_factory=dict)
    stops: set[str] = field(default_factory=set)
    strangers: set[str] = field(default_factory=set)
    stopped: bool = False
    epoch: int = 0
    digest: Any = field(default_factory=hashlib.sha256)
    problems: list[str] = field(default_factory=list)

    def take(self, said: Said) -> None:
        match said.content:
            case TelemetryFrame() as frame:
                self.digest.update(frame.digest.encode())
                self._frame(frame)
            case bytes() as images:
                self.digest.update(images)
                self._images(images)
            case body:
                if body.get("type") != "epoch":  # a number of the session's own: the same rover may be told another one
                    self.digest.update(json.dumps(body, sort_keys=True).encode())
                self._message(said.topic, body)

    def _frame(self, frame: TelemetryFrame) -> None:
        self.counted.take(frame.number)
        state, before = frame.state, self.latest
        layout = self.described or athlete_layout(self.legs)
        if (state.robot, len(state.posture)) != (self.robot, len(layout.joint_names)):
            self.problem(f"frame {frame.number} is of {state.robot} with {state.leg_count} legs")
        if before is not None and frame.number > before.number and state.time < before.state.time:
            back = before.state.time - state.time
            self.problem(f"the rover's clock went back by {back:z.3f} s at frame {frame.number}")
        self.latest = frame

    def _images(self, content: bytes) -> None:
        self.images += 1
        try:
            _, snapshot = decode_images(content, self.legs, described=self.described)
            self.left_out += len(snapshot.left_out)
        except FootFallError as err:
            self.problem(f"images, set {self.images}: {err.message}")

    def _message(self, topic: str, body: dict[str, Any]) -> None:
        if topic == IMAGES:
            self.images += 1
            self.problem(f"images, set {self.images}: they were taken out of the file, their header is there")
            return
        kind, name = body.get("type"), str(body.get("id", ""))
        if topic == TO_ROVER and "epoch" in body:  # recordings of earlier versions of the link know none
            if body["epoch"] < self.epoch:
                self.problem(f"{kind} {name} was sent in epoch {body['epoch']}, after one of epoch {self.epoch}")
            self.epoch = max(self.epoch, body["epoch"])
        if topic == DROPPED:
            self.counted.dropped += int(body.get("dropped", 0))
        elif topic == TO_ROVER and kind == "command":
            if name in self.commands:
                self.problem(f"command {name} was sent twice")
            if self.stopped:
                self.problem(f"command {name} was sent after a stop that was not cleared")
            self.commands[name] = UNHEARD
        elif topic == TO_ROVER and kind == "stop":
            self.stops.add(name)
            self.stopped = True
        elif topic == TO_ROVER and kind == "clear_stop":
            self.stopped = False
        elif topic == ACKNOWLEDGEMENTS and kind == "ack":
            if name in self.commands:
                self.commands[name] = str(body.get("state"))
            else:
                self.strangers.add(name)

    def problem(self, text: str) -> None:
        self.problems.append(text)

    def listed(self) -> tuple[str, ...]:
        more = len(self.problems) - MOST_PROBLEMS
        return (*self.problems[:MOST_PROBLEMS], *([f"and {more} more"] if more > 0 else []))
