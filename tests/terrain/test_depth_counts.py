"""Depth images whose numbers are counts, no depth at all, or seen by another camera than their calibration says."""

import io
from typing import Any

import numpy as np
import pytest
from PIL import Image

from footfall.core.errors import InvalidTerrain
from footfall.io.depth_files import read_depth


def test_counts_of_depth_that_were_turned_to_floats_are_counts():
    """The picture of 16 bit that was read and saved as floats: ground 1500 m away."""
    members: dict[str, Any] = {"focal_length": 100.0, "cx": 1.0, "cy": 1.0}
    for depth, far in ((np.full((2, 2), 1500.0), None), (np.full((2, 2), 2.0), 2.0), (np.full((2, 2), 150.5), 150.5)):
        held = io.BytesIO()
        np.savez(held, depth=depth, **members)
        if far is None:
            with pytest.raises(InvalidTerrain, match="depth_scale"):
                read_depth(held.getvalue(), "a.npz")
        else:
            assert read_depth(held.getvalue(), "a.npz").points[:, 2].max() == far


def packed(**arrays: Any) -> bytes:
    held = io.BytesIO()
    np.savez(held, depth=np.array([[1500.5, 1600.25], [0.0, 1700.0]]), fx=100.0, fy=100.0, cx=1.0, cy=1.0, **arrays)
    return held.getvalue()


def test_the_unit_that_depths_state_is_heeded():
    """Millimetres of floats were metres."""
    for said in ({"units": "mm"}, {"depth_unit": "MM"}):
        with pytest.raises(InvalidTerrain, match=r"a\.npz says that its unit is 'mm', .*state depth_scale"):
            read_depth(packed(**said), "a.npz")
        scan = read_depth(packed(**said, depth_scale=0.001), "a.npz")
        assert scan.points[:, 2].tolist() == pytest.approx([1.5005, 1.60025, 1.7])
    assert read_depth(packed(unit="Metres"), "a.npz").points[:, 2].max() == 1700.0


@pytest.mark.parametrize(
    "said",
    [{"mask": np.eye(2, dtype=bool)}, {"scale": 0.001}, {"Offset": 1.0}, {"nodata": 1600.25}, {"valid": np.eye(2)}],
)
def test_arrays_that_would_change_depths_are_refused_by_name(said):
    with pytest.raises(InvalidTerrain, match=f"has an array {next(iter(said))}, which would be passed over"):
        read_depth(packed(**said), "a.npz")
    read_depth(packed(name="of May", time=1.0), "a.npz")


@pytest.mark.parametrize("shape", [(5,), (1, 5), (5, 1)])
def test_depths_of_a_lens_that_distorts_are_refused(shape):
    """As OpenCV saves it, the array was passed over, or called damaged."""
    for name in ("D", "dist_coeffs"):
        with pytest.raises(InvalidTerrain, match=f"has an array {name}, of a lens that distorts"):
            read_depth(packed(**{name: np.full(shape, 0.1)}), "a.npz")
        read_depth(packed(**{name: np.zeros(shape)}), "a.npz")


def test_a_camera_matrix_beside_another_calibration_is_refused():
    K = np.array([[100.0, 0, 1], [0, 100, 1], [0, 0, 1]])
    read_depth(packed(K=K, intrinsics="of May"), "a.npz")
    with pytest.raises(
        InvalidTerrain, match=r"camera matrix \[\[200.0, 0.0, 2.0\].* would be read with fx 100, fy 100"
    ):
        read_depth(packed(K=2 * K), "a.npz")


def test_the_highest_count_of_16_bits_is_no_depth():
    """It was ground 65.5 m away."""
    depth = np.array([[1500, 65535], [1600, 1700]], np.uint16)
    calibration = {"focal_length": 100.0, "cx": 1.0, "cy": 1.0, "depth_scale": 0.001}
    packed, picture = io.BytesIO(), io.BytesIO()
    np.savez(packed, depth=depth)
    Image.fromarray(depth).save(picture, "PNG")
    for content, name in ((packed, "a.npz"), (picture, "a.png")):
        scan = read_depth(content.getvalue(), name, calibration)
        assert scan.points[:, 2].tolist() == [1.5, 1.6, 1.7]


def test_a_calibration_of_larger_depth_images_is_refused():
    """Points of an image half as large lay to one side of the camera, half as far apart."""
    held = io.BytesIO()
    np.savez(held, depth=np.full((240, 320), 2.0))
    with pytest.raises(InvalidTerrain, match=r"centre at \(318, 241\), in the far corner of 320 × 240 pixels"):
        read_depth(held.getvalue(), "a.npz", {"focal_length": 600.0, "cx": 318.0, "cy": 241.0})
    for cx, cy in ((159.0, 121.0), (160.0, 230.0), (20.0, 15.0)):  # whole, without its lower half, a corner
        read_depth(held.getvalue(), "a.npz", {"focal_length": 300.0, "cx": cx, "cy": cy})
