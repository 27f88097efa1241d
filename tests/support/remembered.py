"""Jobs at once that make each product once for all tests that share ``made``: a walk takes seconds to plan.

A recipe is a pure function of values that their digests name, so what it made once it would make again. Where a test
changes how products are made, it shares with no other: it uses ``InlineJobs``, or the fixture ``forgotten``.
"""

from collections.abc import Mapping
from typing import Any

from footfall.core.progress import Progress
from footfall.core.value import Value
from footfall.planning.answers import Status
from footfall.session.jobs.local import InlineJobs
from footfall.session.jobs.product_recipes import Recipe

Made = dict[tuple[object, ...], Value | bytes]
"""Products by their kind and the digests of parents and settings."""


class RememberedJobs(InlineJobs):
    """Refusals, and what ended by its time limit, are not remembered: their recipe is asked each time."""

    def __init__(self, made: Made) -> None:
        super().__init__()
        self._recipes = {kind: _remembered(kind, recipe, made) for kind, recipe in self._recipes.items()}


def _remembered(kind: str, recipe: Recipe, made: Made) -> Recipe:
    def remembered(parents: Mapping[str, Any], settings: Any, progress: Progress) -> Value | bytes:
        named = tuple(sorted((name, value.digest) for name, value in parents.items()))
        asked = (kind, named, None if settings is None else settings.digest)
        if asked in made:
            return made[asked]
        product = recipe(parents, settings, progress)
        if getattr(product, "status", None) is not Status.TIME_LIMIT:
            made[asked] = product
        return product

    return remembered
