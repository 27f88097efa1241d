"""What sessions there are in a working folder, without opening them."""

import json
from collections.abc import Sequence
from pathlib import Path

from footfall.core.errors import FootFallError, NotFound
from footfall.io.bundles import ARTIFACTS, EVENTS, SESSION
from footfall.session.log.event import RENAMED
from footfall.session.storage.databases import log_name, looking
from footfall.session.storage.head import HEAD
from footfall.session.storage.interface import Listed
from footfall.session.storage.plain_log import has_plain_log


def found_sessions(folder: Path) -> dict[str, Listed | str]:
    """Name → session, of all that the database or a folder stands for; what is wrong, where one can't be read."""
    logged: dict[str, Listed | str] = {}
    problem = f"its events are not in {log_name(folder)}, which was removed or replaced; put it back from a backup"
    try:
        with looking(folder) as log:
            logged = {one.id: one for one in log.sessions()}
    except FileNotFoundError:
        pass
    except (FootFallError, OSError) as err:
        problem = err.message if isinstance(err, FootFallError) else str(err)
    folders = {path.name: path for path in folder.iterdir() if is_session_folder(path)}
    found: dict[str, Listed | str] = {name: f"its folder {name} is missing" for name in logged.keys() - folders.keys()}
    for name, path in folders.items():
        found[name] = _plain(path) if has_plain_log(path) else logged.get(name, problem)
    return found


def chosen_sessions(folder: Path, names: Sequence[str]) -> dict[str, Listed | str]:
    """As :func:`found_sessions`, of those that are named (none: of all), in the order of their names.

    Raises NotFound where there is no such folder or session.
    """
    if not folder.is_dir():
        raise NotFound(f"there is no folder {folder}")
    found = found_sessions(folder)
    unknown = [name for name in names if name not in found]
    if unknown:
        raise NotFound(f"there is no session {', '.join(unknown)} in {folder}")
    return {name: found[name] for name in sorted(set(names) or found)}


def is_session_folder(path: Path) -> bool:
    """Whether a folder is, or was, the one of a session."""
    return not path.name.startswith(".") and any((path / name).exists() for name in (HEAD, EVENTS, ARTIFACTS))


def _plain(path: Path) -> Listed | str:
    """A session whose log is still a plain file."""
    try:
        about = json.loads((path / SESSION).read_bytes())
        events, renamed = 0, None
        with (path / EVENTS).open("rb") as log:
            for line in log:
                events += 1
                if RENAMED.encode() in line and (event := json.loads(line))["type"] == RENAMED:
                    renamed = dict(event["payload"])
        return Listed(path.name, dict(about), events, None, renamed)
    except (OSError, ValueError, TypeError, LookupError) as err:
        return str(err)
