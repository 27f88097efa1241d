"""A step that unknown ground refuses names a good place: by the maps where they are of now, else by the ground."""

from dataclasses import replace

import numpy as np

from footfall.planning.answers import Status
from footfall.robot.ik import contact_point
from footfall.session.products.judged_footfall import decisive
from footfall.session.replay.recompute import replay

LEG = 2
REACHABLE_STABLE = 3


def pierced(live, athlete, dem, standing):
    """One cell is unknown beside a place that leg LEG can step to; that place."""
    x, y, _ = contact_point(athlete, standing.posture, LEG, standing.T_site_base)
    place = float(x) + 0.1, float(y) + 0.1
    heights = np.array(dem.heights)
    row, col = (int(i) for i in dem.geometry.cell(place[0] + 0.9 * athlete.wheel_radius, place[1]))
    heights[row, col] = np.nan
    live.terrains.load(replace(dem, heights=heights))
    return place


def test_the_refusal_names_a_place_that_can_be_planned_and_replays(live, athlete, dem, standing):
    place = pierced(live, athlete, dem, standing)
    refused = live.get(live.plans.step(LEG, place).finish())
    assert refused.status is Status.UNKNOWN_GROUND
    assert refused.instead.of == "ground"
    assert "nearest good place" in refused.reason == live.state.plan_reason
    maps = live.get(live.maps.compute(LEG).finish())
    named = live.get(live.plans.step(LEG, place).finish()).instead
    assert named.of == "maps"
    row, col = (int(i) for i in maps.geometry.cell(named.x, named.y))
    assert decisive(maps)[row, col] == REACHABLE_STABLE
    live.maps.choose_footfall(LEG, named.x, named.y)
    found = live.get(live.plans.step(LEG).finish())
    assert found.status is Status.FOUND, found.reason
    assert found.instead is None
    # maps of how the rover stood say nothing of now
    live.stances.set(replace(standing, time=7.0, T_site_base=np.array(standing.T_site_base) + _east(0.01)))
    assert live.maps.good_places(found.footfall) == ()
    report = replay(live.export_bundle())
    assert report.ok, report.problems


def _east(shift):
    T = np.zeros((4, 4))
    T[0, 3] = shift
    return T
