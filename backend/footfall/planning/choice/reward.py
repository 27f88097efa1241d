"""What an iteration is worth: distance and support for it, mishaps, refusals and time against it."""

from dataclasses import dataclass

from footfall.core.bounds import require_not_negative
from footfall.core.value import Value, value

MISHAPS = ("tip", "torque", "collision")
"""What happens to a rover that walks unchecked. Here checks find it before anything moves."""


@dataclass(frozen=True)
class Came:
    """What came of one iteration.

    distance: nearer to the goal [m]; support: mean over its foot moves of the area of the polygon of the feet that
    stand [m²]; time: of its motion [s]; foot_moves: how many; mishap: one of MISHAPS, or empty. refused: whether a
    check refused it, whichever; then the rover has stayed where it stood.
    """

    distance: float = 0.0
    support: float = 0.0
    time: float = 0.0
    foot_moves: int = 0
    refused: bool = False
    mishap: str = ""


@value
class RewardWeights(Value):
    """What is won and lost with an iteration.

    Won: with a metre of distance, and with a metre over a square metre of support. Lost: with a second, with an
    iteration that is refused, and with a mishap beyond that.
    """

    distance: float = 1.0
    support: float = 0.01
    time: float = 0.002
    refusal: float = 0.2
    mishap: float = 0.5

    def check(self) -> None:
        """Raises InvalidInput for a weight that is negative."""
        require_not_negative(
            distance=self.distance,
            support=self.support,
            time=self.time,
            refusal=self.refusal,
            mishap=self.mishap,
        )


def reward(came: Came, weights: RewardWeights) -> float:
    """The reward of an iteration. Support counts by the way that is gone on it: who stands still wins nothing."""
    won = came.distance * (weights.distance + weights.support * came.support)
    lost = weights.time * came.time + weights.refusal * came.refused + weights.mishap * bool(came.mishap)
    return won - lost
