"""Collision shapes of a URDF as surfaces: primitives, and meshes in STL, OBJ and DAE."""

import io
import re
from pathlib import Path

import coal
import numpy as np
import trimesh

from footfall.core.errors import InvalidRobot
from footfall.core.mesh import Mesh
from footfall.core.misread import Unreadable
from footfall.core.written import number_of
from footfall.io.mesh_text import plain_obj, require_whole_stl

MAX_TRIANGLES = 1_000_000
MAX_BYTES = 300_000_000
ENDINGS = (".stl", ".obj", ".dae")
CYLINDER_SIDES = 32
_HEAD = 1 << 20


def read_mesh(path: Path, address: str) -> tuple[Mesh, float]:
    """A mesh file, and the unit that its lengths were in [m]: of STL and OBJ, which say none, always 1.

    Raises InvalidRobot for what can't be read or has more than a million triangles.
    """
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        raise InvalidRobot(f"{address}: meshes are read as STL, OBJ and DAE, not {ending or 'without an ending'}")
    if path.stat().st_size > MAX_BYTES:
        raise InvalidRobot(f"{address} has more than {MAX_BYTES >> 20} MB; a simpler collision mesh would be right")
    content = path.read_bytes()
    unit = _collada_unit(content, address) if ending == ".dae" else 1.0
    try:
        content = plain_obj(content) if ending == ".obj" else content
        if ending == ".stl":
            require_whole_stl(content)
        vertices, triangles = _of_collada(path, content) if ending == ".dae" else _of_trimesh(content, ending)
    except InvalidRobot:
        raise
    except Exception as err:  # the parsers raise whatever they trip over
        why = f": {err}" if isinstance(err, Unreadable) else ""
        raise InvalidRobot(f"{address} can't be read as a mesh, it is cut or corrupt{why}") from err
    if not len(triangles):
        raise InvalidRobot(f"{address} has no triangles")
    if len(triangles) > MAX_TRIANGLES:
        raise InvalidRobot(
            f"{address} has {len(triangles)} triangles, more than {MAX_TRIANGLES} are refused; simplify it"
        )
    if not np.isfinite(vertices).all():
        raise InvalidRobot(f"{address} has vertices that are not finite numbers")
    return Mesh(unit * vertices, triangles.astype(np.int32)), unit


def box(size: np.ndarray) -> Mesh:
    """Box of those edges (3,) [m] about its centre."""
    return _mesh(trimesh.creation.box(extents=size))


def sphere(radius: float) -> Mesh:
    """Sphere [m]: 320 triangles with corners on it."""
    return _mesh(trimesh.creation.icosphere(subdivisions=2, radius=radius))


def cylinder(radius: float, length: float) -> Mesh:
    """Cylinder along z about its centre [m], its corners on the radius."""
    return _mesh(trimesh.creation.cylinder(radius=radius, height=length, sections=CYLINDER_SIDES))


def _mesh(made: trimesh.Trimesh) -> Mesh:
    return Mesh(np.asarray(made.vertices, float), np.asarray(made.faces, np.int32))


def _of_trimesh(content: bytes, ending: str) -> tuple[np.ndarray, np.ndarray]:
    # no resolver: a mesh file may not make us read others
    loaded = trimesh.load_scene(io.BytesIO(content), file_type=ending[1:], process=False, allow_remote=False)
    solid = loaded.to_mesh()
    return np.asarray(solid.vertices, np.float64), np.asarray(solid.faces)


def _of_collada(path: Path, content: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Through coal's reader (assimp): trimesh reads Collada only with a library that is not here.

    Like the viewers of URDFs it leaves the file's axes as they are, whatever its ``up_axis`` says.
    """
    if re.search(rb"<!(DOCTYPE|ENTITY)", content, re.IGNORECASE):
        raise InvalidRobot(f"{path.name} declares a document type or entities; take <!DOCTYPE …> out")
    loaded = coal.MeshLoader().load(str(path), np.ones(3))
    triangles = [tuple(loaded.tri_indices(i)[k] for k in range(3)) for i in range(loaded.num_tris)]
    return np.array(loaded.vertices(), float), np.array(triangles, np.int64).reshape(-1, 3)


_ASSET = re.compile(rb"<asset\b.*?</asset\s*>", re.DOTALL)
_UNIT = re.compile(rb"<unit\b[^>]*?\smeter\s*=\s*[\"']([^\"']*)[\"']", re.DOTALL)
_COMMENT = re.compile(rb"<!--.*?-->", re.DOTALL)


def _collada_unit(content: bytes, address: str) -> float:
    """The unit [m] that the head of a Collada file states, which the reader passes over; 1 without one.

    RViz, Gazebo and Bullet go by it too.
    """
    head = _ASSET.search(_COMMENT.sub(b"", content[:_HEAD]))
    stated = None if head is None else _UNIT.search(head[0])
    if stated is None:
        return 1.0
    written = stated[1][:40].decode("utf-8", "replace")
    unit = number_of(written)
    if unit is None or not 0 < unit < np.inf:
        raise InvalidRobot(
            f"{address} states a unit of {written!r} metres; a number above zero would be right, such as "
            '<unit meter="0.001"/>'
        )
    return unit
