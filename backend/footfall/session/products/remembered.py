"""Which map a new snapshot is merged into, and where the rover stands on it."""

from dataclasses import replace

from footfall.session.log.fold import SessionState
from footfall.session.shelf import Shelf
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.settings import TerrainSettings


def map_below(state: SessionState, snapshot: str, settings: TerrainSettings, shelf: Shelf) -> str | None:
    """Digest of the terrain that ``snapshot`` is to be merged into; None: it starts a map.

    A terrain that came from images, in cells of the same size. Where the snapshot is part of the present one, the
    terrain before it: the same images twice would make a height look surer than it is.
    """
    digest = _without(state, snapshot) if settings.keep else None
    if digest is None:
        return None
    dem = shelf.typed(Dem, digest)
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


def on_map(state: RobotState, dem: Dem | None) -> RobotState:
    """A telemetered state with the pose that it has on the map: as the map's newest snapshot had to be moved."""
    if dem is None or dem.correction is None:
        return state
    return replace(
        state,
        T_site_base=dem.correction @ state.T_site_base,
        wheel_forces=state.wheel_forces @ dem.correction[:3, :3].T,
    )
