"""What cameras show, by rays: the second method for what is said by geometry alone."""

from dataclasses import replace

import numpy as np

from footfall.core.frames import apply, inverse
from footfall.sim.raycast import TERRAIN, RayScene
from footfall.terrain.ground.triangulate import triangulate
from footfall.terrain.rover_mask.selfmask import robot_parts


def cast_in_view(robot, dem, state, points, settings):
    """By rays from the real cameras to the points, which every link and the ground may stop."""
    T = np.asarray(state.T_site_base)
    bodies = [triangulate(dem)]
    bodies += [
        replace(mesh, vertices=apply(T @ pose, mesh.vertices)) for mesh, pose in robot_parts(robot, state.posture)
    ]
    scene, seen = RayScene(bodies), np.zeros(len(points), bool)
    for spec in robot.description.cameras:
        both = np.ones(len(points), bool)
        for camera in (spec.camera_left, spec.camera_right):
            x, y, depth = apply(inverse(T @ camera.T_base_camera), points).T
            wide = np.abs(camera.fx * x / depth + camera.cx - (camera.width - 1) / 2) <= (camera.width - 1) / 2
            high = np.abs(camera.fy * y / depth + camera.cy - (camera.height - 1) / 2) <= (camera.height - 1) / 2
            both &= (depth >= settings.min_range) & (depth <= settings.max_range) & wide & high
            at, eye = np.flatnonzero(both), (T @ camera.T_base_camera)[:3, 3]
            away = np.linalg.norm(points[at] - eye, axis=1)
            hits = scene.first_hits(eye, (points[at] - eye) / away[:, None])
            both[at] = (hits.body == TERRAIN) & (np.abs(hits.distance - away) <= 0.1)
        seen |= both
    return seen
