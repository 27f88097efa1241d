"""Tables that choose gaits, as files: a GaitPolicy is one artifact, the same bytes for the same table."""

from functools import cache
from pathlib import Path

from footfall.core.errors import InvalidBundle
from footfall.io.artifacts import decode, encode
from footfall.io.whole_files import write_whole
from footfall.planning.choice.choice_settings import ChoiceSettings
from footfall.planning.choice.policy import GaitPolicy, require_made_for
from footfall.resources import robot_assets_folder

SHIPPED = "gaits.npz"
"""The name of a table beside the description of the robot that it goes with."""


def read_policy(path: Path, robot: str | None = None, settings: ChoiceSettings | None = None) -> GaitPolicy:
    """The policy of a file for a robot (digest), None: for whichever it was learned for.

    Raises InvalidBundle where the file holds none, InvalidInput where it was made for another robot, version or, where
    they are given, settings.
    """
    policy = decode(path.read_bytes(), name=path.name)
    if not isinstance(policy, GaitPolicy):
        raise InvalidBundle(f"{path.name} holds {type(policy).__name__}, no policy", file=path.name)
    require_made_for(policy, robot or policy.robot, settings)
    return policy


@cache
def shipped_policy(robot: str) -> GaitPolicy | None:
    """The table that ships with a robot (digest), None where none does."""
    tables = (read_policy(path) for path in sorted(robot_assets_folder().glob(f"*/{SHIPPED}")))
    return next((table for table in tables if table.robot == robot), None)


def write_policy(path: Path, policy: GaitPolicy) -> None:
    """Write a policy."""
    write_whole(path, encode(policy))
