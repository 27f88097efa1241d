"""Which commands the rover has carried out to their last row, and what of the planned is left to make commands of."""

from collections.abc import Callable, Iterable, Mapping

from footfall.planning.answers import Status
from footfall.session.answers.plans import ToCommand
from footfall.session.log.event import Event
from footfall.session.log.fold import SessionState
from footfall.session.log.fold_queue import queues_behind
from footfall.session.products.kinds import COMMANDED, EXECUTION, KINDS, QUEUE


def carried_out(state: SessionState, rows_of: Callable[[str], int]) -> dict[str, float]:
    """Sequences of which one run had every row done → when the last of these was. rows_of: of a sequence."""
    done: dict[tuple[str, int], dict[int, float]] = {}
    for one in state.commands:
        if one.state == "done":
            done.setdefault((one.sequence, one.run), {})[one.row] = one.time
    return {sequence: max(rows.values()) for (sequence, _), rows in done.items() if len(rows) == rows_of(sequence)}


def moved_by(state: SessionState, sequence: str) -> set[str]:
    """Digests of the plan, execution, move of the chassis or queue that commands go back to, through edits and
    execution; of a queue, of its entries, too.
    """
    made = state.products.get(state.before_edits(sequence))
    if made is None:
        return set()
    behind = {made.parents[name] for name in COMMANDED if name in made.parents}
    executed = state.products.get(made.parents.get("execution", ""))
    if executed is not None:
        behind |= {executed.parents["plan"]}
    for digest in tuple(behind):
        behind |= _queued_in(state, digest)
    return behind


def _queued_in(state: SessionState, digest: str) -> set[str]:
    """Digests of what is in a queue, and of the shorter queues that it was made of; none of what is no queue."""
    if state.kind_of(digest) is not QUEUE:
        return set()
    queues = [one for one in queues_behind(state.products, digest) if one is not None]
    return {*queues, *(state.products[one].parents["plan"] for one in queues)}


def planned_behind(state: SessionState, sequence: str) -> str:
    """Digest of the plan, move, walk or queue that commands go back to, through edits and executions; "" for none."""
    made = state.products.get(state.before_edits(sequence))
    executed = None if made is None else state.products.get(made.parents.get("execution", ""))
    behind = executed or made
    return "" if behind is None else behind.parents.get("plan", "")


def to_command(
    state: SessionState, events: Iterable[Event], finished: Mapping[str, float], found: Callable[[str], bool]
) -> ToCommand | None:
    """What commands are to be made of: the planned step, its execution, the move of the chassis, the queue, or the walk
    that is commanded as a whole, that came last, of those that can be carried out and were not; None where there is
    none.

    finished: as :func:`carried_out`. found: whether the answer of that digest is one that can be carried out; asked of
    answers whose status no event says. Answers with digest,
    kind, step (the planned step that it is or is made of; None: a move, a walk), plan (the step, move or walk that it
    is or is made of), leg (None: all of them), and text, for a person.
    """
    made: dict[str, Event] = {}  # or chosen
    legs: dict[str, int | None] = {}
    for event in events:
        if event.type in ("product", "plan_chosen", "queue_shortened"):
            made[event.payload["digest"]] = event
        if event.type == "product":
            legs[event.payload["digest"]] = event.payload.get("leg")
    said = {state.plan: state.plan_status, state.execution: state.execution_status}
    newest = [state.newest(kind) for kind in KINDS.values() if kind.offered]
    able = [one for one in newest if one is not None and _is_found(said, one, found)]
    over = {digest: when for one, when in finished.items() for digest in moved_by(state, one)}
    # the same may have been planned again since
    left = [one for one in able if all(over.get(part, -float("inf")) < made[part].time for part in _parts(state, one))]
    if not left:
        return None
    digest = max(left, key=lambda one: made[one].seq)
    made_as = state.products[digest]
    kind = KINDS[made_as.kind]
    step = digest if kind.plays == "step" else made_as.parents["plan"] if kind is EXECUTION else None
    leg = None if step is None else legs.get(step)
    named = kind.offered if leg is None else f"leg {leg}"
    text = named + (", for sag" if kind.given_as == EXECUTION.given_as else "")
    return {
        "digest": digest,
        "kind": kind.name,
        "step": step,
        "plan": _parts(state, digest)[-1],
        "leg": leg,
        "text": text,
    }


def _parts(state: SessionState, digest: str) -> tuple[str, ...]:
    """What was carried out where this was: itself, and the plan that it executes."""
    made = state.products[digest]
    return (digest, made.parents["plan"]) if KINDS[made.kind].given_as == EXECUTION.given_as else (digest,)


def _is_found(said: Mapping[str | None, str | None], digest: str, found: Callable[[str], bool]) -> bool:
    return said[digest] == Status.FOUND.value if digest in said else found(digest)
