import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core import frames
from footfall.core.mesh import Mesh
from footfall.robot.description import with_payload
from footfall.robot.meshes.shapes import box
from footfall.robot.model import Robot
from footfall.sim.raycast import RayScene
from footfall.telemetry.images import Camera
from footfall.telemetry.state import RobotState
from footfall.terrain.rover_mask.selfmask import beside, mesh_depths, robot_depths, robot_parts


def mesh_mask(parts: list[Mesh], camera: Camera, margin: float, extra_px: int) -> np.ndarray:
    return mesh_depths(parts, camera, margin, extra_px) > 0


CAMERA = Camera("test", 80, 60, 50.0, 50.0, 39.5, 29.5, np.eye(4))


def shows(parts: list[Mesh], camera: Camera) -> np.ndarray:
    """Pixels whose ray hits a part: the second, independent method. Parts in the camera frame."""
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)], -1).reshape(-1, 3)
    hits = RayScene(parts).first_hits(np.zeros(3), rays)
    return ((hits.body >= 0) & (hits.distance > 0.051)).reshape(u.shape)


@pytest.mark.parametrize("posture", ["stand", "crouch", "tall"])
def test_every_pixel_of_the_robot_is_covered_in_every_image(athlete, posture):
    q = athlete.posture(posture)
    state = RobotState(athlete.name, 0.0, q, np.eye(4), np.zeros((6, 3)), np.zeros(36), "idle")
    for spec in athlete.description.cameras:
        for camera in (spec.camera_left, spec.camera_right):
            T = frames.inverse(camera.T_base_camera)
            parts = [Mesh(frames.apply(T @ T_part, m.vertices), m.triangles) for m, T_part in robot_parts(athlete, q)]
            truth = shows(parts, camera)
            mask = robot_depths(athlete, state, camera) > 0
            assert not (truth & ~mask).any()
            assert mask.mean() < truth.mean() + 0.25


@given(
    center=st.tuples(st.floats(-1.5, 1.5), st.floats(-1.0, 1.0), st.floats(-0.5, 3.0)),
    size=st.tuples(*[st.floats(0.05, 2.0)] * 3),
    yaw=st.floats(-3.1, 3.1),
)
def test_boxes_anywhere_even_across_the_lens_are_covered(center, size, yaw):
    T = frames.transform(frames.rotation("y", yaw), center)
    solid = box(size)
    part = Mesh(frames.apply(T, solid.vertices), solid.triangles)
    truth = shows([part], CAMERA)
    mask = mesh_mask([part], CAMERA, margin=0.0, extra_px=1)
    assert not (truth & ~mask).any()
    if not (part.vertices[:, 2] < 0.1).any():
        tight = mesh_mask([part], CAMERA, margin=0.0, extra_px=0)
        outside = tight & ~truth
        assert outside.sum() <= 0.1 * tight.sum() + 200  # the rim of pixels that are only touched


def test_the_margin_is_metric(athlete):
    solid = box((0.2, 0.2, 0.2), (0.0, 0.0, 2.1))
    plain = mesh_mask([solid], CAMERA, margin=0.0, extra_px=0)
    wide = mesh_mask([solid], CAMERA, margin=0.2, extra_px=0)
    # 0.2 m at 2 m and f = 50 px are five pixels on each side
    assert wide.any(axis=0).sum() == plain.any(axis=0).sum() + 10
    assert wide.any(axis=1).sum() == plain.any(axis=1).sum() + 10


def test_parts_behind_the_camera_show_nowhere():
    assert not mesh_mask([box((1, 1, 1), (0.0, 0.0, -2.0))], CAMERA, 0.03, 3).any()
    assert not mesh_mask([], CAMERA, 0.03, 3).any()


def test_the_payload_is_part_of_the_robot(athlete):
    loaded = Robot(with_payload(athlete.description, 100.0, size=(1.0, 1.0, 0.8), position=(0.0, 0.0, -0.6)))
    state = RobotState("athlete", 0.0, athlete.posture("stand"), np.eye(4), np.zeros((6, 3)), np.zeros(36), "idle")
    camera = athlete.description.camera_pair("haz0").camera_left
    mine, plain = ((robot_depths(robot, state, camera) > 0).sum() for robot in (loaded, athlete))
    assert mine > plain + 1000


@given(st.integers(0, 2**32 - 1), st.integers(1, 5))
def test_beside_a_rim_counts_the_deepest_one_around(seed, width):
    rng = np.random.default_rng(seed)
    depths = rng.choice(np.array([0.0, 0.0, 0.0, 1.5, 2.5, np.inf], np.float32), (9, 12))
    found = beside(depths, width)
    finite = np.where(np.isinf(depths), 0.0, depths)
    for row, col in np.ndindex(depths.shape):
        around = finite[max(row - width, 0) : row + width + 1, max(col - width, 0) : col + width + 1]
        assert found[row, col] == around.max()
