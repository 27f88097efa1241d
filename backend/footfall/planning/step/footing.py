"""What a step takes from the stance and the ground alone: prepared once, kept for the next footfall asked for.

Everything here is read only, so plans may share it.
"""

from dataclasses import dataclass

import numpy as np

from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.moving_leg import moment_without
from footfall.balance.support import half_planes
from footfall.balance.torque_candidates import StandingLegs
from footfall.core.arrays import Array
from footfall.maps.standing import Contacts, contacts
from footfall.planning.answers import No
from footfall.planning.latest_results import LatestResults
from footfall.planning.scene.certificate import Certificate
from footfall.planning.scene.ground import Nearby, nearby
from footfall.planning.scene.leg_over_ground import LegOverGround
from footfall.planning.scene.solids import LegAlongPath
from footfall.planning.step.problem import StepSettings
from footfall.planning.step.start import start_objection
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

_KEPT = 12
"""Stances remembered: two for each leg of a rover with six."""
_BEYOND_REACH = 0.5
"""How far beyond the leg's reach the ground is prepared [m]."""


class LegStance:
    """Who stands where and lifts which leg. content: names all that; equal content is equal, in whatever objects."""

    def __init__(self, robot: Robot, dem: Dem, state: RobotState, leg: int) -> None:
        self.robot, self.dem, self.state, self.leg = robot, dem, state, leg
        self.others = [i for i in robot.legs if i != leg]
        self.content = robot.digest, dem.digest, state.digest, leg

    def posture(self, q: Array) -> Array:
        """Whole posture with the leg at q (6,)."""
        out = np.array(self.state.posture)
        out[6 * self.leg : 6 * self.leg + 6] = q
        return out

    @property
    def hip(self) -> Array:
        """(3,), site [m]."""
        return (np.asarray(self.state.T_site_base) @ self.robot.description.legs[self.leg].T_base_hip)[:3, 3]

    @property
    def reach(self) -> float:
        """How far the leg gets from its hip [m]."""
        return self.robot.leg_length(self.leg)


@dataclass(frozen=True)
class Footing:
    """feet: contacts of the legs that stay; normals (k, 2), offsets (k,): half-planes of their polygon, site.

    moment: Σ mass × position in base of all but the leg, (3,) [kg·m]. certificate: the compiled check; solids,
    over_ground: the exact ones.
    """

    feet: Contacts
    normals: Array
    offsets: Array
    moment: Array
    certificate: Certificate
    solids: LegAlongPath
    over_ground: LegOverGround


_objections: LatestResults[str] = LatestResults(_KEPT)
_grounds: LatestResults[Nearby | No] = LatestResults(_KEPT)
_footings: LatestResults[Footing] = LatestResults(_KEPT)
_standing: LatestResults[StandingLegs] = LatestResults(_KEPT)
_feet: LatestResults[Contacts] = LatestResults(_KEPT)


def impossible(stance: LegStance) -> str:
    """What makes the stance impossible on its ground; empty where nothing does."""
    return _objections.get(stance.content, lambda: start_objection(stance.robot, stance.dem, stance.state, stance.leg))


def ground_near(stance: LegStance) -> Nearby | No:
    """The ground in reach of the leg, holes filled."""
    return _grounds.get(stance.content, lambda: _ground_near(stance))


def footing(stance: LegStance, ground: Nearby, settings: StepSettings) -> Footing:
    """Of a stance over the ground near its leg."""
    asked = (
        settings.clearance,
        settings.raise_terrain,
        settings.conservative,
        settings.least_margin,
    )
    return _footings.get((stance.content, ground.dem.digest, *asked), lambda: _footing(stance, ground, settings))


def standing_feet(stance: LegStance) -> Contacts:
    """The contacts of the legs that stay."""
    robot, dem, state = stance.robot, stance.dem, stance.state
    return _feet.get(stance.content, lambda: contacts(robot, dem, state.posture, state.T_site_base, stance.others))


def standing_legs(stance: LegStance, feet: Contacts, friction: float) -> StandingLegs:
    """What the legs that stay put into the programs of torque.

    Args:
        stance: who stands where.
        feet: their contacts.
        friction: coefficient between feet and ground.

    Returns:
        Their share.
    """
    robot, state, leg = stance.robot, stance.state, stance.leg
    return _standing.get(
        (stance.content, friction),
        lambda: StandingLegs(
            robot,
            state.posture,
            state.T_site_base,
            stance.others,
            feet.normals,
            leg,
            BalanceSettings(friction=friction),
        ),
    )


def _ground_near(stance: LegStance) -> Nearby | No:
    state = stance.state
    foot = contacts(stance.robot, stance.dem, state.posture, state.T_site_base, [stance.leg]).points
    return nearby(stance.dem, stance.hip[:2], stance.reach + _BEYOND_REACH, foot)


def _footing(stance: LegStance, ground: Nearby, settings: StepSettings) -> Footing:
    robot, dem, state, leg = stance.robot, stance.dem, stance.state, stance.leg
    feet = standing_feet(stance)
    normals, offsets = half_planes(feet.points, settings.conservative)
    return Footing(
        feet,
        normals,
        offsets,
        moment_without(robot, state.posture, leg),
        Certificate(
            robot,
            state,
            leg,
            dem,
            ground,
            normals,
            offsets,
            clearance=settings.clearance,
            raise_terrain=settings.raise_terrain,
            least_margin=settings.least_margin,
        ),
        LegAlongPath(robot, np.asarray(state.posture), leg, settings.clearance),
        LegOverGround(robot, leg, np.asarray(state.T_site_base), ground, settings.clearance),
    )
