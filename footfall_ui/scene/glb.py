"""Binary glTF of triangles with a picture on them, unlit.

The scene's lights would wash out colours that mean something, and take a computer without graphics most of the time
of a picture.
"""

from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image
from trimesh.exchange.gltf import export_glb
from trimesh.transformations import translation_matrix
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from footfall.core.mesh import Mesh
from footfall_ui.scene.near import near

Array = NDArray[np.float64]


def unlit_glb(mesh: Mesh, uv: Array, picture: NDArray[np.uint8]) -> bytes:
    """uv: (n, 2) of the vertices, from the picture's south-west corner; beyond 0…1 it is repeated.

    picture: (rows, cols, 3 or 4), row 0 south; the fourth is opacity. The vertices are about their middle, where the
    file's first thing places them: float32 keeps seven digits.
    """
    mode = "BLEND" if picture.shape[2] == 4 else "OPAQUE"
    image = Image.fromarray(picture[::-1])  # image row 0 is the north edge
    material = PBRMaterial(
        baseColorTexture=image, metallicFactor=0.0, roughnessFactor=1.0, doubleSided=True, alphaMode=mode
    )
    local, middle = near(mesh.vertices)
    solid = trimesh.Trimesh(local, mesh.triangles, visual=TextureVisuals(uv=uv, material=material), process=False)
    placed = trimesh.Scene()
    placed.add_geometry(solid, transform=translation_matrix(middle))
    return export_glb(placed, tree_postprocessor=_unlit)


def _unlit(tree: dict[str, Any]) -> None:
    for material in tree["materials"]:
        material["extensions"] = {"KHR_materials_unlit": {}}
    tree["extensionsUsed"] = ["KHR_materials_unlit"]
