"""What the rover carries while a walk is executed: what the walk was planned with."""

from dataclasses import replace

from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.walk.problem import WalkPlan, WalkSettings


def with_load_of(walk: WalkPlan, settings: ExecutionSettings) -> ExecutionSettings:
    """The settings with the payload that a walk was planned with, where they name none."""
    planned, own = walk.provenance.settings, settings.compliance.balance
    if not isinstance(planned, WalkSettings) or own.payload_mass is not None:
        return settings
    balance = replace(own, payload_mass=planned.payload_mass, payload_position=planned.payload_position)
    return replace(settings, compliance=replace(settings.compliance, balance=balance))
