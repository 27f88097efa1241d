"""A session that walks: which foot moves of a walk were carried out, which is next, its commands, and the way on."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from footfall.balance.tether import Tether
from footfall.core.errors import Conflict, InvalidInput, NotFound
from footfall.planning.execution.execution_settings import HELD, ExecutionSettings
from footfall.planning.gait.problem import GaitSettings
from footfall.planning.walk.excerpt import end_of, parts_count, start_of
from footfall.planning.walk.problem import WalkGoal, WalkPlan, WalkResult, WalkSettings, foot_moves_in_words
from footfall.planning.walk_execution.payload import with_load_of
from footfall.planning.walk_execution.pins_left import pins_left
from footfall.sequence.commands import Sequence
from footfall.sequence.foot_moves import Rows, foot_moves
from footfall.sequence.rest import PredictedRest, predicted_rest
from footfall.session.answers.walks import WalkingAnswer
from footfall.session.core import SessionCore, present
from footfall.session.gate.checks import POSE_TOLERANCE, START_TOLERANCE
from footfall.session.jobs.job import Job
from footfall.session.jobs.requests import FootMovesRequest, GaitRequest, WalkRequest
from footfall.session.log.fold import SessionState
from footfall.session.log.fold_commands import CommandRecord
from footfall.session.products.compared import UpToDate
from footfall.session.products.executions import Executions, set_points_at
from footfall.session.products.kinds import FOOT_MOVES, GAIT, WALK
from footfall.session.products.stances import Stances
from footfall.session.products.terrains import SHORT_JOB
from footfall.session.products.up_to_date import SENT, difference
from footfall.session.rover.linked import LinkedRover
from footfall.telemetry.joint_layout import joint_in_words
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

AGAIN = "re-plan the walk from here"


@dataclass(frozen=True)
class Walking:
    """How far a walk is.

    walk: its digest. of: how many parts it has, its foot moves and the chassis' last way; foot_moves: without that;
    done: how many parts were carried out. next: number of the one that is next, counted from 0; None: there is none, or
    it can't begin. leg: whose foot it moves; None: it moves the chassis alone. against: why it can't begin where the
    rover stands now, "" where nothing speaks against it. text: all of it, for a person. commanded: of how many parts,
    from the next on, the session's commands are; 0: they are of something else.
    """

    walk: str
    of: int
    foot_moves: int
    done: int
    next: int | None
    leg: int | None
    against: str
    text: str
    commanded: int = 0


@dataclass(frozen=True)
class CommandedFootMove:
    """Rows of a sequence that belong to one foot move of a walk, and what it is called.

    rest: how the rover is predicted to rest after them; None where it is taken as rigid.
    """

    first_row: int
    rows: int
    text: str
    rest: PredictedRest | None


class Walks:
    """Walks, planned and carried out foot move by foot move; thread-safe as
    :class:`footfall.session.core.SessionCore` says.
    """

    _counted: tuple[str, tuple[CommandRecord, ...], frozenset[int]] | None = None
    """Of a walk, by these commands, which foot moves were carried out."""

    def __init__(
        self, core: SessionCore, rover: LinkedRover, fits: UpToDate, stances: Stances, executions: Executions
    ) -> None:
        self._core, self._rover, self._fits, self._stances, self._executions = core, rover, fits, stances, executions

    def walking(self) -> Walking | None:
        """How far the latest walk is, by what the log says of runs; None without a walk that was found."""
        digest = self._core.state.newest(WALK)
        plan = None if digest is None else self._core.typed(WalkResult, digest).plan
        if digest is None or plan is None:
            return None
        of = parts_count(plan)
        over = self._carried_out(digest)
        done = 0 if not over else max(over) + 1
        if done >= of:
            return Walking(
                digest,
                of,
                plan.foot_moves,
                done,
                None,
                None,
                "",
                f"all {foot_moves_in_words(plan)} done: the walk is over",
            )
        leg = plan.legs[done] if done < plan.foot_moves else None
        against = self._against(plan, done)
        began = "nothing of it was carried out yet" if not done else f"{name_of(plan, done - 1)} done"
        text = f"{began}; next: {name_of(plan, done)}"
        return Walking(digest, of, plan.foot_moves, done, done, leg, against, text, self._commanded(digest, done))

    def walking_answer(self) -> WalkingAnswer | None:
        """As :meth:`walking`, plain JSON."""
        now = self.walking()
        if now is None:
            return None
        return {
            "walk": now.walk,
            "of": now.of,
            "foot_moves": now.foot_moves,
            "done": now.done,
            "next": now.next,
            "leg": now.leg,
            "against": now.against,
            "text": now.text,
            "commanded": now.commanded,
        }

    def plan(
        self,
        goal: WalkGoal,
        settings: WalkSettings | None = None,
        tether: Tether | None = None,
        gait: GaitSettings | None = None,
    ) -> Job:
        """Plan a walk to a goal from the state that is planned from; see :meth:`footfall.planning.walk.plan.plan_walk`.

        tether: that the rover hangs on. gait: a wave, which it goes in; see :func:`.as_walk.plan_wave`. Where telemetry
        shows that the rover gives way, its wheels are first taken out of the strain that they are in.
        """
        return self._stances.ask(WALK, self._walk_request(goal, settings or WalkSettings(), tether, gait))

    def plan_gait(self, goal: WalkGoal, settings: GaitSettings | None = None) -> Job:
        """Plan a gait to a goal from the state that is planned from; see :func:`footfall.planning.gait.plan.plan_gait`.

        It is there to be compared with walks: no commands are made of it.
        """
        unpressed = self._rover.seen_to_give_way is True
        return self._stances.ask(GAIT, GaitRequest(goal, settings or GaitSettings(), unpressed))

    def command(
        self,
        walk: str | None,
        first: int,
        count: int = 1,
        settings: ExecutionSettings | None = None,
        *,
        as_commanded: bool = False,
    ) -> str:
        """Commands of ``count`` foot moves of a walk (None: the latest), from where the rover stands; their digest.

        first: number of the first of them, counted from 0; the number after the last foot move is the chassis' way to
        the goal. They are commanded as a step is, see :meth:`.Sequences.make`: as
        ``settings`` say (None: with the pose held) where it is known how the rover sags; as_commanded: as planned all
        the same. Raises Conflict where the rover does not stand as the walk has it then, with what is otherwise and by
        how much, NotFound, InvalidInput where there is no such foot move or it can't be commanded so.
        """
        if as_commanded and settings is not None:
            raise InvalidInput(
                "commands as planned predict no sag, so they take no settings of it: leave out one of them"
            )
        if settings is not None and settings.mode not in HELD:
            raise InvalidInput(f"a walk is executed in a mode of {', '.join(HELD)}", mode=settings.mode)
        digest, plan = self._walk(walk)
        of = parts_count(plan)
        if not 0 <= first < of or count < 1:
            raise InvalidInput(f"the walk has {of} parts, counted from 0", first=first, count=count, of=of)
        against = self._against(plan, first, count)
        if against:
            raise Conflict(against, walk=digest, first=first)
        dem = present(self._core.state.dem, "there is no terrain any more")
        # from the telemetry that was just judged, however old: the gate asks for newer before anything moves
        parents = {**self._stances.standing_now(oldest=np.inf), "dem": dem, "plan": digest}
        request = FootMovesRequest(first, min(count, of - first))
        if self._sags and not as_commanded:
            set_points = set_points_at(self._rover.link.frame, self._core.typed(RobotState, parents["state"]))
            settings = with_load_of(plan, self._executions.settings_for(plan, settings))
            request = replace(request, settings=settings, set_points=set_points)
        # the checks of a row take a tenth of a second
        return self._core.product_jobs.submit(FOOT_MOVES, parents, request, urgent=True).finish(
            SHORT_JOB * request.count
        )

    def replan(self, walk: str | None = None) -> Job:
        """Plan the rest of a walk (None: the latest) from how the rover stands: same goal, settings, tether, gait.

        Pinned places that its foot moves have put a foot on are not asked for again.
        """
        digest = walk or present(self._core.state.newest(WALK), "there is no walk yet")
        made = self._core.state.products.get(digest)
        if made is None or made.kind != WALK.name or made.settings is None:
            raise NotFound(f"the session holds no walk {digest}", digest=digest)
        asked = self._core.typed(WalkRequest, made.settings)
        plan, over, settings = self._core.typed(WalkResult, digest).plan, self._carried_out(digest), asked.settings
        if plan is not None and over:
            settings = replace(settings, pinned=pins_left(plan, settings.pinned, max(over) + 1))
        request = self._walk_request(asked.goal, settings, asked.tether, asked.gait)
        return self._core.product_jobs.submit(WALK, self._stances.standing_now(), request)

    def foot_moves_in(self, sequence: str) -> tuple[CommandedFootMove, ...]:
        """The rows of a sequence by foot moves, where it goes back to a walk; none where it does not."""
        asked = self._asked_of(sequence)
        if asked is None:
            return ()
        walk, request = asked
        plan = self._walk(walk)[1]
        commands = self._commands_of(sequence)
        return tuple(
            CommandedFootMove(rows.first, rows.count, name_of(plan, number), self._rest(plan, number, commands, rows))
            for number, rows in enumerate(foot_moves(commands.commands), request.first)
        )

    def _rest(self, plan: WalkPlan, number: int, commands: Sequence, rows: Rows) -> PredictedRest | None:
        # the chassis stays where it is when a foot is moved; an operator may have written more rows
        T_planned = end_of(plan, min(number, parts_count(plan) - 1))
        return predicted_rest(self._core.robot, commands, rows, T_planned)

    def _carried_out(self, walk: str) -> frozenset[int]:
        """As :func:`carried_out_of`, counted anew when a row or the walk changed since."""
        state, known = self._core.state, self._counted
        # records are compared by identity: the fold makes a new one of what changes, and keeps the others
        if known is None or known[0] != walk or known[1] != state.commands:
            found = frozenset(carried_out_of(state, walk, self._asked_of, self._commands_of))
            self._counted = known = walk, state.commands, found
        return known[2]

    def _commanded(self, walk: str, first: int) -> int:
        """Of how many parts of a walk, from ``first`` on, the session's commands are."""
        asked = None if self._core.state.sequence is None else self._asked_of(self._core.state.sequence)
        if asked is None or (asked[0], asked[1].first) != (walk, first):
            return 0
        return asked[1].count

    def _against(self, plan: WalkPlan, number: int, count: int = 1) -> str:
        """Why ``count`` parts of a walk from ``number`` on can't begin where the rover stands; "" where they can."""
        if plan.parents.get("dem") != self._core.state.dem and (off := self._off_ground(plan, number, count)):
            return f"the terrain has changed since the walk was planned: {off}: {AGAIN}"
        now = self._fits.things_now()
        if now.stands is None:
            return "nothing is known of how the rover stands"
        where = f"the rover does not stand where {name_of(plan, number)} begins"
        doubt = "" if now.measured is None else now.measured.doubt
        for state in (now.stands,) if now.measured is None else now.measured.possible:
            off = self._off_start(state, *start_of(plan, number))
            if off and doubt:
                return f"{where}, on the map and by odometry alone: {off}: {doubt}"
            if off:
                return f"{where}: {off}: {AGAIN}"
        return ""

    def _off_start(self, state: RobotState, posture: NDArray[np.float64], T_site_base: NDArray[np.float64]) -> str:
        """How far a rover is from where a part of a walk begins; "" where commands may begin there."""
        from footfall.planning.walk_execution.off_walk import off_walk

        if self._sags:
            return off_walk(self._core.robot, state, posture, T_site_base)
        found = difference(posture, T_site_base, state, self._core.layout.joint_names)
        what = found.beyond(*SENT)
        if not what:
            return ""
        moved = f"the chassis is {found.moved:z.3f} m from there, at most {POSE_TOLERANCE:g} m are accepted"
        turned = (
            f"{joint_in_words(found.joint)} is {np.degrees(found.turned):+z.2f}° from there, "
            f"at most {np.degrees(START_TOLERANCE):z.2f}° are accepted"
        )
        return moved if what == "chassis" else turned

    def _off_ground(self, plan: WalkPlan, number: int, count: int) -> str:
        """Why the rest of a walk does not fit the present ground from foot move ``number`` on, ``count`` of which are
        to come; "" where it does.
        """
        from footfall.planning.walk_execution.ground_ahead import moved_ground, unknown_ground

        dem = self._core.typed(Dem, present(self._core.state.dem, "there is no terrain any more"))
        return moved_ground(dem, plan, number) or unknown_ground(self._core.robot, dem, plan, number, number + count)

    @property
    def _sags(self) -> bool:
        """Whether it is known how the rover gives way."""
        return self._executions.way_of_commands().mode != "rigid"

    def _walk_request(
        self, goal: WalkGoal, settings: WalkSettings, tether: Tether | None, gait: GaitSettings | None
    ) -> WalkRequest:
        settings.require_legs(self._core.description)
        # only telemetry has wheels that are pressed in: a posture that was made up stands on the ground
        return WalkRequest(goal, settings, self._rover.seen_to_give_way is True, tether, gait)

    def _walk(self, digest: str | None) -> tuple[str, WalkPlan]:
        digest = digest or present(self._core.state.newest(WALK), "there is no walk yet")
        made = self._core.state.products.get(digest)
        if made is None or made.kind != WALK.name:
            raise NotFound(f"the session holds no walk {digest}", digest=digest)
        result = self._core.typed(WalkResult, digest)
        if result.plan is None:
            raise Conflict(f"no walk was found there: {result.reason}", status=result.status.value)
        return digest, result.plan

    def _asked_of(self, sequence: str) -> tuple[str, FootMovesRequest] | None:
        """The walk that commands go back to, and which of its foot moves; None where they go back to none."""
        made = self._core.state.products.get(self._core.state.before_edits(sequence))
        if made is None or made.kind != FOOT_MOVES.name or made.settings is None:
            return None
        return made.parents["plan"], self._core.typed(FootMovesRequest, made.settings)

    def _commands_of(self, sequence: str) -> Sequence:
        return self._core.typed(Sequence, sequence)


def carried_out_of(
    state: SessionState,
    walk: str,
    asked_of: Callable[[str], tuple[str, FootMovesRequest] | None],
    commands_of: Callable[[str], Sequence],
) -> set[int]:
    """Numbers of the foot moves of a walk whose every row the rover has done in one run.

    asked_of: of a sequence, see :meth:`Walks._asked_of`; commands_of: the sequence itself.
    """
    done: dict[tuple[str, int], set[int]] = {}
    for one in state.commands:
        if one.state == "done":
            done.setdefault((one.sequence, one.run), set()).add(one.row)
    found: set[int] = set()
    for (sequence, _), rows in done.items():
        asked = asked_of(sequence)
        if asked is None or asked[0] != walk:
            continue
        groups = enumerate(foot_moves(commands_of(sequence).commands), asked[1].first)
        found |= {number for number, one in groups if rows.issuperset(range(one.first, one.first + one.count))}
    return found


def name_of(plan: WalkPlan, number: int) -> str:
    """What the part of that number is called, which counts foot moves from 1."""
    if number >= plan.foot_moves:
        return "the chassis goes to the goal"
    return f"foot move {number + 1} of {plan.foot_moves}: leg {plan.legs[number]}"
