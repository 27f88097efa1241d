"""What a walk is smoothed for, and what came of it."""

from dataclasses import field

from footfall.core.bounds import require_not_negative
from footfall.core.errors import InvalidInput
from footfall.core.value import LATER, Value, value

MOST_ROUNDS = 20
"""More change nothing any longer."""


@value
class Smoothing(Value):
    """How a walk that was found is made better.

    rounds: how often each pose of the chassis is looked at again; 0: the walk stays as found.

    posture: of the robot description, whose height of the chassis above its feet the walk is to come near (``stand``,
    ``crouch``, ``tall``); None: the height that the walk is planned for.

    The others are what each costs. foot_move: of each. way: a metre of the chassis' way, or 0.8 rad of its turns.
    turning: a radian that joints turn, of the one that turns farthest. torque: the largest share of a torque limit in a
    foot move, to the fourth power. margin, clearance: of a foot move that has none to spare; one that has enough costs
    nothing. nominal: the chassis 0.25 m above or below the height wanted, growing with the square.
    """

    rounds: int = 2
    posture: str | None = None
    foot_move: float = 1.0
    way: float = 1.0
    turning: float = 0.1
    torque: float = 4.0
    margin: float = 1.0
    clearance: float = 0.5
    nominal: float = 0.3

    def check(self) -> None:
        """Raises InvalidInput for too many rounds, and for a cost that is negative."""
        if not 0 <= self.rounds <= MOST_ROUNDS:
            raise InvalidInput(f"a walk is smoothed in 0 to {MOST_ROUNDS} rounds", rounds=self.rounds)
        require_not_negative(
            foot_move=self.foot_move,
            way=self.way,
            turning=self.turning,
            torque=self.torque,
            margin=self.margin,
            clearance=self.clearance,
            nominal=self.nominal,
        )


@value
class WalkFigures(Value):
    """What a walk comes to. chassis_way [m]; turning: of the joint that turns farthest, summed [rad].

    largest_torque, mean_torque: of the foot moves' largest shares of a joint's limit. least_margin [m]. cost: what
    smoothing lowers.
    """

    foot_moves: int
    chassis_way: float
    turning: float
    largest_torque: float
    mean_torque: float
    least_margin: float
    cost: float


@value
class Smoothed(Value):
    """What smoothing came to: the walk as it was found, and as it is told; ``after.cost`` is never more.

    cut_short: whether the time limit ended it, so that another machine's walk may be another.
    """

    before: WalkFigures
    after: WalkFigures
    cut_short: bool = field(default=False, metadata=LATER)
