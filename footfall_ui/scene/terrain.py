"""The ground: the one triangulation, with a picture of the chosen layer on it."""

from typing import Any

import numpy as np
import trimesh
import viser
from numpy.typing import NDArray
from PIL import Image
from trimesh.exchange.gltf import export_glb
from trimesh.transformations import translation_matrix
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from footfall.core.grid import GridGeometry
from footfall.maps.colors import HATCH_RGB, hatched, layer_rgb
from footfall.maps.layers import MapStack
from footfall.terrain.dem import Dem
from footfall.terrain.fusion.lattice import laid_onto
from footfall.terrain.ground.triangulate import triangulate
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.near import near

SUN = np.array([-0.45, 0.35, 0.82])


def hillshade(dem: Dem) -> NDArray[np.float64]:
    """Brightness 0.45…1 of each cell under a fixed sun; unlit layers would hide the relief."""
    known = np.nan_to_num(dem.heights.astype(float), nan=float(np.nanmean(dem.heights)))
    if min(known.shape) < 2:
        return np.ones(known.shape)
    slope_y, slope_x = np.gradient(known, dem.geometry.resolution)
    facing = (SUN[2] - SUN[0] * slope_x - SUN[1] * slope_y) / np.sqrt(1 + slope_x**2 + slope_y**2)
    return 0.45 + 0.55 * np.clip(facing, 0, 1)


def ground_rgb(dem: Dem) -> NDArray[np.uint8]:
    """What the cameras saw, or plain grey ground where there is no image; (rows, cols, 3)."""
    grey = np.full(dem.heights.shape, 168, np.uint8) if dem.texture is None else dem.texture
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


def glb(dem: Dem, rgb: NDArray[np.uint8], cells: GridGeometry) -> bytes:
    """Binary glTF of the terrain's triangulation with one texel for each of ``cells``, coarse or as the terrain's.

    The vertices are about the terrain's middle, where the file's node places them: float32 keeps seven digits.
    Unlit: the scene's lights would wash out the colours that the operator decides on, and take a computer without
    graphics most of the time of a picture.
    """
    mesh = triangulate(dem)
    u = ((mesh.vertices[:, 0] - cells.x0) / cells.resolution + 0.5) / cells.cols
    v = ((mesh.vertices[:, 1] - cells.y0) / cells.resolution + 0.5) / cells.rows
    every = round(cells.resolution / dem.geometry.resolution)
    shaded = (rgb * hillshade(dem)[::every, ::every, None]).astype(np.uint8)
    image = Image.fromarray(shaded[::-1])  # image row 0 is the north edge
    material = PBRMaterial(baseColorTexture=image, metallicFactor=0.0, roughnessFactor=1.0, doubleSided=True)
    visual = TextureVisuals(uv=np.column_stack([u, v]), material=material)
    local, middle = near(mesh.vertices)
    solid = trimesh.Trimesh(local, mesh.triangles, visual=visual, process=False)
    placed = trimesh.Scene()
    placed.add_geometry(solid, transform=translation_matrix(middle))
    return export_glb(placed, tree_postprocessor=_unlit)


def _unlit(tree: dict[str, Any]) -> None:
    for material in tree["materials"]:
        material["extensions"] = {"KHR_materials_unlit": {}}
    tree["extensionsUsed"] = ["KHR_materials_unlit"]


class TerrainDrawing:
    """Keeps every layer that was shown once as a hidden mesh, so that switching back is instant."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._shown: dict[tuple[str, str], viser.GlbHandle] = {}

    def show(
        self,
        dem: Dem | None,
        maps: MapStack | None,
        layer: str | None,
        changed: NDArray[np.bool_] | None = None,
    ) -> None:
        """Show one layer of the map stack; None, or no maps: what the cameras saw. changed: see :func:`held_rgb`."""
        if dem is None:
            self._keep(set())
            return
        shown = layer if maps is not None and layer in maps.layers else None
        key = (dem.digest, "texture")
        older = maps is not None and maps.provenance.parents.get("dem", dem.digest) != dem.digest
        if maps is not None and shown is not None:
            key = (maps.digest, f"{shown}/on/{dem.digest}" if older else shown)
        if key not in self._shown:
            if maps is None or shown is None:
                picture = glb(dem, ground_rgb(dem), dem.geometry)
            elif older:
                picture = glb(dem, held_rgb(dem, maps, shown, changed), dem.geometry)
            else:
                picture = glb(dem, layer_rgb(maps, shown), maps.geometry)
            add = self._server.scene.add_glb
            name = f"/terrain/{key[0]}/{key[1]}"
            self._shown[key] = self._drawn.add(
                add, name, picture, visible=False, cast_shadow=False, receive_shadow=False
            )
        for other, handle in self._shown.items():
            handle.visible = other == key
        # after the new one is there, so that the ground is never blank in between
        self._keep({dem.digest} | ({maps.digest} if maps is not None else set()))

    def _keep(self, digests: set[str]) -> None:
        self._shown = {key: handle for key, handle in self._shown.items() if key[0] in digests}
        self._drawn.only([handle.name for handle in self._shown.values()])
