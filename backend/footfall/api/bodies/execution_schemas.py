"""What requests about executions may contain; as strict as those of ``schemas``."""

from pydantic import ConfigDict

from footfall.api.bodies.schemas import Name, Number
from footfall.api.bodies.settings_models import Strictly, settings_model
from footfall.planning.execution.execution_settings import ExecutionSettings

ExecutionSettingsModel = settings_model(ExecutionSettings)


class ExecutionOrder(Strictly):
    """Plan how to command a planned step; plan null means the present one."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"plan": None},
                {"settings": {"mode": "droop_aware", "stop_share": 0.1, "compliance": {"joint_scale": 0.9}}},
            ]
        }
    )
    plan: Name | None = None
    settings: ExecutionSettingsModel | None = None  # type: ignore[valid-type]


class HeldMoveOrder(Strictly):
    """Plan how to command a move of the chassis, or a queue, with the pose held; plan null means the latest."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"plan": None}, {"settings": {"pause": 1.0}}]})
    plan: Name | None = None
    settings: ExecutionSettingsModel | None = None  # type: ignore[valid-type]


class TakeOver(Strictly):
    """The stiffness of the joints that is thought to be taken over, times the described, as `GET sag` told it; null:
    whatever was measured.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [{"joint_scale": 0.91}, {}]})
    joint_scale: Number | None = None
