"""A route on a newer map is made of what was found for the map before, and is that of a map that is looked at whole."""

from dataclasses import replace

import numpy as np

import footfall
from footfall.core.progress import no_progress
from footfall.maps.layers import MapSettings
from footfall.maps.traversability import traversability
from footfall.planning.route import feasible
from footfall.planning.route.problem import RouteSettings
from footfall.session.jobs import latest_ground, product_recipes
from footfall.session.jobs.latest_ground import LatestGround
from footfall.session.jobs.requests import RouteRequest
from footfall.terrain.from_arrays import from_heights

ASKED = RouteSettings(resolution=0.3, cost="feasible")


def ground(heights):
    return from_heights(np.asarray(heights, np.float32), ASKED.resolution, 0.0, 0.0, "made")


def test_a_route_on_a_newer_map_looks_at_what_changed_and_is_that_of_a_map_looked_at_whole(athlete, monkeypatch):
    heights = np.zeros((400, 400))
    state, goal = footfall.stand(athlete, ground(heights), x=6.0, y=6.0), (110.0, 100.0)
    latest = LatestGround()
    footfall.plan_route(athlete, ground(heights), state, goal, ASKED, look=latest.look)
    heights[60:80, 60:80] = 2.5
    computed = []
    layers = feasible._layers
    monkeypatch.setattr(feasible, "_layers", lambda p, g, *rest: computed.append(g.size) or layers(p, g, *rest))
    found = footfall.plan_route(athlete, ground(heights), state, goal, ASKED, look=latest.look)
    assert 0 < sum(computed) < 0.2 * heights.size
    assert footfall.plan_route(athlete, ground(heights), state, goal, ASKED).digest == found.digest
    # where nearly all changed, parts with all around them would be more than the whole
    del computed[:]
    footfall.plan_route(
        athlete, ground(heights + np.indices(heights.shape)[0] % 3), state, goal, ASKED, look=latest.look
    )
    assert sum(computed) == heights.size


def test_routes_of_a_session_look_at_the_whole_map_once_for_each_settings(athlete, monkeypatch):
    dem = ground(np.zeros((60, 60)))
    state = footfall.stand(athlete, dem, x=6.0, y=6.0)
    parents, request = {"robot": athlete, "dem": dem, "state": state}, RouteRequest((8.0, 6.0), ASKED)
    whole, look = [], feasible.feasible_ground
    monkeypatch.setattr(latest_ground, "LATEST_GROUND", LatestGround())
    monkeypatch.setattr(latest_ground, "feasible_ground", lambda *asked: whole.append(asked) or look(*asked))
    found, again = (product_recipes.route(parents, request, no_progress).digest for _ in range(2))
    assert found == again
    assert len(whole) == 1
    product_recipes.route(parents, replace(request, settings=replace(ASKED, headings=16)), no_progress)
    assert len(whole) == 2


def test_a_route_by_goodness_fits_planes_near_what_changed_alone(athlete, monkeypatch):
    heights = np.zeros((400, 400))
    asked = RouteSettings(resolution=0.3)
    state, goal = footfall.stand(athlete, ground(heights), x=6.0, y=6.0), (110.0, 100.0)
    latest = LatestGround()
    footfall.plan_route(athlete, ground(heights), state, goal, asked, fit=latest.fit)
    heights[60:80, 60:80] = 0.3
    whole = []
    monkeypatch.setattr(latest_ground, "traversability", lambda *args: whole.append(args))
    found = footfall.plan_route(athlete, ground(heights), state, goal, asked, fit=latest.fit)
    assert not whole
    assert footfall.plan_route(athlete, ground(heights), state, goal, asked).digest == found.digest


def test_planes_of_another_map_or_window_are_fitted_whole():
    rows, cols = np.indices((60, 60))
    latest, dem = LatestGround(), ground(0.01 * rows * cols % 0.7)
    assert latest.fit(dem, MapSettings()).digest == traversability(dem, MapSettings()).digest
    wider = MapSettings(window=2.0)
    assert latest.fit(dem, wider).digest == traversability(dem, wider).digest
    finer = from_heights(dem.heights, 0.1, 0.0, 0.0, "made")
    assert latest.fit(finer, wider).digest == traversability(finer, wider).digest
