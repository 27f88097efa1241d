"""Where a leg may stand: maps, read-outs, suggestions, and the chosen footfall.

What judges maps loads compiled code, so it loads when first asked.
"""

from dataclasses import asdict, replace
from typing import TYPE_CHECKING

from footfall.core.errors import Conflict, InvalidInput
from footfall.maps.layers import MapSettings, MapStack
from footfall.maps.quality_settings import QualitySettings
from footfall.planning.step.problem import Footfall
from footfall.session.answers.choices import FootfallAnswer
from footfall.session.choosing.choices import PageChoices
from footfall.session.core import SessionCore, present
from footfall.session.jobs.job import Job
from footfall.session.jobs.requests import DescribedMapRequest, MapRequest
from footfall.session.products.compared import UpToDate
from footfall.session.products.judged_footfall import judge_footfall, nearest_good, without
from footfall.session.products.kinds import DESCRIBED_MAPS, MAPS
from footfall.session.products.stances import Stances
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

if TYPE_CHECKING:
    from footfall.maps.quality import Quality
    from footfall.maps.suggest import Explanation, Suggestions


MOST_GOOD = 20
"""Places that a plan may name instead of one on unknown ground."""


class LegMaps:
    """Where each leg may stand, and the footfall that is chosen; thread-safe as
    :class:`footfall.session.core.SessionCore` says.
    """

    _suggested: "tuple[str, Suggestions | None]" = ("", None)
    """Digest of the maps, and the suggestions on them that the scene shows."""

    def __init__(self, core: SessionCore, choices: PageChoices, fits: UpToDate, stances: Stances) -> None:
        self._core, self._choices, self._fits, self._stances = core, choices, fits, stances

    def compute(self, leg: int, settings: MapSettings | None = None) -> Job:
        """Maps for one leg; an older job for it that still runs is cancelled. Raises Conflict, InvalidInput."""
        self._core.require_leg(leg)
        if self._core.described is not None:
            if settings is not None:
                raise InvalidInput("settings of maps are those of ATHLETE's legs: leave them out for this robot")
            return self._stances.ask(DESCRIBED_MAPS, DescribedMapRequest(leg), leg=leg)
        return self._stances.ask(MAPS, MapRequest(leg, settings or MapSettings()), leg=leg)

    def shown(self, leg: int) -> MapStack | None:
        """The maps of ``leg`` that fit the present terrain and state; a coarse form while they are being made.

        Those that hold in part where no newer ones are on their way; :meth:`.UpToDate.maps_changed` says where they
        don't.
        """
        fit = self._fits.of_maps(leg)
        if fit.fits or (fit.partly and self._core.product_jobs.preview(leg) is None):
            return self._core.typed(MapStack, self._core.state.maps[str(leg)])
        preview = self._core.product_jobs.preview(leg)
        if preview is None or not self._fits.of_made(MAPS, preview.parents).fits:
            return None
        return preview.product if isinstance(preview.product, MapStack) else None

    def explain(self, maps: MapStack, x: float, y: float) -> "Explanation":
        """What every layer of maps of this session says of a point [m], and what decides.

        Raises InvalidInput, also where the session's robot is one that others described: no quality is known for those.
        """
        from footfall.maps.choice import explain_at

        self._core.require_athletes_build()
        return explain_at(self._quality(maps, None, None), x, y)

    def suggest(
        self,
        leg: int,
        count: int = 5,
        separation: float | None = None,
        towards: tuple[float, float] | None = None,
        settings: QualitySettings | None = None,
        show: bool = False,
    ) -> "Suggestions":
        """The best footfalls on the current maps of a leg; see :func:`footfall.maps.suggest.suggest`.

        separation: [m]; None: a wheel's diameter, and less only where nothing else is left.
        show: whether the scene shows them, as long as those maps stay current. Raises Conflict where there are no maps
        of the present terrain and state, and names the job where they are being made; InvalidInput.
        """
        from footfall.maps.suggest import suggest

        self._core.require_leg(leg)
        if not (fit := self._fits.of_maps(leg)).fits:
            if (job := self._core.product_jobs.under_way(MAPS, leg)) is not None:
                so_far = f"{100 * job.fraction:z.0f} % so far"
                raise Conflict(
                    f"the maps of leg {leg} are being made, {so_far}; ask again once they are there", job=job.id
                )
            raise Conflict(
                f"there are no maps of leg {leg} for the present terrain and stance ({fit.reason}); compute them first"
            )
        maps = self._core.typed(MapStack, self._core.state.maps[str(leg)])
        wheel = 2 * self._core.robot.wheel_radius
        strictly = separation is not None
        found = suggest(self._quality(maps, settings, towards), count, separation if strictly else wheel, strictly)
        if show:
            with self._core.folded_log.lock:
                self._suggested = maps.digest, found
                self._core.folded_log.tell("view", view=asdict(self._choices.view), seat="")
        return found

    def suggestions_shown(self, leg: int) -> "Suggestions | None":
        """What the scene was given to show, where it is of maps of ``leg`` that fit the present terrain and state."""
        maps, found = self._suggested
        return found if self._core.state.maps.get(str(leg)) == maps and self._fits.of_maps(leg).fits else None

    def _quality(
        self, maps: MapStack, settings: QualitySettings | None, towards: tuple[float, float] | None
    ) -> "Quality":
        from footfall.maps.choice import stack_quality

        parents = maps.provenance.parents
        dem, state = self._core.typed(Dem, parents["dem"]), self._core.typed(RobotState, parents["state"])
        return stack_quality(self._core.robot, dem, state, maps, settings, towards)

    def good_places(self, footfall: Footfall) -> tuple[tuple[float, float], ...]:
        """The nearest cells that the leg's maps call reachable and stable, nearest first; none without maps of now."""
        if not self._fits.of_maps(footfall.leg).fits:
            return ()
        maps = self._core.typed(MapStack, self._core.state.maps[str(footfall.leg)])
        return nearest_good(maps, footfall.x, footfall.y, MOST_GOOD)

    def choose_footfall(self, leg: int, x: float, y: float) -> FootfallAnswer:
        """Choose where a leg is to stand, acceptable or not; the answer is :meth:`footfall_answer`'s.

        It is the choice of the page that acts. Raises Conflict where that does not show its own.
        """
        self._core.require_leg(leg)
        footfall = Footfall(leg, float(x), float(y))
        answer = self.footfall_answer(footfall)
        with self._core.folded_log.lock:
            self._choices.require_own()
            self._core.folded_log.record("footfall_chosen", {**answer})
            self._choices.change(lambda own: replace(own, footfall=footfall))
        return answer

    def footfall_answer(self, footfall: Footfall) -> FootfallAnswer:
        """What terrain and maps say of a footfall now; see :func:`.footfalls.judge_footfall`."""
        state = self._core.state
        dem = self._core.typed(Dem, present(state.dem, "there is no terrain yet"))
        maps, outdated = self.held(footfall.leg), self.doubt(footfall.leg, footfall.x, footfall.y)
        return judge_footfall(dem, self.sole_radius(footfall.leg), footfall.leg, footfall.x, footfall.y, maps, outdated)

    def sole_radius(self, leg: int) -> float:
        """Of the wheel, or of the sole of a robot that others described [m]."""
        other = self._core.described
        return self._core.description.wheel_radius if other is None else other.model.legs[leg].sole.radius

    def held(self, leg: int) -> MapStack | None:
        """The latest maps of a leg, those that hold in part with their footing unknown where it does not hold."""
        digest = self._core.state.maps.get(str(leg))
        maps = None if digest is None else self._core.typed(MapStack, digest)
        changed = None if maps is None else self._fits.maps_changed(leg)
        return maps if maps is None or changed is None else without(maps, changed)

    def doubt(self, leg: int, x: float, y: float) -> str:
        """Why the latest maps of a leg say nothing of a place [m] as things are now; "" where they do, or are none."""
        maps, fit = self.held(leg), self._fits.of_maps(leg)
        if maps is None or not fit.partly or not maps.geometry.contains(x, y):
            return "" if maps is None else fit.reason
        changed = self._fits.maps_changed(leg)
        row, col = (int(i) for i in maps.geometry.cell(x, y))
        return "" if changed is None or not changed[row, col] else fit.reason
