"""A walk in a closed loop: look, plan, carry some foot moves out, measure, decide again, until it is at the goal.

It runs in a thread of its own and does nothing that an operator could not: it asks for images, maps, walks and commands
of the session, arms and sends them as whoever began it, through the same gate. What it decides stands in the log.
"""

import logging
import threading
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from footfall.core.errors import CommandRefused, Conflict, FootFallError
from footfall.planning.walk.problem import WalkGoal, WalkPlan, WalkResult, WalkSettings
from footfall.planning.walk_execution.decision import Act, SoFar, WayOn, WayOnSettings
from footfall.session.access.acting import acting
from footfall.session.access.identity import LOCAL, Identity
from footfall.session.gate.checks import STALE_AFTER
from footfall.session.jobs.job import Job
from footfall.session.products.remembered import on_map
from footfall.terrain.settings import TerrainSettings

if TYPE_CHECKING:
    from footfall.session.live import LiveSession
    from footfall.telemetry.state import RobotState
    from footfall.terrain.dem import Dem

log = logging.getLogger(__name__)

LOOKS_EVERY = 0.5
"""How often what is waited for is looked at where nothing is told of it [s]."""
IMAGES_WITHIN = 600.0
"""A rover that sent no images after this sends none [s]."""
MAY_BE_REPLANNED = ("rules", "start", "set-points", "pose", "terrain", "load")
"""Checks of the gate that another plan may pass."""


@dataclass(frozen=True)
class LoopSettings:
    """way_on: what is decided by. walk: how walks are planned; one planned anew has the next seed.

    terrain: how maps are made of images. pairs: cameras that are asked for images; None: all. farthest: how far ahead a
    walk is planned at once [m]; after each one that was not found it is half as far.
    """

    way_on: WayOnSettings = field(default_factory=WayOnSettings)
    walk: WalkSettings = field(default_factory=WalkSettings)
    terrain: TerrainSettings = field(default_factory=lambda: TerrainSettings(keep=True))
    pairs: tuple[str, ...] | None = None
    farthest: float = 3.0


class WalkLoop:
    """One walk to a goal. Every method may be called from any thread; made by :meth:`LiveSession.walk_to`.

    state: "going", "held" or "ended"; outcome: of one that has ended: "arrived", "stopped" or "cancelled"; act, reason:
    what was decided last, and why. foot_moves: parts of walks that were carried out.
    """

    def __init__(self, live: "LiveSession", goal: WalkGoal, settings: LoopSettings, who: Identity = LOCAL) -> None:
        self._live, self.goal, self._settings, self._who = live, goal, settings, who
        self.state, self.outcome, self.act, self.reason = "going", "", "", ""
        self.foot_moves = 0
        self._walk: str | None = None
        self._seen = -1
        self.decided: Counter[str] = Counter()
        self._news, self._free, self._over = threading.Event(), threading.Event(), threading.Event()
        self._cancelled = False
        self._free.set()
        self._unlisten = live.listen(lambda _: self._news.set())
        self._thread = threading.Thread(target=self._run, name="footfall-walk", daemon=True)
        self._thread.start()

    # -- for whoever watches -------------------------------------------------------------------

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON for the interface."""
        goal = {"x": self.goal.x, "y": self.goal.y, "yaw": self.goal.yaw}
        told = {"state": self.state, "outcome": self.outcome, "act": self.act, "reason": self.reason}
        return {"goal": goal, **told, "foot_moves": self.foot_moves, "decided": dict(self.decided)}

    def hold(self, who: Identity = LOCAL) -> None:
        """Nothing more is begun; a row that is out is carried out. Raises CommandRefused where another has the conn."""
        self._require_going()
        self._free.clear()
        self.state = "held"
        if self._live.gate["state"] == "sending" and not self._live.gate["waiting"]:
            self._live.hold_run(who)

    def go_on(self, who: Identity = LOCAL) -> None:
        """Go on after :meth:`hold`. Raises CommandRefused, naming the check, where the gate does not let it."""
        self._require_going()
        if self._live.gate["waiting"]:
            self._live.resume_run(who)
        self.state = "going"
        self._free.set()

    def cancel(self, who: Identity = LOCAL) -> None:
        """End it and leave the rover to whoever asks: a row that is out is carried out, nothing more is sent."""
        self._cancelled = True
        self._free.set()
        self._news.set()
        if self._live.gate["run"] is not None:
            self._live.abort_run(who)

    def wait(self, timeout: float | None = None) -> bool:
        """Wait for the end; whether it came within ``timeout`` [s]."""
        return self._over.wait(timeout)

    def close(self) -> None:
        """End it with the session, whatever it does; harmless when done twice."""
        self._cancelled = True
        self._free.set()
        self._news.set()
        if self._thread is not threading.current_thread():
            self._thread.join()

    def _require_going(self) -> None:
        if self.state == "ended":
            raise Conflict(f"the walk has ended: {self.reason}", outcome=self.outcome)

    # -- the loop ------------------------------------------------------------------------------

    def _run(self) -> None:
        limits = self._settings.way_on
        so_far, walk, number = SoFar(), None, 0
        try:
            with acting(self._who):
                while True:
                    decision = self._decide(so_far, walk, number, limits)
                    if decision.act is Act.LOOK:
                        so_far = self._look(so_far)
                    elif decision.act is Act.REPLAN:
                        walk, number, so_far = self._plan(so_far)
                    elif decision.act is Act.GO:
                        number, so_far = self._go(number, limits.foot_moves, so_far)
                    else:
                        return self._end("arrived" if decision.act is Act.ARRIVED else "stopped", decision.reason)
        except _Cancelled:
            self._end("cancelled", "ended by the operator")
        except FootFallError as error:
            self._end("stopped", error.message)
        except Exception as error:
            log.exception("the walk to %s ended by a fault", self.goal)
            self._end("stopped", f"a fault of the software: {type(error).__name__}: {error}")

    def _decide(self, so_far: SoFar, walk: WalkPlan | None, number: int, limits: WayOnSettings) -> WayOn:
        from footfall.planning.walk_execution.way_on import way_on

        state = self._at_rest()
        self._until(self._free.is_set)
        decision = way_on(self._live.robot, self._dem, state, self.goal, walk, number, so_far, limits)
        self.act, self.reason = decision.act.value, decision.reason
        self.decided[self.act] += 1
        self._live.record_decision(self.act, self.reason)
        return decision

    def _look(self, so_far: SoFar) -> SoFar:
        before = self._live.state.snapshot
        self._live.request_images(self._settings.pairs)
        since = time.monotonic()
        self._until(lambda: self._live.state.snapshot != before or time.monotonic() - since > IMAGES_WITHIN)
        if self._live.state.snapshot == before:
            raise Conflict(f"the rover sent no images within {IMAGES_WITHIN:.0f} s")
        self._finish(self._live.build_terrain(self._settings.terrain))
        return replace(so_far, moved=0, looked=True, refused="")

    def _plan(self, so_far: SoFar) -> tuple[WalkPlan | None, int, SoFar]:
        from footfall.planning.walk_execution.stage import stage

        so_far = replace(so_far, anew=so_far.anew + 1)
        dem, live = self._dem, self._live
        farthest = self._settings.farthest / 2 ** (so_far.anew - 1)
        goal = None if dem is None else stage(live.robot, dem, self._at_rest().T_site_base, self.goal, farthest)
        if goal is None:
            return None, 0, replace(so_far, refused="no ground is known on the way to the goal")
        live.snapshot_state()
        asked = replace(self._settings.walk, seed=self._settings.walk.seed + so_far.anew - 1)
        self._walk = self._finish(live.plan_walk(goal, asked))
        found = live.get(self._walk)
        if not isinstance(found, WalkResult) or found.plan is None:
            return None, 0, replace(so_far, refused=f"no walk is found: {getattr(found, 'reason', '')}")
        return found.plan, 0, replace(so_far, refused="")

    def _go(self, number: int, count: int, so_far: SoFar) -> tuple[int, SoFar]:
        live, before = self._live, self._live.state.runs
        try:
            sequence = live.command_foot_moves(self._walk, number, count)
            # making them may have taken longer than telemetry is good for
            self._until(lambda: (age := live.link.age) is not None and age <= STALE_AFTER / 2)
            live.send(live.arm(sequence, self._who)["token"], sequence, self._who)
        except CommandRefused as error:
            if error.details.get("check") not in MAY_BE_REPLANNED:
                raise
            return number, replace(so_far, refused=error.message)
        except FootFallError as error:
            return number, replace(so_far, refused=error.message)
        self._until(lambda: (run := live.state.run) is not None and run.number > before and run.state == "ended")
        ended, frame = live.state.run, live.frame
        self._seen = -1 if frame is None else frame.number
        if ended is None or ended.outcome != "done":
            reason = "" if ended is None else ended.reason
            raise Conflict(f"the commands were not carried out to their end: {reason}")
        moved = len(live.foot_moves_in(sequence))
        self.foot_moves += moved
        return number + moved, replace(so_far, moved=so_far.moved + moved, looked=False, anew=0, refused="")

    # -- what it waits for ---------------------------------------------------------------------

    @property
    def _dem(self) -> "Dem | None":
        from footfall.terrain.dem import Dem

        digest = self._live.state.dem
        found = None if digest is None else self._live.get(digest)
        return found if isinstance(found, Dem) else None

    def _at_rest(self) -> "RobotState":
        """As telemetry from after the latest run has it that shows the rover at rest, on the map."""

        def rests() -> bool:
            frame = self._live.frame
            return frame is not None and frame.number != self._seen and frame.state.mode == "idle"

        self._until(rests)
        frame = self._live.frame
        if frame is None:
            raise Conflict("the rover has sent no telemetry")
        return on_map(frame.state, self._dem)

    def _finish(self, job: Job) -> str:
        try:
            self._until(lambda: job.ended)
        except _Cancelled:
            job.cancel()
            raise
        return job.finish()

    def _until(self, holds: Callable[[], bool]) -> None:
        """Wait until something holds; raises what ends the loop meanwhile."""
        while True:
            self._news.clear()
            if self._cancelled:
                raise _Cancelled
            self._require_safe()
            if holds():
                return
            self._news.wait(LOOKS_EVERY)

    def _require_safe(self) -> None:
        live = self._live
        if live.state.stop.latched:
            raise Conflict("the rover was stopped")
        if live.frame is not None and live.frame.state.mode == "fault":
            raise Conflict("the rover reports a fault")
        if not live.link.connected:
            raise Conflict("the rover is not connected")

    def _end(self, outcome: str, reason: str) -> None:
        self._unlisten()
        self.state, self.outcome, self.reason = "ended", outcome, reason
        self._live.record_decision("end", f"{outcome}: {reason}")
        self._over.set()


class _Cancelled(Exception):
    """Whoever commands has ended the loop."""
