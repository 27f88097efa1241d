import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidImages
from footfall.telemetry.images import Camera, ImagePair
from footfall.terrain.pairs.stereo import depth, deviations, disparity, match
from footfall.terrain.terrain_settings import TerrainSettings

SETTINGS = TerrainSettings(min_range=1.0)


def shifted_pair(make_pair, texture: np.ndarray, shift: int, **options) -> ImagePair:
    """Everything ``shift`` pixels apart: x_left − x_right = shift."""
    left = np.ascontiguousarray(texture[:, 40:200])
    right = np.ascontiguousarray(texture[:, 40 + shift : 200 + shift])
    return make_pair(left, right, **options)


@pytest.mark.parametrize("shift", [1, 10, 20, 33])
@pytest.mark.parametrize("matcher", ["hh", "3way"])
def test_a_shift_is_found_up_to_both_edges(make_pair, speckle, shift, matcher):
    found = disparity(shifted_pair(make_pair, speckle, shift), TerrainSettings(min_range=1.0, matcher=matcher))
    seen_by_both = found[3:-3, shift + 3 : -3]
    assert np.isfinite(seen_by_both).mean() > 0.95
    assert np.nanmax(np.abs(seen_by_both - shift)) < 0.5
    assert np.isnan(found[:, :shift]).mean() > 0.9  # those columns have no partner in the right image


@given(f=st.floats(50.0, 2000.0), baseline=st.floats(0.05, 0.5), z=st.floats(0.5, 20.0), doffs=st.floats(-20.0, 40.0))
def test_depth_inverts_the_projection(make_pair, f, baseline, z, doffs):
    """The definition of disparity, through both cameras' own projections."""
    blank = np.zeros((4, 4), np.uint8)
    pair = make_pair(blank, blank, f=f, baseline=baseline, doffs=doffs)
    point = np.array([0.3, -0.2, z])
    left, right = pair.camera_left, pair.camera_right
    x_left = left.fx * point[0] / z + left.cx
    x_right = right.fx * (point[0] - baseline) / z + right.cx
    assert depth(pair, np.array([[x_left - x_right]]))[0, 0] == pytest.approx(z, rel=1e-9)


def test_depth_of_unknown_and_beyond_infinity(make_pair):
    blank = np.zeros((4, 4), np.uint8)
    out = depth(make_pair(blank, blank), np.array([[np.nan, 0.0, -1.0, 20.0]], np.float32))
    assert np.isnan(out[0, 0])
    assert np.isinf(out[0, 1:3]).all()
    assert out[0, 3] == pytest.approx(2.0)


def test_principal_points_that_differ_shift_the_search(make_pair, speckle):
    """With an offset of 12 px, disparities down to −12 are points before infinity."""
    pair = shifted_pair(make_pair, speckle, -5, doffs=12.0)
    found = disparity(pair, SETTINGS)
    assert np.nanmedian(found) == pytest.approx(-5.0, abs=0.1)
    assert np.nanmedian(depth(pair, found)) == pytest.approx(200 * 0.2 / 7, rel=0.02)


def test_nothing_is_told_of_what_is_met_edge_on(rock_snapshot):
    """Against angles from depths of neighbouring pixels instead of the fitted slopes."""
    pair = rock_snapshot.pairs[0]
    camera = pair.camera_left
    found = match(pair, SETTINGS)
    told = deviations(found, pair, SETTINGS)
    edge_on = np.isinf(told)
    assert np.array_equal(told[~edge_on], found.deviation[~edge_on], equal_nan=True)
    x, y = np.meshgrid(np.arange(camera.width) - camera.cx, np.arange(camera.height) - camera.cy)
    ray = np.stack([x / camera.fx, y / camera.fy, np.ones(x.shape)])
    down, along = np.gradient(ray * depth(pair, found.disparity), axis=(1, 2))
    normal = np.cross(along, down, axis=0)
    sine = np.abs((normal * ray).sum(axis=0)) / np.linalg.norm(normal, axis=0) / np.linalg.norm(ray, axis=0)
    met = np.arcsin(sine)
    known = np.isfinite(met)
    assert (known & edge_on).sum() > 100
    assert (met[known & edge_on] < 1.5 * SETTINGS.least_angle).mean() > 0.9
    assert (met[known & ~edge_on] > SETTINGS.least_angle / 1.5).mean() > 0.98


def test_number_of_threads_does_not_matter(rock_snapshot):
    pair = rock_snapshot.pairs[0]
    before = cv2.getNumThreads()
    try:
        results = []
        for threads in (1, 2, 3):
            cv2.setNumThreads(threads)
            results.append([disparity(pair, TerrainSettings(matcher=m)) for m in ("hh", "3way")])
    finally:
        cv2.setNumThreads(before)
    for other in results[1:]:
        assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(results[0], other, strict=True))


def altered(pair: ImagePair, left=None, right=None, **cameras) -> ImagePair:
    return ImagePair(
        pair.name,
        pair.time,
        pair.left if left is None else left,
        pair.right if right is None else right,
        cameras.get("camera_left", pair.camera_left),
        cameras.get("camera_right", pair.camera_right),
        pair.T_site_base,
    )


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda p: altered(p, left=np.zeros_like(p.left)), "left image is black"),
        (lambda p: altered(p, right=np.full_like(p.right, 255)), "right image is saturated"),
        (lambda p: altered(p, left=np.full_like(p.left, 120)), "left image is blank"),
        (lambda p: altered(p, left=p.right, right=p.left), "swapped"),
        (lambda p: altered(p, right=p.left), "one and the same"),
        (lambda p: altered(p, right=np.ascontiguousarray(p.right[::-1])), "pixels match"),
    ],
)
def test_useless_images_are_refused_by_name(rock_snapshot, change, says):
    pair = rock_snapshot.pairs[0]
    with pytest.raises(InvalidImages, match=says) as caught:
        disparity(change(pair), TerrainSettings())
    assert pair.name in str(caught.value)


def camera_like(camera: Camera, **changes) -> Camera:
    fields = {name: getattr(camera, name) for name in Camera.__dataclass_fields__}
    return Camera(**{**fields, **changes})


def test_cameras_that_are_not_rectified_are_refused(make_pair, speckle):
    pair = shifted_pair(make_pair, speckle, 10)
    turned = np.array(pair.camera_right.T_base_camera)
    turned[:3, :3] = turned[:3, :3] @ cv2.Rodrigues(np.array([0.0, 0.01, 0.0]))[0]
    raised = np.array(pair.camera_right.T_base_camera)
    raised[1, 3] += 0.01
    for changes in ({"T_base_camera": turned}, {"T_base_camera": raised}, {"fx": 210.0}, {"cy": 60.0}):
        with pytest.raises(InvalidImages, match="not rectified"):
            disparity(altered(pair, camera_right=camera_like(pair.camera_right, **changes)), SETTINGS)


def test_sizes_that_differ_are_refused(make_pair, speckle):
    pair = shifted_pair(make_pair, speckle, 10)
    with pytest.raises(InvalidImages, match="its camera wants"):
        altered(pair, right=np.zeros((60, 80), np.uint8))
    smaller = camera_like(pair.camera_right, width=80, height=60)
    with pytest.raises(InvalidImages, match="different sizes"):
        disparity(altered(pair, right=np.zeros((60, 80), np.uint8), camera_right=smaller), SETTINGS)


def test_a_range_too_near_for_the_image_is_refused(make_pair, speckle):
    with pytest.raises(InvalidImages, match="larger min_range"):
        disparity(shifted_pair(make_pair, speckle, 10), TerrainSettings(min_range=0.1))
