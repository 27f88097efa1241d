"""The terrains of a session: loaded, built from images, blended, cleared, undone."""

from footfall.core.errors import Conflict
from footfall.robot.legged.groups import longest_leg
from footfall.session.core import SessionCore, present
from footfall.session.jobs.job import Job
from footfall.session.products.kinds import BLEND, CLEAR, PHOTOGRAPHS, TERRAIN
from footfall.session.products.remembered import map_below
from footfall.telemetry.images import Snapshot
from footfall.telemetry.photographs import Photographs
from footfall.terrain.dem import Dem
from footfall.terrain.fusion.clear import Area
from footfall.terrain.terrain_settings import BlendSettings, TerrainSettings, terrain_settings_by_leg

SHORT_JOB = 120.0
"""How long short work, such as clearing or making and editing a sequence, is waited for [s]."""


class Terrains:
    """The terrains of a session; thread-safe as :class:`footfall.session.core.SessionCore` says."""

    def __init__(self, core: SessionCore) -> None:
        self._core = core

    def load(self, dem: Dem, source: str = "") -> str:
        """Use a terrain that came from elsewhere. Returns its digest."""
        with self._core.folded_log.lock:
            digest = self._core.put(dem)
            self._core.folded_log.record("terrain_loaded", {"digest": digest, "name": dem.name, "source": source})
        return digest

    def delivered(self) -> TerrainSettings:
        """Settings as delivered: a robot that others described looks at ground as near to it as it is small."""
        about = self._core.described
        return TerrainSettings() if about is None else terrain_settings_by_leg(longest_leg(about.model))

    def build(self, settings: TerrainSettings | None = None) -> Job:
        """Rebuild the ground from the latest snapshot and merge it into the map; without settings, as delivered.

        Raises Conflict without a snapshot, InvalidInput where the settings name a pair that it has not.
        """
        settings, state = settings or self.delivered(), self._core.state
        snapshot = present(state.snapshot, "there are no images yet; request them from the rover")
        images = self._core.typed(Snapshot, snapshot)
        settings.not_chosen([*(pair.name for pair in images.pairs), *images.left_out])
        parents = {"robot": self._core.robot_digest, "snapshot": snapshot}
        below = map_below(state, snapshot, settings, self._core.value_store)
        parents = parents if below is None else {**parents, "map": below}
        return self._core.product_jobs.submit(
            TERRAIN, parents, settings, while_there={"dem": state.dem} if settings.keep else None
        )

    def build_from_photographs(
        self, photographs: Photographs, settings: TerrainSettings | None = None, *, with_rover: bool = False
    ) -> Job:
        """A new terrain from stereo pairs of any calibrated cameras.

        with_rover: the cameras are on the rover as it stands now; its body is taken out. Raises Conflict where
        nothing is known of how it stands.
        """
        parents = {"photographs": self._core.put(photographs)}
        if with_rover:
            stands = self._core.state.what_if or self._core.state.state
            state = present(stands, "nothing is known of how the rover stands; freeze its state first")
            parents |= {"robot": self._core.robot_digest, "state": state}
        return self._core.product_jobs.submit(PHOTOGRAPHS, parents, settings or TerrainSettings())

    def blend(self, external: Dem, settings: BlendSettings | None = None, source: str = "") -> Job:
        """Lay a terrain from elsewhere under the present one. source: where it came from. Raises Conflict."""
        dem = present(self._core.state.dem, "there is no terrain yet")
        parents = {"dem": dem, "external": self._core.put(external)}
        return self._core.product_jobs.submit(
            BLEND, parents, settings or BlendSettings(), while_there={"dem": dem}, source=source
        )

    def clear(self, area: Area) -> str:
        """Make an area of the terrain unknown; returns the new digest. Raises Conflict, InvalidTerrain."""
        dem = present(self._core.state.dem, "there is no terrain yet")
        job = self._core.product_jobs.submit(CLEAR, {"dem": dem}, area, urgent=True, while_there={"dem": dem})
        return job.finish(SHORT_JOB)

    def undo(self) -> str:
        """Go back to the terrain before the present one; returns its digest. Raises Conflict where there is none."""
        with self._core.folded_log.lock:
            if not self._core.state.terrain_history:
                raise Conflict("there is no earlier terrain to go back to")
            digest = self._core.state.terrain_history[-1]
            self._core.folded_log.record("terrain_undone", {"digest": digest})
        return digest
