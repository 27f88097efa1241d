"""What is told of whether products are of how things are now."""

from typing import Annotated, Literal, TypedDict

from footfall.session.answers.notes import Each, Says
from footfall.session.products.kinds import KINDS


class OtherGroundAnswer(TypedDict):
    """A newer map against the one that a product was made on, where it looked: what changed [m²], by at most [m]."""

    area: float
    by: float


class FitAnswer(TypedDict):
    """Whether a product was made for how things are now (stance, terrain, robot), and in words why not.

    verdict: unknown where nothing that is known differs, and the rover is not heard. partly: of maps that don't fit
    only because some ground changed; `changed.png` has where. ground: null where it was made on the present terrain, or
    on one that can't be compared.
    """

    fits: bool
    reason: str
    verdict: Literal["fresh", "differs", "unknown"]
    partly: bool
    ground: OtherGroundAnswer | None


class UpToDateAnswer(TypedDict):
    """Of the present products; None where there is none. measured: the rover was heard, not only frozen once; unheard:
    why nobody knows whether it still stands so, empty where it was heard lately.
    """

    measured: bool
    unheard: str
    what_if: FitAnswer | None
    maps: Annotated[dict[str, FitAnswer], Says("leg → of its latest maps")]
    kinds: Annotated[FitAnswer | None, Each(lambda: (one.name for one in KINDS.values() if one.watched))]
