"""Plans of a session: asked for, asked for otherwise and compared, chosen, and gone on from."""

from collections.abc import Sequence as Listed

from footfall.core.errors import Conflict, NotFound
from footfall.planning.answers import Status
from footfall.planning.queue.problem import QueueResult
from footfall.planning.step.alternatives import KINDS, asked_otherwise
from footfall.planning.step.problem import PlanResult, Point, StepPlan, StepSettings
from footfall.session.answers.plans import EndAnswer, PlanListed
from footfall.session.choosing.choices import PageChoices
from footfall.session.core import SessionCore, present
from footfall.session.jobs.job import Job
from footfall.session.jobs.requests import StepRequest
from footfall.session.log.records import ProductRecord
from footfall.session.products.kinds import AFTER, EXECUTION, PLAN, QUEUE
from footfall.session.products.kinds import KINDS as PRODUCT_KINDS
from footfall.session.products.maps import LegMaps
from footfall.session.products.stances import Stances
from footfall.session.products.terrains import SHORT_JOB


class StepPlans:
    """The steps that are planned; thread-safe as :class:`footfall.session.core.SessionCore` says."""

    def __init__(self, core: SessionCore, choices: PageChoices, maps: LegMaps, stances: Stances) -> None:
        self._core, self._choices, self._maps, self._stances = core, choices, maps, stances

    def step(
        self,
        leg: int | None = None,
        target: tuple[float, float] | None = None,
        settings: StepSettings | None = None,
        *,
        through: Listed[Point] = (),
        after: str | None = None,
    ) -> Job:
        """Plan a step to ``target`` (x, y) [m]; without one, to the chosen footfall.

        through: points, site [m], that the wheel's centre passes. after: digest of a plan, execution or sequence from
        whose predicted end the step starts, see :meth:`go_on_after`. Raises Conflict, InvalidInput, NotFound.
        """
        chosen = self._choices.footfall_for(leg, target)
        self._core.require_leg(chosen.leg)
        if after is not None:
            self.go_on_after(after)
        points = tuple((float(x), float(y), float(z)) for x, y, z in through)
        good = self._maps.good_places(chosen)
        request = StepRequest(chosen, settings or StepSettings(), points, explain=True, instead=good)
        return self._stances.ask(PLAN, request, leg=chosen.leg)

    def alternatives(self, digest: str | None = None, kinds: Listed[str] = ()) -> list[Job]:
        """Ask for a plan (None: the present one) otherwise, one job for each kind of KINDS (none named: all).

        What they find is listed beside the plan and replaces nothing. Raises Conflict, InvalidInput, NotFound.
        """
        digest, made = self.made(digest)
        result, plan = self._core.typed(PlanResult, digest), self.found(digest)
        asked = [(kind, *asked_otherwise(plan, kind)) for kind in dict.fromkeys(kinds or KINDS)]
        return [
            self._core.product_jobs.submit(
                PLAN,
                dict(made.parents),
                StepRequest(result.footfall, settings, result.through, explain=True),
                leg=result.footfall.leg,
                alternative={"to": digest, "kind": kind, "text": text},
            )
            for kind, settings, text in asked
        ]

    def choose(self, digest: str) -> None:
        """Take one of the plans that are listed beside each other as the session's plan. Raises NotFound, Conflict."""
        with self._core.folded_log.lock:
            if digest == self._core.state.plan:
                return
            chosen = next((one for one in self._core.state.alternatives if one.plan == digest), None)
            if chosen is None:
                raise NotFound(f"{digest} is none of the plans to choose from", digest=digest)
            if chosen.status != Status.FOUND.value:
                raise Conflict(f"{chosen.text}: there is no such plan: {chosen.reason}", status=chosen.status)
            self._core.folded_log.record("plan_chosen", {"digest": digest})

    def shown(self) -> list[PlanListed]:
        """The present plan and those to compare it with, as plain JSON, each with its figures."""
        # names what compares plans only when plans are compared
        from footfall.session.products.plan_figures import plan_figures

        state = self._core.state
        return [
            {
                "digest": one.plan,
                "kind": one.kind,
                "text": one.text,
                "status": one.status,
                "reason": one.reason,
                "chosen": one.plan == state.plan,
                "figures": plan_figures(self._core.robot, self._core.typed(PlanResult, one.plan)),
            }
            for one in state.plans
        ]

    def doubt(self) -> str:
        """What is doubtful of the present plan, "" where nothing is: its leg ends with less in reserve than before, and
        than a move of the chassis leaves.
        """
        from footfall.planning.body.move import BodyMoveSettings
        from footfall.planning.body.reserve import reserves

        state = self._core.state
        if state.plan is None or state.plan_status != Status.FOUND.value:
            return ""
        plan = self.found(state.plan)
        start, goal = plan.waypoints[[0, -1]]
        checks = [one.check for one in reserves(self._core.robot, start, goal, (plan.leg,), BodyMoveSettings())]
        lacking = " and ".join(check.where for check in checks if not check.holds)
        if not lacking:
            return ""
        return (
            f"Little is left in reserve: {lacking}. The next step, or move of the chassis, may be refused; "
            "a footfall nearer to the chassis leaves more."
        )

    def planned_end(self) -> str | None:
        """Digest of what says best where the present plan ends: of its commands, its execution, which knows sag, and
        itself the one that was made last; None without a plan.
        """
        state = self._core.state
        if state.plan is None or state.plan_status != Status.FOUND.value:
            return None
        plan, execution = state.products[state.plan], None
        able = [state.plan]
        if state.execution is not None and state.execution_status == Status.FOUND.value:
            execution = state.products[state.execution]
            able.append(state.execution)
        if state.sequence is not None:
            behind = state.plan_behind(state.sequence)
            if behind is plan or (behind is not None and behind is execution):
                able.append(state.sequence)
        # the same may be made again: the latest time counts
        made = {one.payload["digest"]: one.seq for one in self._core.events() if one.type == "product"}
        return max(able, key=lambda digest: made[digest])

    def end_answer(self, digest: str) -> EndAnswer:
        """What ends there, as plain JSON: digest; of: "plan", "execution", "queue" or "commands"; sags: whether sag is
        in it.
        """
        kind, behind = PRODUCT_KINDS[self._core.state.products[digest].kind], self._core.state.plan_behind(digest)
        sags = kind is EXECUTION or (behind is not None and PRODUCT_KINDS[behind.kind].given_as == EXECUTION.given_as)
        of = "commands" if kind.is_commands else kind.name
        return {"digest": digest, "of": of, "sags": sags}

    def go_on_after(self, digest: str) -> str:
        """Plan from where a plan, execution, queue or sequence of this session ends; returns the predicted state.

        Until :meth:`.Stances.end_what_if` it is planned from there as in a what-if: nothing planned so can be sent
        before the rover stands there, the command gate sees to that. Raises Conflict, InvalidInput, NotFound.
        """
        kind = self._core.state.kind_of(digest)
        if kind is None or not (kind in (PLAN, EXECUTION, QUEUE) or kind.is_commands):
            raise NotFound(f"the session holds no plan and no sequence {digest}", digest=digest)
        if kind is PLAN:
            self.found(digest)
        if kind is QUEUE and (refused := self._core.typed(QueueResult, digest)).plan is None:
            raise Conflict(f"that plan does not follow the queue: {refused.reason}", status=refused.status.value)
        plan = self._core.state.plan_behind(digest) if kind.is_commands else self._core.state.products[digest]
        if plan is None:
            raise Conflict("the sequence goes back to no plan, so nothing is known of where it starts")
        parents = {
            "robot": self._core.robot_digest,
            "dem": present(self._core.state.dem, "there is no terrain yet"),
            "state": plan.parents["state"],
            kind.given_as: digest,
        }
        return self._core.product_jobs.submit(AFTER, parents, None, urgent=True).finish(SHORT_JOB)

    def found(self, digest: str) -> StepPlan:
        """The plan of a result. Raises Conflict where it is a refusal."""
        result = self._core.typed(PlanResult, digest)
        if result.plan is None:
            raise Conflict(f"no plan was found there to go on with: {result.reason}", status=result.status.value)
        return result.plan

    def made(self, digest: str | None) -> tuple[str, ProductRecord]:
        """A plan (None: the present one) and how it was made."""
        digest = digest or present(self._core.state.plan, "there is no plan yet")
        made = self._core.state.products.get(digest)
        if made is None or made.kind != PLAN.name:
            raise NotFound(f"the session holds no plan {digest}", digest=digest)
        return digest, made
