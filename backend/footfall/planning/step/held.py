"""Whether the wheels that stay hold the rover while a leg is in the air; asked of the start before any search.

What the start alone decides is no matter for a planner: whichever swing it finds begins with the same lift.
"""

from bisect import bisect_left
from collections.abc import Iterable

import numpy as np

from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.forces import distribute
from footfall.balance.region import equilibrium_region, region_margin
from footfall.balance.torques import TorqueCheck, torque_check
from footfall.core.arrays import Array
from footfall.core.beside import beside
from footfall.core.frames import apply
from footfall.maps.standing import Contacts
from footfall.planning.answers import Check
from footfall.planning.step.footing import LegStance, standing_feet, standing_legs
from footfall.robot.kinematics import center_of_mass

NOTHING_HOLDS = "no contact forces inside friction hold the rover"
MOST_FRICTION = 2.0
"""More is not asked of any ground."""
LEAST_SHIFT = 0.01
"""A shift of the chassis that is advised is no smaller [m]."""


def worst_held(stance: LegStance, feet: Contacts, friction: float, qs: Array) -> tuple[int, TorqueCheck]:
    """Where along postures of the leg the torques are worst, and what the standing wheels can do there.

    Args:
        stance: who stands where.
        feet: contacts of the standing legs.
        friction: coefficient between feet and ground.
        qs: postures of the leg, (n, 6) [rad].

    Returns:
        The row, and the check there.
    """
    at, _ = standing_legs(stance, feet, friction).worst(qs)
    # that one once more, by the check of single postures, which names the joint
    robot, state, others = stance.robot, stance.state, stance.others
    balance = BalanceSettings(friction=friction)
    return at, torque_check(robot, stance.posture(qs[at]), state.T_site_base, others, feet.normals, balance)


def spare_torque(check: TorqueCheck) -> float:
    """What is left of the torque limits as a share; NaN where no forces hold the rover: that has no size."""
    return 1.0 - check.ratio if check.feasible else float("nan")


def unheld_lift(stance: LegStance, friction: float, up: Array) -> tuple[str, Check] | None:
    """Why the other wheels can't hold the rover while the leg goes up, with what to try.

    Args:
        stance: who stands where.
        friction: coefficient between feet and ground.
        up: postures of the leg, (n, 6) [rad].

    Returns:
        Words and the check; None where they can.
    """
    feet = standing_feet(stance)
    if _hold(stance, feet, friction, up):
        return None
    # what is wrong where the leg stands is told as that
    at, held = worst_held(stance, feet, friction, up[:1])
    if held.holds:
        at, held = worst_held(stance, feet, friction, up)
    when = f"{at / (len(up) - 1):.0%} of the way up " if at else ""
    what, advice = _unheld(stance, friction, up[at], held)
    check = Check("torque", False, spare_torque(held), "of the limit", f"{held.joint_name or NOTHING_HOLDS}, lift")
    return f"leg {stance.leg} can't be lifted: {when}{what}; {advice}", check


def unheld(stance: LegStance, friction: float, qs: Array) -> str:
    """What the standing wheels lack while the leg is at postures, none of them on the ground.

    Args:
        stance: who stands where.
        friction: coefficient between feet and ground.
        qs: postures of the leg, (n, 6) [rad].

    Returns:
        One sentence; empty where nothing is lacking.
    """
    feet = standing_feet(stance)
    if _hold(stance, feet, friction, qs):
        return ""
    _, held = worst_held(stance, feet, friction, qs)
    if not held.feasible:
        return f"the wheels of legs {listed(stance.others)} can't hold the rover inside friction {friction:z.2f}"
    return _overloaded(held)


def _hold(stance: LegStance, feet: Contacts, friction: float, qs: Array) -> bool:
    return standing_legs(stance, feet, friction).worst(qs)[1] <= 1.0


def listed(legs: Iterable[int]) -> str:
    """Legs for a person, as in "1, 3, 5"."""
    return ", ".join(str(leg) for leg in legs)


def _overloaded(held: TorqueCheck) -> str:
    ratio, limit = beside(held.ratio, 1.0, 2)
    return f"{held.joint_name} would need {ratio} of its torque limit ({limit}), however the load is shared"


def _unheld(stance: LegStance, friction: float, q: Array, held: TorqueCheck) -> tuple[str, str]:
    """What is lacking, by how much, and what to try."""
    robot, feet = stance.robot, standing_feet(stance)
    if held.feasible:
        others = "shift the chassis towards the other legs, or put their wheels nearer to it"
        load = _without_payload(stance, friction, q)
        return _overloaded(held), f"{load}{others}"
    com = apply(stance.state.T_site_base, center_of_mass(robot, stance.posture(q)))[:2]
    region = equilibrium_region(feet.points, feet.normals, friction)
    what = f"the wheels of legs {listed(stance.others)} can't hold the rover inside friction {friction:z.2f}"
    if not len(region.corners):
        enough = _enough_friction(stance, q)
        least = f"; friction of {enough:z.2f} would do" if enough else ""
        advice = "take another stance, with its wheels on more level ground; no shift of the chassis helps"
        return f"{what}, wherever its centre of mass is{least}", advice
    margin, towards = -region_margin(region, com).margin, _nearest(region.corners, com) - com
    size = max(margin, LEAST_SHIFT)
    dx, dy = size * towards / max(float(np.linalg.norm(towards)), 1e-9)
    return (
        f"{what}: its centre of mass is {size:z.2f} m outside of where they can",
        f"shift the chassis by more than that, about ({dx:+z.2f}, {dy:+z.2f}) m, or take another stance",
    )


def _enough_friction(stance: LegStance, q: Array) -> float | None:
    """The least friction that holds the rover, to 0.01 and never less; None where none does."""
    feet = standing_feet(stance)
    com = apply(stance.state.T_site_base, center_of_mass(stance.robot, stance.posture(q)))

    def holds(friction: float) -> bool:
        return distribute(feet.points, feet.normals, com, stance.robot.mass, friction=friction) is not None

    hundredths = range(1, round(100 * MOST_FRICTION) + 1)
    found = bisect_left(hundredths, True, key=lambda one: holds(one / 100))
    return None if found == len(hundredths) else hundredths[found] / 100


def _without_payload(stance: LegStance, friction: float, q: Array) -> str:
    """Whether the rover would be held with nothing on it, as an advice; empty where that is no way out."""
    robot, state = stance.robot, stance.state
    if robot.description.payload is None:
        return ""
    settings = BalanceSettings(friction=friction, payload_mass=0.0)
    feet = standing_feet(stance)
    bare = torque_check(robot, stance.posture(q), state.T_site_base, stance.others, feet.normals, settings)
    return f"take off payload (with none, {bare.ratio:z.2f} of the limit), " if bare.holds else ""


def _nearest(corners: Array, point: Array) -> Array:
    """The nearest place (2,) of a polygon's border, corners (m, 2)."""
    a, b = corners, np.roll(corners, -1, axis=0)
    along = b - a
    share = np.sum((point - a) * along, axis=1) / np.maximum(np.sum(along**2, axis=1), 1e-18)
    places = a + np.clip(share, 0.0, 1.0)[:, None] * along
    return places[int(np.argmin(np.linalg.norm(places - point, axis=1)))]
