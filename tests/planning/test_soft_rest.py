"""Equilibria along a soft mode, where whole steps of Newton's method go to and fro across the balance."""

from pathlib import Path

import numpy as np

from footfall.core.frames import transform
from footfall.planning.compliance.compliant_rover import CompliantRover
from footfall.planning.compliance.equilibrium_kernel import BALANCED, Pose, settle
from footfall.terrain.generate import plane

RECORDED = Path(__file__).parent / "soft_rest.npz"
"""A rover with leg 0 in the air in a walk over rocks; 80 whole steps left 0.14 N·m, and *nothing holds the rover*."""


def test_the_rover_that_stands_is_found_to_stand(athlete):
    with np.load(RECORDED) as kept:
        known = dict(kept)
    rover = CompliantRover(athlete, plane())
    body = rover.body._replace(
        stiffness=known["stiffness"],
        wheel_stiffness=float(known["wheel_stiffness"]),
        friction=float(known["friction"]),
        rolled=float(known["rolled"]),
    )
    pose = Pose(*[known[f"pose_{name}"].copy() for name in Pose._fields])
    before = pose.t.copy()
    left = settle(body, pose, known["before"], known["commanded"], rover.gravity, int(known["increments"]))
    assert left <= BALANCED
    # by the sums alone: the ground bears the weight, and the chassis has hardly moved
    assert np.allclose(pose.forces.sum(axis=0), -rover.mass * rover.gravity, atol=1e-3)
    assert np.linalg.norm(pose.t - before) < 0.005
    assert np.allclose(transform(pose.R, pose.t)[:3, :3] @ pose.R.T, np.eye(3), atol=1e-9)
    assert pose.touching.tolist() == [False] + [True] * 5
