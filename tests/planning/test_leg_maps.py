"""No cell is green for a leg that can't be lifted: the maps ask what a step is asked, and say so once."""

import json
from dataclasses import replace

import numpy as np
import pytest

import footfall
from footfall.balance.balance_settings import BalanceSettings
from footfall.core.value import flatten
from footfall.io.artifacts import decode, encode
from footfall.maps import reach_classes
from footfall.maps.colors import FOOTING, REACH
from footfall.maps.layers import NOT_LIFTED, REACHABLE_STABLE, MapSettings, MapStack
from footfall.maps.stack import map_stack
from footfall.planning.answers import Status
from footfall.planning.body.body_shift import PredictedState
from footfall.planning.step.leg_maps import compute_maps
from footfall.planning.step.plan import plan_step
from footfall.planning.step.problem import StepSettings
from footfall.session.products.judged_footfall import judge_footfall
from footfall.terrain.from_arrays import from_heights

LEG = 1
SLIPPERY = 0.05
X = np.arange(-4, 4.01, 0.1)


@pytest.fixture(scope="module")
def scene(athlete):
    dem = from_heights((0.25 * np.meshgrid(X, X)[0]).astype(np.float32), 0.1, -4, -4, "slope")
    return dem, footfall.stand(athlete, dem)


def settings(friction=0.6, **more):
    return MapSettings(balance=BalanceSettings(friction=friction), **more)


@pytest.fixture(scope="module")
def refused(athlete, scene):
    dem, state = scene
    return compute_maps(athlete, dem, state, LEG, settings(SLIPPERY))


def test_a_leg_that_can_not_be_lifted_has_no_green_cell_and_says_why_once(athlete, scene, refused):
    dem, state = scene
    free = compute_maps(athlete, dem, state, LEG, settings(SLIPPERY, lift_off=False))
    assert (free.layers["footing"] == REACHABLE_STABLE).any()
    green = free.layers["reach_class"] == reach_classes.FREE
    assert not (refused.layers["footing"] == REACHABLE_STABLE).any()
    assert (refused.layers["reach_class"][green] == reach_classes.NOT_LIFTED).all()
    assert (refused.layers["footing"][green] == NOT_LIFTED).all()
    assert np.nanmax(refused.layers["quality"]) == 0
    # cells with a reason of their own keep it
    others = np.isin(
        free.layers["reach_class"],
        (reach_classes.OUT_OF_RANGE, reach_classes.JOINT_LIMIT, reach_classes.FOOT_COLLISION),
    )
    assert np.array_equal(refused.layers["reach_class"][others], free.layers["reach_class"][others])
    assert refused.not_lifted
    assert free.not_lifted == ""
    # that of every step
    rows, cols = np.nonzero(green)
    for i in range(0, len(rows), len(rows) // 4):
        target = float(dem.geometry.xs[cols[i]]), float(dem.geometry.ys[rows[i]])
        result = plan_step(athlete, dem, state, LEG, target, settings=StepSettings(friction=SLIPPERY))
        assert (result.status, result.reason) == (Status.START_INVALID, refused.not_lifted)


STRICT = [
    ({"conservative": True}, {"conservative": True}),
    ({"stable_margin": 1.2}, {"least_margin": 1.2}),
]


@pytest.mark.parametrize(("asked", "of_step"), STRICT, ids=["conservative", "margin"])
def test_maps_ask_of_the_lift_what_they_ask_of_the_footfall(athlete, asked, of_step):
    """In the middle of its feet the rover lifts no leg so; with the chassis lower, and away from the leg, it does."""
    flat = from_heights(np.zeros((len(X), len(X)), np.float32), 0.1, -4, -4, "flat")
    middle = footfall.stand(athlete, flat)
    hip = athlete.description.legs[LEG].T_base_hip[:2, 3]
    dx, dy = -0.2 * hip / np.linalg.norm(hip)
    moved = footfall.shifted_state(athlete, flat, middle, footfall.BodyShift(dx=dx, dy=dy, dz=-0.4))
    assert isinstance(moved, PredictedState), moved
    for state, lifts in ((middle, False), (moved, True)):
        stack = compute_maps(athlete, flat, state, LEG, MapSettings(**asked))
        assert (stack.not_lifted == "") == lifts
        greens = np.argwhere(stack.layers["footing"] == REACHABLE_STABLE)
        assert (len(greens) > 0) == lifts
        refused = np.argwhere(stack.layers["footing"] == NOT_LIFTED)
        assert (len(refused) > 0) != lifts
        cells = greens if lifts else refused
        row, col = cells[len(cells) // 2]
        goal = float(flat.geometry.xs[col]), float(flat.geometry.ys[row])
        step = plan_step(athlete, flat, state, LEG, goal, settings=StepSettings(**of_step))
        assert (step.status is Status.FOUND) == lifts, step.reason
        assert lifts or step.reason.split(";")[0] == stack.not_lifted.split(";")[0]


def test_a_leg_that_can_be_lifted_has_the_maps_that_it_had(athlete, scene):
    dem, state = scene
    asked, plain = (compute_maps(athlete, dem, state, LEG, settings(lift_off=one)) for one in (True, False))
    assert asked.not_lifted == ""
    for name, layer in plain.layers.items():
        assert np.array_equal(asked.layers[name], layer, equal_nan=layer.dtype.kind == "f"), name


def test_a_collision_above_where_it_stands_is_asked_too(athlete, scene):
    dem, state = scene
    # nothing may come nearer than 2 m
    stack = compute_maps(athlete, dem, state, LEG, settings(clearance=2.0))
    assert "is needed" in stack.not_lifted or "must stay clear" in stack.not_lifted
    assert not (stack.layers["footing"] == REACHABLE_STABLE).any()


def test_settings_and_maps_without_the_question_are_those_of_old_records(athlete, scene):
    quality = MapSettings().quality
    # as delivered then: the ramps of these two were shorter
    ramps = {**quality.ramps, "limit_margin": (0.0, 0.35), "margin": (0.0, 0.5)}
    then = MapSettings(lift_off=False, quality=replace(quality, ramps=ramps))
    assert then.digest == "be60a17c682af72ddba2f0e2941d0098"
    assert MapSettings().digest != MapSettings(lift_off=False).digest
    assert "lift_off" not in json.dumps(flatten(MapSettings(lift_off=False))[0])
    dem, state = scene
    old = map_stack(athlete, dem, state, LEG, settings(lift_off=False))
    assert "not_lifted" not in json.dumps(flatten(old)[0])
    assert compute_maps(athlete, dem, state, LEG, settings(lift_off=False)).digest == old.digest


def test_the_maps_keep_their_words(refused):
    again = decode(encode(refused))
    assert isinstance(again, MapStack)
    assert again.digest == refused.digest
    assert again.not_lifted == refused.not_lifted


def test_the_cell_is_marked_and_the_footfall_is_judged_with_the_reason(athlete, scene, refused):
    assert FOOTING[NOT_LIFTED][0].startswith("⊘")
    assert REACH[reach_classes.NOT_LIFTED][0].startswith("⊘")
    dem, _ = scene
    rows, cols = np.nonzero(refused.layers["footing"] == NOT_LIFTED)
    x, y = float(dem.geometry.xs[cols[0]]), float(dem.geometry.ys[rows[0]])
    answer = judge_footfall(dem, athlete.wheel_radius, LEG, x, y, refused)
    assert answer["acceptable"] is False
    assert any(refused.not_lifted in reason for reason in answer["reasons"])


def test_a_collision_is_not_told_of_postures_that_were_not_tried():
    for reason in (reach_classes.FOOT_COLLISION, reach_classes.WAYPOINT_COLLISION):
        assert "upright" in reach_classes.CLASSES[reason][1]
        assert "upright" in reach_classes.explained(reason, 3, 6, 0.0, 0.02, 0.2)
