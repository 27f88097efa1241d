"""What the simulated physics differs in from the robot's description, and how its sensors err."""

import numpy as np

from footfall.balance.balance_settings import GRAVITY
from footfall.balance.friction import FRICTION
from footfall.core.bounds import require_above_zero
from footfall.core.errors import InvalidInput
from footfall.core.value import Value, value

WHEEL_SHAPES = ("sphere", "crowned")
"""How a wheel meets the ground: a sphere of its radius, or an ellipsoid of its radius and half its width, whose
lowest point stays near the middle of the tread when the wheel leans."""


@value
class Noise(Value):
    """Standard deviations of what telemetry measures; drawn anew for every moment, equal for an equal seed and moment.

    encoder [rad]; position of the chassis [m], its orientation [rad] about each axis; wheel force [N] along each axis.
    """

    encoder: float = 0.0
    position: float = 0.0
    orientation: float = 0.0
    force: float = 0.0

    def check(self) -> None:
        for name in ("encoder", "position", "orientation", "force"):
            if not 0 <= getattr(self, name) < np.inf:
                raise InvalidInput(f"the noise of {name} must be finite and not negative")


@value
class PhysicsSettings(Value):
    """How the rover in physics differs from its description.

    gravity [m/s²]. friction: coefficient between any two things. *_scale: times the description's joint stiffness,
    wheel stiffness and link masses (payload too). *_spread: each joint, or wheel, differs from the others by a
    factor drawn from 1 ± spread. wheel_shape: one of WHEEL_SHAPES. tip_tilt: a chassis that leans more than this is
    taken for tipped [rad]. noise: of the sensors. seed: of spreads and noise.
    """

    gravity: float = GRAVITY
    friction: float = FRICTION
    stiffness_scale: float = 1.0
    stiffness_spread: float = 0.0
    wheel_scale: float = 1.0
    wheel_spread: float = 0.0
    mass_scale: float = 1.0
    wheel_shape: str = "sphere"
    tip_tilt: float = 0.4
    noise: Noise = Noise()
    seed: int = 0

    def check(self) -> None:
        scales = {name: getattr(self, name) for name in ("stiffness_scale", "wheel_scale", "mass_scale")}
        require_above_zero(friction=self.friction, tip_tilt=self.tip_tilt, **scales)
        require_above_zero("m/s²", gravity=self.gravity)
        for name in ("stiffness_spread", "wheel_spread"):
            if not 0 <= getattr(self, name) < 1:
                raise InvalidInput(f"{name} of the physics must be from 0 to below 1")
        if self.wheel_shape not in WHEEL_SHAPES:
            raise InvalidInput(f"a wheel's shape in physics is one of {', '.join(WHEEL_SHAPES)}")
        if self.seed < 0:
            raise InvalidInput("the seed of the physics can't be negative", seed=self.seed)


TIME_STEP = 0.004
"""Seconds between two states; from 0.016 s on the stiff joints diverge."""

DAMPING_TIME = 0.1
"""Damping of a joint over its stiffness [s]: motions of the set points die out in a few of these."""

ARMATURE = 2.0
"""Inertia that motor and gear add to each joint [kg·m²]."""

RIM_MASS = 20.0
"""Part of the last link's mass that the wheel's springs carry as its rim [kg]."""

RIM_INERTIA = 0.05
"""Moment of inertia of the rim about each axis [kg·m²]; it cannot turn against its link, so it only divides the sum."""

RIM_DAMPING = 2000.0
"""Of the wheel's springs along each axis [N·s/m]."""
