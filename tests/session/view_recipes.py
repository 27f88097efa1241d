"""A recipe of views that fails the first time, for the pool of a test."""

from collections.abc import Mapping
from itertools import count
from typing import Any

from footfall.core.errors import InvalidImages
from footfall.core.progress import Progress
from footfall.core.value import Value
from footfall.terrain.pair_views import SnapshotViews

_asked = count()


def views(parents: Mapping[str, Any], settings: Any, progress: Progress) -> Value:
    if next(_asked) == 0:
        raise InvalidImages("the first time it fails")
    return SnapshotViews((), parents["snapshot"].state.mode)


RECIPES = {"views": views}
