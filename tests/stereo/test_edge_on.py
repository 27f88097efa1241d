import numpy as np
import pytest

from footfall.telemetry.images import Camera
from footfall.terrain.pairs.edge_on import incidence
from footfall.terrain.pairs.refine import Refined

F, BASELINE, DOFFS = 120.0, 0.2, 3.0
CAMERA = Camera("left", 90, 70, F, F, 44.5, 34.5, np.eye(4))


def fitted(disparity: np.ndarray) -> Refined:
    """Slopes as differences of the neighbours on both sides."""
    down, along = np.gradient(disparity)
    return Refined(*(layer.astype(np.float32) for layer in (disparity, along, down, np.zeros_like(disparity))))


def rays() -> np.ndarray:
    u, v = np.meshgrid(np.arange(CAMERA.width), np.arange(CAMERA.height))
    return np.stack([(u - CAMERA.cx) / F, (v - CAMERA.cy) / F, np.ones(u.shape)], -1)


@pytest.mark.parametrize("normal", [(0.0, -1.0, -0.3), (0.9, 0.1, -0.5), (0.2, -0.95, 0.1), (0.0, 0.0, -1.0)])
def test_the_angle_is_that_between_ray_and_plane(normal):
    """Against geometry in space: the depth of every ray on a plane 2 m away, and the angle that it makes with it."""
    n = np.array(normal) / np.linalg.norm(normal)
    toward = rays() @ n
    with np.errstate(divide="ignore"):
        depth = (np.array([0.0, 0.0, 2.0]) @ n) / toward
    disparity = np.where(depth > 0.2, F * BASELINE / depth - DOFFS, np.nan)
    angle = np.arcsin(np.clip(np.abs(toward) / np.linalg.norm(rays(), axis=-1), 0, 1))
    found = incidence(fitted(disparity), CAMERA, DOFFS)
    sure = np.isfinite(found)
    assert sure.mean() > 0.3
    assert np.abs(found - angle)[sure].max() < 0.01


def test_a_slide_from_a_rock_to_the_ground_behind_it_is_met_edge_on():
    """In columns: rock at 13 px, three steps of less than half a pixel, ground at 11.5 px; also mirrored."""
    image = np.full((70, 90), 13.0)
    image[:, 33], image[:, 34], image[:, 35], image[:, 36:] = 12.6, 12.2, 11.8, 11.5
    for turned in (image, image[:, ::-1]):
        angle = incidence(fitted(turned), CAMERA, DOFFS)
        assert (angle[(turned > 11.7) & (turned < 12.7)] < 0.45).all()
        assert (angle[(turned == 13.0) | (turned == 11.5)] > 0.45).mean() > 0.95


def test_unknown_has_no_angle():
    image = np.full((70, 90), 9.0)
    image[10, 10] = np.nan
    assert np.isnan(incidence(fitted(image), CAMERA, DOFFS)[10, 10])
