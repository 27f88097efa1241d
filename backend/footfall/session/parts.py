"""The parts of a session put together, each over one core of log, values and jobs and over parts before it."""

from contextlib import suppress
from typing import Any

from footfall.core.errors import FootFallError
from footfall.session.access.acting import said_by
from footfall.session.choosing.choices import PageChoices
from footfall.session.choosing.hand import Hand
from footfall.session.commands import Commands
from footfall.session.core import SessionCore
from footfall.session.jobs.pool import JobPool
from footfall.session.least_clearances import LeastClearances
from footfall.session.products.compared import UpToDate
from footfall.session.products.described_plans import DescribedPlans
from footfall.session.products.executions import Executions
from footfall.session.products.maps import LegMaps
from footfall.session.products.outcomes import Outcomes
from footfall.session.products.plans import StepPlans
from footfall.session.products.queues import Queues
from footfall.session.products.sequences import Sequences
from footfall.session.products.stances import Stances
from footfall.session.products.terrains import Terrains
from footfall.session.products.up_to_date import unfit_of
from footfall.session.review import Review
from footfall.session.rover.light_time import LightTime
from footfall.session.rover.linked import LinkedRover
from footfall.session.rover.recorder import DEFAULT_LIMITS, RecordingLimits
from footfall.session.storage.store import SessionStore
from footfall.session.walking import Walks
from footfall.telemetry.state import TelemetryFrame


class SessionParts(SessionCore):
    """Rover, products and commands of a session, each a part of its own; thread-safe as :class:`SessionCore` says."""

    _unfit: frozenset[str] = frozenset()
    """What listeners were told that is not of how things are now."""

    def __init__(
        self,
        store: SessionStore,
        jobs: JobPool,
        recording: RecordingLimits | None = DEFAULT_LIMITS,
        light_time: LightTime | None = None,
    ) -> None:
        super().__init__(store, jobs)
        self.rover = LinkedRover(self, recording, light_time)
        self.choices = PageChoices(self, lambda: self.rover.conn_seat)
        self.terrains = Terrains(self)
        self.fits = UpToDate(self, self.rover)
        self.stances = Stances(self, self.choices, self.rover, self.fits)
        self.maps = LegMaps(self, self.choices, self.fits, self.stances)
        self.plans = StepPlans(self, self.choices, self.maps, self.stances)
        self.described_plans = DescribedPlans(self, self.choices, self.stances)
        self.hand = Hand(self, self.choices, self.fits, self.stances, self.maps)
        self.executions = Executions(self, self.rover, self.plans)
        self.sequences = Sequences(self, self.stances, self.executions)
        self.queues = Queues(self, self.stances, self.plans, self.sequences)
        self.outcomes = Outcomes(self, self.sequences)
        self.least_clearances = LeastClearances(self)
        self.commands = Commands(
            self, self.rover, self.fits, self.executions, self.sequences, self.outcomes, self.least_clearances
        )
        self.review = Review(self, self.choices, self.rover, self.fits, self.sequences)
        self.walks = Walks(self, self.rover, self.fits, self.stances, self.executions)
        self.rover.follow(self.outcomes.look)
        self.rover.follow(self.least_clearances.look)
        self.rover.follow(self._tell_what_fits)

    def _tell_what_fits(self, frame: TelemetryFrame) -> None:
        """Tell when products come to be of other than how things are; a what-if that the rover went to is over."""
        with suppress(FootFallError, OSError), self.folded_log.lock:
            if (made_so := self.stances.stands_in_what_if()) is not None:
                payload = {"digest": self.put(made_so), "made_so": self.state.runs}
                self.folded_log.record_anyway("state_frozen", payload)
            fits = self.fits.up_to_date()
            unfit = unfit_of(fits)
            if unfit != self._unfit:
                self._unfit = unfit
                self.folded_log.tell("fits", fits=fits)

    def record_decision(self, act: str, reason: str) -> None:
        """Write down what a walk in a closed loop does next, and why."""
        self.folded_log.record_anyway("walk_decided", {**said_by(), "act": act, "reason": reason})

    def record_way(self, chosen: dict[str, Any]) -> None:
        """Write down how the next piece of a walk in a closed loop is gone, and what was refused before."""
        self.folded_log.record_anyway("way_chosen", {**said_by(), **chosen})
