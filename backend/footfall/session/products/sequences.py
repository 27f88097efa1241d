"""Commands of a session: made, edited, undone, read from files and written to them."""

import numpy as np

from footfall.core.errors import Conflict, InvalidInput, NotFound
from footfall.core.value import Value
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.sequence.commands import Sequence
from footfall.session.core import SessionCore, present
from footfall.session.jobs.requests import ExportRequest, ImportRequest
from footfall.session.products.executions import Executions
from footfall.session.products.kinds import COMMANDED, EDIT, EXPORT, FOOT_MOVES, IMPORT, SEQUENCE, WALK
from footfall.session.products.stances import Stances
from footfall.session.products.terrains import SHORT_JOB


class Sequences:
    """The commands of a session; thread-safe as :class:`footfall.session.core.SessionCore` says."""

    def __init__(self, core: SessionCore, stances: Stances, executions: Executions) -> None:
        self._core, self._stances, self._executions = core, stances, executions

    def make(
        self, plan_digest: str | None = None, settings: ExecutionSettings | None = None, *, as_commanded: bool = False
    ) -> str:
        """Commands of a planned step, its execution, a move of the chassis, a queue or a walk (None: the present
        step's).

        Returns their digest. A step is commanded as ``settings`` say (None: with the pose held), and a move of the
        chassis or a queue with the pose held, sag predicted, where that is known (:meth:`.Executions.way_of_commands`).
        as_commanded: as it was planned, whether or not the rover sags; where it ends is then not predicted. Raises
        Conflict, InvalidInput, NotFound.
        """
        plan = plan_digest or present(self._core.state.plan, self._which_plan())
        made, kind = self._core.state.products.get(plan), self._core.state.kind_of(plan)
        if made is None or kind is None or kind.given_as not in COMMANDED:
            raise NotFound(f"the session holds no plan {plan}", digest=plan)
        if as_commanded and settings is not None:
            raise InvalidInput(
                "commands as planned predict no sag, so they take no settings of it: leave out one of them"
            )
        if settings is not None and not kind.executed_by:
            instead = ", or make those of its foot moves" if kind is WALK else ""
            raise InvalidInput(
                f"commands of a {kind.name.replace('_', ' ')} take no settings of sag: leave them out{instead}"
            )
        for_sag = kind.executed_by and not as_commanded and self._executions.way_of_commands().mode != "rigid"
        if for_sag and getattr(self._core.get(plan), "plan", None) is not None:
            return self.make(self._executions.executed(plan, settings))
        parents = {"robot": self._core.robot_digest, kind.given_as: plan, "dem": made.parents["dem"]}
        return self._core.product_jobs.submit(SEQUENCE, parents, None, urgent=True).finish(SHORT_JOB)

    def _which_plan(self) -> str:
        """What is missing where no plan is named: of a robot that others described none is the present one."""
        if self._core.described is None:
            return "there is no plan yet"
        return "say which step or walk to make commands of: give its digest as plan"

    def edit(self, digest: str, edit: Value) -> str:
        """Apply an Edit to the present sequence, which ``digest`` must name. Raises Conflict, InvalidSequence."""
        self._require_present(digest)
        parents = {
            "robot": self._core.robot_digest,
            "sequence": digest,
            "dem": present(self.planned_on(digest), "the sequence goes back to no plan"),
        }
        if self._core.described is not None and (behind := self._core.state.plan_behind(digest)) is not None:
            parents["state"] = behind.parents["state"]  # its feet told the ground under them
        return self._core.product_jobs.submit(EDIT, parents, edit, urgent=True).finish(SHORT_JOB)

    def import_file(self, name: str, content: bytes, *, as_commanded: bool = False) -> str:
        """Commands from a file become the present sequence, every rule checked anew; returns the digest.

        name: of the file; its ending says the format. A file that doesn't say from where its commands start is taken
        to start where the rover stands, sagging as it is known to, and the state is then a parent of the sequence.
        as_commanded: of such a file, that its commands were made as planned, and no sag is predicted. Raises Conflict
        without terrain and state, InvalidSequence, naming the place, where the file can't be used.
        """
        set_points = None if as_commanded else self._executions.set_points_now()
        request = ImportRequest(name, np.frombuffer(content, np.uint8), set_points)
        return self._stances.ask(IMPORT, request, urgent=True).finish(SHORT_JOB)

    def undo(self, digest: str | None = None) -> str:
        """Go back to before the latest edit; returns that digest. Raises Conflict where there is none.

        digest: of the sequence that is meant; Conflict where it is another one by now. None: whichever it is.
        """
        with self._core.folded_log.lock:
            self._require_present(digest)
            if not self._core.state.sequence_history:
                raise Conflict("there is no edit to undo")
            before = self._core.state.sequence_history[-1]
            self._core.folded_log.record("sequence_undone", {"digest": before})
        return before

    def redo(self, digest: str | None = None) -> str:
        """Make the edit again that was undone last; returns the digest. digest, and what is raised: as :meth:`undo`."""
        with self._core.folded_log.lock:
            self._require_present(digest)
            if not self._core.state.sequence_ahead:
                raise Conflict("there is no undone edit to redo")
            again = self._core.state.sequence_ahead[-1]
            self._core.folded_log.record("sequence_redone", {"digest": again})
        return again

    def _require_present(self, digest: str | None) -> None:
        there = self._core.state.sequence
        if digest not in (None, there):
            raise Conflict("the sequence has changed since you read it", yours=digest, present=there)

    def export(self, digest: str | None = None, format: str = "seqjson") -> bytes:
        """A sequence (None: the present one) as a file. Raises InvalidSequence where a rule does not hold."""
        parents = {"sequence": self.named(digest)}
        job = self._core.product_jobs.submit(EXPORT, parents, ExportRequest(format), format=format, urgent=True)
        return self._core.get_bytes(job.finish(SHORT_JOB))

    def planned_on(self, sequence: str) -> str | None:
        """Digest of the terrain that the plan behind a sequence was made on; of foot moves, that those were."""
        own = self._core.state.products.get(self._core.state.before_edits(sequence))
        behind = own if own is not None and own.kind == FOOT_MOVES.name else self._core.state.plan_behind(sequence)
        return None if behind is None else behind.parents["dem"]

    def rows_of(self, sequence: str) -> int:
        """How many rows a sequence has."""
        return len(self._core.typed(Sequence, sequence).commands)

    def named(self, digest: str | None) -> str:
        """``digest``, or that of the present sequence. Raises Conflict where there is none."""
        return digest or present(self._core.state.sequence, "there is no sequence yet; make one from a plan")
