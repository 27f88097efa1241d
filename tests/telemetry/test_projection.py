"""Points to pixels and back are inverse laws, and OpenCV says the same."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.telemetry.images import Camera
from footfall.telemetry.projection import in_image, project, sight

sizes = st.floats(50.0, 2000.0)
cameras = st.builds(
    lambda fx, fy, cx, cy: Camera("one", 640, 480, fx, fy, cx, cy, np.eye(4)),
    sizes,
    sizes,
    st.floats(0.0, 639.0),
    st.floats(0.0, 479.0),
)
ahead = st.tuples(st.floats(-20.0, 20.0), st.floats(-20.0, 20.0), st.floats(0.06, 50.0))


@given(cameras, st.floats(-0.5, 639.5), st.floats(-0.5, 479.5), st.floats(0.06, 50.0))
def test_what_a_pixel_looks_at_lies_in_that_pixel(camera, u, v, depth):
    point = depth * sight(camera, u, v)
    assert point[2] == pytest.approx(depth)
    assert project(camera, point) == pytest.approx([u, v], abs=1e-6)
    assert in_image(camera, np.array([u, v]))


@given(cameras, ahead)
def test_the_ray_of_a_points_pixel_goes_through_the_point(camera, point):
    u, v = project(camera, point)
    assert point[2] * sight(camera, u, v) == pytest.approx(np.array(point), rel=1e-9, abs=1e-9)


@given(cameras, st.lists(ahead, min_size=1, max_size=20))
def test_opencv_projects_alike(camera, points):
    K = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1.0]])
    expected = cv2.projectPoints(np.array(points), np.zeros(3), np.zeros(3), K, np.zeros(4))[0][:, 0]
    assert project(camera, points) == pytest.approx(expected, rel=1e-9, abs=1e-6)


@given(cameras, st.floats(-5, 5), st.floats(-5, 5), st.floats(-10.0, 0.049))
def test_what_is_not_in_front_has_no_pixel(camera, x, y, z):
    pixel = project(camera, (x, y, z))
    assert np.isnan(pixel).all()
    assert not in_image(camera, pixel)


def test_the_rim_of_the_image_is_half_a_pixel_outside_the_outermost_centres():
    camera = Camera("one", 4, 3, 10.0, 10.0, 1.5, 1.0, np.eye(4))
    inside = np.array([[-0.5, -0.5], [3.5, 2.5], [0.0, 2.0]])
    outside = np.array([[-0.51, 0.0], [3.51, 0.0], [0.0, -0.51], [0.0, 2.51]])
    assert in_image(camera, inside).all()
    assert not in_image(camera, outside).any()
