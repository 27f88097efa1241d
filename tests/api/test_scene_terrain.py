"""The ground that the scene is given: the map's own triangles, each cell's colour on its place, and no light on it."""

import ast
import io
from pathlib import Path

import numpy as np
import pytest
import trimesh
import viser

import footfall_ui.scene
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.maps.colors import FOOTING, HATCH_RGB, UNKNOWN_RGB, layer_rgb
from footfall.maps.layers import MapStack
from footfall.maps.over_imagery import LINE, grid_lines
from footfall.terrain.dem import MAX_CELLS, Dem
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.ground.shading import relief
from footfall.terrain.ground.triangulate import triangulate
from footfall_ui.scene import drawable as drawable_ground
from footfall_ui.scene import ground_glb as ground_glb_module
from footfall_ui.scene.bearings import bearings_of
from footfall_ui.scene.drawable import drawable, every, picked
from footfall_ui.scene.ground_glb import ground_glb
from footfall_ui.scene.near import near
from footfall_ui.scene.terrain import TerrainDrawing, blended, glb, held_rgb
from footfall_ui.scene.unknown import TEXELS, pattern, unknown_glb
from tests.support.glb import Seen, loaded, read_glb

ROWS, COLS = 9, 13


@pytest.fixture(scope="module")
def drawn_on():
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server
    server.stop()


@pytest.fixture
def colors():
    return np.random.default_rng(20081).integers(0, 256, (ROWS, COLS, 3)).astype(np.uint8)


def test_level_ground_has_each_cell_s_colour_and_nothing_of_the_scene_s_lights(colors):
    dem = from_heights(np.zeros((ROWS, COLS), np.float32), 0.05, 3.0, -7.0, "level")
    content = glb(dem, colors, dem.geometry, np.full(dem.heights.shape, 0.8))
    seen = read_glb(content)
    assert "KHR_materials_unlit" in seen.tree["extensionsUsed"]
    assert [material["extensions"] for material in seen.tree["materials"]] == [{"KHR_materials_unlit": {}}]
    x, y = seen.vertices[:, 0], seen.vertices[:, 1]
    cell = colors[np.rint((y + 7.0) / 0.05).astype(int), np.rint((x - 3.0) / 0.05).astype(int)]
    assert len(cell) == ROWS * COLS
    at = np.floor(seen.uv * [COLS, ROWS]).astype(int)
    texels = seen.picture[at[:, 1], at[:, 0]]
    assert seen.uv * [COLS, ROWS] - at == pytest.approx(0.5, abs=1e-6)
    on_line = grid_lines(dem.geometry)[np.rint((y + 7.0) / 0.05).astype(int), np.rint((x - 3.0) / 0.05).astype(int)]
    assert 0 < on_line.sum() < len(on_line) / 2
    brightness = np.where(on_line, 0.8 * LINE, 0.8)[:, None]
    assert np.abs(texels - brightness * cell).max() <= 0.51


def test_a_coarser_picture_lies_on_its_places(colors):
    """Maps may have every n-th cell of the terrain."""
    coarse = GridGeometry(3.0, -7.0, 0.05, ROWS, COLS)
    dem = from_heights(np.zeros((2 * ROWS - 1, 2 * COLS - 1), np.float32), 0.025, 3.0, -7.0, "fine")
    seen = read_glb(ground_glb(dem, colors, coarse))
    on_cell = (np.abs((seen.vertices[:, :2] - [3.0, -7.0]) / 0.05 % 1.0 - 0.5) > 0.49).all(axis=1)
    assert on_cell.sum() == ROWS * COLS
    at = np.floor(seen.uv[on_cell] * [COLS, ROWS]).astype(int)
    row, col = (np.rint((seen.vertices[on_cell, i] - (3.0, -7.0)[i]) / 0.05).astype(int) for i in (1, 0))
    assert np.array_equal(seen.picture[at[:, 1], at[:, 0]], colors[row, col])


@pytest.mark.parametrize("vertices", [ground_glb_module.SHORT, 4 * COLS, 2 * COLS])
@pytest.mark.parametrize("holes", [0.0, 0.15, 0.5])
def test_its_triangles_are_those_of_picking_and_collisions(colors, vertices, holes, monkeypatch):
    """However many vertices are drawn at once; their heights to half a step."""
    monkeypatch.setattr(ground_glb_module, "SHORT", vertices)
    rng = np.random.default_rng(20082)
    heights = rng.normal(0.0, 0.1, (ROWS, COLS)).astype(np.float32)
    heights[rng.random((ROWS, COLS)) < holes] = np.nan
    dem = from_heights(heights, 0.05, 3.0, -7.0, "holes")
    monkeypatch.setattr(ground_glb_module, "COARSEST", 1.0)
    drawn, whole = read_glb(glb(dem, colors, dem.geometry, relief(dem))), triangulate(dem)
    expected = Seen({}, whole.vertices, whole.triangles.astype(int), np.zeros((0, 2)), np.zeros((0, 0, 3), np.uint8))
    assert len(drawn.triangles) == len(whole.triangles) > 0
    off = np.abs(drawn.corners() - expected.corners())
    assert off[..., :2].max() < 1e-6
    assert off[..., 2].max() <= 0.51 * np.nanmax(heights - np.nanmin(heights)) / vertices
    assert (len(drawn.tree["meshes"][0]["primitives"]) > 1) == (vertices < ROWS * COLS)


def test_another_library_reads_the_same_ground(colors):
    """trimesh, which knows nothing of how it is packed."""
    heights = np.random.default_rng(20086).normal(0.0, 0.1, (ROWS, COLS)).astype(np.float32)
    heights[2, 3] = heights[5, 9] = heights[6, 9] = np.nan
    dem = from_heights(heights, 0.05, 3.0, -7.0, "holes")
    mesh, whole = loaded(glb(dem, colors, dem.geometry, relief(dem))), triangulate(dem)
    assert np.abs(mesh.vertices - whole.vertices).max() < 1e-5
    sized = mesh.faces[mesh.area_faces > 0]
    assert np.array_equal(
        np.unique(np.sort(sized, axis=1), axis=0), np.unique(np.sort(whole.triangles, axis=1), axis=0)
    )
    assert (np.cross(*np.diff(mesh.vertices[sized], axis=1).transpose(1, 0, 2))[:, 2] > 0).all()


@pytest.mark.parametrize("case", ["high", "long"])
def test_ground_that_does_not_fit_in_sixteen_bits_is_drawn_as_it_is(case):
    """A step of heights would be seen, or there are more columns than numbers for them."""
    heights = np.zeros((2, 40_000 if case == "long" else 5), np.float32)
    heights[1, 3] = 900.0 if case == "high" else 0.1
    dem = from_heights(heights, 0.05, 3.0, -7.0, case)
    drawn, whole = (
        read_glb(glb(dem, np.zeros((*heights.shape, 3), np.uint8), dem.geometry, np.ones(heights.shape))),
        triangulate(dem),
    )
    assert "extensionsRequired" not in drawn.tree
    assert np.array_equal(drawn.triangles, whole.triangles)
    assert np.abs(drawn.vertices - whole.vertices).max() < 1e-3


def test_a_cell_takes_twelve_bytes():
    """And its picture. Strips have two more numbers where a row begins."""
    heights = np.random.default_rng(20087).normal(0.0, 0.1, (300, 400)).astype(np.float32)
    dem = from_heights(heights, 0.05)
    content = ground_glb(dem, np.zeros((300, 400, 3), np.uint8), dem.geometry)
    assert len(read_glb(content).triangles) == 2 * 299 * 399
    assert 12 * heights.size < len(content) < 12.2 * heights.size


def test_ground_without_any_triangle_is_nothing_to_draw():
    heights = np.full((4, 5), np.nan, np.float32)
    heights[1, 1] = 0.0
    dem = from_heights(heights, 0.1)
    content = ground_glb(dem, np.zeros((4, 5, 3), np.uint8), dem.geometry)
    assert not trimesh.load_scene(io.BytesIO(content), file_type="glb").geometry


def test_of_a_large_map_every_nth_cell_is_drawn_where_it_is(colors, monkeypatch):
    monkeypatch.setattr(drawable_ground, "MOST_CELLS", ROWS * COLS)
    heights = np.random.default_rng(20085).normal(0.0, 0.1, (3 * ROWS, 3 * COLS)).astype(np.float32)
    whole = from_heights(heights, 0.05, 3.0, -7.0, "large", texture=np.repeat(np.repeat(colors[..., 0], 3, 0), 3, 1))
    drawn = drawable(whole)
    assert drawn.heights.shape == (ROWS, COLS)
    for x, y, z in triangulate(drawn).vertices:
        row, col = whole.geometry.cell(x, y)
        assert heights[int(row), int(col)] == pytest.approx(z, abs=1e-6)
    np.testing.assert_array_equal(drawn.texture, colors[..., 0])
    np.testing.assert_array_equal(
        picked(np.repeat(np.repeat(colors, 3, 0), 3, 1), whole.geometry, drawn.geometry), colors
    )
    assert any("every 3rd cell" in text for text in bearings_of(whole).texts)
    # maps may be coarser still
    coarse = GridGeometry(3.0, -7.0, 0.3, 5, 7)
    np.testing.assert_array_equal(picked(colors[:5, :7], coarse, drawn.geometry)[0, ::2], colors[0, :7])


def test_a_map_that_a_page_can_hold_is_drawn_as_it_is():
    dem = from_heights(np.zeros((5, 7), np.float32), 0.1, 0.0, 0.0)
    assert drawable(dem) is dem
    assert not any("every" in text for text in bearings_of(dem).texts)
    assert every(MAX_CELLS) == 4


def test_ground_far_from_the_origin_keeps_every_cell_and_triangle(colors):
    """At a UTM northing float32 has steps of half a metre: the vertices are sent about the map's middle."""
    heights = np.random.default_rng(20083).normal(0.0, 0.1, (ROWS, COLS)).astype(np.float32)
    dem = from_heights(heights, 0.1, 493890.05, 5180919.05, "utm")
    content = glb(dem, colors, dem.geometry, relief(dem))
    (sent,) = trimesh.load_scene(io.BytesIO(content), file_type="glb", process=False).geometry.values()
    assert len(np.unique(sent.vertices[:, 1].astype(np.float32))) == ROWS
    assert len(np.unique(sent.vertices[:, 0].astype(np.float32))) == COLS
    assert np.abs(read_glb(content).vertices - triangulate(dem).vertices).max() < 1e-5


def test_lines_and_arrows_far_from_the_origin_are_sent_about_their_middle():
    points = np.array([493890.0, 5180919.0, 700.0]) + np.random.default_rng(20084).normal(0.0, 1.0, (7, 2, 3))
    local, middle = near(points)
    assert np.abs(local.astype(np.float32) + np.array(middle) - points).max() < 1e-6
    assert np.abs(points.astype(np.float32) - points).max() > 0.1
    holed = np.concatenate([points, np.full((1, 2, 3), np.nan)])
    assert near(holed)[1] == middle
    assert near(np.zeros((0, 2, 3)))[1] == (0.0, 0.0, 0.0)


def test_every_drawing_of_points_in_the_scene_says_where_its_middle_is():
    """No drawing of points may go to the browser by site coordinates alone."""
    drawn, ways = (
        0,
        {
            "add_line_segments",
            "add_arrows",
            "add_batched_meshes_simple",
            "add_point_cloud",
            "add_spline",
        },
    )
    for path in Path(footfall_ui.scene.__file__).parent.glob("*.py"):
        for call in ast.walk(ast.parse(path.read_text())):
            if not isinstance(call, ast.Call):
                continue
            # called, or handed to what calls it with the rest
            named = {one.attr for one in (call.func, *call.args) if isinstance(one, ast.Attribute)}
            if named & ways:
                drawn += 1
                assert "position" in [word.arg for word in call.keywords], path.name
    assert drawn >= 10


def test_colours_of_older_ground_lie_on_their_places_and_are_striped_where_they_may_be_wrong():
    """The newer map has grown by two cells to the west and one to the south; beyond the maps is what cameras saw."""
    rng = np.random.default_rng(20482)
    older, newer = GridGeometry(0.0, 0.0, 0.1, 12, 14), GridGeometry(-0.2, -0.1, 0.1, 13, 16)
    classes = rng.integers(1, 4, older.shape).astype(np.uint8)
    maps = MapStack(older, 2, "plain", {"footing": classes}, Provenance({"dem": "of old"}))
    heights = np.zeros(newer.shape, np.float32)
    seen_from_above = rng.integers(0, 99, newer.shape).astype(np.uint8)
    dem = Dem(heights, newer, "newer", Provenance({}), texture=seen_from_above)
    changed = np.zeros(older.shape, bool)
    changed[3:10, 4:11] = True
    picture, colors = held_rgb(dem, maps, "footing", changed), layer_rgb(maps, "footing")
    on_maps = picture[1:, 2:]
    assert np.array_equal(on_maps[~changed], colors[~changed])
    striped = (on_maps == HATCH_RGB).all(axis=2)
    seen = (on_maps == seen_from_above[1:, 2:, None]).all(axis=2)
    assert np.array_equal(striped | seen, changed)
    assert 0.3 < striped[changed].mean() < 0.7
    assert (picture[0] == seen_from_above[0][:, None]).all()
    assert (picture[:, :2] == seen_from_above[:, :2, None]).all()
    assert np.array_equal(held_rgb(dem, maps, "footing", None)[1:, 2:], colors)


def test_a_fainter_layer_shows_more_of_what_the_cameras_saw():
    colors, under = (np.full((2, 3, 3), one, np.uint8) for one in (200, 100))
    assert np.array_equal(blended(colors, under, 1.0), colors)
    assert (blended(colors, under, 0.25) == 125).all()


def test_only_layers_of_one_opacity_are_kept(drawn_on):
    dem = from_heights(np.zeros((8, 9), np.float32), 0.1, 0.0, 0.0)
    classes = {"footing": np.ones((8, 9), np.uint8), "slope": np.zeros((8, 9), np.float32)}
    maps = MapStack(dem.geometry, 0, "plain", classes, Provenance({"dem": dem.digest}))
    drawing = TerrainDrawing(drawn_on)

    def shown():
        names = [f"/terrain/{maps.digest}/{one}" for one in ("footing", "slope", "footing-at-0.50", "slope-at-0.50")]
        return [drawn_on.scene.get_handle_by_name(name) is not None for name in names]

    for layer in ("footing", "slope"):
        drawing.show(dem, maps, layer)
    assert shown() == [True, True, False, False]
    drawing.show(dem, maps, "slope", opacity=0.5)
    assert shown() == [False, False, False, True]
    drawing.show(dem, maps, "footing", opacity=1.0)
    assert shown() == [True, False, False, False]


def test_holes_are_striped_in_the_legend_s_colour_of_unknown_ground():
    heights = np.zeros((100, 120), np.float32)
    assert unknown_glb(from_heights(heights, 0.02, 3.0, -7.0)) is None
    heights[20:60, 30:70] = np.nan
    content = unknown_glb(from_heights(heights, 0.02, 3.0, -7.0))
    assert content is not None
    assert "KHR_materials_unlit" in read_glb(content).tree["extensionsUsed"]
    # its squares are those of the ground grid: at every whole metre of the site a picture begins
    mesh = loaded(content)
    apart = mesh.visual.uv - mesh.vertices[:, :2]
    assert np.abs(apart - np.rint(apart)).max() < 1e-5
    assert np.ptp(apart, axis=0).max() < 1e-5
    # no class has its hue, and it goes on in its copies
    shown = pattern().astype(float)
    hue = shown / shown.sum(axis=2, keepdims=True)
    legend = np.array([rgb for _, rgb in FOOTING.values()], float)
    apart = np.linalg.norm(hue[..., None, :] - legend / legend.sum(axis=1, keepdims=True), axis=-1)
    assert (legend[apart.argmin(axis=-1)] == UNKNOWN_RGB).all()
    inner = shown[2:, 2:]
    assert 0.4 < (inner.sum(axis=2) > inner.mean() * 3).mean() < 0.6
    assert np.array_equal(shown[1:-16, 1:], shown[17:, 1:])
    assert TEXELS % 16 == 0
