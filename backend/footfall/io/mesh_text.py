"""OBJ, OFF and STL as the readers of meshes take them: they pass over lines that they don't know, such as indented
ones, and over the last solid of an STL that is cut.
"""

import re

from footfall.core.misread import Unreadable

_ODD_OBJ = re.compile(rb"^(?:[ \t]+[vf]|[vf]\t|v[ \t][^\n]*#)|\\\r?\n", re.MULTILINE)
_OFF = re.compile(rb"(?:ST)?C?N?OFF(?![A-Za-z])")


def plain_obj(content: bytes) -> bytes:
    """An OBJ without indents, tabs, continued lines and comments behind vertices, its vertices counted from one.

    Raises Unreadable for a vertex 0, and vertices without three numbers.
    """
    if _ODD_OBJ.search(content):
        content = re.sub(rb"\\\r?\n", b" ", content)
        content = re.sub(rb"^[ \t]*([vf]|vt|vn)[ \t]+", rb"\1 ", content, flags=re.MULTILINE)
        content = re.sub(rb"^(v [^\n#]*)#[^\n]*", rb"\1", content, flags=re.MULTILINE)
    short = re.search(rb"^v(?: +[^\s]+){0,2} *\r?$", content, re.MULTILINE)
    if short is not None:
        line = content.count(b"\n", 0, short.start()) + 1
        raise Unreadable(f"line {line}, {short[0].decode('ascii', 'replace').strip()!r}, is no vertex of three numbers")
    return _counted_from_one(content)


def plain_off(content: bytes) -> bytes:
    """An OFF without comments and empty lines, whatever its vertices have behind their three coordinates.

    Raises Unreadable for vertices of other dimensions.
    """
    first = content.lstrip()[:40]
    if not first.startswith(b"OFF") and first.partition(b"OFF")[1] and not _OFF.match(first):
        kind = first.partition(b"OFF")[0].decode("ascii", "replace") + "OFF"
        raise Unreadable(f"it is {kind!r}: vertices of three coordinates are read, OFF, COFF, NOFF and STOFF")
    if b"#" not in content and b"\n\n" not in content:
        return content
    lines = (line.partition(b"#")[0].strip() for line in content.split(b"\n"))
    return b"\n".join(line for line in lines if line) + b"\n"


def require_whole_stl(content: bytes) -> None:
    """Raise Unreadable for an STL in text with facets of other than three corners, or with a solid that has no end."""
    if content[:5].lower() != b"solid" or is_binary_stl(content):
        return
    corners = [loop.lower().count(b"vertex") for loop in re.split(rb"(?i)\bendloop\b", content)[:-1]]
    odd = next((number for number, count in enumerate(corners) if count != 3), None)
    if odd is not None:
        raise Unreadable(f"facet {odd} has {corners[odd]} corners; STL has triangles only")
    behind = re.split(rb"(?i)\bendsolid\b", content)[-1]
    if re.search(rb"(?i)\bfacet\s+normal\b", behind):
        raise Unreadable("its last solid has no endsolid: the file is cut")


def is_binary_stl(content: bytes) -> bool:
    """Whether an STL is as long as the triangles that it states; one in text may begin with the same word."""
    return len(content) == 84 + 50 * int.from_bytes(content[80:84], "little")


def _counted_from_one(content: bytes) -> bytes:
    """An OBJ whose faces name vertices by their number in the file.

    OBJ also counts backwards (-1: the last vertex *so far*), which the reader takes from the end of the file. Raises
    Unreadable for a vertex 0.
    """
    if not re.search(rb"^[ \t]*f[ \t](?:[^\n]*[ \t])?(?:-|0+[/ \t\r\n])", content, re.MULTILINE):
        return content
    vertices, lines = 0, []
    for line in content.replace(b"\\\n", b" ").split(b"\n"):
        words = line.split()
        vertices += words[:1] == [b"v"]
        if words[:1] == [b"f"]:
            numbers = [int(word.split(b"/")[0]) for word in words[1:]]
            if 0 in numbers:
                raise Unreadable("a face names vertex 0, the first is 1")
            line = b"f " + b" ".join(b"%d" % (n if n > 0 else vertices + 1 + n) for n in numbers)
        lines.append(line)
    return b"\n".join(lines)
