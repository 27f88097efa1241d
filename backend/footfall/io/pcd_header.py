"""Headers of PCD files, and what makes of such a file one that its reader takes.

That reader knows version 0.7 alone, asks for the lines COUNT and POINTS, which may be left out, ends the names of the
fields at the first bracket of one (CloudCompare writes ``Roughness_(0.25)``), so that it takes points of another length
than they have, and parts numbers of a text at single blanks only.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass

from footfall.core.misread import Unreadable

_END = re.compile(rb"^[ \t]*DATA[ \t]+\w+[^\n]*(?:\n|\Z)", re.MULTILINE)
_HEAD = 65536
_AXES = ("x", "y", "z")
_SINGLE = ("F", "4")


@dataclass(frozen=True)
class PcdHeader:
    """fields: names, in the order of a point's numbers; kinds: type and size of each; counts: numbers of each.

    said: words of all lines by their keyword. end: where the points begin [bytes].
    """

    fields: tuple[str, ...]
    kinds: tuple[tuple[str, str], ...]
    counts: tuple[str, ...]
    said: Mapping[str, tuple[str, ...]]
    end: int

    @property
    def points(self) -> int:
        """How many there are, as it states."""
        if "POINTS" in self.said:
            return _count(self.said, "POINTS")
        return _count(self.said, "WIDTH") * _count(self.said, "HEIGHT")

    @property
    def single(self) -> bool:
        """Whether coordinates are numbers of 32 bit."""
        return any(kind == _SINGLE for field, kind in zip(self.fields, self.kinds, strict=True) if field in _AXES)


def header_of(content: bytes) -> PcdHeader:
    """The header of a PCD. Raises Unreadable saying what it lacks."""
    end = _END.search(content[:_HEAD])
    if end is None:
        raise Unreadable("its header has no line DATA")
    lines = [line.split() for line in content[: end.end()].decode("utf-8", "replace").split("\n")]
    said = {line[0].upper(): tuple(line[1:]) for line in lines if line and not line[0].startswith("#")}
    fields, sizes, kinds = (said.get(key, ()) for key in ("FIELDS", "SIZE", "TYPE"))
    counts = said.get("COUNT", ("1",) * len(fields))
    if not fields or not len(fields) == len(sizes) == len(kinds) == len(counts):
        raise Unreadable(
            f"its header has {len(fields)} FIELDS, {len(sizes)} SIZE, {len(kinds)} TYPE and {len(counts)} COUNT: each "
            "field needs one of each"
        )
    for axis in _AXES:
        at = [i for i, field in enumerate(fields) if field == axis]
        if len(at) > 1 or any(counts[i] != "1" for i in at):
            raise Unreadable(f"its header has {axis} more than once: a point has one")
    return PcdHeader(fields, tuple(zip(kinds, sizes, strict=True)), counts, said, end.end())


def plain_pcd(content: bytes, header: PcdHeader) -> bytes:
    """The same points below a header that the reader takes: fields but x, y and z are called by their number."""
    names = (field if field in _AXES else f"f{i}" for i, field in enumerate(header.fields))
    data = header.said["DATA"][0].lower()
    lines = (
        ("VERSION", "0.7"),
        ("FIELDS", *names),
        ("SIZE", *(size for _, size in header.kinds)),
        ("TYPE", *(kind for kind, _ in header.kinds)),
        ("COUNT", *header.counts),
        ("WIDTH", str(header.points)),
        ("HEIGHT", "1"),
        ("POINTS", str(header.points)),
        ("DATA", data),
    )
    body = content[header.end :]
    if data == "ascii":
        body = re.sub(rb"^ | $", b"", re.sub(rb"[ \t\r]+", b" ", body), flags=re.MULTILINE)
    return "".join(" ".join(line) + "\n" for line in lines).encode() + body


def _count(said: Mapping[str, tuple[str, ...]], key: str) -> int:
    words = said.get(key, ())
    if len(words) != 1 or not words[0].isdecimal():
        raise Unreadable(f"its header needs a line {key} with a whole number")
    return int(words[0])
