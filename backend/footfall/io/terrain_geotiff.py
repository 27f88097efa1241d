"""GeoTIFF terrain through rasterio.

A terrain that remembers is written with these bands, all float64: height [m], variance [m²], time of the newest
measurement [s since 1970], age before the newest of all [s], certainty (probability that the height is right within
5 cm, of a normal distribution), count, source; the names of the sources stand in the tag ``SOURCES``, as JSON. Files
of others need the first band only, and where anything says what that is it must be of heights.
"""

import json
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import rasterio
from rasterio._err import CPLE_BaseError
from rasterio.crs import CRS
from rasterio.enums import ColorInterp, MaskFlags
from rasterio.errors import CRSError, NotGeoreferencedWarning, RasterioError
from rasterio.io import DatasetReader, MemoryFile
from rasterio.transform import Affine
from scipy.special import erf

from footfall.core.arrays import Array
from footfall.core.errors import InvalidTerrain
from footfall.core.grid import GridGeometry
from footfall.io.band_meaning import check_band_is_of_heights
from footfall.io.geo_keys import geo_keys, require_metres_by_keys
from footfall.io.terrain_projection import check_crs, check_true_to_scale, convergence
from footfall.io.terrain_sidecars import mask_beside, place_beside
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import check_cell_count, check_lone_no_value, check_no_value_numbers, from_heights

BANDS = (
    "height above the site's origin, metres",
    "variance of the height, square metres",
    "time of the newest measurement, seconds since 1970",
    "age before the newest measurement of all, seconds",
    "certainty, probability that the height is right within 5 cm",
    "count of measurements",
    "source, 1 + index into the tag SOURCES",
)
WITHIN = 0.05
"""Of "certainty" [m]."""

_WITHOUT_MASK = {MaskFlags.all_valid, MaskFlags.nodata, MaskFlags.alpha}
"""What GDAL says of a raster whose unknown cells it knows by other means than a mask."""

SITE_CRS = 'LOCAL_CS["site",UNIT["metre",1],AXIS["East",EAST],AXIS["North",NORTH]]'


def read_raster(source: bytes | Path, name: str, resolution: float | None = None, projection: CRS | None = None) -> Dem:
    """First band of a GeoTIFF, with its scale, offset and no-data value applied; all bands of a file of ours.

    source: its content, or its path: then GDAL heeds the files beside it, and it may be an ASCII grid.
    projection: what a ``.prj`` beside says, of a file that names no projection itself.
    resolution: cell size [file's unit] of a file without georeferencing, whose south-west cell then
    lies at (0, 0). Raises InvalidTerrain for degrees and other units than metres, projections that are not true to
    scale, rotated or oblong cells, pictures, bands of something else, numbers that stand for no value undeclared, and
    damaged files.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        try:
            with rasterio.Env(GTIFF_REPORT_COMPD_CS=True):
                if isinstance(source, Path):
                    kind = "AAIGrid" if source.suffix.lower() == ".asc" else "GTiff"
                    with rasterio.open(source, driver=kind) as opened:
                        _check_beside(opened, source)
                        dem = _read(opened, name, resolution, projection)
                else:
                    with MemoryFile(source) as memory, memory.open(driver="GTiff") as opened:
                        dem = _read(opened, name, resolution, projection)
        except (RasterioError, CRSError, CPLE_BaseError, OSError, ValueError) as err:
            raise InvalidTerrain(f"{name} can't be read as a raster: it or a file beside it may be corrupt") from err
    require_metres_by_keys(geo_keys(source), name)
    return dem


def _check_beside(source: DatasetReader, path: Path) -> None:
    """Refuse a mask and a place that lie beside a raster and that GDAL can't use: it says nothing of them."""
    mask = mask_beside(path)
    # a mask of one band, as GDAL makes it of ISIS cubes, has no flag at all
    if mask is not None and _WITHOUT_MASK & {*source.mask_flag_enums[0]}:
        raise InvalidTerrain(
            f"{mask.name} is no mask that {path.name} can be read with: it is damaged, or lacks its flags "
            "(INTERNAL_MASK_FLAGS_1=2); write it anew, or remove it",
            beside=mask.name,
        )
    place = place_beside(path)
    if place is not None and source.transform.is_identity and source.rpcs is None and not source.gcps[0]:
        raise InvalidTerrain(
            f"{place.name} lies beside {path.name} and gives it no place: it is damaged, for files of another kind, or "
            "says 1 m with rows from the south; write it anew, or remove it",
            beside=place.name,
        )


def _read(source: DatasetReader, name: str, resolution: float | None, projection: CRS | None) -> Dem:
    check_cell_count(source.height, source.width)
    check_crs(source.crs, name)
    _check_placed_by_grid(source, name)
    _check_holds_heights(source, name)
    transform = _transform(source, name, resolution)
    # a local system says nothing of the globe, what lies beside may
    crs = source.crs if source.crs is not None and source.crs.is_projected else projection
    check_true_to_scale(crs, source.bounds, name)
    from_north = transform.e < 0
    heights = _heights(source, name)
    if from_north:
        heights = heights[::-1]
    edge = transform.f + (source.height if from_north else 0) * transform.e
    dem = from_heights(heights, transform.a, transform.c + transform.a / 2, edge + transform.a / 2, name)
    dem = replace(dem, true_north=convergence(crs, source.bounds))
    return _remembering(dem, source, from_north)


def _check_placed_by_grid(source: DatasetReader, name: str) -> None:
    points = len(source.gcps[0])
    if points or source.rpcs is not None:
        by = f"{points} control points" if points else "rational polynomials"
        raise InvalidTerrain(f"{name} has its place by {by}, not by a grid; resample it: gdalwarp -tr 0.5 0.5 …")
    if "GEOLOCATION" in source.tag_namespaces():
        raise InvalidTerrain(f"{name} has its place by arrays of positions; resample it: gdalwarp -tr 0.5 0.5 …")


def _transform(source: DatasetReader, name: str, resolution: float | None) -> Affine:
    """Where columns and rows lie [m]: columns run east, rows north or south, cells are square."""
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
    return transform


def _heights(source: DatasetReader, name: str) -> Array:
    """Heights [m] in the file's order of rows, NaN where there are none."""
    stored = source.read(1, masked=True).astype(np.float64).filled(np.nan)
    if ColorInterp.alpha in source.colorinterp:  # GDAL heeds it of whole numbers only, gdalwarp writes others too
        stored[source.read(source.colorinterp.index(ColorInterp.alpha) + 1) == 0] = np.nan
    if source.nodata is not None:  # GDAL forgets it where there is a mask too
        stored[stored == source.nodata] = np.nan
    elif (source.scales[0], source.offsets[0]) != (1.0, 0.0):
        check_lone_no_value(stored, name)
    heights = stored * source.scales[0] + source.offsets[0]
    check_no_value_numbers(heights, name)
    return heights


def _check_holds_heights(source: DatasetReader, name: str) -> None:
    """Refuse pictures, and several bands of which the first is called something else."""
    if len(source.subdatasets) > 1:
        raise InvalidTerrain(
            f"{name} has {len(source.subdatasets)} pages, and which of them is the ground is not to tell; take one: "
            f"gdal_translate GTIFF_DIR:1:{name} ground.tif",
            pages=len(source.subdatasets),
        )
    kind = np.dtype(source.dtypes[0])
    if source.colorinterp[0] in (ColorInterp.red, ColorInterp.palette) or kind.kind == "c":
        raise InvalidTerrain(f"{name} holds a picture, not heights: one band of real heights is needed")
    if kind.itemsize == 1 and not source.units[0] and source.scales[0] == 1.0:
        raise InvalidTerrain(
            f"{name} holds whole numbers of 8 bit, as pictures do; if they are heights, let the file say so: by its "
            "band's unit (m), or its scale and offset"
        )
    if not np.isfinite([source.scales[0], source.offsets[0]]).all() or source.scales[0] == 0.0:
        raise InvalidTerrain(
            f"{name} declares the scale {source.scales[0]:g} and the offset {source.offsets[0]:g}, which leave no "
            "heights; correct them: gdal_edit.py -scale 1 -offset 0 …"
        )
    check_band_is_of_heights(source, name)


def _remembering(dem: Dem, source: DatasetReader, from_north: bool) -> Dem:
    """The terrain with its memory layers, where the file holds them. from_north: its rows begin in the north."""
    names = source.tags().get("SOURCES")
    if source.descriptions != BANDS or names is None:
        return dem
    try:
        sources = json.loads(names)
    except ValueError as err:
        raise InvalidTerrain(f"the tag SOURCES of {dem.name} is no list of names") from err
    if not isinstance(sources, list) or not all(isinstance(one, str) for one in sources):
        raise InvalidTerrain(f"the tag SOURCES of {dem.name} is no list of names")
    variance, time, count, number = (source.read(band)[:: -1 if from_north else 1] for band in (2, 3, 6, 7))
    known = np.isfinite(dem.heights)
    whole = np.stack([count[known], number[known]])
    if not ((whole >= 0) & (whole <= 65535) & (whole == np.rint(whole))).all() or (whole[1] > 255).any():
        raise InvalidTerrain(f"{dem.name}: the bands count and source need whole numbers in every known cell")
    return replace(
        dem,
        variance=np.where(known, variance, np.nan).astype(np.float32),
        time=np.where(known, time, np.nan),
        count=np.where(known, count, 0).astype(np.uint16),
        source=np.where(known, number, 0).astype(np.uint8),
        sources=tuple(sources),
    )


def write_geotiff(dem: Dem) -> bytes:
    """Heights, NaN as no-data, in a local engineering coordinate system in metres.

    Float32 and one band, or, of a terrain that remembers, float64 and all bands of the module's docstring.
    """
    grid = dem.geometry
    bands = memory_bands(dem) if dem.remembers else [dem.heights]
    profile = {
        "driver": "GTiff",
        "width": grid.cols,
        "height": grid.rows,
        "count": len(bands),
        "dtype": bands[0].dtype.name,
        "nodata": float("nan"),
        "transform": north_up(grid),
        "crs": CRS.from_wkt(SITE_CRS),
        "compress": "deflate",
        "predictor": 3,
    }
    with rasterio.Env(), MemoryFile() as memory:
        with memory.open(**profile) as target:
            for i, (band, description) in enumerate(zip(bands, BANDS, strict=False), 1):
                target.write(band[::-1], i)
                target.set_band_description(i, description)
            if len(bands) > 1:
                target.update_tags(SOURCES=json.dumps(dem.sources))
        return bytes(memory.read())


def north_up(grid: GridGeometry) -> Affine:
    """Column and row, from the north-west corner, to site x and y [m]."""
    cell = grid.resolution
    west, _, _, north = grid.bounds
    return Affine(cell, 0, west - cell / 2, 0, -cell, north + cell / 2)


def memory_bands(dem: Dem) -> list[Any]:
    """All bands of a terrain that remembers, (rows, cols) float64 each, NaN where unknown."""
    known = np.isfinite(dem.heights)
    layers = {name: np.asarray(getattr(dem, name), np.float64) for name in ("variance", "time", "count", "source")}
    with np.errstate(invalid="ignore"):
        certainty = erf(WITHIN / np.sqrt(2.0 * layers["variance"]))
    age = np.nanmax(layers["time"]) - layers["time"]
    bands = [dem.heights, layers["variance"], layers["time"], age, certainty, layers["count"], layers["source"]]
    return [np.where(known, band, np.nan).astype(np.float64) for band in bands]
