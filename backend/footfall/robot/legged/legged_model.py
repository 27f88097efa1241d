"""A robot that stands on legs, as it was read from a description that others wrote."""

from collections.abc import Mapping
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidRobot
from footfall.core.value import LATER, Value, value
from footfall.robot.description import CameraPairSpec
from footfall.robot.legged.tree import RobotTree
from footfall.telemetry.joint_layout import JointLayout

FEWEST_LEGS, MOST_LEGS = 3, 12
SOLES = ("wheel", "ball", "flat", "point")


@value
class Sole(Value):
    """What of a foot touches the ground, in the frame of the foot link.

    kind: one of SOLES. center: of wheel, ball or flat sole, or the point, (3,) [m]. radius: of wheel or ball [m], or 0.
    axis: (3,) axle of a wheel, outward normal of a flat sole, else zeros. width [m]: of a wheel, else 0.
    polygon: corners of a flat sole, counter-clockwise seen against its normal, (n, 3) [m]; (0, 3) for others.
    doubt: why the guess may be wrong; empty where it is sure.
    """

    kind: str
    center: NDArray[np.float64]
    radius: float
    axis: NDArray[np.float64]
    width: float
    polygon: NDArray[np.float64]
    doubt: str = ""

    def check(self) -> None:
        """Raises InvalidRobot for a kind that is none of SOLES."""
        if self.kind not in SOLES:
            raise InvalidRobot(f"a sole is one of {', '.join(SOLES)}, not {self.kind!r}")


@value
class LegChain(Value):
    """One leg: its moving joints from the base to the foot, and the foot link. doubt: why it may be no leg."""

    name: str
    joints: tuple[str, ...]
    foot: str
    sole: Sole
    group: int
    doubt: str = ""


@value
class LeggedModel(Value):
    """base: first link of the chassis. legs that have one group are built alike. left_out: limb → why it is no leg.

    Raises InvalidRobot for fewer than three legs or more than twelve, and for names or joints that two legs have.
    """

    tree: RobotTree
    base: str
    legs: tuple[LegChain, ...]
    left_out: Mapping[str, str]

    def check(self) -> None:
        """Raises InvalidRobot for too few or too many legs, saying why limbs were left out, and what two legs share."""
        if not FEWEST_LEGS <= len(self.legs) <= MOST_LEGS:
            others = "; ".join(f"{limb}: {why}" for limb, why in self.left_out.items())
            legs = "1 leg" if len(self.legs) == 1 else f"{len(self.legs)} legs"
            raise InvalidRobot(
                f"{self.tree.name} has {legs}, and {FEWEST_LEGS} to {MOST_LEGS} are needed"
                + (f"; no legs are {others}" if others else ""),
                legs=[leg.name for leg in self.legs],
                left_out=dict(self.left_out),
            )
        names = [leg.name for leg in self.legs]
        if len(set(names)) != len(names):
            raise InvalidRobot(f"{self.tree.name}: two legs have one name", names=names)
        owners: dict[str, str] = {}
        for leg in self.legs:
            for joint in leg.joints:
                if joint in owners:
                    raise InvalidRobot(f"{self.tree.name}: legs {owners[joint]} and {leg.name} both have joint {joint}")
                owners[joint] = leg.name

    def groups(self) -> tuple[tuple[LegChain, ...], ...]:
        """Legs that are built alike, together."""
        numbers = sorted({leg.group for leg in self.legs})
        return tuple(tuple(leg for leg in self.legs if leg.group == number) for number in numbers)


STAND = "stand"
"""Name of the posture of a robot.toml that a robot stands in."""


def held_joints(model: LeggedModel, postures: Mapping[str, Mapping[str, float]]) -> dict[str, float]:
    """Joint → where it is held, of the free ones that are no leg's: as ``stand`` has it, else in the middle posture."""
    said, moved = postures.get(STAND, {}), {joint for leg in model.legs for joint in leg.joints}
    middle = model.tree.neutral()
    return {joint: said.get(joint, angle) for joint, angle in middle.items() if joint not in moved}


@value
class DescribedRobot(Value):
    """All that is known of a robot that others described; a :class:`.legged_robot.LeggedRobot` is made of it.

    postures: name → joint → angle [rad or m]. clearances: least distances by name [m]. always: pairs of links that
    touch as they are built. cameras: pairs on the chassis; images say themselves by which they were taken.
    """

    model: LeggedModel
    postures: Mapping[str, Mapping[str, float]]
    clearances: Mapping[str, float]
    always: tuple[tuple[str, str], ...]
    cameras: tuple[CameraPairSpec, ...] = field(default=(), metadata=LATER)

    @property
    def name(self) -> str:
        """What its URDF calls it."""
        return self.model.tree.name

    @property
    def sags(self) -> bool:
        """Whether it is known how every joint of its legs gives way; else it is taken as rigid.

        Of joints that follow others nobody computes it.
        """
        joints = [self.model.tree.joint(name) for leg in self.model.legs for name in leg.joints]
        return all(joint.stiffness > 0 and not joint.mimic for joint in joints)

    @property
    def layout(self) -> JointLayout:
        """Its legs and joints by name."""
        joints = tuple(leg.joints for leg in self.model.legs)
        slides = {joint.name for joint in self.model.tree.joints if joint.kind == "prismatic"}
        sliding = tuple(name for own in joints for name in own if name in slides)
        return JointLayout(tuple(leg.name for leg in self.model.legs), joints, sliding)
