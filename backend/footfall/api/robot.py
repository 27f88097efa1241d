"""GET robot: the description of the robot that the current session, or a new one, uses."""

from typing import Any

from footfall.api.access import AllSessions
from footfall.api.routing import Routes
from footfall.io.robot_files import load_robot

router = Routes(tags=["robot"])


@router.get("/robot")
def robot(sessions: AllSessions) -> dict[str, Any]:
    """Joint names and limits, leg by leg; postures; cameras; which values are assumed."""
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
        "cameras": [pair.name for pair in about.cameras],
        "assumed": about.assumed,
    }
