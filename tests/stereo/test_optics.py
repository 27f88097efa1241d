# Wrong types are passed on purpose, and named settings are spread.
# pyright: reportArgumentType=false

import numpy as np
import pytest

from footfall.core.errors import InvalidInput, NotFound
from footfall.sim.optics import EASY, HARD, CameraEffects, camera_effects, exposed
from footfall.sim.render import RenderScene, render_pair, render_scene, render_snapshot
from footfall.telemetry.images import Camera
from footfall.terrain.generate import plane
from footfall.terrain.ground.triangulate import triangulate

CAMERA = Camera("flat", 200, 100, 100.0, 100.0, 99.5, 49.5, np.eye(4))
AXIS = np.tile([0.0, 0.0, 1.0], (20_000, 1))


def down(width: int, height: int, above: float) -> Camera:
    T = np.diag([1.0, -1.0, -1.0, 1.0])
    T[2, 3] = above
    return Camera("down", width, height, 100.0, 100.0, (width - 1) / 2, (height - 1) / 2, T)


@pytest.mark.parametrize(("read", "shot"), [(1.2, 0.0), (2.0, 0.05)])
def test_noise_has_the_variance_that_was_asked_for(rng, read, shot):
    effects = CameraEffects(exposure=200.0, read_noise=read, shot_noise=shot)
    grey = exposed(np.full(20_000, 0.5), AXIS, CAMERA, effects, 1.0, rng).astype(float)
    assert grey.mean() == pytest.approx(100.0, abs=0.1)
    # rounding to whole levels adds a twelfth
    assert grey.var() == pytest.approx(read**2 + shot * 100.0 + 1 / 12, rel=0.05)


def test_vignetting_and_gain_are_those_of_the_formula(rng):
    quiet = CameraEffects(exposure=100.0, read_noise=0.0, vignetting=4.0)
    rays = np.tile([1.0, 0.0, 1.0], (20_000, 1))  # 45°: cos⁴ is a quarter
    assert (exposed(np.ones(20_000), AXIS, CAMERA, quiet, 1.2, rng) == 120).all()
    assert (exposed(np.ones(20_000), rays, CAMERA, quiet, 1.2, rng) == 30).all()


def test_supersampling_gives_edges_the_share_of_a_pixel_that_is_covered(rng):
    """The western half of the image plane is ground; the edge cuts a column of pixels at a known place."""

    half = plane(4.0, 0.5)
    heights = half.heights.copy()
    heights[:, half.geometry.xs > 0.0] = np.nan
    ground = triangulate(type(half)(heights, half.geometry, "west", half.provenance))
    camera = down(64, 8, 2.0)
    shifted = Camera("down", 64, 8, 100.0, 100.0, 31.25, 3.5, camera.T_base_camera)
    even = {"ground_contrast": 0.0, "read_noise": 0.0}
    fine = RenderScene(ground).image(shifted, np.eye(4), rng, CameraEffects(supersampling=4, **even))
    coarse = RenderScene(ground).image(shifted, np.eye(4), rng, CameraEffects(**even))
    lit = int(coarse[4, 20])
    # x = 0 lies at column 31.25, so pixel 31 (30.5 to 31.5) is covered for three quarters
    assert fine[4, 31] == pytest.approx(0.75 * lit, abs=1)
    assert coarse[4, 31] == lit
    assert np.array_equal(np.delete(fine[4], 31), np.delete(coarse[4], 31))


def test_hard_images_are_what_they_say(athlete, rocks, rock_state):
    scene = render_scene(athlete, rock_state, rocks)
    spec = athlete.description.camera_pair("nav1")
    easy, hard = (render_pair(scene, rock_state, spec, seed=3, scale=0.25, effects=e) for e in (EASY, HARD))
    assert hard.right.mean() / hard.left.mean() == pytest.approx(1.15, abs=0.06)
    assert easy.right.mean() / easy.left.mean() == pytest.approx(1.0, abs=0.05)


def test_contrast_scales_the_grain_and_a_low_sun_lengthens_shadows(athlete, rocks, rock_state):
    scene = render_scene(athlete, rock_state, rocks)
    spec = athlete.description.camera_pair("nav1")
    images = {}
    for name, changes in (
        ("full", {}),
        ("faint", {"ground_contrast": 0.1}),
        ("low", {"sun_elevation": 0.2, "ground_contrast": 0.0}),
        ("high", {"ground_contrast": 0.0}),
    ):
        effects = CameraEffects(read_noise=0.0, **changes)
        images[name] = render_pair(scene, rock_state, spec, scale=0.25, effects=effects).left.astype(float)
    full, faint = (np.median(np.abs(np.diff(images[name], axis=1))) for name in ("full", "faint"))
    assert faint < 0.5 * full
    # in shadow nothing but the sky lights the ground
    dark = CameraEffects().ambient * CameraEffects().exposure * 0.42
    shadow = {name: (np.abs(images[name] - dark) < 2.0).mean() for name in ("low", "high")}
    assert shadow["low"] > shadow["high"]


def test_the_easy_setting_is_what_is_rendered_without_any(athlete, rocks, rock_state):
    plain, named = (
        render_snapshot(athlete, rock_state, rocks, seed=1, scale=0.25, pairs=["haz1"], **extra)
        for extra in ({}, {"effects": camera_effects("easy")})
    )
    assert plain.digest == named.digest


def test_unknown_names_and_impossible_settings_are_refused():
    with pytest.raises(NotFound, match="easy, hard"):
        camera_effects("foggy")
    for wrong in (
        {"sun_elevation": 0.0},
        {"sun_azimuth": np.nan},
        {"ambient": 1.5},
        {"exposure": 0.0},
        {"exposure_difference": -1.0},
        {"shot_noise": -0.1},
        {"supersampling": 0},
    ):
        with pytest.raises(InvalidInput):
            CameraEffects(**wrong)
