"""The margins of the recheck, found with few questions to the meshes, against all distances of all meshes."""

import coal
import numpy as np
import pytest

from footfall.planning.body.stand import stand
from footfall.planning.scene import leg_over_ground, solids
from footfall.planning.scene.ground import Nearby
from footfall.planning.scene.leg_over_ground import LegOverGround
from footfall.planning.scene.solids import FAR, LegAlongPath, leg_poses
from footfall.planning.step.footing import LegStance, ground_near
from footfall.robot.description import PARTS, with_payload
from footfall.robot.kinematics import link_poses
from footfall.robot.meshes.bvh import bvh
from footfall.robot.meshes.shapes import box
from footfall.robot.model import Robot
from footfall.terrain.from_arrays import from_heights


def rough(seed, resolution=0.05):
    x = np.arange(-4.0, 4.0 + resolution / 2, resolution)
    X, Y = np.meshgrid(x, x)
    heights = 0.02 * np.sin(2 * X) * np.cos(1.7 * Y) + np.random.default_rng(seed).uniform(0.0, 0.03, X.shape)
    return from_heights(heights.astype(np.float32), resolution, -4.0, -4.0, "rough ground")


def apart(a, T_a, b, T_b):
    poses = (coal.Transform3s(T[:3, :3], T[:3, 3]) for T in (T_a, T_b))
    return max(coal.distance(a, next(poses), b, next(poses), coal.DistanceRequest(), coal.DistanceResult()), 0.0)


@pytest.fixture(scope="module")
def standing(athlete):
    dem = rough(1)
    return dem, stand(athlete, from_heights(np.zeros((81, 81), np.float32), 0.1, -4.0, -4.0, "level"))


def path(robot, state, leg, rng, count, size):
    own = slice(6 * leg, 6 * leg + 6)
    q = np.asarray(state.posture)[own] - (0, 0.3, 0, 0, 0, 0)
    return np.clip(q + rng.normal(0, size, (count, 6)), robot.lower[own], robot.upper[own])


@pytest.mark.parametrize("touching", [False, True])
@pytest.mark.parametrize(("leg", "clearance"), [(1, 0.0), (4, 0.03)])
def test_the_gap_to_the_ground_is_the_least_of_all_distances(
    athlete, standing, rng, monkeypatch, leg, clearance, touching
):
    dem, state = standing
    near = ground_near(LegStance(athlete, dem, state, leg))
    assert isinstance(near, Nearby)
    over_ground = LegOverGround(athlete, leg, np.asarray(state.T_site_base), near, clearance)
    whole, asked = bvh(near.mesh), []
    measured = leg_over_ground.measured
    monkeypatch.setattr(leg_over_ground, "measured", lambda *some: asked.append(1) or measured(*some))
    lift = 0.0 if touching else 0.1
    T_ground = np.eye(4)
    T_ground[2, 3] = lift
    questions = 0
    for _ in range(4):
        qs = path(athlete, state, leg, rng, 5, 0.15)
        poses = np.asarray(state.T_site_base) @ leg_poses(athlete, leg, qs)
        every = {}
        for i, part in enumerate(PARTS[:-1] if touching else PARTS):
            shape, delta = (
                bvh(athlete.description.meshes[f"leg{leg}_{part}"]),
                athlete.description.clearances.terrain[part],
            )
            for at in range(len(qs)):
                every[at, part] = apart(shape, poses[at, i], whole, T_ground) - delta - clearance
        at, gap = over_ground.gap(qs, lift, touching)
        nearest = min(every, key=lambda one: every[one])
        assert gap.spare == pytest.approx(min(every.values()), abs=1e-6)
        assert gap.between == f"leg{leg}_{nearest[1]} and the terrain"
        assert at == nearest[0]
        questions += len(every)
        # nothing nearer than asked for: said so, and no number made up
        assert over_ground.gap(qs, lift, touching, below=gap.spare - 0.01)[1].spare == gap.spare - 0.01
    assert len(asked) < questions / 10


@pytest.mark.parametrize(("leg", "payload"), [(0, 0.0), (3, 200.0)])
def test_the_gap_of_the_rover_is_the_least_of_all_pairs(athlete, standing, rng, monkeypatch, leg, payload):
    _, state = standing
    robot = Robot(with_payload(athlete.description, payload, (1.0, 1.0, 0.5), (0.0, 0.0, -0.5)))
    posture, deltas, meshes = np.asarray(state.posture), robot.description.clearances, robot.description.meshes
    own, asked, measured = LegAlongPath(robot, posture, leg, 0.01), [], solids.measured
    monkeypatch.setattr(solids, "measured", lambda *some: asked.append(1) or measured(*some))
    count = 0
    for _ in range(4):
        qs = path(robot, state, leg, rng, 2, 0.3)
        least = np.inf
        for q in qs:
            whole = posture.copy()
            whole[6 * leg : 6 * leg + 6] = q
            poses = link_poses(robot, whole)
            shape = {name: bvh(mesh) for name, mesh in meshes.items()}
            name = {part: f"leg{leg}_{part}" for part in PARTS}
            for part in PARTS:
                others = [
                    (link, deltas.other_leg) for link in meshes if link != "base" and not link.startswith(f"leg{leg}_")
                ]
                others += [("base", deltas.chassis[part])] if part in deltas.chassis else []
                for link, delta in others:
                    least = min(least, apart(shape[name[part]], poses[name[part]], shape[link], poses[link]) - delta)
                    count += 1
                if robot.description.payload is not None:
                    load = bvh(box(robot.description.payload.size, robot.description.payload.position))
                    least = min(least, apart(shape[name[part]], poses[name[part]], load, np.eye(4)) - deltas.payload)
            for pair in deltas.own_leg:
                a, b = name[pair.part_a], name[pair.part_b]
                least = min(least, apart(shape[a], poses[a], shape[b], poses[b]) - pair.distance)
        assert own.own_gap(qs)[1].spare == pytest.approx(min(least - 0.01, FAR), abs=1e-6)
    assert len(asked) < count / 20
