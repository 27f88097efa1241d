"""The ratio of paired times against scipy's bootstrap, and what a time limit counts for."""

import numpy as np
import pytest
from scipy.stats import bootstrap

from benchmarks.walks.peer_2006.ratio import paired_ratio
from footfall.core.errors import InvalidInput

SEED = 7


def test_the_interval_is_that_of_scipy() -> None:
    rng = np.random.default_rng(SEED)
    ours = rng.lognormal(0.0, 0.3, 41)
    peer = ours * rng.lognormal(3.0, 0.5, 41)
    ratio = paired_ratio(peer, ours, limit=1e9)
    theirs = bootstrap(
        (peer / ours,), np.median, method="percentile", n_resamples=9_999, rng=np.random.default_rng(SEED)
    ).confidence_interval
    # both draw at random, and a median of a sample is one of its values: neighbours in the order may change places
    values = np.sort(peer / ours)
    for mine, other in ((ratio.low, theirs.low), (ratio.high, theirs.high)):
        assert abs(np.searchsorted(values, mine) - np.searchsorted(values, other)) <= 1, (SEED, mine, other)
    assert ratio.low <= ratio.median <= ratio.high
    assert ratio.at_least == 0


def test_a_time_limit_counts_as_the_limit_and_is_told() -> None:
    ratio = paired_ratio(np.array([np.inf, np.inf, 10.0]), np.array([2.0, 2.0, 2.0]), limit=60.0)
    assert ratio.median == pytest.approx(30.0)
    assert ratio.at_least == 2


@pytest.mark.parametrize("ours", [[np.inf], [0.0], []])
def test_pairs_without_a_time_of_ours_are_refused(ours: list[float]) -> None:
    with pytest.raises(InvalidInput):
        paired_ratio(np.ones(len(ours)), np.array(ours), limit=60.0)
