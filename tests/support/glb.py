"""Reads the scene's binary glTF by the words of its specification, sharing no code with what writes it.

Of extensions it knows KHR_mesh_quantization and KHR_texture_transform.
"""

import io
import json
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image

_NUMBERS = {5121: np.dtype("u1"), 5123: np.dtype("<u2"), 5125: np.dtype("<u4"), 5126: np.dtype("<f4")}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}
_KNOWN = {"KHR_mesh_quantization", "KHR_texture_transform"}


@dataclass
class Seen:
    """What a page draws. vertices: where the file's node places them (n, 3); triangles: (m, 3), those without area
    left out; uv: (n, 2), on the picture from its south-west corner; picture: (rows, cols, 3 or 4), row 0 south.
    """

    tree: dict[str, Any]
    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    uv: NDArray[np.float64]
    picture: NDArray[np.uint8]

    def corners(self) -> NDArray[np.float64]:
        """Of each triangle, (m, 3, 3), from the least of its corners on, the triangles in their order."""
        at = self.vertices[self.triangles]
        first = np.array([min(range(3), key=lambda i: tuple(one[i])) for one in at.tolist()])
        turned = at[np.arange(len(at))[:, None], (first[:, None] + np.arange(3)) % 3]
        return turned[np.lexsort(np.round(turned, 4).reshape(len(at), -1).T[::-1])]


def loaded(content: bytes | None) -> Any:
    """The one mesh of a binary glTF where it stands, as trimesh reads it, whose types say too little."""
    assert content is not None
    scene = trimesh.load_scene(io.BytesIO(content), file_type="glb", process=False)
    (mesh,) = scene.geometry.values()
    mesh.apply_transform(scene.graph.get(scene.graph.nodes_geometry[0])[0])
    return mesh


def read_glb(content: bytes) -> Seen:
    """Everything that the file draws. Raises ValueError where it needs what is not known here."""
    magic, version, length = struct.unpack_from("<4sII", content)
    if (magic, version, length) != (b"glTF", 2, len(content)):
        raise ValueError("no binary glTF 2")
    size = struct.unpack_from("<I", content, 12)[0]
    tree, data = json.loads(content[20 : 20 + size]), content[28 + size :]
    if unknown := set(tree.get("extensionsRequired", ())) - _KNOWN:
        raise ValueError(f"needs {unknown}")
    node, (material,) = tree["nodes"][0], tree["materials"]
    vertices, triangles, uv, count = [], [], [], 0
    for part in tree["meshes"][node["mesh"]]["primitives"]:
        places = _numbers(tree, data, part["attributes"]["POSITION"])
        index = _numbers(tree, data, part["indices"])[:, 0].astype(int)
        if part.get("mode", 4) == 5:
            three = np.stack([index[:-2], index[1:-1], index[2:]], axis=1)
            three[1::2] = three[1::2, [1, 0, 2]]
        else:
            three = index.reshape(-1, 3)
        repeated = (three == np.roll(three, 1, axis=1)).any(axis=1)
        triangles.append(three[~repeated] + count)
        vertices.append(places.astype(float) * node.get("scale", 1.0) + node["translation"])
        uv.append(_numbers(tree, data, part["attributes"]["TEXCOORD_0"]).astype(float))
        count += len(places)
    texture = material["pbrMetallicRoughness"]["baseColorTexture"]
    turned = texture.get("extensions", {}).get("KHR_texture_transform", {"scale": (1, 1), "offset": (0, 0)})
    down = np.concatenate(uv) * turned["scale"] + turned["offset"]
    view = tree["bufferViews"][tree["images"][tree["textures"][texture["index"]]["source"]]["bufferView"]]
    shown = Image.open(io.BytesIO(data[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]))
    along = np.column_stack([down[:, 0], 1.0 - down[:, 1]])
    return Seen(tree, np.concatenate(vertices), np.concatenate(triangles), along, np.asarray(shown)[::-1])


def _numbers(tree: dict[str, Any], data: bytes, number: int) -> NDArray[Any]:
    """(n, width)."""
    accessor = tree["accessors"][number]
    view = tree["bufferViews"][accessor["bufferView"]]
    kind, width = _NUMBERS[accessor["componentType"]], _WIDTHS[accessor["type"]]
    stride = view.get("byteStride", kind.itemsize * width)
    begin = view["byteOffset"] + accessor.get("byteOffset", 0)
    shape, strides = (accessor["count"], width), (stride, kind.itemsize)
    return np.ndarray(shape, kind, data, begin, strides)
