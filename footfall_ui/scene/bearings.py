"""What size and which way things are: the compass' letters and a scale bar at the map's edges, and where light is from.

North is the site's y. The light that the relief is drawn with is an assumed one, and says so.
"""

from dataclasses import dataclass

import numpy as np
import viser

from footfall.core.arrays import Array
from footfall.maps.over_imagery import grid_spacing
from footfall.terrain.dem import Dem
from footfall.terrain.ground.shading import LIGHT
from footfall_ui.scene.drawable import drawable
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.near import near

MOST_PIECES = 5
"""Of the scale bar, each as long as a square of the ground grid."""
OVER = 0.05
"""Of letters and bar over the ground there [m]."""
TONES = ((255, 255, 255), (120, 120, 120))
"""Of the pieces, by turns."""
LIT = "light assumed from here"
ROOT = "/bearings"
_ORDINALS = {2: "2nd", 3: "3rd"}


@dataclass(frozen=True)
class Bearings:
    """texts: what is written where, site frame (3,) [m]. bar: pieces of the scale bar, (n, 2, 3) [m].

    light: an arrow (3, 2, 3) [m] the way that the assumed light shines, from its text on.
    """

    texts: dict[str, Array]
    bar: Array
    light: Array


def bearings_of(whole: Dem) -> Bearings:
    """Letters in the middles of the edges of the map, the bar from its south-west corner eastward."""
    dem = drawable(whole)
    step = round(dem.geometry.resolution / whole.geometry.resolution)
    drawn = "" if step == 1 else f" (drawn: every {_ORDINALS.get(step, f'{step}th')} cell)"
    west, south, east, north = dem.geometry.bounds
    x, y = 0.5 * (west + east), 0.5 * (south + north)
    spacing = grid_spacing(dem.geometry.resolution)
    pieces = int(np.clip(np.floor((east - west) / spacing), 1, MOST_PIECES))
    marks = spacing * np.arange(pieces + 1) + west
    toward = 0.5 * (x + (west if LIGHT[0] < 0 else east))
    places = {
        _north(dem): (x, north),
        "E": (east, y),
        "S": (x, south),
        "W": (west, y),
        f"{pieces * spacing:z.0f} m{drawn}": (float(marks[-1]), south),
        LIT: (toward, north if LIGHT[1] > 0 else south),
    }
    row, col = np.nonzero(np.isfinite(dem.heights))
    known = np.column_stack([dem.geometry.xs[col], dem.geometry.ys[row]])

    def on_ground(xy: tuple[float, float]) -> Array:
        nearest = int(np.argmin(((known - xy) ** 2).sum(axis=1)))
        return np.array([*xy, dem.heights[row[nearest], col[nearest]] + OVER])

    ends = np.array([on_ground((float(mark), south)) for mark in marks])
    texts = {text: on_ground(xy) for text, xy in places.items()}
    return Bearings(texts, np.stack([ends[:-1], ends[1:]], axis=1), _arrow(texts[LIT], spacing))


def _arrow(begin: Array, length: float) -> Array:
    """From a place on, level, the way that light shines."""
    along = -length * np.array([LIGHT[0], LIGHT[1], 0.0]) / np.hypot(LIGHT[0], LIGHT[1])
    aside = np.array([-along[1], along[0], 0.0])
    tip = begin + along
    return np.array([(begin, tip), (tip, tip - 0.3 * along + 0.15 * aside), (tip, tip - 0.3 * along - 0.15 * aside)])


def _north(dem: Dem) -> str:
    """What stands at the north edge: where true north is known and turned from the map's, by how much."""
    if dem.true_north is None or round(dem.true_north[0]) == 0:
        return "N"
    side = "E" if dem.true_north[0] > 0 else "W"
    return f"N (true north {abs(dem.true_north[0]):z.0f}° {side})"


class BearingsDrawing:
    """Made once for each terrain."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._of = ""

    def show(self, dem: Dem | None) -> None:
        """None: there is no terrain."""
        digest = "" if dem is None else dem.digest
        if digest == self._of:
            return
        self._of = ""
        names: list[str] = []
        if dem is not None:
            found, scene = bearings_of(dem), self._server.scene
            for text, point in found.texts.items():
                names.append(f"{ROOT}/{len(names)}")
                self._drawn.add(scene.add_label, names[-1], text, position=point, anchor="bottom-center")
            for name, lines, tones, thick in (
                ("bar", found.bar, TONES, 6.0),
                ("light", found.light, TONES[:1], 2.5),
            ):
                local, middle = near(lines)
                colors = np.array([tones[i % len(tones)] for i in range(len(local))], np.uint8)
                names.append(f"{ROOT}/{name}")
                self._drawn.add(
                    scene.add_line_segments,
                    names[-1],
                    local,
                    np.repeat(colors[:, None], 2, axis=1),
                    thickness=thick,
                    thickness_units="screen",
                    position=middle,
                )
        self._drawn.only(names)
        self._of = digest
