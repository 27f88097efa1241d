"""Scans as text: three numbers first in each row, or columns that a heading calls x, y, z, or east, north, height."""

import io
import re

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidTerrain
from footfall.core.written import how_to_write, number_of

ENDINGS = (".xyz", ".csv", ".txt")

_FRACTION = re.compile("0[0-9]+")
_UNITS = re.compile(r"[ \t]*[\[(][^\])]*[\])]")
"""Behind the name of a column, such as `` [m]``: no column of its own where blanks separate them."""


def read_points(content: bytes, name: str) -> Array:
    """The points (n, 3) of a text. Raises InvalidTerrain naming the line and the column."""
    lines = content[:65536].decode("utf-8", "replace").lstrip("\ufeff").split("\n")
    if not lines:
        raise InvalidTerrain(f"{name} is empty")
    skip, stated = _comments(lines, 0), 0
    if skip < len(lines) and lines[skip].strip().isdecimal():
        stated = int(lines[skip])  # how many points there are, as in PTS files
        lines[skip] = ""
        skip = _comments(lines, skip)
    if skip == len(lines):
        raise InvalidTerrain(f"{name} has no rows of numbers")
    first = _UNITS.sub("", lines[skip])
    separator = next((s for s in (";", ",", "\t") if s in first), None)
    words = [word.strip().strip('"') for word in (first.split(separator) if separator else first.split())]
    columns = None
    if any(number_of(word) is None for word in words[:3]):
        if not any(word.lstrip("+-.")[:1].isdecimal() for word in words[:3]):
            columns, skip = _columns(words, name), skip + 1
            _require_called(content, separator, skip, len(words), name)
    elif len(words) < 3:
        raise InvalidTerrain(f"{name} needs three numbers in each row, there are {len(words)}")
    else:
        columns = _columns_of_comment(lines[:skip], separator, len(words), name)
        if columns is None and separator == ",":
            _require_no_fractions(lines, skip, name)
    points = _numbers(content, separator, skip, columns or (0, 1, 2), name)
    if len(points) < stated:
        raise InvalidTerrain(f"{name} is cut: it states {stated} points and holds {len(points)}")
    if columns is None and len(words) > 3 and _counts_rows(points[:, 0]):
        raise InvalidTerrain(
            f"the first of the {len(words)} columns of {name} counts the rows, from {points[0, 0]:g} to "
            f"{points[-1, 0]:g}, and no heading says which columns are x, y and z: give it one, such as "
            f"{(separator or ' ').join(['id', 'x', 'y', 'z'])}"
        )
    return points


def _comments(lines: list[str], first: int) -> int:
    """Where the comments and empty lines end that begin at ``first``."""
    while first < len(lines) and (not lines[first].strip() or lines[first].lstrip().startswith(("#", "//", "%"))):
        first += 1
    return first


def _counts_rows(column: Array) -> bool:
    """Whether a column is 0, 1, 2 … or 1, 2, 3 …: the number of a point, and no coordinate."""
    return len(column) > 2 and column[0] in (0.0, 1.0) and bool((np.diff(column) == 1.0).all())


_CALLED = {
    "x": {"east", "easting", "e"},
    "y": {"north", "northing", "n"},
    "z": {"height", "elevation", "elev", "altitude", "alt", "up", "h", "u"},
}
"""What else headings call the columns x, y and z."""
_DOWN = {"down", "depth", "d"}
_GLOBE = {"lon", "long", "longitude", "lat", "latitude"}


def _columns(words: list[str], name: str) -> tuple[int, int, int]:
    """Which columns a heading calls x, y and z."""
    found = _called(words)
    missing = [axis for axis in "xyz" if not found[axis]]
    if missing:
        raise InvalidTerrain(
            f"{name} begins with {', '.join(words[:6])}: its heading needs columns x, y and z, or east, north and "
            f"height (up); it has none for {', '.join(missing)}"
        )
    twice = [axis for axis in "xyz" if len(found[axis]) > 1]
    if twice:
        raise InvalidTerrain(f"the heading of {name} has {twice[0]} twice: {', '.join(words[:9])}; call each otherwise")
    return found["x"][0], found["y"][0], found["z"][0]


def _require_called(content: bytes, separator: str | None, skip: int, count: int, name: str) -> None:
    """Raise InvalidTerrain for a row of more columns than the ``count`` that a heading calls.

    R writes the number of a row before it, and no name above that; x,y,z above 1,5,2,5,3,5 has commas for points.
    """
    for line, row in enumerate(_text(content), 1):
        if line <= skip or len(row.split(separator)) <= count:
            continue
        words = [word.strip() for word in re.split("#|//|%", row)[0].split(separator)]
        # without a separator, the last column may be a text of several words
        in_words = separator is None and not any(number_of(word) is not None for word in words[count - 1 :])
        if len(words) > count and any(words[count:]) and not in_words:
            raise InvalidTerrain(
                f"{name}: line {line} has {len(words)} columns and its heading {count}, so that which is x is not to "
                "tell: give each a name, such as id for the number of a row, and write a point where a comma is in "
                "numbers"
            )


def _require_no_fractions(lines: list[str], skip: int, name: str) -> None:
    """Raise InvalidTerrain for a second column that is a fraction behind a comma, such as 05: 1,05,2,5,3,25."""
    for line, row in enumerate(lines[skip:-1], skip + 1):
        second = [*row.split(","), ""][1].strip()
        if _FRACTION.fullmatch(second):
            raise InvalidTerrain(
                f"{name}: line {line} has {second!r} behind its first comma, which is no number but a fraction: write "
                "a point where a comma is in numbers"
            )


def _called(words: list[str]) -> dict[str, list[int]]:
    """Columns by the axis that a heading calls them: by its letter, else by other names of it."""
    numbered = list(enumerate(_plain(words)))
    return {
        axis: [i for i, word in numbered if word == axis] or [i for i, word in numbered if word in names]
        for axis, names in _CALLED.items()
    }


def _columns_of_comment(
    comments: list[str], separator: str | None, count: int, name: str
) -> tuple[int, int, int] | None:
    """Which columns a heading in a comment, the last one first, calls so; None where none is a heading of so many."""
    said = [_UNITS.sub("", one).lstrip("#/% \t") for one in comments if one.strip()]
    for one in said[::-1]:
        for words in (one.split(separator), one.split()):
            found = _called(words)
            if len(words) != count or not (found["x"] and found["y"]):
                continue
            # a third column may have any name, but of what counts downwards
            if not found["z"] and (found["x"][0], found["y"][0]) == (0, 1) and not {*_plain(words)} & _DOWN:
                return None
            return _columns([word.strip() for word in words], name)
    for words in (said[-1].split(separator), said[-1].split()) if said else ():
        if len(words) == count and {*_plain(words)[:3]} & _GLOBE:
            raise InvalidTerrain(
                f"{name} calls its first columns {', '.join(words[:3])}: reproject them to metres on a map, such as UTM"
            )
    return None


def _plain(words: list[str]) -> list[str]:
    return [word.strip().strip('"').lower().lstrip("/#") for word in words]


def _numbers(content: bytes, separator: str | None, skip: int, columns: tuple[int, ...], name: str) -> Array:
    try:
        return np.loadtxt(
            _text(content),
            delimiter=separator,
            skiprows=skip,
            usecols=columns,
            comments=("#", "//", "%"),
            ndmin=2,
        )
    except (ValueError, IndexError) as err:
        where = _no_number(_text(content), separator, skip, columns)
        raise InvalidTerrain(f"{name}: {where}; the columns x, y and z need a number in each row") from err


def _text(content: bytes) -> io.StringIO:
    return io.StringIO(content.decode("utf-8", "replace").lstrip("\ufeff"))


def _no_number(text: io.StringIO, separator: str | None, skip: int, columns: tuple[int, ...]) -> str:
    """The first place of a text where one of these columns has no number."""
    for line, written in enumerate(text, 1):
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
