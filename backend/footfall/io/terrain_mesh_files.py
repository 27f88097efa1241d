"""Terrain as triangle meshes: PLY, OBJ, OFF and STL through trimesh."""

import codecs
import io
import re

import numpy as np

from footfall.core.errors import InvalidTerrain
from footfall.core.mesh import Mesh
from footfall.core.misread import Unreadable
from footfall.core.written import require_plain_numbers
from footfall.io.mesh_text import is_binary_stl, plain_obj, plain_off, require_whole_stl
from footfall.io.polygon_faces import polygons_in, read_polygons
from footfall.terrain.coarse_digits import of_32_bits, require_fine_digits
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import check_no_value_numbers
from footfall.terrain.ground.closed import closed_share
from footfall.terrain.ground.mesh_terrain import MOST_ERROR, terrain_of_mesh
from footfall.terrain.ground.triangulate import triangulate

MAX_CLOSED_SHARE = 0.1
"""A mesh is a surface while at most this share of it, seen from above, are closed solids."""

_ONE_WAY = 0.9
"""A share of what is seen of a mesh along an axis, by area, that looks one way where that axis is up."""
_STEEPEST = 10.0
"""Rise per run of a whole mesh that is no ground."""

MAX_TRIANGLES = 20_000_000
MAX_COORDINATE = 1e8
"""Farther vertices [m] are refused: products of such numbers would leave the range of floats."""


def read_mesh(
    content: bytes, name: str, resolution: float | None = None, unit: float = 1.0, most_error: float = MOST_ERROR
) -> Dem:
    """Highest surface of a mesh, z up; see :func:`footfall.terrain.ground.mesh_terrain.terrain_of_mesh`."""
    ending = name.rsplit(".", 1)[-1].lower()
    try:
        content = content.removeprefix(codecs.BOM_UTF8) if ending in ("obj", "off") else content
        if _is_text(content, ending):
            require_plain_numbers(content)
        _require_faces(content, ending)
        given = {"obj": plain_obj, "off": plain_off}.get(ending, bytes)(content)
        polygons = polygons_in(given, ending)
        vertices, triangles = read_polygons(given, ending) if polygons else _of_library(given, ending)
        if vertices.ndim != 2 or vertices.shape[1] != 3:
            raise Unreadable("its vertices need three numbers each")
    except MemoryError:
        raise
    except Exception as err:  # the parsers raise whatever they trip over
        why = f": {err}" if isinstance(err, Unreadable) else ""
        raise InvalidTerrain(f"{name} can't be read as a mesh, it is cut or corrupt{why}") from err
    if not len(triangles):
        raise InvalidTerrain(f"{name} has no triangles; a terrain needs a surface, not points")
    if len(triangles) > MAX_TRIANGLES:
        raise InvalidTerrain(f"{name} has {len(triangles)} triangles, more than {MAX_TRIANGLES} are refused")
    if not np.isfinite(vertices).all():
        raise InvalidTerrain(f"{name} has vertices that are not finite numbers")
    if np.abs(vertices).max() > MAX_COORDINATE:
        raise InvalidTerrain(f"{name} has coordinates beyond {MAX_COORDINATE:g}; its vertices must be metres")
    _check_whole(given, ending, len(triangles), name)
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise InvalidTerrain(f"{name} is corrupt: its triangles point past its {len(vertices)} vertices")
    used = np.zeros(len(vertices), bool)
    used[triangles] = True
    check_no_value_numbers(vertices[used, 2], name, "leave those vertices and their faces out")
    require_fine_digits(vertices[used], name, resolution, corners=True)
    mesh = Mesh(vertices, triangles.astype(np.int32))
    if (axis := _other_up(mesh)) is not None:
        raise InvalidTerrain(
            f"{name} lies on its side: seen along {axis} its faces look one way, seen along z they don't, so that "
            f"{axis} seems to be up; export it with z up"
        )
    if (closed := closed_share(mesh)) > MAX_CLOSED_SHARE:
        raise InvalidTerrain(
            f"{name} is not a surface: {closed:.0%} of it, seen from above, are closed solids (up to "
            f"{MAX_CLOSED_SHARE:.0%}, such as rocks, is accepted); keep only the upper side, z up",
            closed_share=closed,
            limit=MAX_CLOSED_SHARE,
        )
    dem = terrain_of_mesh(mesh, resolution, name, unit, most_error)
    if _blurs(vertices, dem.geometry.resolution) and (_holds_float32(content, ending) or of_32_bits(vertices)):
        raise InvalidTerrain(
            f"{name} keeps seven digits of coordinates up to {np.abs(vertices[:, :2]).max():z.0f} m, so its vertices "
            f"lie up to {_rounding(vertices):.2g} m off; export it about an origin near the ground, or as doubles"
        )
    return dem


def _other_up(mesh: Mesh) -> str | None:
    """The axis that is up in a mesh that lies on its side; None where z may be up.

    A map seen along another axis than its own shows less of itself, and as much of its back as of its front; a cliff
    shows its front from everywhere, and one as steep as ``_STEEPEST`` is none to walk on.
    """
    corners = np.asarray(mesh.vertices, np.float64)[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    seen, front = np.abs(normals).sum(axis=0), np.abs(normals.sum(axis=0))
    for number, axis in enumerate("xy"):
        one_way = front[number] > _ONE_WAY * seen[number]
        both_ways = front[2] < 0.5 * seen[2]
        if one_way and seen[number] > seen[2] * (1.0 if both_ways else _STEEPEST):
            return axis
    return None


def _of_library(content: bytes, ending: str) -> tuple[np.ndarray, np.ndarray]:
    # no resolver: a mesh file may not make us read others
    import trimesh

    loaded = trimesh.load_scene(io.BytesIO(content), file_type=ending, process=False, allow_remote=False)
    solid = loaded.to_mesh()
    return np.asarray(solid.vertices, np.float64), np.asarray(solid.faces)


def _require_faces(content: bytes, ending: str) -> None:
    """Raise Unreadable for faces that the readers pass over or take apart wrongly, without a word."""
    if ending == "stl":
        require_whole_stl(content)
    curved = re.search(rb"^[ \t]*(surf|bsp|bzp|cdc|cdp|fo)[ \t]", content, re.MULTILINE) if ending == "obj" else None
    if curved is not None:
        raise Unreadable(
            f"it has elements {curved[1].decode()!r}, curved surfaces or faces of old files, which are not read; write "
            "it as polygons"
        )


def _is_text(content: bytes, ending: str) -> bool:
    if ending == "stl":
        return not is_binary_stl(content)
    return ending != "ply" or re.match(rb"ply\s+format ascii", content) is not None


def _check_whole(content: bytes, ending: str, triangles: int, name: str) -> None:
    """Refuse files that hold less than their header states; their readers take what there is."""
    if ending == "off":
        stated = re.match(rb"\s*OFF\s+(?:#[^\n]*\s+)*(\d{1,12})\s+(\d{1,12})\s", content)
        if stated and triangles < int(stated[2]):
            raise InvalidTerrain(f"{name} is cut: it states {int(stated[2])} faces and holds {triangles} triangles")
    if ending == "ply" and _is_text(content, ending):
        header, _, body = content.partition(b"end_header")
        stated = sum(map(int, re.findall(rb"^element \S+ (\d{1,12})", header, re.MULTILINE)))
        held = sum(1 for line in body.split(b"\n") if line.strip())
        if held < stated:
            raise InvalidTerrain(f"{name} is cut: it states {stated} lines of vertices and faces and holds {held}")


def _holds_float32(content: bytes, ending: str) -> bool:
    header = content[: content.find(b"end_header")] if ending == "ply" else b""
    return ending == "stl" or bool(re.search(rb"^property\s+float(?:32)?\s+[xy]\s*$", header, re.MULTILINE))


def _rounding(vertices: np.ndarray) -> float:
    """How far float32 may move the coordinates of these vertices (n, 3) along x or y [m]."""
    return float(np.abs(vertices[:, :2]).max()) * 2.0**-23


def _blurs(vertices: np.ndarray, finest: float) -> bool:
    """Whether float32 moves vertices by more than a hundredth of ``finest`` [m]."""
    return _rounding(vertices) > 0.01 * finest


def write_mesh(dem: Dem, ending: str) -> bytes:
    """The triangulation as ``.ply``, ``.obj``, ``.off`` or ``.stl``; PLY with the texture as colours of the vertices.

    Raises InvalidTerrain where no triangle is left, or float32 files would blur the map.
    """
    mesh = triangulate(dem)
    if not len(mesh.triangles):
        raise InvalidTerrain("the terrain has no 2 × 2 block of known cells, so it has no triangles to write")
    colors = None
    if dem.texture is not None and ending == ".ply":
        row, col = dem.geometry.cell(mesh.vertices[:, 0], mesh.vertices[:, 1])
        grey = dem.texture[row, col]
        colors = np.stack([grey, grey, grey, np.full_like(grey, 255)], axis=1)
    return encode_mesh(mesh, ending, dem.geometry.resolution, colors)


def encode_mesh(mesh: Mesh, ending: str, finest: float, colors: np.ndarray | None = None) -> bytes:
    """Any mesh as a file. finest: length that must not blur [m]; colors: (vertices, 4) uint8 RGBA."""
    if ending in (".ply", ".stl") and _blurs(mesh.vertices, finest):  # they hold float32
        raise InvalidTerrain(
            f"{ending} keeps seven digits, too few for cells of {finest:g} m at "
            f"{np.abs(mesh.vertices[:, :2]).max():z.0f} m from the origin; move the map to the origin, or write .obj "
            "or .off"
        )
    import trimesh

    solid = trimesh.Trimesh(mesh.vertices, mesh.triangles, vertex_colors=colors, process=False)
    out = solid.export(file_type=ending[1:])
    return out.encode("ascii") if isinstance(out, str) else bytes(out)
