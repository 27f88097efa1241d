"""A whole session through the one object that owns it."""

import json

import pytest

from footfall.core.errors import Conflict, InvalidInput, InvalidTelemetry, NotFound
from footfall.planning.step.problem import StepSettings
from footfall.sequence.edit import Edit
from footfall.session.log.fold import fold_all
from footfall.session.storage.sqlite_log import SqliteLog


def planned(session, leg=2, target=(1.0, 0.0)):
    session.plans.step(leg, target).finish()
    return session.sequences.make()


def test_from_state_to_export(session):
    session.maps.compute(2).finish()
    answer = session.maps.choose_footfall(2, 1.0, 0.5)
    assert answer["acceptable"] is True
    assert answer["known"] is True
    assert answer["z"] == 0.0
    assert answer["reasons"] == []
    digest = session.plans.step(2).finish()
    assert session.state.plan == digest
    sequence = session.sequences.make()
    edited = session.sequences.edit(sequence, Edit("duration", 0, number=20.0))
    assert session.state.sequence == edited != sequence
    assert session.sequences.undo() == sequence
    assert session.state.sequence_history == ()
    assert session.sequences.redo() == edited == session.state.sequence
    with pytest.raises(Conflict, match="no undone edit"):
        session.sequences.redo()
    session.sequences.undo()
    other = session.sequences.edit(sequence, Edit("duration", 0, number=21.0))
    with pytest.raises(Conflict, match="no undone edit"):
        session.sequences.redo()
    assert session.sequences.undo() == sequence != other
    data = session.sequences.export(format="csv")
    assert session.get_bytes(session.state.exports[0].digest) == data
    json.dumps(session.summary(), allow_nan=False)


def test_reopening_gives_the_same_state(sessions, session):
    planned(session)
    session.add_note("  a note ")
    state, events = session.state, session.events()
    session_id = session.id
    session.close()
    del sessions._open[session_id]
    again = sessions.open(session_id)
    assert again.events()[: len(events)] == events
    assert [e.type for e in again.events(len(events))] == ["session_opened"]
    assert again.state.digest == state.digest
    assert fold_all(again.events()).digest == state.digest


def test_maps_become_outdated(session, tiny):
    session.maps.compute(1).finish()
    assert session.fits.of_maps(1).fits
    session.terrains.load(tiny.dem(0.1))
    assert not session.fits.of_maps(1).fits
    answer = session.maps.choose_footfall(1, 0.0, 0.0)
    assert answer["footing"] is None
    assert "the terrain has changed since" in answer["reasons"][0]


def test_footfalls_off_the_map_and_in_the_unknown(session):
    answer = session.maps.choose_footfall(0, 100.0, 0.0)
    assert answer["acceptable"] is False
    assert answer["z"] is None
    assert "not on the terrain map" in answer["reasons"][0]


def test_a_refused_plan_is_a_product_with_its_reason(session):
    session.plans.step(0, (2.5, 0.0)).finish()
    assert session.state.plan_status == "goal_invalid"
    with pytest.raises(InvalidInput, match="can't reach"):
        session.sequences.make()
    assert session.events()[-1].type == "job_failed"


def test_what_is_missing_is_said(sessions, state_of):
    live = sessions.create("empty")
    with pytest.raises(Conflict, match="terrain"):
        live.plans.step(0, (1.0, 0.0))
    with pytest.raises(Conflict, match="images"):
        live.terrains.build()
    with pytest.raises(Conflict, match="telemetry"):
        live.stances.freeze()
    with pytest.raises(Conflict, match="sequence"):
        live.sequences.export()
    with pytest.raises(Conflict, match="no rover"):
        live.rover.request_images()
    with pytest.raises(NotFound, match="no value"):
        live.get("0" * 32)
    with pytest.raises(NotFound):
        live.get("../../session")
    with pytest.raises(InvalidInput, match="legs 0…5"):
        live.maps.compute(6)
    with pytest.raises(InvalidInput, match="layer"):
        live.choices.set_view(layer="colour")


def test_a_state_of_another_robot_is_refused(session, state_of):
    from dataclasses import replace

    with pytest.raises(InvalidTelemetry, match="another"):
        session.stances.set(replace(state_of(), robot="another"))


def test_editing_an_outdated_sequence_conflicts(session):
    first = planned(session)
    session.sequences.edit(first, Edit("duration", 0, number=20.0))
    with pytest.raises(Conflict, match="changed"):
        session.sequences.edit(first, Edit("duration", 0, number=30.0))


def test_listeners_hear_in_order_and_may_fail(session, caplog):
    heard = []

    def broken(message):
        raise RuntimeError("a broken listener")

    unlisten_broken = session.listen(broken)
    unlisten = session.listen(heard.append)
    session.add_note("one")
    session.choices.set_view(leg=3, scrub=0.5)
    session.plans.step(0, (1.0, 0.0)).finish()
    unlisten()
    unlisten_broken()
    session.add_note("two")
    kinds = [message["type"] for message in heard]
    assert kinds[:2] == ["event", "view"]
    assert heard[1]["view"]["leg"] == 3
    assert heard[0]["event"]["payload"] == {"text": "one"}
    assert "job" in kinds
    product = kinds.index("event", 2)
    done = next(i for i, m in enumerate(heard) if m["type"] == "job" and m["job"]["state"] == "done")
    assert product < done
    assert "a listener failed" in caplog.text


def test_a_log_that_can_not_be_written_changes_nothing(session, monkeypatch):
    state, count = session.state, len(session.events())

    def full(*_):
        raise OSError("no space left")

    monkeypatch.setattr(SqliteLog, "append", full)
    with pytest.raises(OSError, match="no space"):
        session.add_note("lost")
    assert session.state is state
    monkeypatch.undo()
    session.add_note("kept")
    assert len(session.events()) == count + 1


def test_settings_reach_the_recipe(session):
    digest = session.plans.step(0, (3.5, 0.0), StepSettings(planner="line")).finish()
    assert session.get(digest).provenance.settings.planner == "line"
    assert session.state.plan_status == "time_limit"


def test_the_ghost_plays_what_would_be_sent(session):
    plan = session.plans.step(2, (1.0, 0.0)).finish()
    made = session.sequences.make()
    assert session.review.played == plan
    assert not session.review.commands_of_another_plan
    edited = session.sequences.edit(made, Edit("duration", 0, number=20.0))
    assert session.review.played == edited
    assert not session.review.commands_of_another_plan
    session.sequences.undo()
    assert session.review.played == plan
    session.sequences.redo()
    assert session.review.played == edited
    other = session.plans.step(2, (1.1, 0.0)).finish()
    assert session.review.played == other != plan
    assert session.review.commands_of_another_plan
    session.sequences.make()
    assert not session.review.commands_of_another_plan
