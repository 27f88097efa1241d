"""One open session, made of parts over one core of log, values and jobs.

A script without a server works the same way, with jobs run inline::

    with Sessions(folder, jobs=InlineJobs()) as sessions:
        session = sessions.create("rock step")
        session.terrains.load(dem)
        session.stances.set(state)
        session.maps.compute(leg=2).finish()
        session.maps.choose_footfall(2, x, y)
        plan = session.plans.step(leg=2).finish()
        session.sequences.export(session.sequences.make(plan), "csv")
"""

from contextlib import suppress
from typing import Any

from footfall.core.errors import Conflict, FootFallError
from footfall.planning.walk.problem import WalkGoal
from footfall.session.access.acting import told
from footfall.session.access.identity import LOCAL, Identity
from footfall.session.choosing.choices import PageChoices
from footfall.session.choosing.hand import Hand
from footfall.session.commands import Commands
from footfall.session.core import SessionCore
from footfall.session.jobs.pool import JobPool
from footfall.session.least_clearances import LeastClearances
from footfall.session.loop_settings import LoopSettings
from footfall.session.products.compared import UpToDate
from footfall.session.products.executions import Executions
from footfall.session.products.footing import LegMaps
from footfall.session.products.outcomes import Outcomes
from footfall.session.products.plans import StepPlans
from footfall.session.products.sequences import Sequences
from footfall.session.products.stances import Stances
from footfall.session.products.terrains import Terrains
from footfall.session.products.up_to_date import unfit_of
from footfall.session.review import Review
from footfall.session.rover.light_time import LightTime
from footfall.session.rover.linked import LinkedRover
from footfall.session.rover.recorder import DEFAULT_LIMITS, RecordingLimits
from footfall.session.storage.store import SessionStore
from footfall.session.summary import summary
from footfall.session.walk_loop import WalkLoop
from footfall.session.walking import Walks
from footfall.telemetry.state import TelemetryFrame


class LiveSession(SessionCore):
    """A session with its rover, products and commands, each a part of its own; see the module's docstring.

    Made by :class:`footfall.session.registry.Sessions`; thread-safe as :class:`SessionCore` says.
    """

    _unfit: frozenset[str] = frozenset()
    """What listeners were told that is not of how things are now."""
    _walk_loop: WalkLoop | None = None

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
        self.hand = Hand(self, self.choices, self.fits, self.stances, self.maps)
        self.executions = Executions(self, self.rover, self.plans)
        self.sequences = Sequences(self, self.stances, self.executions)
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

    def summary(self) -> dict[str, Any]:
        """The session as plain JSON, for a page that opens."""
        with self.journal.lock:
            return {**summary(self), "walk_loop": None if self._walk_loop is None else self._walk_loop.as_dict()}

    @property
    def idle(self) -> bool:
        """Whether nobody hears it or holds its conn, nothing is under way, and all of it is written."""
        rover, commands = self.rover, self.commands
        busy = self.journal.listened_to or rover.recorder.listened_to or rover.link.connected or self.unrecorded
        busy = busy or commands.gate["run"] is not None or commands.conn["holder"] is not None
        return not busy and all(job.ended for job in self.jobs)

    def close(self) -> None:
        """End its walk, cancel its jobs, end its run, seal its log; harmless when done twice."""
        if self._walk_loop is not None:
            # it may wait for a job
            self._walk_loop.leave()
        self.workshop.close()
        if self._walk_loop is not None:
            self._walk_loop.close()
        self.rover.close()
        self.least_clearances.close()
        self.journal.close()

    def _tell_what_fits(self, frame: TelemetryFrame) -> None:
        """Tell when products come to be of other than how things are; a what-if that the rover went to is over."""
        with suppress(FootFallError, OSError), self.journal.lock:
            if (made_so := self.stances.stands_in_what_if()) is not None:
                payload = {"digest": self.put(made_so), "made_so": self.state.runs}
                self.journal.record_anyway("state_frozen", payload)
            fits = self.fits.up_to_date()
            unfit = unfit_of(fits)
            if unfit != self._unfit:
                self._unfit = unfit
                self.journal.tell("fits", fits=fits)

    def walk_to(self, goal: WalkGoal, settings: LoopSettings | None = None, who: Identity = LOCAL) -> WalkLoop:
        """Begin to walk to a goal in a closed loop, by images and telemetry, as ``who``; see :class:`WalkLoop`.

        Raises Conflict where the rover is on such a walk already, or there is no rover.
        """
        with self.journal.lock:
            if self._walk_loop is not None and self._walk_loop.state != "ended":
                raise Conflict("the rover is on its way to a goal already: end that walk first")
            if not self.rover.link.connected:
                raise Conflict("no rover is connected")
            self._walk_loop = WalkLoop(self, goal, settings or LoopSettings(), who)
            return self._walk_loop

    @property
    def walk_loop(self) -> WalkLoop | None:
        """The latest walk to a goal in a closed loop, over or not."""
        return self._walk_loop

    def record_decision(self, act: str, reason: str) -> None:
        """Write down what a walk in a closed loop does next, and why."""
        self.journal.record_anyway("walk_decided", {**told(), "act": act, "reason": reason})

    def record_way(self, chosen: dict[str, Any]) -> None:
        """Write down how the next piece of a walk in a closed loop is gone, and what was refused before."""
        self.journal.record_anyway("way_chosen", {**told(), **chosen})
