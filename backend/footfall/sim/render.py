"""What the rover's cameras would see: ray cast of terrain and robot, with grain, sun, shadows and sensor noise.

No graphics hardware. One seed always gives the same images, and a pair looks the same whether it was asked for
alone or with the others.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from footfall.core import frames
from footfall.core.errors import InvalidTerrain, NotFound
from footfall.core.mesh import Mesh
from footfall.core.progress import Progress, no_progress
from footfall.robot.description import CameraPairSpec
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.model import Robot
from footfall.sim.optics import EASY, CameraEffects, exposed
from footfall.sim.raycast import TERRAIN, RayScene
from footfall.sim.regolith import grain
from footfall.telemetry.images import Camera, ImagePair, Snapshot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.ground.triangulate import crop
from footfall.terrain.rover_mask.selfmask import robot_parts

GROUND_ALBEDO = 0.42
METAL_ALBEDO, METAL_CONTRAST = 0.62, 0.06

RIM = 0.02
"""Neighbouring pixels whose radiances differ by more have an edge between them (white facing the sun is 1)."""

SIGHT = 40.0
"""Ground further away is not drawn [m]."""

NEAREST = 0.02
"""The lens keeps nothing closer than this [m]: its own housing is not in the image."""


class RenderScene:
    """Terrain and robot at one state, ready to be looked at; build once, render any number of cameras.

    Meshes are in the site frame. ``links`` are the posed link meshes with their T_site_link.
    """

    def __init__(self, ground: Mesh, links: Sequence[tuple[Mesh, NDArray[np.float64]]] = ()) -> None:
        # rays are cast in single precision: near this point, wherever on a large site it lies
        self._near = np.rint(ground.vertices.mean(axis=0))
        bodies = [(ground, np.eye(4)), *links]
        self._rays = RayScene(
            [
                Mesh(frames.apply(T_site_body, mesh.vertices) - self._near, mesh.triangles)
                for mesh, T_site_body in bodies
            ]
        )
        self._Ts_body_site = frames.inverse(np.stack([T_site_body for _, T_site_body in bodies]))

    def image(
        self,
        camera: Camera,
        T_site_base: NDArray[np.float64],
        rng: np.random.Generator,
        effects: CameraEffects = EASY,
        gain: float = 1.0,
    ) -> NDArray[np.uint8]:
        """Grey image, (height, width) uint8; the sky is black. gain: brightness relative to other cameras."""
        T_site_camera = T_site_base @ camera.T_base_camera
        u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
        rays = _rays(camera, u.ravel(), v.ravel())
        light, body = self._light(T_site_camera, rays, camera.fx, effects)
        n = effects.supersampling
        if n > 1:
            edge = np.flatnonzero(_edges(light.reshape(u.shape), body.reshape(u.shape)))
            inside = (np.arange(n) + 0.5) / n - 0.5
            total = np.zeros(len(edge))
            for dv in inside:
                for du in inside:
                    finer = _rays(camera, u.ravel()[edge] + du, v.ravel()[edge] + dv)
                    total += self._light(T_site_camera, finer, n * camera.fx, effects)[0]
            light[edge] = total / n**2
        return exposed(light, rays, camera, effects, gain, rng)

    def _light(
        self, T_site_camera: NDArray[np.float64], rays: NDArray[np.float64], focal: float, effects: CameraEffects
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Radiance along rays (n, 3) of the camera frame and the bodies hit; ``focal``: samples across unit depth."""
        rays = np.einsum("ij,nj->ni", T_site_camera[:3, :3], rays)
        origin = T_site_camera[:3, 3]
        hits = self._rays.first_hits(origin - self._near, rays)
        light = np.zeros(len(rays))
        seen = np.flatnonzero((hits.body >= 0) & (hits.distance > NEAREST))
        points = origin + rays[seen] * hits.distance[seen, None]
        pixel = hits.distance[seen] / focal
        light[seen] = self._radiance(points, hits.normal[seen], hits.body[seen], rays[seen], pixel, effects)
        return light, hits.body

    def _radiance(
        self,
        points: NDArray,
        normals: NDArray,
        bodies: NDArray,
        rays: NDArray,
        pixel: NDArray,
        effects: CameraEffects,
    ) -> NDArray[np.float64]:
        """Lambert's law with one sun, cast shadows, and an even sky; ``pixel``: its width at the point [m]."""
        steepness = np.abs(np.einsum("ij,ij->i", rays, normals)) / np.linalg.norm(rays, axis=1)
        # a pixel's patch is stretched by 1/steepness one way: the geometric mean of both widths
        footprint = pixel / np.sqrt(np.maximum(steepness, 0.02))
        local = points.copy()
        metal = np.flatnonzero(bodies != TERRAIN)
        Ts = self._Ts_body_site[bodies[metal]]
        local[metal] = np.einsum("nij,nj->ni", Ts[:, :3, :3], points[metal]) + Ts[:, :3, 3]
        pattern = np.clip(grain(local, footprint), -3.0, 3.0)
        is_metal = bodies != TERRAIN
        mean = np.where(is_metal, METAL_ALBEDO, GROUND_ALBEDO)
        albedo = mean * (1.0 + np.where(is_metal, METAL_CONTRAST, effects.ground_contrast) * pattern)
        sun = effects.sun
        facing = np.maximum(normals @ sun, 0.0)
        lit = np.flatnonzero(facing > 0.0)
        shaded = self._rays.blocked(points[lit] - self._near + 1e-3 * normals[lit], sun)
        facing[lit[shaded]] = 0.0
        return albedo * (effects.ambient + (1.0 - effects.ambient) * facing)


def _rays(camera: Camera, u: NDArray, v: NDArray) -> NDArray[np.float64]:
    """Directions (n, 3) through pixels, camera frame, z = 1."""
    return np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(len(u))], axis=-1)


def _edges(light: NDArray[np.float64], body: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Pixels beside which another body or another light begins, with those around them, (height, width)."""
    edge = np.zeros(light.shape, bool)
    for one, other in (((slice(1, None), ...), (slice(-1), ...)), ((..., slice(1, None)), (..., slice(-1)))):
        differ = (body[one] != body[other]) | (np.abs(light[one] - light[other]) > RIM)
        edge[one] |= differ
        edge[other] |= differ
    return edge


def render_scene(robot: Robot | LeggedRobot, state: RobotState, dem: Dem) -> RenderScene:
    """The scene of one state: the Dem's triangulation and every link of the robot where the state puts it.

    Raises InvalidTerrain where the terrain is nowhere in sight.
    """
    ground = crop(dem, state.T_site_base[:2, 3], SIGHT)
    if len(ground.triangles) == 0:
        x, y = state.T_site_base[:2, 3]
        raise InvalidTerrain(
            f"no ground of terrain {dem.name!r} lies within {SIGHT:z.0f} m of the rover at ({x:z.1f}, {y:z.1f})"
        )
    links = [(mesh, state.T_site_base @ T_base_part) for mesh, T_base_part in robot_parts(robot, state.posture)]
    return RenderScene(ground, links)


def render_pair(
    scene: RenderScene,
    state: RobotState,
    spec: CameraPairSpec,
    *,
    seed: int = 0,
    scale: float = 1.0,
    effects: CameraEffects = EASY,
) -> ImagePair:
    """Both images of one pair. seed: of the sensor noise; give each pair of a snapshot its own."""
    left, right = spec.camera_left.reduced(scale), spec.camera_right.reduced(scale)
    brighter = 1.0 + effects.exposure_difference
    return ImagePair(
        name=spec.name,
        time=state.time,
        left=scene.image(left, state.T_site_base, np.random.default_rng([seed, 0]), effects),
        right=scene.image(right, state.T_site_base, np.random.default_rng([seed, 1]), effects, brighter),
        camera_left=left,
        camera_right=right,
        T_site_base=state.T_site_base,
    )


def render_snapshot(
    robot: Robot | LeggedRobot,
    state: RobotState,
    dem: Dem,
    *,
    seed: int = 0,
    pairs: Sequence[str] | None = None,
    scale: float = 1.0,
    effects: CameraEffects = EASY,
    progress: Progress = no_progress,
) -> Snapshot:
    """Images of the named camera pairs (all when None) at one state of the rover on a terrain.

    scale: pixels along each side relative to the real cameras. effects: sun, ground, lens and sensor, see
    :mod:`footfall.sim.optics`. Raises NotFound for a pair the robot doesn't have.
    """
    specs = robot.description.cameras
    names = [spec.name for spec in specs]
    wanted = names if pairs is None else list(pairs)
    for name in wanted:
        if name not in names:
            raise NotFound(f"{robot.name} has no camera pair {name!r}; it has {', '.join(names)}", pair=name)
    progress(0.0, "placing the rover on the terrain")
    scene = render_scene(robot, state, dem)
    images = []
    for i, name in enumerate(wanted):
        progress(i / max(len(wanted), 1), f"taking images of {name}")
        index = names.index(name)
        images.append(
            render_pair(scene, state, specs[index], seed=seed * len(names) + index, scale=scale, effects=effects)
        )
    progress(1.0, f"{len(images)} pairs taken")
    return Snapshot(state, tuple(images))
