"""How images are turned into terrain, and terrain from elsewhere is laid under it."""

import math
from collections.abc import Sequence
from dataclasses import field, replace

from footfall.core.errors import InvalidInput
from footfall.core.value import LATER, Value, before, value

MATCHERS = ("hh", "3way")

WHOLE, COMMON = "whole", "common"
VIEWS = (WHOLE, COMMON)

LEAST_RANGE = 0.05
"""Ground nearer to a camera than this is not searched for [m]."""
NEAREST_BY_LEG = 0.3
"""Of robots that others described, ground is looked at from this share of the longest leg on."""
MAX_SKEW = 0.02
"""Both images of a pair must be taken within this time of each other [s]: a slow rover moves 1 mm."""


@value
class TerrainSettings(Value):
    """Settings of stereo matching, gridding and fusion.

    resolution: cell size [m].
    half_size: the map reaches this far to each side of the rover [m].
    matcher: "hh" (eight directions, most accurate) or "3way" (about half the time).
    block_size: side of the compared patches [px], odd.
    min_range, max_range: depths that are searched for and kept [m].
    max_skew: a pair whose images were taken further apart than this is left out [s].
    max_jump: neighbouring pixels whose disparities differ by more than this belong to two surfaces [px].
    max_edge: depth triangles with a longer side seen from above are left open [m].
    max_deviation: pixels whose depth has a larger standard deviation than this are left out [m].
    max_deviation_beside: the same near to where the rover itself is seen [m].
    doubtful_deviation: pixels that would be left out, but have a deviation up to this, count where they only go on with
        what surer ones show around them [m]; so do those that may be the rover. 0: none.
    least_angle: so are those whose ray meets the surface at less than this: such lead over a depth jump [rad].
    mask_margin: how wrong the robot's pose in its own images may be [m].
    fit_legs: look in the images for where the legs really are, before they are taken out.
    fitted_margin: instead of mask_margin, for legs that were found so [m].
    gate: views of one cell that differ from the weighted median by more than this are left out [m].
    despike: a cell that differs from the median of its 5 × 5 neighbours by more than this, and more than they do, takes
        the median [m].
    min_neighbours: known cells among those 25 (itself included) that a cell needs to be kept.
    keep: merge into the map that there is; else start anew. Off by default: where a new obstacle hides ground from the
        cameras, the map keeps what stood there before, which may be wrong by now.
    memory_half_size: the map keeps what lies this far to each side of the rover [m].
    drift_per_hour: deviation by which an unseen height becomes unsure in an hour [m]; it grows with √time.
    drift_per_metre: likewise for a metre of the rover's way [m]; it grows with √way.
    see_through: a ray must pass this far below an old height to show that nothing is there any more [m].
    clear_deviation: a new height that contradicts the map replaces it where its deviation is at most this [m].
    max_shift, max_turn: a snapshot that fits the map only when moved by more than this is refused [m], [rad].
    pose_shift, pose_turn: expected deviation of the rover's pose between snapshots [m], [rad].
    pairs: only those of these names are used; empty: all.
    view: what photographs show once rectified: "whole", all that each camera sees, or "common", the part around one
        centre for both, as versions before this setting did.
    """

    resolution: float = 0.02
    half_size: float = 4.0
    matcher: str = "3way"
    block_size: int = 3
    min_range: float = 1.0
    max_range: float = 8.0
    max_skew: float = MAX_SKEW
    max_jump: float = 0.35
    max_edge: float = 0.1
    max_deviation: float = 0.05
    max_deviation_beside: float = field(default=0.03, metadata=LATER)
    doubtful_deviation: float = field(default=0.1, metadata=LATER)
    least_angle: float = 0.25
    mask_margin: float = 0.03
    fit_legs: bool = True
    fitted_margin: float = 0.01
    gate: float = 0.05
    despike: float = 0.02
    min_neighbours: int = 8
    keep: bool = False
    memory_half_size: float = 6.0
    drift_per_hour: float = 0.005
    drift_per_metre: float = 0.002
    see_through: float = 0.08
    clear_deviation: float = 0.04
    max_shift: float = 0.15
    max_turn: float = 0.052
    pose_shift: float = 0.03
    pose_turn: float = 0.0175
    pairs: tuple[str, ...] = field(default=(), metadata=LATER)
    view: str = field(default=WHOLE, metadata=before(COMMON))

    def check(self) -> None:
        """Raises InvalidInput for an unknown matcher or view, and for sizes, ranges and limits out of range."""
        self._check_matching()
        self._check_pixels()
        self._check_memory()

    def _check_matching(self) -> None:
        if self.matcher not in MATCHERS:
            raise InvalidInput(f"matcher is one of {', '.join(MATCHERS)}, not {self.matcher!r}")
        if self.view not in VIEWS:
            raise InvalidInput(f"view is one of {', '.join(VIEWS)}, not {self.view!r}")
        if not 0.005 <= self.resolution <= 1.0:
            raise InvalidInput("resolution needs 0.005 to 1 m", resolution=self.resolution)
        if not 2 * self.resolution <= self.half_size <= 1000 * self.resolution:
            raise InvalidInput("half_size needs 2 to 1000 cells", half_size=self.half_size)
        if self.block_size not in (3, 5, 7, 9, 11):
            raise InvalidInput("block_size is an odd number from 3 to 11", block_size=self.block_size)
        if not LEAST_RANGE <= self.min_range < self.max_range < 1000.0:
            raise InvalidInput(f"needs {LEAST_RANGE} m ≤ min_range < max_range < 1000 m")
        if not 0 <= self.max_skew < math.inf:
            raise InvalidInput("max_skew needs a finite number of at least zero [s]", max_skew=self.max_skew)
        if not (self.max_jump > 0 and self.max_edge > 0 and self.gate > 0 and self.despike > 0):
            raise InvalidInput("max_jump, max_edge, gate and despike need numbers above zero")

    def _check_pixels(self) -> None:
        if not (0 <= self.mask_margin <= 1 and 0 <= self.fitted_margin <= 1 and 0 <= self.min_neighbours <= 25):
            raise InvalidInput("needs mask_margin and fitted_margin 0…1 m and min_neighbours 0…25")
        for name in ("max_deviation", "max_deviation_beside"):
            if not 0 < (most := getattr(self, name)) < math.inf:
                raise InvalidInput(f"{name} needs a finite number above zero [m]", **{name: most})
        if not 0 <= self.doubtful_deviation < math.inf:
            raise InvalidInput(
                "doubtful_deviation needs a finite number of at least zero [m]",
                doubtful_deviation=self.doubtful_deviation,
            )
        if not 0 <= self.least_angle <= 0.5:
            raise InvalidInput("least_angle needs 0 to 0.5 rad (29°)", least_angle=self.least_angle)

    def _check_memory(self) -> None:
        if not 0 < self.memory_half_size <= 1000:
            raise InvalidInput("memory_half_size needs 0 to 1000 m", memory_half_size=self.memory_half_size)
        above_zero = (self.see_through, self.clear_deviation, self.pose_shift, self.pose_turn)
        if not min(above_zero) > 0:
            raise InvalidInput("see_through, clear_deviation, pose_shift and pose_turn need numbers above zero")
        if not (self.drift_per_hour >= 0 and self.drift_per_metre >= 0):
            raise InvalidInput("drift_per_hour and drift_per_metre need numbers of at least zero")
        if not (0 <= self.max_shift <= 1.0 and 0 <= self.max_turn <= 0.2):
            raise InvalidInput("needs max_shift 0…1 m and max_turn 0…0.2 rad (11°)")

    def not_chosen(self, names: Sequence[str]) -> list[str]:
        """Which of the pairs that there are are left out. Raises InvalidInput for a chosen one that is not there."""
        unknown = [name for name in self.pairs if name not in names]
        if unknown:
            raise InvalidInput(f"there is no pair {', '.join(unknown)}; there are {', '.join(names)}", pairs=unknown)
        return [name for name in names if self.pairs and name not in self.pairs]


def terrain_settings_by_leg(longest: float) -> TerrainSettings:
    """Settings as delivered for a robot that others described: it looks at ground as near to it as it is small.

    Args:
        longest: length of its longest leg [m].

    Returns:
        The settings.
    """
    own = TerrainSettings()
    return replace(own, min_range=min(max(NEAREST_BY_LEG * longest, LEAST_RANGE), own.min_range))


@value
class BlendSettings(Value):
    """deviation: standard deviation of the external heights where the terrain itself does not say [m].

    time: when they were measured [s since 1970]. level: first raise all of the external terrain by the median
    difference over the common ground: its heights count from another zero, such as an ellipsoid.

    seam: width of the transition outside of the local map [m]; reach: the result extends this far to each side of
    the local map's centre [m], or over the local map only, when 0.
    """

    deviation: float = 0.5
    time: float = 0.0
    level: bool = False
    seam: float = 1.0
    reach: float = 0.0

    def check(self) -> None:
        """Raises InvalidInput for a deviation, seam, reach or time out of range."""
        if not (0 < self.deviation < math.inf and 0 < self.seam < math.inf and 0 <= self.reach < math.inf):
            raise InvalidInput("blending needs a deviation and a seam above zero, and a reach of at least zero [m]")
        if not math.isfinite(self.time):
            raise InvalidInput("the time of the external terrain must be finite [s since 1970]")
