"""How densely a walk is rechecked."""

from footfall.core.bounds import require_above_zero
from footfall.core.value import Value, value


@value
class RecheckSettings(Value):
    """way, turn: what the chassis' origin [m], and a joint or the chassis' heading [rad], move at most between samples.

    hold: what a joint turns at most between the postures whose torques are looked at [rad]. watched: distances larger
    than what is asked for by more than this are not measured [m].
    """

    way: float = 0.002
    turn: float = 0.002
    hold: float = 0.02
    watched: float = 0.05

    def check(self) -> None:
        """Raises InvalidInput for a number that is not above zero."""
        require_above_zero(way=self.way, turn=self.turn, hold=self.hold, watched=self.watched)
