"""Settings of orders that command a rover that sags."""

from pydantic import BaseModel

from footfall.api.bodies.settings_models import settings_value
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.session.live import LiveSession


def settings_of_order(live: LiveSession, given: BaseModel | None) -> ExecutionSettings | None:
    """Those of an order; how stiff joints are, where it does not say, is what was taken over last."""
    settings = settings_value(ExecutionSettings, given)
    if given is None or settings is None:
        return None
    compliance = getattr(given, "compliance", None)
    given_of_compliance = compliance.model_fields_set if compliance and "compliance" in given.model_fields_set else ()
    return settings if "joint_scale" in given_of_compliance else live.executions.settings_in_force(settings)
