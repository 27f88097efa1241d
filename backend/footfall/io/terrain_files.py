"""Terrain files of every kind, in and out.

=============== =========================================================================
``.tif .tiff``  GeoTIFF: first band, projected or local coordinates in metres, north up
``.asc``        ESRI ASCII grid, coordinates in metres
``.npz``        NumPy arrays ``heights`` (rows, cols; row 0 south), ``resolution``, ``x0``, ``y0``
                [m, centre of cell (0, 0)], and ``texture`` (uint8) if there is one; of a terrain that
                remembers also ``variance``, ``count``, ``time``, ``source`` and ``sources`` (JSON, as bytes)
``.ply .obj``   mesh, z up, rasterised from above; it must be a surface
``.off .stl``
``.pcd .las``   scans, and PLY without faces: points, gridded; see :mod:`footfall.io.scan_files`
``.laz .xyz``
``.csv .txt``
``.vtk``
``.png``        grey image of 8 or 16 bit, north up, with stated ``size`` and ``height_range``
=============== =========================================================================
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from footfall.core.errors import InvalidTerrain, NotFound
from footfall.core.misread import Unreadable
from footfall.core.written import require_no_utf16
from footfall.io import terrain_grid_files, terrain_mesh_files, terrain_sidecars
from footfall.io.other_formats import refuse_other_format
from footfall.io.scan_files import SCANS
from footfall.io.scan_terrain import is_scan, terrain_from_scan
from footfall.io.terrain_place import in_projection, projection_of
from footfall.io.units_said import require_scale_said
from footfall.io.whole_files import require_writable, write_whole
from footfall.terrain.dem import Dem, HeightError
from footfall.terrain.from_arrays import check_fill, from_heights
from footfall.terrain.ground.mesh_terrain import MOST_ERROR
from footfall.terrain.ground.resample import resample
from footfall.terrain.ground.simplified import SimplifiedMesh
from footfall.terrain.scan import ScanSettings

if TYPE_CHECKING:
    from rasterio.crs import CRS

MAX_FILE_BYTES = 1_000_000_000
"""Larger files are refused unread."""

MIN_RESOLUTION = 0.001
"""Finer cells [m] are refused: no rover's map has them, but maps in degrees do."""

_STEEPEST = 10.0
"""Rise per run that at least half of a map's neighbouring cells must stay under."""

_MESHES = (".ply", ".obj", ".off", ".stl")
READABLE = (".tif", ".tiff", ".asc", ".npz", *_MESHES, ".png", *SCANS)
WRITABLE = (".tif", ".tiff", ".asc", ".npz", *_MESHES)


def read_terrain(
    path: str | Path,
    *,
    resolution: float | None = None,
    scale: float = 1.0,
    center: bool | tuple[float, float] | None = None,
    size: tuple[float, float] | None = None,
    height_range: tuple[float, float] | None = None,
    most_error: float | None = None,
    unit: str | None = None,
    up: str | None = None,
    pose: Sequence[float] | None = None,
) -> Dem:
    """Read a terrain file; the ending of its name says which kind it is (see the module).

    Args:
        path: the file.
        resolution: side of the cells [m], after scaling; None: the file's (meshes: as fine as their detail).
        scale: factor on all coordinates, heights too, such as feet to metres.
        center: True moves the middle of the map to (0, 0); a point (x, y) [m] becomes (0, 0); None: no move.
        size: (east, north) extent of a whole height image [m]; needed there, and there only.
        height_range: (height of black, height of white) of a height image [m]; needed there, and there only.
        most_error: how far, vertically, a mesh's own surface may be from that of the cells [m]; None: MOST_ERROR.
        unit: of a scan's coordinates, where the file does not say; see :mod:`footfall.io.scan_terrain`.
        up: axis of a scan that points up, where the file does not say.
        pose: where a scan's sensor was: x, y, z [m] in site and the quaternion w, x, y, z; None: points are in site.

    Returns:
        The ground as heights at the centres of cells, site frame [m].

    Raises:
        NotFound: there is no such file.
        InvalidTerrain: it is too large or can't be used; the message says what is wrong and what would be right.
    """
    path = Path(path)
    if not path.is_file():
        raise NotFound(f"there is no terrain file {path}", path=str(path))
    if path.stat().st_size > MAX_FILE_BYTES:
        raise InvalidTerrain(f"{path.name} has {path.stat().st_size} bytes, more than {MAX_FILE_BYTES} are refused")
    _check_readable(path.name)
    ending = path.suffix.lower()
    projection = projection_of(path)
    by_gdal = _require_beside(path, ending)
    return decode_terrain(
        path.read_bytes(),
        path.name,
        by_path=path if by_gdal else None,
        projection=projection,
        resolution=resolution,
        scale=scale,
        center=center,
        size=size,
        height_range=height_range,
        most_error=most_error,
        unit=unit,
        up=up,
        pose=pose,
    )


def _require_beside(path: Path, ending: str) -> bool:
    """Whether GDAL is to read a file, by its path, with what lies beside it. Refuses what would not be heeded."""
    if ending in (".tif", ".tiff"):
        terrain_sidecars.require_heeded(path)
        return True
    if ending != ".asc":
        terrain_sidecars.require_read(path)
        return False
    terrain_sidecars.require_stated_once(path)
    terrain_sidecars.require_heeded(path)
    if (place := terrain_sidecars.place_beside(path)) is not None:
        raise InvalidTerrain(
            f"{place.name} lies beside {path.name}, and ASCII grids state their place themselves; remove it if it does "
            "not belong to it",
            beside=place.name,
        )
    return terrain_sidecars.changes_heights(path) is not None


def decode_terrain(
    content: bytes,
    name: str,
    *,
    resolution: float | None = None,
    scale: float = 1.0,
    center: bool | tuple[float, float] | None = None,
    size: tuple[float, float] | None = None,
    height_range: tuple[float, float] | None = None,
    by_path: Path | None = None,
    projection: "CRS | None" = None,
    most_error: float | None = None,
    unit: str | None = None,
    up: str | None = None,
    pose: Sequence[float] | None = None,
) -> Dem:
    """Like :func:`read_terrain`, for a file's content and its name.

    by_path: where it lies, of a raster that is to be read with the files beside it. projection: that one of them says.
    """
    ending = Path(name).suffix.lower()
    _check_readable(name)
    _check_options(scale, resolution, most_error)
    if not content:
        raise InvalidTerrain(f"{name} is empty")
    _check_content_matches(content, ending, name)
    cell = None if resolution is None else resolution / scale
    if ending == ".png":
        if size is None or height_range is None:
            raise InvalidTerrain(
                f"{name} is a picture: state size=(east, north) and height_range=(black, white) in metres"
            )
        dem = terrain_grid_files.read_png(content, name, size, height_range, cell)
    elif is_scan(content, name):
        settings = ScanSettings(resolution=cell)
        dem = terrain_from_scan(content, name, settings, unit=unit, up=up, pose=pose, projection=projection)
    elif (unit, up, pose) != (None, None, None):
        raise InvalidTerrain(f"unit, up and pose are for scans; {name} is none: use scale for another unit of length")
    elif size is not None or height_range is not None:
        raise InvalidTerrain(f"size and height_range are for pictures only; {name} has its own coordinates")
    elif ending in _MESHES:
        require_scale_said(content, ending, name, scale)
        mesh = terrain_mesh_files.read_mesh(content, name, cell, scale, most_error or MOST_ERROR)
        dem = in_projection(mesh, projection, name)
    else:
        dem = _decode_grid(content, name, ending, cell, by_path, projection)
    return _placed(dem, resolution, scale, center)


def _check_options(scale: float, resolution: float | None, most_error: float | None) -> None:
    if not (np.isfinite(scale) and scale > 0):
        raise InvalidTerrain(f"scale must be a positive number, not {scale}")
    if resolution is not None and not 0 < resolution < np.inf:
        raise InvalidTerrain(f"resolution must be a positive number of metres, not {resolution}")
    if most_error is not None and not 0 < most_error < np.inf:
        raise InvalidTerrain(f"most_error must be a positive number of metres, not {most_error}")


def _decode_grid(
    content: bytes, name: str, ending: str, cell: float | None, by_path: Path | None, projection: "CRS | None"
) -> Dem:
    """A grid of heights with its own coordinates."""
    if ending == ".asc" and by_path is None:
        return in_projection(terrain_grid_files.read_asc(content, name), projection, name)
    if ending == ".npz":
        return in_projection(terrain_grid_files.read_npz(content, name), projection, name)
    from footfall.io import terrain_geotiff

    return terrain_geotiff.read_raster(by_path or content, name, cell, projection)


def encode_terrain(dem: Dem, ending: str) -> bytes:
    """Content of a terrain file of the kind that ``ending`` (such as ".tif") names.

    Grids keep every float32 height exactly. Meshes hold the triangulation, so known cells that no fully
    known 2 × 2 block contains are lost. npz and PLY (as the vertices' colour) keep a texture; GeoTIFF and npz keep
    how sure the heights are, from when, and from where.
    """
    _check_ending(ending, f"a terrain file {ending}", WRITABLE)
    if ending in _MESHES:
        return terrain_mesh_files.write_mesh(dem, ending)
    if ending == ".asc":
        return terrain_grid_files.write_asc(dem)
    if ending == ".npz":
        return terrain_grid_files.write_npz(dem)
    from footfall.io import terrain_geotiff

    return terrain_geotiff.write_geotiff(dem)


def write_terrain(dem: Dem, path: str | Path) -> None:
    """Write a Dem; the ending of the name says which kind of file (see :func:`encode_terrain`)."""
    require_terrain_file(path)
    write_whole(path, encode_terrain(dem, Path(path).suffix.lower()))


def require_terrain_file(path: str | Path) -> None:
    """Raise what :func:`write_terrain` would raise whatever the terrain is: before it is made."""
    path = Path(path)
    _check_ending(path.suffix.lower(), path.name, WRITABLE)
    require_writable(path)
    terrain_sidecars.require_alone(path)


def encode_collision_mesh(made: SimplifiedMesh, ending: str) -> bytes:
    """Content of a mesh file of the kind that ``ending`` names."""
    _check_ending(ending, f"a mesh file {ending}", _MESHES)
    return terrain_mesh_files.encode_mesh(made.mesh, ending, made.tolerance)


def write_collision_mesh(made: SimplifiedMesh, path: str | Path) -> None:
    """Write a simplified mesh; the ending of the name says which kind of file."""
    require_mesh_file(path)
    write_whole(path, encode_collision_mesh(made, Path(path).suffix.lower()))


def require_mesh_file(path: str | Path) -> None:
    """Raise what :func:`write_collision_mesh` would raise whatever the mesh is: before it is made."""
    path = Path(path)
    _check_ending(path.suffix.lower(), f"a mesh file {path.suffix}", _MESHES)
    require_writable(path)


def _placed(dem: Dem, resolution: float | None, scale: float, center: bool | tuple[float, float] | None) -> Dem:
    if scale != 1.0:
        dem = _scaled(dem, scale)
    check_fill(dem.heights, dem.name)
    _check_metres(dem)
    cell = dem.geometry.resolution
    if resolution is not None and abs(cell - resolution) > 1e-9 * resolution:
        dem = resample(dem, resolution)
    if center is None or center is False:
        return dem
    grid = dem.geometry
    west, south, east, north = grid.bounds
    if center is True:
        moved = -0.5 * (east - west), -0.5 * (north - south)
    else:
        point = np.asarray(center, float)
        if point.shape != (2,) or not np.isfinite(point).all():
            raise InvalidTerrain(f"center must be True or a point (x, y) in metres, not {center!r}")
        moved = west - point[0], south - point[1]
    return replace(dem, geometry=replace(grid, x0=float(moved[0]), y0=float(moved[1])))


def _scaled(dem: Dem, scale: float) -> Dem:
    grid = dem.geometry
    heights = dem.heights.astype(np.float64) * scale
    scaled = from_heights(
        heights, grid.resolution * scale, grid.x0 * scale, grid.y0 * scale, dem.name, texture=dem.texture
    )
    scaled = replace(scaled, true_north=dem.true_north)
    if dem.height_error is not None:
        scaled = replace(scaled, height_error=HeightError(dem.height_error.p95 * scale, dem.height_error.most * scale))
    if dem.variance is None:
        return scaled
    variance = dem.variance * np.float32(scale**2)
    return replace(scaled, variance=variance, count=dem.count, time=dem.time, source=dem.source, sources=dem.sources)


def _check_metres(dem: Dem) -> None:
    """Refuse maps whose cells and heights can't both be metres."""
    cell = dem.geometry.resolution
    hint = "are its coordinates in degrees? Reproject to metres, or use scale= for another unit of length"
    if cell < MIN_RESOLUTION:
        raise InvalidTerrain(f"{dem.name} has cells of {cell:.3g} m, finer than {MIN_RESOLUTION} m; {hint}")
    rises = np.concatenate([np.abs(np.diff(dem.heights, axis=axis)).ravel() for axis in (0, 1)])
    rises = rises[np.isfinite(rises)]
    if len(rises) and float(np.median(rises)) > _STEEPEST * cell:
        raise InvalidTerrain(
            f"half of {dem.name} would be steeper than {np.degrees(np.arctan(_STEEPEST)):z.0f}°; {hint}",
            median_rise_m=float(np.median(rises)),
            resolution_m=cell,
        )


def _check_readable(name: str) -> None:
    refuse_other_format(name)
    _check_ending(Path(name).suffix.lower(), name, READABLE)


def _check_ending(ending: str, name: str, accepted: tuple[str, ...]) -> None:
    if ending not in accepted:
        raise InvalidTerrain(f"{name} can't be a terrain file: its name must end in one of {', '.join(accepted)}")


def _check_content_matches(content: bytes, ending: str, name: str) -> None:
    """Refuse a file whose first bytes show another kind than its name, or text that is not UTF-8."""
    if ending in (".asc", ".obj", ".off", ".ply"):
        try:
            require_no_utf16(content)
        except Unreadable as err:
            raise InvalidTerrain(f"{name} can't be read: {err}") from err
    starts = {
        b"\x89PNG": (".png", "a PNG picture"),
        b"II*\0": (".tif", "a TIFF"),
        b"MM\0*": (".tif", "a TIFF"),
        b"II+\0": (".tif", "a TIFF"),
        b"MM\0+": (".tif", "a TIFF"),
        b"PK\x03\x04": (".npz", "a zip or npz archive"),
        b"ply": (".ply", "a PLY mesh"),
        b"\xff\xd8\xff": (".jpg", "a JPEG picture, which holds no heights"),
        b"OFF": (".off", "an OFF mesh"),
        b"ncols": (".asc", "an ASCII grid"),
        b"%PDF": (".pdf", "a PDF"),
        b"glTF": (".glb", "glTF"),
        b"\x89HDF": (".h5", "HDF5 or NetCDF"),
        b"CDF\x01": (".nc", "NetCDF"),
        b"CDF\x02": (".nc", "NetCDF"),
    }
    for start, (true_ending, kind) in starts.items():
        if content[:5].lower().startswith(start.lower()) and true_ending != ending.replace(".tiff", ".tif"):
            raise InvalidTerrain(f"{name} is named {ending}, but its content is {kind}", content=kind)
    if ending in (".tif", ".tiff", ".png", ".npz", ".ply") and not any(
        content.startswith(start) and true == ending.replace(".tiff", ".tif") for start, (true, _) in starts.items()
    ):
        raise InvalidTerrain(f"{name} is named {ending}, but its content is not: the file is corrupt or misnamed")
