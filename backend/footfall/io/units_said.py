"""Units of length that files say in comments, headers and headings, where their format has no place for one."""

import re

from footfall.core.errors import InvalidTerrain
from footfall.terrain.scan import UNITS

_SPELLINGS = {
    "m": ("m", "metre", "metres", "meter", "meters"),
    "cm": ("cm", "centimetre", "centimetres", "centimeter", "centimeters"),
    "mm": ("mm", "millimetre", "millimetres", "millimeter", "millimeters"),
    "km": ("km", "kilometre", "kilometres", "kilometer", "kilometers"),
    "ft": ("ft", "foot", "feet"),
    "us-ft": ("us-ft", "us ft", "usft", "ftus", "us survey foot", "us survey feet"),
    "in": ("inch", "inches"),
    "deg": ("deg", "degree", "degrees", "°"),
}
_MEANT = {spelt: unit for unit, spellings in _SPELLINGS.items() for spelt in spellings}
_FACTORS = {**UNITS, "in": 0.0254}
_UNIT = "(?:1 +)?[\\[(\"']?(" + "|".join(sorted(map(re.escape, _MEANT), key=len, reverse=True)) + ")(?![\\w/^*²³-])"
_SAID = re.compile(
    rf"\bunits?(?: of length)?(?: *[:=] *| +(?:is|are|in) +| +){_UNIT}"
    rf"|\b(?:coordinates|dimensions|lengths|vertices|positions)(?: are)?(?: given)? in +{_UNIT}",
    re.IGNORECASE,
)
_OF_COLUMN = re.compile(
    r"\b(?:[xyz]|east(?:ing)?|north(?:ing)?|height|elev(?:ation)?|alt(?:itude)?|up) *[\[(] *([^\])]{1,20}?) *[\])]",
    re.IGNORECASE,
)
_HEAD = 65536
_TEXTS = (".xyz", ".csv", ".txt")


def units_said(content: bytes, ending: str) -> list[str]:
    """What the comments and the header of a file call the unit of its coordinates, as it spells it, in order."""
    head = content[:_HEAD]
    if ending in (".las", ".laz"):
        return []
    if ending == ".stl":
        first = head.partition(b"\n")[0] if head[:5].lower() == b"solid" else head
        comments = [first[:80].decode("latin-1").replace("_", " ")]
    elif ending == ".ply":
        lines = head.partition(b"end_header")[0].decode("latin-1").splitlines()
        comments = [line.partition(" ")[2] for line in lines if line.startswith(("comment ", "obj_info "))]
    elif ending == ".vtk":
        comments = head.decode("latin-1").split("\n")[1:2]
    else:
        lines = [line.strip() for line in head.decode("utf-8", "replace").lstrip("\ufeff").split("\n")]
        comments = [line for line in lines if line.startswith(("#", "//", "%"))]
        heading = next((line for line in lines if line and line not in comments), "") if ending in _TEXTS else ""
        return [*_said(comments), *(one for line in (*comments, heading) for one in _OF_COLUMN.findall(line))]
    return _said(comments)


def _said(comments: list[str]) -> list[str]:
    return [found[1] or found[2] for line in comments for found in _SAID.finditer(line)]


def require_unit_said(content: bytes, ending: str, name: str, unit: str | None) -> None:
    """Check the unit of a scan's coordinates against what its file says of them.

    Raises InvalidTerrain where that is another one, or degrees.
    """
    for said in units_said(content, ending):
        meant = _MEANT.get(said.lower())
        if meant == "deg":
            raise InvalidTerrain(f"{name} has coordinates in degrees, as it says itself; reproject it to metres")
        if unit is None or meant in (None, unit):
            continue
        how = f"state --unit {meant}" if meant in UNITS else "bring it to metres"
        raise InvalidTerrain(
            f"{name} says itself that its unit is {said}, not {unit}: {how}, or correct it", unit=meant
        )


def require_scale_said(content: bytes, ending: str, name: str, scale: float) -> None:
    """Check the scale of a mesh against the unit that its file says, of metres any.

    Raises InvalidTerrain where the scale does not make metres of that.
    """
    for said in units_said(content, ending):
        meant = _MEANT.get(said.lower())
        if meant == "deg":
            raise InvalidTerrain(f"{name} has coordinates in degrees, as it says itself; reproject it to metres")
        factor = _FACTORS.get(meant or "")
        if factor not in (None, 1.0) and abs(scale - factor) > 1e-5 * factor:
            given = "read as metres" if scale == 1.0 else f"multiplied by {scale:g}"
            raise InvalidTerrain(
                f"{name} says itself that its unit is {said}, and would be {given}: read it with --scale {factor:.9g} "
                f"(footfall terrain convert; scale={factor:.9g} of read_terrain), or correct what it says",
                unit=meant,
            )
