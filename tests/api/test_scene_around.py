"""What is around rover and ground: sky, compass, scale bar, shadow; and labels that are arranged."""

import re
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import cv2
import numpy as np
import pytest
import viser
from hypothesis import given
from hypothesis import strategies as st

import footfall
from footfall.core.frames import apply, inverse, quat_wxyz, rotation, transform
from footfall.resources import static_folder
from footfall.robot.kinematics import wheel_centers
from footfall.session.access.identity import LOCAL
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.ground.shading import LIGHT
from footfall.terrain.ground.surface import height_at
from footfall_ui.scene.bearings import bearings_of
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.labels import ANCHORS, Page, arranged, boxes, covered, labels_of, may_yield, shown_of, sizes_of
from footfall_ui.scene.shadow import MARGIN, OVER, opacity, shadow_glb
from footfall_ui.scene.sky import FADES, LEAST, MOST, SKIES, TEXELS, ball, gradient, place
from footfall_ui.visitors import MOST_KEPT, THEMES, Visitors
from tests.support.chassis_ground import lifted, wavy
from tests.support.glb import loaded


@pytest.fixture(scope="module")
def ground():
    return wavy(half=4.0)


@pytest.fixture(scope="module")
def stood(athlete, ground):
    return footfall.stand(athlete, ground)


def luminance(rgb):
    return rgb.astype(float) @ [0.2126, 0.7152, 0.0722]


def test_the_sky_lies_on_its_ball_by_elevation_alone():
    mesh, uv = ball(300.0, (10.0, -20.0, 3.0))
    away = mesh.vertices - [10.0, -20.0, 3.0]
    assert np.linalg.norm(away, axis=1) == pytest.approx(300.0)
    inside = (uv[:, 1] > 1 / TEXELS) & (uv[:, 1] < 1 - 1 / TEXELS)
    elevation = np.arcsin(away[:, 2] / 300.0)
    assert uv[inside, 1] == pytest.approx(0.5 + elevation[inside] / np.pi)


@pytest.mark.parametrize("theme", THEMES)
def test_far_ground_fades_into_the_horizon_s_colour_from_which_the_sky_darkens(theme):
    colors = gradient(theme)[:, 0].astype(float)
    brightness = luminance(colors)
    sky, ground = brightness[TEXELS // 2 :], brightness[: TEXELS // 2]
    assert (np.diff(sky) <= 0).all()
    assert (np.diff(ground) >= 0).all()
    # no edge at the horizon; it stands out from both sides all the same
    assert np.abs(colors[TEXELS // 2] - colors[TEXELS // 2 - 1]).max() <= 0.1 * np.ptp(brightness)
    assert brightness[TEXELS // 2] - brightness[TEXELS // 2 + TEXELS // 6] > 20
    assert brightness[TEXELS // 2] - brightness[TEXELS // 2 - TEXELS // 6] > 40
    # ground near the rover has its own colour: white lines and the rover are seen before it
    assert np.abs(colors[: TEXELS // 6] - SKIES[theme].ground).max() < 0.1 * np.ptp(brightness)
    assert brightness[: TEXELS // 6].max() < 120


def test_ground_keeps_the_share_of_its_colour_that_haze_leaves_at_its_distance():
    """A ray is followed to level ground; the texture has a row for each 0.7°, of which the middle is taken."""
    colors, sky = gradient("light")[:, 0].astype(float), SKIES["light"]
    for row in range(20, TEXELS // 2):
        down = np.pi / 2 - (row + 0.5) * np.pi / TEXELS
        ray = np.array([np.cos(down), -np.sin(down)])
        share = np.exp(-abs(ray[0] / ray[1]) / FADES)
        expected = share * np.array(sky.ground) + (1 - share) * np.array(sky.haze)
        assert np.abs(colors[row] - expected).max() <= 0.51


def test_the_page_has_these_themes():
    text = (static_folder() / "js" / "themes.js").read_text()
    named = re.search(r"THEMES = \[(.*?)\]", text)
    assert named is not None
    assert tuple(re.findall(r'"(\w+)"', named[1])) == THEMES
    assert set(SKIES) == set(THEMES)


def test_each_page_has_the_sky_of_its_theme():
    visitors = Visitors()
    one, other = (replace(LOCAL, page=page) for page in ("one", "other"))
    visitors.dress(one, "light")
    assert (visitors.theme_of(one), visitors.theme_of(other), visitors.theme_of(None)) == ("light", "dark", "dark")
    for i in range(MOST_KEPT):
        visitors.dress(replace(LOCAL, page=f"more-{i}"), "sunlight")
    assert visitors.theme_of(one) == "dark"


def test_each_page_has_its_own_size_and_its_scene_hears_of_another_one():
    visitors, heard = Visitors(), []
    one, other = (replace(LOCAL, page=page) for page in ("one", "other"))
    visitors.listen(one, lambda: heard.append(visitors.size_of(one)))
    assert visitors.size_of(one) is visitors.size_of(None) is None
    visitors.fit(one, 900.0, 700.0)
    visitors.fit(other, 300.0, 200.0)
    visitors.fit(one, 900.0, 700.0)
    visitors.fit(one, 450.0, 700.0)
    assert heard == [(900.0, 700.0), (450.0, 700.0)]
    assert visitors.size_of(other) == (300.0, 200.0)
    for i in range(MOST_KEPT):
        visitors.fit(replace(LOCAL, page=f"more-{i}"), 10.0, 10.0)
    assert visitors.size_of(one) is None


def test_a_scene_hears_of_its_own_page_s_theme_and_only_of_another_one():
    visitors, heard = Visitors(), []
    one, other = (replace(LOCAL, page=page) for page in ("one", "other"))
    unlisten = visitors.listen(one, lambda: heard.append("one"))
    visitors.listen(other, lambda: heard.append("other"))
    visitors.listen(None, lambda: heard.append("nobody"))
    visitors.dress(one, THEMES[0])
    assert heard == []
    visitors.dress(one, "light")
    visitors.dress(one, "light")
    assert heard == ["one"]
    visitors.dress(other, "light")
    assert heard == ["one", "other"]
    unlisten()
    visitors.dress(one, "dark")
    visitors.dress(other, "dark")
    assert heard == ["one", "other", "other"]


@given(x=st.floats(-1e6, 1e6), y=st.floats(-1e6, 1e6), z=st.floats(-3000, 3000), size=st.sampled_from([3, 40, 300]))
def test_the_sky_is_about_the_map_and_outside_of_it(x, y, z, size):
    dem = from_heights(np.full((size, size), z, np.float32), 0.5, x, y)
    radius, middle = place(dem)
    assert LEAST <= radius <= MOST
    west, south, east, north = dem.geometry.bounds
    for corner in ((west, south), (east, north), (west, north), (east, south)):
        assert np.hypot(*np.subtract(corner, middle[:2])) < 0.8 * radius
    assert abs(middle[2] - z) <= 0.51


def test_letters_and_bar_are_where_they_say():
    heights = np.full((101, 201), 2.0, np.float32)
    heights[:, :3] = np.nan
    found = bearings_of(from_heights(heights, 0.05, 100.0, 50.0))
    west, south, east, north = 100.0, 50.0, 110.0, 55.0
    assert found.texts["N"][:2] == pytest.approx([105.0, north])
    assert found.texts["S"][:2] == pytest.approx([105.0, south])
    assert found.texts["E"][:2] == pytest.approx([east, 52.5])
    assert found.texts["W"] == pytest.approx([west, 52.5, 2.05])
    lengths = np.linalg.norm(np.diff(found.bar, axis=1), axis=-1)
    assert lengths == pytest.approx(1.0)
    assert found.texts[f"{len(lengths)} m"] == pytest.approx(found.bar[-1, 1])
    light = found.texts["light assumed from here"]
    assert light[0] < 105.0
    assert light[1] == pytest.approx(north)
    shaft, *head = found.light
    assert shaft[0] == pytest.approx(light)
    assert (shaft[1] - shaft[0])[:2] @ LIGHT[:2] == pytest.approx(-np.hypot(*LIGHT[:2]))
    for side in head:
        assert side[0] == pytest.approx(shaft[1])
        assert (side[1] - side[0]) @ (shaft[1] - shaft[0]) < 0


def test_where_true_north_is_turned_the_letter_says_so():
    plain = from_heights(np.zeros((20, 20), np.float32), 0.1)
    assert "N" in bearings_of(plain).texts
    for turned, text in (((3.2, 3.1, 3.3), "N (true north 3° E)"), ((-12.0, -12.1, -11.9), "N (true north 12° W)")):
        dem = Dem(plain.heights, plain.geometry, "turned", plain.provenance, true_north=turned)
        assert text in bearings_of(dem).texts


def test_the_shadow_lies_on_the_ground_under_the_whole_rover(athlete, ground, stood):
    mesh = loaded(shadow_glb(ground, athlete, stood))
    feet = apply(stood.T_site_base, wheel_centers(athlete, stood.posture))
    assert mesh.vertices[:, :2].min(axis=0) == pytest.approx(feet[:, :2].min(axis=0) - MARGIN, abs=1e-5)
    assert mesh.vertices[:, 2] - height_at(ground, *mesh.vertices[:, :2].T) == pytest.approx(OVER, abs=1e-4)
    # read off the picture: dark under every wheel and the chassis, clear at the rim
    picture = np.asarray(mesh.visual.material.baseColorTexture.convert("RGBA"))[::-1, :, 3]
    low, high = mesh.vertices[:, :2].min(axis=0), mesh.vertices[:, :2].max(axis=0)
    at = np.rint((feet[:, :2] - low) / (high - low) * (np.array(picture.shape) - 1)).astype(int)
    assert (picture[at[:, 1], at[:, 0]] > 100).all()
    assert picture[picture.shape[0] // 2, picture.shape[1] // 2] > 70
    assert picture[0].max() < 10
    assert picture[:, 0].max() < 10


def test_a_wheel_that_is_raised_loses_its_shadow(athlete, ground, stood):
    wheel = apply(stood.T_site_base, wheel_centers(athlete, stood.posture))[2]
    found = []
    for height in (0.0, 0.1, 0.2, 0.3):
        state = lifted(athlete, stood, [2], height) if height else stood
        place = (np.array([wheel[0]]), np.array([wheel[1]]), height_at(ground, *wheel[:2])[None])
        found.append(float(opacity(*place, athlete, state)[0]))
    assert (np.diff(found) < -0.05).all()
    assert found[0] > 0.5


def test_there_is_no_shadow_on_ground_that_nobody_saw(athlete, stood):
    heights = np.full((80, 80), np.nan, np.float32)
    heights[:3, :3] = 0.0
    far = from_heights(heights, 0.1, 500.0, 500.0)
    assert shadow_glb(far, athlete, replace(stood, time=1.0)) is None


@st.composite
def crowds(draw):
    """Points in a window of 600 × 400 px, crowded or not, texts of any length, and how they hang now."""
    count = draw(st.integers(0, 14))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    points = rng.uniform(0, 1, (count, 2)) * draw(st.sampled_from([(600, 400), (60, 40), (1, 1)]))
    now = [list(ANCHORS)[i] for i in rng.integers(len(ANCHORS), size=count)]
    return points, sizes_of(["m" * int(length) for length in rng.integers(1, 40, count)]), now


def overlap(points, sizes, anchors):
    """All that labels cover of each other [px²], pair by pair."""
    found = boxes(points, sizes, anchors)
    shared = 0.0
    for i, a in enumerate(found):
        for b in found[i + 1 :]:
            width, height = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
            shared += max(width, 0.0) * max(height, 0.0)
    return shared


@given(crowd=crowds())
def test_labels_never_cover_more_of_each_other_than_before_and_stay_where_they_cover_nothing(crowd):
    points, sizes, now = crowd
    found = arranged(points, sizes, now)
    before, after = overlap(points, sizes, now), overlap(points, sizes, found)
    assert after <= before + 1e-6
    if before == 0:
        assert found == now
    assert arranged(points, sizes, found) == found or overlap(points, sizes, arranged(points, sizes, found)) < after


@given(crowd=crowds(), seed=st.integers(0, 2**32 - 1))
def test_labels_that_may_yield_cover_nothing_and_none_yields_without_need(crowd, seed):
    points, sizes, now = crowd
    yielding = np.random.default_rng(seed).random(len(points)) < 0.7
    placed = boxes(points, sizes, now)
    shown = np.array(shown_of(placed, yielding.tolist()), bool)
    assert shown[~yielding].all()
    for i in np.flatnonzero(yielding):
        others = shown.copy()
        others[i] = False
        assert (covered(placed[i], placed[others]) == 0) == shown[i]


def test_only_numbers_and_letters_yield():
    for name in ("/walk/3", "/suggested/0", "/bearings/1"):
        assert may_yield(name)
    for name in ("/walk/end", "/failing-text", "/collision/text", "/support/margin", "/torque/worst", "/forces/text"):
        assert not may_yield(name)


@pytest.mark.parametrize("count", [2, 3, 4])
def test_labels_of_one_place_do_not_overlap(count):
    points, sizes = np.full((count, 2), 200.0), sizes_of(["leg 2: 1393 N"] * count)
    assert overlap(points, sizes, ["bottom-left"] * count) > 0
    assert overlap(points, sizes, arranged(points, sizes, ["bottom-left"] * count)) == 0


def test_every_label_hangs_at_its_point():
    points, sizes = np.full((len(ANCHORS), 2), 50.0), np.full((len(ANCHORS), 2), (80.0, 20.0))
    for name, box in zip(ANCHORS, boxes(points, sizes, list(ANCHORS)), strict=True):
        side, edge = {"left": 0, "center": 0.5, "right": 1}, {"top": 0, "center": 0.5, "bottom": 1}
        vertical, horizontal = name.split("-")
        assert box[0] + side[horizontal] * 80 == pytest.approx(50.0)
        assert box[1] + edge[vertical] * 20 == pytest.approx(50.0)


def test_a_page_sees_points_as_a_pinhole_does():
    """OpenCV projects the same."""
    R = rotation("x", 0.3)[:3, :3] @ rotation("z", 0.2)[:3, :3]
    T = transform(R, (0.5, -1.0, -4.0))
    page = Page(T, 0.9, 640, 480)
    points = np.array([(0.0, 0.0, 0.0), (1.0, 0.5, 2.0), (-1.0, 0.2, 1.0)])
    focal = 240 / np.tan(0.45)
    camera = np.array([(focal, 0, 320), (0, focal, 240), (0, 0, 1.0)])
    back = inverse(T)
    expected, _ = cv2.projectPoints(points, cv2.Rodrigues(back[:3, :3])[0], back[:3, 3], camera, np.zeros(4))
    assert page.pixels(points) == pytest.approx(expected[:, 0], abs=1e-6)
    assert np.isnan(page.pixels(np.array([(0.0, 0.0, -30.0)]))).all()


@pytest.mark.parametrize("density", [0.5, 1.0, 1.25, 1.5, 2.0, 3.0])
def test_labels_of_a_scene_are_moved_apart_for_the_page_that_turns(density):
    """However many pixels viser's picture has for each of the page's, as screens, zoom and slow machines make them."""
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        drawn, turned = Drawn(server), rotation("x", -np.pi / 2)[:3, :3]
        camera = SimpleNamespace(wxyz=quat_wxyz(turned), position=np.array([0.0, -8.0, 1.0]), fov=1.0)
        camera.image_width, camera.image_height = round(900 * density), round(700 * density)
        page = Page(transform(turned, camera.position), 1.0, 900, 700)

        def draw(height):
            add = server.scene.add_label
            return [
                drawn.add(add, name, f"the label {i}", position=(0.5 * i, 0.0, height))
                for i, name in enumerate(("/one", "/two"))
            ]

        def shared(handles):
            points = page.pixels(np.array([one.position for one in handles]))
            return overlap(points, sizes_of([one.text for one in handles]), [one.anchor for one in handles])

        labels, handles = labels_of(server), draw(1.0)
        labels.follow(server, lambda: None, lambda: (900.0, 700.0))
        labels.arrange(server)  # nobody looks yet
        labels.seen_from(cast(viser.CameraHandle, camera))
        assert shared(handles) > 0
        labels.arrange(server)
        assert shared(handles) == 0
        # drawn again at another place they hang as before: nothing flickers
        assert [one.anchor for one in draw(1.1)] == [one.anchor for one in handles]
        drawn.only(["/one"])
        labels.arrange(server)
    finally:
        server.stop()
