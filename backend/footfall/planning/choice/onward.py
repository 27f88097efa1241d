"""By what a walk in a closed loop chooses how to go on: the walk planner, a gait where it holds, or a learned table."""

from collections.abc import Callable, Mapping

from footfall.core.errors import InvalidInput
from footfall.planning.choice.actions import ASIDE, WALK
from footfall.planning.choice.policy import GaitPolicy, require_made_for
from footfall.planning.choice.state import Features
from footfall.planning.gait.problem import WAVE

PLANNER, GAITS, TABLE = "planner", "gaits", "table"
CHOOSERS: Mapping[str, str] = {
    PLANNER: "the walk planner always",
    GAITS: "a wave where all of its checks hold, else the walk planner",
    TABLE: "what a learned table has as best for the ground ahead; where a wave fails, the walk planner",
}
"""In words."""
COMMANDED = (WAVE, WALK)
"""Actions that pieces of a walk are gone by: commands move one foot at a time, and pieces go straight."""


def require_chooser(chooser: str, policy: GaitPolicy | None, robot: str) -> None:
    """Raises InvalidInput where there is no such chooser, or no table for it that fits.

    One fits that was made for this robot (digest) and this version.
    """
    if chooser not in CHOOSERS:
        raise InvalidInput(f"ways to go on are chosen by one of {', '.join(CHOOSERS)}", choose_by=chooser)
    if chooser != TABLE:
        return
    if policy is None:
        raise InvalidInput("there is no learned table for this robot: serve with `--policy FILE`, or choose by another")
    require_made_for(policy, robot)


def way_of(chooser: str, policy: GaitPolicy | None, seen: Callable[[], Features]) -> tuple[str, str]:
    """One of COMMANDED, and why. seen: what a table chooses by, asked for where one does."""
    if chooser != TABLE or policy is None:
        return WAVE if chooser == GAITS else WALK, CHOOSERS[chooser]
    features = seen()
    best, own = policy.choose(features), policy.best_of(features, COMMANDED)
    state = policy.settings.space.in_words(policy.settings.space.index(features))
    if best in COMMANDED:
        return own, f"the table has {own} as best for {state}"
    why = "that goes aside" if best in ASIDE else "that moves several feet at once"
    return own, f"the table has {best} as best for {state}; {why}, so {own}, the next best"
