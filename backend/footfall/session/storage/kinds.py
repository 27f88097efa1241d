"""Of which kind the values are that events name: what is read by one name is trusted to be what belongs there."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from footfall.core.errors import InvalidBundle
from footfall.io.event_log import Record

FILE = "file"
"""The kind of an artifact that holds no value."""

_DEM = ("Dem",)
_STATE = ("RobotState", "PredictedState")
_NAMED: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "session_created": {"robot": ("RobotDescription",)},
    "state_frozen": {"digest": _STATE},
    "what_if_ended": {"digest": _STATE},
    "snapshot_taken": {"digest": ("Snapshot",), "state": _STATE},
    "terrain_loaded": {"digest": _DEM},
    "terrain_undone": {"digest": _DEM},
    "plan_chosen": {"digest": ("PlanResult",)},
    "sequence_undone": {"digest": ("Sequence",)},
    "sequence_redone": {"digest": ("Sequence",)},
}
"""Type of event → place in its payload → kinds."""

_PRODUCTS: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(("terrain", "photographs", "blend", "clear"), _DEM),
    **dict.fromkeys(("sequence", "edit", "import"), ("Sequence",)),
    **dict.fromkeys(("after", "what_if"), ("PredictedState",)),
    "maps": ("MapStack",),
    "plan": ("PlanResult",),
    "execution": ("ExecutionResult",),
    "shift": ("ShiftResult",),
    "body_move": ("BodyMoveResult",),
    "outcome": ("Outcome",),
    "export": (FILE,),
}
_PARENTS: Mapping[str, tuple[str, ...]] = {
    "robot": ("RobotDescription",),
    **dict.fromkeys(("dem", "map", "external"), _DEM),
    "state": _STATE,
    "snapshot": ("Snapshot",),
    "photographs": ("Photographs",),
    "plan": ("PlanResult", "BodyMoveResult", "ShiftResult"),
    "execution": ("ExecutionResult",),
    "sequence": ("Sequence",),
}
_GROUND = ("robot", "dem", "state")
_MADE_FROM: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(("maps", "plan", "after", "what_if", "shift", "body_move", "import"), _GROUND),
    "terrain": ("robot", "snapshot"),
    "photographs": ("photographs",),
    "blend": ("dem", "external"),
    "clear": ("dem",),
    "execution": (*_GROUND, "plan"),
    "sequence": ("robot", "dem"),
    "edit": ("robot", "dem", "sequence"),
    "outcome": (*_GROUND, "sequence"),
    "export": ("sequence",),
}
"""Kind of product → the parents that none is without."""


def require_kinds(records: Iterable[Record], kinds: Mapping[str, str]) -> None:
    """Every value that is there is of a kind that belongs where an event names it, and no product lacks a parent.

    kinds: digest → name of the value's class, or FILE; what is not in there is not judged. Raises InvalidBundle with
    the event's number, the place and both kinds.
    """
    for record in records:
        for place, digest, wanted in _places(record):
            found = kinds.get(digest) if isinstance(digest, str) else None
            if found is not None and found not in wanted:
                raise InvalidBundle(
                    f"event {record['seq']} ({record['type']}) names a {found} as {place}, "
                    f"where a {' or '.join(wanted)} belongs",
                    seq=record["seq"],
                    place=place,
                    found=found,
                )


def _places(record: Record) -> Iterator[tuple[str, Any, tuple[str, ...]]]:
    payload = record["payload"]
    for place, wanted in _NAMED.get(record["type"], {}).items():
        yield place, payload.get(place), wanted
    if record["type"] != "product":
        return
    kind, parents = payload.get("kind"), payload.get("parents")
    if not isinstance(kind, str) or kind not in _PRODUCTS or not isinstance(parents, Mapping):
        return  # the fold refuses it
    lacking = [name for name in _MADE_FROM[kind] if name not in parents]
    if lacking:
        raise InvalidBundle(
            f"event {record['seq']}: {kind} is said to be made without {' and '.join(lacking)}",
            seq=record["seq"],
            lacking=lacking,
        )
    yield "digest", payload.get("digest"), _PRODUCTS[kind]
    yield "state", payload.get("state"), _STATE
    for name, digest in parents.items():
        yield f"parents.{name}", digest, _PARENTS.get(name, ())
