"""Suggested footfalls: a ranked small mark at each."""

from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.maps.suggest import Suggestions
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.near import near

COLOR = (40, 200, 90)
SIZE = 0.08
"""Half a mark's width [m]."""
OVER_GROUND = 0.03
MARKS = "/suggested/marks"


@dataclass(frozen=True)
class Marker:
    """point: site frame (3,) [m]; text: its rank, best 1; the page lists the scores, which would cover each
    other here."""

    point: NDArray[np.float64]
    text: str


def markers(suggestions: Suggestions) -> tuple[Marker, ...]:
    """Best first; where the height is unknown there is no place to draw one."""
    return tuple(
        Marker(np.array([one.x, one.y, one.z + OVER_GROUND]), f"{rank}")
        for rank, one in enumerate(suggestions.footfalls, 1)
        if one.z is not None
    )


class SuggestedDrawing:
    """A square on its corner at each suggestion, with its rank."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._of: Suggestions | None = None

    def show(self, suggestions: Suggestions) -> None:
        if suggestions is self._of:
            return
        self._of = None
        found = markers(suggestions)
        if not found:
            self._drawn.clear()
            return
        corners = SIZE * np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
        around = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
        segments, middle = near(np.concatenate([one.point + around for one in found]))
        scene = self._server.scene
        names = {f"/suggested/{rank}": one for rank, one in enumerate(found)}
        self._drawn.add(
            scene.add_line_segments, MARKS, segments, COLOR, thickness=3.0, thickness_units="screen", position=middle
        )
        for name, one in names.items():
            self._drawn.add(scene.add_label, name, one.text, position=one.point)
        self._drawn.only([MARKS, *names])
        self._of = suggestions

    def hide(self) -> None:
        self._of = None
        self._drawn.clear()
