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

import time
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import CommandRefused, Conflict, InvalidInput, NotFound
from footfall.core.value import Value
from footfall.planning.step.problem import Footfall, PlanResult, StepSettings
from footfall.sequence.commands import Sequence
from footfall.session.commanding import Commanding
from footfall.session.fold import SessionState
from footfall.session.footing import FootingSession
from footfall.session.gate import (
    POSE_TOLERANCE,
    STALE_AFTER,
    START_TOLERANCE,
    Facts,
    Gate,
    pose_difference,
    worst_joint,
)
from footfall.session.job import Job
from footfall.session.jobs import InlineJobs, Jobs
from footfall.session.link import RoverLink, Send
from footfall.session.recorded import ViewState, present
from footfall.session.remembered import on_map
from footfall.session.requests import ExportRequest, StepRequest
from footfall.session.store import SessionStore
from footfall.session.summary import summary
from footfall.session.terrains import SHORT_JOB
from footfall.telemetry.images import Snapshot
from footfall.telemetry.link import ImageRequestMessage, encode
from footfall.telemetry.state import RobotState, TelemetryFrame
from footfall.terrain.dem import Dem

_V = TypeVar("_V", bound=Value)

STILL_TOLERANCE = 1e-4
"""A rover whose joints [rad] and chassis [m] differ by less has not moved."""


class LiveSession(FootingSession):
    """A session with its rover, products and commands; see the module's docstring. Made by
    :class:`footfall.session.registry.Sessions`; thread-safe as
    :class:`footfall.session.recorded.RecordedSession` says.
    """

    def __init__(self, store: SessionStore, jobs: Jobs | InlineJobs) -> None:
        super().__init__(store, jobs)
        self._requests = 0
        self.link = RoverLink()
        stop = self.state.stop
        gate = Gate(stopped=stop.latched, acknowledged=stop.acknowledged, runs=self.state.runs)
        self._commanding = Commanding(gate, self.link, self._journal.record, self._journal.record_anyway)

    def summary(self) -> dict[str, Any]:
        """The session as plain JSON, for a page that opens."""
        with self._journal.lock:
            return summary(self)

    @property
    def gate(self) -> dict[str, Any]:
        """The command gate, as plain JSON."""
        return self._commanding.gate.as_dict()

    def close(self) -> None:
        """Cancel its jobs, end its run, seal its log; harmless when done twice."""
        self._workshop.close()
        self._commanding.close()
        super().close()

    # -- the rover -----------------------------------------------------------------------------

    @property
    def frame(self) -> TelemetryFrame | None:
        """The latest telemetry frame."""
        return self.link.frame

    @property
    def telemetry_age(self) -> float | None:
        """Seconds since it came."""
        return self.link.age

    def rover_connected(self, send: Send) -> None:
        """A rover is on the link. ``send``: hands it a text frame; thread-safe, does not block."""
        self.link.connect(send)
        # a stop in force goes first: the log may be slow
        self._commanding.connected()
        self._journal.record_anyway("link_connected", {})
        self._journal.tell("link", link=self.link.as_dict())

    def rover_disconnected(self, send: Send | None = None) -> None:
        """The rover is gone. With ``send``: only if that is the one in use."""
        if self.link.disconnect(send):
            self._commanding.lost("the rover disconnected")
            self._journal.record_anyway("link_lost", {})
            self._journal.tell("link", link=self.link.as_dict())

    def take_telemetry(self, frame: TelemetryFrame, at: float | None = None) -> None:
        """``at``: when it came, time.monotonic() [s]. Raises InvalidTelemetry where the frame is of another robot."""
        self._require_robot(frame.state)
        if self.link.take(frame, at):
            self._journal.tell("telemetry", frame=frame, age=self.link.age)

    def take_images(self, snapshot: Snapshot) -> str:
        """Keep a snapshot; its state becomes the planning state. Returns its digest."""
        self._require_robot(snapshot.state)
        # packing nine pairs takes long; telemetry and acknowledgements must not wait for it
        digest, state = self.put(snapshot), self.put(snapshot.state)
        payload = {"digest": digest, "state": state, "pairs": [pair.name for pair in snapshot.pairs]}
        if snapshot.left_out:
            payload["left_out"] = dict(snapshot.left_out)
        self._journal.record("snapshot_taken", payload)
        return digest

    def take_complaint(self, text: str, *, message_id: str = "", about_rover: bool = False) -> None:
        """The rover could not use a message (or, ``about_rover``, the server one of its): the operator is told.

        The same text again is counted, not logged again.
        """
        if self.link.complain(text):
            payload = {"id": message_id, "reason": text, "source": "server" if about_rover else "rover"}
            self._journal.record_anyway("link_fault", payload)
        self._journal.tell("link", link=self.link.as_dict())

    def take_acknowledgement(self, command_id: str, state: str, reason: str = "") -> None:
        """The rover "received", "started", has "done" or "refused" a command. Unknown ids change nothing."""
        if any(command.id == command_id for command in self.state.commands):
            self._commanding.heard(command_id, state, reason)

    def take_stop_acknowledgement(self, stop_id: str | None = None) -> None:
        """The rover stands still because of the stop ``stop_id`` (None: the latest)."""
        self._commanding.stop_acknowledged(stop_id)

    def superseded(self, by: str) -> None:
        """Tell whoever listens that session ``by`` holds the rover from now on."""
        self._journal.tell("session", session={"current": by})

    def snapshot_state(self) -> str:
        """Freeze the rover's present state for planning; the frozen one is kept while the rover still stands so.

        Raises Conflict where there is no telemetry.
        """
        frame = self.frame
        if frame is None:
            raise Conflict("the rover has sent no telemetry yet, so there is no state to plan from")
        frozen, dem = self.state.state, self.state.dem
        now = on_map(frame.state, None if dem is None else self._shelf.typed(Dem, dem))
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

    def plan_matches_rover(self) -> dict[str, Any]:
        """Whether the rover stands where the sequence (or the plan) starts; ok is None where that can't be told."""
        state, frame = self.state, self.frame
        start, age = self._start_of(state), self.link.age
        unknown = ""
        if start is None:
            unknown = "there is no plan yet"
        elif frame is None or age is None:
            unknown = "the rover has sent no telemetry yet"
        elif not self.link.connected:
            unknown = "the rover is not connected"
        elif age > STALE_AFTER:
            unknown = f"the latest telemetry is {age:.1f} s old"
        if unknown or start is None or frame is None:
            return {"ok": None, "joint": None, "difference": None, "reason": unknown}
        posture, T_site_base = start
        joint, difference = worst_joint(posture, frame.state, self.description.joint_names)
        moved = pose_difference(T_site_base, frame.state.T_site_base)
        if abs(difference) > START_TOLERANCE:
            reason = f"{joint} is {difference:+.4f} rad from where the plan starts"
        elif moved > POSE_TOLERANCE:
            reason = f"the chassis has moved by {moved:.3f} m since the plan was made"
        else:
            return {"ok": True, "joint": joint, "difference": difference, "reason": ""}
        return {"ok": False, "joint": joint, "difference": difference, "reason": reason}

    # -- products ------------------------------------------------------------------------------

    def plan_step(
        self, leg: int | None = None, target: tuple[float, float] | None = None, settings: StepSettings | None = None
    ) -> Job:
        """Plan a step to ``target`` (x, y) [m]; without one, to the chosen footfall. Raises Conflict, InvalidInput."""
        chosen = self.state.footfall
        if target is not None and leg is not None:
            chosen = Footfall(leg, float(target[0]), float(target[1]))
        elif target is not None:
            raise InvalidInput("a target needs the leg that is to step there")
        elif chosen is None or (leg is not None and chosen.leg != leg):
            raise Conflict("no footfall is chosen for this leg; choose one, or give a target")
        self._require_leg(chosen.leg)
        request = StepRequest(chosen, settings or StepSettings())
        return self._workshop.submit("plan", self._ground(), request, leg=chosen.leg)

    def make_sequence(self, plan_digest: str | None = None) -> str:
        """Commands of a plan (None: the present one); returns the digest. Raises Conflict, InvalidInput."""
        plan = plan_digest or present(self.state.plan, "there is no plan yet")
        made = self.state.products.get(plan)
        if made is None or made.kind != "plan":
            raise NotFound(f"the session holds no plan {plan}", digest=plan)
        parents = {"robot": self.robot_digest, "plan": plan, "dem": made.parents["dem"]}
        return self._workshop.submit("sequence", parents, None, urgent=True).finish(SHORT_JOB)

    def edit_sequence(self, digest: str, edit: Value) -> str:
        """Apply an Edit to the present sequence, which ``digest`` must name. Raises Conflict, InvalidSequence."""
        if digest != self.state.sequence:
            raise Conflict("the sequence has changed since you read it", yours=digest, present=self.state.sequence)
        parents = {
            "robot": self.robot_digest,
            "sequence": digest,
            "dem": present(self._planned_on(digest), "the sequence goes back to no plan"),
        }
        return self._workshop.submit("edit", parents, edit, urgent=True).finish(SHORT_JOB)

    def undo_sequence(self) -> str:
        """Go back to before the latest edit; returns that digest. Raises Conflict where there is none."""
        with self._journal.lock:
            if not self.state.sequence_history:
                raise Conflict("there is no edit to undo")
            digest = self.state.sequence_history[-1]
            self._journal.record("sequence_undone", {"digest": digest})
        return digest

    def export_sequence(self, digest: str | None = None, format: str = "seqjson") -> bytes:
        """A sequence (None: the present one) as a file. Raises InvalidSequence where a rule does not hold."""
        parents = {"sequence": self._sequence(digest)}
        job = self._workshop.submit("export", parents, ExportRequest(format), format=format, urgent=True)
        return self.get_bytes(job.finish(SHORT_JOB))

    # -- commands ------------------------------------------------------------------------------

    def arm(self, sequence_digest: str | None = None) -> dict[str, Any]:
        """Check that a sequence may be sent now; the token of the answer sends it once, for a short time.

        Raises CommandRefused; its details name the check that failed and by how much.
        """
        digest = self._sequence(sequence_digest)
        sequence = self._shelf.typed(Sequence, digest)
        return self._commanding.arm(digest, sequence, self._facts(digest), self.description.joint_names)

    def send(self, token: str, expected: str | None = None) -> dict[str, Any]:
        """Begin to send the armed sequence; everything is checked again. Raises CommandRefused.

        expected: digest of the sequence that the sender means; where another one was armed, nothing is sent.
        """
        digest = self._commanding.gate.armed_sequence(token)
        if expected is not None and expected != digest:
            raise CommandRefused(
                "the token was armed for another version of the sequence; arm this one",
                check="arming",
                armed=digest,
                asked=expected,
            )
        sequence = self._shelf.typed(Sequence, digest)
        return self._commanding.send(token, sequence, self._facts(digest), self.description.joint_names)

    def stop(self, reason: str = "") -> dict[str, Any]:
        """Stop the rover, now; stays in force until cleared. Works without rover, disk or free lock."""
        self._commanding.stop(reason, time.time())
        return self.gate

    def clear_stop(self) -> dict[str, Any]:
        """Raises Conflict while a connected rover has not acknowledged the stop."""
        self._commanding.clear_stop()
        return self.gate

    # -- inside --------------------------------------------------------------------------------

    def _ground(self) -> dict[str, str]:
        if self.state.state is None and self.state.dem is not None:
            self.snapshot_state()
        return super()._ground()

    def _start_of(self, state: SessionState) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Posture and T_site_base that the present sequence, or else the present plan, starts from."""
        if state.sequence is not None:
            sequence = self._shelf.typed(Sequence, state.sequence)
            return sequence.start, sequence.T_site_base
        plan = None if state.plan is None else self._shelf.typed(PlanResult, state.plan).plan
        return None if plan is None else (plan.waypoints[0], plan.T_site_base)

    def _facts(self, sequence: str) -> Facts:
        return Facts(self.link.connected, self.frame, self.link.age, self.state.dem, self._planned_on(sequence))

    def _planned_on(self, sequence: str) -> str | None:
        """Digest of the terrain that the plan behind a sequence was made on."""
        behind = self.state.plan_behind(sequence)
        return None if behind is None else behind.parents["dem"]

    def _sequence(self, digest: str | None) -> str:
        return digest or present(self.state.sequence, "there is no sequence yet; make one from a plan")


__all__ = ["LiveSession", "ViewState"]


def stands_alike(one: RobotState, other: RobotState) -> bool:
    """Whether two states differ by no more than encoder noise; clock, forces and torques don't count."""
    if one.robot != other.robot or one.mode != other.mode or one.posture.shape != other.posture.shape:
        return False
    turned = float(np.abs(one.posture - other.posture).max())
    return max(turned, pose_difference(one.T_site_base, other.T_site_base)) <= STILL_TOLERANCE
