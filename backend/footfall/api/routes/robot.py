"""GET robot: the description of the robot that the current session, or a new one, uses."""

from collections.abc import Mapping
from typing import TypedDict

from footfall.api.access import AllSessions
from footfall.api.routing import Routes
from footfall.core.arrays import Array
from footfall.io.robot_files import load_robot
from footfall.session.answers.notes import DigestText

router = Routes(tags=["robot"])


class RobotAnswer(TypedDict):
    """SI units, radians; one number for each joint, leg by leg."""

    name: str
    digest: DigestText
    legs: int
    mass: float
    wheel_radius: float
    joint_names: tuple[str, ...]
    lower: Array
    upper: Array
    torque_limits: Array
    speed_limits: Array
    stiffness: Array
    leg_lengths: list[float]
    T_base_hips: list[Array]
    least_load: float
    postures: Mapping[str, Array]
    cameras: list[str]
    assumed: tuple[str, ...]


@router.get("/robot")
def robot(sessions: AllSessions) -> RobotAnswer:
    """Joint names and limits, leg by leg; postures; cameras; which values are assumed.

    leg_lengths: farthest contact from the hip-yaw joint [m], which T_base_hips places; least_load: share of the weight
    below which a wheel is in the air.
    """
    from footfall.planning.compliance.from_telemetry import LEAST_LOAD

    live = sessions.current
    model = live.robot if live is not None else load_robot("athlete")
    about = model.description
    return {
        "name": model.name,
        "digest": model.digest,
        "legs": model.leg_count,
        "mass": model.mass,
        "wheel_radius": model.wheel_radius,
        "joint_names": about.joint_names,
        "lower": model.lower,
        "upper": model.upper,
        "torque_limits": model.torque_limits,
        "speed_limits": model.speed_limits,
        "stiffness": model.stiffness,
        "postures": about.postures,
        "leg_lengths": [model.leg_length(leg) for leg in model.legs],
        "T_base_hips": [leg.T_base_hip for leg in about.legs],
        "least_load": LEAST_LOAD,
        "cameras": [pair.name for pair in about.cameras],
        "assumed": about.assumed,
    }
