"""One open session: the thread-safe owner of its log, state, store, jobs and gate.

A script without a server works the same way, with jobs run inline::

    with Sessions(folder, jobs=InlineJobs()) as sessions:
        session = sessions.create("rock step")
        session.load_terrain(dem)
        session.set_state(state)
        session.compute_maps(leg=2).finish()
        session.choose_footfall(2, x, y)
        plan = session.plan_step(leg=2).finish()
        session.export_sequence(session.make_sequence(plan), "csv")
"""

from contextlib import suppress
from typing import Any, TypeVar

import numpy as np

from footfall.core.errors import Conflict, FootFallError, InvalidInput, NotFound
from footfall.core.frames import pose_difference
from footfall.core.value import Value
from footfall.planning.execution.settings import ExecutionSettings
from footfall.planning.walk.problem import WalkGoal
from footfall.session.access.acting import told
from footfall.session.access.identity import LOCAL, Identity
from footfall.session.gate.checks import STALE_AFTER
from footfall.session.jobs.requests import ExportRequest, ImportRequest
from footfall.session.loop_settings import LoopSettings
from footfall.session.products.kinds import COMMANDED, EDIT, EXPORT, IMPORT, SEQUENCE
from footfall.session.products.terrains import SHORT_JOB
from footfall.session.products.up_to_date import unfit_of
from footfall.session.recorded import present
from footfall.session.summary import summary
from footfall.session.walk_loop import WalkLoop
from footfall.session.walking import WalkingSession
from footfall.telemetry.link import ImageRequestMessage, encode
from footfall.telemetry.state import RobotState, TelemetryFrame

_V = TypeVar("_V", bound=Value)

STILL_TOLERANCE = 1e-4
"""A rover whose joints [rad] and chassis [m] differ by less has not moved."""


class LiveSession(WalkingSession):
    """A session with its rover, products and commands; see the module's docstring. Made by
    :class:`footfall.session.registry.Sessions`; thread-safe as
    :class:`footfall.session.recorded.RecordedSession` says.
    """

    _unfit: frozenset[str] = frozenset()
    """What listeners were told that is not of how things are now."""
    _walk_loop: WalkLoop | None = None

    def summary(self) -> dict[str, Any]:
        """The session as plain JSON, for a page that opens."""
        with self._journal.lock:
            return {**summary(self), "walk_loop": None if self._walk_loop is None else self._walk_loop.as_dict()}

    @property
    def idle(self) -> bool:
        """Whether nobody hears it or holds its conn, nothing is under way, and all of it is written."""
        busy = self._journal.listened_to or self.recorder.listened_to or self.link.connected or self.unrecorded
        busy = busy or self.gate["run"] is not None or self.conn["holder"] is not None
        return not busy and all(job.ended for job in self.jobs)

    def close(self) -> None:
        """End its walk, cancel its jobs, end its run, seal its log; harmless when done twice."""
        if self._walk_loop is not None:
            # it may wait for a job
            self._walk_loop.leave()
        self._workshop.close()
        if self._walk_loop is not None:
            self._walk_loop.close()
        self.link.close()
        self._commanding.close()
        self.recorder.close()
        super().close()

    # -- the rover -----------------------------------------------------------------------------

    def snapshot_state(self) -> str:
        """Freeze the rover's present state for planning; the frozen one is kept while the rover still stands so.

        Raises Conflict where there is no telemetry.
        """
        frame = self.frame
        if frame is None:
            raise Conflict("the rover has sent no telemetry yet, so there is no state to plan from")
        frozen, now = self.state.state, self.place_on_map(frame.state).state
        if frozen is not None and stands_alike(self._shelf.typed(RobotState, frozen), now):
            return frozen
        return self.set_state(now)

    def set_state(self, state: RobotState) -> str:
        """Plan from ``state`` from now on. Returns its digest."""
        self._require_robot(state)
        with self._journal.lock:
            digest = self.put(state)
            if digest != self.state.state:
                self._journal.record("state_frozen", {"digest": digest})
        return digest

    def _telemetry_arrived(self, frame: TelemetryFrame, at: float, light: float, by_request: bool) -> None:
        super()._telemetry_arrived(frame, at, light, by_request)
        with suppress(FootFallError, OSError), self._journal.lock:
            if (made_so := self.stands_in_what_if()) is not None:
                payload = {"digest": self.put(made_so), "made_so": self.state.runs}
                self._journal.record_anyway("state_frozen", payload)
            fits = self.up_to_date()
            unfit = unfit_of(fits)
            if unfit != self._unfit:
                self._unfit = unfit
                self._journal.tell("fits", fits=fits)

    def request_images(self, pairs: tuple[str, ...] | list[str] | None = None) -> None:
        """Ask the rover for images of the named camera pairs (None: all). Raises Conflict, NotFound."""
        known = [camera.name for camera in self.description.cameras]
        for name in pairs or ():
            if name not in known:
                raise NotFound(f"there is no camera pair {name!r}; there are {', '.join(known)}", pair=name)
        with self._journal.lock:
            self._requests += 1
            request = ImageRequestMessage(f"images-{self._requests}", None if pairs is None else tuple(pairs))
        self.link.send(encode(request))

    # -- walking to a goal ---------------------------------------------------------------------

    def walk_to(self, goal: WalkGoal, settings: LoopSettings | None = None, who: Identity = LOCAL) -> WalkLoop:
        """Begin to walk to a goal in a closed loop, by images and telemetry, as ``who``; see :class:`WalkLoop`.

        Raises Conflict where the rover is on such a walk already, or there is no rover.
        """
        with self._journal.lock:
            if self._walk_loop is not None and self._walk_loop.state != "ended":
                raise Conflict("the rover is on its way to a goal already: end that walk first")
            if not self.link.connected:
                raise Conflict("no rover is connected")
            self._walk_loop = WalkLoop(self, goal, settings or LoopSettings(), who)
            return self._walk_loop

    @property
    def walk_loop(self) -> WalkLoop | None:
        """The latest walk to a goal in a closed loop, over or not."""
        return self._walk_loop

    def record_decision(self, act: str, reason: str) -> None:
        """Write down what a walk in a closed loop does next, and why."""
        self._journal.record_anyway("walk_decided", {**told(), "act": act, "reason": reason})

    # -- products ------------------------------------------------------------------------------

    def make_sequence(
        self, plan_digest: str | None = None, settings: ExecutionSettings | None = None, *, as_commanded: bool = False
    ) -> str:
        """Commands of a planned step, its execution, a move of the chassis or a walk (None: the present step's).

        Returns their digest. A step is commanded as ``settings`` say (None: with the pose held), and a move of the
        chassis with the pose held, sag predicted, where that is known: see :meth:`way_of_commands`. as_commanded: as it
        was planned, whether or not the rover sags; where it ends is then not predicted. Raises Conflict,
        InvalidInput, NotFound.
        """
        plan = plan_digest or present(self.state.plan, "there is no plan yet")
        made, kind = self.state.products.get(plan), self.state.kind_of(plan)
        if made is None or kind is None or kind.given_as not in COMMANDED:
            raise NotFound(f"the session holds no plan {plan}", digest=plan)
        if as_commanded and settings is not None:
            raise InvalidInput(
                "commands as planned predict no sag, so they take no settings of it: leave out one of them"
            )
        for_sag = kind.executed_by and not as_commanded and self.way_of_commands().mode != "rigid"
        if for_sag and getattr(self._shelf.get(plan), "plan", None) is not None:
            return self.make_sequence(self.executed(plan, settings))
        parents = {"robot": self.robot_digest, kind.given_as: plan, "dem": made.parents["dem"]}
        return self._workshop.submit(SEQUENCE, parents, None, urgent=True).finish(SHORT_JOB)

    def edit_sequence(self, digest: str, edit: Value) -> str:
        """Apply an Edit to the present sequence, which ``digest`` must name. Raises Conflict, InvalidSequence."""
        if digest != self.state.sequence:
            raise Conflict("the sequence has changed since you read it", yours=digest, present=self.state.sequence)
        parents = {
            "robot": self.robot_digest,
            "sequence": digest,
            "dem": present(self._planned_on(digest), "the sequence goes back to no plan"),
        }
        return self._workshop.submit(EDIT, parents, edit, urgent=True).finish(SHORT_JOB)

    def import_sequence(self, name: str, content: bytes) -> str:
        """Commands from a file become the present sequence, every rule checked anew; returns the digest.

        name: of the file; its ending says the format. A file that doesn't say from where its commands start is taken
        to start where the rover stands, and the state is then a parent of the sequence. Raises Conflict without
        terrain and state, InvalidSequence, naming the place, where the file can't be used.
        """
        request = ImportRequest(name, np.frombuffer(content, np.uint8))
        return self.ask(IMPORT, request, urgent=True).finish(SHORT_JOB)

    def undo_sequence(self) -> str:
        """Go back to before the latest edit; returns that digest. Raises Conflict where there is none."""
        with self._journal.lock:
            if not self.state.sequence_history:
                raise Conflict("there is no edit to undo")
            digest = self.state.sequence_history[-1]
            self._journal.record("sequence_undone", {"digest": digest})
        return digest

    def redo_sequence(self) -> str:
        """Make the edit again that was undone last; returns the digest. Raises Conflict where there is none."""
        with self._journal.lock:
            if not self.state.sequence_ahead:
                raise Conflict("there is no undone edit to make again")
            digest = self.state.sequence_ahead[-1]
            self._journal.record("sequence_redone", {"digest": digest})
        return digest

    def export_sequence(self, digest: str | None = None, format: str = "seqjson") -> bytes:
        """A sequence (None: the present one) as a file. Raises InvalidSequence where a rule does not hold."""
        parents = {"sequence": self._sequence(digest)}
        job = self._workshop.submit(EXPORT, parents, ExportRequest(format), format=format, urgent=True)
        return self.get_bytes(job.finish(SHORT_JOB))

    # -- inside --------------------------------------------------------------------------------

    def _ground(self) -> dict[str, str]:
        if self.state.state is None and self.state.dem is not None:
            self.snapshot_state()
        return super()._ground()

    def _standing_now(self, oldest: float = STALE_AFTER) -> dict[str, str]:
        if self.link.connected and (self.link.age or 0.0) <= oldest and self.moved_since_frozen():
            self.snapshot_state()
        return super()._standing_now(oldest)


def stands_alike(one: RobotState, other: RobotState) -> bool:
    """Whether two states differ by no more than encoder noise; clock, forces and torques don't count."""
    if one.robot != other.robot or one.mode != other.mode or one.posture.shape != other.posture.shape:
        return False
    turned = float(np.abs(one.posture - other.posture).max())
    return max(turned, pose_difference(one.T_site_base, other.T_site_base)) <= STILL_TOLERANCE
