"""What keeps a map right over time: cameras out of place, poses that are off, obstacles that come and go.

All of it is planted in simulated images, so that the truth is known; nothing here was measured on a rover.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from benchmarks.ground_truth import cells_seen, true_heights
from benchmarks.scenes import robot, rocks, standing
from benchmarks.timing import SEED, Figure
from footfall.core.errors import InvalidImages
from footfall.core.frames import apply, transform
from footfall.robot.kinematics import wheel_centers
from footfall.sim.render import render_scene, render_snapshot
from footfall.telemetry.images import ImagePair, Snapshot
from footfall.telemetry.state import RobotState
from footfall.terrain.build import build_terrain
from footfall.terrain.dem import Dem
from footfall.terrain.generate import rock_field
from footfall.terrain.ground.surface import height_at
from footfall.terrain.pairs.epipolar import align_pair, estimate_rotation
from footfall.terrain.rocks import add_rocks
from footfall.terrain.terrain_settings import TerrainSettings

SMALL, LARGE, RECOVERED = 0.2, 1.0, 0.02
"""Planted turns of a right camera that are to be recovered and refused, and how well [deg]."""

POSE_SHIFT, POSE_TURN = 0.03, np.deg2rad(1.0)
SNAPSHOTS, STRIDE = 6, 0.3

HALF = 0.5
"""Wrong poses are planted at half the cameras' resolution: the images of two dozen snapshots are taken for them."""

OBSTACLE, TALL, CLEAN, KEPT = 0.3, 0.25, 0.05, 0.05
"""Diameter and height of what comes and goes, and by how much a cell may be off [m]."""

WELL_SEEN = 0.8

WORLD_CELL = 0.04
"""Of the ground that the images show, and of the maps [m]; between its cells the ground is that of its triangles."""


def figures(quick: bool) -> Iterator[Figure]:
    yield from _miscalibration(("nav1",) if quick else tuple(spec.name for spec in robot().description.cameras))
    yield from _wrong_poses(1 if quick else 4, ("nav0", "nav3") if quick else None)
    yield from _obstacles(1 if quick else 5)


def _miscalibration(names: tuple[str, ...]) -> Iterator[Figure]:
    """Right cameras that really stand turned about one axis; the pair still carries the model it should have."""
    scene = render_scene(robot(), standing(), rocks())
    errors, refused = [], []
    for name in names:
        spec = robot().description.camera_pair(name)
        left = scene.image(spec.camera_left, standing().T_site_base, np.random.default_rng([SEED, 0]))
        for axis in np.eye(3):
            for angle in (SMALL, LARGE):
                turned = Rotation.from_rotvec(np.deg2rad(angle) * axis).as_matrix()
                true = replace(spec.camera_right, T_base_camera=spec.camera_right.T_base_camera @ transform(turned))
                right = scene.image(true, standing().T_site_base, np.random.default_rng([SEED, 1]))
                pair = ImagePair(name, 0.0, left, right, spec.camera_left, spec.camera_right, standing().T_site_base)
                if angle == SMALL:
                    errors.append(float(np.abs(np.rad2deg(estimate_rotation(pair).rotation) - angle * axis).max()))
                else:
                    refused.append(_is_refused(pair))
    most = "terrain.turned_0.2_deg_recovered_worst"
    yield Figure(most, (max(errors),), "deg", RECOVERED)
    yield Figure("terrain.turned_0.2_deg_recovered", tuple(errors), "deg", RECOVERED)
    yield Figure(
        f"terrain.{len(refused)}_turned_1_deg_refused", (float(np.mean(refused)),), "share", 1.0, at_most=False
    )


def _is_refused(pair: ImagePair) -> bool:
    try:
        align_pair(pair)
    except InvalidImages:
        return True
    return False


def _wrong_poses(count: int, pairs: tuple[str, ...] | None) -> Iterator[Figure]:
    """A rover that walks on, each time sure of a pose that is 3 cm and 1° off; only the first is right."""
    growth, worst = [], []
    settings = TerrainSettings(keep=True, resolution=WORLD_CELL)
    for seed in range(SEED, SEED + count):
        rng = np.random.default_rng(seed)
        world, states = _walk(seed)
        dem: Dem | None = None
        errors = []
        for i, true in enumerate(states):
            images = render_snapshot(robot(), true, world, seed=seed + i, pairs=pairs, scale=HALF)
            told = true if i == 0 else _moved(true, rng)
            taken = tuple(replace(pair, T_site_base=told.T_site_base) for pair in images.pairs)
            now = build_terrain(robot(), Snapshot(told, taken), settings, map=dem)
            errors.append(float(np.nanmedian(np.abs(now.heights - true_heights(world, now.geometry)))))
            dem = now
        growth.append(errors[-1] - errors[0])
        worst.append(max(errors) - errors[0])
    yield Figure("terrain.six_snapshots_error_growth", tuple(growth), "m", 0.01)
    yield Figure("terrain.six_snapshots_error_growth_worst", (max(worst),), "m", 0.01)


def _walk(seed: int) -> tuple[Dem, list[RobotState]]:
    """Rocky ground and six places of the rover, one stride after the other."""
    world = rock_field(12.0, WORLD_CELL, abundance=0.05, smallest=0.1, largest=0.4, seed=seed)
    return world, [_placed(world, STRIDE * (i - 2.5), 60.0 * i) for i in range(SNAPSHOTS)]


def _placed(world: Dem, x: float, time: float) -> RobotState:
    """The rover level in its nominal posture, as low as the ground lets its wheels: what images need, no more."""
    posture = robot().posture("stand")
    T = transform(None, (x, 0.0, 0.0))
    wheels = apply(T, wheel_centers(robot(), posture))
    T[2, 3] = float(np.max(height_at(world, wheels[:, 0], wheels[:, 1]) - wheels[:, 2])) + robot().wheel_radius
    return RobotState(robot().name, time, posture, T, np.zeros((6, 3)), np.zeros(36), "idle")


def _moved(state: RobotState, rng: np.random.Generator) -> RobotState:
    """The state with its chassis told to be elsewhere, by 3 cm and 1° in random directions."""
    shift, axis = (vector / np.linalg.norm(vector) for vector in rng.normal(size=(2, 3)))
    T = state.T_site_base.copy()
    T[:3, :3] = Rotation.from_rotvec(POSE_TURN * axis).as_matrix() @ T[:3, :3]
    T[:3, 3] += POSE_SHIFT * shift
    return replace(state, T_site_base=T)


def _obstacles(count: int) -> Iterator[Figure]:
    """Obstacles that have gone at the second snapshot, and others that have come, where the cameras see them well."""
    cleaned, kept = [], []
    settings = TerrainSettings(keep=True, resolution=WORLD_CELL)
    for seed in range(SEED, SEED + count):
        ground = rock_field(12.0, WORLD_CELL, abundance=0.03, smallest=0.1, largest=0.2, seed=seed)
        gone, come = _ring(seed)
        worlds = add_rocks(ground, gone), add_rocks(ground, come)
        states = [_placed(ground, 0.0, 60.0 * i) for i in range(2)]
        images = [
            render_snapshot(robot(), state, world, seed=2 * seed + i)
            for i, (state, world) in enumerate(zip(states, worlds, strict=True))
        ]
        dem = build_terrain(robot(), images[1], settings, map=build_terrain(robot(), images[0], settings))
        truth = true_heights(worlds[1], dem.geometry)
        seen = [
            cells_seen(robot(), state, world, taken, dem.geometry)
            for state, world, taken in zip(states, worlds, images, strict=True)
        ]
        off = dem.heights - truth
        for x, y, _, _ in gone:
            on = _disc(dem, x, y)
            if min(float(one[on].mean()) for one in seen) >= WELL_SEEN:
                cleaned.append(not (off[on] > CLEAN).any())
        for x, y, _, _ in come:
            on = _disc(dem, x, y)
            if float(seen[1][on].mean()) >= WELL_SEEN:
                kept.append(abs(float(np.nanmax(dem.heights[on])) - float(truth[on].max())) <= KEPT)
    if cleaned:
        name = f"terrain.{len(cleaned)}_obstacles_gone_are_cleaned"
        yield Figure(name, (float(np.mean(cleaned)),), "share", 1.0, at_most=False)
    if kept:
        yield Figure(f"terrain.{len(kept)}_new_obstacles_kept", (float(np.mean(kept)),), "share", 1.0, at_most=False)


def _ring(seed: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Five places each, in turn, around the rover and outside of its feet."""
    rng = np.random.default_rng([seed, 7])
    angles = np.arange(10) * np.pi / 5 + rng.uniform(0.0, np.pi / 5)
    radii = rng.uniform(2.6, 3.2, 10)
    places = [(r * np.cos(a), r * np.sin(a), OBSTACLE, TALL) for r, a in zip(radii, angles, strict=True)]
    return np.array(places[::2]), np.array(places[1::2])


def _disc(dem: Dem, x: float, y: float) -> NDArray[np.bool_]:
    """Cells on an obstacle, its rim left out: a cell beside a step may have either height."""
    xs, ys = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    return np.hypot(xs - x, ys - y) < 0.5 * OBSTACLE - 0.02
