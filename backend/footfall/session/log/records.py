"""What the fold keeps of events: products, plans to compare, exports, points and notes."""

from collections.abc import Mapping

from footfall.core.value import Value, value
from footfall.planning.step.problem import Point


@value
class ProductRecord(Value):
    """How a product came to be. kind: its name; parents: name → digest; settings: digest of the request, or None."""

    kind: str
    parents: Mapping[str, str]
    settings: str | None


@value
class ExportRecord(Value):
    """One export: which sequence, as what, and the digest of its bytes."""

    sequence: str
    format: str
    digest: str


@value
class PlanRecord(Value):
    """One of the plans that are compared.

    kind: "asked", or one of planning.step.alternatives.KINDS; text: what differs, for a person.
    """

    plan: str
    kind: str
    text: str
    status: str
    reason: str


@value
class LeadPoints(Value):
    """Points that the wheel of a leg is to pass in its swing: of its centre, in their order, site frame [m]."""

    leg: int
    points: tuple[Point, ...]


@value
class Note(Value):
    """What an operator wrote down."""

    time: float
    text: str
