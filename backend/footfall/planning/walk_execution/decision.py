"""What a rover that walks to a goal may do next, within which limits, and what it has done so far."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from enum import Enum

from footfall.core.bounds import require_above_zero, require_not_negative
from footfall.core.value import Value, value, value_enum
from footfall.planning.walk.problem import LEAST_MARGIN, MOST_TORQUE, Place, WalkGoal

TOO_NEAR = ("self collision", "terrain collision", "wheel clearance")
"""Checks of an execution that fail where bodies would come too near to each other or to the ground."""


@value_enum
class Act(Enum):
    """What can be done next; LIFT: a look with a leg lifted."""

    GO = "go"
    LOOK = "look"
    REPLAN = "replan"
    LIFT = "lift"
    STOP = "stop"
    ARRIVED = "arrived"


@value
class WayOnSettings(Value):
    """How a walk in a closed loop goes on.

    foot_moves: that are carried out between two decisions. look_every: a look after so many; 0: only where one is
    needed. least_margin: of the centre of mass to the polygon of the feet that stand, now and in the foot moves that
    are next [m]. most_torque: largest share of a joint's torque limit in those. most_anew: how often it is planned anew
    with no foot move between.
    """

    foot_moves: int = 1
    look_every: int = 1
    least_margin: float = LEAST_MARGIN
    most_torque: float = MOST_TORQUE
    most_anew: int = 5

    def check(self) -> None:
        """Raises InvalidInput for a count or torque that is not above zero, and a look or margin below it."""
        require_above_zero(foot_moves=self.foot_moves, most_torque=self.most_torque, most_anew=self.most_anew)
        require_not_negative(look_every=self.look_every, least_margin=self.least_margin)


@value
class WayOn(Value):
    """The decision, and the reason for it, for a person. leg: that is lifted to look, −1 where none is."""

    act: Act
    reason: str
    leg: int = -1


@dataclass(frozen=True)
class SoFar:
    """What was done already.

    moved: foot moves since the latest look. looked: whether it looked since it last moved; anew: how often it was
    planned anew since, declined: for how many of those plans no commands were made or sent, as the rover would not
    stand firmly; too_near: for how many of these bodies would come too near, since a search last found no walk.
    refused: why what was decided last can't be done: no walk was found, or the next foot move of the walk can't be
    commanded; empty where nothing was refused. nearest: where a search came that found no walk, which is gone to first.
    short: why the walk ends before the goal; empty where it does not. lifted: legs that were lifted to look, or could
    not be, since it last moved. unmet: pinned places that have had no foot yet.
    """

    moved: int = 0
    looked: bool = False
    anew: int = 0
    declined: int = 0
    too_near: int = 0
    refused: str = ""
    nearest: WalkGoal | None = None
    short: str = ""
    lifted: tuple[int, ...] = ()
    unmet: tuple[Place, ...] = ()

    def gone_on(self, moved: int, unmet: tuple[Place, ...]) -> "SoFar":
        """After so many foot moves more, with the pinned places that they leave."""
        return SoFar(moved=self.moved + moved, nearest=self.nearest, short=self.short, unmet=unmet)

    def with_no_commands(self, why: str, fails: Collection[str] = ()) -> "SoFar":
        """After commands were not made, or not sent: the first time it looks, and the same plan is tried once more.

        fails: checks of the execution that fail, by their names.
        """
        near = self.too_near + (self.looked and not set(TOO_NEAR).isdisjoint(fails))
        return replace(self, refused=why, declined=self.declined + self.looked, too_near=near)
