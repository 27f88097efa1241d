"""Refusals name the joint and the size, and the contact that was planned is the one that is found afterwards."""

import re

import numpy as np
import pytest

from footfall.maps.reach import reach
from footfall.maps.reach_classes import JOINT_LIMIT, NO_GEOMETRY
from footfall.maps.standing import contacts
from footfall.planning.answers import Status
from footfall.planning.body.stand import stand
from footfall.planning.scene.ground import Contact, footfall_contact
from footfall.planning.step.plan import plan_step
from footfall.planning.step.target import candidates
from footfall.robot.description import JOINTS
from footfall.terrain.from_arrays import from_heights
from tests.support.chassis_ground import with_posture

LEG = 2


def flat():
    return from_heights(np.zeros((201, 201), np.float32), 0.04, -4.0, -4.0, "flat")


@pytest.fixture(scope="module")
def blocks():
    """Blocks of 4 to 96 cm around a level middle."""
    rng, heights = np.random.default_rng(4), np.zeros((201, 201), np.float32)
    for _ in range(60):
        (row, col), (rows, cols) = rng.integers(0, 201, 2), rng.integers(5, 25, 2)
        heights[row : row + rows, col : col + cols] = rng.uniform(-0.15, 0.2)
    return from_heights(heights, 0.04, -4.0, -4.0, "blocks")


def test_a_joint_that_would_turn_too_far_is_named_with_the_size_that_the_map_knows(athlete):
    dem = flat()
    state = stand(athlete, dem)
    found = reach(athlete, dem, state, LEG)
    told = 0
    for i in np.flatnonzero(found.reason == JOINT_LIMIT)[::41][:12]:
        x, y, _ = found.contacts[i]
        result = plan_step(athlete, dem, state, LEG, (float(x), float(y)))
        assert result.status is Status.GOAL_INVALID
        said = re.search(r": (leg2_\w+) would turn (\d+\.\d{3}) rad \((\d+\.\d)°\) past its limit", result.reason)
        assert said is not None, result.reason
        joint = JOINTS[found.blame[i]][0]
        assert joint in said[1]
        assert float(said[2]) == pytest.approx(-found.limit_margin[i], abs=6e-4)
        assert float(said[3]) == pytest.approx(np.rad2deg(float(said[2])), abs=0.1)
        told += 1
    assert told >= 3


def test_a_leg_that_is_too_short_or_too_long_is_told_by_how_much(athlete):
    dem = flat()
    state = stand(athlete, dem)
    found = reach(athlete, dem, state, LEG)
    spec = athlete.description.legs[LEG]
    T_site_hip = np.asarray(state.T_site_base) @ spec.T_base_hip
    for i in np.flatnonzero(found.reason == NO_GEOMETRY)[::97][:6]:
        x, y, _ = found.contacts[i]
        reason = plan_step(athlete, dem, state, LEG, (float(x), float(y))).reason
        said = re.search(r"thigh and shank miss it by (\d\.\d{3}) m", reason)
        assert said is not None, reason
        # the ankle stands straight above the contact, on level ground
        ankle = found.contacts[i] + (0.0, 0.0, athlete.wheel_radius + spec.foot)
        out, up = np.hypot(*(ankle - T_site_hip[:3, 3])[:2]), ankle[2] - T_site_hip[2, 3] - spec.hip_offset[2]
        far = [np.hypot(side * out - spec.hip_offset[0], up) for side in (1, -1)]
        missed = min(max(one - spec.thigh - spec.shank, abs(spec.thigh - spec.shank) - one) for one in far)
        assert float(said[1]) == pytest.approx(max(missed, 0.001), abs=6e-4)


def test_the_contact_of_an_upright_wheel_is_the_one_that_was_planned(athlete, blocks, rng):
    state = stand(athlete, flat())
    upright = 0
    for _ in range(700):
        leg, turn, away = int(rng.integers(6)), rng.uniform(0, 2 * np.pi), rng.uniform(0.8, 1.6)
        hip = (np.asarray(state.T_site_base) @ athlete.description.legs[leg].T_base_hip)[:2, 3]
        x, y = hip + away * np.array([np.cos(turn), np.sin(turn)])
        wanted = footfall_contact(athlete, blocks, float(x), float(y))
        if not isinstance(wanted, Contact):
            continue
        possible = candidates(athlete, leg, wanted, np.asarray(state.T_site_base), np.array(state.leg(leg)), 0)
        for one in [one for one in possible if one.lean == 0][:2]:
            posture = np.array(state.posture)
            posture[6 * leg : 6 * leg + 6] = one.q
            put = with_posture(state, posture)
            found = contacts(athlete, blocks, put.posture, put.T_site_base, [leg])
            assert np.linalg.norm(found.points[0] - wanted.point) < 1e-3, (x, y)
            assert found.normals[0] == pytest.approx(wanted.normal, abs=0.01)
            upright += 1
    assert upright > 200
