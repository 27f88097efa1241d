"""Every error that FootFall raises, as one tree.

::

    FootFallError
    ├── InvalidInput          what a caller or a file gave is wrong; says what would be right
    │   ├── InvalidTerrain
    │   ├── InvalidImages
    │   ├── InvalidRobot
    │   ├── InvalidTelemetry
    │   ├── InvalidSequence
    │   └── InvalidBundle
    ├── NotFound              a named thing does not exist
    ├── Conflict              the request does not fit the present state
    │   ├── CommandRefused    the command gate said no
    │   └── Busy              too much waits already; the same request may pass later
    ├── Cancelled             the caller asked the work to stop
    ├── WorkerLost            a worker process died under a job
    └── NotRecorded           the store can't take it now, so it was not done

"No plan found" is not an error: it is a result with a reason.
"""

from typing import Any

from footfall.core.json_object import JsonObject


class FootFallError(Exception):
    """Base of all errors. ``details`` carries the offending data, ready for JSON.

    ``kind`` is a stable name: the REST interface makes its problem ``type`` from it.
    """

    kind = "error"

    def __init__(self, message: str, /, **details: Any) -> None:
        super().__init__(message)
        self.message = message
        self.details = details

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuild, (type(self), self.message, self.details)


def _rebuild(cls: type[FootFallError], message: str, details: JsonObject) -> FootFallError:
    return cls(message, **details)


class InvalidInput(FootFallError):
    """What was given is wrong; the message says what would be right."""

    kind = "invalid-input"


class InvalidTerrain(InvalidInput):
    """A terrain file, array or parameter can't be used."""

    kind = "invalid-terrain"


class InvalidImages(InvalidInput):
    """An image pair or its camera model can't be used."""

    kind = "invalid-images"


class InvalidRobot(InvalidInput):
    """A robot description can't be used."""

    kind = "invalid-robot"


class InvalidTelemetry(InvalidInput):
    """A message of the rover link can't be used."""

    kind = "invalid-telemetry"


class InvalidSequence(InvalidInput):
    """A command sequence or an edit of one breaks a rule."""

    kind = "invalid-sequence"


class InvalidBundle(InvalidInput):
    """A session bundle is damaged or of an unknown version."""

    kind = "invalid-bundle"


class NotFound(FootFallError):
    """A named thing does not exist."""

    kind = "not-found"


class Conflict(FootFallError):
    """The request does not fit the present state."""

    kind = "conflict"


class CommandRefused(Conflict):
    """The command gate said no; ``details`` names the check that failed."""

    kind = "command-refused"


class Busy(Conflict):
    """Too much waits already; the same request may pass later. ``details`` has ``retry_after`` [s]."""

    kind = "busy"


class Cancelled(FootFallError):
    """The caller asked the work to stop."""

    kind = "cancelled"


class WorkerLost(FootFallError):
    """A worker process died under a job."""

    kind = "worker-lost"


class NotRecorded(FootFallError):
    """The store can't take it now, so it was not done. ``details``: ``no_room``, whether the disk is full."""

    kind = "not-recorded"
