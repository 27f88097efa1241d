"""Sky and far ground: a ball around everything, dim, with haze at its level horizon.

It tells up from down and where the known ground ends; nothing on it is measured.
"""

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.core.mesh import Mesh
from footfall.terrain.dem import Dem
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.glb import unlit_glb

ZENITH, HAZE = (34, 42, 60), (112, 124, 146)
"""Colours of the sky overhead and at the horizon: dark enough for light labels."""
FAR_GROUND, BELOW = (84, 84, 86), (54, 54, 57)
"""Colours of the ground at the horizon and under the rover."""
LEAST, MOST = 300.0, 900.0
"""Radius [m]; the pages draw nothing that is farther than a kilometre."""
STEP = 50.0
"""Of its middle, east and north, and of its radius [m]: it is not sent anew for every map."""
TEXELS, RINGS, SIDES = 256, 24, 32
NAME = "/sky"


def gradient() -> NDArray[np.uint8]:
    """From straight down to straight up, (TEXELS, 1, 3): a sharp horizon in the middle, and haze over it."""
    elevation = (np.arange(TEXELS) + 0.5) / TEXELS * 2 - 1
    share = np.abs(elevation)[:, None] ** 0.5
    near, far = (np.where(elevation[:, None] < 0, *pair) for pair in ((FAR_GROUND, HAZE), (BELOW, ZENITH)))
    return np.rint(near + share * (far - near)).astype(np.uint8)[:, None, :]


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
    """Sent again only where the map has moved or grown far."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._at: tuple[float, tuple[float, float, float]] | None = None

    def show(self, dem: Dem | None) -> None:
        """None: there is no terrain yet."""
        at = place(dem)
        if at == self._at:
            return
        self._at = None
        content = unlit_glb(*ball(*at), gradient())
        self._drawn.add(self._server.scene.add_glb, NAME, content, cast_shadow=False, receive_shadow=False)
        self._at = at
