"""The closed form of legs that turn, slide and slide: right by pin, as complete as descent, turns without end."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from footfall.core.errors import InvalidRobot
from footfall.io.any_robot import load_legged
from footfall.robot.legged.posture import placed
from footfall.robot.limb.by_structure import ENDLESS, solver_of
from footfall.robot.limb.cylindrical import CylindricalLimb, is_cylindrical
from footfall.robot.limb.limb import limb_of
from footfall.robot.limb.numeric import NumericLimb

SAME = 1e-9


def model_of(rng, along_first, cosine=0.0, limits=((-np.pi, np.pi), (-0.6, 0.9), (-0.4, 0.7))):
    """A pin model with axes and offsets at random: it turns, then slides along that axis and across it, or reversed.

    cosine: of the angle between the axis of the turn and what should be across it.
    """
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    across = np.cross(axis, rng.normal(size=3))
    across = np.sqrt(1 - cosine**2) * across / np.linalg.norm(across) + cosine * axis
    ways = (axis, across) if along_first else (across, axis * rng.choice([-1.0, 1.0]))
    model, parent, R_turn = pin.Model(), 0, np.eye(3)
    for number, (low, high) in enumerate(limits):
        R = Rotation.from_rotvec(rng.uniform(-2, 2, 3)).as_matrix()
        R_turn = R_turn @ R if number else R_turn
        own = axis if number == 0 else R_turn.T @ ways[number - 1]
        kind = (pin.JointModelPrismaticUnaligned if number else pin.JointModelRevoluteUnaligned)(own)
        bounds = (np.array([one]) for one in (1e3, 1e3, low, high))
        parent = model.addJoint(parent, kind, pin.SE3(R, 0.3 * rng.normal(size=3)), f"joint{number}", *bounds)
    model.addFrame(pin.Frame("foot", parent, pin.SE3(np.eye(3), 0.3 * rng.normal(size=3)), pin.FrameType.OP_FRAME))
    return model


def feet_by_pin(model, qs):
    data, frame, feet = model.createData(), model.getFrameId("foot"), []
    for q in qs:
        pin.framesForwardKinematics(model, data, q)
        feet.append(data.oMf[frame].translation.copy())
    return np.array(feet)


def away(posture, others):
    """Largest difference to the nearest of others (n, 3), whole turns aside."""
    off = np.abs(others - posture)
    off[:, 0] = np.abs((off[:, 0] + np.pi) % (2 * np.pi) - np.pi)
    return float(off.max(axis=1).min(initial=np.inf))


@pytest.mark.parametrize("along_first", [True, False])
def test_no_posture_of_2000_places_is_missed_and_none_is_false(along_first, rng):
    for _ in range(4):
        model = model_of(rng, along_first)
        limb = limb_of(model, "foot", "point")
        asked = rng.uniform(limb.lower, limb.upper, (500, 3))
        places = feet_by_pin(model, asked)
        found = CylindricalLimb(limb).solve(places)
        there = ~np.isnan(found.left)
        assert max(away(own, q[some]) for own, q, some in zip(asked, found.q, there, strict=True)) < 1e-7
        feet = feet_by_pin(model, found.q[there])
        assert np.abs(feet - np.repeat(places, there.sum(axis=1), axis=0)).max() < SAME
        assert found.left[there].max() < SAME
        inside = found.q[there]
        assert ((inside >= limb.lower) & (inside <= limb.upper)).all()
        nearest = np.minimum(inside - limb.lower, limb.upper - inside).min(axis=1)
        np.testing.assert_allclose(found.spare[there], nearest, atol=SAME)


@pytest.mark.parametrize("along_first", [True, False])
def test_descent_finds_the_same_postures_of_places_in_reach_and_out_of_it(along_first, rng):
    for _ in range(2):
        limb = limb_of(model_of(rng, along_first), "foot", "point")
        closed, numeric = CylindricalLimb(limb), NumericLimb(limb)
        places = closed.feet(rng.uniform(limb.lower - 0.5, limb.upper + 0.5, (300, 3)))[:, :3, 3]
        exact, found = closed.solve(places), numeric.solve(places)
        assert 0 < (exact.counts > 0).sum() < len(places)
        edge = np.abs(exact.spare) < 1e-6  # on a limit rounding decides
        for k in np.nonzero(~edge.any(axis=1))[0]:
            own, theirs = exact.q[k][~np.isnan(exact.left[k])], found.q[k, : found.counts[k]]
            assert all(away(q, own) < 1e-5 for q in theirs)
            # descent misses of two postures that nearly are one the other
            twins = len(own) == 2 and away(own[0], own[1:]) < 1e-3
            assert twins or all(away(q, theirs) < 1e-5 for q in own)


def test_the_branch_says_on_which_side_of_the_axis_the_foot_is(rng):
    limb = limb_of(model_of(rng, along_first=False), "foot", "point")
    closed = CylindricalLimb(limb)
    q = rng.uniform(limb.lower, limb.upper, (200, 3))
    found = closed.solve(closed.feet(q)[:, :3, 3])
    both = found.counts == 2
    assert both.any()
    # the same place is reached farther out by branch 0 than by branch 1
    assert (found.q[both, 0, 1] >= found.q[both, 1, 1]).all()
    for own, branches in zip(q, found.q, strict=True):
        there = ~np.isnan(branches[:, 0])
        branch = int(np.flatnonzero(there)[np.argmin([away(own, one[None]) for one in branches[there]])])
        out = closed.solve_from(closed.feet(own[None])[:, :3, 3], own[None])[0]
        assert away(out, branches[branch][None]) < 1e-7


def test_other_structures_have_no_such_form(rng):
    leaning = limb_of(model_of(rng, along_first=True, cosine=0.01), "foot", "point")
    assert not is_cylindrical(leaning)
    assert isinstance(solver_of(leaning, endless=True), NumericLimb)
    with pytest.raises(InvalidRobot, match="slides along the axis of its turn and across it"):
        CylindricalLimb(leaning)


def test_a_foot_led_round_and_round_turns_on_and_on_without_a_jump():
    robot = load_legged("ambler")
    solver = robot.limbs[0]
    q = np.array([[0.3, -0.5, 0.0]])
    angles = np.linspace(0.3, 0.3 + 10 * np.pi, 2000)
    for angle in angles[1:]:
        place = solver.feet(np.array([[angle, -0.5, 0.0]]))[:, :3, 3]
        there = solver.solve_from(place, q)
        assert np.abs(there - q).max() < 0.02
        q = there
    np.testing.assert_allclose(q[0], [angles[-1], -0.5, 0.0], atol=1e-9)
    assert robot.upper[robot.slices[0]][0] == pytest.approx(2 * np.pi * ENDLESS)


def test_a_turn_with_limits_comes_back_inside_them(rng):
    limb = limb_of(model_of(rng, True, limits=((0.5, 2.0), (-0.6, 0.9), (-0.4, 0.7))), "foot", "point")
    closed = CylindricalLimb(limb)
    q = rng.uniform(limb.lower, limb.upper, (50, 3))
    places = closed.feet(q)[:, :3, 3]
    np.testing.assert_allclose(closed.solve_from(places, q + np.array([2 * np.pi, 0, 0])), q, atol=1e-7)
    beyond = q + np.array([3.0, 0, 0])
    assert np.isnan(closed.solve_from(closed.feet(beyond)[:, :3, 3], q)).all()


def test_a_foot_on_the_axis_keeps_the_turn_it_has():
    robot = load_legged("ambler")
    limb = robot.limbs[0].limb
    closed = CylindricalLimb(replace(limb, lower=np.array([-np.pi, -2.0, -1.0])))
    at_axis = np.array([[1.2, -float(limb.placements[1, :3, 3][0]), 0.0]])
    place = closed.feet(at_axis)[:, :3, 3]
    np.testing.assert_allclose(closed.solve_from(place, at_axis), at_axis, atol=1e-9)


def test_all_legs_of_the_ambler_have_the_closed_form_and_reach_by_pin(rng):
    robot = load_legged("ambler")
    assert all(isinstance(solver, CylindricalLimb) for solver in robot.limbs)
    for _ in range(20):
        q = rng.uniform(np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi))
        soles = placed(robot, q).soles
        for leg in robot.legs:
            own = robot.slices[leg]
            np.testing.assert_allclose(
                robot.limbs[leg].solve_from(soles[leg][None], q[None, own])[0], q[own], atol=1e-7
            )
