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

from footfall.core.errors import Conflict, NotFound
from footfall.planning.walk.problem import WalkGoal
from footfall.session.access.identity import LOCAL, Identity
from footfall.session.answers.sessions import SessionAnswer
from footfall.session.loop_settings import LoopSettings
from footfall.session.parts import SessionParts
from footfall.session.storage.looked import EarlierStore
from footfall.session.summary import summary
from footfall.session.walk_loop import WalkLoop


class LiveSession(SessionParts):
    """A session that tells of itself, walks to goals, and is closed; see the module's docstring.

    Made by :class:`footfall.session.registry.Sessions`; thread-safe as :class:`footfall.session.core.SessionCore` says.
    """

    _walk_loop: WalkLoop | None = None

    def summary(self) -> SessionAnswer:
        """The session as plain JSON, for a page that opens."""
        with self.folded_log.lock:
            return summary(self, None if self._walk_loop is None else self._walk_loop.as_dict())

    @property
    def idle(self) -> bool:
        """Whether nobody hears it or holds its conn, nothing is under way, and all of it is written."""
        rover, commands = self.rover, self.commands
        busy = self.folded_log.listened_to or rover.recorder.listened_to or rover.link.connected or self.unrecorded
        busy = busy or commands.gate["run"] is not None or commands.conn["holder"] is not None
        return not busy and all(job.ended for job in self.jobs)

    def close(self) -> None:
        """End its walk, cancel its jobs, end its run, seal its log; harmless when done twice."""
        if self._walk_loop is not None:
            # it may wait for a job
            self._walk_loop.leave()
        self.product_jobs.close()
        if self._walk_loop is not None:
            self._walk_loop.close()
        self.rover.close()
        self.least_clearances.close()
        self.folded_log.close()

    def walk_to(self, goal: WalkGoal, settings: LoopSettings | None = None, who: Identity = LOCAL) -> WalkLoop:
        """Begin to walk to a goal in a closed loop, by images and telemetry, as ``who``; see :class:`WalkLoop`.

        Raises Conflict where the rover is on such a walk already, or there is no rover, InvalidInput for another robot,
        and where the settings name a leg that it does not have.
        """
        self.require_athletes_build()
        settings = settings or LoopSettings()
        settings.walk.require_legs(self.description)
        with self.folded_log.lock:
            if self._walk_loop is not None and self._walk_loop.state != "ended":
                raise Conflict("the rover is on its way to a goal already: end that walk first")
            if not self.rover.link.connected:
                raise Conflict("no rover is connected")
            self._walk_loop = WalkLoop(self, goal, settings, who)
            return self._walk_loop

    def as_of(self, event: int) -> "LiveSession":
        """The session as it was after the event of that number, only to be looked at. Raises NotFound without one."""
        until = self.events()[: event + 1]
        if not until or until[-1].seq != event:
            raise NotFound(f"the session has no event {event}; it has {len(self.folded_log)}", event=event)
        return LiveSession(EarlierStore(self.store, until), self.product_jobs.pool, None)

    @property
    def walk_loop(self) -> WalkLoop | None:
        """The latest walk to a goal in a closed loop, over or not."""
        return self._walk_loop
