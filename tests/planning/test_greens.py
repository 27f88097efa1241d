"""Greens of the maps are what the planner says, on small terrains: a second method for the map, cell by cell."""

import pytest

import footfall
from benchmarks import greens
from benchmarks.timing import SEED
from footfall.terrain.generate import fractal, rock_field

GROUNDS = {
    "steep": lambda: fractal(size=6.0, resolution=0.08, roughness=0.25, seed=8),
    "rocks": lambda: rock_field(size=6.0, resolution=0.08, abundance=0.08, largest=0.5, seed=SEED),
}


@pytest.mark.parametrize("name", GROUNDS)
def test_a_step_leads_to_every_green_that_is_tried(athlete, name):
    dem = GROUNDS[name]()
    state = footfall.stand(athlete, dem)
    looked = greens.look([(dem, state)], [1, 4], 4)
    assert looked.greens
    assert looked.greens.count(False) == 0, looked.refusals
    # purple is said of upright wheels alone, but seldom does a wheel that leans get there
    assert sum(looked.purples) <= 0.1 * len(looked.purples)
