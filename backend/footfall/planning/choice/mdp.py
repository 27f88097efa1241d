"""A finite Markov decision process that is estimated from what was seen, and its optimal values.

Source: M. Puterman, *Markov Decision Processes*, Wiley 1994: §6.3.2 value iteration, theorem 6.3.1 its bound.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput


@dataclass(frozen=True)
class SeenTransition:
    """One transition: state, action, the reward, and the state after it."""

    state: int
    action: int
    reward: float
    after: int


@dataclass(frozen=True, eq=False)
class Process:
    """A Markov decision process as it was seen.

    chances: (states, actions, states) of what comes after; rewards: (states, actions) expected; visits: (states,
    actions), how often each was seen. An action that was never seen in a state can't be chosen there.
    """

    chances: Array
    rewards: Array
    visits: NDArray[np.int64]

    @property
    def open(self) -> NDArray[np.bool_]:
        """(states, actions): what can be chosen."""
        return self.visits > 0


@dataclass(frozen=True, eq=False)
class Solved:
    """What each state, and each action in it, is worth.

    values: (states,); action_values: (states, actions), −inf where an action can't be chosen; iterations: how many
    sweeps. bound: no value is farther from the optimum than this.
    """

    values: Array
    action_values: Array
    iterations: int
    bound: float

    @property
    def choices(self) -> NDArray[np.int64]:
        """(states,): the best action of each, the first of equals."""
        return np.argmax(self.action_values, axis=1)


def estimated(seen: Iterable[SeenTransition], states: int, actions: int, otherwise: int) -> Process:
    """The process of largest likelihood: counts over their sum, means of rewards. Sums are in the order of ``seen``.

    A state in which nothing was seen gets action ``otherwise``, stays as it is, and is worth the worst mean reward of
    all for ever: so nothing leads there that could lead elsewhere. Raises InvalidInput where nothing was seen.
    """
    counts = np.zeros((states, actions, states), np.int64)
    sums = np.zeros((states, actions))
    for one in seen:
        counts[one.state, one.action, one.after] += 1
        sums[one.state, one.action] += one.reward
    visits = counts.sum(axis=2)
    if not visits.any():
        raise InvalidInput("no transition was seen, so nothing can be learned")
    rewards = sums / np.maximum(visits, 1)
    chances = counts / np.maximum(visits, 1)[:, :, None]
    worst = float(rewards[visits > 0].min())
    for state in np.flatnonzero(~visits.any(axis=1)):
        chances[state, otherwise, state], rewards[state, otherwise], visits[state, otherwise] = 1.0, worst, 1
    return Process(chances, rewards, visits)


def value_iteration(process: Process, discount: float, tolerance: float = 1e-9) -> Solved:
    """Optimal values of a process.

    vₖ₊₁(s) = maxₐ [r(s, a) + γ Σ p(s′ | s, a) vₖ(s′)] (Puterman eq. 6.3.1). It contracts by γ, so that ‖vₖ₊₁ − v*‖ ≤ γ
    / (1 − γ) ‖vₖ₊₁ − vₖ‖ in the largest norm, which is the bound; it is at most ε after ln(ε (1 − γ) / ‖v₁ − v₀‖) / ln
    γ + 1 sweeps. The choices are then worth within twice the bound of the best.

    Args:
        process: chances and rewards.
        discount: γ, 0 ≤ γ < 1.
        tolerance: of each value, times the largest that one could be, or 1.

    Returns:
        Values of states and of actions in them.

    Raises:
        InvalidInput: a state has no action to choose, or the discount is out of range.
    """
    if not 0.0 <= discount < 1.0:
        raise InvalidInput("a discount is at least 0 and below 1", discount=discount)
    if not process.open.any(axis=1).all():
        raise InvalidInput("every state needs an action that can be chosen")
    largest = float(np.abs(process.rewards[process.open]).max()) / (1.0 - discount)
    values, iterations, bound = np.zeros(len(process.rewards)), 0, np.inf
    while bound > tolerance * max(1.0, largest):
        new = _backed_up(process, discount, values).max(axis=1)
        change = float(np.abs(new - values).max())
        bound, values, iterations = discount / (1.0 - discount) * change, new, iterations + 1
    # one more backup, whose values are the best of its row, and nearer to the optimum than the bound
    action_values = _backed_up(process, discount, values)
    return Solved(action_values.max(axis=1), action_values, iterations, bound)


def _backed_up(process: Process, discount: float, values: Array) -> Array:
    """What each action is worth where what comes after is worth ``values``, (states, actions)."""
    return np.where(process.open, process.rewards + discount * process.chances @ values, -np.inf)
