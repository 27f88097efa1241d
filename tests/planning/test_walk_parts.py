"""A walk taken apart: moves of the chassis and steps that join to it again, and can be commanded one by one."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput
from footfall.core.frames import rotation
from footfall.core.value import Provenance
from footfall.planning.answers import Status
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.body.move import BodyMovePlan, BodyMoveSettings
from footfall.planning.body.stand import stand
from footfall.planning.execution.plan import plan_execution
from footfall.planning.motion import BODY
from footfall.planning.step.problem import StepPlan, StepSettings
from footfall.planning.walk.parts import PLANNER, parts_of
from footfall.planning.walk.problem import LIFT, LOWER, SWING, Stance, WalkGoal, WalkPlan, WalkSettings
from tests.support.chassis_ground import wavy
from tests.support.short_walks import SETTINGS, short_parts, short_walk

LEGS = 6


def made_up(body_rows, swings, seed):
    """A walk of any numbers: so many rows of the chassis before each foot move and after the last; swings: (leg, rows).

    The chassis moves in rows of its own alone, and in the others one leg.
    """
    rng = np.random.default_rng(seed)
    posture, T = rng.uniform(-1, 1, 6 * LEGS), np.eye(4)
    rows = [(posture, T, 0, BODY)]
    stances = [any_stance(rng)]
    for number, count in enumerate(body_rows):
        for _ in range(count):
            posture, T = rng.uniform(-1, 1, 6 * LEGS), T.copy()
            T[:3, :3] = T[:3, :3] @ rotation("z", rng.uniform(-0.1, 0.1))[:3, :3]
            T[:3, 3] += rng.uniform(-0.1, 0.1, 3)
            rows.append((posture, T, number, BODY))
        if number == len(swings):
            break
        leg, phases = swings[number]
        for phase in phases:
            posture = posture.copy()
            posture[6 * leg : 6 * leg + 6] = rng.uniform(-1, 1, 6)
            rows.append((posture, T, number, phase))
        stances.append(any_stance(rng))
    postures, poses, moves, phases = zip(*rows, strict=True)
    count = len(rows)
    settings = WalkSettings(seed=4, support="preferred", least_margin=0.03, friction=0.5, lift=0.21, clearance=0.02)
    return WalkPlan(
        goal=WalkGoal(1.0, 0.0),
        legs=tuple(leg for leg, _ in swings),
        stances=tuple(stances),
        waypoints=np.array(postures),
        Ts_site_base=np.array(poses),
        moves=np.array(moves),
        phases=phases,
        margins=np.ones(count),
        torques=np.ones(count),
        provenance=Provenance({"dem": "d", "state": "s", "robot": "r"}, settings, 4),
    )


def any_stance(rng):
    return Stance(
        rng.uniform(-3, 3, (LEGS, 3)),
        rng.uniform(-1, 1, (LEGS, 3)),
        np.repeat(np.eye(4)[None], LEGS, axis=0),
        rng.integers(0, 8, LEGS),
    )


@st.composite
def walks(draw):
    counts = st.integers(1, 3)
    swing = st.tuples(
        st.integers(0, LEGS - 1),
        st.tuples(counts, counts, counts).map(lambda n: (LIFT,) * n[0] + (SWING,) * n[1] + (LOWER,) * n[2]),
    )
    swings = draw(st.lists(swing, max_size=4))
    rows = draw(st.lists(st.integers(0, 4), min_size=len(swings) + 1, max_size=len(swings) + 1))
    return made_up(rows, swings, draw(st.integers(0, 1000)))


def poses_of(part):
    if isinstance(part, BodyMovePlan):
        return part.Ts_site_base
    return np.repeat(part.T_site_base[None], len(part.waypoints), axis=0)


def asked_of(part):
    settings = part.provenance.settings
    assert isinstance(settings, BodyMoveSettings | StepSettings)
    return settings


@given(walks())
def test_the_parts_join_to_the_walk_again(walk):
    parts = parts_of(walk)
    joined = [walk.waypoints[:1], *(part.waypoints[1:] for part in parts)]
    np.testing.assert_array_equal(np.concatenate(joined), walk.waypoints)
    poses = [walk.Ts_site_base[:1], *(poses_of(part)[1:] for part in parts)]
    np.testing.assert_array_equal(np.concatenate(poses), walk.Ts_site_base)
    for before, after in pairwise(parts):
        np.testing.assert_array_equal(before.waypoints[-1], after.waypoints[0])
        np.testing.assert_array_equal(poses_of(before)[-1], poses_of(after)[0])
    steps = [part for part in parts if isinstance(part, StepPlan)]
    assert tuple(step.leg for step in steps) == walk.legs
    assert "".join(f"{one} " for step in steps for one in step.phases[1:]) == "".join(
        f"{one} " for one in walk.phases if one != BODY
    )


@given(walks())
def test_each_part_is_a_plan_of_its_kind(walk):
    parts = parts_of(walk)
    assert len(parts) >= walk.foot_moves
    over = 0
    for part in parts:
        assert part.parents == {"dem": "d", "robot": "r", "walk": walk.digest}
        asked = asked_of(part)
        assert (asked.conservative, asked.least_margin, asked.friction, asked.clearance) == (False, 0.03, 0.5, 0.02)
        assert len(part.waypoints) > 1
        if isinstance(part, BodyMovePlan):
            assert isinstance(asked, BodyMoveSettings)
            assert part.standing == tuple(range(LEGS))
            np.testing.assert_array_equal(part.contacts, walk.stances[over].contacts)
            np.testing.assert_allclose(part.shift.applied(part.Ts_site_base[0]), part.Ts_site_base[-1], atol=1e-12)
            continue
        assert isinstance(asked, StepSettings)
        over += 1
        placed = walk.stances[over]
        np.testing.assert_array_equal(part.contact, placed.contacts[part.leg])
        np.testing.assert_array_equal(part.normal, placed.normals[part.leg])
        assert (part.branch, part.planner) == (placed.branches[part.leg], PLANNER)
        assert (part.phases[0], asked.lift, asked.seed) == (LIFT, 0.21, 4)
        others = np.delete(part.waypoints, np.s_[6 * part.leg : 6 * part.leg + 6], axis=1)
        assert (others == others[0]).all()


def test_a_required_support_is_asked_of_every_part():
    walk = made_up([2, 0], [(1, (LIFT, SWING, LOWER))], seed=0)
    walk = replace(walk, provenance=replace(walk.provenance, settings=WalkSettings(support="required")))
    assert [asked_of(part).conservative for part in parts_of(walk)] == [True, True]


def test_a_foot_move_without_a_foot_that_is_lifted_is_refused():
    walk = made_up([2, 2], [(1, ())], seed=0)
    with pytest.raises(InvalidInput, match="foot move 0 of the walk lifts no foot"):
        parts_of(walk)


@pytest.fixture(scope="module")
def dem():
    return wavy(half=4.0)


@pytest.fixture(scope="module")
def standing(athlete, dem):
    return stand(athlete, dem)


def test_the_parts_of_a_walk_are_the_plans_that_it_was_made_of(athlete, dem, standing):
    made_of = short_parts(athlete, dem, standing)
    parts = parts_of(short_walk(athlete, dem, standing))
    assert [type(part) for part in parts] == [type(one) for one in made_of]
    for part, one in zip(parts, made_of, strict=True):
        np.testing.assert_array_equal(part.waypoints, one.waypoints)
        np.testing.assert_array_equal(poses_of(part), poses_of(one))
        for name in ("least_margin", "friction", "clearance", "conservative"):
            assert getattr(part.provenance.settings, name) == getattr(one.provenance.settings, name), name
        if isinstance(part, BodyMovePlan):
            assert isinstance(one, BodyMovePlan)
            np.testing.assert_allclose(part.shift.vector, one.shift.vector, atol=1e-12)
            np.testing.assert_array_equal(part.contacts, one.contacts)
            assert part.standing == one.standing
        else:
            assert isinstance(one, StepPlan)
            assert part.phases == one.phases
            asked = asked_of(part)
            assert isinstance(asked, StepSettings)
            assert asked.lift == SETTINGS.lift
            np.testing.assert_allclose(part.contact, one.contact, atol=5e-3)


def test_a_step_of_a_walk_can_be_executed_from_where_it_starts(athlete, dem, standing):
    [_, step, _] = parts_of(short_walk(athlete, dem, standing))
    assert isinstance(step, StepPlan)
    here = replace(standing, posture=step.waypoints[0], T_site_base=step.T_site_base)
    done = plan_execution(athlete, dem, here, step)
    assert done.status is Status.FOUND, done.reason
    assert done.provenance.parents["plan"] == step.digest
    # from where the walk starts it is another stance
    assert plan_execution(athlete, dem, standing, step).status is Status.START_INVALID


def test_shifts_of_a_walk_that_turns_are_told_as_they_are():
    walk = made_up([3, 0], [(0, (LIFT, LOWER))], seed=3)
    part = parts_of(walk)[0]
    assert isinstance(part, BodyMovePlan)
    assert part.shift.digest == BodyShift.between(walk.Ts_site_base[0], walk.Ts_site_base[3]).digest
