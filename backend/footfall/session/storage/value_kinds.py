"""Of which class the values are that events name: what is read by one name is trusted to be what belongs there.

Of products, the table in :mod:`footfall.session.products.kinds` says it.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from footfall.core.errors import InvalidBundle
from footfall.io.event_log import Record
from footfall.session.products.kinds import KINDS

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

_INPUTS: Mapping[str, tuple[str, ...]] = {
    "robot": ("RobotDescription",),
    **dict.fromkeys(("map", "external"), _DEM),
    "dem": _DEM,
    "state": ("RobotState",),
    "snapshot": ("Snapshot",),
    "photographs": ("Photographs",),
}
"""Name of a parent → kinds of values that no product need be."""


def parents_called(name: str) -> tuple[str, ...]:
    """Kinds of values that a parent of this name may be of: inputs, and products that are given under that name."""
    made = (kind.makes for kind in KINDS.values() if kind.given_as == name)
    return tuple(dict.fromkeys((*_INPUTS.get(name, ()), *made)))


def require_kinds(records: Iterable[Record], kinds: Mapping[str, str]) -> None:
    """Every value that is there is of a kind that belongs where an event names it, and no product lacks a parent.

    kinds: digest → name of the value's class, or FILE; what is not in there is not judged. Raises InvalidBundle with
    the event's number, the place and both kinds.
    """
    for record in records:
        for place, digest, wanted in _places(record):
            found = kinds.get(digest) if isinstance(digest, str) else None
            if found is not None and found not in wanted:
                belongs = f"a {' or '.join(wanted)}" if wanted else "nothing"
                raise InvalidBundle(
                    f"event {record['seq']} ({record['type']}) names a {found} as {place}, where {belongs} belongs",
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
    name, parents = payload.get("kind"), payload.get("parents")
    if not isinstance(name, str) or name not in KINDS or not isinstance(parents, Mapping):
        return  # the fold refuses it
    kind = KINDS[name]
    lacking = [one for one in kind.needs if one not in parents]
    if lacking:
        raise InvalidBundle(
            f"event {record['seq']}: {name} is said to be made without {' and '.join(lacking)}",
            seq=record["seq"],
            lacking=lacking,
        )
    yield "digest", payload.get("digest"), (kind.makes,)
    yield "state", payload.get("state"), _STATE
    yield "settings", payload.get("settings"), (() if kind.request is None else (kind.request,))
    for one, digest in parents.items():
        yield f"parents.{one}", digest, parents_called(one)
