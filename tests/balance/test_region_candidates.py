"""Margins with friction for many places of one foot against the whole region at each place."""

import numba
import numpy as np
import pytest

from footfall.balance.region import equilibrium_region, region_margin, regions_without_each, surviving_margin
from footfall.balance.region_candidates import NO_LEG, region_margins_for_candidates
from footfall.core.errors import InvalidInput
from tests.balance.peers import is_held, random_stance


def problem(rng, count, feet=5, tilt=0.25):
    """Feet that stay, and candidates about the place of the one that is missing."""
    contacts, normals = random_stance(rng, feet=feet + 1, tilt=tilt)
    candidates = contacts[feet] + rng.uniform(-1, 1, (count, 3)) * [1.2, 1.2, 0.3]
    own = np.column_stack([0.3 * rng.normal(size=(count, 2)), np.ones(count)])
    return contacts[:feet], normals[:feet], candidates, own, rng.uniform(-2.0, 2.0, (count, 2))


@pytest.mark.parametrize("conservative", [False, True])
@pytest.mark.parametrize("feet", [2, 3, 5])
def test_it_is_a_lower_bound_within_the_tolerance_of_the_whole_region(rng, conservative, feet):
    inside = outside = 0
    for tolerance in (1e-3, 0.05):
        fixed, normals, candidates, own, coms = problem(rng, 150, feet)
        found = region_margins_for_candidates(
            fixed, normals, candidates, own, coms, conservative, 0.6, 8, tolerance=tolerance
        )
        for i in range(len(candidates)):
            stance = np.vstack([fixed, candidates[i]]), np.vstack([normals, own[i]])
            if conservative:
                exact = surviving_margin(regions_without_each(*stance), coms[i])
            else:
                exact = region_margin(equilibrium_region(*stance), coms[i])
            if exact.margin == -np.inf:
                assert found.margin[i] == -np.inf
                continue
            assert exact.margin - tolerance - 1e-4 <= found.margin[i] <= exact.most + 1e-7
            inside += exact.margin > 0
            outside += exact.margin < 0
            if conservative:
                # a leg is named whose loss is as bad as the worst, within the tolerance
                rest = [foot for foot in range(feet + 1) if foot != found.lost[i]]
                alone = region_margin(equilibrium_region(stance[0][rest], stance[1][rest]), coms[i])
                assert alone.margin <= exact.margin + tolerance + 1e-4
            else:
                assert found.lost[i] == NO_LEG
    assert outside > 15
    assert inside > 15 or (conservative and feet < 4)


def test_it_is_never_optimistic_to_highs(rng):
    fixed, normals, candidates, own, coms = problem(rng, 400)
    found = region_margins_for_candidates(fixed, normals, candidates, own, coms).margin
    answers = []
    for i in np.flatnonzero(np.abs(found) > 2e-3):
        held = is_held(np.vstack([fixed, candidates[i]]), np.vstack([normals, own[i]]), coms[i], 0.6)
        assert held == (found[i] > 0)
        answers.append(held)
    assert 0.05 < np.mean(answers) < 0.95


def test_feet_that_hold_nothing_alone_may_with_the_candidate():
    """Two feet on slopes too steep for them, and a candidate that carries everything."""
    fixed = np.array([[1, 0, 0], [-1, 0.5, 0.0]])
    steep = np.tile([np.sin(0.9), 0, np.cos(0.9)], (2, 1))
    candidates, up = np.array([[0.2, -0.3, 0.0]]), np.array([[0, 0, 1.0]])
    assert len(equilibrium_region(fixed, steep).corners) == 0
    found = region_margins_for_candidates(fixed, steep, candidates, up, [0.2, -0.3]).margin[0]
    exact = region_margin(equilibrium_region(np.vstack([fixed, candidates]), np.vstack([steep, up])), [0.2, -0.3])
    assert np.isfinite(found)
    assert found == pytest.approx(exact.margin, abs=1e-3)
    everything = region_margins_for_candidates(fixed, steep, candidates, steep[:1], [0, 0]).margin[0]
    assert everything == -np.inf


def test_the_same_bytes_on_one_thread_and_on_two(rng):
    args = problem(rng, 2000)
    every = [region_margins_for_candidates(*args, conservative=True)]
    before = numba.get_num_threads()
    try:
        numba.set_num_threads(1)
        every.append(region_margins_for_candidates(*args, conservative=True))
    finally:
        numba.set_num_threads(before)
    for first, second in zip(*every, strict=True):
        assert first.tobytes() == second.tobytes()


def test_unknown_and_impossible_candidates(rng):
    fixed, normals, candidates, own, coms = problem(rng, 5)
    candidates[1, 2] = np.nan
    own[2] = np.nan
    coms[3] = np.nan
    own[4] = [0, 0, -1]
    for conservative in (False, True):
        found = region_margins_for_candidates(fixed, normals, candidates, own, coms, conservative)
        assert np.isnan(found.margin).tolist() == [False, True, True, True, False]
        assert found.margin[4] == -np.inf
        assert (found.lost[1:] == NO_LEG).all()
    none = region_margins_for_candidates(fixed, normals, np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 2)))
    assert none.margin.shape == (0,)


def test_bad_input_is_refused_by_name(rng):
    fixed, normals, candidates, own, coms = problem(rng, 4)
    with pytest.raises(InvalidInput, match="at least three feet"):
        region_margins_for_candidates(fixed[:1], normals[:1], candidates, own, coms)
    with pytest.raises(InvalidInput, match="contacts need"):
        region_margins_for_candidates(fixed * np.nan, normals, candidates, own, coms)
    with pytest.raises(InvalidInput, match="candidates and their normals"):
        region_margins_for_candidates(fixed, normals, candidates, own[:2], coms)
    with pytest.raises(InvalidInput, match="coms_xy"):
        region_margins_for_candidates(fixed, normals, candidates, own, coms[:2])
    with pytest.raises(InvalidInput, match="friction"):
        region_margins_for_candidates(fixed, normals, candidates, own, coms, friction=-0.1)
    with pytest.raises(InvalidInput, match="tolerance"):
        region_margins_for_candidates(fixed, normals, candidates, own, coms, tolerance=0.0)
