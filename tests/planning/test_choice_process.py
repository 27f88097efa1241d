"""Values of small Markov decision processes: by linear systems, by enumeration, and laws of penalties."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput
from footfall.planning.choice.mdp import Process, SeenTransition, estimated, value_iteration
from footfall.planning.choice.reward import Came, RewardWeights, reward

seeds = st.integers(0, 2**32 - 1)
discounts = st.sampled_from([0.0, 0.5, 0.9, 0.97])


def toy(seed: int, states: int = 4, actions: int = 3) -> Process:
    """Random chances and rewards; some actions can't be chosen, one of each state can."""
    rng = np.random.default_rng(seed)
    visits = (rng.random((states, actions)) < 0.7).astype(np.int64)
    visits[np.arange(states), rng.integers(0, actions, states)] = 1
    chances = rng.dirichlet(np.full(states, 0.5), (states, actions))
    return Process(chances, rng.normal(size=(states, actions)), visits)


def worth(process: Process, choices, discount: float, rewards=None) -> np.ndarray:
    """Values of always choosing so, by (I − γ P) v = r."""
    states = np.arange(len(process.rewards))
    P = process.chances[states, choices]
    r = (process.rewards if rewards is None else rewards)[states, choices]
    return np.linalg.solve(np.eye(len(states)) - discount * P, r)


@given(seeds, discounts)
def test_values_are_those_of_the_best_of_all_policies(seed, discount):
    process = toy(seed)
    solved = value_iteration(process, discount)
    policies = [
        choices
        for choices in product(range(3), repeat=4)
        if all(process.open[state, action] for state, action in enumerate(choices))
    ]
    best = np.max([worth(process, choices, discount) for choices in policies], axis=0)
    assert np.abs(solved.values - best).max() <= solved.bound + 1e-9
    # and the choices that they lead to are worth that
    own = worth(process, solved.choices, discount)
    assert np.abs(own - best).max() <= 2 * solved.bound + 1e-9
    np.testing.assert_allclose(solved.action_values.max(axis=1), solved.values)


@given(seeds, discounts, st.sampled_from([1e-1, 1e-3, 1e-6]))
def test_the_bound_holds_and_is_reached_in_time(seed, discount, tolerance):
    process = toy(seed)
    rough, fine = value_iteration(process, discount, tolerance), value_iteration(process, discount, 1e-12)
    assert np.abs(rough.values - fine.values).max() <= rough.bound + 1e-9
    largest = max(1.0, np.abs(process.rewards[process.open]).max() / (1 - discount))
    assert rough.bound <= tolerance * largest
    if discount > 0.0:
        first = np.abs(np.where(process.open, process.rewards, -np.inf).max(axis=1)).max()
        most = np.log(tolerance * largest * (1 - discount) / first) / np.log(discount) + 1
        assert rough.iterations <= max(1.0, np.ceil(most))


def test_a_process_with_a_known_optimum():
    """Stay for 1 a time, or pay 1 once and then win 2 a time.

    From the first state: stay for ever 1 / (1 − γ), go −1 + 2 γ / (1 − γ), better where γ > 2/3.
    """
    stay, go = 0, 1
    seen = [SeenTransition(0, stay, 1.0, 0), SeenTransition(0, go, -1.0, 1), SeenTransition(1, stay, 2.0, 1)]
    process = estimated(seen, 2, 2, stay)
    for discount in (0.5, 0.66, 0.67, 0.9):
        solved = value_iteration(process, discount)
        far = 2.0 / (1.0 - discount)
        assert solved.values == pytest.approx([max(1.0 / (1.0 - discount), discount * far - 1.0), far])
        assert solved.choices[0] == (go if discount > 2 / 3 else stay)


def test_counts_become_chances_and_means():
    seen = [
        SeenTransition(0, 1, 1.0, 0),
        SeenTransition(0, 1, 2.0, 2),
        SeenTransition(0, 1, 6.0, 2),
        SeenTransition(2, 0, -4.0, 0),
    ]
    process = estimated(seen, 3, 2, 1)
    np.testing.assert_allclose(process.chances[0, 1], [1 / 3, 0, 2 / 3])
    assert process.rewards[0, 1] == 3.0
    assert process.open.tolist() == [[False, True], [False, True], [True, False]]
    # in the state where nothing was seen the worst goes on for ever
    assert process.rewards[1, 1] == -4.0
    assert value_iteration(process, 0.5).values[1] == pytest.approx(-8.0)


@given(seeds, st.sampled_from([0.5, 0.9]), st.lists(st.integers(0, 50), min_size=2, max_size=4))
def test_a_larger_penalty_never_raises_the_mishaps_of_the_best_policy(seed, discount, penalties):
    """Of all policies best for r − λ m: mishaps as expected from any state fall as λ grows."""
    process = toy(seed)
    mishaps = np.random.default_rng(seed + 1).random(process.rewards.shape)
    before = np.full(len(mishaps), np.inf)
    for penalty in sorted(penalties):
        penalised = Process(process.chances, process.rewards - 0.1 * penalty * mishaps, process.visits)
        choices = value_iteration(penalised, discount, 1e-12).choices
        expected = worth(process, choices, discount, mishaps)
        assert (expected <= before + 1e-6).all()
        before = expected


@given(st.floats(0.0, 1.0), st.floats(0.0, 6.0), st.floats(0.0, 100.0), st.booleans())
def test_rewards_are_monotone(distance, support, time, refused):
    weights, came = RewardWeights(), Came(distance, support, time, 3, refused)
    worth_it = reward(came, weights)
    assert reward(Came(distance + 0.1, support, time, 3, refused), weights) > worth_it
    assert reward(Came(distance, support, time + 1.0, 3, refused), weights) < worth_it
    assert reward(Came(distance, support, time, 3, refused, "tip"), weights) == pytest.approx(worth_it - weights.mishap)
    assert reward(Came(distance, support + 1.0, time, 3, refused), weights) == pytest.approx(
        worth_it + weights.support * distance
    )


def test_refusals():
    with pytest.raises(InvalidInput, match="no transition was seen"):
        estimated([], 2, 2, 0)
    process = toy(0)
    with pytest.raises(InvalidInput, match="below 1"):
        value_iteration(process, 1.0)
    shut = Process(process.chances, process.rewards, np.zeros_like(process.visits))
    with pytest.raises(InvalidInput, match="every state needs"):
        value_iteration(shut, 0.5)
    with pytest.raises(InvalidInput, match="mishap"):
        RewardWeights(mishap=-1.0)
