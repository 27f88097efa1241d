"""A walk as a product of a session: asked for, recorded with its status, told whether it still fits, replayed."""

from dataclasses import replace
from itertools import count
from types import SimpleNamespace

import numpy as np
import pytest

from footfall.balance.tether import EDGE, Tether
from footfall.core.errors import InvalidInput
from footfall.planning import watch
from footfall.planning.answers import Status
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.motion import BODY
from footfall.planning.walk import smooth
from footfall.planning.walk.problem import Place, WalkGoal, WalkResult, WalkSettings
from footfall.planning.walk.smoothing import Smoothing
from footfall.sequence.edit import Edit
from footfall.session.jobs.product_recipes import PRODUCTS
from footfall.session.jobs.requests import WalkRequest
from footfall.session.log.fold import fold_all
from footfall.session.products.kinds import WALK
from footfall.session.replay.recompute import PATIENCE, replay
from footfall.session.steadiness import along
from tests.support.chassis_ground import wavy

LOAD = {"payload_mass": 40.0, "payload_position": np.array([0.2, 0.1, 0.4])}
NEAR = WalkRequest(WalkGoal(0.4, 0.1, 0.0), WalkSettings(seed=1, forbidden=(Place(3.0, 3.0, leg=1),), **LOAD))
TETHER = Tether(np.array([-3.2, 1.9, 2.0]), np.array(EDGE))
ON_TETHER = WalkRequest(WalkGoal(0.4, 0.1, 0.0), WalkSettings(seed=1, smoothing=Smoothing(rounds=0)), tether=TETHER)
OFF = WalkRequest(WalkGoal(90.0, 0.0), WalkSettings())


def walked(live, request):
    return live.get(live.stances.ask(WALK, request).finish())


def test_a_walk_is_asked_for_recorded_and_replayed_to_the_same_digest(live, standing):
    found = walked(live, NEAR)
    assert (found.status, found.goal.digest) == (Status.FOUND, NEAR.goal.digest)
    assert found.provenance.parents["state"] == standing.digest
    told = live.events()[-1].payload
    assert (told["kind"], told["digest"], told["status"], told["reason"]) == ("walk", found.digest, "found", "")
    assert live.get(told["settings"]).digest == NEAR.digest
    assert live.state.newest(WALK) == live.summary()["walk"] == found.digest
    assert live.fits.up_to_date()["walk"]["fits"]

    refused = walked(live, OFF)
    assert refused.status is Status.OFF_MAP
    told = live.events()[-1].payload
    assert (told["status"], told["reason"]) == ("off_map", refused.reason)
    assert refused.reason
    assert live.state.newest(WALK) == refused.digest

    assert fold_all(live.events()).digest == live.state.digest
    report = replay(live.export_bundle())
    assert report.ok, report.problems
    assert [(one.kind, one.verdict) for one in report.products] == [("walk", "same")] * 2


def test_a_walk_on_a_tether_is_recorded_with_it_replayed_and_planned_again_on_it(live):
    found = walked(live, ON_TETHER)
    assert found.status is Status.FOUND, found.reason
    assert found.plan.tethered.tether.digest == TETHER.digest
    assert found.provenance.parents["tether"] == TETHER.digest
    assert live.get(live.events()[-1].payload["settings"]).digest == ON_TETHER.digest
    again = live.get(live.walks.replan().finish())
    assert again.digest == found.digest
    under = walked(live, replace(ON_TETHER, tether=replace(TETHER, anchor=np.array([-3.2, 1.9, -1.0]))))
    assert under.status is Status.START_INVALID
    assert "below the ground" in under.reason
    report = replay(live.export_bundle())
    assert report.ok, report.problems
    assert [(one.kind, one.verdict) for one in report.products] == [("walk", "same")] * 3


def test_commands_of_a_walk_on_a_tether_are_made_and_say_that_none_drives_its_drum(live):
    found = walked(live, ON_TETHER)
    sequence = live.get(live.walks.command(found.digest, 0, 1, as_commanded=True))
    [rule] = [one for one in sequence.rules if one.rule == "tether"]
    assert not rule.holds
    assert "none drives its drum" in rule.text


def test_a_replay_names_what_another_planner_makes_otherwise(live):
    walked(live, NEAR)

    def found(parents, settings, progress):
        made = PRODUCTS["walk"](parents, settings, progress)
        assert isinstance(made, WalkResult)
        assert made.plan is not None, made.reason
        return made, made.plan

    def otherwise(parents, settings, progress):
        made, plan = found(parents, settings, progress)
        margins = np.array(plan.margins)
        margins[0] += 0.5
        return replace(made, plan=replace(plan, margins=margins))

    def out_of_time(parents, settings, progress):
        made, plan = found(parents, settings, progress)
        return replace(made, status=Status.TIME_LIMIT, plan=None, reason="60 s passed", partial=plan)

    bundle = live.export_bundle()
    [report] = replay(bundle, recipes={**PRODUCTS, "walk": otherwise}).products
    assert (report.verdict, report.difference, report.magnitude) == ("different", "plan.margins[0]", 0.5)
    [report] = replay(bundle, recipes={**PRODUCTS, "walk": out_of_time}).products
    assert "ran into its time limit in this replay" in report.text


@pytest.mark.usefixtures("forgotten")
def test_a_slow_machine_replays_what_a_fast_one_found(live, remembered, monkeypatch):
    """The clock goes on by the same at every look at it, so that the walk takes three times its limit."""

    def each_look_takes(seconds):
        looks = count()
        monkeypatch.setattr(watch, "time", SimpleNamespace(monotonic=lambda: seconds * next(looks)))
        return looks

    found = walked(live, NEAR)
    bundle = live.export_bundle()
    looks = each_look_takes(0.0)
    assert replay(bundle).ok
    lasted = 3 * NEAR.settings.time_limit
    assert lasted < PATIENCE * NEAR.settings.time_limit
    slowly = lasted / next(looks)
    each_look_takes(slowly)
    assert replay(bundle).ok
    # what is asked for anew has the limit that was set
    remembered.clear()
    each_look_takes(slowly)
    assert walked(live, NEAR).digest != found.digest


@pytest.mark.usefixtures("forgotten")
def test_a_walk_whose_smoothing_ran_out_of_time_says_so_and_a_replay_blames_nobody(live, remembered, monkeypatch):
    def late(self, number):
        raise watch.OutOfTime

    with monkeypatch.context() as patch:
        patch.setattr(smooth._Smoothing, "_better", late)
        found = walked(live, NEAR)
    assert (found.status, found.smoothed.cut_short) == (Status.FOUND, True)
    remembered.clear()
    [report] = replay(live.export_bundle()).products
    assert (report.verdict, report.ok) == ("not_reproducible", True)
    assert "ran into its time limit when it was recorded" in report.text
    assert report.recomputed == walked(live, NEAR).digest != found.digest


def test_a_walk_of_other_ground_is_told_as_such(live):
    walked(live, NEAR)
    live.terrains.load(wavy(half=4.0, seed=1))
    fit = live.fits.up_to_date()["walk"]
    assert not fit["fits"]
    assert fit["reason"].startswith("the terrain has changed since: by up to 0.02 m on ")


def test_in_a_what_if_a_walk_starts_from_there(live):
    lower = live.stances.what_if(BodyShift(dz=-0.2))
    found = walked(live, NEAR)
    assert found.provenance.parents["state"] == lower
    if found.plan is not None:
        np.testing.assert_array_equal(found.plan.waypoints[0], live.get(lower).posture)
    assert live.fits.up_to_date()["walk"]["fits"]
    live.stances.end_what_if()
    assert "the rover stands elsewhere" in live.fits.up_to_date()["walk"]["reason"]


def test_a_walk_becomes_commands_that_replay_and_are_edited(live):
    found = walked(live, NEAR)
    with pytest.raises(InvalidInput, match=r"a walk take no settings of sag: .* foot moves"):
        live.sequences.make(found.digest, ExecutionSettings(mode="droop_aware"))
    digest = live.sequences.make(found.digest)
    made = live.get(digest)
    assert made.valid, [(rule.rule, rule.row, rule.text) for rule in made.failures]
    np.testing.assert_allclose(made.predicted[-1], found.plan.waypoints[-1], atol=1e-9)
    np.testing.assert_allclose(made.poses[-1], found.plan.Ts_site_base[-1], atol=1e-6)
    assert live.state.sequence == digest
    as_planned, as_commanded = (along(live, one).course for one in (found.digest, digest))
    in_body = [row for row, phase in enumerate(found.plan.phases[1:]) if phase == BODY]
    for course in (as_planned, as_commanded):
        ends = [course.margins["plain"][course.rows == row][-1] for row in in_body]
        # with what it carries
        np.testing.assert_allclose(ends, found.plan.margins[1:][in_body], atol=2e-3)
    live.sequences.edit(digest, Edit("duration", 0, number=30.0))
    live.sequences.export(format="csv")
    live.summary()
    report = replay(live.export_bundle())
    assert report.ok, report.problems
    assert [one.kind for one in report.products] == ["walk", "sequence", "edit", "export"]


def test_a_refused_walk_becomes_no_commands(live):
    refused = walked(live, OFF)
    with pytest.raises(InvalidInput, match=r"there is no plan to make commands of: .*off the map"):
        live.sequences.make(refused.digest)
