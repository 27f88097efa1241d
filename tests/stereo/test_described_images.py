"""A robot of one's own sees the ground with its own cameras: itself is taken out, and what is left is the ground."""

import numpy as np
import pytest

from footfall.core import frames
from footfall.core.errors import NotFound
from footfall.core.mesh import Mesh
from footfall.io.link_images import decode_images, encode_images
from footfall.planning.legged.measured import measured_at_rest, standing_state
from footfall.planning.legged.under_feet import ground_told
from footfall.planning.legged.walk import plan_walk
from footfall.planning.looking.in_view import in_view
from footfall.robot.legged.posture import placed
from footfall.sequence.of_legged import make_legged_sequence
from footfall.sim.raycast import RayScene
from footfall.sim.render import render_snapshot
from footfall.terrain.build import build_terrain
from footfall.terrain.generate import fractal
from footfall.terrain.ground.surface import height_at
from footfall.terrain.rover_mask.leg_errors import ENCODER_SD
from footfall.terrain.rover_mask.legged_parts import SAG_SHARE, SLIDE_SD, legged_displacements, legged_parts
from footfall.terrain.rover_mask.selfmask import robot_depths
from footfall.terrain.terrain_settings import TerrainSettings
from tests.support.described import robot_of, seeing

WORLD = fractal(4.0, 0.02, roughness=0.02, seed=3)
SETTINGS = TerrainSettings(half_size=1.2, min_range=0.1)


@pytest.fixture(scope="module")
def robot():
    return seeing(robot_of(6)[1])


@pytest.fixture(scope="module")
def state(robot):
    return measured_at_rest(robot, WORLD)


@pytest.fixture(scope="module")
def snapshot(robot, state):
    return render_snapshot(robot, state, WORLD, seed=1)


@pytest.fixture(scope="module")
def built(robot, snapshot):
    return build_terrain(robot, snapshot, SETTINGS)


def shows(robot, state, camera) -> np.ndarray:
    """Pixels whose ray hits a body: the second, independent method."""
    T = frames.inverse(camera.T_base_camera)
    parts = [
        Mesh(frames.apply(T @ T_part, m.vertices), m.triangles) for m, T_part in legged_parts(robot, state.posture)
    ]
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)], -1).reshape(-1, 3)
    hits = RayScene(parts).first_hits(np.zeros(3), rays)
    return ((hits.body >= 0) & (hits.distance > 0.051)).reshape(u.shape)


def test_every_pixel_that_shows_it_is_taken_out(robot, state):
    shown = 0
    for pair in robot.description.cameras:
        for camera in (pair.camera_left, pair.camera_right):
            truth = shows(robot, state, camera)
            mask = robot_depths(robot, state, camera)
            assert not (truth & ~(mask > 0)).any()
            assert np.isinf(mask[truth]).mean() > 0.99
            shown += truth.sum()
    assert shown > 1000


def test_errors_of_joints_move_its_parts_as_forward_kinematics_do(robot, state):
    """Against differences of whole postures; the Ambler's legs slide, too."""
    from footfall.io.any_robot import load_legged

    ambler = load_legged("ambler")
    for one, q in ((robot, state.posture), (ambler, 0.5 * (ambler.lower + ambler.upper))):
        found = legged_displacements(one, q)
        parts = legged_parts(one, q)
        assert len(found) == len(parts)
        sliding = np.isin(one.joint_names, one.layout.sliding)
        drawn = [body for body, shapes in enumerate(one.shapes) if shapes]
        for (spread, bend, fitted), (mesh, T), body in zip(found, parts, drawn, strict=True):
            assert not fitted
            if body == 0:
                assert not spread.any()
                assert not bend.any()
                continue
            leg = next(leg for leg in one.legs if one.slices[leg].start < body <= one.slices[leg].stop)
            own = range(one.slices[leg].start, one.slices[leg].stop)
            before = frames.apply(T, mesh.vertices)
            for column, joint in enumerate(own):
                step = 1e-6
                moved = q.copy()
                moved[joint] += step
                after = frames.apply(placed(one, moved).Ts_base_body[body], mesh.vertices)
                deviation = SLIDE_SD if sliding[joint] else ENCODER_SD
                np.testing.assert_allclose(spread[..., column], deviation * (after - before) / step, atol=1e-5)


def test_legs_bend_so_that_a_loaded_foot_comes_nearer_by_as_much_as_is_assumed(robot, state):
    bends = legged_displacements(robot, state.posture)
    drawn = [body for body, shapes in enumerate(robot.shapes) if shapes]
    for leg in robot.legs:
        last = robot.slices[leg].stop
        bend = bends[drawn.index(last)][1]
        assert bend[:, 2].max() <= SAG_SHARE * robot.length * 1.3
        assert bend[:, 2].max() >= SAG_SHARE * robot.length * 0.7


def test_images_go_over_the_link_and_come_back(robot, snapshot):
    request, back = decode_images(encode_images("images-1", snapshot), 6, described=robot.layout)
    assert request == "images-1"
    assert back.digest == snapshot.digest
    with pytest.raises(NotFound, match="no camera pair 'rear'; it has out0"):
        render_snapshot(robot, snapshot.state, WORLD, pairs=["rear"])


def test_the_ground_in_the_images_is_the_ground(robot, state, built):
    x, y = np.meshgrid(built.geometry.xs, built.geometry.ys)
    off = built.heights - height_at(WORLD, x, y)
    known = np.isfinite(off)
    near = np.hypot(x, y) < 0.9
    assert known[near].mean() > 0.85
    assert abs(np.median(off[known])) < 0.001
    assert np.quantile(np.abs(off[known & near]), 0.95) < 0.006
    # nothing of the robot is left standing on it: 21 mm are where it is not taken out
    assert np.abs(off[known & (np.hypot(x, y) < 0.6)]).max() < 0.013
    assert built.provenance.parents["robot"] == robot.digest


def test_a_walk_is_planned_on_what_it_saw_and_holds_on_the_ground_that_is_there(robot, state, built):
    told = ground_told(robot, built, state)
    found = plan_walk(robot, told, standing_state(robot, told, state), (0.2, 0.0))
    assert found.plan is not None, found.reason
    sequence = make_legged_sequence(found.plan, robot, built)
    assert sequence.valid, sequence.failures
    # where feet were put down, the ground is where the images have it
    x, y, z = found.plan.end.contacts.T
    np.testing.assert_allclose(height_at(WORLD, x, y), z, atol=0.006)


def test_maps_made_of_images_know_what_is_said_to_be_in_view(robot, state, built):
    x, y = (one.ravel() for one in np.meshgrid(*[np.arange(-0.59, 0.6, 0.02)] * 2))
    points = np.column_stack([x, y, height_at(WORLD, x, y)])
    known, found = np.isfinite(height_at(built, x, y)), in_view(robot, built, state, points, SETTINGS)
    assert found.mean() >= 0.5
    assert known[found].mean() >= 0.97
    assert known[~found].mean() <= 0.5


def test_images_of_another_robot_are_refused(snapshot, athlete):
    from footfall.core.errors import InvalidImages

    with pytest.raises(InvalidImages, match="not of 'athlete'"):
        build_terrain(athlete, snapshot, SETTINGS)
