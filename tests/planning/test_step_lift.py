"""The compiled way of following a wheel up, beside numpy and pin."""

import itertools

import numpy as np
import pytest

from footfall.core.frames import apply, inverse, rotation_rpy, transform
from footfall.planning.body.stand import stand
from footfall.planning.joint_path import samples
from footfall.planning.scene.ground import Nearby
from footfall.planning.scene.lift import LARGEST_STEP, branch_of, vertical
from footfall.planning.scene.lift_kernel import followed, nearest_branch, off_line
from footfall.planning.scene.solids import leg_chain
from footfall.planning.step.footing import LegStance, ground_near
from footfall.planning.step.problem import StepSettings
from footfall.planning.step.rise import space_of
from footfall.planning.step.situation import TRUE, Situation
from footfall.planning.watch import Watch
from footfall.robot.ik import solve_leg, wheel_pose_for_contact
from footfall.robot.kinematics import leg_wheel_pose
from footfall.robot.meshes.collision import CollisionScene
from footfall.terrain.generate import plane


def followed_by_numpy(q_bottom, solutions, valid, largest):
    path = [q_bottom]
    for q, possible in zip(solutions[1:], valid[1:], strict=True):
        away = np.where(possible, np.abs(q - path[-1]).max(axis=1), np.inf)
        if away.min() > largest:
            break
        path.append(q[np.argmin(away)])
    return np.array(path)


@pytest.mark.parametrize("largest", [0.15, 0.3, 10.0])
def test_the_nearest_solutions_are_followed_as_far_as_they_are_near(rng, largest):
    lengths = set()
    for _ in range(40):
        q_bottom = rng.normal(size=6)
        steps = np.cumsum(rng.normal(0.0, 0.06, (9, 1, 6)), axis=0)
        solutions = q_bottom + steps + rng.normal(0.0, 0.5, (9, 8, 6)) * (np.arange(8) > 0)[:, None]
        valid = rng.random((9, 8)) < 0.9
        solutions[~valid & (rng.random((9, 8)) < 0.5)] = np.nan
        expected = followed_by_numpy(q_bottom, solutions, valid, largest)
        assert followed(q_bottom, solutions, valid, largest).tolist() == expected.tolist()
        lengths.add(len(expected))
    assert len(lengths) > 1 or largest == 10.0


def test_the_branch_is_the_nearest_solution(athlete, rng):
    lower, upper = athlete.lower[:6], athlete.upper[:6]
    for q in rng.uniform(lower, upper, (50, 6)):
        solutions = solve_leg(athlete, 0, leg_wheel_pose(athlete, q, 0)[None]).q[0]
        expected = int(np.nanargmin(np.abs(solutions - q).max(axis=1)))
        assert branch_of(athlete, 0, q) == expected
        assert solutions[expected] == pytest.approx(q, abs=1e-6)
    assert nearest_branch(np.full((8, 6), np.nan), q) == 0


def test_how_far_a_wheel_leaves_its_line_is_what_pin_says(athlete, rng):
    start = athlete.posture("stand")[12:18]
    for _ in range(10):
        qs = start + np.cumsum(rng.normal(0.0, LARGEST_STEP / 4, (6, 6)), axis=0)
        up = rotation_rpy(*rng.normal(0.0, 0.3, 3))[:, 2]
        origin = leg_wheel_pose(athlete, qs[0], 2)[:3, 3]
        centers = np.array([leg_wheel_pose(athlete, q, 2)[:3, 3] for q in 0.5 * (qs[:-1] + qs[1:])])
        away = np.linalg.norm(np.cross(centers - origin, up), axis=1)
        assert off_line(*leg_chain(athlete, 2), qs, origin, up) == pytest.approx(away.max(), abs=1e-12)
    assert off_line(*leg_chain(athlete, 2), qs[:1], origin, up) == 0.0


def test_wheels_stand_upright_on_many_contacts_as_on_one(athlete, rng):
    T_site_base = transform(rotation_rpy(0.1, -0.05, 2.0), (3.0, -1.0, 1.2))
    contacts, normals = rng.normal(size=(5, 3)), rng.normal((0.0, 0.0, 3.0), 1.0, (5, 3))
    headings = rng.uniform(-4.0, 4.0, 5)
    Ts = T_site_base @ wheel_pose_for_contact(athlete, contacts, normals, headings, T_site_base)
    for T, contact, normal, heading in zip(Ts, contacts, normals, headings, strict=True):
        up = normal / np.linalg.norm(normal)
        axle = np.cross(up, (np.cos(heading), np.sin(heading), 0.0))
        axle /= np.linalg.norm(axle)
        assert T[:3, :3] == pytest.approx(np.column_stack([-up, axle, np.cross(-up, axle)]), abs=1e-12)
        assert T[:3, 3] == pytest.approx(contact + athlete.wheel_radius * up, abs=1e-12)
        one = wheel_pose_for_contact(athlete, contact, normal, heading, T_site_base)
        assert apply(one, np.zeros(3)) == pytest.approx(apply(inverse(T_site_base) @ T, np.zeros(3)), abs=1e-12)


def test_a_way_up_proven_in_a_few_looks_is_free_for_the_meshes(athlete):
    dem = plane(size=6.0, resolution=0.05)
    state, leg, asked = stand(athlete, dem), 1, []
    ground = ground_near(LegStance(athlete, dem, state, leg))
    assert isinstance(ground, Nearby)
    situation = Situation(athlete, dem, state, leg, ground, StepSettings())
    meshes = CollisionScene(athlete, state.posture, leg, state.T_site_base, ground.mesh)
    space = space_of(situation, Watch(), TRUE)
    free, situation.free = situation.free, lambda q, terrain: asked.append(q) or free(q, terrain)
    up = vertical(athlete, leg, situation.T_site_base, np.array(state.leg(leg)), 0.2)
    assert isinstance(up, np.ndarray)
    assert situation.footing.certificate.edges_sure(up, situation.settings.epsilon, TRUE)
    assert space.path_is_free(up)
    assert not asked
    assert not any(meshes.collides(q, TRUE) for a, b in itertools.pairwise(up) for _, q in samples(a, b, 0.004))

    into_the_ground = np.array([up[-1], up[0] + (0.0, 0.2, 0.0, 0.0, 0.0, 0.0), up[-1]])
    assert meshes.collides(into_the_ground[1], TRUE)
    assert not situation.footing.certificate.edges_sure(into_the_ground, situation.settings.epsilon, TRUE)
    assert not space.path_is_free(into_the_ground)
    assert asked
