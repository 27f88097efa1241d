"""Numeric inverse kinematics of a limb: right by pin, and as complete as the closed forms of those that have one."""

import itertools
import math

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput, InvalidRobot, NotFound
from footfall.core.frames import rotation_rpy, transform
from footfall.robot.ik import solve_leg
from footfall.robot.limb.limb import Limb, limb_of
from footfall.robot.limb.numeric import NumericLimb

SAME = 1e-5
"""Two ways to one posture agree within this [rad]."""

KINDS = {"RX": "100", "RY": "010", "RZ": "001", "PX": "100", "PY": "010", "PZ": "001"}


def chain(kinds, placements, lower=-2.5, upper=2.5):
    """A pin model of joints in a row, such as RZ, RY, PX, with a frame ``foot`` at its end."""
    model = pin.Model()
    parent = 0
    for number, (kind, placement) in enumerate(zip(kinds, placements, strict=False)):
        joint = getattr(pin, f"JointModel{kind}")()
        low, high = (lower, upper) if kind[0] == "R" else (0.0, 0.4)
        parent = model.addJoint(
            parent, joint, placement, f"joint{number}", *(np.array([one]) for one in (1e3, 1e3, low, high))
        )
    model.addFrame(pin.Frame("foot", parent, placements[-1], pin.FrameType.OP_FRAME))
    return model


def feet_by_pin(model, qs, foot="foot"):
    """Poses (n, 4, 4) of the foot."""
    data, frame = model.createData(), model.getFrameId(foot)
    poses = []
    for q in qs:
        pin.framesForwardKinematics(model, data, q)
        poses.append(data.oMf[frame].homogeneous.copy())
    return np.array(poses)


def away(posture, others):
    """How far a posture (joints,) is from the nearest of others (n, joints): its joint that differs most [rad]."""
    if not len(others):
        return math.inf
    apart = np.abs(others - posture)
    return float(np.minimum(apart, np.abs(apart - 2 * math.pi)).max(axis=1).min())


def shifted(x, y=0.0, z=0.0, rpy=(0.0, 0.0, 0.0)):
    return pin.SE3(transform(rotation_rpy(*rpy), (x, y, z)))


QUADRUPED = ("RX", "RY", "RY"), (shifted(0.3, 0.1), shifted(0.0, 0.09), shifted(0.0, z=-0.3), shifted(0.0, z=-0.32))


def quadruped_postures(place):
    """Every posture of that leg, by its closed form: roll, then a planar 2R (hip offset 0.09, 0.3 and 0.32 m long)."""
    x, y, z = place - (0.3, 0.1, 0.0)
    side, thigh, shank = 0.09, 0.3, 0.32
    found = []
    below = y * y + z * z - side * side
    if below < 0:
        return np.empty((0, 3))
    for depth in (-math.sqrt(below), math.sqrt(below)):
        roll = math.atan2(z, y) - math.atan2(depth, side)
        cosine = (x * x + depth * depth - thigh**2 - shank**2) / (2 * thigh * shank)
        if abs(cosine) > 1:
            continue
        for knee in (math.acos(cosine), -math.acos(cosine)):
            pitch = math.atan2(-x, -depth) - math.atan2(shank * math.sin(knee), thigh + shank * math.cos(knee))
            found.append((roll, pitch, knee))
    return np.array(found).reshape(-1, 3)


def inside(postures, lower, upper):
    """Those that whole turns bring into the limits, brought there."""
    turned = postures - 2 * math.pi * np.floor((postures - lower) / (2 * math.pi))
    return turned[(turned <= upper).all(axis=1)]


def agree(found, exact):
    """Each place that can be reached has a posture, none is wrong, and of a thousand at most one is missed.

    The most that is missed is the other of two postures that nearly are one: about a straight knee or wrist.
    """
    assert (found.counts > 0).all()
    missed = 0
    for q, count, theirs in zip(found.q, found.counts, exact, strict=True):
        assert all(away(one, theirs) < SAME for one in q[:count])
        missed += sum(away(one, q[:count]) > SAME for one in theirs)
    assert missed <= 1e-3 * sum(map(len, exact))


def test_every_posture_of_the_rover_s_leg_is_found_and_no_other(athlete, rng):
    solver = NumericLimb(limb_of(athlete.model, "leg0_wheel", "pose"))
    asked = rng.uniform(solver.limb.lower, solver.limb.upper, (2000, 6))
    places = feet_by_pin(athlete.model, np.hstack([asked, np.zeros((2000, 30))]), "leg0_wheel")
    found, exact = solver.solve(places), solve_leg(athlete, 0, places)
    agree(found, [q[valid] for q, valid in zip(exact.q, exact.valid, strict=True)])


def test_every_posture_of_a_leg_of_three_joints_is_found_and_no_other(rng):
    model = chain(*QUADRUPED)
    solver = NumericLimb(limb_of(model, "foot", "point"))
    asked = rng.uniform(solver.limb.lower, solver.limb.upper, (2000, 3))
    places = feet_by_pin(model, asked)[:, :3, 3]
    found = solver.solve(places)
    exact = [inside(quadruped_postures(place), solver.limb.lower, solver.limb.upper) for place in places]
    agree(found, exact)


@st.composite
def chains(draw):
    count = draw(st.integers(3, 7))
    kinds = draw(st.lists(st.sampled_from(sorted(KINDS)), min_size=count, max_size=count))
    lengths = st.floats(0.05, 0.4)
    turns = st.tuples(*(st.floats(-3.0, 3.0) for _ in range(3)))
    return kinds, [shifted(draw(lengths), draw(lengths), draw(lengths), draw(turns)) for _ in range(count + 1)]


@given(chains(), st.integers(0, 2**32 - 1), st.sampled_from(["point", "pose"]))
def test_postures_that_are_found_bring_the_foot_to_its_place(made, seed, place):
    model = chain(*made)
    solver = NumericLimb(limb_of(model, "foot", place))
    asked = np.random.default_rng(seed).uniform(solver.limb.lower, solver.limb.upper, (4, len(made[0])))
    poses = feet_by_pin(model, asked)
    np.testing.assert_allclose(solver.feet(asked), poses, atol=1e-12)
    found = solver.solve(poses[:, :3, 3] if place == "point" else poses)
    for i, pose in enumerate(poses):
        mine = found.q[i, : found.counts[i]]
        assert (mine >= solver.limb.lower).all()
        assert (mine <= solver.limb.upper).all()
        reached = feet_by_pin(model, mine)
        for one in reached:
            np.testing.assert_allclose(one[:3, 3], pose[:3, 3], atol=1e-8 * solver.limb.reach)
            if place == "pose":
                np.testing.assert_allclose(one[:3, :3], pose[:3, :3], atol=1e-7)
        assert (np.isnan(found.q[i, found.counts[i] :])).all()
        for one, other in itertools.combinations(mine, 2):
            assert away(one, other[None]) > 1e-5


def test_from_a_posture_nearby_the_way_leads_back(athlete, rng):
    solver = NumericLimb(limb_of(athlete.model, "leg3_wheel", "pose"))
    q = athlete.posture("stand")[18:24] + rng.uniform(-0.3, 0.3, (200, 6))
    nearby = q + rng.uniform(-0.02, 0.02, q.shape)
    np.testing.assert_allclose(solver.solve_from(solver.feet(q), nearby), q, atol=1e-6)


def test_one_limb_gives_the_same_answers_again(rng):
    model = chain(*QUADRUPED)
    places = rng.uniform(-0.6, 0.6, (50, 3))
    first, again = (NumericLimb(limb_of(model, "foot", "point")).solve(places) for _ in range(2))
    np.testing.assert_array_equal(first.q, again.q)


def test_what_is_out_of_reach_has_no_posture(athlete):
    model = chain(*QUADRUPED)
    solver = NumericLimb(limb_of(model, "foot", "point"))
    far = np.array([[0.3, 0.1, -0.7], [5.0, 0.0, 0.0], [0.3, 0.1, 0.0]])  # too far twice, inside the hip's offset
    assert solver.solve(far).counts.tolist() == [0, 0, 0]
    assert np.isnan(solver.solve_from(far, np.zeros((3, 3)))).all()
    one = NumericLimb(limb_of(athlete.model, "leg0_wheel", "pose"))
    straight = np.eye(4)
    straight[0, 3] = one.limb.reach + 1.5
    assert one.solve(straight[None]).counts.tolist() == [0]


def test_continuous_joints_turn_all_the_way():
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelRUBZ(), pin.SE3.Identity(), "turn")
    model.addFrame(pin.Frame("foot", joint, shifted(0.5), pin.FrameType.OP_FRAME))
    limb = limb_of(model, "foot", "point")
    np.testing.assert_allclose([limb.lower, limb.upper], [[-math.pi], [math.pi]])
    angles = np.linspace(-3.1, 3.1, 21)
    places = 0.5 * np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    np.testing.assert_allclose(NumericLimb(limb).solve(places).q[:, 0, 0], angles, atol=1e-6)


def test_what_is_no_limb_is_refused(athlete):
    with pytest.raises(NotFound, match="no frame 'leg9_wheel'"):
        limb_of(athlete.model, "leg9_wheel", "pose")
    with pytest.raises(InvalidRobot, match="base is fixed to the base"):
        limb_of(athlete.model, "base", "pose")
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
    model.addFrame(pin.Frame("foot", joint, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    with pytest.raises(InvalidRobot, match="ball moves in 3 ways at once"):
        limb_of(model, "foot", "point")
    fields = limb_of(chain(*QUADRUPED), "foot", "point")
    given = {name: getattr(fields, name) for name in fields.__dataclass_fields__}
    for wrong, why in [
        ({"lower": fields.upper, "upper": fields.lower}, "the lower below the upper"),
        ({"axes": 2.0 * fields.axes}, "axis of length 1"),
        ({"placements": fields.placements[:3]}, "need 4 placements"),
        ({"place": "sole"}, "not 'sole'"),
        ({"names": ()}, "1 to 7 joints, not 0"),
    ]:
        with pytest.raises(InvalidRobot, match=why):
            Limb(**{**given, **wrong})


def test_places_of_another_shape_are_refused():
    solver = NumericLimb(limb_of(chain(*QUADRUPED), "foot", "point"))
    for places in (np.eye(4)[None], np.zeros(3), np.full((1, 3), np.nan)):
        with pytest.raises(InvalidInput, match=r"finite points \(n, 3\)"):
            solver.solve(places)
    with pytest.raises(InvalidInput, match="3 finite numbers each"):
        solver.solve_from(np.zeros((1, 3)), np.zeros((1, 6)))
    with pytest.raises(InvalidInput, match="2 places need as many postures"):
        solver.solve_from(np.zeros((2, 3)), np.zeros((1, 3)))
