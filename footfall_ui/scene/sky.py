"""Sky and far ground: a ball around everything, in the colours of the page's theme, with haze at its level horizon.

The haze tells far from near and where the known ground ends. It lies on nothing that is known: colours of layers mean
something, and none of this is measured.
"""

from typing import NamedTuple

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.core.mesh import Mesh
from footfall.terrain.dem import Dem
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.glb import unlit_glb
from footfall_ui.visitors import THEMES

Color = tuple[int, int, int]


class Sky(NamedTuple):
    """Colours overhead, at the horizon, and of the ground under the rover."""

    zenith: Color
    haze: Color
    ground: Color


SKIES = {
    "dark": Sky((34, 42, 60), (112, 124, 146), (54, 54, 57)),
    "light": Sky((112, 142, 184), (188, 199, 212), (98, 97, 96)),
    "sunlight": Sky((96, 138, 194), (206, 216, 228), (110, 108, 105)),
}
"""Of the themes. White lines and a white rover are seen before all ground."""
FADES = 20.0
"""Ground at so many times the height of the eye has lost 63 % of its own colour: Koschmieder's law."""
LEAST, MOST = 300.0, 900.0
"""Radius [m]; the pages draw nothing that is farther than a kilometre."""
STEP = 50.0
"""Of its middle, east and north, and of its radius [m]: it is not sent anew for every map."""
TEXELS, RINGS, SIDES = 256, 24, 32
NAME = "/sky"


def gradient(theme: str = THEMES[0]) -> NDArray[np.uint8]:
    """From straight down to straight up, (TEXELS, 1, 3): haze is thickest at the horizon, in the middle."""
    sky = SKIES[theme]
    elevation = (np.arange(TEXELS) + 0.5) / TEXELS * np.pi - np.pi / 2
    away = 1.0 / np.tan(np.abs(elevation))  # of the ground seen there, over the height of the eye
    clear = np.where(elevation < 0, np.exp(-away / FADES), np.abs(elevation / (np.pi / 2)) ** 0.5)[:, None]
    beyond = np.where(elevation[:, None] < 0, sky.ground, sky.zenith)
    return np.rint(sky.haze + clear * (beyond - np.array(sky.haze))).astype(np.uint8)[:, None, :]


def ball(radius: float, middle: tuple[float, float, float]) -> tuple[Mesh, NDArray[np.float64]]:
    """A sphere [m] and where on the gradient its vertices are, (n, 2): by their elevation alone."""
    elevation = np.linspace(-np.pi / 2, np.pi / 2, RINGS + 1)
    azimuth = np.linspace(0.0, 2 * np.pi, SIDES + 1)
    up, around = np.meshgrid(elevation, azimuth, indexing="ij")
    vertices = np.stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)], axis=-1)
    corner = np.arange(RINGS * (SIDES + 1)).reshape(RINGS, SIDES + 1)[:, :-1].ravel()
    lower = np.column_stack([corner, corner + 1, corner + SIDES + 2])
    upper = np.column_stack([corner, corner + SIDES + 2, corner + SIDES + 1])
    along = np.clip(0.5 + up / np.pi, 0.5 / TEXELS, 1 - 0.5 / TEXELS)
    mesh = Mesh(radius * vertices.reshape(-1, 3) + middle, np.concatenate([lower, upper]).astype(np.int32))
    return mesh, np.column_stack([np.full(along.size, 0.5), along.ravel()])


def place(dem: Dem | None) -> tuple[float, tuple[float, float, float]]:
    """Radius and middle of the ball [m]: about the map, at the height of its lowest ground, far outside of it."""
    if dem is None:
        return LEAST, (0.0, 0.0, 0.0)
    west, south, east, north = dem.geometry.bounds
    x, y = (STEP * round((low + high) / 2 / STEP) for low, high in ((west, east), (south, north)))
    radius = STEP * np.ceil(2 * np.hypot(east - west, north - south) / STEP)
    return float(np.clip(radius, LEAST, MOST)), (x, y, float(np.round(np.nanmin(dem.heights))))


class SkyDrawing:
    """Sent again only where the map has moved or grown far, or the page wears another theme."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._as: tuple[str, float, tuple[float, float, float]] | None = None

    def show(self, dem: Dem | None, theme: str = THEMES[0]) -> None:
        """dem: None: there is no terrain yet."""
        radius, middle = place(dem)
        if (theme, radius, middle) == self._as:
            return
        self._as = None
        content = unlit_glb(*ball(radius, middle), gradient(theme))
        self._drawn.add(self._server.scene.add_glb, NAME, content, cast_shadow=False, receive_shadow=False)
        self._as = theme, radius, middle
