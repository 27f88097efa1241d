"""What a learned policy is compared with: one action always, and a rule of thumb."""

from footfall.planning.choice.actions import TRIPOD, WALK, WAVE
from footfall.planning.choice.policy import GaitPolicy
from footfall.planning.choice.state import Features
from training.route import Choose

LEARNED, THRESHOLD = "learned", "threshold"
ALWAYS = {f"always {action}": action for action in (WAVE, TRIPOD, WALK)}
NAMES = (LEARNED, *ALWAYS, THRESHOLD)
EASY, FAIR = 0.25, 0.05
"""Least traversability at which the rule of thumb takes a tripod, and a wave."""


def by_threshold(seen: Features) -> str:
    """The hand-written rule: a tripod on easy ground, a wave on fair ground, else, and after a refusal, the planner."""
    if seen.refused or seen.traversability < FAIR:
        return WALK
    return TRIPOD if seen.traversability >= EASY else WAVE


def chooser(name: str, policy: GaitPolicy | None) -> Choose:
    """One of NAMES. policy: of the learned one."""
    if name == LEARNED:
        if policy is None:
            raise ValueError("the learned chooser needs a policy")
        return policy.choose
    return by_threshold if name == THRESHOLD else lambda _: ALWAYS[name]
