"""The recheck of a whole walk, independent of how it was planned."""

from footfall.planning.walk.recheck.walk import EVERY, recheck_walk

__all__ = ["EVERY", "recheck_walk"]
