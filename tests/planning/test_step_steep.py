"""Steps on steep ground: what the compiled check leaves unsure there, and that plans of before stay what they were."""

from dataclasses import replace

import numpy as np
import pytest

import footfall
from benchmarks.steps.families import problem
from benchmarks.steps.problem import build
from benchmarks.steps.quality import swing
from benchmarks.steps.search import unsure_ends
from footfall.core.value import flatten, unflatten
from footfall.planning.answers import Status
from footfall.planning.scene.ground import Nearby
from footfall.planning.step.footing import LegStance, ground_near
from footfall.planning.step.problem import StepSettings
from footfall.planning.step.situation import RAISED, Situation

FAMILY = "steep fractal"
SEEDS = (4, 23, 30)
"""Problems of the set whose swing has an end that balls around the wheel leave unsure."""


@pytest.mark.parametrize("seed", SEEDS)
def test_the_ends_of_a_swing_over_steep_ground_are_sure(seed):
    one = problem(FAMILY, seed)
    scene = build(one)
    planned = {}
    for steep in (False, True):
        settings = StepSettings(seed=1, steep_ground=steep)
        result = footfall.plan_step(scene.robot, scene.dem, scene.state, one.leg, one.target, settings=settings)
        assert result.status is Status.FOUND
        assert all(check.holds for check in result.checks)
        near = ground_near(LegStance(scene.robot, scene.dem, scene.state, one.leg))
        assert isinstance(near, Nearby)
        situation = Situation(scene.robot, scene.dem, scene.state, one.leg, near, settings)
        assert result.plan is not None
        path = swing(result.plan)
        planned[steep] = unsure_ends(situation, path[0], path[-1])
        # what is sure is free for the meshes as well
        sure = [q for q in path if situation.first_unsure(q[None], RAISED)]
        scene_of_meshes = situation.footing.over_ground
        assert scene_of_meshes.collision(np.array(sure), settings.raise_terrain, touching=False) is None
    assert planned[False] >= 1
    assert planned[True] == 0


def test_settings_of_before_keep_their_digest_and_their_meaning():
    before = StepSettings(steep_ground=False)
    structure, arrays = flatten(before)
    assert "steep_ground" not in str(structure)
    assert unflatten(structure, arrays).steep_ground is False
    # what was stored before the setting came
    assert before.digest == DIGEST
    now = StepSettings(steep_ground=True)
    assert now.steep_ground
    assert now.digest != before.digest
    assert unflatten(*flatten(now)).digest == now.digest
    assert replace(before, seed=3).steep_ground is False
    unasked = StepSettings()
    assert unasked.steep_ground is None
    assert unasked.digest not in (before.digest, now.digest)
    assert unflatten(*flatten(unasked)).digest == unasked.digest


DIGEST = "e64ad2ca8f7c47fa5b8477c15adeeba2"
