"""The ground that the scene is given: the map's own triangles, each cell's colour on its place, and no light on it."""

import io
import json
import struct

import numpy as np
import pytest
import trimesh

from footfall.terrain.from_arrays import from_heights
from footfall.terrain.ground.triangulate import triangulate
from footfall_ui.scene.terrain import SUN, glb

ROWS, COLS = 9, 13


@pytest.fixture
def colors():
    return np.random.default_rng(20081).integers(0, 256, (ROWS, COLS, 3)).astype(np.uint8)


def described(content):
    """The JSON part of a binary glTF."""
    length = struct.unpack("<I", content[12:16])[0]
    return json.loads(content[20 : 20 + length])


def loaded(content):
    """Its one mesh, as another library reads it."""
    (mesh,) = trimesh.load_scene(io.BytesIO(content), file_type="glb", process=False).geometry.values()
    return mesh


def test_level_ground_has_each_cell_s_colour_and_nothing_of_the_scene_s_lights(colors):
    dem = from_heights(np.zeros((ROWS, COLS), np.float32), 0.05, 3.0, -7.0, "level")
    content = glb(dem, colors, dem.geometry)
    tree = described(content)
    assert "KHR_materials_unlit" in tree["extensionsUsed"]
    assert [material["extensions"] for material in tree["materials"]] == [{"KHR_materials_unlit": {}}]
    mesh = loaded(content)
    brightness = 0.45 + 0.55 * SUN[2]
    x, y = mesh.vertices[:, 0], mesh.vertices[:, 1]
    cell = colors[np.rint((y + 7.0) / 0.05).astype(int), np.rint((x - 3.0) / 0.05).astype(int)]
    assert len(cell) == ROWS * COLS
    shown = mesh.visual.material.baseColorTexture
    at = np.floor(mesh.visual.uv * [COLS, ROWS]).astype(int)
    texels = np.asarray(shown.convert("RGB"))[::-1][at[:, 1], at[:, 0]]
    assert np.abs(texels - brightness * cell).max() <= 1.0


def test_its_triangles_are_those_of_picking_and_collisions(colors):
    heights = np.random.default_rng(20082).normal(0.0, 0.1, (ROWS, COLS)).astype(np.float32)
    heights[3, 4] = heights[7, 0] = np.nan
    dem = from_heights(heights, 0.05, 3.0, -7.0, "holes")
    drawn, whole = loaded(glb(dem, colors, dem.geometry)), triangulate(dem)
    assert np.abs(drawn.vertices - whole.vertices).max() < 1e-6
    assert np.array_equal(drawn.faces, whole.triangles)
