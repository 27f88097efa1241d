"""The command gate: the one way to the rover, and the stop that closes it.

::

    idle ──arm──▶ armed ──send──▶ sending ──last row done──▶ idle
      ▲             │                │
      └── expired ──┴── refused row, lost link, overdue row, stop

Beside that stands the latch of the stop: while it is set nothing is armed, begun or released. The gate does
no input or output and its lock is held for moments only, so a stop never waits for a disk or a listener.
"""

import secrets
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from footfall.core.errors import CommandRefused
from footfall.sequence.commands import Command, Sequence
from footfall.telemetry.state import RobotState, TelemetryFrame

ARMED_FOR = 10.0
"""An arming that is not used expires after this [s]."""
STALE_AFTER = 2.0
"""Telemetry older than this is no ground to act on [s]."""
START_TOLERANCE = 0.01
"""Largest difference of any joint between the rover and the start of a sequence [rad]."""
POSE_TOLERANCE = 0.05
"""Largest distance of any point one metre from the chassis' origin from where the sequence has it [m]."""
RECEIVED_WITHIN = 3.0
"""A command that the rover has not acknowledged after this ends the run [s]."""
DONE_FACTOR, DONE_EXTRA = 3.0, 30.0
"""A command that takes longer than factor × duration + extra [s] ends the run."""


@dataclass(frozen=True)
class Facts:
    """What the gate judges by. dem: digest of the present terrain; planned_on: of the sequence's terrain."""

    connected: bool
    frame: TelemetryFrame | None
    age: float | None
    dem: str | None
    planned_on: str | None


@dataclass(frozen=True)
class Run:
    """A sequence on its way to the rover. row: the one that was sent last, −1 before the first."""

    number: int
    digest: str
    sequence: Sequence
    row: int = -1

    @property
    def command(self) -> Command:
        return self.sequence.commands[self.row]

    @property
    def command_id(self) -> str:
        """Unique for ever: a sequence's content, how often it was sent, which row."""
        return f"{self.digest[:12]}-{self.number}-{self.row}"


def require_fit(sequence: Sequence, facts: Facts, joint_names: tuple[str, ...]) -> None:
    """Raises CommandRefused, naming the check, unless ``sequence`` may be sent in the present situation."""
    for failure in sequence.failures[:1]:
        row = "the sequence" if failure.row < 0 else f"row {failure.row}"
        _refuse("rules", f"{row} breaks {failure.rule}: {failure.text}", row=failure.row, rule=failure.rule)
    if not sequence.commands:
        _refuse("rules", "the sequence has no commands")
    if not facts.connected:
        _refuse("link", "no rover is connected")
    if facts.frame is None or facts.age is None:
        _refuse("telemetry", "the rover has sent no telemetry yet")
    if facts.age > STALE_AFTER:
        _refuse(
            "telemetry",
            f"the latest telemetry is {facts.age:.1f} s old; at most {STALE_AFTER:g} s are accepted",
            age=facts.age,
            limit=STALE_AFTER,
        )
    state = facts.frame.state
    if state.robot != sequence.robot:
        _refuse("robot", f"the sequence is for {sequence.robot}, the rover is {state.robot}")
    if state.mode != "idle":
        _refuse("mode", f"the rover is {state.mode}; it must be idle", mode=state.mode)
    if facts.planned_on is None or facts.planned_on != facts.dem:
        _refuse(
            "terrain",
            "the terrain has changed since the sequence was planned; plan the step again",
            planned_on=facts.planned_on,
            present=facts.dem,
        )
    joint, difference = worst_joint(sequence.start, state, joint_names)
    if not abs(difference) <= START_TOLERANCE:
        _refuse(
            "start",
            f"{joint} of the rover is {difference:+.4f} rad from where the sequence starts; "
            f"at most {START_TOLERANCE:g} rad are accepted",
            joint=joint,
            difference=difference,
            limit=START_TOLERANCE,
        )
    moved = pose_difference(sequence.T_site_base, state.T_site_base)
    if not moved <= POSE_TOLERANCE:
        _refuse(
            "pose",
            f"the chassis has moved by {moved:.3f} m since the sequence was planned; "
            f"at most {POSE_TOLERANCE:g} m are accepted",
            difference=moved,
            limit=POSE_TOLERANCE,
        )


def worst_joint(start: np.ndarray, state: RobotState, joint_names: tuple[str, ...]) -> tuple[str, float]:
    """The joint that is farthest from ``start`` (legs × 6,), and by how much (measured − start) [rad]."""
    if start.shape != state.posture.shape:
        return "the number of joints", float("inf")
    difference = state.posture - start
    i = int(np.argmax(np.abs(difference)))
    return joint_names[i], float(difference[i])


def pose_difference(T_site_base: np.ndarray, T_site_measured: np.ndarray) -> float:
    """Bound on how far any point within 1 m of the chassis' origin has moved [m]."""
    shift = float(np.linalg.norm(T_site_base[:3, 3] - T_site_measured[:3, 3]))
    return shift + float(np.linalg.norm(T_site_base[:3, :3] - T_site_measured[:3, :3], 2))


def _refuse(check: str, message: str, **details: Any) -> NoReturn:
    raise CommandRefused(message, check=check, **details)


class Gate:
    """The state machine of the module's docstring. Thread-safe.

    runs: number of the latest run that the session knows; run numbers go on from there.
    """

    def __init__(
        self,
        *,
        stopped: bool = False,
        acknowledged: bool = False,
        runs: int = 0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._clock = clock
        self._guard = threading.Lock()
        self._stopped, self._stop_acknowledged = stopped, acknowledged
        # ids of another process must not look like ours: its acknowledgements may still be on their way
        self._stop_prefix, self._stops, self._cleared_stops = f"stop-{secrets.token_hex(4)}", 0, 0
        self._runs = runs
        self._armed: tuple[str, str, float] | None = None  # token, sequence digest, expires at
        self._run: Run | None = None
        self._received = False
        self._released_at: float | None = None

    def arm(self, digest: str) -> str:
        """Arm a sequence that :func:`require_fit` has passed; the token that sends it, once, within ARMED_FOR.

        A newer arming replaces an older one. Raises CommandRefused while stopped or sending.
        """
        with self._guard:
            self._require_open()
            token = secrets.token_hex(16)
            self._armed = (token, digest, self._clock() + ARMED_FOR)
            return token

    def armed_sequence(self, token: str) -> str:
        """Digest of the sequence that ``token`` sends. Raises CommandRefused."""
        with self._guard:
            return self._require_armed(token)

    def begin(self, token: str, sequence: Sequence) -> Run:
        """Use up a token and begin a run; nothing is released yet. Raises CommandRefused."""
        with self._guard:
            self._require_open()
            digest = self._require_armed(token)
            self._armed = None
            self._runs += 1
            self._run = Run(self._runs, digest, sequence)
            self._released_at = None
            return self._run

    def advance(self, number: int) -> Run | None:
        """Turn to the next row of run ``number``: the run at that row; None where it has ended.

        After its last row the run is over: ask :meth:`finish`.
        """
        with self._guard:
            run = self._run
            if run is None or run.number != number or run.row + 1 >= len(run.sequence.commands):
                return None
            self._run = Run(run.number, run.digest, run.sequence, run.row + 1)
            self._received, self._released_at = False, None
            return self._run

    def release(self, run: Run, transmit: Callable[[], None]) -> bool:
        """Let the row of ``run`` go to the rover, unless a stop or an end came first. Whether it went.

        ``transmit`` is called with the lock held, so that a stop is either before it or after it on the wire.
        """
        with self._guard:
            if self._stopped or self._run is not run or self._released_at is not None:
                return False
            self._released_at = self._clock()
            transmit()
            return True

    def heard(self, command_id: str, state: str) -> Run | None:
        """The rover said ``state`` of a command: the present run if the command is its row, else None."""
        with self._guard:
            run = self._run
            if run is None or run.row < 0 or run.command_id != command_id or self._released_at is None:
                return None
            self._received = True
            return run

    def end(self, number: int | None = None) -> Run | None:
        """End the present run (``number``: only that one); the run as it was, or None."""
        with self._guard:
            run = self._run
            if run is None or (number is not None and run.number != number):
                return None
            self._run = None
            return run

    def overdue(self) -> str | None:
        """Why the present row takes too long, or None."""
        with self._guard:
            if self._run is None or self._released_at is None:
                return None
            waited = self._clock() - self._released_at
            if not self._received and waited > RECEIVED_WITHIN:
                return f"the rover did not acknowledge row {self._run.row} within {RECEIVED_WITHIN:g} s"
            longest = DONE_FACTOR * self._run.command.duration + DONE_EXTRA
            if waited > longest:
                return f"row {self._run.row} was not done within {longest:.0f} s"
            return None

    def latch(self) -> tuple[bool, Run | None]:
        """Set the stop: whether it was not set before, and the run that it ended."""
        with self._guard:
            first = not self._stopped
            self._stops += 1
            run, self._run, self._armed = self._run, None, None
            if first:
                self._stop_acknowledged = False
            self._stopped = True
            return first, run

    @property
    def stop_id(self) -> str:
        """Name of the latest stop, for the message that tells the rover."""
        return f"{self._stop_prefix}-{self._stops}"

    def stops(self) -> int:
        """How often a stop was asked for; see :meth:`unlatch`."""
        return self._stops

    def rover_changed(self) -> bool:
        """A rover has come to the link, which has acknowledged no stop yet. Whether a stop is in force."""
        with self._guard:
            self._stop_acknowledged = False
            return self._stopped

    def stop_acknowledged(self, stop_id: str | None = None) -> bool:
        """The rover stands: whether that is news. ``stop_id``: of which stop; one that was cleared since is none."""
        with self._guard:
            current = [f"{self._stop_prefix}-{n}" for n in range(self._cleared_stops, self._stops + 1)]
            if stop_id is not None and stop_id not in current:
                return False
            news = self._stopped and not self._stop_acknowledged
            self._stop_acknowledged = self._stopped
            return news

    def unlatch(self, stops: int | None = None, transmit: Callable[[], None] = lambda: None) -> bool:
        """Clear the stop, unless there were more than ``stops`` stops by now. Whether it was cleared.

        ``transmit`` is called with the lock held: a later stop comes later on the wire too, and wins.
        """
        with self._guard:
            if stops is not None and self._stops != stops:
                return False
            self._stopped = self._stop_acknowledged = False
            self._cleared_stops = self._stops + 1
            transmit()
            return True

    @property
    def stopped(self) -> bool:
        return self._stopped

    @property
    def acknowledged(self) -> bool:
        """Whether the rover has acknowledged the stop that is latched."""
        return self._stop_acknowledged

    @property
    def run(self) -> Run | None:
        """The run that is being sent."""
        return self._run

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON for the interface."""
        with self._guard:
            left = None if self._armed is None else self._armed[2] - self._clock()
            armed = left is not None and left > 0
            return {
                "state": "sending" if self._run else "armed" if armed else "idle",
                "stopped": self._stopped,
                "stop_acknowledged": self._stop_acknowledged,
                "run": self._run.number if self._run else None,
                "row": self._run.row if self._run else None,
                "sequence": self._run.digest if self._run else self._armed[1] if self._armed and armed else None,
                "expires_in": left if armed else None,
            }

    def _require_open(self) -> None:
        if self._stopped:
            _refuse("stop", "a stop is in force; clear it first")
        if self._run is not None:
            _refuse("busy", f"run {self._run.number} is still being sent", run=self._run.number)

    def _require_armed(self, token: str) -> str:
        if self._armed is None or not secrets.compare_digest(self._armed[0].encode(), token.encode()):
            _refuse("arming", "nothing is armed with this token; a token sends once")
        if self._clock() > self._armed[2]:
            _refuse("arming", f"the arming expired; a token is good for {ARMED_FOR:g} s")
        return self._armed[1]
