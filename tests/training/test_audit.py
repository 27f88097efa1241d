"""Motions that a table chooses, carried out in physics: as planned on easy ground; falls and contacts are seen."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from footfall.io.policies import SHIPPED
from footfall.planning.choice.actions import TRIPOD
from footfall.planning.choice.choice_settings import ChoiceSettings
from footfall.planning.choice.iteration import Plan
from footfall.planning.gait.problem import GaitPlan
from footfall.resources import robot_assets_folder
from footfall.sim.physics.physics_settings import PhysicsSettings
from footfall.telemetry.state import RobotState
from tests.training.test_routes import EASY
from training import audit
from training.audit import Carried, carried_out, in_sum
from training.grounds import ground
from training.route import walked

SETTINGS = ChoiceSettings()
METRES = 1.2


@pytest.fixture(scope="module")
def first() -> tuple[RobotState, GaitPlan]:
    """The first iteration of a tripod on easy ground, and the state that it goes from."""
    went: list[tuple[RobotState, Plan]] = []
    route = walked(EASY, METRES, lambda _: TRIPOD, SETTINGS, went=lambda *one: went.append(one))
    assert len(went) == len(route.decisions)
    state, plan = went[0]
    assert isinstance(plan, GaitPlan)
    assert plan.waypoints[0] == pytest.approx(state.posture)
    return state, plan


def in_physics(state: RobotState, plan: GaitPlan) -> Carried:
    return carried_out(ground(EASY, METRES), state, plan, TRIPOD, SETTINGS.speed, PhysicsSettings())


def going_to(plan: GaitPlan, posture: np.ndarray) -> GaitPlan:
    """A plan that no planner makes: from where it begins straight to a posture."""
    return replace(
        plan,
        waypoints=np.array([plan.waypoints[0], posture]),
        Ts_site_base=plan.Ts_site_base[:2],
        moves=plan.moves[:2],
        phases=plan.phases[:2],
        margins=plan.margins[:2],
        torques=plan.torques[:2],
    )


def test_a_tripod_goes_in_physics_where_it_was_planned_to(first):
    came = in_physics(*first)
    assert came.fell == ""
    assert came.contacts == ()
    assert came.metres > 0.4
    assert came.off < 0.05
    assert 0.0 < came.torque < 1.0


def test_a_rover_that_falls_is_seen_to(first):
    """The legs of one side fold while the others stretch."""
    state, plan = first
    posture = plan.waypoints[0].copy()
    posture[[6 * leg + 1 for leg in (0, 1, 2)]] -= 1.3
    posture[[6 * leg + 1 for leg in (3, 4, 5)]] += 0.5
    came = in_physics(state, going_to(plan, posture))
    assert "tipped" in came.fell
    assert np.isnan(came.off)
    assert "fell 1, 1.00" in in_sum("one", [came])


def test_legs_that_meet_are_seen_to(first):
    """Two legs that stand side by side turn towards each other."""
    state, plan = first
    posture = plan.waypoints[0].copy()
    posture[0] += 1.0
    posture[6] -= 1.0
    came = in_physics(state, going_to(plan, posture))
    assert any("leg0" in one and "leg1" in one for one in came.contacts), came
    assert "touched what they should not 1, 1.00" in in_sum("one", [came])


def test_where_a_rover_does_not_stand_it_is_told(first):
    state, plan = first
    T_site_base = state.T_site_base.copy()
    T_site_base[2, 3] += 1.0
    came = in_physics(replace(state, T_site_base=T_site_base), plan)
    assert "does not stay in that state" in came.fell
    assert came.metres > 0.4


def test_by_the_command_a_route_is_told_and_kept(tmp_path, monkeypatch, capsys):
    policy = tmp_path / "gaits.npz"
    policy.write_bytes((robot_assets_folder() / "athlete" / SHIPPED).read_bytes())
    told = []
    for _ in range(2):
        monkeypatch.setattr(sys, "argv", ["", str(policy), "--routes", "1", "--metres", "0.6"])
        assert audit.main() == 0
        told.append(capsys.readouterr().out)
    assert told[0] == told[1]
    assert "1 routes, chosen by: learned: " in told[0]
    assert "fell 0, 0.00" in told[0]
