"""How each kind of product is made from its parents: what live jobs and replays share.

A recipe is a pure function ``(parents, settings, progress) -> Value | bytes``. ``parents`` are values by
name; the parent called ``robot`` comes as a built robot, of ATHLETE's build or one that others described. The numeric
libraries load inside of the recipes: the server process names kinds without paying for them.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from importlib import import_module
from typing import Any

from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, part, preview_of
from footfall.core.value import Value
from footfall.planning.answers import Status
from footfall.planning.execution.execution_settings import MODES
from footfall.session.jobs.requests import (
    BodyMoveRequest,
    ExecutionRequest,
    ExportRequest,
    FootMovesRequest,
    GaitRequest,
    ImportRequest,
    MapRequest,
    OutcomeRequest,
    RouteRequest,
    ShiftRequest,
    StepRequest,
    WalkRequest,
)
from footfall.session.products.kinds import KINDS

Recipe = Callable[[Mapping[str, Any], Any, Progress], Value | bytes]


def terrain(parents: Mapping[str, Any], settings: Any, progress: Progress) -> Value:
    """robot, snapshot and, where there is one, the map to merge into; TerrainSettings → Dem."""
    from footfall.terrain.build import build_terrain

    return build_terrain(parents["robot"], parents["snapshot"], settings, progress=progress, map=parents.get("map"))


def photographs(parents: Mapping[str, Any], settings: Any, progress: Progress) -> Value:
    """photographs and, where their rover is to be taken out, robot and state; TerrainSettings → Dem."""
    from footfall.terrain.photographs import terrain_from_photographs

    robot, state = parents.get("robot"), parents.get("state")
    return terrain_from_photographs(parents["photographs"], settings, progress, robot, state)


def blend(parents: Mapping[str, Any], settings: Any, progress: Progress) -> Value:
    """dem and the external one that goes under it; BlendSettings → Dem."""
    from footfall.terrain.fusion.blend import blend

    progress(0.0, "laying the terrain under the map")
    return blend(parents["dem"], parents["external"], settings)


def clear(parents: Mapping[str, Any], settings: Any, progress: Progress) -> Value:
    """dem; Area → Dem without it."""
    from footfall.terrain.fusion.clear import clear

    return clear(parents["dem"], settings)


def maps(parents: Mapping[str, Any], settings: MapRequest, progress: Progress) -> Value:
    """robot, dem, state; MapRequest → MapStack."""
    from footfall.planning.step.leg_maps import compute_maps

    robot, dem, state = (parents[name] for name in ("robot", "dem", "state"))
    preview = preview_of(progress)
    return compute_maps(robot, dem, state, settings.leg, settings.settings, progress=progress, preview=preview)


def plan(parents: Mapping[str, Any], settings: StepRequest, progress: Progress) -> Value:
    """robot, dem, state; StepRequest → PlanResult."""
    from footfall.planning.step.plan import plan_step

    robot, dem, state = (parents[name] for name in ("robot", "dem", "state"))
    chosen = settings.footfall
    return plan_step(
        robot,
        dem,
        state,
        chosen.leg,
        (chosen.x, chosen.y),
        settings=settings.settings,
        progress=progress,
        through=settings.through,
        explain=settings.explain,
        instead=settings.instead,
    )


def after(parents: Mapping[str, Any], settings: None, progress: Progress) -> Value:
    """robot, dem, state that it starts from, and a plan (a result that has one), execution or sequence.

    Makes a PredictedState.
    """
    from footfall.planning.body.after import state_after

    robot, dem, state = (parents[name] for name in ("robot", "dem", "state"))
    sequence = parents.get("sequence")
    if "execution" in parents:
        done = _execution_of(parents["execution"])
        return state_after(robot, dem, state, done.predicted[-1], done.Ts_site_base[-1], parents["execution"].digest)
    if sequence is None:
        motion = _plan_of(parents["plan"]).motion
        end = motion.waypoints[-1], motion.Ts_site_base[-1]
        return state_after(robot, dem, state, *end, parents["plan"].digest)
    if not sequence.commands:
        raise InvalidInput("the sequence has no commands, so nothing comes after it")
    return state_after(robot, dem, state, sequence.predicted[-1], sequence.poses[-1], sequence.digest)


def what_if(parents: Mapping[str, Any], settings: Any, progress: Progress) -> Value:
    """robot, dem, state; BodyShift → PredictedState. Raises InvalidInput where the feet can't stay where they are."""
    from footfall.planning.body.body_shift import ShiftRefused
    from footfall.planning.body.shift import shifted_state

    found = shifted_state(parents["robot"], parents["dem"], parents["state"], settings)
    if isinstance(found, ShiftRefused):
        raise InvalidInput(found.reason, leg=found.leg, joint=found.joint, excess=found.excess)
    return found


def execution(parents: Mapping[str, Any], settings: ExecutionRequest, progress: Progress) -> Value:
    """robot, dem, state, plan (a PlanResult with a plan); ExecutionRequest → ExecutionResult."""
    from footfall.planning.execution.plan import plan_execution

    robot, dem, state = (parents[name] for name in ("robot", "dem", "state"))
    step = _plan_of(parents["plan"])
    return plan_execution(robot, dem, state, step, settings.settings, settings.set_points, progress)


def held_move(parents: Mapping[str, Any], settings: ExecutionRequest, progress: Progress) -> Value:
    """robot, dem, state, plan (a result that has a move of the chassis); ExecutionRequest → BodyExecutionResult."""
    from footfall.planning.execution.body_plan import plan_body_execution

    robot, dem, state = (parents[name] for name in ("robot", "dem", "state"))
    move = _plan_of(parents["plan"])
    return plan_body_execution(robot, dem, state, move, settings.settings, settings.set_points, progress)


def queue(parents: Mapping[str, Any], settings: None, progress: Progress) -> Value:
    """robot, dem, state that it starts from, plan (a result of a step, move or shift) and, where there is one, the
    queue so far → QueueResult.
    """
    from footfall.planning.queue.join import queued

    robot, dem, state = (parents[name] for name in ("robot", "dem", "state"))
    before = _plan_of(parents["queue"]) if "queue" in parents else None
    return queued(robot, dem, state, parents["plan"], before)


def held_queue(parents: Mapping[str, Any], settings: ExecutionRequest, progress: Progress) -> Value:
    """robot, dem, state, plan (a QueueResult); ExecutionRequest → WalkExecutionResult."""
    from footfall.planning.walk_execution.queue_plan import plan_queue_execution

    robot, dem, state = (parents[name] for name in ("robot", "dem", "state"))
    queue = _plan_of(parents["plan"])
    return plan_queue_execution(robot, dem, state, queue, settings.settings, settings.set_points, progress)


def shift(parents: Mapping[str, Any], settings: ShiftRequest, progress: Progress) -> Value:
    """robot, dem, state; ShiftRequest → ShiftResult."""
    from footfall.planning.body.find_shift import find_shift

    robot, dem, state = (parents[name] for name in ("robot", "dem", "state"))
    chosen = settings.footfall
    return find_shift(robot, dem, state, chosen.leg, (chosen.x, chosen.y), settings.settings, progress)


def body_move(parents: Mapping[str, Any], settings: BodyMoveRequest, progress: Progress) -> Value:
    """robot, dem, state; BodyMoveRequest → BodyMoveResult."""
    from footfall.planning.body.body_move import plan_body_move

    robot, dem, state = (parents[name] for name in ("robot", "dem", "state"))
    return plan_body_move(robot, dem, state, settings.shift, settings.settings, progress)


def walk(parents: Mapping[str, Any], settings: WalkRequest, progress: Progress) -> Value:
    """robot, dem, state; WalkRequest → WalkResult."""
    from footfall.planning.walk.plan import plan_walk
    from footfall.planning.walk_execution.unpressed import unpressed

    robot, dem, state = (parents[name] for name in ("robot", "dem", "state"))
    if settings.unpressed:
        state = unpressed(robot, state)
    goal, tether = settings.goal, settings.tether
    if settings.gait is not None:
        from footfall.planning.gait.as_walk import plan_wave

        return plan_wave(robot, dem, state, goal, settings.gait, settings.settings, progress)
    return plan_walk(robot, dem, state, goal, settings=settings.settings, progress=progress, tether=tether)


def gait(parents: Mapping[str, Any], settings: GaitRequest, progress: Progress) -> Value:
    """robot, dem, state; GaitRequest → GaitResult."""
    from footfall.planning.gait.plan import plan_gait
    from footfall.planning.walk_execution.unpressed import unpressed

    robot, dem, state = (parents[name] for name in ("robot", "dem", "state"))
    if settings.unpressed:
        state = unpressed(robot, state)
    return plan_gait(robot, dem, state, settings.goal, settings=settings.settings, progress=progress)


def route(parents: Mapping[str, Any], settings: RouteRequest, progress: Progress) -> Value:
    """robot, dem, state; RouteRequest → RouteResult."""
    from footfall.robot.legged.legged_robot import LeggedRobot
    from footfall.session.jobs.latest_ground import LATEST_GROUND

    robot, dem, state = (parents[name] for name in ("robot", "dem", "state"))
    look, fit = LATEST_GROUND.look, LATEST_GROUND.fit
    if isinstance(robot, LeggedRobot):
        from footfall.planning.legged.route_to import plan_route as plan_legged_route

        return plan_legged_route(robot, dem, state, settings.goal, settings.settings, progress, fit)
    from footfall.planning.route.plan import plan_route

    return plan_route(robot, dem, state, settings.goal, settings.settings, progress, look, fit)


def sequence(parents: Mapping[str, Any], settings: None, progress: Progress) -> Value:
    """robot, dem, plan (a result that has one: step, chassis move, shift, queue or walk) or execution → Sequence."""
    from footfall.planning.legged.problem import LeggedResult
    from footfall.sequence.make import make_sequence
    from footfall.sequence.of_legged import make_legged_sequence

    if isinstance(parents.get("plan"), LeggedResult):
        return make_legged_sequence(_plan_of(parents["plan"]), parents["robot"], parents["dem"])
    chosen = _execution_of(parents["execution"]) if "execution" in parents else _plan_of(parents["plan"])
    return make_sequence(chosen, parents["robot"], parents["dem"])


def foot_moves(parents: Mapping[str, Any], settings: FootMovesRequest, progress: Progress) -> Value:
    """robot, dem, state that they start from, plan (a WalkResult with a plan); FootMovesRequest → Sequence."""
    from footfall.planning.walk.excerpt import excerpt
    from footfall.planning.walk_execution.plan import plan_walk_execution
    from footfall.sequence.make import make_sequence

    robot, dem, state = (parents[name] for name in ("robot", "dem", "state"))
    walk, first, count = _plan_of(parents["plan"]), settings.first, settings.count
    if settings.settings is None:
        return make_sequence(excerpt(walk, first, count, state), robot, dem)
    found = plan_walk_execution(
        robot, dem, state, walk, settings.settings, settings.set_points, first, count, part(progress, 0.0, 0.5)
    )
    if found.execution is None or found.status is not Status.FOUND:
        mode = MODES[settings.settings.mode][0]
        raise InvalidInput(
            f"the walk can't be commanded {mode}: {found.reason}; or ask for fewer foot moves, for another mode, "
            "or for commands as planned: the rover then sags, and where feet touch down is not predicted",
            status=found.status.value,
            mode=settings.settings.mode,
            failed_at=found.failed_at,
            fails=[check.name for check in found.checks if not check.holds],
        )
    return make_sequence(found.execution, robot, dem)


def outcome(parents: Mapping[str, Any], settings: OutcomeRequest, progress: Progress) -> Value:
    """robot, dem, sequence, state at rest after a run of it; OutcomeRequest → Outcome."""
    from footfall.robot.legged.legged_robot import LeggedRobot
    from footfall.sequence.foretold import outcome
    from footfall.sequence.legged_foretold import legged_outcome

    robot, dem, sent, state = (parents[name] for name in ("robot", "dem", "sequence", "state"))
    ran = sent, state, settings.set_points, settings.run, settings.rows
    return legged_outcome(robot, dem, *ran) if isinstance(robot, LeggedRobot) else outcome(robot, dem, *ran)


def _plan_of(result: Any) -> Any:
    if result.plan is None:
        raise InvalidInput(f"there is no plan to make commands of: {result.reason}", status=result.status.value)
    return result.plan


def _execution_of(result: Any) -> Any:
    # one that fails a check is there to be looked at
    if result.execution is None or result.status is not Status.FOUND:
        raise InvalidInput(f"there is no execution to make commands of: {result.reason}", status=result.status.value)
    return result.execution


def edit(parents: Mapping[str, Any], settings: Any, progress: Progress) -> Value:
    """robot, sequence, dem, of a robot that others described the state that it began from; Edit → Sequence."""
    from footfall.robot.legged.legged_robot import LeggedRobot
    from footfall.sequence.edit import apply_edit
    from footfall.session.jobs.described_recipes import from_feet, on_map

    if isinstance(robot := parents["robot"], LeggedRobot):
        _, ground, _ = from_feet(parents)
        return on_map(apply_edit(robot, parents["sequence"], settings, ground), ground, parents)
    return apply_edit(robot, parents["sequence"], settings, parents["dem"])


def from_file(parents: Mapping[str, Any], settings: ImportRequest, progress: Progress) -> Value:
    """robot, dem, and state for files that don't say from where they start; ImportRequest → Sequence."""
    from footfall.io.imports import sequence_of
    from footfall.robot.legged.legged_robot import LeggedRobot
    from footfall.sequence.commands import AtRest
    from footfall.session.jobs.described_recipes import from_feet, on_map

    robot, dem, state = (parents[name] for name in ("robot", "dem", "state"))
    name, content = settings.name, settings.content.tobytes()
    if isinstance(robot, LeggedRobot):
        _, ground, start = from_feet(parents)
        return on_map(sequence_of(name, content, robot, ground, otherwise=start), ground, parents)
    start = state if settings.set_points is None else AtRest(state, settings.set_points)
    return sequence_of(name, content, robot, dem, otherwise=start)


def export(parents: Mapping[str, Any], settings: ExportRequest, progress: Progress) -> bytes:
    """sequence; ExportRequest → the bytes of the file."""
    from footfall.io.exports import export as write

    return write(parents["sequence"], settings.format, first_row=settings.first_row)


class _Products(Mapping[str, Recipe]):
    """The recipe of every kind in the table, found when it is first asked for."""

    def __getitem__(self, name: str) -> Recipe:
        module, _, function = KINDS[name].recipe.partition(":")
        return getattr(import_module(module), function)

    def __iter__(self) -> Iterator[str]:
        return iter(KINDS)

    def __len__(self) -> int:
        return len(KINDS)


PRODUCTS: Mapping[str, Recipe] = _Products()


def make(
    recipes: Mapping[str, Recipe], kind: str, parents: Mapping[str, Value], settings: Value | None, progress: Progress
) -> Value | bytes:
    """One product, from stored values. Raises InvalidInput for an unknown kind, and what the recipe raises."""
    if kind not in recipes:
        raise InvalidInput(f"there is no recipe for {kind!r}; there are {', '.join(recipes)}", kind=kind)
    given = {name: built_robot(value) if name == "robot" else value for name, value in parents.items()}
    return recipes[kind](given, settings, progress)


def built_robot(description: Value) -> Any:
    """The model of a robot description, built once for each content."""
    return _built(_ByDigest(description))


class _ByDigest:
    """A key that compares values by content."""

    def __init__(self, value: Value) -> None:
        self.value = value

    def __hash__(self) -> int:
        return hash(self.value.digest)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _ByDigest) and other.value.digest == self.value.digest


@lru_cache(maxsize=4)
def _built(key: _ByDigest) -> Any:
    from footfall.robot.legged.legged_model import DescribedRobot

    about = key.value
    if isinstance(about, DescribedRobot):
        from footfall.robot.legged.legged_robot import LeggedRobot

        return LeggedRobot.of(about)
    from footfall.robot.model import Robot

    return Robot(about)  # type: ignore[arg-type]
