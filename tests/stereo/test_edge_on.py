import numpy as np
import pytest

from footfall.telemetry.images import Camera, ImagePair
from footfall.terrain.edge_on import without_edge_on

F, BASELINE, DOFFS = 120.0, 0.2, 3.0


def a_pair(width: int = 90, height: int = 70) -> ImagePair:
    image = np.zeros((height, width), np.uint8)
    T_right = np.eye(4)
    T_right[0, 3] = BASELINE
    left = Camera("left", width, height, F, F, (width - 1) / 2, (height - 1) / 2, np.eye(4))
    right = Camera("right", width, height, F, F, (width - 1) / 2 + DOFFS, (height - 1) / 2, T_right)
    return ImagePair("test", 0.0, image, image, left, right, np.eye(4))


def rays(pair: ImagePair) -> np.ndarray:
    camera = pair.camera_left
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    return np.stack([(u - camera.cx) / F, (v - camera.cy) / F, np.ones(u.shape)], -1)


@pytest.mark.parametrize("normal", [(0.0, -1.0, -0.3), (0.9, 0.1, -0.5), (0.2, -0.95, 0.1), (0.0, 0.0, -1.0)])
def test_the_angle_is_that_between_ray_and_plane(normal):
    """Against geometry in space: the depth of every ray on a plane 2 m away, and the angle that it makes with it."""
    pair = a_pair()
    n = np.array(normal) / np.linalg.norm(normal)
    toward = rays(pair) @ n
    with np.errstate(divide="ignore"):
        depth = (np.array([0.0, 0.0, 2.0]) @ n) / toward
    disparity = np.where(depth > 0.2, F * BASELINE / depth - DOFFS, np.nan).astype(np.float32)
    angle = np.arcsin(np.clip(np.abs(toward) / np.linalg.norm(rays(pair), axis=-1), 0, 1))
    for least in (0.1, 0.25, 0.45):
        kept = np.isfinite(without_edge_on(disparity, pair, least))
        sure = np.isfinite(disparity) & (np.abs(angle - least) > 0.01)
        assert np.array_equal(kept[sure], (angle > least)[sure])


def test_a_slide_from_a_rock_to_the_ground_behind_it_goes_and_both_stay():
    """In columns: rock at 13 px, three steps of less than half a pixel, ground at 11.5 px; also turned and mirrored."""
    pair = a_pair(70, 70)
    image = np.full((70, 70), 13.0, np.float32)
    image[:, 33], image[:, 34], image[:, 35], image[:, 36:] = 12.6, 12.2, 11.8, 11.5
    for turned in (image, image.T, image[:, ::-1], image[::-1].T):
        turned = np.ascontiguousarray(turned)
        kept = np.isfinite(without_edge_on(turned, pair, 0.45))
        assert not kept[(turned > 11.7) & (turned < 12.7)].any()
        assert kept[(turned == 13.0) | (turned == 11.5)].mean() > 0.95


def test_no_angle_at_all_keeps_everything_and_lone_pixels_stay(rng):
    pair = a_pair()
    image = rng.uniform(5.0, 40.0, (70, 90)).astype(np.float32)
    image[rng.uniform(size=image.shape) < 0.2] = np.nan
    assert np.array_equal(without_edge_on(image, pair, 0.0), image, equal_nan=True)
    lone = np.full((70, 90), np.nan, np.float32)
    lone[10, 10] = 20.0
    assert np.array_equal(without_edge_on(lone, pair, 0.3), lone, equal_nan=True)
