"""Map layers as files: all of them as the bands of one GeoTIFF or as named arrays, one as a picture or an array."""

import io
import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rasterio.crs import CRS
from rasterio.io import MemoryFile

from footfall.core.errors import InvalidInput, NotFound
from footfall.io.image_files import encode_png
from footfall.io.terrain_geotiff import SITE_CRS, north_up
from footfall.io.whole_files import require_writable, write_whole
from footfall.maps.colors import BARE_RGB, HATCH_RGB, UNKNOWN_RGB, hatched, layer_rgb
from footfall.maps.layers import ALL_LAYERS, MapStack
from footfall.maps.over_imagery import darkened, grain
from footfall.terrain.dem import Dem
from footfall.terrain.ground.shading import relief

ALL, ONE = (".tif", ".tiff", ".npz"), (".png", ".npy")


def maps_geotiff(stack: MapStack) -> bytes:
    """Every layer as a float32 band, described by name and unit; classes keep their numbers, NaN is unknown.

    The tag ``FOOTFALL`` says as JSON which leg, which polygon footing asks for, and the digest.
    """
    rows, cols = stack.geometry.shape
    profile = {
        "driver": "GTiff",
        "height": rows,
        "width": cols,
        "count": len(stack.layers),
        "dtype": "float32",
        "crs": CRS.from_wkt(SITE_CRS),
        "transform": north_up(stack.geometry),
        "nodata": float("nan"),
        "compress": "deflate",
    }
    about = {"leg": stack.leg, "stability": stack.stability, "digest": stack.digest}
    with MemoryFile() as memory:
        with memory.open(**profile) as target:
            for band, (name, cells) in enumerate(stack.layers.items(), 1):
                target.write(cells[::-1].astype(np.float32), band)
                target.set_band_description(
                    band, f"{name} [{ALL_LAYERS[name].unit}]" if ALL_LAYERS[name].unit else name
                )
            target.update_tags(FOOTFALL=json.dumps(about))
        return bytes(memory.read())


def layer_png(stack: MapStack, layer: str) -> bytes:
    """One layer in the colours of the page, north up. Raises NotFound for a layer that the stack lacks."""
    return encode_png(np.ascontiguousarray(layer_rgb(stack, layer)[::-1]))


def relief_png(dem: Dem) -> bytes:
    """The ground as the assumed light and the images' grain show it, north up; what nobody saw has its own colour."""
    known = np.isfinite(dem.heights)
    bare = np.full((*known.shape, 3), BARE_RGB, np.uint8)
    rgb = darkened(bare, np.where(known, relief(dem) * grain(dem), 0.0))
    rgb[~known] = UNKNOWN_RGB
    return encode_png(np.ascontiguousarray(rgb[::-1]))


def changed_png(changed: NDArray[np.bool_]) -> bytes:
    """Stripes where the ground of maps has changed, to lie over their layers, north up; clear where it has not."""
    rgba = np.zeros((*changed.shape, 4), np.uint8)
    rgba[changed] = (*UNKNOWN_RGB, 255)
    rgba[hatched(changed)] = (*HATCH_RGB, 255)
    return encode_png(np.ascontiguousarray(rgba[::-1]))


def layer_npy(stack: MapStack, layer: str) -> bytes:
    """One layer as a numpy array, row 0 south. Raises NotFound for a layer that the stack lacks."""
    out = io.BytesIO()
    np.save(out, require_layer(stack, layer), allow_pickle=False)
    return out.getvalue()


def require_layer(stack: MapStack, layer: str) -> NDArray[np.generic]:
    """The cells of a layer. Raises NotFound for a layer that the stack lacks."""
    if layer not in stack.layers:
        raise NotFound(f"there is no layer {layer!r}; there are {', '.join(stack.layers)}", layer=layer)
    return stack.layers[layer]


def require_map_file(path: Path, layer: str | None) -> None:
    """Raise what :func:`write_maps` would raise whatever the maps are: before they are computed."""
    ending = path.suffix.lower()
    if ending not in ALL + ONE:
        raise InvalidInput(
            f"maps are written as {', '.join(ALL)} (all layers) or {', '.join(ONE)} (one layer), "
            f"not {path.suffix or path.name!r}"
        )
    if ending in ONE and layer is None:
        raise InvalidInput(f"say which layer goes into {path.name}")
    if ending in ALL and layer is not None:
        raise InvalidInput(f"{path.name} takes all layers; leave out the layer, or write {' or '.join(ONE)}")
    if layer is not None and layer not in ALL_LAYERS:
        raise NotFound(f"there is no layer {layer!r}; there are {', '.join(ALL_LAYERS)}", layer=layer)
    require_writable(path)


def write_maps(stack: MapStack, path: Path, layer: str | None = None) -> None:
    """.tif or .npz: all layers; .png (colours, north up) or .npy (row 0 south): the one called ``layer``.

    Raises InvalidInput for another ending, and where a layer is named for all or none for one; NotFound for a layer
    that the stack lacks.
    """
    require_map_file(path, layer)
    ending = path.suffix.lower()
    if layer is None:
        write_whole(path, _npz(stack) if ending == ".npz" else maps_geotiff(stack))
    else:
        write_whole(path, layer_png(stack, layer) if ending == ".png" else layer_npy(stack, layer))


def _npz(stack: MapStack) -> bytes:
    """Arrays by layer name, row 0 south; the grid as ``x0``, ``y0``, ``resolution`` [m]; ``leg``, ``stability``."""
    out = io.BytesIO()
    grid = stack.geometry
    about = {"x0": grid.x0, "y0": grid.y0, "resolution": grid.resolution, "leg": stack.leg}
    np.savez_compressed(out, allow_pickle=False, **about, stability=stack.stability, **dict(stack.layers.items()))
    return out.getvalue()
