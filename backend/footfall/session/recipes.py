"""How each kind of product is made from its parents: the one list that live jobs and replays share.

A recipe is a pure function ``(parents, settings, progress) -> Value | bytes``. ``parents`` are values by
name; the parent called ``robot`` comes as a built :class:`~footfall.robot.model.Robot`. The numeric
libraries load inside of the recipes: the server process names kinds without paying for them.
"""

from collections.abc import Callable, Mapping
from functools import lru_cache
from importlib import import_module
from typing import Any

from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, preview_of
from footfall.core.value import Value
from footfall.session.requests import BodyMoveRequest, ExportRequest, MapRequest, ShiftRequest, StepRequest

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
    from footfall.terrain.blend import blend

    progress(0.0, "laying the terrain under the map")
    return blend(parents["dem"], parents["external"], settings)


def clear(parents: Mapping[str, Any], settings: Any, progress: Progress) -> Value:
    """dem; Area → Dem without it."""
    from footfall.terrain.clear import clear

    return clear(parents["dem"], settings)


def maps(parents: Mapping[str, Any], settings: MapRequest, progress: Progress) -> Value:
    """robot, dem, state; MapRequest → MapStack."""
    from footfall.maps.stack import compute_maps

    robot, dem, state = (parents[name] for name in ("robot", "dem", "state"))
    preview = preview_of(progress)
    return compute_maps(robot, dem, state, settings.leg, settings.settings, progress=progress, preview=preview)


def plan(parents: Mapping[str, Any], settings: StepRequest, progress: Progress) -> Value:
    """robot, dem, state; StepRequest → PlanResult."""
    from footfall.planning.step.plan import plan_step

    robot, dem, state = (parents[name] for name in ("robot", "dem", "state"))
    chosen, how = settings.footfall, settings.settings
    target = (chosen.x, chosen.y)
    return plan_step(
        robot, dem, state, chosen.leg, target, planner=how.planner, seed=how.seed, settings=how, progress=progress
    )


def what_if(parents: Mapping[str, Any], settings: Any, progress: Progress) -> Value:
    """robot, dem, state; BodyShift → PredictedState. Raises InvalidInput where the feet can't stay where they are."""
    from footfall.planning.stance.shift import ShiftRefused, shifted_state

    found = shifted_state(parents["robot"], parents["dem"], parents["state"], settings)
    if isinstance(found, ShiftRefused):
        raise InvalidInput(found.reason, leg=found.leg, joint=found.joint, excess=found.excess)
    return found


def shift(parents: Mapping[str, Any], settings: ShiftRequest, progress: Progress) -> Value:
    """robot, dem, state; ShiftRequest → ShiftResult."""
    from footfall.planning.stance.find_shift import find_shift

    robot, dem, state = (parents[name] for name in ("robot", "dem", "state"))
    chosen = settings.footfall
    return find_shift(robot, dem, state, chosen.leg, (chosen.x, chosen.y), settings.settings, progress)


def body_move(parents: Mapping[str, Any], settings: BodyMoveRequest, progress: Progress) -> Value:
    """robot, dem, state; BodyMoveRequest → BodyMoveResult."""
    from footfall.planning.stance.body_move import plan_body_move

    robot, dem, state = (parents[name] for name in ("robot", "dem", "state"))
    return plan_body_move(robot, dem, state, settings.shift, settings.settings, progress)


def sequence(parents: Mapping[str, Any], settings: None, progress: Progress) -> Value:
    """robot, plan (a PlanResult with a plan), dem → Sequence."""
    from footfall.sequence.make import make_sequence

    result = parents["plan"]
    if result.plan is None:
        raise InvalidInput(f"there is no plan to make commands of: {result.reason}", status=result.status.value)
    return make_sequence(result.plan, parents["robot"], parents["dem"])


def edit(parents: Mapping[str, Any], settings: Any, progress: Progress) -> Value:
    """robot, sequence, dem; Edit → Sequence."""
    from footfall.sequence.edit import apply_edit

    return apply_edit(parents["robot"], parents["sequence"], settings, parents["dem"])


def export(parents: Mapping[str, Any], settings: ExportRequest, progress: Progress) -> bytes:
    """sequence; ExportRequest → the bytes of the file."""
    from footfall.io.exports import export as write

    return write(parents["sequence"], settings.format)


RECIPES: Mapping[str, Recipe] = {
    "terrain": terrain,
    "photographs": photographs,
    "blend": blend,
    "clear": clear,
    "maps": maps,
    "plan": plan,
    "what_if": what_if,
    "shift": shift,
    "body_move": body_move,
    "sequence": sequence,
    "edit": edit,
    "export": export,
}


def preload() -> None:
    """Import what the recipes need, before the first job waits for it."""
    for module in (
        "footfall.terrain.photographs",
        "footfall.terrain.blend",
        "footfall.terrain.clear",
        "footfall.maps.stack",
        "footfall.planning.step.plan",
        "footfall.planning.stance.find_shift",
        "footfall.sequence.edit",
        "footfall.io.exports",
    ):
        import_module(module)


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
    from footfall.robot.model import Robot

    return Robot(key.value)  # type: ignore[arg-type]
