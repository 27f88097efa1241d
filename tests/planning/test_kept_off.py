"""How deep places lie where the chassis is kept off, against shapely's shapes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import LineString, Point

from footfall.planning.route.kept_off import LOOKED_AT, kept_off, kept_off_between
from footfall.planning.route.problem import Corridor, NoGo, RouteSettings

AT = st.floats(-3.0, 3.0, width=32)
SIZE = st.floats(0.0625, 2.0, width=32)
AREAS = st.lists(st.builds(NoGo, AT, AT, SIZE), max_size=3).map(tuple)
CORRIDORS = st.lists(st.builds(Corridor, AT, AT, AT, AT, SIZE), max_size=3).map(tuple)
SETTINGS = st.builds(RouteSettings, no_go=AREAS, corridors=CORRIDORS)


def deep(place, settings):
    """By shapely."""
    found = [0.0, *(one.radius - place.distance(Point(one.x, one.y)) for one in settings.no_go)]
    ways = [(LineString([(one.x, one.y), (one.to_x, one.to_y)]), one.beside) for one in settings.corridors]
    if ways:
        found.append(min(place.distance(way) - beside for way, beside in ways))
    return max(found)


@given(SETTINGS, AT, AT)
def test_a_place_is_as_deep_as_shapely_has_it(settings, x, y):
    assert kept_off(np.array([[x, y]]), settings)[0] == pytest.approx(deep(Point(x, y), settings), abs=1e-9)


@given(AREAS, AT, AT, AT, AT)
def test_a_straight_way_comes_as_deep_as_its_deepest_place(areas, x, y, to_x, to_y):
    settings = RouteSettings(no_go=areas)
    found = kept_off_between(np.array([x, y]), np.array([[to_x, to_y]]), settings)[0]
    way = LineString([(x, y), (to_x, to_y)])
    deepest = max([0.0, *(one.radius - way.distance(Point(one.x, one.y)) for one in areas)])
    # places are looked at so far apart
    assert deepest - LOOKED_AT / 2.0 - 1e-9 <= found <= deepest + 1e-9
