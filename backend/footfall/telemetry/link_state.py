"""The one JSON form of how a rover stands, of its joints' names, and of its cameras, as the rover link has them."""

from collections.abc import Mapping

from footfall.core.errors import InvalidInput, InvalidTelemetry
from footfall.telemetry.fields import Fields
from footfall.telemetry.images import Camera
from footfall.telemetry.joint_layout import JointLayout
from footfall.telemetry.state import MODES, RobotState


def state_object(state: RobotState) -> dict[str, object]:
    """JSON-ready form of a state: the fields of a telemetry message without number and commanded.

    Whoever reads it has to know the rover: names of joints are not in it.
    """
    return {
        "robot": state.robot,
        "time": state.time,
        "posture": state.posture.tolist(),
        "T_site_base": state.T_site_base.tolist(),
        "wheel_forces": state.wheel_forces.tolist(),
        "joint_torques": state.joint_torques.tolist(),
        "mode": state.mode,
    }


def state_from(body: Mapping[str, object], legs: int | None = None, described: JointLayout | None = None) -> RobotState:
    """Inverse of :func:`state_object`; legs, described: as in :func:`read_state`. Raises InvalidTelemetry."""
    fields = Fields(body, "state")
    try:
        state = read_state(fields, legs, described)
    except InvalidTelemetry:
        raise
    except InvalidInput as err:
        raise InvalidTelemetry(f"state: {err.message}", **err.details) from err
    fields.end()
    return state


def read_state(fields: Fields, legs: int | None, described: JointLayout | None = None) -> RobotState:
    """The fields of a state, taken from a message.

    legs: how many the rover has, where that is known. described: its legs and joints, where it is not of ATHLETE's
    build. Raises InvalidTelemetry, and what :class:`RobotState` raises.
    """
    if described is None:
        posture = fields.angles("posture", legs)
        count = len(posture) // 6
    else:
        posture, count = fields.array("posture", (len(described.joint_names),)), len(described.legs)
    return RobotState(
        robot=fields.text("robot", longest=64),
        time=fields.number("time"),
        posture=posture,
        T_site_base=fields.array("T_site_base", (4, 4)),
        wheel_forces=fields.array("wheel_forces", (count, 3)),
        joint_torques=fields.array("joint_torques", (len(posture),)),
        mode=fields.choice("mode", MODES),
        described=described,
    )


def layout_object(layout: JointLayout) -> dict[str, object]:
    """JSON-ready form of legs and joints by name."""
    joints = {leg: list(own) for leg, own in zip(layout.legs, layout.joints, strict=True)}
    return {"legs": list(layout.legs), "of_leg": joints, "sliding": list(layout.sliding)}


def layout_from(body: Mapping[str, object]) -> JointLayout:
    """Inverse of :func:`layout_object`. Raises InvalidTelemetry, also for names that are used twice."""
    fields = Fields(body, "joints")
    legs = fields.texts("legs")
    of_leg = Fields(fields.inner("of_leg"), "joints of legs")
    joints = tuple(of_leg.texts(leg) for leg in legs)
    of_leg.end()
    sliding = fields.texts("sliding", empty=True)
    fields.end()
    try:
        return JointLayout(legs, joints, sliding)
    except InvalidInput as err:
        raise InvalidTelemetry(f"joints: {err.message}", **err.details) from err


def camera_object(camera: Camera) -> dict[str, object]:
    """JSON-ready form of a camera model."""
    return {
        "name": camera.name,
        "width": camera.width,
        "height": camera.height,
        "fx": camera.fx,
        "fy": camera.fy,
        "cx": camera.cx,
        "cy": camera.cy,
        "T_base_camera": camera.T_base_camera.tolist(),
    }


def camera_from(body: Mapping[str, object]) -> Camera:
    """Inverse of :func:`camera_object`. Raises InvalidTelemetry, or InvalidImages for an impossible camera."""
    fields = Fields(body, "camera")
    camera = Camera(
        name=fields.text("name", longest=64),
        width=fields.whole("width", least=1),
        height=fields.whole("height", least=1),
        fx=fields.number("fx"),
        fy=fields.number("fy"),
        cx=fields.number("cx"),
        cy=fields.number("cy"),
        T_base_camera=fields.array("T_base_camera", (4, 4)),
    )
    fields.end()
    return camera
