"""What commands for a rover that sags are asked to keep of what their plan was asked for."""

from dataclasses import replace

from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.sequence.make import RigidPlan, settings_of


def with_support_of(plan: RigidPlan, settings: ExecutionSettings) -> ExecutionSettings:
    """The settings, with the conservative polygon where the plan was made with it."""
    return replace(settings, conservative=settings.conservative or settings_of(plan).conservative)


def as_planned(plan: RigidPlan, settings: ExecutionSettings) -> ExecutionSettings:
    """Settings of which none was chosen for the plan: on ground with the friction that it was made with."""
    balance = replace(settings.compliance.balance, friction=settings_of(plan).friction)
    return with_support_of(plan, replace(settings, compliance=replace(settings.compliance, balance=balance)))
