"""The place that is offered where unknown ground refuses a footfall: right by brute force, told, and never a guess."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from footfall.planning.answers import Status
from footfall.planning.body.stand import stand
from footfall.planning.scene.ground import Contact, footfall_contact
from footfall.planning.step.nearest_place import FARTHEST, nearest_place, place_in_words
from footfall.planning.step.plan import plan_step
from footfall.planning.step.problem import NearestPlace
from footfall.robot.ik import contact_point
from footfall.terrain.generate import plane

LEG = 2
RESOLUTION = 0.1
COORDINATE = st.floats(-3.4, 3.4)


def holed(*holes, resolution=RESOLUTION):
    """Level ground in which discs (x, y, radius) are unknown; a radius of 0: the cell there alone."""
    dem = plane(8.0, resolution)
    heights = np.array(dem.heights)
    X, Y = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    for x, y, radius in holes:
        away = np.hypot(X - x, Y - y)
        heights[away <= max(radius, away.min())] = np.nan
    return replace(dem, heights=heights)


def passes(robot, dem, x, y):
    return isinstance(footfall_contact(robot, dem, x, y), Contact)


def by_brute_force(robot, dem, x, y):
    """Distance to the nearest middle of a cell that passes, every one looked at from near to far."""
    places = sorted((math.hypot(a - x, b - y), a, b) for a in dem.geometry.xs for b in dem.geometry.ys)
    return next((away for away, a, b in places if away <= FARTHEST and passes(robot, dem, a, b)), None)


@settings(max_examples=10)
@given(st.lists(st.tuples(COORDINATE, COORDINATE, st.floats(0.0, 0.8)), min_size=1, max_size=5), st.data())
def test_it_is_the_nearest_cell_that_passes_the_check_that_refused(athlete, holes, data):
    dem = holed(*holes)
    hx, hy, _ = data.draw(st.sampled_from(holes))
    x, y = hx + data.draw(st.floats(-0.3, 0.3)), hy + data.draw(st.floats(-0.3, 0.3))
    found = nearest_place(athlete, dem, x, y)
    expected = by_brute_force(athlete, dem, x, y)
    if found is None:
        assert expected is None
        return
    assert passes(athlete, dem, found.x, found.y)
    assert found.of == "ground"
    assert found.away == pytest.approx(math.hypot(found.x - x, found.y - y))
    assert found.away == pytest.approx(expected)


def test_the_first_good_place_of_the_maps_whose_ground_passes_is_taken(athlete):
    dem = holed((0.0, 0.0, 0.0))
    radius = athlete.wheel_radius
    in_hole, far, beyond = (0.1, 0.0), (1.5, 0.0), (1.6, 0.0)
    assert not passes(athlete, dem, *in_hole)
    found = nearest_place(athlete, dem, 0.05, 0.0, [in_hole, far, beyond])
    assert found is not None
    assert (found.x, found.y, found.of) == (*far, "maps")
    # where none passes, known ground is what there is
    ground = nearest_place(athlete, dem, 0.05, 0.0, [in_hole])
    assert ground is not None
    assert ground.of == "ground"
    assert radius < ground.away < radius + 3 * RESOLUTION


def test_there_may_be_none(athlete):
    dem = plane(8.0, RESOLUTION)
    one_cell = np.full(dem.geometry.shape, np.nan, np.float32)
    one_cell[40, 40] = 0.0
    assert nearest_place(athlete, replace(dem, heights=one_cell), 0.0, 0.0) is None
    assert nearest_place(athlete, holed((0.0, 0.0, FARTHEST + 1.0)), 0.0, 0.0) is None
    assert nearest_place(athlete, dem, 50.0, 50.0) is None


@pytest.mark.parametrize(
    ("dx", "dy", "wind"),
    [(1, 0, "east"), (1, 1, "north-east"), (0, 1, "north"), (-1, 0.1, "west"), (0, -1, "south"), (1, -1, "south-east")],
)
def test_it_is_told_with_distance_direction_and_place(dx, dy, wind):
    away = 0.02 * math.hypot(dx, dy)
    told = place_in_words(1.0, 2.0, NearestPlace(1.0 + 0.02 * dx, 2.0 + 0.02 * dy, away, "maps"))
    assert f"{away:.3f} m to the {wind}, at ({1 + 0.02 * dx:.3f}, {2 + 0.02 * dy:.3f})" in told
    assert "green in the maps" in told


def test_a_plan_that_one_unknown_cell_refuses_names_a_place_that_can_be_planned(athlete):
    bare = plane(8.0, RESOLUTION)
    state = stand(athlete, bare)
    x, y, _ = contact_point(athlete, state.posture, LEG, state.T_site_base)
    target = float(x) + 0.1, float(y) - 0.1
    dem = holed((target[0] + athlete.wheel_radius, target[1], 0.0))
    refused = plan_step(athlete, dem, state, LEG, target, instead=())
    assert refused.status is Status.UNKNOWN_GROUND
    assert refused.instead is not None
    assert place_in_words(*target, refused.instead) in refused.reason
    assert refused.instead.away < 3 * RESOLUTION
    again = plan_step(athlete, dem, state, LEG, (refused.instead.x, refused.instead.y), instead=())
    assert again.status is Status.FOUND, again.reason
    assert again.instead is None
    # who does not ask, as recordings did, gets the answer of before
    unasked = plan_step(athlete, dem, state, LEG, target)
    assert unasked.instead is None
    assert "nearest good place" not in unasked.reason
    assert unasked.digest == plan_step(athlete, dem, state, LEG, target).digest != refused.digest
