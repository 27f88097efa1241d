"""What refuses a step of a robot that others described onto a cell: the classes of the layer "refused_by"."""

from collections.abc import Mapping
from typing import NamedTuple

from footfall.maps import layers as footing

(
    UNKNOWN,
    NOTHING,
    OUT_OF_RANGE,
    STEEP,
    EDGE,
    ROUGH,
    NOT_LIFTED,
    NOT_REACHED,
    LIMITS,
    DISC,
    SUPPORT,
    GROUND,
    FOOT,
    SELF,
    EFFORT,
    NOT_PROVEN,
) = range(16)


class Refused(NamedTuple):
    """name, text: for a person; footing: the class of the layer "footing" that such a cell has."""

    name: str
    text: str
    footing: int


REFUSALS: Mapping[int, Refused] = {
    UNKNOWN: Refused("unknown", "the ground under the foot is not known", footing.UNKNOWN),
    NOTHING: Refused("nothing", "a step leads there, every sample of it checked", footing.REACHABLE_STABLE),
    OUT_OF_RANGE: Refused(
        "out of reach", "farther from every place of the hip than the leg is long", footing.OUT_OF_RANGE
    ),
    STEEP: Refused("steep", "the ground under the foot is steeper than the settings allow", footing.NO_SOLUTION),
    EDGE: Refused("edge", "the foot would rest on an edge beside its middle", footing.UNSURE),
    ROUGH: Refused("rough", "the ground under the foot is too rough for one plane to stand for it", footing.UNSURE),
    NOT_LIFTED: Refused("not lifted", "the leg can't be lifted from where it stands", footing.NOT_LIFTED),
    NOT_REACHED: Refused("not reached", "no way of the leg leads the foot there", footing.NO_SOLUTION),
    LIMITS: Refused("limits", "a joint would leave its limits, or jump", footing.NO_SOLUTION),
    DISC: Refused("disc", "a disc would lean too far", footing.NO_SOLUTION),
    SUPPORT: Refused("support", "the weight would leave the feet that stand", footing.REACHABLE_UNSTABLE),
    GROUND: Refused("ground", "a body would come too near the ground", footing.COLLISION),
    FOOT: Refused("foot", "the foot would be in the ground on its way", footing.COLLISION),
    SELF: Refused("self", "two bodies would come too near each other", footing.COLLISION),
    EFFORT: Refused(
        "effort", "the joints would bear too much, or no forces hold the robot", footing.REACHABLE_UNSTABLE
    ),
    NOT_PROVEN: Refused("not proven", "the time limit came before the cell was looked at", footing.UNSURE),
}
"""Class → name, meaning, footing. Only NOTHING says yes."""

OF_CHECK: Mapping[str, int] = {
    "limits": LIMITS,
    "disc": DISC,
    "support": SUPPORT,
    "ground": GROUND,
    "foot": FOOT,
    "self": SELF,
    "effort": EFFORT,
}
"""Check of the whole robot → class."""
