"""What requests about the queue of steps and moves may contain; as strict as those of ``schemas``."""

from pydantic import ConfigDict

from footfall.api.bodies.schemas import Name
from footfall.api.bodies.settings_models import Strictly


class QueueOrder(Strictly):
    """Put a planned step or move of the chassis at the end of the queue, by digest; null: the present step."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"plan": None}]})
    plan: Name | None = None


class QueueShortening(Strictly):
    """What of the queue is left, by the digest that it had then (`before` of an entry); null: nothing."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"to": None}]})
    to: Name | None
