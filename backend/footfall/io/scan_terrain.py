"""Ground from the file of a scan or a depth image."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidTerrain
from footfall.core.frames import rotation_from_quat_wxyz, transform
from footfall.io.depth_files import DEPTH_IMAGES, read_depth
from footfall.io.las_projection import projection_in
from footfall.io.scan_files import (
    SCANS,
    ply_has_faces,
    read_scan,
    require_no_viewpoint,
    rounding_of,
)
from footfall.io.terrain_place import in_projection, projection_of
from footfall.io.terrain_sidecars import require_read
from footfall.io.units_said import require_unit_said
from footfall.terrain.dem import Dem
from footfall.terrain.gridding import terrain_of_scan
from footfall.terrain.scan import UNITS, ScanSettings

if TYPE_CHECKING:
    from rasterio.crs import CRS

_MOST_ROUNDED = 0.1
"""Share of a cell that numbers of 32 bit may move points by: they are averaged, vertices of a mesh are not."""


def is_scan(content: bytes, name: str) -> bool:
    """Whether a terrain file holds points and no surface."""
    ending = Path(name).suffix.lower()
    return ending in SCANS or (ending == ".ply" and content[:3] == b"ply" and not ply_has_faces(content))


def read_scan_terrain(
    path: Path,
    settings: ScanSettings | None = None,
    *,
    unit: str | None = None,
    up: str | None = None,
    pose: Sequence[float] | None = None,
    calibration: Mapping[str, object] | None = None,
) -> Dem:
    """:func:`terrain_from_scan` of a file, heeding the coordinates that a ``.prj`` beside it says."""
    require_read(path)
    return terrain_from_scan(
        path.read_bytes(),
        path.name,
        settings,
        unit=unit,
        up=up,
        pose=pose,
        calibration=calibration,
        projection=projection_of(path),
    )


def terrain_from_scan(
    content: bytes,
    name: str,
    settings: ScanSettings | None = None,
    *,
    unit: str | None = None,
    up: str | None = None,
    pose: Sequence[float] | None = None,
    calibration: Mapping[str, object] | None = None,
    projection: "CRS | None" = None,
) -> Dem:
    """The ground of a scan, or of a depth image with its calibration.

    projection: of its coordinates, which are metres then; a LAS file may say it itself. pose: where the sensor was,
    x, y, z [m] and the quaternion w, x, y, z, site; see :func:`footfall.terrain.gridding.terrain_of_scan`.
    """
    T_site_sensor = None if pose is None else pose_of(pose)
    if Path(name).suffix.lower() in DEPTH_IMAGES:
        scan = read_depth(content, name, calibration)
    elif calibration is not None:
        raise InvalidTerrain(f"a calibration is for depth images ({', '.join(DEPTH_IMAGES)}); {name} has points")
    else:
        scan = read_scan(content, name)
        if T_site_sensor is None:
            require_no_viewpoint(content, name)
        if projection is not None and T_site_sensor is None:
            scan = replace(scan, unit=scan.unit or "m")
        require_unit_said(content, Path(name).suffix.lower(), name, unit or scan.unit)
    dem = terrain_of_scan(scan, settings, unit, up, T_site_sensor)
    off = rounding_of(content, name, scan.points) * UNITS[unit or scan.unit or "m"]
    if off > _MOST_ROUNDED * dem.geometry.resolution:
        raise InvalidTerrain(
            f"{name} keeps seven digits of coordinates up to {np.abs(scan.points).max():z.0f}, so its points lie up to "
            f"{off:z.2g} m off; export it about an origin near the ground, or as doubles"
        )
    if T_site_sensor is not None:
        return dem  # in the site's frame, whatever the sensor's was
    return in_projection(dem, projection_in(content, name) or projection, name)


def pose_of(numbers: Sequence[float]) -> NDArray[np.float64]:
    """T (4, 4) of x, y, z, qw, qx, qy, qz."""
    seven = np.asarray(numbers, np.float64)
    if seven.shape != (7,) or not np.isfinite(seven).all():
        raise InvalidTerrain("a pose is seven finite numbers: x,y,z [m] and the quaternion qw,qx,qy,qz")
    length = float(np.linalg.norm(seven[3:]))
    if abs(length - 1.0) > 0.01:
        raise InvalidTerrain(f"a pose's quaternion qw,qx,qy,qz has the length 1, not {length:.4g}")
    return transform(rotation_from_quat_wxyz(seven[3:] / length), seven[:3])
