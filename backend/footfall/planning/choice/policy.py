"""A learned policy: for each state the action to take, as a table that goes with one robot and one version."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput
from footfall.core.value import Provenance, Value, value
from footfall.planning.choice.actions import ACTIONS, WALK
from footfall.planning.choice.choice_settings import ChoiceSettings
from footfall.planning.choice.mdp import SeenTransition, estimated, value_iteration
from footfall.planning.choice.state import Features

VERSION = 2
"""Of the meaning of a table: features, actions and their order."""
LEARN_AGAIN = "learn one with `python -m training.gait_policy`"


@value
class GaitPolicy(Value):
    """version: VERSION of the program that learned it. actions: ACTIONS then. settings: it was learned with.

    action_values: (states, actions), what each is worth, −inf where it was never tried; visits: (states, actions), how
    often it was. bound: how far values may be from those of the estimated process. seeds: how many rollouts it was
    learned from. The provenance names the robot.
    """

    version: int
    actions: tuple[str, ...]
    settings: ChoiceSettings
    action_values: NDArray[np.float64]
    visits: NDArray[np.int64]
    bound: float
    seeds: int
    provenance: Provenance

    def check(self) -> None:
        """Raises InvalidInput where a state or an action lacks its number, and for a state with no action to choose."""
        shape = (self.settings.space.size, len(self.actions))
        if self.action_values.shape != shape or self.visits.shape != shape:
            raise InvalidInput(f"a policy needs one number for each state and action, {shape[0]} × {shape[1]}")
        if np.isnan(self.action_values).any() or not np.isfinite(self.action_values).any(axis=1).all():
            raise InvalidInput("every state of a policy needs an action of finite worth, and no number may be missing")

    @property
    def robot(self) -> str:
        """Digest of the robot that it was learned for."""
        return self.provenance.parents["robot"]

    @property
    def choices(self) -> NDArray[np.int64]:
        """(states,): the best action of each, the first of equals."""
        return np.argmax(self.action_values, axis=1)

    def choose(self, features: Features) -> str:
        """The action to take: one of ACTIONS."""
        return self.best_of(features, self.actions)

    def best_of(self, features: Features, among: Sequence[str]) -> str:
        """The best of some actions, the first of equals; the walk planner where none of them was ever tried."""
        values = self.action_values[self.settings.space.index(features)]
        own = [values[self.actions.index(action)] for action in among]
        return among[int(np.argmax(own))] if np.isfinite(own).any() else WALK


def learned(seen: Sequence[SeenTransition], settings: ChoiceSettings, robot: str, seeds: int) -> GaitPolicy:
    """The optimal policy of the process that was seen; robot: digest of whose iterations those were."""
    space = settings.space
    seen = [one for one in seen if ACTIONS[one.action] in settings.actions]
    tried = np.zeros((space.size, len(ACTIONS)), np.int64)
    np.add.at(tried, ([one.state for one in seen], [one.action for one in seen]), 1)
    process = estimated(seen, space.size, len(ACTIONS), ACTIONS.index(WALK))
    solved = value_iteration(process, settings.discount)
    provenance = Provenance({"robot": robot}, settings)
    return GaitPolicy(VERSION, ACTIONS, settings, solved.action_values, tried, solved.bound, seeds, provenance)


def require_made_for(policy: GaitPolicy, robot: str, settings: ChoiceSettings | None = None) -> None:
    """Raises InvalidInput where a policy is of another version or robot (digest).

    Also where it was learned with other settings than ``settings``, if such are given.
    """
    if policy.version != VERSION or policy.actions != ACTIONS:
        raise InvalidInput(
            f"the policy is of version {policy.version} for {', '.join(policy.actions)}, this program reads version "
            f"{VERSION} for {', '.join(ACTIONS)}; {LEARN_AGAIN}",
            version=policy.version,
        )
    if policy.robot != robot:
        raise InvalidInput(
            f"the policy was learned for robot {policy.robot[:8]}…, this one is {robot[:8]}…; {LEARN_AGAIN}",
            learned_for=policy.robot,
            robot=robot,
        )
    if settings is not None and policy.settings.digest != settings.digest:
        raise InvalidInput(
            f"the policy was learned with settings {policy.settings.digest[:8]}…, these are {settings.digest[:8]}…; "
            f"{LEARN_AGAIN}, or take its own",
            learned_with=policy.settings.digest,
            settings=settings.digest,
        )
