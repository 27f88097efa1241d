"""What collides is asked where the sagging rover is predicted to be: a rock that only a rigid rover would clear."""

from dataclasses import replace

import numpy as np
import pytest

import footfall
from footfall.core.frames import apply
from footfall.planning.answers import Status
from footfall.planning.compliance.compliant_rover import CompliantRover
from footfall.planning.execution.execution_settings import MODES, ExecutionSettings
from footfall.planning.execution.plan import plan_execution
from footfall.planning.step.problem import StepSettings
from footfall.robot.ik import contact_point
from footfall.robot.meshes.collision import CollisionScene, posture_collisions
from footfall.sequence.of_execution import sequence_of_execution
from footfall.terrain.ground.triangulate import triangulate
from tests.support.chassis_ground import wavy

LEG, OWN = 2, slice(12, 18)


@pytest.fixture(scope="module")
def bare():
    return wavy(resolution=0.05)


@pytest.fixture(scope="module")
def stood(athlete, bare):
    """A rover that sags on Earth: its state and what it was commanded."""
    rover, state = CompliantRover(athlete, bare), footfall.stand(athlete, bare)
    rest = rover.let_down(state.posture, state.T_site_base)
    return rover.state(rest), rest.commanded


def around_the_hip(robot, state, by):
    """Site (x, y) where the wheel stands when its leg is turned about its hip by so much [rad], a little nearer."""
    hip = (state.T_site_base @ robot.description.legs[LEG].T_base_hip)[:2, 3]
    out = np.array(contact_point(robot, state.posture, LEG, state.T_site_base)[:2]) - hip
    x, y = hip + 0.97 * np.array([[np.cos(by), -np.sin(by)], [np.sin(by), np.cos(by)]]) @ out
    return float(x), float(y)


def executed(robot, stood, dem, plan, **settings):
    state, commanded = stood
    return plan_execution(robot, dem, state, plan, ExecutionSettings(**settings), commanded)


def swings(phases):
    return [i for i, phase in enumerate(phases) if phase == "swing"]


@pytest.fixture(scope="module")
def on_the_way(athlete, bare, stood):
    """A flat rock halfway under the swing of a low step, and the step over it."""
    target = around_the_hip(athlete, stood[0], -0.6)
    low = StepSettings(planner="line", raise_terrain=0.05)
    found = footfall.plan_step(athlete, bare, stood[0], LEG, target, settings=low)
    assert found.plan is not None, found.reason
    ends = [found.plan.waypoints[i] for i in (0, -1)]
    x, y = np.mean([contact_point(athlete, q, LEG, stood[0].T_site_base)[:2] for q in ends], axis=0)
    X, Y = np.meshgrid(bare.geometry.xs, bare.geometry.ys)
    dem = replace(bare, heights=np.where(np.hypot(X - x, Y - y) < 0.15, 0.068, bare.heights).astype(np.float32))
    over = footfall.plan_step(athlete, dem, stood[0], LEG, target, settings=low)
    assert over.plan is not None, over.reason
    return dem, over.plan


def too_near(robot, dem, postures, Ts_site_base):
    """What of the swinging leg is nearer to the ground than it may be, by the meshes."""
    near, found = triangulate(dem), set()
    for q, T in zip(postures, Ts_site_base, strict=True):
        scene = CollisionScene(robot, q, LEG, T, near, raise_terrain=0.0)
        found |= {(hit.link_a, hit.link_b) for hit in scene.contacts(q[OWN], "raised")}
    return found


LOW = {"least_clearance": 0.0, "most_lift": 0.2}
"""Nothing but the collision check asks how high the wheel is, and nothing lifts it higher."""


def test_a_rock_that_the_drooping_wheel_comes_too_near_to_is_refused(athlete, stood, on_the_way):
    dem, plan = on_the_way
    result = executed(athlete, stood, dem, plan, mode="as_commanded", **LOW)
    assert result.status is Status.NO_PATH
    assert "terrain collision by 0.0" in result.reason
    assert f"leg{LEG}_wheel and the terrain" in result.reason
    assert [check.name for check in result.checks if not check.holds] == ["terrain collision"]
    done = result.execution
    assert done is not None
    # the meshes say so of the predicted poses, and nothing of what a rigid rover would do with the same set points
    rows = swings(done.phases)
    rigid = np.tile(plan.waypoints[0], (len(rows), 1))
    rigid[:, OWN] = done.commanded[rows, OWN]
    assert too_near(athlete, dem, rigid, [plan.T_site_base] * len(rows)) == set()
    predicted = too_near(athlete, dem, done.predicted[rows], done.Ts_site_base[rows])
    assert predicted == {(f"leg{LEG}_wheel", "terrain")}
    # and so do the rules of the commands, which predict anew
    made = sequence_of_execution(done, athlete, dem)
    assert "terrain-collision" in {rule.rule for rule in made.rules if not rule.holds}


@pytest.mark.parametrize("settings", [{"mode": "as_commanded"}, {"mode": "droop_aware", **LOW}])
def test_the_same_rock_is_cleared_by_lifting_higher_or_by_reckoning_with_the_droop(
    athlete, stood, on_the_way, settings
):
    dem, plan = on_the_way
    result = executed(athlete, stood, dem, plan, **settings)
    assert result.status is Status.FOUND, result.reason
    done = result.execution
    assert done is not None
    rules = [rule for rule in sequence_of_execution(done, athlete, dem).rules if "collision" in rule.rule]
    assert rules
    assert [rule for rule in rules if not rule.holds] == []
    rows = swings(done.phases)
    assert too_near(athlete, dem, done.predicted[rows], done.Ts_site_base[rows]) == set()


def test_a_boulder_that_the_chassis_sinks_towards_is_refused_unless_the_chassis_is_held(athlete, bare, stood):
    state, _ = stood
    base_on_itself = athlete.description.meshes["base"].vertices
    base = apply(state.T_site_base, base_on_itself)
    middle, hip = state.T_site_base[:2, 3], (state.T_site_base @ athlete.description.legs[LEG].T_base_hip)[:2, 3]
    x, y = middle + 0.6 * (hip - middle)
    X, Y = np.meshgrid(bare.geometry.xs, bare.geometry.ys)
    # as it stands the chassis has 2 cm to spare
    top = base[:, 2].min() - athlete.description.clearances.chassis_terrain - 0.02
    dem = replace(bare, heights=np.where(np.hypot(X - x, Y - y) < 0.12, top, bare.heights).astype(np.float32))
    plan = footfall.plan_step(athlete, dem, state, LEG, around_the_hip(athlete, state, -0.3)).plan
    assert plan is not None
    near = triangulate(dem)
    for q in plan.waypoints[::4]:
        assert all(hit.link_a != "base" for hit in posture_collisions(athlete, q, plan.T_site_base, near))
    for mode in MODES:
        result = executed(athlete, stood, dem, plan, mode=mode)
        done = result.execution
        assert done is not None
        lowest = int(np.argmin([apply(T, base_on_itself)[:, 2].min() for T in done.Ts_site_base]))
        hits = posture_collisions(athlete, done.predicted[lowest], done.Ts_site_base[lowest], near)
        assert (("base", "terrain") in {(hit.link_a, hit.link_b) for hit in hits}) == (mode != "pose_held")
        if mode == "pose_held":
            assert result.status is Status.FOUND, result.reason
        else:
            assert result.status is Status.NO_PATH
            assert "terrain collision by 0.0" in result.reason
            assert "base and the terrain" in result.reason
