"""What all parts of a session share: its log, values, jobs and files, under one lock."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

from footfall.core.arrays import Array
from footfall.core.errors import Conflict, InvalidInput, InvalidTelemetry
from footfall.core.value import Value
from footfall.session.described_robots import athletes_alone
from footfall.session.folded_log import FoldedLog
from footfall.session.jobs.job import Job
from footfall.session.jobs.pool import JobPool
from footfall.session.jobs.product_recipes import built_robot
from footfall.session.log.event import RENAMED, Event
from footfall.session.log.fold import SessionState
from footfall.session.naming import session_name
from footfall.session.product_jobs import ProductJobs
from footfall.session.products.up_to_date import StandingDifference, difference
from footfall.session.storage.references import whole_zip
from footfall.session.storage.store import SessionStore
from footfall.session.value_store import ValueStore
from footfall.telemetry.state import RobotState

if TYPE_CHECKING:
    from footfall.robot.description import RobotDescription
    from footfall.robot.legged.legged_model import DescribedRobot
    from footfall.robot.legged.legged_robot import LeggedRobot
    from footfall.robot.model import Robot
    from footfall.telemetry.joint_layout import JointLayout


_V = TypeVar("_V", bound=Value)


class SessionCore:
    """What its folder holds of a session, and its jobs. Every method may be called from any thread.

    Listeners are called in the order of what happened with the session's lock held: they put the message
    into a queue of their own and return.
    """

    _layout: "JointLayout | None" = None
    _reach: float | None = None

    def __init__(self, store: SessionStore, jobs: JobPool) -> None:
        self.store = store
        self.folded_log = FoldedLog(store)
        self.value_store = ValueStore(store)
        self.product_jobs = ProductJobs(jobs, self.folded_log, self.value_store, store)
        for repair in store.repairs:
            self.folded_log.record("log_repaired", repair)
        if len(self.folded_log) and store.writes:
            self.folded_log.record("session_opened", {})

    def begin(self, name: str, robot: str, robot_name: str) -> None:
        """Write the first event of a new session; ``robot`` is the digest of its description."""
        self.folded_log.record("session_created", {"name": name, "robot": robot, "robot_name": robot_name})

    @property
    def id(self) -> str:
        """Name of the session's folder."""
        return self.store.folder.name

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
        """The description that the session was made with, of a robot of ATHLETE's build; else raises InvalidInput."""
        from footfall.robot.description import RobotDescription

        self.require_athletes_build()
        return self.typed(RobotDescription, self.robot_digest)

    def require_athletes_build(self) -> None:
        """Raises InvalidInput where the session's robot is one that others described."""
        if (other := self.described) is not None:
            raise athletes_alone(other.name)

    @property
    def described(self) -> "DescribedRobot | None":
        """The session's robot where others described it; None where it is of ATHLETE's build."""
        from footfall.robot.legged.legged_model import DescribedRobot

        found = self.get(self.robot_digest)
        return found if isinstance(found, DescribedRobot) else None

    @property
    def robot(self) -> "Robot":
        """The robot's model, built when first asked for. Raises InvalidInput where it is not of ATHLETE's build."""
        return built_robot(self.description)

    @property
    def any_robot(self) -> "Robot | LeggedRobot":
        """As :attr:`robot`, whoever described it."""
        return built_robot(self.get(self.robot_digest))

    @property
    def reach(self) -> float:
        """How far from its origin the chassis is compared with where it was [m]: 1 m, or a shorter longest leg."""
        if self._reach is None:
            other = self.described
            if other is None:
                self._reach = 1.0
            else:
                from footfall.robot.legged.groups import longest_leg

                self._reach = min(1.0, longest_leg(other.model))
        return self._reach

    def difference(self, posture: Array, T_site_base: Array, now: RobotState) -> StandingDifference:
        """Of how the robot stands now from a posture (joints,) and a pose of its chassis (4, 4)."""
        layout = self.layout
        return difference(posture, T_site_base, now, layout.joint_names, self.reach, layout.sliding)

    @property
    def layout(self) -> "JointLayout":
        """The robot's legs and joints by name."""
        if self._layout is None:
            other = self.described
            self._layout = self.robot.layout if other is None else other.layout
        return self._layout

    @property
    def named_layout(self) -> "JointLayout | None":
        """As :attr:`layout`, of a robot whose telemetry goes by names; None where it is of ATHLETE's build."""
        return None if self.described is None else self.layout

    @property
    def state(self) -> SessionState:
        """What the log folds to."""
        return self.folded_log.state

    @property
    def jobs(self) -> list[Job]:
        """The session's jobs, newest last."""
        return self.product_jobs.jobs

    def events(self, since: int = 0) -> list[Event]:
        """Events with ``seq`` ≥ ``since``."""
        return self.folded_log.events(since)

    def listen(self, callback: Callable[[dict[str, Any]], None]) -> Callable[[], None]:
        """Hear of everything from now on; returns what ends it. See the class about what callbacks may do."""
        return self.folded_log.listen(callback)

    @property
    def unrecorded(self) -> int:
        """Events that the disk could not take yet."""
        return self.folded_log.unrecorded

    @property
    def only_looked_at(self) -> bool:
        """Whether nothing in it can be changed, and so nothing happens that could be heard."""
        return not self.store.writes

    @property
    def appended(self) -> tuple[int, float]:
        """How many events were written since the session was opened, and how long that took in all [s]."""
        return self.folded_log.appended

    def put(self, value: Value) -> str:
        """Store a value; returns its digest. Nothing refers to it yet."""
        return self.value_store.put(value)

    def get(self, digest: str) -> Value:
        """Raises NotFound; InvalidBundle where the stored file is damaged."""
        return self.value_store.get(digest)

    def typed(self, kind: type[_V], digest: str) -> _V:
        """As :meth:`get`, of a value that is a ``kind``. Raises InvalidInput where it is of another."""
        return self.value_store.typed(kind, digest)

    def has(self, digest: str) -> bool:
        """Whether a value of this name is stored."""
        return self.store.has(digest)

    def put_bytes(self, data: bytes, extension: str) -> str:
        """Store the content of a file that is no value, such as an export."""
        return self.store.put_bytes(data, extension)

    def get_bytes(self, digest: str) -> bytes:
        """Raises NotFound; InvalidBundle where the stored file is damaged."""
        return self.store.get_bytes(digest)

    def add_note(self, text: str) -> None:
        """Write something down. Raises InvalidInput for an empty or overlong note."""
        if not 0 < len(text.strip()) <= 10_000:
            raise InvalidInput("a note has 1 to 10 000 characters", length=len(text))
        self.folded_log.record("note", {"text": text.strip()})

    def rename(self, name: str) -> None:
        """Call the session otherwise from now on. Raises InvalidInput for a name that is none."""
        name = session_name(name)
        with self.folded_log.lock:
            if name != self.state.name:
                self.folded_log.record(RENAMED, {"name": name})

    def export_bundle(self) -> bytes:
        """The session so far, as a zip. Raises Conflict where artifacts are missing."""
        with self.folded_log.lock:
            return whole_zip(self.store.bundle())

    def require_leg(self, leg: int) -> None:
        """Raises InvalidInput where the rover has no such leg."""
        count = len(self.layout.legs)
        if type(leg) is not int or not 0 <= leg < count:
            raise InvalidInput(f"{self.state.robot_name} has legs 0…{count - 1}", leg=leg)

    def require_robot(self, state: RobotState) -> None:
        """Raises InvalidTelemetry where a state is of another robot."""
        legs = len(self.layout.legs)
        alike = state.described is None or state.described.digest == self.layout.digest
        alike = alike and (state.described is None) == (self.described is None)
        if state.robot == self.state.robot_name and state.leg_count == legs and not alike:
            raise InvalidTelemetry(
                f"this state of {state.robot} has other joints than the session's robot, or does not name them",
                fault="wrong-legs",
            )
        if state.robot != self.state.robot_name or state.leg_count != legs:
            raise InvalidTelemetry(
                f"this is a state of {state.robot} with {state.leg_count} legs; "
                f"the session is about {self.state.robot_name} with {legs}",
                robot=state.robot,
                fault="wrong-robot" if state.robot != self.state.robot_name else "wrong-legs",
            )


def present(digest: str | None, otherwise: str) -> str:
    """``digest`` where there is one; raises Conflict, saying ``otherwise``, where there is none."""
    if digest is None:
        raise Conflict(otherwise)
    return digest
