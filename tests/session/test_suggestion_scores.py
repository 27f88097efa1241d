"""Scores of suggested footfalls tell them apart on real ground: little of what a leg reaches is best of all."""

import numpy as np
import pytest

from footfall.maps.quality import quality
from footfall.maps.quality_settings import QualitySettings
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from tests.support.laid_sample import lay_sample


@pytest.fixture(params=["rock-step", "fractal-step"])
def sampled(request, tmp_path):
    """A sample with maps of one leg; the leg, and the maps."""
    session = lay_sample(request.param, tmp_path)
    with Sessions(tmp_path, jobs=InlineJobs()) as sessions:
        live = sessions.open(session)
        ((leg, digest),) = live.state.maps.items()
        yield live, int(leg), live.get(digest)


def quality_of(live, maps):
    """As suggestions are ranked unless they are asked for otherwise."""
    return live.maps._quality(maps, QualitySettings(), None)


@pytest.mark.parametrize("factor", ["margin", "limit_margin"])
def test_few_of_the_cells_that_a_leg_reaches_are_at_the_end_of_a_ramp(sampled, factor):
    live, _, maps = sampled
    found = quality_of(live, maps)
    amounts = found.layers[factor][found.score > 0]
    assert (amounts >= found.settings.ramps[factor][1]).mean() < 0.2


def test_suggestions_have_scores_of_their_own_as_they_are_shown(sampled):
    live, leg, _ = sampled
    found = live.maps.suggest(leg, settings=QualitySettings()).footfalls
    assert len(found) == 5
    shown = [f"{100 * one.score:.1f}" for one in found]
    assert len(set(shown)) == len(shown)
    # told in hundredths they were one and the same
    assert found[0].score - found[-1].score > 0.01
    assert all(one.apart is not None for one in found)


def test_more_room_and_more_stability_count_wherever_they_are(sampled):
    live, _, maps = sampled
    found = quality_of(live, maps)
    for factor in ("margin", "limit_margin"):
        amount = found.layers[factor]
        cells = (found.score > 0) & (amount < 0.9 * found.settings.ramps[factor][1])
        more = {**found.layers, factor: np.where(cells, amount * 1.05, amount)}
        again = quality(found.geometry, more, found.situation, found.settings)
        assert (again.score[cells] > found.score[cells]).all()
