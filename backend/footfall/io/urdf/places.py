"""Where the mesh files of a URDF lie, and that none lies outside the folders it may read."""

from collections.abc import Sequence
from pathlib import Path
from urllib.parse import unquote

from footfall.core.errors import InvalidRobot, NotFound

PACKAGE, FILE = "package://", "file://"
GIVEN = "with --packages, or among the packages of its robot.toml"
"""How a folder is given."""


def place_of(address: str, urdf: Path, folders: Sequence[Path]) -> Path:
    """The file that a mesh address names.

    ``package://NAME/REST`` is looked for in the given folders, then upward from the URDF: a folder NAME, or one inside.
    Other addresses are paths from the URDF's folder. A file must lie in its package, in a given folder, or in the
    robot's own: the URDF's folder or the one above. Raises InvalidRobot for others, NotFound where there is no file.
    """
    if address.startswith(PACKAGE):
        return _in_package(address, urdf, folders)
    if "://" in address and not address.startswith(FILE):
        scheme = address.split("://")[0]
        raise InvalidRobot(f"{address}: {scheme} addresses are not read; package://NAME/… or a path would be right")
    here = urdf.resolve().parent
    path = (here / unquote(address.removeprefix(FILE))).resolve()
    homes = [here, here.parent, *(folder.resolve() for folder in folders)]
    if not any(path.is_relative_to(home) for home in homes if home != Path(home.anchor)):
        raise InvalidRobot(f"{address} lies outside {here.parent}; give its folder {GIVEN}", file=address)
    if not path.is_file():
        raise NotFound(f"{address} is missing: there is no {path}", file=address)
    return path


def _in_package(address: str, urdf: Path, folders: Sequence[Path]) -> Path:
    package, _, rest = unquote(address.removeprefix(PACKAGE)).partition("/")
    if package in ("", ".", ".."):
        raise InvalidRobot(f"{address} names no package; package://NAME/… would be right", file=address)
    looked = [*(folder.resolve() for folder in folders), *urdf.resolve().parents]
    for folder in looked:
        for home in (folder, folder / package) if folder.name == package else (folder / package,):
            path = (home / rest).resolve()
            if path.is_file() and not path.is_relative_to(home.resolve()):
                raise InvalidRobot(f"{address} leads out of its package {home}", file=address)
            if path.is_file():
                return path
    raise NotFound(
        f"{address} is missing: no folder {package} with {rest} above {urdf.resolve().parent}"
        f"{' or in ' + ', '.join(map(str, folders)) if folders else ''}; give the folder it lies in {GIVEN}",
        file=address,
    )
