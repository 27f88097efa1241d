"""Taking back what was chosen, and making it again: laws over any order of choices, edits, plans and terrain."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from footfall.core.errors import Conflict, InvalidBundle
from footfall.sequence.edit import Edit
from footfall.session.access.acting import acting
from footfall.session.access.identity import Identity, Role
from footfall.session.log.event import event_of, next_event
from footfall.session.log.fold import SessionState, fold, fold_all

ADA = Identity("ada", Role.PLANNER, "192.0.2.1", "page-a")
BOB = Identity("bob", Role.PLANNER, "192.0.2.2", "page-b")
NAME = st.integers(0, 3).map(lambda i: f"{i:032x}")
LEG, PLACE = st.integers(0, 2), st.floats(-2, 2)
POINTS = st.lists(st.lists(PLACE, min_size=3, max_size=3), max_size=2)
ACTS = st.one_of(
    st.tuples(st.just("footfall"), LEG, PLACE, PLACE),
    st.tuples(st.just("points"), LEG, POINTS),
    st.tuples(st.just("asked"), NAME),
    st.tuples(st.just("alternative"), NAME),
    st.tuples(st.just("plan"), NAME),
    st.tuples(st.just("executed"), NAME),
    st.tuples(st.just("sequence"), NAME),
    st.tuples(st.just("edit"), NAME),
    st.sampled_from([("undo",), ("redo",), ("edit undone",), ("edit redone",)]),
    st.just(("undo",)),
    st.just(("redo",)),
)
PRELUDE = [
    ("footfall", 1, 0.5, 0.5),
    ("asked", f"{0:032x}"),
    ("alternative", f"{1:032x}"),
    ("executed", f"{5:032x}"),
    ("plan", f"{1:032x}"),
    ("sequence", f"{0:032x}"),
    ("edit", f"{1:032x}"),
    ("points", 1, [[0.0, 0.0, 1.0]]),
    ("edit", f"{2:032x}"),
]
"""Something of each kind, so that most of what comes after it can be done."""
CHANGED = (
    *("footfall", "points", "plan", "plan_status", "plan_reason", "alternatives"),
    *("execution", "execution_status", "execution_reason", "sequence", "sequence_history"),
)


class Log:
    """Events, each one of which may follow the one before."""

    def __init__(self):
        self.events, self.state = [], SessionState()

    def record(self, type, **payload):
        event = next_event(self.events[-1] if self.events else None, 1000.0 + len(self.events), type, payload)
        self.state = fold(self.state, event)
        self.events.append(event)

    def product(self, kind, digest, **about):
        parents = {"sequence": self.state.sequence or "", "plan": self.state.plan or "", **about.pop("parents", {})}
        self.record("product", kind=kind, digest=digest, parents=parents, settings=None, **about)

    def act(self, kind, *about):
        """Do it where it can be done."""
        state = self.state
        told = {"status": "found", "reason": ""}
        match kind:
            case "footfall":
                self.record("footfall_chosen", **dict(zip(("leg", "x", "y"), about, strict=True)))
            case "points":
                self.record("points_set", leg=about[0], points=about[1])
            case "asked":
                self.product("plan", about[0], **told)
            case "alternative" if state.plan is not None:
                to = {"to": state.plan, "kind": "higher_lift", "text": "higher"}
                self.product("plan", about[0], alternative=to, **told)
            case "plan" if any(one.plan == about[0] for one in state.alternatives):
                self.record("plan_chosen", digest=about[0])
            case "executed" if state.plan is not None:
                self.product("execution", about[0], **told)
            case "sequence":
                self.product("sequence", about[0])
            case "edit" if state.sequence is not None:
                self.product("edit", about[0])
            case "undo" if state.choices:
                self.record("choice_undone", choice=state.choices[-1].seq)
            case "redo" if state.choices_ahead:
                self.record("choice_redone", choice=state.choices_ahead[-1].seq)
            case "edit undone" if state.sequence_history:
                self.record("sequence_undone", digest=state.sequence_history[-1])
            case "edit redone" if state.sequence_ahead:
                self.record("sequence_redone", digest=state.sequence_ahead[-1])


def chosen(state):
    """Digest of all that a choice can change."""
    return replace(state, choices=(), choices_ahead=(), products={}).digest


def logged(acts):
    log = Log()
    for act in [*PRELUDE, *acts]:
        log.act(*act)
    return log


HISTORIES = st.lists(ACTS, min_size=4, max_size=16).map(logged)


@given(HISTORIES)
@settings(max_examples=80)
def test_undo_then_redo_is_the_state_as_it_was(log):
    before = log.state
    steps = len(before.choices)
    seen = []
    for _ in range(steps):
        seen.append(chosen(log.state))
        log.act("undo")
    assert log.state.choices == ()
    for one in reversed(seen):
        log.act("redo")
        assert chosen(log.state) == one
    assert log.state.digest == before.digest


@given(HISTORIES, ACTS.filter(lambda act: act[0] in ("footfall", "points", "plan", "edit")))
@settings(max_examples=80)
def test_undo_takes_back_exactly_the_latest_choice(log, act):
    before = log.state
    log.act(*act)
    if log.state.choices == before.choices:
        # nothing was chosen: an alternative that is not there, or what was chosen already
        assert chosen(log.state) == chosen(before)
        assert log.state.choices_ahead == before.choices_ahead
        return
    assert log.state.choices_ahead == ()
    log.act("undo")
    for name in CHANGED:
        was, now = getattr(before, name), getattr(log.state, name)
        assert now == was or now.digest == was.digest, name
    assert [one.seq for one in log.state.choices] == [one.seq for one in before.choices]


@given(HISTORIES)
@settings(max_examples=80)
def test_the_histories_of_choices_and_of_edits_agree(log):
    state = log.state
    edits = [one.other["sequence"] for one in state.choices if one.kind == "edit"]
    assert edits == list(state.sequence_history)
    ahead = [one.other["sequence"] for one in state.choices_ahead if one.kind == "edit"]
    assert ahead == list(state.sequence_ahead)[len(state.sequence_ahead) - len(ahead) :]
    able = {one.plan for one in state.alternatives}
    assert all(one.other["plan"] in able for one in (*state.choices, *state.choices_ahead) if one.kind == "plan")
    # nothing is ever taken out of the log, and it reads the same from the disk
    assert fold_all([event_of(event.as_dict()) for event in log.events]).digest == state.digest


def test_the_plan_before_comes_back_with_how_it_was_to_be_executed():
    log = logged([])
    assert (log.state.plan, log.state.execution) == (f"{1:032x}", None)
    while log.state.plan != f"{0:032x}":
        log.act("undo")
    assert (log.state.execution, log.state.execution_status) == (f"{5:032x}", "found")


def test_what_is_not_the_latest_choice_is_no_undo():
    log = logged([("footfall", 1, 0.6, 0.5), ("footfall", 1, 0.7, 0.5)])
    first = log.state.choices[0].seq
    with pytest.raises(InvalidBundle, match="not the latest"):
        log.record("choice_undone", choice=first)
    with pytest.raises(InvalidBundle, match="not taken back last"):
        log.record("choice_redone", choice=first)


def test_choices_of_a_session_go_back_in_their_order(session):
    session.plans.step(2, (1.0, 0.0)).finish()
    with acting(ADA):
        session.maps.choose_footfall(2, 1.0, 0.0)
        sequence = session.sequences.make()
        edited = session.sequences.edit(sequence, Edit("duration", 0, number=20.0))
    with acting(BOB):
        session.choices.set_points(2, [(0.5, 0.0, 0.9)])
        session.maps.choose_footfall(3, 0.5, 0.5)
    kinds = [(one.kind, one.leg, one.by) for one in session.state.choices]
    assert kinds == [("footfall", 2, "ada"), ("edit", None, "ada"), ("points", 2, "bob"), ("footfall", 3, "bob")]
    count = len(session.events())

    assert session.choices.undo().kind == "footfall"
    assert (session.state.footfall.leg, session.state.footfall.x) == (2, 1.0)
    assert session.choices.undo().kind == "points"
    assert session.state.points is None
    assert session.choices.undo().kind == "edit"
    assert session.state.sequence == sequence
    assert session.choices.undo().kind == "footfall"
    assert session.state.footfall is None
    with pytest.raises(Conflict, match="nothing to undo"):
        session.choices.undo()
    for kind in ("footfall", "edit", "points", "footfall"):
        assert session.choices.redo().kind == kind
    with pytest.raises(Conflict, match="nothing to redo"):
        session.choices.redo()
    assert session.state.sequence == edited
    assert session.summary()["footfall"]["leg"] == 3
    # each was an event of its own; none was taken out
    assert [event.type for event in session.events(count)] == ["choice_undone"] * 4 + ["choice_redone"] * 4


def test_who_did_it_is_in_the_log_also_of_what_a_job_made(session):
    with acting(ADA):
        session.plans.step(2, (1.0, 0.0)).finish()
        session.add_note("by ada")
    session.add_note("by a script")
    plan, note, script = session.events()[-3:]
    assert plan.payload["kind"] == "plan"
    assert plan.payload["by"] == note.payload["by"] == ADA.as_dict()
    assert "by" not in script.payload


def test_a_choice_that_is_not_the_latest_any_more_is_refused(session):
    session.maps.choose_footfall(2, 1.0, 0.0)
    mine = session.choices.undoable["undo"]["choice"]
    session.maps.choose_footfall(2, 1.1, 0.0)
    with pytest.raises(Conflict, match="since") as refused:
        session.choices.undo(mine)
    assert refused.value.details["present"] == session.choices.undoable["undo"]["choice"] != mine
    assert session.state.footfall.x == 1.1
    # the same once more is no choice to take back
    session.maps.choose_footfall(2, 1.1, 0.0)
    session.choices.undo()
    assert session.state.footfall.x == 1.0
