"""Which goal posture is tried first: by motion or by clearance, judged by the meshes of another scene."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput
from footfall.core.value import flatten, unflatten
from footfall.planning.answers import Status
from footfall.planning.body.stand import stand
from footfall.planning.scene.ground import Contact, Nearby, footfall_contact
from footfall.planning.scene.lift import branch_of, vertical
from footfall.planning.step.footing import LegStance, ground_near
from footfall.planning.step.goals import ALIKE, Goals
from footfall.planning.step.plan import plan_step
from footfall.planning.step.problem import GOAL_ORDERS, StepSettings
from footfall.planning.step.rise import rises
from footfall.planning.step.situation import TRUE, Situation
from footfall.planning.step.target import candidates
from footfall.planning.watch import Watch
from footfall.robot.meshes.collision import CollisionScene
from tests.support.chassis_ground import wavy

ROCKS = [(2.15, 0.33, 0.12, 0.4), (1.5, 1.1, 0.5, 0.3)]
TARGET = (1.95, 0.55)
CLOSE = 2e-4
"""Clearances are held against the meshes to this [m]."""


@pytest.fixture(scope="module")
def rocky(athlete):
    dem = wavy(ROCKS, half=4.0, resolution=0.05)
    return dem, stand(athlete, dem)


class Asked:
    """All that Goals is made from, and what it may choose among."""

    def __init__(self, robot, place, leg, target, **asked):
        dem, state = place
        self.stance = LegStance(robot, dem, state, leg)
        near, contact = ground_near(self.stance), footfall_contact(robot, dem, *target)
        assert isinstance(near, Nearby)
        assert isinstance(contact, Contact)
        self.situation = Situation(robot, dem, state, leg, near, StepSettings(**asked))
        self.contact, self.q = contact, np.array(state.leg(leg))
        branch = branch_of(robot, leg, self.q)
        self.every = candidates(robot, leg, contact, self.situation.T_site_base, self.q, branch)

    def goals(self):
        return Goals(self.situation, Watch(), self.stance, self.contact, self.q)

    def lowered(self, q):
        """Whether the wheel can stand with the leg at q and be lowered there."""
        s = self.situation
        up = vertical(s.robot, s.leg, s.T_site_base, q, s.settings.lift)
        return s.free(q, TRUE) and not isinstance(up, str) and rises(s, Watch(), up)

    def clears(self, q, clearance):
        """By the meshes, without certificate or bounds."""
        s = self.situation
        scene = CollisionScene(s.robot, s.state.posture, s.leg, s.T_site_base, s.ground.mesh, clearance)
        return not scene.collides(q, "true")


def step(spare):
    return np.floor(spare / ALIKE)


@pytest.mark.parametrize("clearance", [0.0, 0.01])
def test_what_a_posture_has_to_spare_is_what_the_meshes_say(athlete, rocky, rng, clearance):
    asked = Asked(athlete, rocky, 0, TARGET, clearance=clearance)
    seen = []
    for i in rng.choice(len(asked.every), 12, replace=False):
        q = asked.every[i].q
        spare = asked.situation.spare(q)
        seen.append(spare)
        if clearance + spare > CLOSE:
            assert asked.clears(q, clearance + spare - CLOSE)
        assert not asked.clears(q, max(clearance + spare + CLOSE, 0.0))
    assert np.ptp(seen) > 0.01


@settings(max_examples=8)
@given(leg=st.integers(0, 5), along=st.floats(-0.3, 0.3), out=st.floats(-0.2, 0.2))
def test_by_clearance_no_goal_with_more_room_is_left_out(athlete, rocky, leg, along, out):
    _, state = rocky
    hip = (np.asarray(state.T_site_base) @ athlete.description.legs[leg].T_base_hip)[:2, 3]
    radial = hip / np.linalg.norm(hip)
    target = hip + (1.0 + out) * radial + along * np.array([-radial[1], radial[0]])
    asked = Asked(athlete, rocky, leg, target, goals="clearance")
    goals = list(asked.goals())
    spare = {id(one): asked.situation.spare(one.q) for one in asked.every}
    allowed = [i for i, one in enumerate(asked.every) if asked.lowered(one.q)]
    ranked = sorted(allowed, key=lambda i: (-step(spare[id(asked.every[i])]), i))
    assert [goal.candidate.q.tolist() for goal in goals] == [asked.every[i].q.tolist() for i in ranked[:3]]


def test_by_motion_the_order_is_that_of_the_candidates(athlete, rocky):
    asked = Asked(athlete, rocky, 0, TARGET)
    allowed = [one.q.tolist() for one in asked.every if asked.lowered(one.q)]
    assert [goal.candidate.q.tolist() for goal in asked.goals()] == allowed[:3]
    assert [asked.every[goal.place].q.tolist() for goal in asked.goals()] == allowed[:3]


def test_the_plan_stands_with_the_most_room_and_says_so(athlete, rocky):
    dem, state = rocky
    plans = {}
    for goals in GOAL_ORDERS:
        asked = Asked(athlete, rocky, 0, TARGET, goals=goals)
        result = plan_step(athlete, dem, state, 0, TARGET, settings=asked.situation.settings, explain=True)
        assert result.status is Status.FOUND, result.reason
        assert result.plan is not None
        assert all(check.holds for check in result.checks)
        taken = next(one.text for one in result.decisions if one.about == "goal" and one.taken)
        plans[goals] = asked.situation.spare(result.plan.waypoints[-1, :6]), taken
    spare, taken = plans["clearance"]
    asked = Asked(athlete, rocky, 0, TARGET)
    most = max(asked.situation.spare(one.q) for one in asked.every if asked.lowered(one.q))
    assert step(spare) == step(most)
    assert spare > plans["motion"][0] + ALIKE
    assert f"by clearance of {len(asked.every)} postures" in taken
    assert f"{1e3 * spare:.0f} mm to spare beyond every clearance" in taken
    assert "clearance" not in plans["motion"][1]


def test_a_branch_that_was_asked_for_is_kept(athlete, rocky):
    for branch in (0, 2):
        asked = Asked(athlete, rocky, 0, TARGET, goals="clearance", branch=branch)
        goals = list(asked.goals())
        assert goals
        assert all(goal.candidate.branch // 2 == branch // 2 for goal in goals)


def test_a_footfall_that_is_refused_names_the_nearest_posture_in_either_order(athlete, rocky):
    dem, state = rocky
    beside_rock = (2.05, 0.45)
    (reason,) = {
        plan_step(athlete, dem, state, 0, beside_rock, settings=StepSettings(goals=goals)).reason
        for goals in GOAL_ORDERS
    }
    assert "postures that reach it is allowed; in the nearest, " in reason


def test_settings_of_before_are_what_they_were():
    """The order is stored where it was chosen only, so that records without it keep their digests."""
    chosen = StepSettings(goals="clearance")
    assert "goals" in str(flatten(chosen))
    assert "goals" not in str(flatten(StepSettings()))
    again = unflatten(*flatten(chosen))
    assert isinstance(again, StepSettings)
    assert again.goals == "clearance"
    assert again.digest == chosen.digest != StepSettings().digest
    with pytest.raises(InvalidInput, match="goals is one of motion, clearance"):
        StepSettings(goals="prettiest")
