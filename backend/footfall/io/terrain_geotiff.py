"""GeoTIFF terrain through rasterio."""

import warnings

import numpy as np
import rasterio
from rasterio.crs import CRS
from rasterio.enums import ColorInterp
from rasterio.errors import CRSError, NotGeoreferencedWarning, RasterioError
from rasterio.io import DatasetReader, MemoryFile
from rasterio.transform import Affine

from footfall.core.errors import InvalidTerrain
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import check_cell_count, from_heights

_SITE_CRS = 'LOCAL_CS["site",UNIT["metre",1],AXIS["East",EAST],AXIS["North",NORTH]]'


def read_geotiff(content: bytes, name: str, resolution: float | None = None) -> Dem:
    """First band of a GeoTIFF, with its scale, offset and no-data value applied.

    resolution: cell size [file's unit] of a file without georeferencing, whose south-west cell then
    lies at (0, 0). Raises InvalidTerrain for degrees and other units than metres, rotated or oblong
    cells, pictures, and damaged files.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        try:
            with MemoryFile(content) as memory, memory.open(driver="GTiff") as source:
                return _read(source, name, resolution)
        except (RasterioError, CRSError, OSError, ValueError) as err:
            raise InvalidTerrain(f"{name} can't be read as a GeoTIFF, it may be corrupt: {err}") from err


def _read(source: DatasetReader, name: str, resolution: float | None) -> Dem:
    check_cell_count(source.height, source.width)
    check_crs(source.crs, name)
    if source.colorinterp[0] in (ColorInterp.red, ColorInterp.palette) or np.dtype(source.dtypes[0]).kind == "c":
        raise InvalidTerrain(f"{name} holds a picture, not heights: one band of real heights is needed")
    transform = source.transform
    if transform.is_identity:
        if resolution is None:
            raise InvalidTerrain(f"{name} has no georeferencing: state resolution=, its cell size in metres")
        transform = Affine(resolution, 0, -resolution / 2, 0, -resolution, resolution * (source.height - 0.5))
    if abs(transform.b) + abs(transform.d) > 1e-9 * abs(transform.a) or transform.a <= 0:
        raise InvalidTerrain(
            f"{name} is rotated or mirrored; resample it to columns running east, rows running north or south"
        )
    if abs(abs(transform.e) - transform.a) > 1e-4 * transform.a:
        raise InvalidTerrain(
            f"{name} has oblong cells, {transform.a:g} × {abs(transform.e):g} m; resample it to square ones"
        )
    band = source.read(1, masked=True)
    heights = band.astype(np.float64).filled(np.nan) * source.scales[0] + source.offsets[0]
    if transform.e < 0:
        heights = heights[::-1]
    edge = transform.f + (source.height if transform.e < 0 else 0) * transform.e
    return from_heights(heights, transform.a, transform.c + transform.a / 2, edge + transform.a / 2, name)


def check_crs(crs: CRS | None, name: str) -> None:
    """Refuse coordinates that are not metres; none at all are taken as local metres."""
    if crs is None:
        return
    if crs.is_geographic:
        raise InvalidTerrain(
            f"the coordinates of {name} are degrees ({crs.to_string()[:60]}); reproject it to metres, such as UTM"
        )
    try:
        unit, factor = crs.linear_units_factor
    except CRSError:
        return
    if abs(factor - 1.0) > 1e-9:
        raise InvalidTerrain(f"the coordinates of {name} are in {unit} ({factor:g} m); reproject it to metres")


def check_projection_text(wkt: str, name: str) -> None:
    """Refuse what a .prj file beside a grid says, unless it says metres."""
    try:
        crs = CRS.from_wkt(wkt, morph_from_esri_dialect=True)
    except CRSError as err:
        raise InvalidTerrain(f"{name} does not describe coordinates: {err}") from err
    check_crs(crs, name)


def write_geotiff(dem: Dem) -> bytes:
    """Float32 heights, NaN as no-data, in a local engineering coordinate system in metres."""
    grid = dem.geometry
    cell = grid.resolution
    west, _, _, north = grid.bounds
    profile = {
        "driver": "GTiff",
        "width": grid.cols,
        "height": grid.rows,
        "count": 1,
        "dtype": "float32",
        "nodata": float("nan"),
        "transform": Affine(cell, 0, west - cell / 2, 0, -cell, north + cell / 2),
        "crs": CRS.from_wkt(_SITE_CRS),
        "compress": "deflate",
        "predictor": 3,
    }
    with rasterio.Env(), MemoryFile() as memory:
        with memory.open(**profile) as target:
            target.write(dem.heights[::-1], 1)
            target.set_band_description(1, "height above the site's origin, metres")
        return bytes(memory.read())
