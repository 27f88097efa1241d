"""Set points followed row by row, with where the rover is predicted to be after each."""

import numpy as np

from footfall.core.arrays import Array
from footfall.core.progress import Progress
from footfall.planning.compliance.compliant_rover import CompliantRover, RestingRover
from footfall.planning.compliance.predict import advanced

ROW = 0.05
"""Largest change of a planned joint between two waypoints [rad]."""


class Lost(Exception):
    """The motion can't be commanded or predicted any further; its text says why."""


class Walker:
    """Follows set points from row to row and remembers where the rover was."""

    def __init__(self, rover: CompliantRover, start: RestingRover, first: str, rows: int, progress: Progress) -> None:
        """first: the phase that begins at ``start``; rows: about how many there will be."""
        self.rover, self.rest, self._rows, self._progress = rover, start, rows, progress
        self.rests, self.phases = [start], [first]

    def go(self, commanded: Array, phase: str) -> None:
        """One row more. Raises Lost where nothing holds the rover there."""
        self._progress(min(len(self.rests) / self._rows, 1.0), f"predicting how the rover gives way: {phase}")
        rest = advanced(self.rover, self.rest, commanded)
        if not rest.settled:
            raise Lost(f"in {phase}, at waypoint {len(self.rests)}, nothing holds the rover in balance")
        self.rest = rest
        self.rests.append(rest)
        self.phases.append(phase)

    def line(self, commanded: Array, phase: str, rows: int | None = None) -> None:
        """Straight to the set points in so many rows, else as many as keep ``ROW``."""
        origin = self.rest.commanded
        count = rows or max(1, int(np.ceil(np.abs(commanded - origin).max() / ROW)))
        for row in range(1, count + 1):
            self.go(commanded if row == count else origin + row / count * (commanded - origin), phase)
