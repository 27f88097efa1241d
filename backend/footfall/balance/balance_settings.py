"""What balance is judged by: friction, gravity and its direction, and what the rover carries."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.balance.friction import FRICTION
from footfall.core.arrays import Array
from footfall.core.bounds import require_above_zero
from footfall.core.errors import InvalidInput, NotFound
from footfall.core.frames import rotation
from footfall.core.value import Value, value

GRAVITY = 9.81
"""On Earth [m/s²]."""

SIDES = 8
"""Eight sides lose about 10 % of the cone's cross-section; the result stays on the safe side."""

SIDES_ALLOWED = (4, 8, 16)

GRAVITIES: Mapping[str, float] = {"earth": GRAVITY, "moon": 1.62, "mars": 3.71}
"""Gravity at the surface [m/s²]."""

PAYLOAD_LIMIT = 300.0
"""Largest payload [kg]: what is published for the first ATHLETE prototype on Earth."""


@value
class BalanceSettings(Value):
    """friction: coefficient between wheel and ground; sides of the friction pyramids: 4, 8 or 16.

    gravity [m/s²], see GRAVITIES. slope, uphill [rad]: what if the site were tilted by ``slope`` so that it rises
    towards the azimuth ``uphill``; 0 for a site whose z is vertical.
    payload_mass [kg]: None for what the robot's description carries; a number stands in its place, 0 for nothing.
    payload_position: (3,) of that payload's centre in base [m]; None: where the description has its own, or the deck.
    """

    friction: float = FRICTION
    gravity: float = GRAVITY
    slope: float = 0.0
    uphill: float = 0.0
    payload_mass: float | None = None
    payload_position: NDArray[np.float64] | None = None
    sides: int = SIDES

    def check(self) -> None:
        """Raises InvalidInput for a friction, gravity, slope, direction or payload out of range."""
        require_cone(self.friction, self.sides)
        require_above_zero("m/s²", gravity=self.gravity)
        if not 0 <= self.slope < np.pi / 2:
            raise InvalidInput("the slope must be at least 0 and below π/2 [rad]", slope=self.slope)
        if not np.isfinite(self.uphill):
            raise InvalidInput("the uphill direction must be finite [rad]", uphill=self.uphill)
        if self.payload_mass is not None and not 0 <= self.payload_mass <= PAYLOAD_LIMIT:
            raise InvalidInput(
                f"the payload must be between 0 and {PAYLOAD_LIMIT:g} kg", payload_mass=self.payload_mass
            )
        where = self.payload_position
        if where is not None and self.payload_mass is None:
            raise InvalidInput("a payload_position needs a payload_mass [kg]")
        if where is not None and (where.shape != (3,) or not np.isfinite(where).all()):
            raise InvalidInput("the payload's position needs three finite numbers [m]")

    @property
    def R_level_site(self) -> Array:
        """(3, 3): turns the site so that z points against gravity; x and y keep their direction on even ground."""
        if self.slope == 0.0:
            return np.eye(3)
        return rotation("z", self.uphill) @ rotation("y", -self.slope) @ rotation("z", -self.uphill)

    def level(self, vectors: ArrayLike) -> Array:
        """Points or directions (…, 3) of the site in the *level* frame: z against gravity, origin that of the site."""
        turned = np.asarray(vectors, float)
        if turned.shape[-1:] != (3,):
            raise InvalidInput("points and normals need three numbers each", shape=list(turned.shape))
        return turned @ self.R_level_site.T


def gravity_named(name: str) -> float:
    """Gravity of a named place [m/s²]; raises NotFound naming those that exist."""
    try:
        return GRAVITIES[name]
    except KeyError:
        raise NotFound(f"no gravity is known for {name!r}; there are {', '.join(GRAVITIES)}") from None


def require_cone(friction: float, sides: int) -> None:
    """Raises InvalidInput unless friction is above zero and sides one of SIDES_ALLOWED."""
    require_above_zero(friction=friction)
    if sides not in SIDES_ALLOWED:
        raise InvalidInput(f"a friction cone has {', '.join(map(str, SIDES_ALLOWED))} sides", sides=sides)
