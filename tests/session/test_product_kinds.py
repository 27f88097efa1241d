"""What a new kind of product costs the session: an entry in the table, and a recipe. All else reads the entry."""

from dataclasses import replace

import pytest

from footfall.core.errors import InvalidInput
from footfall.planning.body.body_shift import BodyShift
from footfall.session.jobs.product_recipes import PRODUCTS
from footfall.session.log.fold import fold_all
from footfall.session.products.kinds import BODY_MOVE, GROUND, KINDS, OUTCOME, Kind
from footfall.session.replay.recompute import replay

SHIFT = BodyShift(dx=0.25)


def echo(parents, settings, progress):
    """The recipe: robot, dem, state; BodyShift → the state at another time."""
    return replace(parents["state"], time=settings.dx)


def another(parents, settings, progress):
    return replace(parents["state"], time=settings.dx + 1.0)


@pytest.fixture
def kind(monkeypatch, tiny):
    entry = Kind(
        name="echo",
        makes="RobotState",
        request="BodyShift",
        needs=GROUND,
        recipe=f"{__name__}:echo",
        from_the_rover=True,
        watched=True,
    )
    monkeypatch.setitem(KINDS, entry.name, entry)
    monkeypatch.setitem(tiny.RECIPES, entry.name, PRODUCTS[entry.name])
    return entry


def test_a_new_kind_is_asked_for_told_kept_taken_in_and_recomputed(kind, sessions, session, monkeypatch):
    digest = session.stances.ask(kind, SHIFT).finish()
    assert session.get(digest).time == SHIFT.dx
    told = session.events()[-1]
    assert (told.type, told.payload["kind"], told.payload["digest"]) == ("product", "echo", digest)
    assert session.state.newest(kind) == session.summary()["echo"] == digest
    assert session.fits.up_to_date()["echo"]["fits"]
    assert fold_all(session.events()).digest == session.state.digest
    bundle = session.export_bundle()
    assert sessions.import_bundle(bundle).state.newest(kind) == digest
    [report] = replay(bundle).products
    assert (report.kind, report.verdict) == ("echo", "same")
    monkeypatch.setitem(KINDS, "echo", replace(kind, recipe=f"{__name__}:another"))
    [report] = replay(bundle).products
    assert (report.verdict, report.difference, report.magnitude) == ("different", "time", 1.0)


def test_a_kind_is_asked_for_with_its_own_request_and_parents(kind, session):
    events = len(session.events())
    with pytest.raises(InvalidInput, match="echo is asked for with BodyShift"):
        session.stances.ask(kind, None)
    with pytest.raises(InvalidInput, match="body_move is asked for with BodyMoveRequest"):
        session.stances.ask(BODY_MOVE, SHIFT)
    with pytest.raises(InvalidInput, match="outcome is made of robot, dem, state, sequence"):
        session.stances.ask(OUTCOME, None)
    assert len(session.events()) == events
