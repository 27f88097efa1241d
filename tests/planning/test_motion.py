"""Every planner yields one kind of motion: where it begins and ends, which feet stay, how it is cut and played."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

import footfall
from footfall.core.errors import InvalidInput, InvalidSequence
from footfall.core.frames import inverse
from footfall.core.value import Provenance
from footfall.planning.between_rows import at as place_at
from footfall.planning.between_rows import base_path, finer
from footfall.planning.gait.problem import TRIPOD
from footfall.planning.motion import BODY, Motion
from footfall.planning.walk.problem import LIFT, LOWER, SWING, Stance, WalkGoal, WalkPlan
from footfall.planning.walk.recheck.feet import DRIFT
from footfall.robot.description import link_name
from footfall.sequence.make import make_sequence
from tests.support.chassis_ground import wavy
from tests.support.short_walks import LEG, short_parts, short_walk

LEGS = 6


@pytest.fixture(scope="module")
def dem():
    return wavy(half=4.0)


@pytest.fixture(scope="module")
def standing(athlete, dem):
    return footfall.stand(athlete, dem)


@pytest.fixture(scope="module")
def plans(athlete, dem, standing):
    """One of each kind: the body's first move, the step after it, both in a walk, and a gait of several feet."""
    body, step, _ = short_parts(athlete, dem, standing)
    gait = footfall.plan_gait(athlete, dem, standing, (0.2, 0.0), TRIPOD)
    assert gait.plan is not None, gait.reason
    return {"body": body, "step": step, "walk": short_walk(athlete, dem, standing), "gait": gait.plan}


KINDS = ("body", "step", "walk", "gait")


def wheels_by_pin(robot, posture, T_site_base):
    """Where wheels are, site (legs, 3), by the URDF."""
    scratch = robot.model.createData()
    pin.framesForwardKinematics(robot.model, scratch, np.array(posture))
    frames = [robot.link_frames[link_name(leg, "wheel")] for leg in robot.legs]
    return np.array([(T_site_base @ scratch.oMf[frame].homogeneous)[:3, 3] for frame in frames])


@pytest.mark.parametrize("kind", ["body", "walk", "gait"])
def test_a_motion_begins_where_the_rover_stands(plans, standing, kind):
    motion = plans[kind].motion
    np.testing.assert_allclose(motion.waypoints[0], standing.posture, atol=1e-12)
    np.testing.assert_allclose(motion.Ts_site_base[0], standing.T_site_base, atol=1e-12)


def test_a_motion_ends_where_its_plan_ends_and_the_next_begins(plans):
    body, step, walk = (plans[kind].motion for kind in ("body", "step", "walk"))
    np.testing.assert_array_equal(step.waypoints[0], body.waypoints[-1])
    np.testing.assert_array_equal(step.Ts_site_base[0], body.Ts_site_base[-1])
    over = len(body.phases) + len(step.phases) - 2
    np.testing.assert_array_equal(walk.waypoints[over], step.waypoints[-1])
    np.testing.assert_array_equal(step.Ts_site_base[-1], plans["step"].T_site_base)
    x, y = walk.Ts_site_base[-1, :2, 3]
    assert (x, y) == (plans["walk"].goal.x, plans["walk"].goal.y)


@pytest.mark.parametrize("kind", KINDS)
def test_feet_that_stay_do_not_move_and_the_others_do(athlete, plans, kind):
    """By pin, at each row and half way to it, within what the recheck of walks allows."""
    motion = plans[kind].motion
    assert motion.stays.shape == (len(motion.waypoints), LEGS)
    assert motion.stays.sum(axis=1).min() >= 3
    gone = np.zeros(LEGS)
    for row in range(1, len(motion.phases)):
        q, T = motion.waypoints[row - 1 : row + 1], motion.Ts_site_base[row - 1 : row + 1]
        before = wheels_by_pin(athlete, q[0], T[0])
        half = wheels_by_pin(athlete, 0.5 * (q[0] + q[1]), base_path(T[0], T[1], np.array([0.5]))[0])
        away = [np.linalg.norm(there - before, axis=1) for there in (half, wheels_by_pin(athlete, q[1], T[1]))]
        assert np.max(away, axis=0)[motion.stays[row]].max() < DRIFT
        gone += np.where(motion.stays[row], 0.0, away[1])
    moved = {"body": (), "step": (LEG,), "walk": (LEG,), "gait": range(LEGS)}[kind]
    assert (gone > 0.05).tolist() == [leg in moved for leg in range(LEGS)]


@pytest.mark.parametrize("kind", KINDS)
def test_the_chassis_moves_in_its_own_rows_alone(plans, kind):
    motion = plans[kind].motion
    for row in range(1, len(motion.phases)):
        still = np.array_equal(motion.Ts_site_base[row], motion.Ts_site_base[row - 1])
        assert still or motion.phases[row] == BODY
        assert bool(motion.lifted(row)) == (motion.phases[row] != BODY)


def test_one_leg_alone_moves_in_a_step_and_in_its_commands(athlete, plans):
    assert [plans[kind].motion.leg for kind in KINDS] == [None, LEG, None, None]
    assert make_sequence(plans["step"], athlete).motion.leg == LEG
    assert make_sequence(plans["body"], athlete).motion.leg is None


@pytest.mark.parametrize("kind", ["body", "step", "walk"])
def test_commands_are_predicted_to_move_as_planned(athlete, plans, kind):
    planned, predicted = plans[kind].motion, make_sequence(plans[kind], athlete).motion
    np.testing.assert_allclose(predicted.waypoints, planned.waypoints, atol=1e-12)
    np.testing.assert_allclose(predicted.Ts_site_base, planned.Ts_site_base, atol=1e-6)
    rows = range(1, len(planned.phases))
    assert [predicted.lifted(row) for row in rows] == [planned.lifted(row) for row in rows]
    # who predicts by commands alone knows of no foot that it stays while all joints move
    assert not (predicted.stays[1:] & ~planned.stays[1:]).any()


@st.composite
def motions(draw):
    rng = np.random.default_rng(draw(st.integers(0, 1000)))
    count = draw(st.integers(2, 9))
    Ts = [np.eye(4)]
    for _ in range(count - 1):
        turn = rng.uniform(-0.3, 0.3, 3)
        Ts.append(Ts[-1] @ pin.exp6(np.concatenate([rng.uniform(-1, 1, 3), turn])).homogeneous)
    phases = tuple(draw(st.lists(st.sampled_from([BODY, LIFT, SWING, LOWER]), min_size=count, max_size=count)))
    return Motion(rng.uniform(-1, 1, (count, 6 * LEGS)), np.array(Ts), rng.random((count, LEGS)) < 0.5, phases)


@given(motions(), st.integers(0, 8))
def test_a_motion_cut_at_a_row_and_joined_again_is_the_same(motion, at):
    at = min(at, len(motion.phases) - 1)
    first, second = motion.rows(range(at + 1)), motion.rows(range(at, len(motion.phases)))
    for name in ("waypoints", "Ts_site_base", "stays"):
        joined = np.concatenate([getattr(first, name), getattr(second, name)[1:]])
        np.testing.assert_array_equal(joined, getattr(motion, name))
    assert first.phases + second.phases[1:] == motion.phases
    assert first.travelled[-1] + second.travelled[-1] == pytest.approx(motion.travelled[-1])


@given(motions(), st.floats(0.05, 3.0), st.integers(1, 4))
def test_a_finer_motion_passes_the_same_rows_and_nothing_else(motion, step, fewest):
    """Bit for bit at the rows; between them evenly, on the straight lines of the joints and the chassis."""
    fine, gone_to = finer(motion, step, fewest)
    assert fine.travel.max() <= step + 1e-9
    assert len(gone_to) == len(fine.phases) == len(fine.waypoints) == len(fine.Ts_site_base)
    assert fine.phases == tuple(motion.phases[row] for row in gone_to)
    np.testing.assert_array_equal(fine.stays, motion.stays[gone_to])
    last = np.searchsorted(gone_to, np.arange(len(motion.phases)), side="right") - 1
    for name in ("waypoints", "Ts_site_base"):
        np.testing.assert_array_equal(getattr(fine, name)[last], getattr(motion, name))
    for row, (begin, end) in enumerate(pairwise(last)):
        count = end - begin
        assert count == fewest or (count > fewest and motion.travel[row] / (count - 1) > step)
        # the largest joint goes straight on, and the chassis too, about one axis: each part is as long as any other
        np.testing.assert_allclose(fine.travel[begin:end], motion.travel[row] / count, atol=1e-12)
        parts = [pin.log6(pin.SE3(inverse(a) @ b)) for a, b in pairwise(fine.Ts_site_base[begin : end + 1])]
        turns = [np.linalg.norm(part.angular) for part in parts]
        np.testing.assert_allclose(turns, turns[0], atol=1e-6)
        ways = np.diff(fine.Ts_site_base[begin : end + 1, :3, 3], axis=0)
        np.testing.assert_allclose(ways, np.tile(ways[0], (count, 1)), atol=1e-12)


@given(motions(), st.floats(0.0, 1.0))
def test_what_is_played_passes_each_row_and_is_never_far_from_it(motion, moment):
    along = motion.travelled / motion.travelled[-1]
    for row, share in enumerate(along):
        posture, T_site_base = place_at(motion, float(share))
        np.testing.assert_allclose(posture, motion.waypoints[row], atol=1e-9)
        np.testing.assert_allclose(T_site_base, motion.Ts_site_base[row], atol=1e-6)
    posture, _ = place_at(motion, moment)
    nearest = int(np.argmin(np.abs(along - moment)))
    away = abs(along[nearest] - moment) * motion.travelled[-1]
    assert np.abs(posture - motion.waypoints[nearest]).max() <= away + 1e-9


def walk_of(rows, legs):
    """A walk of rows (posture, foot move, phase) on the spot."""
    postures, moves, phases = zip(*rows, strict=True)
    stance = Stance(
        np.zeros((LEGS, 3)), np.tile([0.0, 0.0, 1.0], (LEGS, 1)), np.tile(np.eye(4), (LEGS, 1, 1)), np.zeros(LEGS, int)
    )
    return WalkPlan(
        goal=WalkGoal(0.0, 0.0),
        legs=legs,
        stances=(stance,) * (len(legs) + 1),
        waypoints=np.array(postures),
        Ts_site_base=np.tile(np.eye(4), (len(rows), 1, 1)),
        moves=np.array(moves),
        phases=phases,
        margins=np.ones(len(rows)),
        torques=np.ones(len(rows)),
        provenance=Provenance({}),
    )


def test_what_moves_more_than_the_lifted_leg_is_no_row_of_commands(athlete, standing):
    lifted = standing.posture.copy()
    lifted[6 * LEG + 2] += 0.1
    walk = walk_of([(standing.posture, 0, BODY), (lifted, 0, LIFT)], (LEG,))
    assert [command.leg for command in make_sequence(walk, athlete).commands] == [LEG]
    both = lifted.copy()
    both[0] += 0.01
    with pytest.raises(InvalidSequence, match="moves more than its leg"):
        make_sequence(replace(walk, waypoints=np.array([standing.posture, both])), athlete)


def test_a_foot_that_is_lifted_after_the_last_foot_move_is_misuse(standing):
    walk = walk_of([(standing.posture, 0, BODY), (standing.posture, 1, LIFT)], (LEG,))
    with pytest.raises(InvalidInput, match="waypoint 1 lifts a foot in foot move 1, there are 1"):
        _ = walk.motion
