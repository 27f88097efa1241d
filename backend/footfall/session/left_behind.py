"""The stop that an earlier run of FootFall left in force: whoever starts anew must not lose it.

Which session held the rover is told by a mark in its folder, as times in the logs say nothing once a clock jumped.
"""

import logging
from pathlib import Path

from footfall.core.errors import FootFallError
from footfall.session.log.event import event_of
from footfall.session.log.fold import fold_all
from footfall.session.log.fold_commands import StopRecord
from footfall.session.storage.artifact_folder import sync_folder
from footfall.session.storage.databases import sole_writer
from footfall.session.storage.head import HELD
from footfall.session.storage.listing import found_sessions
from footfall.session.storage.store import read_session

_log = logging.getLogger(__name__)


def mark_held(folder: Path) -> bool:
    """Mark a session as the one that holds the rover; whether that could be written, which is logged."""
    try:
        (folder / HELD).touch()
        sync_folder(folder)
    except OSError as err:
        _log.error("that session %s holds the rover is not written: %s", folder.name, err)
        return False
    return True


def unmark_held(folder: Path) -> None:
    """Another session holds the rover, and its stop."""
    try:
        (folder / HELD).unlink(missing_ok=True)
    except OSError as err:
        _log.error("that session %s holds the rover no more is not written: %s", folder.name, err)


def unmark_left(folder: Path) -> None:
    """As :func:`unmark_held`, of a session that an earlier run left, unless another server has it open."""
    try:
        with sole_writer(folder):
            unmark_held(folder)
    except (FootFallError, OSError) as err:
        _log.warning("session %s is still marked as the one that holds the rover: %s", folder.name, err)


def left_behind(folder: Path) -> tuple[str, ...]:
    """Ids of the sessions of a working folder that held the rover when FootFall ended: one, after a crash maybe two.

    Where none is marked, as versions before left them, it is taken for the one that was written to last.
    """
    marked = sorted(path.parent.name for path in folder.glob(f"[!.]*/{HELD}"))
    if marked:
        return tuple(marked)
    times = [
        (found.latest, name)
        for name, found in found_sessions(folder).items()
        if not isinstance(found, str) and found.latest is not None
    ]
    return (max(times)[1],) if times else ()


def stop_left_in(folder: Path) -> StopRecord:
    """The stop as the log of the session in ``folder`` has it; one that is in force where the log can't be read."""
    try:
        return fold_all(event_of(record) for record in read_session(folder).records).stop
    except (FootFallError, OSError) as err:
        _log.warning("whether session %s left a stop in force can't be told: %s", folder.name, err)
        return StopRecord(latched=True, reason="its log can't be read, so a stop is taken to be in force")
