"""All that a worker can be asked for: the products of a session, and what is only looked at or told."""

import json
from collections.abc import Mapping
from importlib import import_module
from typing import Any

from footfall.core.progress import Progress
from footfall.core.value import Value
from footfall.session.jobs.product_recipes import PRODUCTS, Recipe
from footfall.session.jobs.requests import CheckRequest
from footfall.session.jobs.warm import WARM_UPS as WARM_UPS
from footfall.session.products.kinds import KINDS


def views(parents: Mapping[str, Any], settings: Any, progress: Progress) -> Value:
    """robot, snapshot; TerrainSettings → SnapshotViews, to be looked at."""
    from footfall.terrain.pair_views import snapshot_views

    return snapshot_views(parents["robot"], parents["snapshot"], settings, progress)


def check(parents: Mapping[str, Any], settings: CheckRequest, progress: Progress) -> bytes:
    """No parents; CheckRequest → the report of a replay as JSON."""
    from footfall.session.replay.recompute import replay

    return json.dumps(replay(settings.bundle.tobytes(), progress=progress).as_dict()).encode()


RECIPES: Mapping[str, Recipe] = {**PRODUCTS, "views": views, "check": check}


def preload() -> None:
    """Import what the recipes need, before the first job waits for it."""
    for module in dict.fromkeys(kind.loads for kind in KINDS.values() if kind.loads):
        import_module(module)
