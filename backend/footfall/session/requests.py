"""What was asked of a job, as values: stored beside the products, so that a replay asks the same."""

from footfall.core.errors import InvalidInput
from footfall.core.value import Value, value
from footfall.maps.layers import MapSettings
from footfall.planning.stance.find_problem import FindShiftSettings
from footfall.planning.stance.move import BodyMoveSettings
from footfall.planning.stance.shift import BodyShift
from footfall.planning.step.problem import Footfall, StepSettings


@value
class MapRequest(Value):
    """Maps for one leg."""

    leg: int
    settings: MapSettings

    def check(self) -> None:
        if type(self.leg) is not int or self.leg < 0:
            raise InvalidInput("leg is a whole number, 0…", leg=repr(self.leg))


@value
class StepRequest(Value):
    """A step of one leg to a chosen footfall."""

    footfall: Footfall
    settings: StepSettings


@value
class ShiftRequest(Value):
    """The shift of the chassis that makes a footfall possible."""

    footfall: Footfall
    settings: FindShiftSettings


@value
class BodyMoveRequest(Value):
    """A move of the chassis over its standing feet."""

    shift: BodyShift
    settings: BodyMoveSettings


@value
class ExportRequest(Value):
    """A sequence in one of the export formats."""

    format: str
