"""What requests may contain. Strict: no unknown members, no booleans or texts where numbers belong, no NaN."""

from typing import Annotated, Any

from annotated_types import Len
from pydantic import ConfigDict, Field

from footfall.api.bodies.settings_models import FromNumber, Strictly, settings_model
from footfall.balance.tether import EDGE, Tether
from footfall.maps.layers import MapSettings
from footfall.maps.quality_settings import QualitySettings
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.body.find_problem import FindShiftSettings
from footfall.planning.body.move import BodyMoveSettings
from footfall.planning.step.alternatives import KINDS
from footfall.planning.step.problem import MOST_THROUGH, StepSettings
from footfall.session.view import LEAST_OPACITY, LOOKS, PLAYS, TAPE_ENDS
from footfall.terrain.fusion.clear import Area
from footfall.terrain.terrain_settings import BlendSettings, TerrainSettings

LONGEST_TEXT = 2000


Number = Annotated[float, Field(ge=-1e8, le=1e8)]
"""A coordinate or an amount: larger ones are a slip, and their squares would leave the range of floats."""
Vector2 = Annotated[list[Number], Len(2, 2)]
Vector3 = Annotated[list[Number], Len(3, 3)]
Matrix4 = Annotated[list[Annotated[list[Number], Len(4, 4)]], Len(4, 4)]
Name = Annotated[str, Field(min_length=1, max_length=100)]
Text = Annotated[str, Field(max_length=LONGEST_TEXT)]
SessionName = Annotated[str, Field(max_length=LONGEST_TEXT, description="1 to 80 printable characters")]
"""Longer ones come as far as ``session_name``, which says by how much."""
Leg = Annotated[int, Field(ge=0, le=63), FromNumber]


def _examples(*examples: dict[str, Any]) -> ConfigDict:
    return ConfigDict(json_schema_extra={"examples": list(examples)})


StepSettingsModel = settings_model(StepSettings)
MapSettingsModel = settings_model(MapSettings)
TerrainSettingsModel = settings_model(TerrainSettings)
QualitySettingsModel = settings_model(QualitySettings)
FindShiftSettingsModel = settings_model(FindShiftSettings)
BodyMoveSettingsModel = settings_model(BodyMoveSettings)
BodyShiftModel = settings_model(BodyShift)
BlendSettingsModel = settings_model(BlendSettings)


class TetherModel(settings_model(Tether)):  # type: ignore[misc]
    """A tether from an anchor in site to a drum on the chassis, which only pulls.

    anchor: x, y, z in site [m]. attachment: where it leaves the drum, in base [m]; left out: the middle of ATHLETE's
    edge between legs 2 and 3. most_force: of the drum [N]. free_length: that can be paid out [m]; speed: of paying
    out and hauling in [m/s]. clearance: from ground and legs [m]; bare: how much of it next to the anchor may lie on
    the ground [m].
    """

    anchor: Vector3
    attachment: Vector3 = Field(default_factory=lambda: list(EDGE))


class NewSession(Strictly):
    """``sample`` opens a copy of a sample session, ``name`` starts an empty one, ``session`` (id) opens an old one."""

    model_config = _examples({"sample": "rock-step"}, {"name": "morning drive"})
    sample: Name | None = None
    name: SessionName | None = None
    session: Name | None = None


class SessionRenamed(Strictly):
    """What a session is called from now on."""

    model_config = _examples({"name": "rock step, second try"})
    name: SessionName


class StateReport(Strictly):
    """One state of the rover, from a script instead of the rover link; SI units, radians, site frame."""

    time: float = Field(description="rover clock, seconds since 1970-01-01 UTC")
    posture: list[Number] = Field(description="joint angles [rad], six for each leg", max_length=384)
    T_site_base: Matrix4 = Field(description="pose of the chassis")
    wheel_forces: list[Vector3] = Field(description="force of the ground on each wheel [N]", max_length=64)
    joint_torques: list[Number] = Field(description="[N·m], six for each leg", max_length=384)
    mode: Name = "idle"


class Stand(Strictly):
    """Where to stand the robot on the current terrain."""

    x: Number = 0.0
    y: Number = 0.0
    yaw: Number = 0.0
    posture: Name = "stand"
    tether: TetherModel | None = Field(default=None, description="that it hangs on; the posture is then of no account")


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

    width: Annotated[int, Field(ge=1, le=8192), FromNumber]
    height: Annotated[int, Field(ge=1, le=8192), FromNumber]
    fx: Number
    fy: Number
    cx: Number
    cy: Number
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
    radius: Number = 0.0
    corners: list[Vector2] | None = None

    def area(self) -> Area:
        """What is to be cleared. Raises InvalidInput where it is neither."""
        return Area(tuple(self.center or ()), self.radius, tuple(tuple(corner) for corner in self.corners or ()))


class TerrainOptions(Strictly):
    """How to read an uploaded terrain file."""

    model_config = _examples({"scale": 2.75, "center": True, "resolution": 0.1})
    resolution: Annotated[float, Field(gt=0, le=1e6)] | None = None
    scale: Annotated[float, Field(gt=0, le=1e6)] = 1.0
    center: bool | Vector2 | None = None
    size: Vector2 | None = None
    height_range: Vector2 | None = None
    most_error: Annotated[float, Field(gt=0, le=1e4)] | None = None

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
    x: Number
    y: Number


class Ray(Strictly):
    """A line of sight in the site frame."""

    model_config = _examples({"origin": [0.0, 0.0, 5.0], "direction": [0.0, 0.0, -1.0]})
    origin: Vector3
    direction: Vector3


class PlanOrder(Strictly):
    """Plan one step of one leg; target null means the chosen footfall.

    through: points, site frame [m], that the wheel's centre passes during the swing. after: digest of a plan, queue or
    sequence from whose predicted end the step starts.
    """

    model_config = _examples(
        {"leg": 2, "target": [1.6, 2.9], "settings": {"planner": "auto", "seed": 1}},
        {"leg": 2, "target": [1.6, 2.9], "through": [[1.5, 2.6, 0.9]]},
    )
    leg: Leg
    target: Vector2 | None = None
    settings: StepSettingsModel | None = None  # type: ignore[valid-type]
    through: Annotated[list[Vector3], Len(0, MOST_THROUGH)] = Field(default_factory=list)
    after: Name | None = None


class AlternativesOrder(Strictly):
    """Ask for a plan otherwise; null means every kind."""

    model_config = _examples({"kinds": ["higher_lift", "other_knee"]}, {"kinds": None})
    kinds: Annotated[list[Name], Len(1, len(KINDS))] | None = None


class PlanChoice(Strictly):
    """Which of the plans that are listed beside each other is to be the session's, by digest."""

    model_config = _examples({"plan": "0123456789abcdef0123456789abcdef"})
    plan: Name


class GoOn(Strictly):
    """A plan, execution or sequence, by digest, whose predicted end is planned from.

    null means what says best where the session's plan ends: its commands, its execution, or the plan, whichever was
    made last.
    """

    model_config = _examples({"after": None})
    after: Name | None = None


class SuggestionOrder(Strictly):
    """The best footfalls on the current maps of a leg; ``towards``: goal direction (east, north) or null.

    ``separation``: at least so far apart [m]; null: a wheel's diameter, and less only where nothing else is left.
    """

    model_config = _examples({"leg": 2, "count": 5, "separation": 0.3, "towards": [1.0, 0.0]})
    leg: Leg
    count: Annotated[int, Field(ge=1, le=50), FromNumber] = 5
    separation: Annotated[float, Field(ge=0, le=1e6)] | None = None
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
    """Move the chassis over its standing feet, from how the rover stands.

    after: digest of a plan, queue or sequence from whose predicted end it starts instead.
    """

    model_config = _examples({"shift": {"dx": 0.05, "dz": -0.1}})
    shift: BodyShiftModel  # type: ignore[valid-type]
    settings: BodyMoveSettingsModel | None = None  # type: ignore[valid-type]
    after: Name | None = None


class StopOrder(Strictly):
    """Stop the rover. Stays latched until cleared. page: which of somebody's pages or programs asks."""

    model_config = _examples({}, {"reason": "wheel 3 is sinking"})
    reason: Text = ""
    page: str = ""


class ShownChange(Strictly):
    """What the scene shows; what is left out stays."""

    torques: bool = Field(default_factory=bool)
    forces: bool = Field(default_factory=bool)
    support: bool = Field(default_factory=bool)
    region: bool = Field(default_factory=bool, description="where the centre of mass may be, with friction")
    age: bool = Field(default_factory=bool, description="the ground is hatched by how old it is")
    contours: bool = Field(default_factory=bool, description="lines of equal height on the ground")
    tracks: bool = Field(default_factory=bool, description="where wheels were put down")
    suggestions: bool = Field(default_factory=bool)
    predicted: bool = Field(default_factory=bool, description="the second ghost, while a run goes")
    cameras: bool = Field(default_factory=bool)
    swept: bool = Field(default_factory=bool)
    tape: bool = Field(default_factory=bool, description="a click on the ground measures instead of choosing")


class ViewChange(Strictly):
    """What is looked at on the page that asks (FootFall-Page; on every page, where none is named); what is left out
    stays."""

    model_config = _examples(
        {"leg": 2, "layer": "footing"},
        {"scrub": 0.5, "show_ghost": True},
        {"shown": {"cameras": True}, "look": "top"},
        {"plays": "walk"},
        {"follows": True},
        {"goal": [2.5, 1.0]},
        {"shown": {"tape": True}, "tape": [[0.0, 1.0, 0.1], [0.5, 1.0, 0.3]]},
    )
    leg: Leg = Field(default_factory=int)
    layer: Name | None = Field(default=None, description="null shows no layer")
    scrub: Annotated[float, Field(ge=0, le=1)] = Field(default_factory=float)
    show_ghost: bool = Field(default_factory=bool)
    opacity: Annotated[float, Field(ge=LEAST_OPACITY, le=1)] = Field(
        default_factory=float, description="of the layer's colours over what the cameras saw"
    )
    shown: ShownChange = Field(default_factory=ShownChange)
    look: Name = Field(default_factory=str, description=f"one of {', '.join(LOOKS)}")
    tape: Annotated[list[Vector3], Len(0, TAPE_ENDS)] = Field(default_factory=list, description="points, site [m]")
    goal: Vector2 | None = Field(default=None, description="of a walk: x, y [m] in the site frame; null: none")
    goal_page: Annotated[str, Len(0, 64)] = Field(
        default_factory=str, description="the page, as FootFall-Page names it, whose next click sets the goal; or none"
    )
    follows: bool = Field(
        default_factory=bool,
        description="whether the page shows what the holder of the conn shows, instead of its own choices",
    )
    plays: Name = Field(
        default_factory=str,
        description=f"what the ghost plays, until something newer is made: one of {', '.join(PLAYS)}",
    )


class NewNote(Strictly):
    """A remark for the session's log."""

    model_config = _examples({"text": "rock is flatter than it looked"})
    text: Annotated[str, Field(min_length=1, max_length=LONGEST_TEXT)]
