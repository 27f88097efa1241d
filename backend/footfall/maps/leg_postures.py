"""The posture that a leg would take at each cell: from all that reach it, the first that is free of collision.

A wheel's heading is free, and a wheel that hits the ground in one heading may be clear of it in another. So where
nothing but the wheel and the link that turns with it collide, more headings are tried.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.progress import Progress, no_progress, part
from footfall.maps.leg_collisions import LegCollisions
from footfall.maps.reach_classes import FREE, UNSURE
from footfall.robot import ik_kernel

TURNS = np.deg2rad([0, 15, -15, 30, -30, 45, -45, 60, -60, 75, -75, 90])
"""Headings that are tried, from the leg's radial direction, forwards and backwards: those of the step planner."""


@dataclass(frozen=True)
class LegFrame:
    """One leg for :mod:`footfall.robot.ik_kernel`.

    lengths: (5,); lower, upper: (6,) [rad]; R_hip_site: (3, 3); azimuth: the leg's radial direction in site [rad];
    up: (3,) the way to the waypoint in the hip frame [m].
    """

    lengths: Array
    lower: Array
    upper: Array
    R_hip_site: Array
    azimuth: float
    up: Array

    def headed(self, qs: Array, normals: Array, turn: float, half_turn: bool) -> tuple[Array, NDArray[np.bool_]]:
        """Postures (n, 6), the wheel turned from the radial direction, and where that is inside the limits, (n,)."""
        qs = np.array(qs)
        done = ik_kernel.head_wheels(
            self.R_hip_site, normals, self.azimuth + turn, half_turn, self.lower, self.upper, qs
        )
        return qs, done

    def raised(self, branch: NDArray[np.int64], qs: Array) -> Array:
        """The postures (n, 6) above those; see ``ik_kernel.solve_raised``."""
        above = np.empty_like(qs)
        ik_kernel.solve_raised(self.lengths, self.up, branch, self.lower, self.upper, qs, above)
        return above


@dataclass(frozen=True)
class Postures:
    """For n cells: reason, blame, link as in Verdict; q, above: (n, 6); checks: mesh checks made."""

    reason: NDArray[np.uint8]
    blame: NDArray[np.uint8]
    link: NDArray[np.uint8]
    q: Array
    above: Array
    checks: int


def choose_postures(
    leg: LegFrame,
    cell: NDArray[np.int64],
    branch: NDArray[np.int64],
    qs: Array,
    normals: Array,
    collisions: LegCollisions | None,
    progress: Progress = no_progress,
) -> Postures:
    """The posture of every cell, from candidates as :meth:`LegCollisions.decide` takes them; UNSURE without checks.

    A wheel heads as near to the leg's radial direction as it must; only where no heading that is tried is inside the
    limits does it stay as it is in ``qs``.

    Args:
        leg: where the leg is, and its limits.
        cell: (m,) which cell each candidate is of.
        branch: (m,) which solution of the inverse kinematics it is.
        qs: (m, 6) its joint angles [rad].
        normals: (m, 3) in site, of the ground under it.
        collisions: checks of the leg; None: nothing is known to be free.
        progress: called with a fraction 0…1 and a text; what it raises ends the work.

    Returns:
        One posture for each cell, with what is known of it.
    """
    qs, _ = leg.headed(qs, normals, 0.0, True)
    above = leg.raised(branch, qs)
    if collisions is None:
        first = np.flatnonzero(np.diff(cell, prepend=-1))
        nothing = np.zeros(len(first), np.uint8)
        return Postures(np.full(len(first), UNSURE, np.uint8), nothing, nothing, qs[first], above[first], 0)
    most = collisions.most_checks
    found = collisions.decide(cell, branch, qs, above, most, part(progress, 0.0, 0.6))
    reason, blame, link = found.reason.copy(), found.blame.copy(), found.link.copy()
    q, up = qs[found.chosen], above[found.chosen]
    checks, turnable = found.checks, found.turnable
    alike = collisions.half_turn_alike
    turns = TURNS[1:] if alike else np.concatenate([TURNS[1:], TURNS + np.pi])
    for k, turn in enumerate(turns):
        progress(0.6 + 0.4 * k / len(turns), "other headings")
        again = np.flatnonzero(turnable & (reason[cell] != FREE) & (reason[cell] != UNSURE))
        turned, done = leg.headed(qs[again], normals[again], float(turn), alike)
        again, turned = again[done], turned[done]
        cells, number = np.unique(cell[again], return_inverse=True)
        raised = leg.raised(branch[again], turned)
        left = None if most is None else most - checks
        found = collisions.decide(number, branch[again], turned, raised, left)
        checks += found.checks
        better = (found.reason == FREE) | (found.reason == UNSURE)
        at, chosen = cells[better], found.chosen[better]
        reason[at], blame[at], link[at] = found.reason[better], 0, 0
        q[at], up[at] = turned[chosen], raised[chosen]
        # what another heading brings against the rest of the leg stays there in every heading
        turnable[again] &= found.turnable
    return Postures(reason, blame, link, q, up, checks)
