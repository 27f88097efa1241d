"""A limb as a value: joints in a row from the body to the foot, whatever their number, axes and kinds."""

from typing import Literal

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.errors import InvalidRobot, NotFound
from footfall.core.frames import require_transform
from footfall.core.value import Value, value

Place = Literal["point", "pose"]

LONGEST = 7
"""Joints of a limb at most."""


@value
class Limb(Value):
    """A chain of joints on a body that stays where it is.

    names: of the joints, from the body outward. placements: (joints + 1, 4, 4) each joint on the one before with that
    at zero, the first on the body, the last the foot's frame on the last joint. axes: (joints, 3) unit axis of each in
    its own frame. slides: (joints,) whether it moves along its axis, else it turns about it. lower, upper: (joints,)
    [rad or m]. place: what of the foot is asked for: where its frame's origin is (a ball or point foot), or its whole
    pose (a wheel or a sole).
    """

    names: tuple[str, ...]
    placements: Array
    axes: Array
    slides: NDArray[np.bool_]
    lower: Array
    upper: Array
    place: Place

    def check(self) -> None:
        """Raises InvalidRobot for a number of joints, placements, axes, kinds or limits that don't make a chain."""
        count = len(self.names)
        if not 1 <= count <= LONGEST:
            raise InvalidRobot(f"a limb has 1 to {LONGEST} joints, not {count}", joints=list(self.names))
        if self.placements.shape != (count + 1, 4, 4):
            raise InvalidRobot(f"{count} joints need {count + 1} placements: the foot has one too")
        for placement in self.placements:
            require_transform(placement, "a placement")
        if self.axes.shape != (count, 3) or not np.allclose(np.linalg.norm(self.axes, axis=1), 1.0, atol=1e-9):
            raise InvalidRobot("each joint needs an axis of length 1")
        if self.slides.shape != (count,) or self.lower.shape != (count,) or self.upper.shape != (count,):
            raise InvalidRobot(f"kinds and limits are needed for each of the {count} joints")
        if not (np.isfinite(self.lower) & np.isfinite(self.upper) & (self.lower < self.upper)).all():
            raise InvalidRobot("the limits of a joint must be finite, the lower below the upper", joints=self.names)
        if self.place not in ("point", "pose"):
            raise InvalidRobot(f"the place of a foot is a point or a pose, not {self.place!r}")

    @property
    def equations(self) -> int:
        """How many numbers the place of the foot is: 3 or 6."""
        return 3 if self.place == "point" else 6

    @property
    def reach(self) -> float:
        """Farthest that the foot can be from the first joint [m]."""
        slides = np.where(self.slides, np.maximum(np.abs(self.lower), np.abs(self.upper)), 0.0)
        return float(np.linalg.norm(self.placements[1:, :3, 3], axis=1).sum() + slides.sum())


def limb_of(model: pin.Model, foot: str, place: Place) -> Limb:
    """The limb of a pin model that ends in the frame ``foot``, on the model's base.

    A continuous joint gets the limits ±π. Raises NotFound where there is no such frame, InvalidRobot for joints that
    neither turn about nor slide along one axis.
    """
    if not model.existFrame(foot):
        raise NotFound(f"{model.name} has no frame {foot!r}")
    frame = model.frames[model.getFrameId(foot)]
    chain, joint = [], frame.parentJoint
    while joint:
        chain.insert(0, joint)
        joint = model.parents[joint]
    if not chain:
        raise InvalidRobot(f"{foot} is fixed to the base: no joint moves it")
    axes, slides, lower, upper = [], [], [], []
    for joint in chain:
        axis, kind, low, high = _joint(model, joint)
        axes.append(axis)
        slides.append(kind)
        lower.append(low)
        upper.append(high)
    placements = [model.jointPlacements[joint].homogeneous for joint in chain] + [frame.placement.homogeneous]
    return Limb(
        tuple(model.names[joint] for joint in chain),
        np.array(placements),
        np.array(axes),
        np.array(slides),
        np.array(lower),
        np.array(upper),
        place,
    )


def _joint(model: pin.Model, joint: int) -> tuple[Array, bool, float, float]:
    """Axis, whether it slides, lower and upper limit."""
    moves, at = model.joints[joint], model.idx_qs[joint]
    name = moves.shortname()
    if moves.nv != 1:
        raise InvalidRobot(f"{model.names[joint]} moves in {moves.nv} ways at once; joints of limbs move in one")
    data = moves.createData()
    moves.calc(data, pin.neutral(model))
    motion = np.asarray(data.S).reshape(6)
    slides = bool(np.linalg.norm(motion[3:]) < 0.5)
    axis = motion[:3] if slides else motion[3:]
    if moves.nq == 2 or "RUB" in name:  # continuous: pin keeps cosine and sine
        return axis, slides, -np.pi, np.pi
    return axis, slides, float(model.lowerPositionLimit[at]), float(model.upperPositionLimit[at])
