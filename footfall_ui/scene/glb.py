"""Binary glTF of triangles with a picture on them: unlit what has a meaning, physically lit what is a thing.

The scene's lights would wash out colours that mean something, and take a computer without graphics most of the time
of a picture.
"""

import io
import json
import struct
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from footfall.core.arrays import Array
from footfall.core.mesh import Mesh
from footfall_ui.scene.near import near

SHORT = 0xFFFF
"""Numbers below it fit in sixteen bits; WebGL keeps it for itself among indices."""
NEAREST = 9728
"""glTF's number for the texel that is nearest, unmixed."""
_KINDS = {"f": 5126, "u2": 5123, "u4": 5125}
_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3"}


class Glb:
    """A file that is put together: numbers first, then what is drawn of them with one picture."""

    def __init__(self) -> None:
        self._content = bytearray()
        self._tree: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{}],
            "extensionsUsed": [],
            "bufferViews": [],
            "accessors": [],
        }

    def view(self, content: bytes, stride: int = 0) -> int:
        """Bytes of the file, which begin at a multiple of four. stride: from one vertex to the next."""
        self._content += bytes(-len(self._content) % 4)
        more = {"byteStride": stride} if stride else {}
        place = {"buffer": 0, "byteOffset": len(self._content), "byteLength": len(content)}
        self._content += content
        self._tree["bufferViews"].append(place | more)
        return len(self._tree["bufferViews"]) - 1

    def numbers(self, numbers: NDArray[Any], view: int | None = None) -> int:
        """Indices (n,) or points (n, 2 or 3); view: where they lie already, None: they are put in."""
        kind = _KINDS[numbers.dtype.kind if numbers.dtype.kind == "f" else numbers.dtype.str[1:]]
        at = self.view(np.ascontiguousarray(numbers).tobytes()) if view is None else view
        accessor: dict[str, Any] = {"bufferView": at, "componentType": kind, "count": len(numbers)}
        accessor["type"] = _TYPES[1 if numbers.ndim == 1 else numbers.shape[1]]
        if numbers.ndim == 2 and numbers.shape[1] == 3:
            accessor |= {"min": numbers.min(axis=0).tolist(), "max": numbers.max(axis=0).tolist()}
        self._tree["accessors"].append(accessor)
        return len(self._tree["accessors"]) - 1

    def needs(self, *extensions: str) -> None:
        """Whoever reads the file must know them."""
        self._tree["extensionsUsed"] += extensions
        self._tree["extensionsRequired"] = list(extensions)

    def draw(
        self,
        primitives: list[dict[str, Any]],
        picture: NDArray[np.uint8],
        place: ArrayLike,
        scale: ArrayLike = (1.0, 1.0, 1.0),
        texture: dict[str, Any] | None = None,
    ) -> None:
        """picture: (rows, cols, 3 or 4), row 0 south; the fourth is opacity. texture: what more is said of it."""
        if not primitives:
            return
        self._tree["extensionsUsed"].append("KHR_materials_unlit")
        material = {
            "pbrMetallicRoughness": {
                "baseColorTexture": {"index": 0} | (texture or {}),
                "metallicFactor": 0.0,
                "roughnessFactor": 1.0,
            },
            "alphaMode": "BLEND" if picture.shape[2] == 4 else "OPAQUE",
            "doubleSided": True,
            "extensions": {"KHR_materials_unlit": {}},
        }
        translation, size = (np.asarray(one, float).tolist() for one in (place, scale))
        self._tree |= {
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "translation": translation, "scale": size}],
            "meshes": [{"primitives": [{"material": 0, **one} for one in primitives]}],
            "materials": [material],
            "textures": [{"source": 0}],
            "images": [self._image(picture[::-1])],  # image row 0 is the north edge
        }

    def paint(self, primitive: dict[str, Any], colors: NDArray[np.uint8], surfaces: NDArray[np.uint8]) -> None:
        """One mesh of several materials, (n, 3) for each: colors, sRGB; surfaces, 0, how rough, how much a metal."""
        pictures = {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 1}}
        self._tree |= {
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"material": 0, **primitive}]}],
            "materials": [{"pbrMetallicRoughness": pictures, "doubleSided": True}],
            "samplers": [{"magFilter": NEAREST, "minFilter": NEAREST}],
            "textures": [{"source": 0, "sampler": 0}, {"source": 1, "sampler": 0}],
            "images": [self._image(colors[None]), self._image(surfaces[None])],
        }

    def _image(self, picture: NDArray[np.uint8]) -> dict[str, Any]:
        png = io.BytesIO()
        Image.fromarray(picture).save(png, "PNG")
        return {"bufferView": self.view(png.getvalue()), "mimeType": "image/png"}

    def encoded(self) -> bytes:
        """The whole file."""
        content = bytes(self._content) + bytes(-len(self._content) % 4)
        tree = {name: said for name, said in self._tree.items() if said != []}
        if content:
            tree["buffers"] = [{"byteLength": len(content)}]
        text = json.dumps(tree, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        if content:
            chunks += struct.pack("<I4s", len(content), b"BIN\0") + content
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def unlit_glb(mesh: Mesh, uv: Array, picture: NDArray[np.uint8]) -> bytes:
    """uv: (n, 2) of the vertices, from the picture's south-west corner; beyond 0…1 it is repeated.

    The vertices are about their middle, where the file's first thing places them: float32 keeps seven digits.
    """
    file = Glb()
    if not len(mesh.triangles):
        return file.encoded()
    local, middle = near(mesh.vertices)
    fits = np.uint16 if len(mesh.vertices) <= SHORT else np.uint32
    down = np.column_stack([uv[:, 0], 1.0 - uv[:, 1]])
    primitive = {
        "attributes": {
            "POSITION": file.numbers(local.astype(np.float32)),
            "TEXCOORD_0": file.numbers(down.astype(np.float32)),
        },
        "indices": file.numbers(mesh.triangles.ravel().astype(fits)),
    }
    file.draw([primitive], picture, middle)
    return file.encoded()
