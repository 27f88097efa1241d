"""Inverse kinematics of limbs by descent: postures a second, and what is missed. ``footfall bench limb``."""

import time
from collections.abc import Callable, Iterator
from typing import TypeVar

import numpy as np
import pinocchio as pin

from benchmarks.scenes import robot
from benchmarks.timing import SEED, Figure
from footfall.robot.ik import solve_leg
from footfall.robot.limb.limb import limb_of
from footfall.robot.limb.numeric import NumericLimb

T = TypeVar("T")

POSTURES = 20_000.0
"""What is wanted [1/s]."""


def leg_of_three() -> pin.Model:
    """A leg as most quadrupeds have it: roll, pitch, pitch; thigh and shank of 0.3 and 0.32 m."""
    model, parent = pin.Model(), 0
    at = [(0.3, 0.1, 0.0), (0.0, 0.09, 0.0), (0.0, 0.0, -0.3), (0.0, 0.0, -0.32)]
    limits = [(-0.8, 0.8), (-1.5, 2.0), (-2.6, -0.4)]
    kinds = (pin.JointModelRX, pin.JointModelRY, pin.JointModelRY)
    for kind, place, (low, high) in zip(kinds, at, limits, strict=False):
        bounds = (np.array([one]) for one in (100.0, 10.0, low, high))
        parent = model.addJoint(parent, kind(), pin.SE3(np.eye(3), np.array(place)), f"joint{parent}", *bounds)
    model.addFrame(pin.Frame("foot", parent, pin.SE3(np.eye(3), np.array(at[-1])), pin.FrameType.OP_FRAME))
    return model


def figures(quick: bool) -> Iterator[Figure]:
    rng = np.random.default_rng(SEED)
    count = 200 if quick else 2000
    wheel = NumericLimb(limb_of(robot().model, "leg0_wheel", "pose"))
    foot = NumericLimb(limb_of(leg_of_three(), "foot", "point"))
    for name, solver in (("three_joints", foot), ("six_joints", wheel)):
        q = rng.uniform(solver.limb.lower, solver.limb.upper, (count, len(solver.limb.names)))
        feet = solver.feet(q)
        places = feet if solver is wheel else feet[:, :3, 3]
        solver.solve(places[:2])
        took, found = _timed(lambda s=solver, p=places: s.solve(p))
        yield Figure(f"limb.{name}.places", (count / took,), "1/s")
        yield Figure(f"limb.{name}.all_postures", (found.counts.sum() / took,), "1/s")
        yield Figure(f"limb.{name}.not_solved", (float((found.counts == 0).sum()),), "places", 0.0)
        near = q + rng.uniform(-0.05, 0.05, q.shape)
        solver.solve_from(places[:2], near[:2])
        took, _ = _timed(lambda s=solver, p=places, n=near: s.solve_from(p, n))
        yield Figure(f"limb.{name}.from_nearby", (count / took,), "1/s", POSTURES, at_most=False)
        if solver is wheel:
            took, exact = _timed(lambda p=places: solve_leg(robot(), 0, p))
            yield Figure("limb.six_joints.closed_form", (exact.valid.sum() / took,), "1/s")
            short = exact.valid.sum(axis=1) - found.counts
            yield Figure("limb.six_joints.missed", (float(short.clip(0).sum() / exact.valid.sum()),), "share", 1e-3)


def _timed(work: Callable[[], T]) -> tuple[float, T]:
    begun = time.process_time()
    answer = work()
    return time.process_time() - begun, answer
