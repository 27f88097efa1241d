"""What a learned policy is compared with: one action always, a rule of thumb, and how a walk by itself chooses."""

from footfall.planning.choice.actions import TRIPOD, WALK, WAVE
from footfall.planning.choice.onward import COMMANDED
from footfall.planning.choice.policy import GaitPolicy
from footfall.planning.choice.state import Features
from training.route import Choose

LEARNED, THRESHOLD = "learned", "threshold"
ALWAYS = {f"always {action}": action for action in (WAVE, TRIPOD, WALK)}
HOLDS, LEARNED_COMMANDED = "wave where it holds", "learned, of what is commanded"
NAMES = (LEARNED, *ALWAYS, THRESHOLD, HOLDS, LEARNED_COMMANDED)
EASY, FAIR = 0.25, 0.05
"""Least traversability at which the rule of thumb takes a tripod, and a wave."""


def by_threshold(seen: Features) -> str:
    """The hand-written rule: a tripod on easy ground, a wave on fair ground, else, and after a refusal, the planner."""
    if seen.refused or seen.traversability < FAIR:
        return WALK
    return TRIPOD if seen.traversability >= EASY else WAVE


def where_it_holds(seen: Features) -> str:
    """A wave, and after one that was refused the planner."""
    return WALK if seen.refused else WAVE


def chooser(name: str, policy: GaitPolicy | None) -> Choose:
    """One of NAMES. policy: of the learned ones."""
    if name in (LEARNED, LEARNED_COMMANDED):
        if policy is None:
            raise ValueError("the learned chooser needs a policy")
        return policy.choose if name == LEARNED else lambda seen: _commanded(policy, seen)
    rules = {THRESHOLD: by_threshold, HOLDS: where_it_holds}
    return rules.get(name) or (lambda _: ALWAYS[name])


def _commanded(policy: GaitPolicy, seen: Features) -> str:
    """As a walk by itself takes it of a table; a wave that was refused is not tried again."""
    return WALK if seen.refused else policy.best_of(seen, COMMANDED)
