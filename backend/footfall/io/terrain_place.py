"""Where a terrain lies on the globe, as a file beside it says; GDAL and PROJ load where one does."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from footfall.io.terrain_sidecars import coordinates_beside
from footfall.terrain.dem import Dem

if TYPE_CHECKING:
    from rasterio.crs import CRS


def projection_of(path: Path) -> "CRS | None":
    """What a ``.prj``, ``.qpj`` or ``.aux.xml`` beside a terrain file says, the first of them; None without one.

    Raises InvalidTerrain where any of them can't be used.
    """
    sidecars = coordinates_beside(path)
    if not sidecars:
        return None
    from footfall.io.terrain_projection import check_projection_text

    first, *_ = [check_projection_text(text, name) for name, text in sidecars]
    return first


def in_projection(dem: Dem, projection: "CRS | None", name: str) -> Dem:
    """A terrain whose coordinates are of that system, with its true north; None: it does not say.

    Raises InvalidTerrain where the system is not true to scale there.
    """
    if projection is None:
        return dem
    from footfall.io.terrain_projection import check_true_to_scale, convergence

    check_true_to_scale(projection, dem.geometry.bounds, name)
    return replace(dem, true_north=convergence(projection, dem.geometry.bounds))
