"""A walk in a closed loop: look, plan, carry some foot moves out, measure, decide again, until it is at the goal.

It runs in a thread of its own and does nothing that an operator could not: it asks for images, maps, walks and commands
of the session, arms and sends them as whoever began it, through the same gate. What it decides stands in the log.
"""

import logging
import threading
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from footfall.core.errors import CommandRefused, Conflict, FootFallError
from footfall.core.value import fields_of
from footfall.planning.walk.excerpt import parts_count
from footfall.planning.walk.problem import WalkGoal, WalkPlan
from footfall.planning.walk_execution.decision import Act, SoFar, WayOn, WayOnSettings
from footfall.session.access.acting import acting
from footfall.session.access.identity import LOCAL, Identity
from footfall.session.answers.commands import ConnAnswer
from footfall.session.gate.checks import STALE_AFTER
from footfall.session.jobs.job import Job
from footfall.session.loop_ends import how_the_conn_went, require_there
from footfall.session.loop_looking import build_map, take_images, up_and_back
from footfall.session.loop_pieces import Pieces, newest_dem
from footfall.session.loop_settings import LoopSettings
from footfall.session.parts import SessionParts
from footfall.session.storage.interface import StoreRefused
from footfall.session.walking import name_of

if TYPE_CHECKING:
    from footfall.terrain.fusion.on_map import OnMap

log = logging.getLogger(__name__)

LOOKS_EVERY = 0.5
"""How often what is waited for is looked at where nothing is told of it [s]."""
LET_GO_ON, CARRIED_OUT = "somebody to let it go on", "the rover to carry it out"
"""What it waits for."""
MAY_BE_REPLANNED = ("rules", "start", "set-points", "pose", "terrain", "load")
"""Checks of the gate that another plan may pass."""
ARMED_ANEW = "arming"
"""The check of an arming that ran out before what it was for was sent, as on a machine that is busy."""


class WalkLoop:
    """One walk to a goal. Every method may be called from any thread; made by :meth:`.LiveSession.walk_to`.

    state: "going", "held" or "ended"; outcome: of one that has ended: "arrived", "stopped" or "cancelled"; act, reason:
    what was decided last, and why. part: of the walk that is planned, which is next or under way; waits_for: what has
    to come before it does anything else. foot_moves: parts of walks that were carried out.
    """

    def __init__(self, live: SessionParts, goal: WalkGoal, settings: LoopSettings, who: Identity = LOCAL) -> None:
        self._live, self.goal, self._settings, self._who = live, goal, settings, who
        self.state, self.outcome, self.act, self.reason = "going", "", "", ""
        self.part, self.waits_for, self.foot_moves = "", "", 0
        self._pieces = Pieces(live, goal, settings, self._finish, lambda: self._at_rest().state)
        self._seen, self.decided = -1, Counter[str]()
        self._news, self._free, self._over = threading.Event(), threading.Event(), threading.Event()
        # nothing is sent while somebody holds or ends it, and nobody is told of a hold while something is being sent
        self._sending = threading.Lock()
        self._sent: int | None = None
        # number of the conn under which it goes, once whoever began it holds one
        self._conn: int | None = live.commands.conn["number"] if live.commands.holds_conn(who) else None
        self._epoch = live.rover.epoch
        self._cancelled, self._ended_by = False, ""
        self._free.set()
        self._unlisten = live.listen(lambda _: self._news.set())
        self._thread = threading.Thread(target=self._run, name="footfall-walk", daemon=True)
        self._thread.start()

    # -- for whoever watches -------------------------------------------------------------------

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON for the interface."""
        goal = {"x": self.goal.x, "y": self.goal.y, "yaw": self.goal.yaw}
        decided = {"state": self.state, "outcome": self.outcome, "act": self.act, "reason": self.reason}
        so_far = {"part": self.part, "waits_for": self.waits_for, "foot_moves": self.foot_moves}
        limits = {"limits": fields_of(self._settings.way_on), "farthest": self._settings.farthest}
        ways = self._pieces.ways
        chosen = {"choose_by": self._settings.choose_by, "planners": dict(ways.planners), "chosen": ways.latest_answer}
        return {"goal": goal, **decided, **so_far, "decided": dict(self.decided), **limits, **chosen}

    def hold(self, who: Identity = LOCAL) -> None:
        """Nothing more is begun; a row that is out is carried out. Raises CommandRefused where another has the conn."""
        with self._sending:
            self._require_going()
            self._steer(self._live.commands.hold, who)
            self._free.clear()
            self.state = "held"

    def go_on(self, who: Identity = LOCAL) -> None:
        """Go on after :meth:`hold`. Raises CommandRefused, naming the check, where the gate does not let it."""
        with self._sending:
            self._require_going()
            self._steer(self._live.commands.resume, who)
            self.state = "going"
            self._free.set()
            self._news.set()

    def cancel(self, who: Identity = LOCAL) -> None:
        """End it and leave the rover to whoever asks: a row that is out is carried out, nothing more is sent.

        Raises CommandRefused where another has the conn.
        """
        with self._sending:
            self._require_going()
            self._steer(self._live.commands.abort, who)
            self._ended_by = who.name
            self._leave()

    def wait(self, timeout: float | None = None) -> bool:
        """Wait for the end; whether it came within ``timeout`` [s]."""
        return self._over.wait(timeout)

    def leave(self) -> None:
        """Have it end as soon as what it waits for ends, which is not waited for; harmless when done twice."""
        with self._sending:
            self._leave()

    def close(self) -> None:
        """End it with the session, whatever it does; harmless when done twice."""
        self.leave()
        if self._thread is not threading.current_thread():
            self._thread.join()

    def _leave(self) -> None:
        self._cancelled = True
        self._free.set()
        self._news.set()

    def _steer(self, steer: Callable[[Identity], None], who: Identity) -> None:
        """Steer its run, where one is under way; else only require that ``who`` may. Raises CommandRefused."""
        if self._is_sending():
            try:
                return steer(who)
            except CommandRefused:
                if self._is_sending():
                    raise
        # there is none, or it has ended just now
        return self._live.commands.require_may_leave(who)

    def _is_sending(self) -> bool:
        """Whether a run that this loop began is under way, and not one of somebody else."""
        return self._sent is not None and self._live.commands.gate["run"] == self._sent

    def _require_going(self) -> None:
        if self.state == "ended":
            raise Conflict(f"the walk has ended: {self.reason}", outcome=self.outcome)
        if self._cancelled:
            raise Conflict("the walk has ended: it was cancelled", outcome="cancelled")

    # -- the loop ------------------------------------------------------------------------------

    def _run(self) -> None:
        with acting(self._who, by_itself=True):
            try:
                self._end(*self._walked())
            except _Cancelled:
                self._end("cancelled", f"ended by {self._ended_by}" if self._ended_by else "its session was closed")
            except FootFallError as error:
                self._end("stopped", error.message)
            except StoreRefused as error:
                self._end("stopped", error.not_recorded.message)
            except Exception as error:
                log.exception("the walk to %s ended by a fault", self.goal)
                self._end("stopped", f"a fault of the software: {type(error).__name__}: {error}")

    def _walked(self) -> tuple[str, str]:
        """Outcome and reason."""
        limits = self._settings.way_on
        so_far, walk, number = SoFar(unmet=self._settings.walk.pinned), None, 0
        while True:
            decision = self._decide(so_far, walk, number, limits)
            if decision.act is Act.LOOK:
                so_far = self._look(so_far)
            elif decision.act is Act.REPLAN:
                number, (walk, so_far) = 0, self._pieces.plan(so_far)
            elif decision.act is Act.LIFT:
                so_far = self._lift(decision.leg, so_far)
            elif decision.act is Act.GO:
                number, so_far = self._go(number, limits.foot_moves, so_far)
            else:
                return "arrived" if decision.act is Act.ARRIVED else "stopped", decision.reason

    def _decide(self, so_far: SoFar, walk: WalkPlan | None, number: int, limits: WayOnSettings) -> WayOn:
        from footfall.planning.walk_execution.way_on import way_on

        # held for hours, the rover may stand elsewhere by now
        self._until(self._free.is_set, LET_GO_ON)
        place = self._at_rest()
        robot, dem, balance = self._live.robot, newest_dem(self._live), self._settings.walk.balance
        decision = way_on(robot, dem, place.state, self.goal, walk, number, so_far, limits, place.doubt, balance)
        self.act, self.reason = decision.act.value, decision.reason
        self.part = "" if walk is None or number >= parts_count(walk) else name_of(walk, number)
        self.decided[self.act] += 1
        self._live.record_decision(self.act, self.reason)
        return decision

    def _look(self, so_far: SoFar) -> SoFar:
        self._take_images()
        return self._map_anew(so_far)

    def _take_images(self) -> None:
        take_images(self._live, self._settings.pairs, self._until)

    def _map_anew(self, so_far: SoFar) -> SoFar:
        build_map(self._live, self._settings.terrain, self._finish)
        return replace(so_far, moved=0, looked=True, refused="", nearest=None)

    def _go(self, number: int, count: int, so_far: SoFar) -> tuple[int, SoFar]:
        live = self._live
        self.waits_for = "its commands"
        try:
            sequence = live.walks.command(self._pieces.walk, number, count, self._pieces.commanded)
        except FootFallError as error:
            return number, so_far.with_no_commands(error.message, error.details.get("fails", ()))
        if refused := self._begin(sequence):
            return number, so_far.with_no_commands(refused)
        self._carry_out()
        moved = len(live.walks.foot_moves_in(sequence))
        self.foot_moves += moved
        return number + moved, so_far.gone_on(moved, self._pieces.unmet(so_far.unmet, number + moved))

    def _lift(self, leg: int, so_far: SoFar) -> SoFar:
        """Look with a leg lifted: its rows go one by one as far as it is up, and the rest after the images.

        The map is made anew when the leg is down: the gate lets no row go over ground that another map shows.
        """
        tried = replace(so_far, lifted=(*so_far.lifted, leg))
        made = up_and_back(self._live, leg, self._settings.walk, self._finish)
        refused = made if isinstance(made, str) else self._begin(made.sequence, row_by_row=True)
        if isinstance(made, str) or refused:
            return replace(tried, refused=refused)
        # let go on by somebody else it comes down with no look
        if up := all(self._goes_to(row, made.up) for row in range(1, made.up + 1)):
            self._take_images()
            self._let_go(self._live.commands.resume)
        self._carry_out()
        return replace(self._map_anew(tried), anew=0, declined=0, too_near=0) if up else tried

    def _goes_to(self, row: int, last: int) -> bool:
        """Whether its run waits before a row, once it waits or has ended; before the ``last`` it lets none go."""
        self._until(self._waits_or_ended, CARRIED_OUT)
        waits = self._is_sending() and self._live.commands.gate["row"] == row
        if waits and row < last:
            self._let_go(self._live.commands.next_row)
        return waits

    def _waits_or_ended(self) -> bool:
        commands = self._live.commands
        return commands.end_of_run(self._sent) is not None or (self._is_sending() and commands.gate["waiting"])

    def _let_go(self, rows: Callable[[Identity], None]) -> None:
        """Let a row go, or all that are left, unless somebody did or ends the walk. Raises CommandRefused."""
        self._until(self._free.is_set, LET_GO_ON)
        self._see_anew()
        self._at_rest()
        with self._sending:
            if self._live.commands.gate["waiting"] and not self._cancelled:
                rows(self._who)

    def _carry_out(self) -> None:
        """Wait for the end of its run. Raises Conflict where that came before the last row was done."""
        self._until(self._is_carried_out, CARRIED_OUT)
        outcome, reason = self._live.commands.end_of_run(self._sent) or ("", "")
        self._see_anew()
        if outcome != "done":
            raise Conflict(f"the commands were not carried out to their end: {reason}")

    def _see_anew(self) -> None:
        """What telemetry has said up to now says nothing of how the rover rests."""
        self._seen = -1 if self._live.rover.frame is None else self._live.rover.frame.number

    def _begin(self, sequence: str, row_by_row: bool = False) -> str:
        """Send commands, once nobody holds it; why the gate refused what another plan may pass, "" where they go."""
        refused = None
        while refused is None:
            # making them may have taken longer than telemetry is good for
            self._until(self._free.is_set, LET_GO_ON)
            self._until(lambda: not self._free.is_set() or self._is_fresh(STALE_AFTER / 2), "telemetry that is new")
            refused = self._send(sequence, row_by_row)
        return refused

    def _send(self, sequence: str, row_by_row: bool) -> str | None:
        """Why the gate refused what another plan may pass, "" where it was sent, None where that is to be tried again.

        That is so where it was held meanwhile, or the arming ran out. Raises what ends the walk: a stop, another
        refusal, a conn that was given up.
        """
        live, who = self._live, self._who
        with self._sending:
            if self._cancelled or not self._free.is_set():
                return None
            self._require_safe()
            try:
                armed = live.commands.arm(sequence, who)
                self._require_conn(armed["conn"])
                self._conn = armed["conn"]["number"]
                self._sent = live.commands.send(armed["token"], sequence, who, row_by_row)["run"]
            except CommandRefused as error:
                check = error.details.get("check")
                if check not in (*MAY_BE_REPLANNED, ARMED_ANEW):
                    raise
                return None if check == ARMED_ANEW else error.message
            return ""

    # -- what it waits for ---------------------------------------------------------------------

    def _at_rest(self) -> "OnMap":
        """As telemetry from after the latest run has it that shows the rover at rest, on the map."""

        def rests() -> bool:
            frame = self._live.rover.frame
            rested = frame is not None and frame.number != self._seen and frame.state.mode == "idle"
            return rested and self._is_fresh(STALE_AFTER)

        self._until(rests, "telemetry of the rover at rest")
        frame = self._live.rover.frame
        if frame is None:
            raise Conflict("the rover has sent no telemetry")
        return self._live.fits.place_on_map(frame.state)

    def _is_fresh(self, within: float) -> bool:
        age = self._live.rover.link.age
        return age is not None and age <= within

    def _is_carried_out(self) -> bool:
        """Whether its run has ended. One that waits by itself holds the walk, which goes on with one that goes on."""
        with self._sending:
            gate = self._live.commands.gate
            waits = self._is_sending() and gate["waiting"]
            self.waits_for = f"{LET_GO_ON}: {gate['why']}" if waits else CARRIED_OUT
            if waits and self._free.is_set() and not self._cancelled:
                self.state = "held"
                self._free.clear()
            elif self._is_sending() and gate["mode"] == "whole" and not self._free.is_set():
                self.state = "going"
                self._free.set()
        return self._live.commands.end_of_run(self._sent) is not None

    def _finish(self, job: Job, what: str) -> str:
        try:
            self._until(lambda: job.ended, what)
        except _Cancelled:
            job.cancel()
            raise
        return job.finish()

    def _until(self, holds: Callable[[], bool], what: str) -> None:
        """Wait for ``what`` until something holds; raises what ends the loop meanwhile."""
        self.waits_for = what
        while True:
            self._news.clear()
            if self._cancelled:
                raise _Cancelled
            self._require_safe()
            if holds():
                return
            self._news.wait(LOOKS_EVERY)

    def _require_safe(self) -> None:
        require_there(self._live)
        self._require_conn(self._live.commands.conn)
        if self._live.rover.epoch != self._epoch:
            raise Conflict("the rover was stopped, connected anew, or given up on in the middle of a row, meanwhile")

    def _require_conn(self, conn: ConnAnswer) -> None:
        if self._conn is not None and (conn["holder"] is None or conn["number"] != self._conn):
            raise Conflict(f"{how_the_conn_went(self._live)}; take it, and begin the walk anew")

    def _break_off(self) -> None:
        """Where it ends with a run of its own under way, nothing goes after the row that is out.

        Without the conn, which is not taken for that, the gate holds the run.
        """
        gate, conn = self._live.commands.gate, self._live.commands.conn
        if self._is_sending() and not gate["aborted"] and conn["holder"] is not None and conn["number"] == self._conn:
            with suppress(FootFallError):
                self._live.commands.abort(self._who)

    def _end(self, outcome: str, reason: str) -> None:
        self._unlisten()
        with self._sending:
            self._break_off()
            # whoever reads it at this moment finds no end without its reason
            self.reason, self.outcome, self.part, self.waits_for = reason, outcome, "", ""
            self.state = "ended"
        try:
            self._live.record_decision("end", f"{outcome}: {reason}")
        finally:
            self._over.set()


class _Cancelled(Exception):
    """Whoever commands has ended the loop."""
