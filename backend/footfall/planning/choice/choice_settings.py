"""What a policy is learned with, and chooses with."""

from footfall.core.bounds import require_above_zero, require_not_negative
from footfall.core.errors import InvalidInput
from footfall.core.value import Value, value
from footfall.planning.choice.actions import ACTIONS, WALK, WAYS
from footfall.planning.choice.reward import RewardWeights
from footfall.planning.choice.state import StateSpace
from footfall.planning.gait.problem import GaitSettings
from footfall.planning.walk.problem import WalkSettings
from footfall.planning.walk.smoothing import Smoothing

LONG = 3600.0
"""A time limit that a search of few attempts does not meet on a machine that does much else [s]."""


@value
class ChoiceSettings(Value):
    """space: the states. weights: of the reward. discount: what a reward is worth an iteration later.

    actions: that may be chosen; what was seen of others counts for nothing.
    ahead: how far one iteration goes, at most [m]. gaits: of every gait, whose name is replaced. walks: of the walk
    planner, whose seed is replaced; not smoothed, and given up after a few attempts, not by the clock, since what the
    clock ends is not the same again. speed: share of the joints' speed limits; pause: from one foot move to the
    next, for telemetry from after the placing [s].
    """

    space: StateSpace = StateSpace()
    weights: RewardWeights = RewardWeights()
    discount: float = 0.9
    actions: tuple[str, ...] = WAYS
    ahead: float = 0.6
    gaits: GaitSettings = GaitSettings(stride=0.6)
    walks: WalkSettings = WalkSettings(smoothing=Smoothing(rounds=0), time_limit=LONG, attempts=4)
    speed: float = 0.8
    pause: float = 5.0

    def check(self) -> None:
        """Raises InvalidInput for a distance, speed, pause or discount out of range, and actions that there are not."""
        if WALK not in self.actions or not set(self.actions) <= set(ACTIONS):
            raise InvalidInput(f"actions are some of {', '.join(ACTIONS)}, the walk planner among them")
        require_above_zero(ahead=self.ahead, speed=self.speed)
        require_not_negative(pause=self.pause)
        if not 0.0 <= self.discount < 1.0:
            raise InvalidInput("a discount is at least 0 and below 1", discount=self.discount)
        if not self.speed <= 1.0:
            raise InvalidInput("speed is a share of the limits, at most 1", speed=self.speed)
