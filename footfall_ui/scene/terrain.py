"""The ground: the one triangulation, with a picture of the chosen layer on it."""

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.core.grid import GridGeometry
from footfall.maps.colors import HATCH_RGB, hatched, layer_rgb
from footfall.maps.layers import MapStack
from footfall.maps.over_imagery import LINE, darkened, grain, grid_lines
from footfall.terrain.dem import Dem
from footfall.terrain.fusion.lattice import laid_onto
from footfall.terrain.ground.shading import DARKEST, relief
from footfall_ui.scene.drawable import drawable, picked
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.ground_glb import ground_glb

GREY = 190
"""Of ground without an image."""


def ground_rgb(dem: Dem) -> NDArray[np.uint8]:
    """What the cameras saw, or plain grey ground where there is no image; (rows, cols, 3)."""
    grey = np.full(dem.heights.shape, GREY, np.uint8) if dem.texture is None else dem.texture
    return np.repeat(grey[..., None], 3, axis=2)


def held_rgb(dem: Dem, maps: MapStack, layer: str, changed: NDArray[np.bool_] | None) -> NDArray[np.uint8]:
    """A layer of maps of older ground on the cells of newer ground, (rows, cols, 3).

    changed: cells of the maps (rows, cols) where they don't hold: stripes over what the cameras saw; None: none.
    """
    out, cells = ground_rgb(dem), dem.geometry
    spoiled = np.zeros(maps.geometry.shape, bool) if changed is None else changed
    held, marked = (laid_onto(cells, one, maps.geometry, False) for one in (~spoiled, hatched(spoiled)))
    colors = layer_rgb(maps, layer)
    for channel in range(3):
        laid = laid_onto(cells, colors[..., channel], maps.geometry, 0)
        out[held, channel], out[marked, channel] = laid[held], HATCH_RGB[channel]
    return out


def blended(colors: NDArray[np.uint8], under: NDArray[np.uint8], opacity: float) -> NDArray[np.uint8]:
    """Colours (rows, cols, 3) over others of the same cells."""
    return np.rint(opacity * colors + (1.0 - opacity) * under.astype(float)).astype(np.uint8)


def glb(dem: Dem, rgb: NDArray[np.uint8], cells: GridGeometry, brightness: NDArray[np.float64]) -> bytes:
    """Binary glTF of the terrain's triangulation with one texel for each of ``cells``, coarse or as the terrain's.

    brightness: of each cell of the terrain, 0…1; lines of the ground grid are darker still.
    """
    every = round(cells.resolution / dem.geometry.resolution)
    lit = np.where(grid_lines(cells), LINE, 1.0) * brightness[::every, ::every]
    return ground_glb(dem, darkened(rgb, lit), cells)


class TerrainDrawing:
    """Keeps every layer that was shown once as a hidden mesh, so that switching back is instant."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._shown: dict[tuple[str, str], viser.GlbHandle] = {}
        self._opacity = 1.0
        self._relief: tuple[str, NDArray[np.float64]] | None = None

    def show(
        self,
        dem: Dem | None,
        maps: MapStack | None,
        layer: str | None,
        changed: NDArray[np.bool_] | None = None,
        opacity: float = 1.0,
    ) -> None:
        """Show one layer of the map stack; None, or no maps: what the cameras saw.

        changed: see :func:`held_rgb`. opacity: of the layer, 0…1; only the layers of one are kept.
        """
        if dem is None:
            self._keep(set())
            return
        shown = layer if maps is not None and layer in maps.layers else None
        key = (dem.digest, "texture")
        older = maps is not None and maps.provenance.parents.get("dem", dem.digest) != dem.digest
        if maps is not None and shown is not None:
            key = (maps.digest, f"{shown}/on/{dem.digest}" if older else shown)
            if opacity < 1.0:
                key = (key[0], f"{key[1]}-at-{opacity:z.2f}")
        if key not in self._shown:
            drawn = drawable(dem)
            if maps is None or shown is None:
                picture = glb(drawn, ground_rgb(drawn), drawn.geometry, self._relief_of(drawn))
            else:
                brightness = np.maximum(self._relief_of(drawn) * grain(drawn), DARKEST)
                rgb, cells = layer_rgb(maps, shown), maps.geometry
                if older:
                    rgb, cells = held_rgb(dem, maps, shown, changed), dem.geometry
                if drawn is not dem:
                    rgb, cells = picked(rgb, cells, drawn.geometry), drawn.geometry
                if opacity < 1.0:
                    rgb = blended(rgb, picked(ground_rgb(drawn), drawn.geometry, cells), opacity)
                picture = glb(drawn, rgb, cells, brightness)
            add = self._server.scene.add_glb
            name = f"/terrain/{key[0]}/{key[1]}"
            self._shown[key] = self._drawn.add(
                add, name, picture, visible=False, cast_shadow=False, receive_shadow=False
            )
        for other, handle in self._shown.items():
            handle.visible = other == key
        # after the new one is there, so that the ground is never blank in between
        kept = {dem.digest} | ({maps.digest} if maps is not None else set())
        if self._opacity != opacity:
            self._shown = {one: handle for one, handle in self._shown.items() if one == key or one[1] == "texture"}
            self._opacity = opacity
        self._keep(kept)

    def _relief_of(self, dem: Dem) -> NDArray[np.float64]:
        """Worked out once for each terrain: layers are switched more often."""
        if self._relief is None or self._relief[0] != dem.digest:
            self._relief = dem.digest, relief(dem)
        return self._relief[1]

    def _keep(self, digests: set[str]) -> None:
        self._shown = {key: handle for key, handle in self._shown.items() if key[0] in digests}
        self._drawn.only([handle.name for handle in self._shown.values()])
