"""A recorded session read without opening it: what the command line takes out of bundles."""

from pathlib import Path
from typing import TypeVar

from footfall.core.errors import FootFallError, InvalidBundle, InvalidInput, NotFound
from footfall.core.value import Provenance, Value
from footfall.io.any_robot import load_robot
from footfall.io.artifacts import decode
from footfall.io.bundles import ARTIFACTS
from footfall.io.scripting import make_sequence
from footfall.io.terrain_files import read_terrain
from footfall.planning.answers import Status
from footfall.planning.execution.problem import ExecutionResult
from footfall.planning.gait.problem import GaitPlan, GaitResult
from footfall.planning.legged.problem import LeggedResult
from footfall.planning.route.problem import Route, RouteResult
from footfall.planning.step.problem import PlanResult
from footfall.planning.walk.problem import WalkResult
from footfall.planning.walk_execution.problem import WalkExecutionResult
from footfall.robot.description import RobotDescription
from footfall.robot.legged.legged_model import DescribedRobot
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.model import Robot
from footfall.sequence.commands import Sequence
from footfall.session.described_robots import athletes_alone
from footfall.session.log.event import event_of, loaded_world
from footfall.session.log.fold import fold_all
from footfall.session.storage.store import read_session
from footfall.telemetry.images import Snapshot
from footfall.terrain.dem import Dem

_V = TypeVar("_V", bound=Value)


class RecordedSession:
    """A session folder or zip. Raises InvalidBundle where it is none."""

    def __init__(self, path: Path) -> None:
        self.name = path.name
        self._files = (bundle := read_session(path)).files
        self.events = tuple(event_of(record) for record in bundle.records)
        self.state = fold_all(self.events)

    def get(self, digest: str | None, kind: type[_V], what: str) -> _V:
        """A value of the session. Raises NotFound where the session never had one."""
        if digest is None:
            raise NotFound(f"the session {self.name} has no {what}")
        file = f"{digest}.npz"
        if file not in self._files:
            raise InvalidBundle(f"{self.name} lacks {ARTIFACTS}/{file}, its {what}", file=file)
        value = decode(self._files[file](), expect=digest, name=f"{ARTIFACTS}/{file}")
        if not isinstance(value, kind):
            raise InvalidBundle(f"{ARTIFACTS}/{file} of {self.name} is a {type(value).__name__}, not its {what}")
        return value

    def typed(self, kind: type[_V], digest: str) -> _V:
        """A value of the session that is a ``kind``. Raises InvalidBundle."""
        return self.get(digest, kind, kind.__name__)

    def robot(self) -> Robot:
        """The robot that the session is about. Raises InvalidInput where others described it."""
        about = self.get(self.state.robot, Value, "robot")
        if isinstance(about, DescribedRobot):
            raise athletes_alone(about.name)
        return Robot(self.get(self.state.robot, RobotDescription, "robot"))

    def world(self) -> Dem:
        """The ground that its rover stands on: what was loaded first, or its map where nothing was."""
        return self.get(loaded_world(self.events) or self.state.dem, Dem, "terrain")

    def snapshot(self) -> Snapshot:
        """Its newest images."""
        return self.get(self.state.snapshot, Snapshot, "images")

    def sequence(self) -> Sequence:
        """Its sequence after the last edit."""
        return self.get(self.state.sequence, Sequence, "sequence")


def sequence_of(source: Path, robot: Path | None = None, terrain: Path | None = None) -> Sequence:
    """The sequence of a session, or the commands of a stored plan.

    robot, terrain: files that the plan of a robot that others described was made with; it needs both.
    """
    if source.suffix != ".npz":
        return RecordedSession(source).sequence()
    value = _read(source)
    if isinstance(value, Sequence):
        return value
    if isinstance(value, LeggedResult):
        return _of_legged(source.name, value, robot, terrain)
    if robot is not None or terrain is not None:
        raise InvalidInput(f"{source.name} is no plan of a robot of your own: leave out --robot and --terrain")
    if not isinstance(value, (PlanResult, WalkResult, GaitResult, ExecutionResult, WalkExecutionResult)):
        raise InvalidInput(f"{source.name} holds a {type(value).__name__}; give a plan, a sequence or a session")
    found = value.execution if isinstance(value, (ExecutionResult, WalkExecutionResult)) else value.plan
    if found is None or value.status is not Status.FOUND:
        raise InvalidInput(f"{source.name} holds a plan that was refused: {value.reason}")
    return make_sequence(found.walk if isinstance(found, GaitPlan) else found)


def _of_legged(name: str, result: LeggedResult, robot: Path | None, terrain: Path | None) -> Sequence:
    if result.plan is None:
        raise InvalidInput(f"{name} holds a plan that was refused: {result.reason}")
    if robot is None or terrain is None:
        raise InvalidInput(f"{name} is of {result.plan.start.robot}: give its --robot and --terrain")
    described, dem = load_robot(robot), read_terrain(terrain)
    _require_made_with(name, result.provenance, described, dem)
    return make_sequence(result.plan, described, dem)


def legged_walk_of(source: Path, robot: LeggedRobot, dem: Dem) -> LeggedResult:
    """The walk of a robot that others described, found or not, out of a file.

    Raises NotFound where there is no file, InvalidInput where it holds none, or one of another robot or terrain.
    """
    value = _read(source)
    if not isinstance(value, LeggedResult):
        raise InvalidInput(f"{source.name} holds a {type(value).__name__}, no walk of a robot of your own")
    _require_made_with(source.name, value.provenance, robot, dem)
    return value


def route_of(source: Path, robot: LeggedRobot, dem: Dem) -> Route:
    """The route of a robot that others described, out of a file.

    Raises NotFound where there is no file, InvalidInput where it holds none, or one of another robot or terrain.
    """
    value = _read(source)
    if not isinstance(value, RouteResult):
        raise InvalidInput(f"{source.name} holds a {type(value).__name__}, not what `footfall plan route --out` writes")
    if value.plan is None:
        raise InvalidInput(f"{source.name} holds no route: {value.reason}")
    _require_made_with(source.name, value.provenance, robot, dem)
    return value.plan


def _read(source: Path) -> Value:
    if not source.is_file():
        raise NotFound(f"there is no file {source}")
    try:
        return decode(source.read_bytes(), name=source.name)
    except FootFallError as error:
        raise InvalidInput(f"{source.name} holds no plan of FootFall: {error.message}") from error


def _require_made_with(name: str, planned: Provenance, robot: Robot | LeggedRobot, dem: Dem) -> None:
    terrain = planned.parents["terrain" if "terrain" in planned.parents else "dem"]
    for what, made_with, given in (("robot", planned.parents["robot"], robot), ("terrain", terrain, dem)):
        if given.digest != made_with:
            reason = f"{name} was planned with another {what}: give that one, or plan it anew with this one"
            raise InvalidInput(reason, planned_with=made_with, given=given.digest)
