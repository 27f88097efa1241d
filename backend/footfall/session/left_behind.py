"""The stop that an earlier run of FootFall left in force: whoever starts anew must not lose it."""

import logging
from pathlib import Path

from footfall.core.errors import FootFallError
from footfall.session.log.event import event_of
from footfall.session.log.fold import fold_all
from footfall.session.log.fold_commands import StopRecord
from footfall.session.storage.listing import found_sessions
from footfall.session.storage.store import read_session


def last_session(folder: Path) -> str | None:
    """Id of the session of a working folder that was written to last, None where there is none."""
    times = [
        (found.latest, name)
        for name, found in found_sessions(folder).items()
        if not isinstance(found, str) and found.latest is not None
    ]
    return max(times)[1] if times else None


def stop_left_in(folder: Path) -> StopRecord:
    """The stop as the log of the session in ``folder`` has it; none where the log can't be read, which is logged."""
    try:
        return fold_all(event_of(record) for record in read_session(folder).records).stop
    except (FootFallError, OSError) as err:
        logging.getLogger(__name__).warning(
            "whether session %s left a stop in force can't be told: its log can't be read: %s", folder.name, err
        )
        return StopRecord()
