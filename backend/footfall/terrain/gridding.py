"""Scans become ground: points turned upright and to metres, robust heights of cells, with variance and count."""

import math

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.arrays import Array
from footfall.core.errors import InvalidTerrain
from footfall.core.frames import require_transform
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.terrain.coarse_digits import require_fine_digits
from footfall.terrain.dem import MAX_SOURCES, Dem
from footfall.terrain.from_arrays import check_cell_count, check_no_value_numbers
from footfall.terrain.gridding_kernel import by_cell, extent, supported, surfaces
from footfall.terrain.scan import NOISE, UNITS, UPS, VEGETATION, Scan, ScanSettings

_FINEST = 0.02
_POINTS_A_CELL = 4
_ROUND = (1.0, 2.0, 5.0, 10.0)

_AROUND = 2
"""Neighbours within so many cells support a return."""

_MOST_GRASS = 1 / 3
"""A return above the ground that fewer neighbours than this share support is taken for grass."""

_STATE = {
    "unit": f"state the unit of its coordinates with --unit, one of {', '.join(UNITS)}",
    "up": "say which axis points up with --up, such as --up z, or where the sensor was with --pose",
}


def terrain_of_scan(
    scan: Scan,
    settings: ScanSettings | None = None,
    unit: str | None = None,
    up: str | None = None,
    T_site_sensor: ArrayLike | None = None,
) -> Dem:
    """The ground that a scan shows, in the site frame.

    Args:
        scan: points, with what their file says of their coordinates.
        settings: how points become cells; None: as delivered.
        unit: of the points, one of UNITS, where the scan does not say.
        up: what is up among the points, one of UPS, where the scan does not say.
        T_site_sensor: pose of the sensor, (4, 4), of points in its frame, which says what is up; None: they are in
            site.

    Returns:
        The ground.

    Raises:
        InvalidTerrain: something has to be stated, which is named, or there are no points of the ground.
    """
    settings = settings or ScanSettings()
    points = placed(scan, unit, up, T_site_sensor)
    if scan.classes is not None:
        left_out = (NOISE if settings.outliers else ()) + (VEGETATION if settings.vegetation else ())
        points = points[~np.isin(scan.classes, left_out)] if left_out else points
    if not len(points):
        raise InvalidTerrain(f"{scan.name} has no points of the ground")
    factor = UNITS[unit or scan.unit or "m"]
    return gridded(points, settings, scan.name, factor, scan.step * factor)


def placed(scan: Scan, unit: str | None, up: str | None, T_site_sensor: ArrayLike | None) -> Array:
    """The scan's points in site.

    Args:
        scan: points, with what their file says of their coordinates.
        unit: of the points, one of UNITS, where the scan does not say.
        up: what is up among the points, one of UPS, where the scan does not say.
        T_site_sensor: pose of the sensor, (4, 4), of points in its frame; None: they are in site.

    Returns:
        (n, 3) [m].

    Raises:
        InvalidTerrain: something has to be stated, or is stated against what the scan says.
    """
    if unit is not None and unit not in UNITS:
        raise InvalidTerrain(f"a unit is one of {', '.join(UNITS)}, not {unit!r}", unit=unit)
    if unit is not None and scan.unit is not None and unit != scan.unit:
        raise InvalidTerrain(
            f"the coordinates of {scan.name} are {scan.unit}, as its coordinate system says, not {unit}: leave out "
            "--unit, or correct the system",
            unit=scan.unit,
        )
    unit, up = unit or scan.unit, up or scan.up
    if up is not None and up not in UPS:
        raise InvalidTerrain(f"up is one of {', '.join(UPS)}, not {up!r}", up=up)
    if scan.camera and T_site_sensor is None:
        raise InvalidTerrain(
            f"{scan.name} is seen from a camera: say where it was with --pose x,y,z,qw,qx,qy,qz (z forward, y down)"
        )
    missing = {"unit": unit is None, "up": up is None and T_site_sensor is None}
    if any(missing.values()):
        asked = "; ".join(_STATE[name] for name, is_missing in missing.items() if is_missing)
        example = " ".join({"unit": "--unit m", "up": "--up z"}[name] for name in missing if missing[name])
        raise InvalidTerrain(
            f"{scan.name} does not say what its coordinates mean: {asked} (such as {example})",
            missing=[name for name, is_missing in missing.items() if is_missing],
        )
    factor = UNITS[unit or "m"]
    if T_site_sensor is None:
        heights = scan.points[:, "xyz".index((up or "z").removeprefix("-"))]
        check_no_value_numbers(heights, scan.name, "leave those points out")
        points = _upright(scan.points, up or "z")
        return points if factor == 1.0 else points * factor
    if up is not None and scan.up is None:
        raise InvalidTerrain("a pose says what is up: leave out either --up or --pose")
    T = require_transform(T_site_sensor, "T_site_sensor")
    return (factor * scan.points) @ T[:3, :3].T + T[:3, 3]


def _upright(points: Array, up: str) -> Array:
    """Points with that axis turned to z, by the rotation that keeps handedness."""
    if up == "z":
        return points
    x, y, z = points.T
    turned = {"-z": (x, -y, -z), "y": (x, -z, y), "-y": (x, z, -y), "x": (-z, y, x), "-x": (z, y, -x)}[up]
    return np.column_stack(turned)


def gridded(points: Array, settings: ScanSettings, name: str, unit: float = 1.0, step: float = 0.0) -> Dem:
    """Cells of points; a cell's centre lies at a multiple of the resolution.

    Args:
        points: (n, 3) in site [m].
        settings: how points become cells.
        name: what the map is called.
        unit: in which their file had them [m].
        step: in which it kept them, where it says so [m].

    Returns:
        The ground.

    Raises:
        InvalidTerrain: no cell has enough points that agree, or they were written with too few digits.
    """
    points = np.ascontiguousarray(points, np.float64)
    low, high = extent(points)
    resolution = settings.resolution or natural_resolution(
        len(points), float(high[0] - low[0]), float(high[1] - low[1])
    )
    if step > resolution * (1.0 + 1e-9):
        raise InvalidTerrain(
            f"{name} keeps its coordinates in steps of {step:g} m, coarser than its cells of {resolution:g} m; take "
            f"--resolution {step:g} or coarser, or write it with a finer scale, such as 0.001",
            step=step,
        )
    require_fine_digits(points, name, resolution, unit)
    first = np.floor(low / resolution + 0.5)
    cols, rows = (int(n) for n in np.floor(high / resolution + 0.5) - first + 1)
    check_cell_count(rows, cols)
    x0, y0 = (first * resolution).tolist()
    begin, heights = by_cell(points, x0, y0, resolution, rows, cols)
    height, variance, count = surfaces(
        begin,
        heights,
        settings.gap,
        settings.least_share,
        settings.least_count,
        settings.deviation,
        settings.vegetation,
    )
    height = height.reshape(rows, cols)
    _leave_out(height, settings)
    unknown = np.isnan(height)
    if unknown.all():
        raise InvalidTerrain(
            f"no cell of {resolution:g} m of {name} has enough points that agree; choose a coarser resolution, a lower "
            "least_count, or keep outliers"
        )
    known = ~unknown
    variance = np.where(known, variance.reshape(rows, cols), np.nan).astype(np.float32)
    return Dem(
        height.astype(np.float32),
        GridGeometry(x0, y0, resolution, rows, cols),
        name,
        Provenance({}, settings),
        variance=variance,
        count=np.where(known, count.reshape(rows, cols).clip(0, 65535), 0).astype(np.uint16),
        time=np.where(known, settings.time, np.nan),
        source=known.astype(np.uint8),
        sources=(name,)[:MAX_SOURCES],
    )


def _leave_out(height: Array, settings: ScanSettings) -> None:
    """Make cells unknown that their neighbours do not support, in place."""
    if not (settings.outliers or settings.vegetation):
        return
    known, alike, below = supported(height, settings.gap, _AROUND)
    alone = np.zeros(height.shape, bool)
    if settings.outliers:
        alone |= alike == 0
    if settings.vegetation:
        alone |= (below > 0) & (alike < _MOST_GRASS * known)
    height[alone] = np.nan


def natural_resolution(count: int, width: float, depth: float) -> float:
    """Side of cells that hold about four points each.

    Args:
        count: of the points.
        width: of the ground that they cover, east-west [m].
        depth: of it, north-south [m].

    Returns:
        The side, rounded up to 1, 2 or 5 times a power of ten [m].
    """
    wanted = max(math.sqrt(_POINTS_A_CELL * max(width * depth, _FINEST**2) / count), _FINEST)
    power = 10.0 ** math.floor(math.log10(wanted) + 1e-9)
    return next(float(f"{step * power:.6g}") for step in _ROUND if step * power >= wanted * (1 - 1e-9))
