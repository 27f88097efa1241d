"""What the prediction of sag assumes of springs, ground and load."""

from dataclasses import field

from footfall.balance.balance_settings import BalanceSettings
from footfall.core.errors import InvalidInput
from footfall.core.value import Value, value

WIDEST = 20.0
"""Springs more than so many times stiffer or softer than the description's are no calibration but another rover."""


@value
class ComplianceSettings(Value):
    """joint_scale, wheel_scale: factors on the stiffnesses of the robot's description.

    rolling: whether a locked wheel rolls over its rim as its leg turns; else it is held at its lowest point.
    balance: friction, gravity and its direction, payload.
    """

    joint_scale: float = 1.0
    wheel_scale: float = 1.0
    rolling: bool = True
    balance: BalanceSettings = field(default_factory=BalanceSettings)

    def check(self) -> None:
        """Raises InvalidInput for a factor on the stiffnesses that is too small or too large."""
        for name in ("joint_scale", "wheel_scale"):
            if not 1 / WIDEST <= getattr(self, name) <= WIDEST:
                raise InvalidInput(
                    f"{name} must be between {1 / WIDEST:g} and {WIDEST:g}", **{name: getattr(self, name)}
                )
