"""Rectified images against the scene itself: lens models written out here, by hand, on a textured plane."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from footfall.core import frames
from footfall.core.errors import InvalidImages
from footfall.io.image_files import LEVEL_FORWARD
from footfall.telemetry.calibration import CameraModel, PairCalibration
from footfall.terrain.pairs.epipolar import estimate_rotation
from footfall.terrain.pairs.point_matches import matches
from footfall.terrain.pairs.rectify import rectified_cameras, rectify, require_simultaneous
from footfall.terrain.pairs.stereo import offset, require_rectified

LENSES = {
    "none": [],
    "plumb_bob": [-0.25, 0.08, 0.001, -0.0008, -0.01],
    "rational": [0.3, -0.1, 0.0005, 0.0005, 0.01, 0.6, -0.05, 0.005],
    "fisheye": [0.02, -0.01, 0.004, -0.001],
}
WALL = 3.0
"""The scene: a plane across +x of base, this far away [m]."""


def distorted(model: str, c: list[float], x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where a lens puts the ray (x, y, 1), in units of the focal length (Brown, 1966; Kannala & Brandt, 2006)."""
    if model == "none":
        return x, y
    r2 = x * x + y * y
    if model == "fisheye":
        r = np.maximum(np.sqrt(r2), 1e-12)
        angle = np.arctan(r)
        bent = angle * (1 + sum(k * angle ** (2 * i + 2) for i, k in enumerate(c)))
        return x * bent / r, y * bent / r
    k1, k2, p1, p2, k3 = c[:5]
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    if model == "rational":
        k4, k5, k6 = c[5:]
        radial = radial / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
    return (
        x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
        y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
    )


def wall_grey(y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Smooth pattern without repetition on the wall, from its metres."""
    waves = np.random.default_rng(8).uniform([4, -9, 0], [19, 9, 6.28], (40, 3))
    return 128 + 16 * sum(np.sin(a * y + b * z + c) for a, b, c in waves) / np.sqrt(20)


def photograph(camera: CameraModel) -> np.ndarray:
    """The wall through the lens: rays of the pixels by fixed-point iteration of the model above."""
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    wanted = (u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy
    x, y = wanted[0].copy(), wanted[1].copy()
    for _ in range(100):
        at = distorted(camera.model, list(camera.distortion), x, y)
        x, y = x + 0.8 * (wanted[0] - at[0]), y + 0.8 * (wanted[1] - at[1])
    return seen(x, y, camera.T_base_camera)


def seen(x: np.ndarray, y: np.ndarray, T: np.ndarray) -> np.ndarray:
    rays = np.stack([x, y, np.ones_like(x)], -1) @ T[:3, :3].T
    points = T[:3, 3] + rays * ((WALL - T[0, 3]) / rays[..., 0])[..., None]
    return np.clip(np.rint(wall_grey(points[..., 1], points[..., 2])), 0, 255).astype(np.uint8)


def calibration(model: str) -> PairCalibration:
    turn = Rotation.from_euler("xyz", [1.5, -2.0, 1.0], degrees=True).as_matrix()
    T_right = LEVEL_FORWARD @ frames.transform(turn, (0.2, 0.004, -0.003))
    left, right = (
        CameraModel(f"yard {side}", 320, 240, f, f + 1, cx, cy, model, np.array(LENSES[model], float), T)
        for side, f, cx, cy, T in (
            ("left", 230.0, 158.0, 121.0, LEVEL_FORWARD),
            ("right", 233.0, 161.0, 118.5, T_right),
        )
    )
    return PairCalibration("yard", left, right)


@pytest.fixture(scope="module", params=list(LENSES))
def yard(request):
    cal = calibration(request.param)
    return cal, rectify(cal, photograph(cal.left), photograph(cal.right))


def test_rectified_cameras_keep_their_places(yard):
    cal, pair = yard
    require_rectified(pair)
    assert np.allclose(pair.camera_left.T_base_camera[:3, 3], cal.left.T_base_camera[:3, 3])
    assert np.allclose(pair.camera_right.T_base_camera[:3, 3], cal.right.T_base_camera[:3, 3], atol=1e-9)
    assert pair.baseline == pytest.approx(np.linalg.norm(cal.T_left_right[:3, 3]))


def test_rectified_images_show_what_a_pinhole_would(yard):
    """Independent of OpenCV: the wall looked at through the rectified camera directly."""
    _, pair = yard
    for image, camera in ((pair.left, pair.camera_left), (pair.right, pair.camera_right)):
        u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
        expected = seen((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, camera.T_base_camera).astype(int)
        inside = image > 0
        assert inside.mean() > 0.8
        difference = np.abs(image.astype(int) - expected)[inside]
        assert np.median(difference) <= 1
        assert np.quantile(difference, 0.95) < 5


def test_rows_agree_and_the_wall_is_where_it_is(yard):
    _, pair = yard
    found = estimate_rotation(pair)
    assert found.checked
    assert found.rows_before < 0.1
    left, right = matches(pair)
    camera = pair.camera_left
    z = camera.fx * pair.baseline / (left[:, 0] - right[:, 0] + offset(pair))
    p = np.stack([(left[:, 0] - camera.cx) / camera.fx * z, (left[:, 1] - camera.cy) / camera.fy * z, z], -1)
    assert abs(np.median(frames.apply(camera.T_base_camera, p)[:, 0]) - WALL) < 0.01


@pytest.fixture(scope="module")
def plain():
    cal = calibration("none")
    return cal, np.full((240, 320), 100, np.uint8)


def test_wrong_images_are_refused_by_name(plain):
    cal, image = plain
    with pytest.raises(InvalidImages, match=r"pair yard: the right image has 319 × 240 pixels"):
        rectify(cal, image, image[:, 1:])
    with pytest.raises(InvalidImages, match=r"pair yard: the left image has .* \(float64\)"):
        rectify(cal, image.astype(float), image)  # type: ignore[arg-type]


def test_images_of_two_moments_are_refused(plain):
    cal, image = plain
    with pytest.raises(InvalidImages, match=r"pair yard: .*0\.500 s apart.*not synchronised"):
        rectify(cal, image, image, time=10.0, time_right=10.5)
    assert rectify(cal, image, image, time=10.0, time_right=10.5, max_skew=0.6).time == 10.0
    with pytest.raises(InvalidImages):
        require_simultaneous("yard", 0.0, float("nan"), 1.0)


def test_a_pose_that_is_no_number_is_refused(plain):
    cal, image = plain
    with pytest.raises(InvalidImages, match=r"pair yard: the rover's pose"):
        rectify(cal, image, image, T_site_base=np.full((4, 4), np.nan))


def test_absurd_coefficients_are_refused():
    a = calibration("plumb_bob")
    wild = np.array([50.0, 3000.0, 0.0, 0.0, 1e5])
    left, right = (
        CameraModel(c.name, c.width, c.height, c.fx, c.fy, c.cx, c.cy, c.model, wild, c.T_base_camera)
        for c in (a.left, a.right)
    )
    with pytest.raises(InvalidImages, match=r"yard.*focal length"):
        rectified_cameras(PairCalibration("yard", left, right))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"model": "pinhole7"}, "pinhole7.*known are"),
        ({"distortion": np.zeros(3)}, "plumb_bob takes 4 or 5"),
        ({"distortion": np.full(5, np.nan)}, "finite distortion"),
        ({"fx": float("nan")}, "finite intrinsics"),
        ({"fx": -1.0}, "above zero"),
        ({"width": 0}, "size"),
    ],
)
def test_wrong_models_are_refused(change, says):
    a = calibration("plumb_bob").left
    fields = {name: getattr(a, name) for name in a.__dataclass_fields__}
    with pytest.raises(InvalidImages, match=says):
        CameraModel(**{**fields, **change})


def test_pairs_that_do_not_belong_together_are_refused():
    a, fish = calibration("none"), calibration("fisheye")
    with pytest.raises(InvalidImages, match="baseline"):
        PairCalibration("yard", a.right, a.left)
    with pytest.raises(InvalidImages, match="both lenses"):
        PairCalibration("yard", a.left, fish.right)
