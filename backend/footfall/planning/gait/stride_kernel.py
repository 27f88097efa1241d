"""What legs have to spare over all that their feet stand in a gait, compiled; and a group of feet that swings."""

import numpy as np
from numpy.typing import NDArray

from footfall.balance.support_kernel import margin_of_feet
from footfall.compiled import njit
from footfall.core.arrays import Array, Ints
from footfall.planning.scene.rover_kernel import CLEAR, center_of_mass, first_too_near, place_rover
from footfall.planning.walk.body_kernel import HOLDS, MARGIN, NEAR, TORQUE, Checks, moved_between, torque_of
from footfall.planning.walk.legs_kernel import LegsTables, leg_at

_TORQUE_EVERY = 4
"""Forces and torques are asked for at every so many samples, and at every waypoint."""


@njit()
def spares_of(
    Ts: Array, wheels: Array, which: Ints, first: Ints, last: Ints, lift: float, legs: LegsTables, spares: Array
) -> None:
    """Write what the leg of each foot has to spare (m,) at the worst of the chassis poses at which it stands there.

    Ts: (n, 3, 4); wheels: (m, 3, 4) T_site_wheel, on branch 0; which: (m,) the legs; first, last: (m,) rows of Ts. At
    these two the wheel is above where it stands as well, by ``lift`` [m].
    """
    q, raised = np.empty(6), np.empty((3, 4))
    for i in range(len(wheels)):
        raised[:] = wheels[i]
        raised[2, 3] += lift
        least = min(
            leg_at(Ts[first[i]], raised, 0, which[i], legs, q), leg_at(Ts[last[i]], raised, 0, which[i], legs, q)
        )
        for at in range(first[i], last[i] + 1):
            least = min(least, leg_at(Ts[at], wheels[i], 0, which[i], legs, q))
        spares[i] = least


@njit()
def group_swings(
    path: Array,
    ways: Ints,
    standing: NDArray[np.bool_],
    T: Array,
    contacts: Array,
    normals: Array,
    raised: float,
    checks: Checks,
    margins: Array,
    torques: Array,
) -> tuple[int, int, float, int]:
    """Check the straight lines of joints along a path (n, legs × 6) with the chassis at T (3, 4).

    ways: (n, legs) how each foot is on the way to a row, see rover_kernel.LIFTED; standing: (legs,) which carry;
    contacts, normals: (legs, 3), read where they stand. Samples are so near that nothing moves farther between two than
    ``checks.gap``. Returns what fails, of what, what it has to spare, and on the way to which row. margins, torques
    (n,): the worst on the way to each row.
    """
    bodies = 7 * len(standing)
    poses, before, q = np.empty((bodies, 3, 4)), np.empty((bodies, 3, 4)), np.empty(path.shape[1])
    x, y = contacts[standing, 0].copy(), contacts[standing, 1].copy()
    place_rover(path[0], T, checks.rover, before)
    share, samples = 0.25, 0
    for row in range(len(path)):
        margins[row], torques[row], done = np.inf, 0.0, 0.0
        while True:
            if row == 0:
                done = 1.0
                q[:] = path[0]
                place_rover(q, T, checks.rover, poses)
            else:
                while True:
                    to = min(1.0, done + share)
                    q[:] = path[row - 1] + to * (path[row] - path[row - 1])
                    place_rover(q, T, checks.rover, poses)
                    away = moved_between(before, poses, checks.reaches)
                    if not away > checks.gap:
                        break
                    share *= min(0.9, max(0.1, 0.95 * checks.gap / away))
                share *= min(2.0, max(0.5, 0.95 * checks.gap / max(away, 1e-6)))
                done = to
            before[:] = poses
            com = center_of_mass(poses, T, checks.rover)
            margin = margin_of_feet(x, y, com[0], com[1], 0)
            margins[row] = min(margins[row], margin)
            if not margin >= checks.balance.least:
                return MARGIN, 0, margin - checks.balance.least, row
            code, near = first_too_near(poses, T, ways[max(row, 1)], raised, checks.rover)
            if code != CLEAR:
                return NEAR, code, near, row
            if done >= 1.0 or samples % _TORQUE_EVERY == 0:
                ratio = torque_of(poses, T, contacts, normals, standing, checks)
                torques[row] = max(torques[row], ratio)
                if not ratio <= checks.most_torque:
                    return TORQUE, 0, checks.most_torque - ratio, row
            samples += 1
            if done >= 1.0:
                break
    return HOLDS, 0, 0.0, len(path)
