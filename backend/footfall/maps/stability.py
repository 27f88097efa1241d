"""How stable the rover would stand with one leg on each reachable cell, and while that leg is in the air above it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.moving_leg import centers_of_mass
from footfall.balance.payload import loaded
from footfall.balance.region_candidates import region_margins_for_candidates
from footfall.balance.support import bindings_for_candidates, margins
from footfall.balance.tip_over_candidates import tip_energies_for_candidates
from footfall.balance.torque_candidates import torque_ratios_for_postures
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply
from footfall.maps.binding import binding_feet, binding_loss
from footfall.maps.reach import Reach
from footfall.maps.standing import Contacts, contacts, standing
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem


@dataclass(frozen=True)
class StayingFeet:
    """The feet that stay while one leg steps, in a frame with z against gravity.

    legs: those that stand. feet: their contacts, site. points, normals: (k, 3) of them, level, see
    :meth:`footfall.balance.balance_settings.BalanceSettings.level`.
    """

    legs: tuple[int, ...]
    feet: Contacts
    points: Array
    normals: Array


def stance_without(robot: Robot, dem: Dem, state: RobotState, leg: int, balance: BalanceSettings) -> StayingFeet:
    """The other standing wheels; one known to be in the air carries nothing.

    Raises InvalidInput where fewer than three other legs could carry the rover meanwhile.
    """
    others = [other for other in robot.legs if other != leg]
    if len(others) < 3:
        raise InvalidInput(f"{robot.name} stands on {len(others)} legs while leg {leg} moves; it needs three")
    down = standing(robot, dem, state.posture, state.T_site_base, others)
    feet = contacts(robot, dem, state.posture, state.T_site_base, down)
    return StayingFeet(tuple(down), feet, balance.level(feet.points), balance.level(feet.normals))


def geometric(
    robot: Robot,
    state: RobotState,
    leg: int,
    stance: StayingFeet,
    reached: Reach,
    balance: BalanceSettings,
    conservative: bool,
) -> dict[str, NDArray]:
    """Layers of the support polygons for each cell of ``reached``, (n,) each; NaN where the leg has no posture.

    "margin", "margin_conservative" [m]: absolute stability margin with the leg standing there. "margin_lifted": that
    of the other feet's polygon (``conservative``: their conservative one) with the leg in the air above, as the step
    planner asks. "tip_energy" [J]. "binding", "binding_lost": uint8 codes of :mod:`footfall.maps.binding`, the feet
    and the lost leg behind the margin that ``conservative`` asks for.

    The centre of mass is that of the present posture with the leg's new angles, and the payload of ``balance``.
    """
    mass, coms = _coms(robot, state, leg, reached.postures, balance)
    _, lifted = _coms(robot, state, leg, reached.above, balance)
    feet = balance.level(reached.contacts)
    there, above = np.isfinite(coms).all(axis=1), np.isfinite(lifted).all(axis=1)
    in_air = np.full(len(feet), np.nan)
    in_air[above] = margins(stance.points, lifted[above, :2], conservative)
    energy = np.full(len(feet), np.nan)
    energy[there] = tip_energies_for_candidates(stance.points, feet[there], coms[there], mass, balance.gravity)
    plain, strict = (bindings_for_candidates(stance.points, feet[:, :2], coms[:, :2], lost) for lost in (False, True))
    decisive, legs = strict if conservative else plain, (*stance.legs, leg)
    return {
        "margin": plain.margins,
        "margin_conservative": strict.margins,
        "margin_lifted": in_air,
        "tip_energy": energy,
        "binding": binding_feet(decisive.pairs, legs),
        "binding_lost": binding_loss(decisive.lost, legs),
    }


def with_friction(
    robot: Robot,
    state: RobotState,
    leg: int,
    stance: StayingFeet,
    reached: Reach,
    balance: BalanceSettings,
    at: NDArray[np.bool_],
) -> dict[str, Array]:
    """Layers with friction cones on the real normals.

    "margin_friction", "margin_friction_conservative" [m]: to the equilibrium region (balance.region_candidates), and to
    what of it survives the loss of any one leg. "torque_ratio": least possible largest torque over its limit.

    Args:
        robot: the rover.
        state: how the rover stands.
        leg: number of the leg that is to step, from 0.
        stance: the feet that stay.
        reached: the cells (n,) that the leg reaches, with their postures.
        balance: friction, gravity and payload.
        at: (n,) the cells that are asked for.

    Returns:
        Name → (n,), NaN where not asked for.
    """
    postures, normals = reached.postures[at], reached.normals[at]
    _, coms = _coms(robot, state, leg, postures, balance)
    args = stance.points, stance.normals, balance.level(reached.contacts[at]), balance.level(normals)
    found = {}
    for name, conservative in (("margin_friction", False), ("margin_friction_conservative", True)):
        found[name] = region_margins_for_candidates(
            *args, coms[:, :2], conservative, balance.friction, balance.sides
        ).margin
    found["torque_ratio"] = torque_ratios_for_postures(
        robot,
        state.posture,
        state.T_site_base,
        stance.legs,
        stance.feet.normals,
        leg,
        postures,
        normals,
        balance,
    )
    layers = {}
    for name, numbers in found.items():
        layers[name] = np.full(len(at), np.nan)
        layers[name][at] = numbers
    return layers


def _coms(robot: Robot, state: RobotState, leg: int, postures: Array, balance: BalanceSettings) -> tuple[float, Array]:
    """Mass [kg], and centres of mass (n, 3) [m], level."""
    mass, coms = loaded(robot, centers_of_mass(robot, state.posture, leg, postures), balance)
    return mass, balance.level(apply(state.T_site_base, coms))
