"""Reading robot descriptions: those that ship with FootFall, by name, and others, by path."""

import tomllib
from pathlib import Path

from footfall.core.errors import InvalidRobot, NotFound
from footfall.core.misread import Unreadable, place_of
from footfall.core.written import utf8_of
from footfall.resources import robot_assets_folder
from footfall.robot.build import describe
from footfall.robot.description import RobotDescription
from footfall.robot.model import Robot

WORKS_WITH_OWN = (
    "footfall robot check, map, plan step, plan route, plan walk, view, referee and export; "
    "in Python stand, compute_maps, plan_step, plan_walk, plan_route and export"
)
"""What takes robots that others described (io.any_robot)."""
SHIPPED_TOML = ("ambler",)
"""Names of robots that ship as a robot.toml with its URDF, like those that others described."""


def robot_names() -> list[str]:
    """Names of the robots of ATHLETE's build that ship with FootFall."""
    return sorted(path.stem for path in robot_assets_folder().glob("*/*.toml") if path.stem == path.parent.name)


def robot_toml(name_or_path: str | Path) -> Path:
    """Where the robot.toml of a robot of SHIPPED_TOML is, or of a folder that holds one; else the path as it is."""
    if str(name_or_path) in SHIPPED_TOML:
        return robot_assets_folder() / str(name_or_path) / "robot.toml"
    path = Path(name_or_path)
    inside = path / "robot.toml"
    return inside if str(name_or_path) not in robot_names() and inside.is_file() else path


def load_robot(name_or_path: str | Path) -> Robot:
    """A robot by its name ("athlete"), or by the path of a description file or of the folder that holds one.

    Raises NotFound where there is no such robot, InvalidRobot where its description can't be used.
    """
    if str(name_or_path) in robot_names():
        return Robot(read_description(robot_assets_folder() / str(name_or_path) / f"{name_or_path}.toml"))
    return Robot(read_description(name_or_path))


def read_description(path: str | Path) -> RobotDescription:
    """Read a description file (TOML; robot/assets/athlete/athlete.toml explains the format)."""
    path = robot_toml(path)
    if path.is_dir():
        found = sorted(path.glob("*.toml"))
        if len(found) != 1:
            raise InvalidRobot(f"{path} must hold one robot description (.toml); it holds {len(found)}")
        path = found[0]
    if not path.is_file():
        known = ", ".join([*robot_names(), *SHIPPED_TOML])
        raise NotFound(f"there is no robot {str(path)!r}: known by name are {known}; else give a description file")
    if path.suffix != ".toml":
        way = f"; footfall robot init {path} proposes one" if path.suffix.lower() == ".urdf" else ""
        raise InvalidRobot(f"{path.name} is no robot description: FootFall reads .toml{way}", path=str(path))
    try:
        raw = tomllib.loads(utf8_of(path.read_bytes()))
    except (tomllib.TOMLDecodeError, Unreadable) as err:
        raise InvalidRobot(f"{path.name} is not readable TOML{place_of(err)}", path=str(path)) from err
    if "urdf" in raw:
        raise InvalidRobot(
            f"{path.name} describes a robot of your own, and this takes ATHLETE's legs alone; "
            f"with such a robot work {WORKS_WITH_OWN}",
            path=str(path),
        )
    return describe(raw)
