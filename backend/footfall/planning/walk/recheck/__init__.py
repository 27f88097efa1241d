"""The recheck of a whole walk, independent of how it was planned; asked for in ``walk``."""
