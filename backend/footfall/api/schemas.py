"""What requests may contain. Strict: no unknown members, no booleans or texts where numbers belong, no NaN."""

from collections.abc import Mapping
from dataclasses import MISSING, fields
from functools import cache
from types import UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from annotated_types import Len
from pydantic import BaseModel, ConfigDict, Field, Strict, create_model

from footfall.core.value import Value
from footfall.maps.layers import MapSettings
from footfall.maps.quality_settings import QualitySettings
from footfall.planning.stance.find_problem import FindShiftSettings
from footfall.planning.stance.move import BodyMoveSettings
from footfall.planning.stance.shift import BodyShift
from footfall.planning.step.problem import StepSettings
from footfall.sequence.commands import COMMAND_NAMES
from footfall.sequence.edit import EDIT_KINDS
from footfall.terrain.clear import Area
from footfall.terrain.settings import BlendSettings, TerrainSettings

_V = TypeVar("_V", bound=Value)

LONGEST_TEXT = 2000

Vector2 = Annotated[list[float], Len(2, 2)]
Vector3 = Annotated[list[float], Len(3, 3)]
Matrix4 = Annotated[list[Annotated[list[float], Len(4, 4)]], Len(4, 4)]
Name = Annotated[str, Field(min_length=1, max_length=100)]
Text = Annotated[str, Field(max_length=LONGEST_TEXT)]
Leg = Annotated[int, Field(ge=0, le=63)]


class Strictly(BaseModel):
    """Base of every request."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)


def _examples(*examples: dict[str, Any]) -> ConfigDict:
    return ConfigDict(json_schema_extra={"examples": list(examples)})


@cache
def settings_model(settings: type[Value]) -> type[Strictly]:
    """A request model with the fields, types and defaults of a settings value, which stays their only source.

    A field that is a settings value itself becomes a model of its own.
    """
    hints = get_type_hints(settings)
    members: dict[str, Any] = {}
    for f in fields(settings):  # type: ignore[arg-type]
        hint = hints[f.name]
        default = ... if f.default is MISSING else f.default
        if isinstance(f.default, Value):
            default = Field(default_factory=settings_model(hint))
        elif f.default_factory is not MISSING:
            default = Field(default_factory=f.default_factory)
        members[f.name] = (_accepting_lists(hint), default)
    doc = (settings.__doc__ or "").strip()
    return create_model(settings.__name__, __base__=Strictly, __doc__=doc, **members)


def _accepting_lists(hint: Any) -> Any:
    if isinstance(hint, type) and issubclass(hint, Value):
        return settings_model(hint)
    # JSON has no arrays of numpy
    if get_origin(hint) is np.ndarray:
        return list[float]
    # JSON has no tuples; only the container is relaxed, its numbers stay strict
    if get_origin(hint) is tuple:
        return Annotated[hint, Strict(False)]
    if get_origin(hint) is Mapping:
        name, one = get_args(hint)
        return dict[name, _accepting_lists(one)]
    if get_origin(hint) in (Union, UnionType):
        return Union[tuple(_accepting_lists(one) for one in get_args(hint))]  # noqa: UP007
    return hint


def settings_value(settings: type[_V], given: BaseModel | None) -> _V | None:
    """The settings value that a request holds, or None where it holds none. Raises what the value's check does."""
    if given is None:
        return None
    hints = get_type_hints(settings)
    members: dict[str, Any] = {}
    for name in type(given).model_fields:
        member = getattr(given, name)
        if isinstance(member, BaseModel):
            member = settings_value(hints[name], member)
        elif isinstance(member, list):
            member = np.array(member, np.float64) if _holds_array(hints[name]) else tuple(member)
        members[name] = member
    return settings(**members)


def _holds_array(hint: Any) -> bool:
    return get_origin(hint) is np.ndarray or any(_holds_array(one) for one in get_args(hint))


StepSettingsModel = settings_model(StepSettings)
MapSettingsModel = settings_model(MapSettings)
TerrainSettingsModel = settings_model(TerrainSettings)
QualitySettingsModel = settings_model(QualitySettings)
FindShiftSettingsModel = settings_model(FindShiftSettings)
BodyMoveSettingsModel = settings_model(BodyMoveSettings)
BodyShiftModel = settings_model(BodyShift)
BlendSettingsModel = settings_model(BlendSettings)


class NewSession(Strictly):
    """``sample`` opens a copy of a sample session, ``name`` starts an empty one, ``session`` (id) opens an old one."""

    model_config = _examples({"sample": "rock-step"}, {"name": "morning drive"})
    sample: Name | None = None
    name: Name | None = None
    session: Name | None = None


class StateReport(Strictly):
    """One state of the rover, from a script instead of the rover link; SI units, radians, site frame."""

    time: float = Field(description="rover clock, seconds since 1970-01-01 UTC")
    posture: list[float] = Field(description="joint angles [rad], six for each leg", max_length=384)
    T_site_base: Matrix4 = Field(description="pose of the chassis")
    wheel_forces: list[Vector3] = Field(description="force of the ground on each wheel [N]", max_length=64)
    joint_torques: list[float] = Field(description="[N·m], six for each leg", max_length=384)
    mode: Name = "idle"


class Stand(Strictly):
    """Where to stand the robot on the current terrain."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    posture: Name = "stand"


class FreezeState(Strictly):
    """Empty: freeze what the rover last said. ``stand``: compute a stance on the current terrain instead."""

    model_config = _examples({}, {"stand": {"x": 0.0, "y": 0.0, "yaw": 0.0}})
    stand: Stand | None = None


class ImageRequest(Strictly):
    """Which camera pairs; null for all."""

    model_config = _examples({"pairs": None}, {"pairs": ["chassis_0"]})
    pairs: Annotated[list[Name], Len(1, 64)] | None = None


class CameraModel(Strictly):
    """Pinhole camera without distortion, OpenCV axes."""

    width: Annotated[int, Field(ge=1, le=8192)]
    height: Annotated[int, Field(ge=1, le=8192)]
    fx: float
    fy: float
    cx: float
    cy: float
    T_base_camera: Matrix4


class Calibration(Strictly):
    """Both cameras of an uploaded rectified pair; the pose defaults to that of the session's state."""

    name: Name = "uploaded"
    camera_left: CameraModel
    camera_right: CameraModel
    T_site_base: Matrix4 | None = None


class PhotographOptions(Strictly):
    """How uploaded pairs become a terrain. cameras: only these pairs; with_rover: the rover's own cameras took them."""

    model_config = _examples({"settings": {"matcher": "3way"}, "cameras": ["front"]}, {"with_rover": True})
    settings: TerrainSettingsModel | None = None  # type: ignore[valid-type]
    cameras: Annotated[list[Name], Len(1, 64)] | None = None
    with_rover: bool = False


class BuildTerrain(Strictly):
    """Rebuild the ground from the session's images."""

    model_config = _examples({"source": "images", "settings": {}})
    source: Annotated[str, Field(pattern="^images$")] = "images"
    settings: TerrainSettingsModel | None = None  # type: ignore[valid-type]


class ClearTerrain(Strictly):
    """A disc or a polygon, site frame [m]."""

    model_config = _examples({"center": [1.0, 0.5], "radius": 0.4})
    center: Vector2 | None = None
    radius: float = 0.0
    corners: list[Vector2] | None = None

    def area(self) -> Area:
        """What is to be cleared. Raises InvalidInput where it is neither."""
        return Area(tuple(self.center or ()), self.radius, tuple(tuple(corner) for corner in self.corners or ()))


class TerrainOptions(Strictly):
    """How to read an uploaded terrain file."""

    model_config = _examples({"scale": 2.75, "center": True, "resolution": 0.1})
    resolution: Annotated[float, Field(gt=0)] | None = None
    scale: Annotated[float, Field(gt=0)] = 1.0
    center: bool | Vector2 | None = None
    size: Vector2 | None = None
    height_range: Vector2 | None = None

    def arguments(self) -> dict[str, Any]:
        """Keyword arguments of ``read_terrain``."""
        given = self.model_dump()
        listed = {name: tuple(one) if isinstance(one, list) else one for name, one in given.items()}
        return {**listed, "center": listed["center"] or None}


class BlendOptions(Strictly):
    """How to read an uploaded terrain, as ``options`` of an upload, and how to lay it under the present one."""

    model_config = _examples({"read": {"center": [354000.0, 7200000.0]}, "settings": {"level": True, "reach": 20.0}})
    read: TerrainOptions = Field(default_factory=TerrainOptions)
    settings: BlendSettingsModel | None = None  # type: ignore[valid-type]


class MapOrder(Strictly):
    """Compute the map layers for one leg."""

    model_config = _examples(
        {"leg": 2, "settings": {"conservative": False}},
        {"leg": 2, "settings": {"friction": True, "balance": {"friction": 0.5, "gravity": 3.71}}},
    )
    leg: Leg
    settings: MapSettingsModel | None = None  # type: ignore[valid-type]


class FootfallChoice(Strictly):
    """Where the wheel of one leg is to touch, site frame [m]."""

    model_config = _examples({"leg": 2, "x": 1.6, "y": 2.9})
    leg: Leg
    x: float
    y: float


class Ray(Strictly):
    """A line of sight in the site frame."""

    model_config = _examples({"origin": [0.0, 0.0, 5.0], "direction": [0.0, 0.0, -1.0]})
    origin: Vector3
    direction: Vector3


class PlanOrder(Strictly):
    """Plan one step of one leg; target null means the chosen footfall."""

    model_config = _examples({"leg": 2, "target": [1.6, 2.9], "settings": {"planner": "auto", "seed": 1}})
    leg: Leg
    target: Vector2 | None = None
    settings: StepSettingsModel | None = None  # type: ignore[valid-type]


class SuggestionOrder(Strictly):
    """The best footfalls on the current maps of a leg; ``towards``: goal direction (east, north) or null."""

    model_config = _examples({"leg": 2, "count": 5, "separation": 0.3, "towards": [1.0, 0.0]})
    leg: Leg
    count: Annotated[int, Field(ge=1, le=50)] = 5
    separation: Annotated[float, Field(ge=0)] = 0.3
    towards: Vector2 | None = None
    settings: QualitySettingsModel | None = None  # type: ignore[valid-type]


class ShiftOrder(Strictly):
    """Which shift of the chassis makes a footfall possible? target null means the chosen footfall."""

    model_config = _examples({"leg": 2, "target": [1.6, 3.1]})
    leg: Leg
    target: Vector2 | None = None
    settings: FindShiftSettingsModel | None = None  # type: ignore[valid-type]


class WhatIfOrder(BodyShiftModel):  # type: ignore[valid-type,misc]
    """What if the chassis stood elsewhere, its feet where they are? What is left out of the shift is 0.

    dx, dy, dz along the axes of the site [m]; droll, dpitch, dyaw about those of the chassis [rad].
    """

    model_config = _examples({"dx": 0.05, "dz": -0.1}, {"dz": -0.2, "dyaw": 0.2})


class BodyMoveOrder(Strictly):
    """Move the chassis over its standing feet."""

    model_config = _examples({"shift": {"dx": 0.05, "dz": -0.1}})
    shift: BodyShiftModel  # type: ignore[valid-type]
    settings: BodyMoveSettingsModel | None = None  # type: ignore[valid-type]


class NewSequence(Strictly):
    """Make commands of a plan; null means the session's current plan."""

    model_config = _examples({"plan": None})
    plan: Name | None = None


class CommandModel(Strictly):
    """One command: LEG_MOVE with six joint angles [rad], or WAIT."""

    name: Annotated[str, Field(pattern=f"^({'|'.join(COMMAND_NAMES)})$")]
    leg: Leg | None = None
    joints: Annotated[list[float], Len(6, 6)] | None = None
    duration: float = Field(description="[s]")
    phase: Annotated[str, Field(max_length=20)] = ""


class EditModel(Strictly):
    """One change of the command list; rows count from 0."""

    kind: Annotated[str, Field(pattern=f"^({'|'.join(EDIT_KINDS)})$")]
    row: Annotated[int, Field(ge=0)]
    command: CommandModel | None = None
    to: Annotated[int, Field(ge=0)] | None = None
    joint: Annotated[int, Field(ge=0, le=5)] | None = None
    number: float | None = None


class SequenceEdit(Strictly):
    """An edit; If-Match must name the version that it changes."""

    model_config = _examples(
        {"edit": {"kind": "insert", "row": 1, "command": {"name": "WAIT", "duration": 2.0}}},
        {"edit": {"kind": "duration", "row": 1, "number": 4.0}},
        {"edit": {"kind": "delete", "row": 1}},
    )
    edit: EditModel


class SendOrder(Strictly):
    """Send what was armed; the token comes from arming and serves once."""

    model_config = _examples({"arming": "the token of the arm request"})
    arming: Name


class StopOrder(Strictly):
    """Stop the rover. Stays latched until cleared."""

    model_config = _examples({}, {"reason": "wheel 3 is sinking"})
    reason: Text = ""


class ViewChange(Strictly):
    """What the operator looks at; what is left out stays."""

    model_config = _examples({"leg": 2, "layer": "footing"}, {"scrub": 0.5, "show_ghost": True})
    leg: Leg | None = None
    layer: Name | None = None
    scrub: Annotated[float, Field(ge=0, le=1)] | None = None
    show_ghost: bool | None = None


class NewNote(Strictly):
    """A remark for the session's log."""

    model_config = _examples({"text": "rock is flatter than it looked"})
    text: Annotated[str, Field(min_length=1, max_length=LONGEST_TEXT)]
