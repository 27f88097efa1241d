"""GET robot: the description of the robot that the current session, or a new one, uses."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal, TypedDict

import numpy as np

from footfall.api.access import AllSessions
from footfall.api.kinds import SERVED
from footfall.api.routing import Routes
from footfall.core.arrays import Array
from footfall.io.robot_files import load_robot
from footfall.session.answers.notes import DigestText
from footfall.telemetry.joint_layout import JointLayout

if TYPE_CHECKING:
    from footfall.robot.legged.legged_robot import LeggedRobot
    from footfall.robot.model import Robot

router = Routes(tags=["robot"])


class PlannedBy(TypedDict):
    """kind: of the product, as in the session's summary; folder: below a session, where it is asked for and read."""

    kind: str
    folder: str


class RobotAnswer(TypedDict):
    """SI units, radians; one number for each joint, leg by leg, null where nothing limits it or nobody says.

    athletes_build: whether it has ATHLETE's legs; else null and empty stand for what nobody says of such a robot.
    leg_joints: of each leg, which numbers of a posture are its own. joint_units: rad where a joint turns, m where
    it slides. longest_leg: the length of one [m]. foot_radii: of each leg's wheel or ball [m], 0 where a foot is a
    point. planned_by: step and walk → which kind of product plans them in this robot's sessions.
    """

    name: str
    digest: DigestText
    athletes_build: bool
    legs: int
    leg_names: tuple[str, ...]
    leg_joints: list[list[int]]
    mass: float
    wheel_radius: float | None
    foot_radii: list[float]
    joint_names: tuple[str, ...]
    joint_units: list[Literal["rad", "m"]]
    lower: Array
    upper: Array
    torque_limits: Array
    speed_limits: Array
    stiffness: Array | None
    leg_lengths: list[float]
    longest_leg: float
    T_base_hips: list[Array]
    least_load: float
    postures: Mapping[str, Array]
    cameras: list[str]
    assumed: tuple[str, ...]
    planned_by: dict[str, PlannedBy]


class _Joints(TypedDict):
    leg_names: tuple[str, ...]
    leg_joints: list[list[int]]
    joint_names: tuple[str, ...]
    joint_units: list[Literal["rad", "m"]]


@router.get("/robot")
def robot(sessions: AllSessions) -> RobotAnswer:
    """Legs, joints and limits, leg by leg; postures; cameras; which values are assumed.

    leg_lengths: farthest contact from the hip-yaw joint [m], which T_base_hips places; least_load: share of the weight
    below which a foot is in the air.
    """
    from footfall.robot.legged.legged_robot import LeggedRobot

    live = sessions.current
    model = load_robot("athlete") if live is None else live.any_robot
    return _described(model) if isinstance(model, LeggedRobot) else _athletes(model)


def _athletes(model: "Robot") -> RobotAnswer:
    """Of a robot of ATHLETE's build."""
    about = model.description
    return {
        "name": model.name,
        "digest": model.digest,
        "athletes_build": True,
        "legs": model.leg_count,
        "mass": model.mass,
        "wheel_radius": model.wheel_radius,
        "foot_radii": [model.wheel_radius for _ in model.legs],
        **_joints(model.layout),
        "lower": model.lower,
        "upper": model.upper,
        "torque_limits": model.torque_limits,
        "speed_limits": model.speed_limits,
        "stiffness": model.stiffness,
        "postures": about.postures,
        "leg_lengths": [model.leg_length(leg) for leg in model.legs],
        "longest_leg": max(model.leg_length(leg) for leg in model.legs),
        "T_base_hips": [leg.T_base_hip for leg in about.legs],
        "least_load": _least_load(),
        "cameras": [pair.name for pair in about.cameras],
        "assumed": about.assumed,
        "planned_by": _planned_by(described=False),
    }


def _described(model: "LeggedRobot") -> RobotAnswer:
    """Of a robot that others described."""
    kinds = [model.model.tree.joint(name).kind for name in model.joint_names]
    endless = np.array([kind == "continuous" for kind in kinds]) & model.coupling.alone
    return {
        "name": model.name,
        "digest": model.digest,
        "athletes_build": False,
        "legs": len(model.legs),
        "mass": model.mass,
        "wheel_radius": None,
        "foot_radii": model.radii.tolist(),
        **_joints(model.layout),
        "lower": np.where(endless, -np.inf, model.lower),
        "upper": np.where(endless, np.inf, model.upper),
        "torque_limits": model.efforts,
        "speed_limits": model.speeds,
        "stiffness": model.stiffness if model.sags else None,
        "postures": model.postures,
        "leg_lengths": [],
        "longest_leg": model.length,
        "T_base_hips": [],
        "least_load": _least_load(),
        "cameras": [pair.name for pair in model.description.cameras],
        "assumed": (),
        "planned_by": _planned_by(described=True),
    }


def _joints(layout: JointLayout) -> _Joints:
    return {
        "leg_names": layout.legs,
        "leg_joints": [list(range(own.start, own.stop)) for own in layout.slices],
        "joint_names": layout.joint_names,
        "joint_units": ["m" if name in layout.sliding else "rad" for name in layout.joint_names],
    }


def _planned_by(described: bool) -> dict[str, PlannedBy]:
    return {
        kind.plays: {"kind": kind.name, "folder": served.folder}
        for kind, served in SERVED.items()
        if kind.plays and kind.for_described == described
    }


def _least_load() -> float:
    from footfall.planning.compliance.from_telemetry import LEAST_LOAD

    return LEAST_LOAD
