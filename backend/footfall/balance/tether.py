"""A tether from an anchor in the ground to a drum on the chassis: one more limb, which only pulls.

Its drum keeps the pull that the balance asks for, anything from none to its most, and pays out what the chassis' way
needs. So it is taut, and as long as anchor and attachment are apart.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.arrays import Array
from footfall.core.bounds import require_above_zero, require_not_negative
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply
from footfall.core.value import Value, value


@value
class Tether(Value):
    """A tether from an anchor in the ground to a drum on the chassis.

    Attributes:
        anchor: (3,) in site [m].
        attachment: (3,) where it leaves the drum, in base, on or above the chassis [m].
        most_force: most pull of the drum [N].
        free_length: length that can be paid out [m].
        speed: of paying out and hauling in [m/s].
        clearance: from the ground and from the legs [m].
        bare: how much of it next to the anchor may lie on the ground [m].
    """

    anchor: NDArray[np.float64]
    attachment: NDArray[np.float64]
    most_force: float = 12_000.0
    free_length: float = 30.0
    speed: float = 0.05
    clearance: float = 0.05
    bare: float = 0.5

    def check(self) -> None:
        """Raises InvalidInput for points that are not finite, and a force, length, speed or clearance out of range."""
        for name, point in (("anchor", self.anchor), ("attachment", self.attachment)):
            if point.shape != (3,) or not np.isfinite(point).all():
                raise InvalidInput(f"the tether's {name} needs three finite numbers [m]")
        require_above_zero(most_force=self.most_force, free_length=self.free_length, speed=self.speed)
        require_not_negative(clearance=self.clearance, bare=self.bare)
        if self.clearance > MOST_CLEARANCE:
            raise InvalidInput(f"a tether's clearance is at most {MOST_CLEARANCE:g} m", clearance=self.clearance)

    def lengths(self, Ts_site_base: ArrayLike) -> Array:
        """How far anchor and attachment are apart with the chassis at each pose.

        Args:
            Ts_site_base: poses of the chassis, (n, 4, 4).

        Returns:
            Lengths (n,) [m].
        """
        Ts = np.asarray(Ts_site_base, float)
        return np.linalg.norm(self.anchor - Ts[:, :3, 3] - Ts[:, :3, :3] @ self.attachment, axis=1)

    def pull(self, T_site_base: Array) -> tuple[Array, Array]:
        """Where the tether pulls at the chassis, and where to.

        Args:
            T_site_base: pose of the chassis, (4, 4).

        Returns:
            The attachment (3,) in site [m], and the unit direction (3,) to the anchor in site.

        Raises:
            InvalidInput: the tether is shorter than SHORTEST and has no direction.
        """
        at = apply(T_site_base, self.attachment)
        length = float(np.linalg.norm(self.anchor - at))
        if not length > SHORTEST:
            raise InvalidInput("the tether's anchor is at its attachment: it has no direction", length=length)
        return at, (self.anchor - at) / length


EDGE = (-1.05, 0.615, -0.1)
"""Where a tether leaves ATHLETE's chassis unless told otherwise: the middle of its edge between legs 2 and 3, in base
[m]."""
MOST_CLEARANCE = 1.0
"""More is not looked for around each of its points [m]."""
SHORTEST = 0.01
"""A tether that is shorter has no direction that could be counted on [m]."""
