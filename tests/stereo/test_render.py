import numpy as np
import pytest

from footfall.core import frames
from footfall.core.errors import Cancelled, InvalidTerrain, NotFound
from footfall.core.grid import GridGeometry
from footfall.sim.raycast import RayScene
from footfall.sim.render import RenderScene, render_pair, render_scene, render_snapshot
from footfall.telemetry.images import Camera
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.generate import plane, rock_field
from footfall.terrain.ground.triangulate import triangulate


def test_same_seed_same_images_alone_or_together(athlete, rocks, rock_state, rock_snapshot):
    again = render_snapshot(athlete, rock_state, rocks, seed=1, scale=0.5, pairs=["haz1", "nav2"])
    together = {pair.name: pair for pair in rock_snapshot.pairs}
    for pair in again.pairs:
        assert pair.digest == together[pair.name].digest
    other = render_snapshot(athlete, rock_state, rocks, seed=2, scale=0.5, pairs=["nav2"])
    difference = np.abs(other.pairs[0].left.astype(int) - together["nav2"].left)
    assert 0 < difference.mean() < 3  # the same scene with other noise


def test_snapshot_has_every_pair_of_the_robot(athlete, rock_snapshot, rock_state):
    assert [pair.name for pair in rock_snapshot.pairs] == [spec.name for spec in athlete.description.cameras]
    assert len(rock_snapshot.pairs) == 9
    assert rock_snapshot.state is rock_state
    for pair in rock_snapshot.pairs:
        assert pair.left.shape == (240, 320)
        assert pair.left.std() > 10
        assert pair.baseline == pytest.approx(0.2)


def test_unknown_pairs_are_refused(athlete, rocks, rock_state):
    with pytest.raises(NotFound, match=r"mast.*nav0"):
        render_snapshot(athlete, rock_state, rocks, pairs=["mast"])


def test_rendering_can_be_cancelled(athlete, rocks, rock_state):
    def stop(fraction: float, text: str) -> None:
        raise Cancelled("stop")

    with pytest.raises(Cancelled):
        render_snapshot(athlete, rock_state, rocks, progress=stop)


def test_both_images_agree_where_both_see_the_ground(rocks, rock_state, athlete):
    """A left pixel carried through its true depth into the right image has the same grey, noise aside."""
    scene = render_scene(athlete, rock_state, rocks)
    pair = render_pair(scene, rock_state, athlete.description.camera_pair("nav1"), seed=3, scale=0.5)
    left = pair.camera_left
    T = pair.T_site_base @ left.T_base_camera
    u, v = np.meshgrid(np.arange(left.width), np.arange(left.height))
    rays = np.stack([(u - left.cx) / left.fx, (v - left.cy) / left.fy, np.ones(u.shape)], -1).reshape(-1, 3)
    hits = RayScene([triangulate(rocks)]).first_hits(T[:3, 3], rays @ T[:3, :3].T)
    z = hits.distance.reshape(u.shape)  # the rays advance one metre of depth a length
    partner = u - left.fx * pair.baseline / z
    ok = (hits.body.reshape(u.shape) >= 0) & (partner >= 0) & (partner < left.width - 1)
    column = np.floor(np.where(ok, partner, 0)).astype(int)
    t = np.where(ok, partner, 0) - column
    right = pair.right[v, column] * (1 - t) + pair.right[v, np.minimum(column + 1, left.width - 1)] * t
    difference = np.abs(right - pair.left)[ok]
    assert ok.mean() > 0.5
    assert np.median(difference) < 4.0
    unrelated = np.abs(np.roll(right, 7, axis=1) - pair.left)[ok]
    assert np.median(unrelated) > 3 * np.median(difference)


def test_pixel_centres(rng):
    """An edge in the world falls on the column that the camera model says: the first pixel's centre is at 0."""
    half = plane(8.0, 0.5)
    west = half.heights.copy()
    west[:, half.geometry.xs > 0.0] = np.nan  # ground ends at x = 0
    ground = triangulate(Dem(west, half.geometry, "west", half.provenance))
    T_down = np.diag([1.0, -1.0, -1.0, 1.0])
    T_down[2, 3] = 2.0
    for cx in (31.2, 31.4, 31.6):
        camera = Camera("down", 64, 8, 64.0, 64.0, cx, 3.5, T_down)
        lit = RenderScene(ground).image(camera, np.eye(4), rng)[4] > 20
        assert lit[:32].all()  # the columns left of cx see x ≤ 0
        assert not lit[32:].any()


def test_grain_sticks_to_the_site_while_the_camera_moves(rng):
    scene = RenderScene(triangulate(plane(6.0, 0.5)))
    T = np.diag([1.0, -1.0, -1.0, 1.0])
    T[2, 3] = 2.0
    camera = Camera("down", 120, 90, 100.0, 100.0, 59.5, 44.5, T)
    here = scene.image(camera, np.eye(4), rng).astype(float)
    there = scene.image(camera, frames.transform(None, (0.2, 0.0, 0.0)), rng).astype(float)  # ten pixels east
    assert np.abs(there[:, :-10] - here[:, 10:]).mean() < 3.0
    assert np.abs(there - here).mean() > 8.0


def test_far_from_the_sites_origin_all_looks_the_same():
    """Map coordinates of half a million metres must not cost precision; the grain repeats every 10.24 m."""
    images = []
    for east in (0.0, 10.24 * 50_000):
        ground = rock_field(6.0, 0.05, seed=4)
        ground = Dem(
            ground.heights,
            GridGeometry(ground.geometry.x0 + east, ground.geometry.y0, 0.05, *ground.geometry.shape),
            "rocks",
            ground.provenance,
        )
        T = np.diag([1.0, -1.0, -1.0, 1.0])
        T[2, 3] = 2.5
        camera = Camera("down", 120, 90, 100.0, 100.0, 59.5, 44.5, T)
        T_site_base = frames.transform(None, (east, 0.0, 0.0))
        images.append(RenderScene(triangulate(ground)).image(camera, T_site_base, np.random.default_rng(0)).astype(int))
    assert np.median(np.abs(images[0] - images[1])) == 0
    assert np.abs(images[0] - images[1]).mean() < 0.1


def test_a_rover_off_the_terrain_is_told(athlete, rocks, rock_state):
    s = rock_state
    away = frames.transform(None, (100.0, 0.0, 2.0))
    state = RobotState(s.robot, s.time, s.posture, away, s.wheel_forces, s.joint_torques, s.mode)
    with pytest.raises(InvalidTerrain, match=r"within 40 m of the rover at \(100.0, 0.0\)"):
        render_snapshot(athlete, state, rocks)


def test_sky_is_dark(athlete, rock_snapshot):
    haz = next(pair for pair in rock_snapshot.pairs if pair.name == "haz0")
    assert (haz.left < 5).mean() > 0.02


def test_reduced_cameras_look_the_same_way(athlete):
    camera = athlete.description.cameras[0].camera_left
    small = camera.reduced(0.25)
    assert (small.width, small.height) == (160, 120)
    for model in (camera, small):
        # the rays through the image's outer edges, half a pixel outside the outermost centres
        assert (-0.5 - model.cx) / model.fx == pytest.approx((-0.5 - camera.cx) / camera.fx)
        assert (model.width - 0.5 - model.cx) / model.fx == pytest.approx((camera.width - 0.5 - camera.cx) / camera.fx)
