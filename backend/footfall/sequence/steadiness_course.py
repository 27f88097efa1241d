"""How steadily the rover stands all along a plan, a walk or a sequence, and where it stands worst."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.moving_leg import centers_of_mass
from footfall.balance.payload import loaded
from footfall.core.arrays import Array
from footfall.core.frames import apply, rotation_from_z
from footfall.maps.standing import standing
from footfall.maps.support_outlines import OUTLINES, Support, support_of, support_on
from footfall.planning.between_rows import base_path
from footfall.planning.step.problem import StepPlan, StepSettings
from footfall.planning.walk.problem import WalkPlan, WalkSettings
from footfall.robot.kinematics import center_of_mass, wheel_centers
from footfall.robot.model import Robot
from footfall.sequence.commands import Sequence
from footfall.sequence.sampled import DRAG
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.terrain.dem import Dem

SAMPLING = 0.02
"""Largest joint step between two moments [rad]."""
ON_A_TETHER = "the tether holds, too: forces of the ground alone say nothing"


@dataclass(frozen=True)
class SteadinessCourse:
    """moments: (n,) 0…1, as a ghost is scrubbed: shares of the way, measured by the largest joint's travel.

    rows: (n,) the command that is carried out, or of a plan the waypoint that is gone to, from 0; two moments are the
    same where a row ends and the next begins on other wheels. margins: outline → (n,) [m], −inf where nothing is held,
    NaN where that is not known. why: outline → what is to be said of it, of the first row that has something to say.
    """

    moments: Array
    rows: NDArray[np.int64]
    margins: Mapping[str, Array]
    why: Mapping[str, str]

    def worst(self, outline: str) -> int | None:
        """Which moment has the least margin; None where none is known."""
        found = self.margins[outline]
        return None if np.isnan(found).all() else int(np.nanargmin(found))


def course_of(
    robot: Robot,
    dem: Dem,
    moved: StepPlan | WalkPlan | Sequence,
    balance: BalanceSettings | None = None,
    up: Array | None = None,
) -> SteadinessCourse:
    """Margins at samples of every row. A row stands on the wheels that are down, and stay, from its begin to its end.

    Args:
        robot: the rover.
        dem: the ground that the motion was made on, in site.
        moved: the motion.
        balance: its friction, the sides of its cones and the payload count; None: what the motion was made with.
        up: (3,) unit in site, along which polygons are seen of a rover on a tether; None: from above, and nothing else
            holds it.

    Returns:
        The margins.
    """
    balance = balance or balance_of(moved)
    motion = moved.motion
    waypoints, Ts, travel, begins = motion.waypoints, motion.Ts_site_base, motion.travel, motion.travelled
    stances = _Stances(robot, dem, balance)
    R_site_slope = None if up is None else rotation_from_z(up, np.eye(3)[np.argmin(np.abs(up))])
    moments, rows, found, why = [], [], [], {}
    for row in range(len(travel)):
        lifted = motion.lifted(row + 1)
        leg = lifted[0] if len(lifted) == 1 else None
        support = stances.of_row(waypoints[row : row + 2], Ts[row : row + 2], leg)
        shares = np.linspace(0.0, 1.0, max(1, int(np.ceil(travel[row] / SAMPLING))) + 1)
        coms = _coms(robot, waypoints[row : row + 2], Ts[row : row + 2], leg, shares, balance)
        if R_site_slope is not None:
            support, coms = _on_slope(support, R_site_slope), coms @ R_site_slope
        found.append(support.margins(coms[:, :2]))
        moments.append((begins[row] + shares * travel[row]) / max(begins[-1], 1e-12))
        rows.append(np.full(len(shares), row))
        why = support.why | why
    return SteadinessCourse(
        np.concatenate(moments),
        np.concatenate(rows),
        {name: np.concatenate([one[name] for one in found]) for name in OUTLINES},
        why,
    )


def _on_slope(support: Support, R_site_slope: Array) -> Support:
    return replace(support_on(support.legs, support.points @ R_site_slope, None), unknown=ON_A_TETHER)


def balance_of(moved: StepPlan | WalkPlan | Sequence) -> BalanceSettings:
    """Friction and payload that a motion was made with; those of the settings as delivered where it does not say."""
    made_with = moved.provenance.settings
    if isinstance(made_with, (WalkSettings, SequenceSettings)):
        return made_with.balance
    return BalanceSettings(friction=made_with.friction) if isinstance(made_with, StepSettings) else BalanceSettings()


class _Stances:
    """What the wheels of each row hold; rows that stand alike share it."""

    def __init__(self, robot: Robot, dem: Dem, balance: BalanceSettings) -> None:
        self._robot, self._dem, self._balance = robot, dem, balance
        self._made: dict[bytes, Support] = {}
        self._down: dict[bytes, list[int]] = {}

    def of_row(self, postures: Array, Ts_site_base: Array, leg: int | None) -> Support:
        """How steady the rover stands on the feet that stay during a row.

        postures (2, legs × 6), Ts_site_base (2, 4, 4): where a row begins and ends; leg: the one it moves.
        """
        robot = self._robot
        moved = [apply(T, wheel_centers(robot, q)) for q, T in zip(postures, Ts_site_base, strict=True)]
        stays = np.linalg.norm(moved[1] - moved[0], axis=1) <= DRAG
        down = [self._down_at(q, T) for q, T in zip(postures, Ts_site_base, strict=True)]
        legs = [one for one in robot.legs if one != leg and stays[one] and one in down[0] and one in down[1]]
        own = [6 * one + joint for one in legs for joint in range(6)]
        key = bytes(legs) + postures[0, own].tobytes() + Ts_site_base[0].tobytes()
        if key not in self._made:
            self._made[key] = support_of(robot, self._dem, postures[0], Ts_site_base[0], legs, self._balance)
        return self._made[key]

    def _down_at(self, posture: Array, T_site_base: Array) -> list[int]:
        key = posture.tobytes() + T_site_base.tobytes()
        if key not in self._down:
            self._down[key] = standing(self._robot, self._dem, posture, T_site_base, self._robot.legs)
        return self._down[key]


def _coms(
    robot: Robot, postures: Array, Ts_site_base: Array, leg: int | None, shares: Array, balance: BalanceSettings
) -> Array:
    """Centres of mass at shares 0…1 of a row, site (n, 3) [m]."""
    dense = postures[0] + shares[:, None] * (postures[1] - postures[0])
    Ts = base_path(Ts_site_base[0], Ts_site_base[1], shares)
    if leg is not None:
        coms = centers_of_mass(robot, postures[0], leg, dense[:, 6 * leg : 6 * leg + 6])
    else:
        coms = np.array([center_of_mass(robot, posture) for posture in dense])
    _, coms = loaded(robot, coms, balance)
    return np.einsum("nij,nj->ni", Ts[:, :3, :3], coms) + Ts[:, :3, 3]
