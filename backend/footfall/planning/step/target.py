"""Leg postures that put the wheel onto a contact, best first."""

from dataclasses import dataclass

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import apply, inverse
from footfall.planning.scene.ground import Contact
from footfall.planning.scene.lean_kernel import lean_onto
from footfall.robot.ik import leg_azimuth, solve_leg, wheel_pose_for_contact
from footfall.robot.leg_branches import bend_of
from footfall.robot.model import Robot

HEADINGS = np.deg2rad([0, 15, -15, 30, -30, 45, -45, 60, -60, 75, -75, 90])
"""Turns of the wheel about the ground's normal that are tried, from the leg's radial direction."""
TURN_COST = 0.25
"""Preference for the radial heading: this share of the turn (and of a lean) adds to the joint distance."""


MOST_LEAN = np.deg2rad(12.0)
"""How far a wheel may lean from upright on the local ground, into the plane of its leg."""
LEAST_LEAN = 1e-4


@dataclass(frozen=True)
class Candidate:
    """q: leg posture (6,) [rad]; branch: of the inverse kinematics; turn: from the radial heading; lean [rad]."""

    q: Array
    branch: int
    turn: float
    lean: float


def candidates(
    robot: Robot, leg: int, contact: Contact, T_site_base: Array, q_start: Array, branch: int
) -> list[Candidate]:
    """All postures on a contact inside the limits, the wheel upright on the local ground or leaning.

    A wheel that is upright to ground sloping across the leg's plane can't pass the straight wrist while it is lowered;
    one that leans a few degrees into that plane can (see lift.py). Both touch the same point. Those on the start's
    branch come first; within that, those whose largest joint change from the start plus a little for turn and lean is
    least. A wheel turned by half a turn touches the same; both are tried. A straight wrist joins two branches, so
    wrists don't count. All have their wheel on the same contact and keep every clearance, or are refused; among those a
    short motion is worth more to whoever watches the rover than a few centimetres of room, and it is quicker and costs
    less torque. Where the wheel can't stand upright there are none, lean or not: the reach map says so too.

    Args:
        robot: the rover.
        leg: number of the leg, from 0.
        contact: where the wheel is to touch.
        T_site_base: pose of the chassis, (4, 4).
        q_start: posture of the leg now, (6,) [rad].
        branch: of the inverse kinematics that it is on.

    Returns:
        The postures, best first.
    """
    turns = np.concatenate([HEADINGS, HEADINGS])
    upright = upright_poses(robot, leg, contact, T_site_base)
    leaning = _leaning(robot, leg, contact, T_site_base, upright)
    leans = np.arccos(np.clip(np.sum(upright[:, :3, 0] * leaning[:, :3, 0], axis=1), -1.0, 1.0))
    chosen = (leans > LEAST_LEAN) & (leans <= MOST_LEAN)
    solved = solve_leg(robot, leg, np.concatenate([upright, leaning[chosen]]))
    if not solved.valid[: len(upright)].any():
        return []
    turns = np.concatenate([turns, turns[chosen]])
    leans = np.concatenate([np.zeros(len(upright)), leans[chosen]])
    poses, branches = np.nonzero(solved.valid)
    qs = solved.q[poses, branches]
    turned, lean = turns[poses], leans[poses]
    away = np.abs(qs - q_start).max(axis=1) + TURN_COST * (np.abs(turned) + lean)
    order = np.lexsort((away, bend_of(branches) != bend_of(branch)))
    sorted_by_rank = (branches[order].tolist(), turned[order].tolist(), lean[order].tolist())
    return [Candidate(*one) for one in zip(qs[order], *sorted_by_rank, strict=True)]


def upright_poses(robot: Robot, leg: int, contact: Contact, T_site_base: Array) -> Array:
    """Poses of a wheel upright on the local ground: every heading, and half a turn on.

    Args:
        robot: the rover.
        leg: number of the leg, from 0.
        contact: where the wheel touches.
        T_site_base: pose of the chassis, (4, 4).

    Returns:
        (2 · HEADINGS, 4, 4) in base.
    """
    turns = np.concatenate([HEADINGS, HEADINGS]) + np.repeat([0.0, np.pi], len(HEADINGS))
    headings = leg_azimuth(robot, leg, T_site_base) + turns
    return wheel_pose_for_contact(robot, contact.point, contact.normal, headings, T_site_base)


def _leaning(robot: Robot, leg: int, contact: Contact, T_site_base: Array, upright: Array) -> Array:
    """The poses leaned into the leg's plane, the lowest rim point along the normal being the contact again."""
    T_base_site, spec = inverse(T_site_base), robot.description.legs[leg]
    point, normal = apply(T_base_site, contact.point), T_base_site[:3, :3] @ contact.normal
    return lean_onto(np.ascontiguousarray(upright), point, normal, robot.wheel_radius, spec.T_base_hip, spec.foot)
