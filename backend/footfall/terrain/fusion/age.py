"""How old the ground is: by how much each cell was measured before the newest one."""

import numpy as np
from numpy.typing import NDArray

from footfall.terrain.dem import Dem

BANDS = (60.0, 600.0, 3600.0)
"""Ages from which on ground counts as older, and older still [s]: a minute, ten minutes, an hour."""


def ages(dem: Dem) -> NDArray[np.float32]:
    """Time between each cell's newest measurement and the newest of all, (rows, cols) [s]; NaN where nothing says."""
    if dem.time is None or not np.isfinite(dem.time).any():
        return np.full(dem.geometry.shape, np.nan, np.float32)
    return (np.nanmax(dem.time) - dem.time).astype(np.float32)


def age_bands(dem: Dem) -> NDArray[np.int8]:
    """Of each cell how many of BANDS it has passed, (rows, cols); −1 where its height or its age is not known."""
    old = ages(dem)
    known = np.isfinite(dem.heights) & np.isfinite(old)
    passed = np.searchsorted(BANDS, np.where(known, old, 0.0), side="right")
    return np.where(known, passed, -1).astype(np.int8)


def age_shares(dem: Dem) -> tuple[list[float], float]:
    """Shares (0…1) of the cells with a height: in each band, the newest first, and of those whose age is unknown."""
    bands = age_bands(dem)[np.isfinite(dem.heights)]
    shares = [float((bands == band).mean()) for band in range(len(BANDS) + 1)]
    return shares, float((bands < 0).mean())
