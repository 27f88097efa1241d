"""Scans as text: three numbers first in each row, or columns that a heading calls x, y, z."""

import io
import re

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidTerrain
from footfall.core.written import how_to_write, number_of

ENDINGS = (".xyz", ".csv", ".txt")


def read_points(content: bytes, name: str) -> Array:
    """The points (n, 3) of a text. Raises InvalidTerrain naming the line and the column."""
    lines = content[:65536].decode("utf-8", "replace").lstrip("\ufeff").split("\n")
    if not lines:
        raise InvalidTerrain(f"{name} is empty")
    comments = 0
    while comments < len(lines) and (
        not lines[comments].strip() or lines[comments].lstrip().startswith(("#", "//", "%"))
    ):
        comments += 1
    if comments == len(lines):
        raise InvalidTerrain(f"{name} has no rows of numbers")
    first = lines[comments]
    separator = next((s for s in (";", ",", "\t") if s in first), None)
    words = [word.strip().strip('"') for word in (first.split(separator) if separator else first.split())]
    columns = (0, 1, 2)
    skip, stated = comments, 0
    if len(words) == 1 and words[0].isdecimal():
        skip, stated = skip + 1, int(words[0])  # how many points there are, as in PTS files
    elif any(number_of(word) is None for word in words[:3]):
        if not any(word[:1].isdecimal() for word in words[:3]):
            columns, skip = _columns(words, name), skip + 1
    elif len(words) < 3:
        raise InvalidTerrain(f"{name} needs three numbers in each row, there are {len(words)}")
    else:
        columns = _columns_of_comment(lines[:comments], separator, len(words), name)
    points = _numbers(content, separator, skip, columns, name)
    if len(points) < stated:
        raise InvalidTerrain(f"{name} is cut: it states {stated} points and holds {len(points)}")
    return points


def _columns(words: list[str], name: str) -> tuple[int, int, int]:
    """Which columns a heading calls x, y and z."""
    plain = _plain(words)
    found = [plain.index(axis) if axis in plain else -1 for axis in "xyz"]
    if min(found) < 0:
        raise InvalidTerrain(f"{name} begins with {', '.join(words[:6])}: its heading needs columns x, y and z")
    twice = [axis for axis in "xyz" if plain.count(axis) > 1]
    if twice:
        raise InvalidTerrain(f"the heading of {name} has {twice[0]} twice: {', '.join(words[:9])}; call each otherwise")
    return found[0], found[1], found[2]


def _columns_of_comment(comments: list[str], separator: str | None, count: int, name: str) -> tuple[int, int, int]:
    """Which columns a heading in the last comment calls so; the first three where it is no heading of so many."""
    last = comments[-1].lstrip("#/% \t") if comments else ""
    for words in (last.split(separator), last.split()):
        plain = _plain(words)
        if len(words) != count:
            continue
        if {"x", "y", "z"} <= {*plain}:
            return _columns([word.strip() for word in words], name)
        if {*plain[:3]} & _GLOBE:
            raise InvalidTerrain(
                f"{name} calls its first columns {', '.join(words[:3])}: reproject them to metres on a map, such as UTM"
            )
    return 0, 1, 2


_GLOBE = {"lon", "long", "longitude", "lat", "latitude"}


def _plain(words: list[str]) -> list[str]:
    return [re.sub(r"[\[(].*", "", word).strip().strip('"').lower().lstrip("/#") for word in words]


def _numbers(content: bytes, separator: str | None, skip: int, columns: tuple[int, ...], name: str) -> Array:
    try:
        return np.loadtxt(
            io.StringIO(content.decode("utf-8", "replace").lstrip("\ufeff")),
            delimiter=separator,
            skiprows=skip,
            usecols=columns,
            comments=("#", "//", "%"),
            ndmin=2,
        )
    except (ValueError, IndexError) as err:
        where = _no_number(content.decode("utf-8", "replace").lstrip("\ufeff"), separator, skip, columns)
        raise InvalidTerrain(f"{name}: {where}; the columns x, y and z need a number in each row") from err


def _no_number(text: str, separator: str | None, skip: int, columns: tuple[int, ...]) -> str:
    """The first place of a text where one of these columns has no number."""
    for line, written in enumerate(io.StringIO(text), 1):
        row = re.split("#|//|%", written)[0]
        if line <= skip or not row.strip():
            continue
        words = row.split(separator)
        for axis, column in zip("xyz", columns, strict=True):
            if column >= len(words):
                return f"line {line} has {len(words)} columns, and column {column + 1} is {axis}"
            word = words[column].strip()
            if number_of(word) is None:
                place = f"line {line}, column {column + 1} ({axis})"
                return f"{place} has {word[:40]!r}, which is no number{how_to_write(word)}"
    return "a row has no number"
