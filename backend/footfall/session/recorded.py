"""What a session is without its rover: log, state, values, jobs, choices and notes, under one lock."""

from collections.abc import Callable
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any, cast

from footfall.core.errors import Conflict, InvalidInput, InvalidTelemetry
from footfall.core.value import Value
from footfall.session.access.acting import actor
from footfall.session.access.identity import Identity, Role
from footfall.session.choosing.pages import Choices, Pages
from footfall.session.jobs.job import Job
from footfall.session.jobs.pool import JobPool
from footfall.session.jobs.product_recipes import built_robot
from footfall.session.journal import Journal
from footfall.session.log.event import Event
from footfall.session.log.fold import SessionState
from footfall.session.shelf import Shelf
from footfall.session.storage.references import whole_zip
from footfall.session.storage.store import SessionStore
from footfall.session.view import ViewState
from footfall.session.workshop import Workshop
from footfall.telemetry.state import RobotState

if TYPE_CHECKING:
    from footfall.robot.description import RobotDescription
    from footfall.robot.model import Robot


class RecordedSession:
    """The part of a session that its folder holds. Every method may be called from any thread.

    Listeners are called in the order of what happened with the session's lock held: they put the message
    into a queue of their own and return.
    """

    def __init__(self, store: SessionStore, jobs: JobPool) -> None:
        self._store = store
        self._journal = Journal(store)
        self._shelf = Shelf(store)
        self._workshop = Workshop(jobs, self._journal, self._shelf, store)
        chosen = self.state.footfall
        view = ViewState() if chosen is None else ViewState(leg=chosen.leg)
        self._pages = Pages(Choices(view, chosen, self.state.points))
        for repair in store.repairs:
            self._journal.record("log_repaired", repair)
        if len(self._journal) and store.writes:
            self._journal.record("session_opened", {})

    def begin(self, name: str, robot: str, robot_name: str) -> None:
        """Write the first event of a new session; ``robot`` is the digest of its description."""
        self._journal.record("session_created", {"name": name, "robot": robot, "robot_name": robot_name})

    # -- what it is ----------------------------------------------------------------------------

    @property
    def id(self) -> str:
        """Name of the session's folder."""
        return self._store.folder.name

    @property
    def name(self) -> str:
        """What its maker called it."""
        return self.state.name

    @property
    def robot_digest(self) -> str:
        """Content name of the robot description."""
        return present(self.state.robot, "the session has no robot")

    @property
    def description(self) -> "RobotDescription":
        """The robot description that the session was made with."""
        return cast("RobotDescription", self.get(self.robot_digest))

    @property
    def robot(self) -> "Robot":
        """The robot's model, built when first asked for."""
        return built_robot(self.description)

    @property
    def state(self) -> SessionState:
        """What the log folds to."""
        return self._journal.state

    @property
    def choices(self) -> Choices:
        """What is chosen on the page that acts; what was chosen last, where no page acts."""
        return self.choices_of(actor())

    @property
    def view(self) -> ViewState:
        """What is looked at on the page that acts; as :attr:`choices`."""
        return self.choices.view

    @property
    def jobs(self) -> list[Job]:
        """The session's jobs, newest last."""
        return self._workshop.jobs

    def events(self, since: int = 0) -> list[Event]:
        """Events with ``seq`` ≥ ``since``."""
        return self._journal.events(since)

    def listen(self, callback: Callable[[dict[str, Any]], None]) -> Callable[[], None]:
        """Hear of everything from now on; returns what ends it. See the class about what callbacks may do."""
        return self._journal.listen(callback)

    @property
    def unrecorded(self) -> int:
        """Events that the disk could not take yet."""
        return self._journal.unrecorded

    @property
    def only_looked_at(self) -> bool:
        """Whether nothing in it can be changed, and so nothing happens that could be heard."""
        return not self._store.writes

    @property
    def appended(self) -> tuple[int, float]:
        """How many events were written since the session was opened, and how long that took in all [s]."""
        return self._journal.appended

    # -- values --------------------------------------------------------------------------------

    def put(self, value: Value) -> str:
        """Store a value; returns its digest. Nothing refers to it yet."""
        return self._shelf.put(value)

    def get(self, digest: str) -> Value:
        """Raises NotFound; InvalidBundle where the stored file is damaged."""
        return self._shelf.get(digest)

    def has(self, digest: str) -> bool:
        """Whether a value of this name is stored."""
        return self._store.has(digest)

    def put_bytes(self, data: bytes, extension: str) -> str:
        """Store the content of a file that is no value, such as an export."""
        return self._store.put_bytes(data, extension)

    def get_bytes(self, digest: str) -> bytes:
        """Raises NotFound; InvalidBundle where the stored file is damaged."""
        return self._store.get_bytes(digest)

    # -- choices and notes ---------------------------------------------------------------------

    def choices_of(self, who: Identity | None) -> Choices:
        """What a page shows: its own choices, or where it follows, those of the holder of the conn.

        Where nobody holds that, or a program that names no page: what was chosen last. Viewers can't choose, so they
        begin by following.
        """
        own = self._own_choices(who)
        if not own.view.follows:
            return own
        shown = self._pages.of(self._conn_seat())
        return replace(shown, view=replace(shown.view, follows=True))

    def concerns(self, who: Identity, changed: str) -> bool:
        """Whether a page shows something else since those of the seat ``changed`` ("": of every one) are others."""
        if not who.seat or changed in ("", who.seat):
            return True
        return self._own_choices(who).view.follows and self._conn_seat() in ("", changed)

    def set_view(self, **changes: Any) -> ViewState:
        """Change fields of the view of the page that acts; see :meth:`footfall.session.view.ViewState.changed`.

        follows: whether it shows what the holder of the conn shows. Raises InvalidInput; Conflict where it does.
        """
        if "leg" in changes:
            self._require_leg(changes["leg"])
        follows = changes.pop("follows", None)
        with self._journal.lock:
            if follows is not None:
                self._pages.follow(self._seat(), follows)
            if changes:
                latest = len(self.events()) - 1
                self._change_choices(lambda own: replace(own, view=own.view.changed(latest, **changes)))
            else:
                self._tell_choices()
            return self.view

    def _change_choices(self, make: Callable[[Choices], Choices]) -> None:
        """Other choices on the page that acts. Raises Conflict where it does not show its own."""
        with self._journal.lock:
            self._require_own()
            self._pages.change(self._seat(), make)
            self._tell_choices()

    def _tell_choices(self) -> None:
        self._journal.tell("view", view=asdict(self.view), seat=self._seat())

    def _require_own(self) -> None:
        """What is chosen is chosen of what is in sight. Raises Conflict where that is another page's."""
        if self._own_choices(actor()).view.follows and self._conn_seat() != self._seat():
            raise Conflict(
                "this page shows what the holder of the conn shows: let it show its own choices, and then choose"
            )

    def _own_choices(self, who: Identity | None) -> Choices:
        return self._pages.of(_seat_of(who), follows=who is not None and who.role is Role.VIEWER)

    def _seat(self) -> str:
        return _seat_of(actor())

    def _conn_seat(self) -> str:
        """Of the page that holds the conn; "" where none does."""
        return ""

    def add_note(self, text: str) -> None:
        """Write something down. Raises InvalidInput for an empty or overlong note."""
        if not 0 < len(text.strip()) <= 10_000:
            raise InvalidInput("a note has 1 to 10 000 characters", length=len(text))
        self._journal.record("note", {"text": text.strip()})

    def export_bundle(self) -> bytes:
        """The session so far, as a zip. Raises Conflict where artifacts are missing."""
        with self._journal.lock:
            return whole_zip(self._store.bundle())

    def close(self) -> None:
        """Cancel its jobs and seal its log; harmless when done twice."""
        self._workshop.close()
        self._journal.close()

    def _require_leg(self, leg: int) -> None:
        count = len(self.description.legs)
        if type(leg) is not int or not 0 <= leg < count:
            raise InvalidInput(f"{self.state.robot_name} has legs 0…{count - 1}", leg=leg)

    def _require_robot(self, state: RobotState) -> None:
        legs = len(self.description.legs)
        if state.robot != self.state.robot_name or state.leg_count != legs:
            raise InvalidTelemetry(
                f"this is a state of {state.robot} with {state.leg_count} legs; "
                f"the session is about {self.state.robot_name} with {legs}",
                robot=state.robot,
                fault="wrong-robot" if state.robot != self.state.robot_name else "wrong-legs",
            )


def _seat_of(who: Identity | None) -> str:
    return "" if who is None else who.seat


def present(digest: str | None, otherwise: str) -> str:
    """``digest`` where there is one; raises Conflict, saying ``otherwise``, where there is none."""
    if digest is None:
        raise Conflict(otherwise)
    return digest
