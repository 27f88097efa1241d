"""Where two values differ first, and by how much."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from footfall.core.value import Provenance, Value


@dataclass(frozen=True)
class FieldDifference:
    """path: of the field, such as ``plan.waypoints[3, 7]``; magnitude: largest |difference| there, None where
    the two have no numbers to subtract; text: for a person."""

    path: str
    magnitude: float | None
    text: str


def differences(recorded: Any, recomputed: Any, path: str = "") -> Iterator[FieldDifference]:
    """All differences in field order, recorded against recomputed. Versions of the software don't count."""
    if type(recorded) is not type(recomputed):
        if _is_number(recorded) and _is_number(recomputed):
            yield from _numbers(float(recorded), float(recomputed), path)
        else:
            yield FieldDifference(path, None, f"{_short(recorded)} was recorded, now it is {_short(recomputed)}")
    elif isinstance(recorded, Value):
        yield from _by_field(recorded, recomputed, path)
    elif isinstance(recorded, np.ndarray):
        yield from _arrays(recorded, recomputed, path)
    elif isinstance(recorded, Mapping):
        yield from _by_name(recorded, recomputed, path)
    elif isinstance(recorded, tuple):
        yield from _in_order(recorded, recomputed, path)
    elif isinstance(recorded, bytes):
        yield from _bytes(recorded, recomputed, path)
    elif isinstance(recorded, float):
        yield from _numbers(recorded, recomputed, path)
    elif recorded != recomputed:
        yield FieldDifference(path, None, f"{_short(recorded)} was recorded, now it is {_short(recomputed)}")


def _by_field(recorded: Value, recomputed: Value, path: str) -> Iterator[FieldDifference]:
    for f in fields(recorded):  # type: ignore[arg-type]
        if isinstance(recorded, Provenance) and f.name == "software":
            continue
        yield from differences(getattr(recorded, f.name), getattr(recomputed, f.name), _join(path, f.name))


def _by_name(recorded: Mapping[str, Any], recomputed: Mapping[str, Any], path: str) -> Iterator[FieldDifference]:
    for name in dict.fromkeys([*recorded, *recomputed]):
        if name not in recorded or name not in recomputed:
            yield FieldDifference(f"{path}[{name!r}]", None, "only one of the two has it")
        else:
            yield from differences(recorded[name], recomputed[name], f"{path}[{name!r}]")
    if list(recorded) != list(recomputed) and set(recorded) == set(recomputed):
        yield FieldDifference(path, None, "the order of the names differs")


def _in_order(recorded: tuple[Any, ...], recomputed: tuple[Any, ...], path: str) -> Iterator[FieldDifference]:
    if len(recorded) != len(recomputed):
        yield FieldDifference(path, None, f"{len(recorded)} items were recorded, now there are {len(recomputed)}")
    for i, (one, other) in enumerate(zip(recorded, recomputed, strict=False)):
        yield from differences(one, other, f"{path}[{i}]")


def _arrays(recorded: np.ndarray, recomputed: np.ndarray, path: str) -> Iterator[FieldDifference]:
    if recorded.dtype != recomputed.dtype or recorded.shape != recomputed.shape:
        yield FieldDifference(
            path,
            None,
            f"{recorded.dtype} {recorded.shape} was recorded, now it is {recomputed.dtype} {recomputed.shape}",
        )
        return
    floats = recorded.dtype.kind == "f"
    different = recorded != recomputed
    if floats:
        different &= ~(np.isnan(recorded) & np.isnan(recomputed))
    if not different.any():
        return
    first = tuple(int(i) for i in np.argwhere(different)[0])
    where = f"{path}[{', '.join(str(i) for i in first)}]" if first else path
    magnitude = None
    if recorded.dtype.kind in "fiu":
        with np.errstate(invalid="ignore", over="ignore"):
            size = np.abs(recorded.astype(float) - recomputed.astype(float))[different]
        magnitude = float("inf") if np.isnan(size).any() else float(size.max())
    if not floats and magnitude is not None:
        magnitude = max(magnitude, 1.0)  # whole numbers have no rounding to excuse them
    yield FieldDifference(
        where, magnitude, f"{int(different.sum())} of {recorded.size} numbers differ, by at most {magnitude}"
    )


def _numbers(recorded: float, recomputed: float, path: str) -> Iterator[FieldDifference]:
    if recorded == recomputed or (recorded != recorded and recomputed != recomputed):
        return
    size = abs(recorded - recomputed)
    yield FieldDifference(
        path, float("inf") if size != size else size, f"{recorded!r} was recorded, now it is {recomputed!r}"
    )


def _bytes(recorded: bytes, recomputed: bytes, path: str) -> Iterator[FieldDifference]:
    if recorded != recomputed:
        shared = min(len(recorded), len(recomputed))
        first = next((i for i in range(shared) if recorded[i] != recomputed[i]), shared)
        yield FieldDifference(
            _join(path, f"byte {first}"),
            None,
            f"{len(recorded)} bytes were recorded, now there are {len(recomputed)}",
        )


def _is_number(item: Any) -> bool:
    return isinstance(item, (int, float)) and not isinstance(item, bool)


def _join(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


def _short(item: Any) -> str:
    text = repr(item)
    return text if len(text) < 80 else text[:77] + "..."
