"""The terrains of a session: loaded, built from images, blended, cleared, undone."""

from footfall.core.errors import Conflict
from footfall.session.jobs.job import Job
from footfall.session.products.kinds import BLEND, CLEAR, PHOTOGRAPHS, TERRAIN
from footfall.session.products.remembered import map_below
from footfall.session.recorded import RecordedSession, present
from footfall.telemetry.images import Snapshot
from footfall.telemetry.photographs import Photographs
from footfall.terrain.dem import Dem
from footfall.terrain.fusion.clear import Area
from footfall.terrain.settings import BlendSettings, TerrainSettings

SHORT_JOB = 120.0
"""How long short work, such as clearing or making and editing a sequence, is waited for [s]."""


class TerrainSession(RecordedSession):
    """The part of a session that changes its terrain; thread-safe as :class:`RecordedSession` says."""

    def load_terrain(self, dem: Dem, source: str = "") -> str:
        """Use a terrain that came from elsewhere. Returns its digest."""
        with self._journal.lock:
            digest = self.put(dem)
            self._journal.record("terrain_loaded", {"digest": digest, "name": dem.name, "source": source})
        return digest

    def build_terrain(self, settings: TerrainSettings | None = None) -> Job:
        """Rebuild the ground from the latest snapshot and merge it into the map.

        Raises Conflict without a snapshot, InvalidInput where the settings name a pair that it has not.
        """
        settings, state = settings or TerrainSettings(), self.state
        snapshot = present(state.snapshot, "there are no images yet; request them from the rover")
        images = self._shelf.typed(Snapshot, snapshot)
        settings.not_chosen([*(pair.name for pair in images.pairs), *images.left_out])
        parents = {"robot": self.robot_digest, "snapshot": snapshot}
        below = map_below(state, snapshot, settings, self._shelf)
        return self._workshop.submit(TERRAIN, parents if below is None else {**parents, "map": below}, settings)

    def build_from_photographs(
        self, photographs: Photographs, settings: TerrainSettings | None = None, *, with_rover: bool = False
    ) -> Job:
        """A new terrain from stereo pairs of any calibrated cameras.

        with_rover: the cameras are on the rover as it stands now; its body is taken out. Raises Conflict where
        nothing is known of how it stands.
        """
        parents = {"photographs": self.put(photographs)}
        if with_rover:
            state = present(self.state.state, "nothing is known of how the rover stands; freeze its state first")
            parents |= {"robot": self.robot_digest, "state": state}
        return self._workshop.submit(PHOTOGRAPHS, parents, settings or TerrainSettings())

    def blend_terrain(self, external: Dem, settings: BlendSettings | None = None, source: str = "") -> Job:
        """Lay a terrain from elsewhere under the present one. source: where it came from. Raises Conflict."""
        dem = present(self.state.dem, "there is no terrain yet")
        parents = {"dem": dem, "external": self.put(external)}
        return self._workshop.submit(BLEND, parents, settings or BlendSettings(), source=source)

    def clear_terrain(self, area: Area) -> str:
        """Make an area of the terrain unknown; returns the new digest. Raises Conflict, InvalidTerrain."""
        dem = present(self.state.dem, "there is no terrain yet")
        return self._workshop.submit(CLEAR, {"dem": dem}, area, urgent=True).finish(SHORT_JOB)

    def undo_terrain(self) -> str:
        """Go back to the terrain before the present one; returns its digest. Raises Conflict where there is none."""
        with self._journal.lock:
            if not self.state.terrain_history:
                raise Conflict("there is no earlier terrain to go back to")
            digest = self.state.terrain_history[-1]
            self._journal.record("terrain_undone", {"digest": digest})
        return digest
