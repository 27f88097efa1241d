"""How images are turned into terrain."""

from footfall.core.errors import InvalidInput
from footfall.core.value import Value, value

MATCHERS = ("hh", "3way")


@value
class TerrainSettings(Value):
    """Settings of stereo matching, gridding and fusion.

    resolution: cell size [m].
    half_size: the map reaches this far to each side of the rover [m].
    matcher: "hh" (eight directions, most accurate) or "3way" (about half the time).
    block_size: side of the compared patches [px], odd.
    min_range, max_range: depths that are searched for and kept [m].
    max_jump: neighbouring pixels whose disparities differ by more than this belong to two surfaces [px].
    max_edge: depth triangles with a longer side seen from above are left open [m].
    mask_margin: how wrong the robot's pose in its own images may be [m].
    gate: views of one cell that differ from the weighted median by more than this are left out [m].
    despike: a cell that differs from the median of its 5 × 5 neighbours by more than this takes the median [m].
    min_neighbours: known cells among those 25 (itself included) that a cell needs to be kept.
    """

    resolution: float = 0.02
    half_size: float = 4.0
    matcher: str = "hh"
    block_size: int = 5
    min_range: float = 1.0
    max_range: float = 8.0
    max_jump: float = 0.5
    max_edge: float = 0.1
    mask_margin: float = 0.03
    gate: float = 0.05
    despike: float = 0.02
    min_neighbours: int = 8

    def check(self) -> None:
        if self.matcher not in MATCHERS:
            raise InvalidInput(f"matcher is one of {', '.join(MATCHERS)}, not {self.matcher!r}")
        if not 0.005 <= self.resolution <= 1.0:
            raise InvalidInput("resolution needs 0.005 to 1 m", resolution=self.resolution)
        if not 2 * self.resolution <= self.half_size <= 1000 * self.resolution:
            raise InvalidInput("half_size needs 2 to 1000 cells", half_size=self.half_size)
        if self.block_size not in (3, 5, 7, 9, 11):
            raise InvalidInput("block_size is an odd number from 3 to 11", block_size=self.block_size)
        if not 0.05 <= self.min_range < self.max_range < 1000.0:
            raise InvalidInput("needs 0.05 m ≤ min_range < max_range < 1000 m")
        if not (self.max_jump > 0 and self.max_edge > 0 and self.gate > 0 and self.despike > 0):
            raise InvalidInput("max_jump, max_edge, gate and despike need numbers above zero")
        if not (0 <= self.mask_margin <= 1 and 0 <= self.min_neighbours <= 25):
            raise InvalidInput("needs mask_margin 0…1 m and min_neighbours 0…25")
