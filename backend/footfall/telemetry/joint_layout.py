"""Which legs a robot has and which joints each of them, by name: what postures, commands and files of them go by."""

import re
from itertools import accumulate, pairwise

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidRobot
from footfall.core.value import Value, value
from footfall.telemetry.command_kinds import CommandKind

_ATHLETES = re.compile(r"leg(\d+)_(\w+)_joint")


def joint_in_words(name: str) -> str:
    """A joint as persons call it.

    Args:
        name: as the description has it.

    Returns:
        Of ATHLETE's build such as ``leg 2 knee pitch``; the name itself of a robot that others described.
    """
    found = _ATHLETES.fullmatch(name)
    return f"leg {found[1]} {found[2].replace('_', ' ')}" if found else name


@value
class JointLayout(Value):
    """legs: their names. joints: of each leg the names of its joints, from the base to the foot.

    sliding: which of the joints slide, so that their places are metres, not radians.
    """

    legs: tuple[str, ...]
    joints: tuple[tuple[str, ...], ...]
    sliding: tuple[str, ...] = ()

    def check(self) -> None:
        """Raises InvalidRobot where a leg lacks a name or joints, or where two legs or two joints have one name."""
        names = self.joint_names
        if len(self.legs) != len(self.joints) or not all(self.joints):
            raise InvalidRobot("each leg needs a name and joints")
        if len(set(self.legs)) < len(self.legs) or len(set(names)) < len(names) or not set(self.sliding) <= set(names):
            raise InvalidRobot("no two legs and no two joints have one name, and what slides is one of the joints")

    @property
    def joint_names(self) -> tuple[str, ...]:
        """All joints, leg after leg: the order of a posture."""
        return tuple(name for own in self.joints for name in own)

    @property
    def slices(self) -> tuple[slice, ...]:
        """Where the joints of each leg are in a posture."""
        return tuple(slice(a, b) for a, b in pairwise(accumulate(map(len, self.joints), initial=0)))

    def moved(self, kind: CommandKind, leg: int | None) -> slice:
        """Which joints of a posture a command of that kind moves.

        leg: the one that it names; nothing is moved by a command of a leg that there is not.
        """
        if kind.moves_all:
            return slice(0, len(self.joint_names))
        if kind.names_leg and leg is not None and 0 <= leg < len(self.legs):
            return self.slices[leg]
        return slice(0, 0)

    def by_leg(self, posture: NDArray[np.float64]) -> list[tuple[int, NDArray[np.float64]]]:
        """The legs, each with its joints of a posture (joints,)."""
        return [(leg, posture[own]) for leg, own in enumerate(self.slices)]
