"""What one sample of a gait fails: the checks of a walk, asked of any set of standing feet."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from footfall.balance.held_kernel import held_ratio, least_held_ratio
from footfall.balance.support_kernel import margin_of_feet
from footfall.core.frames import inverse
from footfall.planning.scene.rover_kernel import (
    BODIES,
    CLEAR,
    STANDING,
    TERRAIN,
    center_of_mass,
    first_too_near,
    place_rover,
)
from footfall.planning.walk.legs_kernel import leg_at
from footfall.planning.walk.world import World
from footfall.robot.ik import solve_leg
from footfall.robot.leg_frames import PART_COUNT

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Lack:
    """A failed check: leg −1 where it is of none; amount > 0 in unit."""

    name: str
    leg: int
    amount: float
    unit: str


def lacks(
    world: World,
    T: Array,
    wheels: Array,
    branches: NDArray[np.int64],
    feet: NDArray[np.int64],
    contacts: Array,
    normals: Array,
    raised: float,
    q: Array,
) -> tuple[list[Lack], float, float]:
    """What fails, the margin [m] and the torque ratio, with the chassis at T (4, 4) and wheels (legs, 4, 4) in site.

    feet: (legs,) how each is, see rover_kernel.LIFTED; contacts, normals: (legs, 3), read where they stand. raised:
    the ground for legs in the air [m]. q (legs × 6,) holds the last posture and is written.
    """
    found: list[Lack] = []
    piece, T34 = world.around(T).checks, np.ascontiguousarray(T[:3])
    legs = world.legs._replace(reach_reserve=0.0, joint_reserve=0.0, wrist=0.0, knee_roll=np.inf)
    own = np.empty(6)
    for leg in range(len(wheels)):
        spare = leg_at(T34, np.ascontiguousarray(wheels[leg, :3]), int(branches[leg]), leg, legs, own)
        if np.isnan(own).any():
            found.append(_unreached(world, T, wheels[leg], int(branches[leg]), leg, spare))
        else:
            q[6 * leg : 6 * leg + 6] = own
    poses = np.empty((PART_COUNT * len(wheels), 3, 4))
    place_rover(q, T34, piece.rover, poses)
    com, down = np.array(center_of_mass(poses, T34, piece.rover)), feet == STANDING
    margin = margin_of_feet(contacts[down, 0], contacts[down, 1], com[0], com[1], 0)
    if not margin >= world.settings.least_margin:
        found.append(Lack("support polygon", -1, world.settings.least_margin - margin, "m"))
    code, near = first_too_near(poses, T34, feet, raised, piece.rover)
    if code != CLEAR:
        first, other = divmod(code, BODIES)
        name = "terrain collision" if other >= TERRAIN else "self collision"
        found.append(Lack(name, first // PART_COUNT if first < PART_COUNT * len(wheels) else -1, -near, "m"))
    ratio = held_ratio(poses, T34, contacts, normals, down, piece.held)[0]
    if not ratio <= world.settings.most_torque:
        ratio = least_held_ratio(poses, T34, contacts, normals, down, piece.held)
    if not np.isfinite(ratio):
        found.append(Lack("friction", -1, np.inf, ""))
    elif ratio > world.settings.most_torque:
        found.append(Lack("torque", -1, ratio - world.settings.most_torque, "of the limit"))
    return found, margin, ratio


def _unreached(world: World, T: Array, wheel: Array, branch: int, leg: int, spare: float) -> Lack:
    """Why a leg has no posture there: too far or too near, or past a joint's limit."""
    own = slice(6 * leg, 6 * leg + 6)
    angles = solve_leg(world.robot, leg, (inverse(T) @ wheel)[None]).q[0, branch]
    if np.isnan(angles).any():
        return Lack("reach", leg, max(-1.0 - spare, 0.0), "m")
    past = np.maximum(world.robot.lower[own] - angles, angles - world.robot.upper[own])
    return Lack("joint limits", leg, float(past.max()), "rad")
