"""Some foot moves of a walk as a walk of its own, from where the rover stands when they are its turn."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput
from footfall.core.value import Provenance
from footfall.planning.motion import BODY
from footfall.planning.walk.problem import WalkPlan
from footfall.robot.tolerance import JOINT_TOLERANCE
from footfall.telemetry.state import RobotState


def parts_count(plan: WalkPlan) -> int:
    """How many parts a walk has: its foot moves, and the chassis' way after the last where it goes any."""
    return plan.foot_moves + int((plan.moves[1:] == plan.foot_moves).any())


def start_of(plan: WalkPlan, number: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Posture (legs × 6,) [rad] and chassis pose (4, 4) in which foot move ``number`` (0…m) of a walk begins.

    Raises InvalidInput where the walk has no such foot move.
    """
    row = _first_row(plan, number) - 1
    return plan.waypoints[row], plan.Ts_site_base[row]


def end_of(plan: WalkPlan, number: int) -> NDArray[np.float64]:
    """Pose of the chassis (4, 4) in which foot move ``number`` (0…m) of a walk ends.

    Raises InvalidInput where the walk has no such foot move.
    """
    _first_row(plan, number)
    return plan.Ts_site_base[np.flatnonzero(plan.moves == number)[-1]]


def excerpt(plan: WalkPlan, first: int, count: int, state: RobotState) -> WalkPlan:
    """Foot moves ``first`` … ``first + count - 1`` (0…m) of a walk, from the posture and pose of ``state``.

    Whether that is near enough to where the walk has the rover then is for the caller to say (:func:`start_of`). A
    posture that is off by more than an encoder is brought back onto the walk: by the first move of the chassis, where
    the foot move begins with one, else by a short one of its own. Parents are the walk, and the state.

    Raises InvalidInput where the walk has no such foot moves.
    """
    if count < 1:
        raise InvalidInput("at least one foot move is taken of a walk", count=count)
    begins = _first_row(plan, first)
    own = np.flatnonzero((plan.moves >= first) & (plan.moves < first + count))
    own = own[own >= begins]
    rows = np.concatenate([[begins - 1], own])
    waypoints, poses = plan.waypoints[rows].copy(), plan.Ts_site_base[rows].copy()
    moves, phases = plan.moves[rows] - first, [plan.phases[row] for row in rows]
    moves[0], phases[0] = 0, BODY
    poses[0] = state.T_site_base
    margins, torques, kept = plan.margins[rows], plan.torques[rows], rows
    if np.abs(state.posture - waypoints[0]).max() > JOINT_TOLERANCE:
        if phases[1] != BODY:
            again = [0, *range(len(rows))]
            waypoints, poses, moves = waypoints[again], poses[again], moves[again]
            margins, torques, phases, kept = margins[again], torques[again], [BODY, *phases], rows[again]
        waypoints[0] = state.posture
    last, tethered = min(first + count, plan.foot_moves), plan.tethered
    if tethered is not None:
        tethered = replace(tethered, lengths=tethered.tether.lengths(poses), pulls=tethered.pulls[kept])
    parents = {name: digest for name, digest in plan.parents.items() if name != "state"}
    parents |= {"walk": plan.digest, "state": state.digest}
    return replace(
        plan,
        legs=plan.legs[first:last],
        stances=plan.stances[first : last + 1],
        waypoints=waypoints,
        Ts_site_base=poses,
        moves=moves,
        phases=tuple(phases),
        margins=margins,
        torques=torques,
        tethered=tethered,
        provenance=Provenance(parents, plan.provenance.settings, plan.provenance.seed),
    )


def _first_row(plan: WalkPlan, number: int) -> int:
    """Of foot move ``number``: the first waypoint that is moved to."""
    rows = np.flatnonzero(plan.moves == number)
    rows = rows[rows > 0]
    if not len(rows):
        raise InvalidInput(
            f"the walk has {plan.foot_moves} foot moves; there is none with the number {number}, counted from 0",
            number=number,
        )
    return int(rows[0])
