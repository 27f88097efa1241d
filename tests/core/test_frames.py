"""Laws of rigid transforms, against scipy's Rotation as the second method."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from footfall.core.errors import InvalidInput
from footfall.core.frames import (
    apply,
    heading,
    inverse,
    quat_wxyz,
    require_transform,
    rotation,
    rotation_from_quat_wxyz,
    rotation_from_z,
    rotation_rpy,
    rpy,
    transform,
    turn_of,
)

ANGLES = st.floats(-10, 10)
METRES = st.floats(-1e3, 1e3)
VECTORS = st.tuples(METRES, METRES, METRES).map(np.array)
ROTATIONS = (
    st.tuples(*[st.floats(-1, 1)] * 4)
    .filter(lambda q: np.linalg.norm(q) > 0.1)
    .map(lambda q: Rotation.from_quat(q).as_matrix())
)
TRANSFORMS = st.builds(transform, ROTATIONS, VECTORS)


@given(TRANSFORMS)
def test_the_inverse_undoes(T):
    np.testing.assert_allclose(T @ inverse(T), np.eye(4), atol=1e-9)
    np.testing.assert_allclose(inverse(T), np.linalg.inv(T), atol=1e-9)
    np.testing.assert_allclose(inverse(inverse(T)), T, atol=1e-9)


@given(st.lists(TRANSFORMS, min_size=6, max_size=6))
def test_the_inverse_of_a_stack_is_the_stack_of_inverses(Ts):
    stack = np.array(Ts).reshape(2, 3, 4, 4)
    single = np.array([inverse(T) for T in Ts]).reshape(2, 3, 4, 4)
    # a stacked product may round its last digit otherwise
    np.testing.assert_allclose(inverse(stack), single, rtol=1e-15, atol=1e-12)


@given(TRANSFORMS, TRANSFORMS, VECTORS)
def test_apply_follows_composition(T_a_b, T_b_c, p_c):
    np.testing.assert_allclose(apply(T_a_b @ T_b_c, p_c), apply(T_a_b, apply(T_b_c, p_c)), atol=1e-8)
    np.testing.assert_allclose(apply(T_a_b, p_c), (T_a_b @ [*p_c, 1.0])[:3], atol=1e-9)
    np.testing.assert_allclose(apply(inverse(T_a_b), apply(T_a_b, p_c)), p_c, atol=1e-8)


def test_apply_keeps_the_shape_of_the_points(rng):
    points = rng.normal(size=(2, 5, 3))
    T = transform(rotation("z", 0.3), (1, 2, 3))
    moved = apply(T, points)
    assert moved.shape == points.shape
    np.testing.assert_allclose(moved[1, 4], apply(T, points[1, 4]), atol=1e-12)


@given(ANGLES, ANGLES, ANGLES)
def test_rotation_rpy_is_scipys_fixed_axes_xyz(roll, pitch, yaw):
    want = Rotation.from_euler("xyz", [roll, pitch, yaw]).as_matrix()
    np.testing.assert_allclose(rotation_rpy(roll, pitch, yaw), want, atol=1e-12)


@given(ROTATIONS, VECTORS)
def test_rpy_leads_back_to_the_rotation_and_its_yaw_is_the_heading(R, place):
    np.testing.assert_allclose(rotation_rpy(*rpy(R)), R, atol=1e-6)
    assert abs(rpy(R)[1]) <= np.pi / 2
    assert heading(transform(R, place)) == rpy(R)[2]


@given(st.floats(-np.pi, np.pi), st.floats(-1.5, 1.5), st.floats(-np.pi, np.pi))
def test_rpy_is_scipys_where_pitch_is_not_upright(roll, pitch, yaw):
    R = Rotation.from_euler("xyz", [roll, pitch, yaw])
    np.testing.assert_allclose(rotation_rpy(*rpy(R.as_matrix())), R.as_matrix(), atol=1e-9)
    np.testing.assert_allclose(rpy(R.as_matrix())[1], R.as_euler("xyz")[1], atol=1e-9)


@given(ROTATIONS)
def test_how_far_a_rotation_turns_is_scipys(R):
    # near 0 and π the cosine says little
    np.testing.assert_allclose(turn_of(R), Rotation.from_matrix(R).magnitude(), atol=1e-6)


@given(st.sampled_from("xyz"), st.lists(ANGLES, min_size=1, max_size=5))
def test_rotation_about_an_axis_is_scipys(axis, angles):
    want = Rotation.from_rotvec(np.outer(angles, np.eye(3)["xyz".index(axis)])).as_matrix()
    np.testing.assert_allclose(rotation(axis, angles), want, atol=1e-12)


@given(ROTATIONS)
def test_quaternion_round_trip(R):
    q = quat_wxyz(R)
    assert np.linalg.norm(q) == pytest.approx(1.0, abs=1e-12)
    assert q[0] >= 0
    np.testing.assert_allclose(rotation_from_quat_wxyz(q), R, atol=1e-9)
    np.testing.assert_allclose(Rotation.from_quat(q[[1, 2, 3, 0]]).as_matrix(), R, atol=1e-9)


@pytest.mark.parametrize("axis", "xyz")
@pytest.mark.parametrize("angle", [np.pi, np.pi - 1e-9, -np.pi + 1e-9, np.pi / 2, 0.0])
def test_quaternions_hold_at_half_turns(axis, angle):
    R = rotation(axis, angle)
    np.testing.assert_allclose(rotation_from_quat_wxyz(quat_wxyz(R)), R, atol=1e-12)


@pytest.mark.parametrize(
    "q",
    [[1, 0, 0], [0, 0, 0, 0], [1, 1, 0, 0], [np.nan, 0, 0, 0], [[1, 0, 0, 0]], ["w", 0, 0, 0], [[1], 0, 0, 0], None],
)
def test_other_quaternions_are_refused(q):
    with pytest.raises(InvalidInput, match="quaternion"):
        rotation_from_quat_wxyz(q)


@given(VECTORS, VECTORS)
def test_a_frame_from_its_normal(normal, forward):
    lengths = np.linalg.norm(normal), np.linalg.norm(forward)
    assume(min(lengths) > 1e-3)
    assume(np.linalg.norm(np.cross(normal / lengths[0], forward / lengths[1])) > 1e-3)
    R = rotation_from_z(normal, forward)
    require_transform(transform(R), "R")
    np.testing.assert_allclose(R[:, 2], normal / lengths[0], atol=1e-9)
    assert R[:, 0] @ forward > 0
    assert R[:, 1] @ forward == pytest.approx(0, abs=1e-6)


def test_the_length_of_the_normal_does_not_matter():
    want = rotation_from_z((0.1, 0.2, 1.0))
    for scale in (1e-200, 1e-12, 1e12, 1e300):
        np.testing.assert_allclose(rotation_from_z(np.array([0.1, 0.2, 1.0]) * scale), want, atol=1e-12)


@pytest.mark.parametrize(
    ("normal", "forward"),
    [
        ((0, 0, 0), (1, 0, 0)),
        ((1, 0, 0), (1, 0, 0)),
        ((-5, 0, 0), (1, 0, 0)),
        ((0, 0, 1), (0, 0, 0)),
        ((0, np.nan, 1), (1, 0, 0)),
        ((0, np.inf, 1), (1, 0, 0)),
        ((1e9, 1e-6, 0), (1, 0, 0)),
    ],
)
def test_a_frame_without_directions_is_refused(normal, forward):
    with pytest.raises(InvalidInput):
        rotation_from_z(normal, forward)


@given(TRANSFORMS)
def test_rigid_transforms_are_accepted_unchanged(T):
    assert require_transform(T, "T_site_base") is T
    np.testing.assert_array_equal(require_transform(T.tolist(), "T_site_base"), T)


def spoiled(row, col, number):
    T = np.eye(4)
    T[row, col] = number
    return T


# row by row orthogonal, but the products overflow to inf − inf
HUGE = transform(np.array([[1e200, -1e200, 0], [1e200, 1e200, 0], [0, 0, 1]]))


@pytest.mark.parametrize(
    "T",
    [
        np.eye(3),
        np.zeros((2, 4, 4)),
        spoiled(0, 0, np.nan),
        spoiled(1, 3, np.inf),
        spoiled(0, 0, 1.001),
        spoiled(0, 0, -1.0),
        spoiled(0, 1, 1e-3),
        spoiled(3, 0, 1e-12),
        spoiled(3, 3, 2.0),
        np.zeros((4, 4)),
        HUGE,
        np.full((4, 4), 1e308),
        "pose",
        None,
        [[1, 0], [0]],
        [["a"] * 4] * 4,
    ],
    ids=range(16),
)
def test_what_is_no_rigid_transform_is_refused_by_name(T):
    with pytest.raises(InvalidInput, match="T_site_base"):
        require_transform(T, "T_site_base")
