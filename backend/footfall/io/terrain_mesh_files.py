"""Terrain as triangle meshes: PLY, OBJ, OFF and STL through trimesh."""

import io
import re

import numpy as np
import trimesh

from footfall.core.errors import InvalidTerrain
from footfall.core.mesh import Mesh
from footfall.terrain.dem import Dem
from footfall.terrain.ground.rasterise import rasterise
from footfall.terrain.ground.triangulate import triangulate

MAX_TRIANGLES = 20_000_000
MAX_COORDINATE = 1e8
"""Farther vertices [m] are refused: products of such numbers would leave the range of floats."""


def read_mesh(content: bytes, name: str, resolution: float | None = None) -> Dem:
    """Highest surface of a mesh, z up; see :func:`footfall.terrain.ground.rasterise.rasterise`."""
    ending = name.rsplit(".", 1)[-1].lower()
    try:
        # no resolver: a mesh file may not make us read others
        loaded = trimesh.load_scene(io.BytesIO(content), file_type=ending, process=False, allow_remote=False)
        solid = loaded.to_mesh()
        vertices, triangles = np.asarray(solid.vertices, np.float64), np.asarray(solid.faces)
    except Exception as err:  # the parsers raise whatever they trip over
        raise InvalidTerrain(f"{name} can't be read as a mesh, it may be corrupt: {err}") from err
    if not len(triangles):
        raise InvalidTerrain(f"{name} has no triangles; a terrain needs a surface, not points")
    if len(triangles) > MAX_TRIANGLES:
        raise InvalidTerrain(f"{name} has {len(triangles)} triangles, more than {MAX_TRIANGLES} are refused")
    if not np.isfinite(vertices).all():
        raise InvalidTerrain(f"{name} has vertices that are not finite numbers")
    if np.abs(vertices).max() > MAX_COORDINATE:
        raise InvalidTerrain(f"{name} has coordinates beyond {MAX_COORDINATE:g}; its vertices must be metres")
    stated = _stated_faces(content) if ending == "off" else 0
    if len(triangles) < stated:
        raise InvalidTerrain(f"{name} is cut: it states {stated} faces and holds {len(triangles)} triangles")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise InvalidTerrain(f"{name} is corrupt: its triangles point past its {len(vertices)} vertices")
    return rasterise(Mesh(vertices, triangles.astype(np.int32)), resolution, name)


def _stated_faces(content: bytes) -> int:
    """Faces by the header of an OFF file; its reader takes as many as there are."""
    numbers = re.match(rb"\s*OFF\s+(?:#[^\n]*\s+)*(\d{1,12})\s+(\d{1,12})\s", content)
    return int(numbers[2]) if numbers else 0


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
    # PLY and STL hold float32
    reach = float(np.abs(mesh.vertices[:, :2]).max())
    if ending in (".ply", ".stl") and reach * 2.0**-23 > 0.01 * finest:
        raise InvalidTerrain(
            f"{ending} keeps seven digits, too few for cells of {finest:g} m at {reach:.0f} m from "
            "the origin; move the map to the origin, or write .obj or .off"
        )
    solid = trimesh.Trimesh(mesh.vertices, mesh.triangles, vertex_colors=colors, process=False)
    out = solid.export(file_type=ending[1:])
    return out.encode("ascii") if isinstance(out, str) else bytes(out)
