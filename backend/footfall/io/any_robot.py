"""Reading any robot: those that ship with FootFall, by name, and ones that others described, by path."""

import tomllib
from pathlib import Path
from typing import Literal, overload

from footfall.core.errors import InvalidRobot
from footfall.core.misread import Unreadable
from footfall.core.written import utf8_of
from footfall.io.robot_files import load_robot as load_shipped
from footfall.io.robot_files import robot_toml
from footfall.io.urdf.proposed import Proposed, read_proposed
from footfall.robot.legged.finding import Grade
from footfall.robot.legged.judge_legs import judge_mass
from footfall.robot.legged.judge_tree import judge_tree
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.model import Robot

OF_ROBOT, OF_LEGS = ("mass", "mesh size", "mass_check"), ("effort", "velocity")
"""Checks without which a robot is not loaded: of all of it, and of the joints of its legs. What else is unusable is
refused by name where it is asked for, or counts for nothing in statics."""
MOST_TOLD = 4
"""Faults that a refusal names."""


@overload
def load_robot(name_or_path: Literal["athlete"]) -> Robot: ...
@overload
def load_robot(name_or_path: str | Path) -> Robot | LeggedRobot: ...
def load_robot(name_or_path: str | Path) -> Robot | LeggedRobot:
    """Load a robot of those that ship with FootFall, or one that others described.

    Args:
        name_or_path: its name ("athlete", "ambler"), or the path of a description file, of the folder that holds one,
            which may be a robot.toml beside a URDF.

    Returns:
        A Robot of ATHLETE's build, or a LeggedRobot where its file names a URDF.

    Raises:
        NotFound: there is no robot of that name, and no file at that path.
        InvalidRobot: its description can't be used; the message says what would be right.
    """
    return load_legged(name_or_path) if is_legged(name_or_path) else load_shipped(name_or_path)


def load_legged(path: str | Path) -> LeggedRobot:
    """A robot by its name, or the path of its robot.toml. Raises NotFound and InvalidRobot as :func:`load_robot`."""
    read = read_proposed(robot_toml(path))
    _require_usable(read)
    return LeggedRobot(read.model, read.postures, read.clearances, read.always, read.cameras)


def is_legged(name_or_path: str | Path) -> bool:
    """Whether a file is TOML with a ``urdf`` in it, which a robot.toml has and ATHLETE's description does not."""
    path = robot_toml(name_or_path)
    if path.suffix != ".toml" or not path.is_file():
        return False
    try:
        return "urdf" in tomllib.loads(utf8_of(path.read_bytes()))
    except (tomllib.TOMLDecodeError, Unreadable):
        return False


def _require_usable(read: Proposed) -> None:
    """Raises InvalidRobot for what nobody should plan with, in the words of `footfall robot check`."""
    tree = read.model.tree
    joints = {name for leg in read.model.legs for name in leg.joints}
    faults = [
        f"{one.where}: {one.text}"
        for one in (*judge_tree(tree), judge_mass(tree, read.mass_check))
        if one.grade is Grade.UNUSABLE
        and (one.check_name in OF_ROBOT or (one.check_name in OF_LEGS and one.where in joints))
    ]
    if faults:
        more = f"; and {len(faults) - MOST_TOLD} more, see footfall robot check" if len(faults) > MOST_TOLD else ""
        raise InvalidRobot(f"{tree.name} can't be used: {'; '.join(faults[:MOST_TOLD])}{more}", faults=faults)
