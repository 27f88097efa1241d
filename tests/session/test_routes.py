"""A route as a product of a session: asked for, recorded with its status, told whether it still fits, replayed."""

from dataclasses import replace

import pytest

from footfall.core.errors import InvalidInput
from footfall.planning.answers import Status
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.route.problem import NoGo, RouteResult, RouteSettings
from footfall.session.jobs.product_recipes import PRODUCTS
from footfall.session.jobs.requests import RouteRequest
from footfall.session.log.fold import fold_all
from footfall.session.products.kinds import ROUTE
from footfall.session.replay.recompute import replay
from tests.support.chassis_ground import wavy

NEAR = RouteRequest((0.8, 0.3), RouteSettings(no_go=(NoGo(0.4, 0.15, 0.1),)))
OFF = RouteRequest((90.0, 0.0))


def routed(live, request):
    return live.get(live.stances.ask(ROUTE, request).finish())


def test_a_route_is_asked_for_recorded_and_replayed_to_the_same_digest(live, standing):
    found = routed(live, NEAR)
    assert (found.status, found.goal) == (Status.FOUND, NEAR.goal)
    assert found.provenance.parents["state"] == standing.digest
    assert found.provenance.settings.digest == NEAR.settings.digest
    told = live.events()[-1].payload
    assert (told["kind"], told["digest"], told["status"], told["reason"]) == ("route", found.digest, "found", "")
    assert live.get(told["settings"]).digest == NEAR.digest
    assert live.state.newest(ROUTE) == live.summary()["route"] == found.digest
    assert live.fits.up_to_date()["route"]["fits"]

    refused = routed(live, OFF)
    assert refused.status is Status.OFF_MAP
    told = live.events()[-1].payload
    assert (told["status"], told["reason"]) == ("off_map", refused.reason)
    assert live.state.newest(ROUTE) == refused.digest

    assert fold_all(live.events()).digest == live.state.digest
    report = replay(live.export_bundle())
    assert report.ok, report.problems
    assert [(one.kind, one.verdict) for one in report.products] == [("route", "same")] * 2


def test_a_route_with_headings_is_replayed_to_the_same_digest(live):
    found = routed(live, RouteRequest((0.8, 0.3), RouteSettings(cost="feasible", turning=0.5)))
    assert len(found.plan.headings) == len(found.plan.points) - 1
    report = replay(live.export_bundle())
    assert report.ok, report.problems


def test_a_replay_names_what_another_planner_makes_otherwise(live):
    found = routed(live, NEAR)

    def dearer(parents, settings, progress):
        made = PRODUCTS["route"](parents, settings, progress)
        assert isinstance(made, RouteResult)
        assert made.plan is not None, made.reason
        return replace(made, plan=replace(made.plan, cost=made.plan.cost + 0.5))

    [report] = replay(live.export_bundle(), recipes={**PRODUCTS, "route": dearer}).products
    assert (report.verdict, report.difference) == ("different", "plan.cost")
    assert report.magnitude == pytest.approx(0.5)
    assert found.plan.cost > 0.5


def test_a_route_of_other_ground_is_told_as_such(live):
    routed(live, NEAR)
    live.terrains.load(wavy(half=4.0, seed=1))
    fit = live.fits.up_to_date()["route"]
    assert not fit["fits"]
    assert fit["reason"].startswith("the terrain has changed since: by up to 0.02 m on ")


def test_in_a_what_if_a_route_starts_from_there(live):
    moved = live.stances.what_if(BodyShift(dx=0.05, dz=-0.2))
    found = routed(live, NEAR)
    assert found.provenance.parents["state"] == moved
    assert found.plan.points[0] == pytest.approx(live.get(moved).T_site_base[:2, 3])
    live.stances.end_what_if()
    assert "the rover stands elsewhere" in live.fits.up_to_date()["route"]["reason"]


def test_a_goal_that_is_no_place_is_misuse():
    for goal in ((float("nan"), 0.0), (1.0, float("inf")), (1.0,), (1.0, 2.0, 3.0)):
        with pytest.raises(InvalidInput, match="finite x and y"):
            RouteRequest(goal)  # type: ignore[arg-type]
