"""The sessions of one working folder: made, opened, listed, carried in and out."""

import os
import re
import secrets
import threading
import time
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from footfall.core.errors import Conflict, FootFallError, InvalidBundle, NotFound
from footfall.core.value import SOFTWARE_VERSION
from footfall.io.bundles import FORMAT, SESSION, VERSION, read_bundle
from footfall.resources import sample_sessions_folder
from footfall.session.access.acting import actor
from footfall.session.access.identity import LOCAL, Identity
from footfall.session.answers.commands import GateAnswer
from footfall.session.answers.sessions import SessionListed
from footfall.session.jobs.local import Jobs
from footfall.session.jobs.pool import JobPool
from footfall.session.left_behind import left_behind, mark_held, stop_left_in, unmark_held, unmark_left
from footfall.session.live import LiveSession
from footfall.session.looked import Looked
from footfall.session.naming import session_name
from footfall.session.pixels import PixelBudget
from footfall.session.reading import Read, read_here
from footfall.session.rover.light_time import LightTime
from footfall.session.rover.recorder import DEFAULT_LIMITS, RecordingLimits
from footfall.session.storage.carried_in import check_bundle
from footfall.session.storage.interface import Listed
from footfall.session.storage.listing import found_sessions, is_session_folder
from footfall.session.storage.references import require_whole, whole_zip
from footfall.session.storage.store import SessionStore, read_session, remove_session
from footfall.telemetry.link import EPOCHS_AHEAD

if TYPE_CHECKING:
    from footfall.planning.choice.policy import GaitPolicy
    from footfall.robot.legged.legged_robot import LeggedRobot
    from footfall.robot.model import Robot

_ID = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")

MOST_IDLE = 8
"""Sessions that stay open beside the current one while nothing goes on in them; the next one closes the oldest."""


class Sessions:
    """Every session under ``folder``; close it, or use it as a context manager. Thread-safe.

    jobs: the pool that all sessions share; None: worker processes of its own.
    robot: name or path of the robot of new sessions that name none.
    recording: how much of what the rover says each session records; None: nothing.
    light_time: how long messages to and from the rover are on their way; see :meth:`set_light_time`.
    read: how files from outside are read; a server reads them in a process apart. read_recordings: how recordings are
    read for plots; a server has another process for that.
    pixels: of images from outside that are in memory. policy: the learned table that walks in a closed loop may choose
    gaits by.
    """

    def __init__(
        self,
        folder: str | os.PathLike[str],
        jobs: JobPool | None = None,
        robot: "str | os.PathLike[str] | Robot | LeggedRobot" = "athlete",
        recording: RecordingLimits | None = DEFAULT_LIMITS,
        light_time: LightTime | None = None,
        read: Read = read_here,
        read_recordings: Read = read_here,
        policy: "GaitPolicy | None" = None,
    ) -> None:
        self.folder = Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.jobs = Jobs() if jobs is None else jobs
        self.read, self.read_recordings = read, read_recordings
        self.policy = policy
        self._robot = robot
        self._recording = recording
        self.light_time = light_time or LightTime()
        self.pixels = PixelBudget()
        self._guard = threading.RLock()
        self._open: dict[str, LiveSession] = {}
        self._asked_for: dict[str, float] = {}
        self._looked = Looked(lambda store: LiveSession(store, self.jobs, None, self.light_time))
        self._current: LiveSession | None = None
        self._left_behind = left_behind(self.folder)

    @property
    def current(self) -> LiveSession | None:
        """The session that was made or opened last: it holds the rover. Waits for nothing: a stop goes through it."""
        return self._current

    def stop(self, reason: str = "", who: Identity = LOCAL) -> GateAnswer:
        """Stop the rover, now, as :meth:`.Commands.stop`. Waits for no session that is made, opened or carried in.

        Raises Conflict where no session is open.
        """
        while True:
            live = self._current
            if live is None:
                raise Conflict("no session is open, so there is no rover to stop; open one with POST /api/v1/sessions")
            gate = live.commands.stop(reason, who)
            # another session may have taken the rover over meanwhile, and looked for a stop too early to find this one
            if self._current is live:
                return gate

    def create(self, name: str, robot: "str | os.PathLike[str] | Robot | LeggedRobot | None" = None) -> LiveSession:
        """A new, empty session for a robot (its name, a path, or the built model). Raises InvalidInput, NotFound."""
        from footfall.io.any_robot import load_robot

        name = session_name(name)
        robot = self._robot if robot is None else robot
        built = load_robot(os.fspath(robot)) if isinstance(robot, (str, os.PathLike)) else robot
        with self._guard:
            self._require_may_switch()
            self._close_idle()
            session_id = self._new_id()
            about = {
                "format": FORMAT,
                "version": VERSION,
                "id": session_id,
                "name": name,
                "created": time.time(),
                "robot": {"name": built.name, "digest": built.digest},
                "software": SOFTWARE_VERSION,
            }
            store = SessionStore.create(self.folder / session_id, about)
            try:
                store.put(built.description)
                live = LiveSession(store, self.jobs, self._recording, self.light_time)
                live.begin(name, built.digest, built.name)
            except BaseException:
                store.close()
                remove_session(store.folder)
                raise
            try:
                self._require_may_switch()  # making it takes a while, in which a run may have begun
            except BaseException:
                live.close()
                remove_session(store.folder)
                raise
            return self._hold(live)

    def open(self, session_id: str) -> LiveSession:
        """Make a session the current one, which holds the rover. Raises NotFound, InvalidBundle, Conflict.

        Refused while the current one sends commands (who stops the rover must not lose sight of it), and to others
        (CommandRefused) while somebody holds its conn. A stop that is in force stays so in the session that follows.
        """
        with self._guard:
            other = self._current is None or session_id != self._current.id
            if other:
                self._require_may_switch()
            live = self._load(session_id)
            if other:
                self._require_may_switch()  # reading a long log takes seconds, in which a run may have begun
            return self._hold(live)

    def get(self, session_id: str) -> LiveSession:
        """A session to be changed, opened where needed; that leaves the current one, ``current``, as it is.

        Raises NotFound, InvalidBundle, Conflict.
        """
        if (opened := self._opened(session_id)) is not None:
            return opened
        with self._guard:
            return self._load(session_id)

    def look(self, session_id: str) -> LiveSession:
        """A session to be read: the open one, else as its folder has it, where nothing changes. Raises as :meth:`get`.

        One that is open on another server can be looked at, too.
        """
        if (opened := self._opened(session_id)) is not None:
            return opened
        return self._looked.at(self._existing(session_id))

    def opened(self) -> "list[LiveSession]":
        """The sessions that are open, the current one first."""
        with self._guard:
            return sorted(self._open.values(), key=lambda live: live is not self._current)

    def set_light_time(self, light_time: LightTime) -> None:
        """How far the rover is, for all sessions, those that are open and those to come."""
        with self._guard:
            self.light_time = light_time
            for live in self._open.values():
                live.rover.set_light_time(light_time)

    def list(self) -> list[SessionListed]:
        """What there is, newest first; a damaged session is listed with its ``problem``."""
        found = [self._about(name, one) for name, one in found_sessions(self.folder).items() if _ID.fullmatch(name)]
        return sorted(found, key=lambda about: (-(about["created"] or 0.0), about["id"]))

    def samples(self) -> "list[str]":
        """Names of the sample sessions that ship with FootFall."""
        folder = sample_sessions_folder()
        if not folder.is_dir():
            return []
        return sorted(
            path.name.removesuffix(".zip")
            for path in folder.iterdir()
            if path.suffix == ".zip" or (path / SESSION).is_file()
        )

    def open_sample(self, name: str) -> LiveSession:
        """A copy of a sample session. Raises NotFound naming the samples."""
        if name not in self.samples():
            known = ", ".join(self.samples()) or "none"
            raise NotFound(f"there is no sample session {name!r}; there are: {known}", sample=name)
        path = sample_sessions_folder() / name
        return self.import_bundle(path if path.is_dir() else path.with_name(f"{name}.zip"), ours=True)

    def import_bundle(self, bundle: str | os.PathLike[str] | bytes, *, ours: bool = False) -> LiveSession:
        """Copy a bundle (folder, zip file, or its bytes) into the working folder and open it.

        Every artifact is looked at before. ours: it comes with this program and is read in this process.
        Raises InvalidBundle, naming the file, where anything is wrong; then nothing is left behind.
        """
        self._require_may_switch()
        (read_here if ours else self.read)(check_bundle, bundle)
        read = read_bundle(bundle)
        with self._guard:
            session_id = self._new_id()
            folder = self.folder / session_id
            SessionStore.take_in(folder, replace(read, session={**read.session, "id": session_id})).close()
            try:
                _require_sense(self._load(session_id))
                require_whole(read)
                return self.open(session_id)
            except BaseException:
                if (live := self._open.pop(session_id, None)) is not None:
                    live.close()
                remove_session(folder)
                raise

    def export_bundle(self, session_id: str) -> bytes:
        """A session as a zip, the same bytes for the same session. Raises NotFound, Conflict where it is not whole."""
        with self._guard:
            live = self.get(session_id) if session_id == "current" else self._open.get(session_id)
        return live.export_bundle() if live is not None else whole_zip(read_session(self._existing(session_id)))

    def close(self) -> None:
        """Close every session, then the workers."""
        with self._guard:
            sessions, self._open, self._current = self._open, {}, None
        for live in sessions.values():
            live.close()
        self.jobs.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, err: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _hold(self, live: LiveSession) -> LiveSession:
        self._open[live.id] = live
        # first it takes the stops, then it hears of those that were: none falls between
        before, self._current = self._current, live
        if before is live:
            return live
        # both are marked until the stop of the one is that of the other: an end in between loses none
        marked = mark_held(self.folder / live.id)
        if before is not None:
            before.rover.superseded(live.id)
            if before.commands.gate["stopped"]:
                _stay_stopped(live, before.id, before.state.stop.reason)
            if marked:
                unmark_held(self.folder / before.id)
        left, self._left_behind = self._left_behind, ()
        for name in left:
            if name != live.id:
                stop = stop_left_in(self.folder / name)
                if stop.latched:
                    _stay_stopped(live, name, stop.reason)
                if marked:
                    unmark_left(self.folder / name)
        return live

    def _opened(self, session_id: str) -> LiveSession | None:
        """One that is open is there at once, whatever is carried in meanwhile."""
        if session_id == "current":
            if self._current is None:
                raise NotFound("no session is open; make one or open a sample")
            return self._current
        live = self._open.get(session_id)
        if live is not None:
            self._asked_for[session_id] = time.monotonic()
        return live

    def _close_idle(self) -> None:
        """Each open session takes memory, threads and files; a thousand would take them all."""
        idle = [live for live in self._open.values() if live is not self._current and live.idle]
        idle.sort(key=lambda live: self._asked_for.get(live.id, 0.0))
        for live in idle[:-MOST_IDLE]:
            del self._open[live.id]
            self._asked_for.pop(live.id, None)
            live.close()

    def _load(self, session_id: str) -> LiveSession:
        if session_id not in self._open:
            folder = self._existing(session_id)
            self._close_idle()
            store = SessionStore(folder)
            try:
                self._open[session_id] = LiveSession(store, self.jobs, self._recording, self.light_time)
            except BaseException:
                store.close()
                raise
            self._asked_for[session_id] = time.monotonic()
        return self._open[session_id]

    def _require_may_switch(self) -> None:
        current, who = self._current, actor()
        if current is None:
            return
        if current.commands.gate["run"] is not None:
            raise Conflict(
                "commands are on their way to the rover; wait until they are done, or stop it, "
                "before another session takes it over",
                session=current.id,
            )
        if who is not None:
            current.commands.require_may_leave(who)

    def _existing(self, session_id: str) -> Path:
        path = self.folder / session_id
        if not _ID.fullmatch(session_id) or not is_session_folder(path):
            raise NotFound(f"there is no session {session_id!r}", session=session_id)
        return path

    def _new_id(self) -> str:
        while True:
            session_id = f"{time.strftime('%Y%m%d-%H%M%S', time.gmtime())}-{secrets.token_hex(2)}"
            if not (self.folder / session_id).exists():
                return session_id

    def _about(self, session_id: str, found: Listed | str) -> SessionListed:
        about: SessionListed = {
            "id": session_id,
            "name": session_id,
            "created": None,
            "robot": None,
            "events": None,
            "latest": None,
            "open": session_id in self._open,
        }
        if isinstance(found, str):
            return {**about, "problem": f"it can't be read: {found}"}
        try:
            return {
                **about,
                "name": str((found.renamed or found.about)["name"]),
                "created": float(found.about["created"]),
                "robot": found.about["robot"]["name"],
                "events": found.events,
                "latest": found.latest,
            }
        except (ValueError, KeyError, TypeError) as err:
            return {**about, "problem": f"it can't be read: {err!r}"}


def _require_sense(live: LiveSession) -> None:
    """Raises InvalidBundle unless the session can be shown, and its rover commanded: later nobody could mend it."""
    if live.rover.epoch > time.time() + EPOCHS_AHEAD:
        raise InvalidBundle(
            f"the session's epoch is {live.rover.epoch}, which no rover would believe", epoch=live.rover.epoch
        )
    try:
        live.summary()
    except (FootFallError, LookupError, TypeError, ValueError, AttributeError, OverflowError, StopIteration) as err:
        reason = err.message if isinstance(err, FootFallError) else repr(err)
        raise InvalidBundle(f"the session's events and artifacts do not fit together: {reason}") from err


def _stay_stopped(live: LiveSession, before: str, reason: str) -> None:
    """The rover is the same, so is its stop: clearing it is an act of its own."""
    if not live.commands.gate["stopped"]:
        live.commands.stop(
            f"still in force from session {before}" + (f": {reason}" if reason else ""), actor() or LOCAL
        )
