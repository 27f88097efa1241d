"""The map that persists while the rover moves: each new terrain is merged into what is remembered.

A cell is a height that stands still, known with a variance. What comes new and agrees is fused (a gated Kalman
update); what contradicts is believed when it is seen clearly, else neither is; what a new ray passes through is
forgotten; all else is kept, with the time it was seen. See P. Fankhauser et al., "Robot-centric elevation mapping with
uncertainty estimates", CLAWAR 2014, and its clean-up of cells by visibility in "Probabilistic terrain mapping for
mobile robots with uncertain localization", RA-L 2018.
"""

from dataclasses import replace

import numpy as np

from footfall.core.arrays import AnyArray, Bytes, Mask
from footfall.core.errors import InvalidTerrain
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.terrain.dem import Dem
from footfall.terrain.fusion import lattice
from footfall.terrain.fusion.count_known import count_known_around
from footfall.terrain.fusion.visibility import DepthView, seen_through
from footfall.terrain.terrain_settings import TerrainSettings

DEVIATIONS = 3.0
"""Two heights of a cell that differ by more than this many standard deviations of their difference disagree."""

MIN_SUPPORT = 4
"""A new height overrules an old one only with this many known new cells among its 3 × 3, itself included."""

MAX_COUNT = int(np.iinfo(np.uint16).max)


def merge(map: Dem, new: Dem, settings: TerrainSettings | None = None, views: tuple[DepthView, ...] = ()) -> Dem:
    """The map after ``new`` was seen, on the lattice of the map, which grows with ``new`` up to the memory's limit.

    views: how far the cameras behind ``new`` saw, for forgetting what is gone. Neither input changes; the result
    has the digests of both as parents. Raises InvalidTerrain where one of them carries no memory layers, or their
    cells don't coincide.

    Per cell, with height h and variance P of the map (after drift) and z, R of the new one:

    * |z − h| ≤ max(gate, 3·√(P + R)): h += K·(z − h), P = (1 − K)·P with K = P / (P + R);
    * else z, where it is clear (√R ≤ clear_deviation) and its neighbours are known too, or a view passed
      ``see_through`` below h; else unknown: both can't be right;
    * no z: h, unless a view passed ``see_through`` below it.
    """
    settings = settings or TerrainSettings()
    for dem, what in ((map, "map"), (new, "new terrain")):
        if not dem.remembers:
            raise InvalidTerrain(f"the {what} {dem.name!r} does not say how sure its heights are; it can't be merged")
    grid = _reach(map, new, settings)
    sources = (*map.sources, *(name for name in new.sources if name not in map.sources))
    old, fresh = _on(grid, drifted(map, new, settings), sources), _on(grid, new, sources)
    h, P = old["heights"].astype(np.float64), old["variance"].astype(np.float64)
    z, R = fresh["heights"].astype(np.float64), fresh["variance"].astype(np.float64)
    was, seen = np.isfinite(h), np.isfinite(z)
    both = was & seen
    with np.errstate(invalid="ignore"):
        agree = both & (np.abs(z - h) <= np.maximum(settings.gate, DEVIATIONS * np.sqrt(P + R)))
        clear = (np.sqrt(R) <= settings.clear_deviation) & (count_known_around(seen, 3) >= MIN_SUPPORT)
    gone = seen_through(old["heights"], grid, views, settings.see_through) & was
    replaced = (both & ~agree & (clear | gone)) | (seen & ~was)
    forgotten = (gone & ~seen) | (both & ~agree & ~replaced)
    K = P / (P + R)
    heights = np.where(agree, h + K * (z - h), np.where(replaced, z, h))
    variance = np.where(agree, (1.0 - K) * P, np.where(replaced, R, P))
    heights[forgotten], variance[forgotten] = np.nan, np.nan
    with np.errstate(invalid="ignore"):
        newest = replaced | (agree & (fresh["time"] >= old["time"]))
    count = np.where(agree, np.minimum(old["count"].astype(np.int64) + fresh["count"], MAX_COUNT), old["count"])
    layers = {
        "heights": heights.astype(np.float32),
        "variance": variance.astype(np.float32),
        "count": np.where(forgotten, 0, np.where(replaced, fresh["count"], count)).astype(np.uint16),
        "time": np.where(forgotten, np.nan, np.where(newest, fresh["time"], old["time"])),
        "source": np.where(forgotten, 0, np.where(newest, fresh["source"], old["source"])).astype(np.uint8),
    }
    if not np.isfinite(layers["heights"]).any():
        raise InvalidTerrain("nothing of the map is left: every height of it is gone and no new one lies on it")
    return Dem(
        geometry=grid,
        name=new.name,
        provenance=Provenance({"map": map.digest, "new": new.digest}, settings),
        texture=_texture(grid, map, new, newest, forgotten),
        sources=sources,
        viewpoint=new.viewpoint or map.viewpoint,
        correction=map.correction if new.correction is None else new.correction,
        **layers,
    )


def drifted(map: Dem, new: Dem, settings: TerrainSettings) -> Dem:
    """The map with its variance grown by the time and the way between its newest snapshot and ``new``.

    Both as a random walk: the variance grows linearly, so that it does not matter in how many parts.
    """
    if map.variance is None or map.time is None or new.time is None:
        raise InvalidTerrain("drift needs a map with variances and the times of both")
    grown = 0.0
    if np.isfinite(new.time).any():
        seconds = max(0.0, float(np.nanmax(new.time)) - float(np.nanmax(map.time)))
        grown += settings.drift_per_hour**2 * seconds / 3600.0
    if map.viewpoint is not None and new.viewpoint is not None:
        way = float(np.linalg.norm(np.subtract(new.viewpoint, map.viewpoint)))
        grown += settings.drift_per_metre**2 * way
    return replace(map, variance=(map.variance + grown).astype(np.float32)) if grown > 0 else map


def _reach(map: Dem, new: Dem, settings: TerrainSettings) -> GridGeometry:
    west, south, east, north = new.geometry.bounds
    x, y = 0.5 * (west + east), 0.5 * (south + north)
    if new.viewpoint is not None:
        x, y = new.viewpoint[:2]
    wide = max(settings.memory_half_size, settings.half_size)
    whole = lattice.union(map.geometry, new.geometry)
    return lattice.window(whole, x, y, min(wide, 1000 * whole.resolution))


def _on(grid: GridGeometry, dem: Dem, sources: tuple[str, ...]) -> dict[str, AnyArray]:
    """The remembered layers of a terrain on the cells of ``grid``, its sources numbered as in ``sources``."""
    empty = {"heights": np.nan, "variance": np.nan, "count": 0, "time": np.nan, "source": 0}
    layers = {name: lattice.laid_onto(grid, getattr(dem, name), dem.geometry, none) for name, none in empty.items()}
    number = np.array([0, *(1 + sources.index(name) for name in dem.sources)], np.uint8)
    layers["source"] = number[layers["source"]]
    return layers


def _texture(grid: GridGeometry, map: Dem, new: Dem, newest: Mask, forgotten: Mask) -> Bytes | None:
    """What ``new`` shows of the cells that are newest in it, else ``map``; None where neither has a texture."""
    if map.texture is None and new.texture is None:
        return None
    before, after = (
        np.zeros(grid.shape, np.uint8) if dem.texture is None else lattice.laid_onto(grid, dem.texture, dem.geometry, 0)
        for dem in (map, new)
    )
    return np.where(forgotten, 0, np.where(newest & (after > 0), after, before)).astype(np.uint8)
