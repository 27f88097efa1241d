"""What a page that plays a session without a server has to know, as plain JSON."""

import base64
from collections.abc import Mapping, Sequence
from typing import Protocol, TypedDict, TypeVar

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import FootFallError
from footfall.core.value import SOFTWARE_VERSION, Value
from footfall.io.map_files import layer_png
from footfall.maps.colors import layer_legend
from footfall.maps.layers import LAYERS, MapStack
from footfall.planning.step.problem import PlanResult, StepPlan
from footfall.robot.model import Robot
from footfall.sequence.commands import Sequence as Commands
from footfall.sequence.moved_legs import moved_legs
from footfall.session.answers.plans import PlanFigures
from footfall.session.log.event import Event
from footfall.session.log.fold import fold_all
from footfall.session.products.judged_footfall import decisive
from footfall.session.products.kinds import MAPS, PLAN
from footfall.session.products.plan_figures import plan_figures, swing
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

_V = TypeVar("_V", bound=Value)


class Get(Protocol):
    """A value of the session by its digest, which is a ``kind``. Raises FootFallError where it is another, or none."""

    def __call__(self, kind: type[_V], digest: str, /) -> _V: ...


class PlanChecked(TypedDict):
    """One check of a plan."""

    name: str
    holds: bool
    margin: float
    unit: str
    where: str


class StorySwing(TypedDict):
    """The wheel's way; along: how far it has gone over ground [m]; ground: height under it, site [m]."""

    centers: NDArray[np.float64]
    share: NDArray[np.float64]
    along: NDArray[np.float64]
    ground: NDArray[np.float64]


class StoryPlan(TypedDict):
    """A planned step. map: digest of the picture that it is shown over."""

    seq: int
    leg: int
    footfall: list[float]
    status: str
    reason: str
    checks: list[PlanChecked]
    figures: PlanFigures | None
    swing: StorySwing | None
    map: str | None


class StoryLegendEntry(TypedDict):
    """What a colour of a map says."""

    text: str
    rgb: list[int]


class StoryMap(TypedDict):
    """Maps of a leg as a picture."""

    digest: str
    title: str
    bounds: list[float]
    legend: list[StoryLegendEntry]
    png: str


class StoryRow(TypedDict):
    """One row of the commands; leg: that it is about, the one that steps where all joints move."""

    name: str
    leg: int | None
    phase: str
    duration: float


class StoryCommands(TypedDict):
    """The commands after the last edit."""

    digest: str
    valid: bool
    duration: float
    rows: list[StoryRow]


class StoryEvent(TypedDict):
    """One event for a person."""

    seq: int
    time: float
    text: str


class StoryCommand(TypedDict):
    """How far one row came that was sent."""

    row: int
    run: int
    state: str
    reason: str


class Story(TypedDict):
    """All that the page shows."""

    name: str
    robot: str
    software: str
    wheel_radius: float
    events: list[StoryEvent]
    plans: list[StoryPlan]
    maps: dict[str, StoryMap]
    sequence: StoryCommands | None
    commands: list[StoryCommand]


def page_story(events: Sequence[Event], get: Get, robot: Robot) -> Story:
    """See the module's docstring. events: all of the session; get: its values by digest."""
    state = fold_all(events)
    rows = {e.payload["id"]: e.payload["row"] for e in events if e.type == "command_sent"}
    plans: list[StoryPlan] = []
    maps: dict[str, StoryMap] = {}
    for event in events:
        if event.type == "product" and event.payload["kind"] == PLAN.name:
            plan = _plan(event, get, robot)
            picture = _map_of(plan["leg"], event, events, get)
            if picture is not None:
                maps[picture["digest"]] = picture
                plan["map"] = picture["digest"]
            plans.append(plan)
    return {
        "name": state.name,
        "robot": state.robot_name,
        "software": SOFTWARE_VERSION,
        "wheel_radius": robot.wheel_radius,
        "events": [{"seq": e.seq, "time": e.time, "text": _words(e, rows)} for e in events],
        "plans": plans,
        "maps": maps,
        "sequence": None if state.sequence is None else _sequence(get(Commands, state.sequence)),
        "commands": [
            {"row": c.row, "run": c.run, "state": _STATES.get(c.state, c.state), "reason": c.reason}
            for c in state.commands
            if c.run == state.runs and c.sequence == state.sequence
        ],
    }


_STATES = {"sent": "released", "received": "acknowledged", "refused": "failed"}
"""States of a command as operators call them."""


def _words(event: Event, rows: Mapping[str, int]) -> str:
    """The event for a person; digests are for machines. rows: of the commands, by their ids."""
    payload = event.payload
    state = event.type.removeprefix("command_")
    if state != event.type and payload.get("id") in rows:
        reason = f": {payload['reason']}" if payload.get("reason") else ""
        return f"row {rows[payload['id']] + 1} {_STATES.get(state, state)}{reason}"
    values = [payload.get(name) for name in ("kind", "status", "text", "name", "format", "state", "reason")]
    words = [text for text in values if isinstance(text, str) and text and not _is_digest(text)]
    for name, first in (("leg", 0), ("row", 1)):
        if isinstance(payload.get(name), int):
            words.append(f"{name} {payload[name] + first}")
    named = [] if event.type == "product" else [event.type]
    return ", ".join(word.replace("_", " ") for word in [*named, *dict.fromkeys(words)])


def _is_digest(text: str) -> bool:
    return len(text) == 32 and all(letter in "0123456789abcdef" for letter in text)


def _plan(event: Event, get: Get, robot: Robot) -> StoryPlan:
    result = get(PlanResult, event.payload["digest"])
    shown: StoryPlan = {
        "seq": event.seq,
        "leg": result.footfall.leg,
        "footfall": [result.footfall.x, result.footfall.y],
        "status": result.status.value,
        "reason": result.reason,
        "checks": [
            {"name": c.name, "holds": c.holds, "margin": c.margin, "unit": c.unit, "where": c.where}
            for c in result.checks
        ],
        "figures": plan_figures(robot, result),
        "swing": None,
        "map": None,
    }
    if result.plan is not None:
        shown["swing"] = _swing(robot, result.plan, get(Dem, event.payload["parents"]["dem"]))
    return shown


def _swing(robot: Robot, plan: StepPlan, dem: Dem) -> StorySwing:
    """The wheel's way; along: how far it has gone over ground [m]; ground: height under it, site [m]."""
    centers, share = swing(robot, plan)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(centers[:, :2], axis=0), axis=1))])
    return {
        "centers": centers,
        "share": share,
        "along": along,
        "ground": height_at(dem, centers[:, 0], centers[:, 1]),
    }


def _map_of(leg: int, plan: Event, events: Sequence[Event], get: Get) -> StoryMap | None:
    """The latest maps of the leg on the ground that was planned on, as a picture; None where there are none."""
    dem = plan.payload["parents"]["dem"]
    made = [
        e.payload["digest"]
        for e in events[: plan.seq]
        if e.type == "product" and e.payload["kind"] == MAPS.name and e.payload["leg"] == leg
        if e.payload["parents"]["dem"] == dem
    ]
    if not made:
        return None
    try:
        stack = get(MapStack, made[-1])
    except FootFallError:
        return None  # a session may be shown without its pictures
    layer = next(name for name, cells in stack.layers.items() if cells is decisive(stack))
    return {
        "digest": made[-1],
        "title": LAYERS[layer].title,
        "bounds": list(stack.geometry.bounds),
        "legend": [{"text": text, "rgb": list(rgb)} for text, rgb in layer_legend(stack, layer)],
        "png": base64.b64encode(layer_png(stack, layer)).decode(),
    }


def _sequence(sequence: Commands) -> StoryCommands:
    rows: list[StoryRow] = [
        {"name": c.name, "leg": leg, "phase": c.phase, "duration": c.duration}
        for c, leg in zip(sequence.commands, moved_legs(sequence), strict=True)
    ]
    return {"digest": sequence.digest, "valid": sequence.valid, "duration": sequence.duration, "rows": rows}
