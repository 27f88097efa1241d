"""Faces of mesh files with more than three corners, OBJ, OFF and PLY, read here and cut into triangles.

The mesh library cuts faces as fans, which fills the pits that concave ones run around, and does not read files in
which faces differ in their number of corners.
"""

import re
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from footfall.core.ears import triangles_of
from footfall.core.misread import Unreadable

MOST_CORNERS = 20_000
"""Of one face; clipping ears takes the square of it."""

_NUMBERS = {
    **dict.fromkeys(("char", "int8"), "i1"), **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"), **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"), **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"), **dict.fromkeys(("double", "float64"), "f8"),
}  # fmt: skip

Parts = tuple[NDArray[np.float64], NDArray[np.int64]]


def polygons_in(content: bytes, ending: str) -> bool:
    """Whether a file has a face of more than three corners; a file of triangles alone is for the mesh library."""
    if ending == "obj":
        return re.search(rb"^[ \t]*f(?:[ \t]+[^\s\\]+){4}", content.replace(b"\\\n", b" "), re.MULTILINE) is not None
    try:
        if ending == "off":
            vertices, lines = _off_lines(content)
            return any(line[0] != b"3" for line in lines[vertices:])
        return ending == "ply" and _ply_polygons(content)
    except (LookupError, TypeError, ValueError):
        return False  # whoever reads it says what is wrong


def read_polygons(content: bytes, ending: str) -> Parts:
    """Vertices (n, 3) and triangles (m, 3) of such a file.

    Raises Unreadable saying what is wrong with it.
    """
    vertices, faces = _faces(content, ending)
    triangles: list[NDArray[np.int64]] = []
    for number, face in enumerate(faces):
        if len(face) < 3:
            raise Unreadable(f"face {number} has {len(face)} corners")
        if len(face) > MOST_CORNERS:
            raise Unreadable(f"face {number} has {len(face)} corners, more than {MOST_CORNERS} are refused")
        if face.min() < 0 or face.max() >= len(vertices):
            raise Unreadable(f"face {number} names a vertex past the {len(vertices)} that there are")
        try:
            triangles.append(face[triangles_of(vertices[face])] if len(face) > 3 else face[None])
        except ValueError as err:
            raise Unreadable(f"face {number} can't be cut into triangles: {err}") from err
    return vertices, np.concatenate(triangles) if triangles else np.zeros((0, 3), np.int64)


def _faces(content: bytes, ending: str) -> tuple[NDArray[np.float64], list[NDArray[np.int64]]]:
    return {"obj": _of_obj, "off": _of_off, "ply": _of_ply}[ending](content)


def _of_obj(content: bytes) -> tuple[NDArray[np.float64], list[NDArray[np.int64]]]:
    vertices: list[list[float]] = []
    faces: list[NDArray[np.int64]] = []
    for line in content.replace(b"\\\n", b" ").split(b"\n"):
        words = line.partition(b"#")[0].split()
        if words[:1] == [b"v"]:
            vertices.append([float(word) for word in words[1:4]])
        elif words[:1] == [b"f"]:
            faces.append(np.array([int(word.split(b"/")[0]) - 1 for word in words[1:]]))
    return np.array(vertices, float).reshape(-1, 3), faces


def _off_lines(content: bytes) -> tuple[int, list[list[bytes]]]:
    """How many vertices there are, and the words of each line of vertices and faces."""
    lines = [line for raw in content.split(b"\n") if (line := raw.partition(b"#")[0].split())]
    if not lines or re.fullmatch(rb"(?:ST)?C?N?OFF", lines[0][0]) is None:
        raise Unreadable("it does not begin with OFF")
    lines[0] = lines[0][1:]
    lines = [line for line in lines if line]
    count, number = int(lines[0][0]), int(lines[0][1])
    if len(lines) < 1 + count + number:
        raise Unreadable(f"it states {count} vertices and {number} faces and holds {len(lines) - 1} lines")
    return count, lines[1 : 1 + count + number]


def _of_off(content: bytes) -> tuple[NDArray[np.float64], list[NDArray[np.int64]]]:
    count, lines = _off_lines(content)
    vertices = np.array([[float(word) for word in line[:3]] for line in lines[:count]]).reshape(-1, 3)
    return vertices, [np.array([int(word) for word in line[1 : 1 + int(line[0])]]) for line in lines[count:]]


Element = tuple[str, int, list[list[str]]]


def _ply_parts(content: bytes) -> tuple[bytes, list[Element], bytes]:
    """Format, elements with their properties, and the body."""
    header, marker, body = content.partition(b"end_header")
    if not marker:
        raise Unreadable("its header has no end")
    form, elements = b"", []
    for line in header.split(b"\n"):
        words = line.split()
        if words[:1] == [b"format"]:
            form = words[1]
        elif words[:1] == [b"element"]:
            elements.append((words[1].decode(), int(words[2]), []))
        elif words[:1] == [b"property"]:
            elements[-1][2].append([word.decode() for word in words[1:]])
    return form, elements, body[body.index(b"\n") + 1 :]


def _ply_polygons(content: bytes) -> bool:
    form, elements, body = _ply_parts(content)
    before = elements[: [one[0] for one in elements].index("face")]
    _, count, properties = elements[len(before)]
    if properties[0][0] != "list" or any(one[0] == "list" for *_, others in before for one in others):
        return True
    if form == b"ascii":
        rows = [line for line in body.split(b"\n") if line.strip()][sum(number for _, number, _ in before) :]
        return any(row.split(None, 1)[0] != b"3" for row in rows[:count])
    order = ">" if form == b"binary_big_endian" else "<"
    skipped = sum(number * sum(np.dtype(_NUMBERS[one[0]]).itemsize for one in others) for _, number, others in before)
    if any(one[0] == "list" for one in properties[1:]):
        return _listed_polygons(body, skipped, count, properties, order)
    corners = [("count", order + _NUMBERS[properties[0][1]]), ("corners", order + _NUMBERS[properties[0][2]], (3,))]
    row = np.dtype([*corners, *((one[1], order + _NUMBERS[one[0]]) for one in properties[1:])])
    if len(body) < skipped + count * row.itemsize:
        return False  # it is cut
    return bool((np.frombuffer(body, row, count, skipped)["count"] != 3).any())


def _listed_polygons(body: bytes, at: int, count: int, properties: list[list[str]], order: str) -> bool:
    """Whether faces that have more lists than one, such as coordinates of a texture, differ in the lengths of a list,
    or have other than three corners."""
    first, _ = _binary(body, at, min(count, 1), properties, order, "face")
    fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
    lengths: dict[str, int] = {}
    for number, one in enumerate(properties):
        if one[0] != "list":
            fields.append((f"of {number}", order + _NUMBERS[one[0]]))
            continue
        held = first[0][one[3]] if first else []
        lengths[f"count {number}"] = length = len(held) if isinstance(held, list) else 0
        fields += [(f"count {number}", order + _NUMBERS[one[1]]), (f"of {number}", order + _NUMBERS[one[2]], (length,))]
    row = np.dtype(fields)
    if lengths.get("count 0") != 3 or len(body) < at + count * row.itemsize:
        return True
    rows = np.frombuffer(body, row, count, at)
    return any((rows[name] != length).any() for name, length in lengths.items())


def _of_ply(content: bytes) -> tuple[NDArray[np.float64], list[NDArray[np.int64]]]:
    form, elements, body = _ply_parts(content)
    rows = _text_rows(body) if form == b"ascii" else None
    order = ">" if form == b"binary_big_endian" else "<"
    vertices, faces, at = np.zeros((0, 3)), [], 0
    for name, count, properties in elements:
        if rows is not None:
            table = [next(rows, None) for _ in range(count)]
            if None in table:
                raise Unreadable(f"it is cut: it states {count} lines of {name}")
            values = [_split(row or [], properties) for row in table]
        else:
            values, at = _binary(body, at, count, properties, order, name)
        if name == "vertex":
            vertices = np.array([[one["x"], one["y"], one["z"]] for one in values], float).reshape(-1, 3)
        elif name == "face":
            listed = next((key for key in ("vertex_indices", "vertex_index") if values and key in values[0]), None)
            if listed is None:
                raise Unreadable("its faces have no list vertex_indices")
            faces = [np.array(one[listed], np.int64) for one in values]
    return vertices, faces


def _text_rows(body: bytes) -> Iterator[list[bytes]]:
    return (words for line in body.split(b"\n") if (words := line.split()))


def _split(row: list[bytes], properties: list[list[str]]) -> dict[str, object]:
    found: dict[str, object] = {}
    at = 0
    for one in properties:
        if one[0] == "list":
            count = int(row[at])
            found[one[3]] = [int(float(word)) for word in row[at + 1 : at + 1 + count]]
            at += 1 + count
        else:
            found[one[1]] = float(row[at])
            at += 1
    return found


def _binary(
    body: bytes, at: int, count: int, properties: list[list[str]], order: str, name: str
) -> tuple[list[dict[str, object]], int]:
    named = [one[1:3] if one[0] == "list" else one[:1] for one in properties]
    kinds = [[np.dtype(order + _NUMBERS[word]) for word in words] for words in named]
    found: list[dict[str, object]] = []
    for _ in range(count):
        row: dict[str, object] = {}
        for one, kind in zip(properties, kinds, strict=True):
            number = 1
            if one[0] == "list":
                number = int(_taken(body, at, kind[0], 1, name)[0])
                at += kind[0].itemsize
            values = _taken(body, at, kind[-1], number, name)
            at += number * kind[-1].itemsize
            row[one[-1]] = values.tolist() if one[0] == "list" else float(values[0])
        found.append(row)
    return found, at


def _taken(body: bytes, at: int, kind: np.dtype, count: int, name: str) -> np.ndarray:
    if count < 0 or at + count * kind.itemsize > len(body):
        raise Unreadable(f"it is cut in the middle of its element {name}")
    return np.frombuffer(body, kind, count, at)
