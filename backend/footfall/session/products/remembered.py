"""Which map a new snapshot is merged into, and which images moved the rover to where it is on a map."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from footfall.session.log.event import Event
from footfall.session.log.fold import SessionState
from footfall.session.value_store import ValueStore
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.fusion.on_map import Looks
from footfall.terrain.terrain_settings import TerrainSettings


def map_below(state: SessionState, snapshot: str, settings: TerrainSettings, value_store: ValueStore) -> str | None:
    """Digest of the terrain that ``snapshot`` is to be merged into; None: it starts a map.

    A terrain that came from images, in cells of the same size. Where the snapshot is part of the present one, the
    terrain before it: the same images twice would make a height look surer than it is.
    """
    digest = _without(state, snapshot) if settings.keep else None
    if digest is None:
        return None
    dem = value_store.typed(Dem, digest)
    same_cells = abs(dem.geometry.resolution - settings.resolution) < 1e-9
    return digest if dem.remembers and same_cells else None


def _without(state: SessionState, snapshot: str) -> str | None:
    digest = base = state.dem
    while digest is not None and (made := state.products.get(digest)) is not None:
        if "dem" in made.parents:
            digest = made.parents["dem"]  # the one that it is a change of
        else:
            digest = made.parents.get("map")
            if made.parents.get("snapshot") == snapshot:
                base = digest
    return base


def looks_behind(state: SessionState, events: Iterable[Event], value_store: ValueStore) -> Looks | None:
    """The images that the correction of the present terrain is from; None where it is from none of this session's.

    Images with too little ground in common with the map leave its correction as it was: it is from those before then.
    """
    states = {event.payload["digest"]: event.payload["state"] for event in events if event.type == "snapshot_taken"}
    merged: list[str] = []
    built = None if state.dem is None else _built(state, state.dem)
    while built is not None and "map" in (parents := state.products[built].parents):
        if parents["snapshot"] not in states:
            return None
        merged.append(built)
        built = _built(state, below := parents["map"])
    if not merged:
        return None
    correction_below = _correction(value_store, below)
    newest = _correction(value_store, merged[0])
    before = (_correction(value_store, one) for one in (*merged[1:], below))
    moved = next((i for i, one in enumerate(before) if not np.array_equal(one, newest)), None)
    if moved is None:
        return None
    taken = [
        value_store.typed(RobotState, states[state.products[one].parents["snapshot"]])
        for one in (merged[moved], merged[-1])
    ]
    settings = value_store.typed(Dem, merged[moved]).provenance.settings
    settings = settings if isinstance(settings, TerrainSettings) else TerrainSettings()
    return Looks(*taken, count=len(merged) - moved, below=correction_below, settings=settings)


def _built(state: SessionState, digest: str) -> str | None:
    """The terrain made of images that a terrain is, or is a change of; None where it came from elsewhere."""
    made = state.products.get(digest)
    while made is not None and "dem" in made.parents:
        made = state.products.get(digest := made.parents["dem"])
    return None if made is None or "snapshot" not in made.parents else digest


def _correction(value_store: ValueStore, dem: str) -> NDArray[np.float64]:
    correction = value_store.typed(Dem, dem).correction
    return np.eye(4) if correction is None else correction
