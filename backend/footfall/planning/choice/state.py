"""The state that a choice is made in: what the ground and the rover are like, in classes, and the current gait.

P. Mihelich has two features: the least traversability under the rover, and the current gait. Added to them is whether
the iteration before was refused, as the same one would be refused again; slope ahead, lean, age, and whether the
ground to one side is better, where asked for.
"""

import math
from bisect import bisect_right
from dataclasses import dataclass
from itertools import pairwise

from footfall.core.errors import InvalidInput
from footfall.core.value import Value, value
from footfall.planning.choice.actions import ACTIONS, WALK, WAYS, way_of_going

CLASSED = ("traversability", "slope_ahead", "lean", "age")
"""Features that are numbers, in the order in which tables have them."""


@dataclass(frozen=True)
class Features:
    """What a choice goes by.

    traversability: least under the rover and where it goes next, 0…1, unknown ground 0. slope_ahead: rise of the ground
    along the way [rad], uphill positive. lean: of the chassis from level [rad]. age: of the oldest ground there [s], 0
    where the map does not say. current: one of ACTIONS, that of the iteration before; refused: whether a check refused
    that. A rover that has not gone yet stands as after a walk. aside: least traversability where an action aside would
    go; left: whether that is to the left.
    """

    traversability: float
    slope_ahead: float = 0.0
    lean: float = 0.0
    age: float = 0.0
    current: str = WALK
    refused: bool = False
    aside: float = 0.0
    left: bool = True


@value
class StateSpace(Value):
    """Limits between the classes of each feature, rising; a number at a limit is of the class above it.

    Without limits a feature counts for nothing. sides: whether it counts that the ground aside is of a better class
    than straight ahead.
    """

    traversability: tuple[float, ...] = (0.05, 0.15, 0.25, 0.5)
    slope_ahead: tuple[float, ...] = ()
    lean: tuple[float, ...] = ()
    age: tuple[float, ...] = ()
    sides: bool = False

    def check(self) -> None:
        """Raises InvalidInput for limits that don't rise or are not finite."""
        for name in CLASSED:
            limits = getattr(self, name)
            if not all(math.isfinite(limit) for limit in limits) or any(a >= b for a, b in pairwise(limits)):
                raise InvalidInput(f"the limits of {name} must be finite and rise", limits=list(limits))

    @property
    def shape(self) -> tuple[int, ...]:
        """Classes of CLASSED, better aside or not, refused or not, how the iteration before was gone."""
        return (*(len(getattr(self, name)) + 1 for name in CLASSED), 2 if self.sides else 1, 2, len(WAYS))

    @property
    def size(self) -> int:
        """How many states there are."""
        return math.prod(self.shape)

    def index(self, features: Features) -> int:
        """The number of a state, 0…size − 1. Raises InvalidInput where a feature is no number or no action."""
        if features.current not in ACTIONS:
            raise InvalidInput(f"the current gait is one of {', '.join(ACTIONS)}", current=features.current)
        if math.isnan(features.aside):
            raise InvalidInput("aside is not a number")
        number = 0
        for name, classes in zip(CLASSED, self.shape, strict=False):
            feature = getattr(features, name)
            if math.isnan(feature):
                raise InvalidInput(f"{name} is not a number")
            number = number * classes + bisect_right(getattr(self, name), feature)
        if self.sides:
            straight = bisect_right(self.traversability, features.traversability)
            number = number * 2 + (bisect_right(self.traversability, features.aside) > straight)
        return (number * 2 + features.refused) * len(WAYS) + WAYS.index(way_of_going(features.current))

    def in_words(self, number: int) -> str:
        """A state in words, without features that count for nothing."""
        number, current = divmod(number, len(WAYS))
        number, refused = divmod(number, 2)
        said = [f"after {WAYS[current]}" + (" that was refused" if refused else "")]
        if self.sides:
            number, better = divmod(number, 2)
            said += ["better aside"] * better
        for name, classes in reversed(tuple(zip(CLASSED, self.shape, strict=False))):
            number, own = divmod(number, classes)
            limits = getattr(self, name)
            if limits:
                low = f"{limits[own - 1]:g} ≤ " if own else ""
                high = f" < {limits[own]:g}" if own < len(limits) else ""
                said.append(f"{low}{name.replace('_', ' ')}{high}")
        return ", ".join(reversed(said))
