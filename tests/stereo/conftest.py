"""One simulated snapshot for all tests of this folder: nine pairs at half the resolution, over a rock field."""

import numpy as np
import pytest

from footfall.core import frames
from footfall.robot.kinematics import wheel_centers
from footfall.sim.render import render_snapshot
from footfall.telemetry.images import Camera, ImagePair
from footfall.telemetry.state import RobotState
from footfall.terrain.build import build_terrain
from footfall.terrain.dem import Dem
from footfall.terrain.generate import rock_field
from footfall.terrain.ground.surface import height_at
from footfall.terrain.terrain_settings import TerrainSettings

SCALE = 0.5


def standing_state(robot, dem: Dem, yaw: float = 0.3) -> RobotState:
    """Level, as low as the ground under the wheels lets it."""
    posture = robot.posture("stand")
    T_site_base = frames.transform(frames.rotation("z", yaw))
    wheels = frames.apply(T_site_base, wheel_centers(robot, posture))
    T_site_base[2, 3] = np.max(height_at(dem, wheels[:, 0], wheels[:, 1]) - wheels[:, 2] + robot.wheel_radius)
    n = 6 * robot.leg_count
    return RobotState(robot.name, 0.0, posture, T_site_base, np.zeros((robot.leg_count, 3)), np.zeros(n), "idle")


def downward_pair(left, right, f: float = 200.0, baseline: float = 0.2, height: float = 2.0, doffs: float = 0.0):
    """A pair that looks straight down from ``height`` above the site's origin; image rows run south."""
    T_left = np.diag([1.0, -1.0, -1.0, 1.0])
    T_left[2, 3] = height
    T_right = T_left.copy()
    T_right[0, 3] = baseline
    h, w = left.shape
    cameras = [
        Camera(name, w, h, f, f, (w - 1) / 2 + shift, (h - 1) / 2, T)
        for name, shift, T in (("left", 0.0, T_left), ("right", doffs, T_right))
    ]
    return ImagePair("down", 0.0, left, right, cameras[0], cameras[1], np.eye(4))


@pytest.fixture(scope="session")
def make_pair():
    """:func:`downward_pair`, for test files that can't import this one."""
    return downward_pair


@pytest.fixture(scope="session")
def standing():
    """:func:`standing_state`, likewise."""
    return standing_state


@pytest.fixture(scope="session")
def rocks() -> Dem:
    return rock_field(12.0, 0.02, smallest=0.08, largest=1.0, seed=3)


@pytest.fixture(scope="session")
def rock_state(athlete, rocks) -> RobotState:
    return standing_state(athlete, rocks)


@pytest.fixture(scope="session")
def rock_snapshot(athlete, rocks, rock_state):
    return render_snapshot(athlete, rock_state, rocks, seed=1, scale=SCALE)


@pytest.fixture(scope="session")
def rock_dem(athlete, rock_snapshot) -> Dem:
    return build_terrain(athlete, rock_snapshot, TerrainSettings())


@pytest.fixture(scope="session")
def speckle():
    """A textured image, (120, 240), from which both images of a pair are cut."""
    fine = np.random.default_rng(5).integers(20, 230, (120, 240))
    return np.clip((fine + np.roll(fine, 1, 0) + np.roll(fine, 1, 1)) / 3, 0, 255).astype(np.uint8)
