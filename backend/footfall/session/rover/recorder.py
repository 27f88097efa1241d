"""Records what a session hears of its rover, and tells it, beside the log; by a thread of its own that may be slow.

The recordings are MCAP files (:mod:`footfall.io.recordings`) in ``recordings/`` of the session's folder. They are no
part of the log: nothing is folded from them, and bundles leave them out.
"""

import contextlib
import json
import logging
import os
import re
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, NamedTuple

from footfall.core.errors import FootFallError, NotFound
from footfall.io.recordings import ACKNOWLEDGEMENTS, SUFFIX, TO_ROVER, UNFINISHED
from footfall.io.recordings.recovery import recover
from footfall.io.recordings.writing import JOINTS, RecordingWriter
from footfall.session.rover.light_time import LightTime
from footfall.session.rover.link import RoverLink
from footfall.telemetry.images import Snapshot
from footfall.telemetry.joint_layout import JointLayout
from footfall.telemetry.link_state import layout_object
from footfall.telemetry.state import TelemetryFrame

FOLDER = "recordings"
FLUSH_AFTER = 1.0
"""A chunk that is not full is closed after so long without news [s]."""
TRY_AGAIN_AFTER = 10.0
"""Pause after the disk refused [s]; what comes meanwhile is counted as dropped."""
LAST_WORDS = 5.0
"""How long closing waits for the disk [s]; a recording that is unfinished then is recovered at the next opening."""
MOST_IMAGES = 2
"""Snapshots that wait: nine pairs take 6 MB."""
_NAME = re.compile(r"telemetry-(\d+)-.*\.mcap(\.part)?$")
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class RecordingLimits:
    """file_bytes: a recording that has grown to this is finished and the next one begun.

    session_bytes: of all recordings of a session; beyond it the oldest are removed.
    waiting: things that wait for the disk; beyond it the oldest are dropped and counted.
    """

    file_bytes: int = 16 << 20
    session_bytes: int = 1 << 30
    waiting: int = 256


DEFAULT_LIMITS = RecordingLimits()


class RecordedRobot(NamedTuple):
    """Who is recorded. described: whether others described it: then the recording says its legs and joints by name."""

    name: str
    layout: JointLayout
    described: bool


Item = TelemetryFrame | Snapshot | tuple[str, dict[str, Any]]
"""A frame, images, or a topic and a JSON object."""


class Recorder:
    """Takes from any thread without waiting; one thread, started by the first thing to record, writes.

    folder: of the session. robot: asked for when a recording begins. limits: None: write nothing.
    tell: hears of what went wrong (once, until it went well again) and of recordings that were saved; called from
    the recorder's thread with an event's type and a text.
    """

    def __init__(
        self,
        folder: Path,
        robot: Callable[[], RecordedRobot],
        tell: Callable[[str, str], None],
        limits: RecordingLimits | None = DEFAULT_LIMITS,
    ) -> None:
        self._folder = folder / FOLDER
        self._robot, self._tell = robot, tell
        self._limits = limits or DEFAULT_LIMITS
        self._listeners: list[Callable[[Item, int], None]] = []
        self._filled = threading.Condition()
        self._waiting: deque[tuple[int, Item]] = deque()
        self._untold = self.dropped = 0
        self._closing = limits is None
        self._thread: threading.Thread | None = None
        # when things came, by a clock that does not jump
        self._offset = time.time_ns() - time.monotonic_ns()
        self._file: IO[bytes] | None = None
        self._writer: RecordingWriter | None = None
        self._path = self._folder
        self._latest = self._number = 0
        self._refused_until = 0.0
        self._reported = False
        if limits is not None and any(self._folder.glob(f"*{UNFINISHED}")):
            self._start()

    def take(self, item: Item, at: float | None = None) -> None:
        """Record a thing that came ``at``, time.monotonic() (None: now) [s]. Never waits for the disk.

        Where too much waits, the oldest is dropped and counted.
        """
        came = self._offset + (time.monotonic_ns() if at is None else round(at * 1e9))
        for listener in self._listeners:
            listener(item, came)
        with self._filled:
            if self._closing:
                return
            if isinstance(item, Snapshot):
                older = [one for one in self._waiting if isinstance(one[1], Snapshot)]
                if len(older) >= MOST_IMAGES:
                    self._waiting.remove(older[0])
                    self._drop()
            if len(self._waiting) >= self._limits.waiting:
                self._waiting.popleft()
                self._drop()
            self._waiting.append((came, item))
            self._start()
            self._filled.notify()

    def listen(self, callback: Callable[[Item, int], None]) -> Callable[[], None]:
        """Tell ``callback`` of each thing, recorded or not, and when it came [ns]; returns what ends it.

        It is called by whoever brings the thing, which must not wait.
        """
        self._listeners = [*self._listeners, callback]

        def unlisten() -> None:
            self._listeners = [one for one in self._listeners if one is not callback]

        return unlisten

    @property
    def listened_to(self) -> bool:
        """Whether anybody is told of what comes."""
        return bool(self._listeners)

    def close(self) -> None:
        """Finish the recording under way; harmless when done twice."""
        with self._filled:
            self._closing = True
            self._filled.notify()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(LAST_WORDS)

    def paths(self) -> list[Path]:
        """The recordings, oldest first; the last ones may be unfinished."""
        try:
            found = [p for p in self._folder.iterdir() if _NAME.match(p.name) and p.is_file()]
        except OSError:
            return []
        return sorted(found, key=lambda path: path.name)

    def path(self, name: str) -> Path:
        """The recording ``name``, as it will be called when it is finished. Raises NotFound."""
        for path in self.paths():
            if recording_name(path) == name:
                return path
        raise NotFound(f"the session has no recording {name!r}", recording=name)

    # -- inside: the caller holds the condition --------------------------------------------------

    def _drop(self) -> None:
        self.dropped += 1
        self._untold += 1

    def _start(self) -> None:
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="footfall-recorder", daemon=True)
            self._thread.start()

    # -- inside: the recorder's thread -----------------------------------------------------------

    def _run(self) -> None:
        self._recover()
        while True:
            with self._filled:
                self._filled.wait_for(lambda: self._waiting or self._closing, FLUSH_AFTER)
                item = self._waiting.popleft() if self._waiting else None
                ended = item is None and self._closing
                untold, self._untold = self._untold, 0
            self._guarded(lambda item=item, untold=untold, ended=ended: self._write(item, untold, ended), item, untold)
            if ended:
                return

    def _guarded(self, work: Callable[[], None], item: object, untold: int) -> None:
        """Do it; what the disk can't take is counted, and told once."""
        new = item is not None
        if time.monotonic() < self._refused_until and not self._closing:
            self._lose(new, untold)
            return
        try:
            work()
        except OSError as err:
            self._refused_until = time.monotonic() + TRY_AGAIN_AFTER
            self._lose(new + (0 if self._writer is None else self._writer.unsaved), untold)
            self._abandon()
            if not self._reported:
                self._reported = True
                self._tell("link_fault", f"telemetry is not recorded: {err.strerror or err}")
        except Exception:
            # one strange thing must not end the recording of the others
            _log.exception("something could not be recorded")
            self._lose(new, untold)
        else:
            if new and self._writer is not None and not self._writer.unsaved:
                self._reported = False

    def _lose(self, new: int, untold: int) -> None:
        """Count what is lost only now, and keep for later what could not be told of earlier losses."""
        with self._filled:
            self.dropped += new
            self._untold += new + untold

    def _write(self, came: tuple[int, Item] | None, untold: int, ended: bool) -> None:
        if came is not None:
            at, item = max(self._latest, came[0]), came[1]
            self._latest = at
            writer = self._open()
            if untold:
                writer.dropped(untold, at)
            match item:
                case TelemetryFrame():
                    writer.frame(item, at)
                case Snapshot():
                    writer.images(item, at)
                case (topic, body):
                    writer.note(topic, body, at)
            if writer.size >= self._limits.file_bytes:
                self._finish()
        elif self._writer is None:
            self._lose(0, untold)
        else:
            if untold:
                self._writer.dropped(untold, self._latest)
            if self._writer.unsaved:
                self._writer.flush()
        if ended:
            self._finish()

    def _open(self) -> RecordingWriter:
        if self._writer is None:
            robot = self._robot()
            self._folder.mkdir(exist_ok=True)
            self._path = self._next()
            self._file = file = create(self._path)
            about = {"session": self._folder.parent.name, "robot": robot.name, "legs": str(len(robot.layout.legs))}
            if robot.described:
                about[JOINTS] = json.dumps(layout_object(robot.layout))
            names = robot.layout.joint_names
            self._writer = RecordingWriter(file, names, about, sync=lambda: os.fsync(file.fileno()))
        return self._writer

    def _next(self) -> Path:
        """Numbered on, so that names are in order also where the clock went back."""
        numbers = [int(found[1]) for path in self.paths() if (found := _NAME.match(path.name))]
        number = max([self._number, *numbers]) + 1
        self._number = number
        stamp = time.strftime("%Y%m%d-%H%M%S", time.gmtime())
        return self._folder / f"telemetry-{number:05}-{stamp}{UNFINISHED}"

    def _finish(self) -> None:
        if self._writer is None or self._file is None:
            return
        self._writer.finish()
        os.fsync(self._file.fileno())
        self._file.close()
        self._writer = self._file = None
        os.replace(self._path, self._path.with_name(recording_name(self._path)))
        self._remove_oldest()

    def _abandon(self) -> None:
        """Leave a recording that can't be written as it is; what is whole of it is saved at the next opening."""
        if self._file is not None:
            with contextlib.suppress(OSError):
                self._file.close()
            with contextlib.suppress(OSError):
                if self._path.stat().st_size < _SMALLEST:
                    self._path.unlink()
        self._writer = self._file = None

    def _remove_oldest(self) -> None:
        finished = [path for path in self.paths() if not path.name.endswith(UNFINISHED)]
        sizes = [path.stat().st_size for path in finished]
        # the one just finished stays
        for path, _ in zip(finished[:-1], sizes, strict=False):
            if sum(sizes) <= self._limits.session_bytes:
                return
            path.unlink()
            del sizes[0]

    def _recover(self) -> None:
        for path in [path for path in self.paths() if path.name.endswith(UNFINISHED)]:
            try:
                text = save(path)
            except Exception as err:  # a file that is odd in a new way must not end the recording of others
                _log.exception("a recording can't be saved")
                text = f"the recording {recording_name(path)} was cut short and can't be saved: {err}"
            self._tell("log_repaired", text)


_SMALLEST = 1024
"""A file of fewer bytes holds no chunk."""


def create(path: Path) -> IO[bytes]:
    """A new file; where there is one of this name, that stays."""
    return path.open("xb")


def recording_name(path: Path) -> str:
    """What a recording is, or will be, called."""
    return path.name.removesuffix(UNFINISHED) + SUFFIX if path.name.endswith(UNFINISHED) else path.name


def save(path: Path) -> str:
    """Make an unfinished recording a finished one; returns what was saved. One without a message is removed."""
    name = recording_name(path)
    partial = path.with_name(f".{name}")
    try:
        with path.open("rb") as source, partial.open("wb") as target:
            saved = recover(source, target)
            os.fsync(target.fileno())
    except OSError:
        partial.unlink(missing_ok=True)
        raise
    except FootFallError:
        partial.unlink()
        path.unlink()
        return f"the recording {name} was cut before its first message and was removed"
    if saved.messages:
        os.replace(partial, path.with_name(name))
    else:
        partial.unlink()
    path.unlink()
    return (
        f"the recording {name} was cut short: {saved.counts.frames} frames, {saved.messages} messages "
        f"were saved, the last {saved.lost} bytes were lost"
    )


class RecordedLink(RoverLink):
    """A rover link whose messages down are recorded, as soon as they are on their way."""

    def __init__(self, recorder: Recorder, light_time: LightTime | None = None) -> None:
        super().__init__(light_time=light_time)
        self._recorder = recorder

    def send(self, text: str) -> None:
        """See :meth:`RoverLink.send`."""
        super().send(text)
        self._recorder.take((TO_ROVER, json.loads(text)))


def acknowledgement(
    kind: str, command_id: str, state: str = "", reason: str = "", time: float | None = None
) -> tuple[str, dict[str, Any]]:
    """What to record of an acknowledgement: "ack" of a command, "stop_ack" of a stop. time: rover clock [s]."""
    body = {"type": kind, "id": command_id} | ({"state": state, "reason": reason} if state else {})
    return ACKNOWLEDGEMENTS, body | ({} if time is None else {"time": time})
