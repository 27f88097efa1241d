"""The queue of a session: steps and moves of the chassis, planned one after another, to be commanded together."""

import itertools

from footfall.core.errors import Conflict, InvalidInput, NotFound
from footfall.planning.queue.problem import PlanQueue, QueueResult, entries_in_words
from footfall.sequence.commands import Sequence
from footfall.sequence.foot_moves import foot_moves
from footfall.sequence.rest import predicted_rest
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.session.access.acting import said_by
from footfall.session.answers.queues import QueueAnswer, QueuedAnswer
from footfall.session.carried_out import carried_out, moved_by, planned_behind
from footfall.session.core import SessionCore, present
from footfall.session.jobs.job import Job
from footfall.session.log.fold_queue import queues_behind
from footfall.session.products.kinds import BODY_MOVE, GROUND, PLAN, QUEUE, SHIFT
from footfall.session.products.plans import StepPlans
from footfall.session.products.sequences import Sequences
from footfall.session.products.stances import Stances
from footfall.session.products.up_to_date import SENT
from footfall.session.walking import CommandedFootMove
from footfall.telemetry.state import RobotState


class Queues:
    """Steps and moves that are commanded together; thread-safe as :class:`footfall.session.core.SessionCore` says."""

    def __init__(self, core: SessionCore, stances: Stances, plans: StepPlans, sequences: Sequences) -> None:
        self._core, self._stances, self._plans, self._sequences = core, stances, plans, sequences

    def add(self, plan: str | None = None) -> Job:
        """Put a planned step or move of the chassis (None: the present step) at the end of the queue.

        One that was carried out is over: the plan begins the next. The first has to begin where the rover stands, every
        other exactly where the queue ends; the answer says by how much one does not. Raises Conflict, NotFound.
        """
        digest = plan or present(self._core.state.plan, "there is no plan to queue yet")
        made = self._core.state.products.get(digest)
        if made is None or made.kind not in (PLAN.name, BODY_MOVE.name, SHIFT.name):
            raise NotFound(f"the session holds no step and no move of the chassis {digest}", digest=digest)
        found = self._core.get(digest)
        if getattr(found, "plan", None) is None:
            raise Conflict(f"there is no plan to queue: {getattr(found, 'reason', '')}")
        queue = self._core.state.queue
        if queue is None or self._is_over(queue):
            self._require_at_rover(made.parents["state"])
            before, begun = {}, made
        else:
            before, begun = {"queue": queue}, self._core.state.products[queue]
        parents = {**{name: begun.parents[name] for name in GROUND}, "plan": digest, **before}
        return self._core.product_jobs.submit(QUEUE, parents, None, urgent=True, while_there={"queue": queue})

    def shorten(self, to: str | None) -> None:
        """Take entries from the end until the queue is ``to``, one that it was before; None: empty it.

        Where it was planned from its end, it is planned from the end of what is left then, or from how the rover
        stands. Raises Conflict where it was never that, or is it already.
        """
        with self._core.folded_log.lock:
            state = self._core.state
            if state.queue is None:
                raise Conflict("there is no queue to take anything from")
            if to not in queues_behind(state.products, state.queue)[1:]:
                raise Conflict("the queue has changed since you read it; read it again", yours=to, present=state.queue)
            goes_on = self._goes_on(state.queue)
            self._core.folded_log.record("queue_shortened", {"digest": to, **said_by()})
        if goes_on and to is not None:
            self._plans.go_on_after(to)
        elif goes_on:
            self._stances.end_what_if()

    def answer(self) -> QueueAnswer | None:
        """The queue as plain JSON; None where it is empty."""
        digest = self._core.state.queue
        if digest is None:
            return None
        # names what computes only where there is a queue
        from footfall.sequence.predict import needed_duration

        plan, limits = self._plan(digest), self._core.robot.speed_limits * SequenceSettings().speed_fraction
        before = queues_behind(self._core.state.products, digest)[1:][::-1]
        entries: list[QueuedAnswer] = []
        for number, (entry, left) in enumerate(zip(plan.entries, before, strict=True), 1):
            q = entry.plan.waypoints
            entries.append(
                {
                    "number": number,
                    "what": "chassis" if entry.leg is None else f"leg {entry.leg}",
                    "plan": entry.answer,
                    "leg": entry.leg,
                    "duration": sum(needed_duration(b - a, limits) for a, b in itertools.pairwise(q)),
                    "margin": entry.balance,
                    "before": left,
                }
            )
        over, goes_on = self._is_over(digest), self._goes_on(digest)
        return {"digest": digest, "entries": entries, "goes_on": goes_on, "carried_out": over}

    def foot_moves_in(self, sequence: str) -> tuple[CommandedFootMove, ...]:
        """The rows of a sequence by foot moves, where it goes back to a queue; none where it does not."""
        behind = planned_behind(self._core.state, sequence)
        if self._core.state.kind_of(behind) is not QUEUE:
            return ()
        queue, commands = self._plan(behind), self._core.typed(Sequence, sequence)
        groups = queue.foot_moves()
        found: list[CommandedFootMove] = []
        for rows, numbers in itertools.zip_longest(foot_moves(commands.commands), groups):
            if rows is None:
                break  # an operator may have deleted rows, or written more
            numbers = numbers or groups[-1]
            T_planned = queue.entries[numbers[-1]].plan.motion.Ts_site_base[-1]
            leg = queue.entries[numbers[-1]].leg
            text = f"{entries_in_words(numbers)} of {len(queue.entries)}: {'chassis' if leg is None else f'leg {leg}'}"
            rest = predicted_rest(self._core.robot, commands, rows, T_planned)
            found.append(CommandedFootMove(rows.first, rows.count, text, rest))
        return tuple(found)

    def _plan(self, digest: str) -> PlanQueue:
        found = self._core.typed(QueueResult, digest).plan
        if found is None:
            raise InvalidInput(f"{digest} is no queue", digest=digest)
        return found

    def _is_over(self, queue: str) -> bool:
        """Whether the rover has carried out all of a queue."""
        state = self._core.state
        return any(queue in moved_by(state, one) for one in carried_out(state, self._sequences.rows_of))

    def _goes_on(self, queue: str) -> bool:
        """Whether it is planned from where a queue ends."""
        state = self._core.state
        made = None if state.what_if is None or state.state is None else state.products.get(state.state)
        return made is not None and made.parents.get("plan") == queue

    def _require_at_rover(self, start: str) -> None:
        """The first entry begins where the rover stands. Raises Conflict that says by how much it does not."""
        stands = self._stances.standing_now()["state"]
        then, now = (self._core.typed(RobotState, one) for one in (start, stands))
        found = self._core.difference(then.posture, then.T_site_base, now)
        what = found.beyond(*SENT)
        if what:
            chassis, joint = f"its chassis by {found.moved:z.3f} m", f"{found.joint} by {found.turned:+z.4f} rad"
            off = chassis if what == "chassis" else joint
            raise Conflict(
                f"a queue begins where the rover stands, and this plan begins elsewhere: {off}; plan it from how the "
                "rover stands, or queue the plan before it first",
                moved=found.moved,
                turned=found.turned,
            )
