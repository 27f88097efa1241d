"""How large the Ambler is, and where each size comes from.

D. Wettergreen, H. Thomas, C. Thorpe, "Planning strategies for the Ambler walking robot", IEEE Int. Conf. on Systems
Engineering, 1990, says how it is built: six legs on two stacks, each leg a rotation without end, an extension and a
vertical, and the stance that is typical of it. All else is assumed: it gives a robot that stands and walks so.
"""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class AmblerSizes:
    """Lengths [m], masses [kg], efforts [N·m, N], speeds [rad/s, m/s].

    Published: height, width, length of the typical stance. Assumed: all others.

    apart: of the stacks' axes. lowest, rise: of the lowest extension over the ground in the typical stance, and from
    each leg of a stack to the one above it. shortest, longest: of a foot from its stack. upward, downward: how far a
    foot gets from the typical stance. overlap: of the parts of a telescope that is all out. hub, arch: radius and
    height; length, width beyond the stacks and height. boom, outer, inner: width and height of the extension, radii of
    the vertical's tubes. masses: of the arch, and of hub, extension, outer and inner tube of each leg.
    """

    height: float = 5.0
    width: float = 4.5
    length: float = 3.5
    apart: float = 1.6
    lowest: float = 3.4
    rise: float = 0.4
    shortest: float = 1.0
    longest: float = 2.65
    upward: float = 1.15
    downward: float = 0.75
    overlap: float = 0.1
    hub: tuple[float, float] = (0.25, 0.3)
    arch: tuple[float, float, float] = (1.2, 0.5, 0.5)
    boom: tuple[float, float] = (0.16, 0.2)
    outer: float = 0.1
    inner: float = 0.07
    arch_mass: float = 1300.0
    leg_masses: tuple[float, float, float, float] = (60.0, 50.0, 40.0, 50.0)
    efforts: tuple[float, float, float] = (4000.0, 6000.0, 20000.0)
    speeds: tuple[float, float, float] = (0.2, 0.15, 0.15)
    clearance: float = 0.1

    @property
    def base_height(self) -> float:
        """Of the base, the middle of the arch's underside, over the ground in the typical stance."""
        return self.height - self.arch[2]

    @property
    def middle(self) -> float:
        """From a stack to a foot with the extension half out."""
        return (self.shortest + self.longest) / 2

    @property
    def out(self) -> float:
        """How far outward of its stack a foot stands in the typical stance."""
        return (self.width - self.apart) / 2

    @property
    def sheath(self) -> float:
        """Height of the lower end of all outer tubes over the ground in the typical stance."""
        return self.upward + self.overlap

    @property
    def tube(self) -> float:
        """Length of an inner tube."""
        return self.upward + self.downward + 2 * self.overlap

    def azimuth(self, ahead: int) -> float:
        """Where a foot stands in the typical stance, seen from its stack: 0 sideways, outward, above 0 to the front.

        ahead: 1 for the front leg of a stack, 0 for the middle one, −1 for the rear one.
        """
        return math.atan2(ahead * self.length / 2, self.out)

    def extension(self, ahead: int) -> float:
        """How far the extension is out there, from half out."""
        return math.hypot(ahead * self.length / 2, self.out) - self.middle
