"""Whether the server lives, and whether it can do its work: for whoever starts, watches and restarts it."""

import os
import secrets
import shutil
from collections.abc import Callable
from typing import TypedDict

from fastapi import Request, Response

from footfall.api.access import AllSessions
from footfall.api.bodies.answer_models import answer_model
from footfall.api.routing import Routes
from footfall.core.errors import FootFallError
from footfall.session.access.accounts import Accounts, AccountsUnreadable
from footfall.session.registry import Sessions
from footfall.session.storage.databases import has_log, looking

router = Routes(tags=["health"])

_NOBODY = ""
"""A name that no session has."""

LEAST_FREE = 256 << 20
"""Disk space below which the server is not ready [bytes]: some minutes of recording and terrains."""


class Alive(TypedDict):
    """That there is an answer is the answer."""

    live: bool


class Checked(TypedDict):
    """One thing that was looked at; text: what was found, or what to do."""

    what: str
    ok: bool
    text: str


class Ready(TypedDict):
    """Whether all of it is well."""

    ready: bool
    checks: list[Checked]


@router.get("/health/live")
async def live() -> Alive:
    """The server answers; where it does not, start it again."""
    return {"live": True}


@router.get(
    "/health/ready", responses={503: {"model": answer_model(Ready), "description": "Not ready; the checks say why."}}
)
def ready(sessions: AllSessions, request: Request, response: Response) -> Ready:
    """Whether work can be done: workers, the folder of the sessions, disk space, the log, accounts. 503 where not."""
    checks = [_checked(what, look, sessions) for what, look in _CHECKS.items()]
    if (accounts := request.app.state.accounts) is not None:
        checks.append(_checked("accounts", lambda _: _readable(accounts), sessions))
    well = all(one["ok"] for one in checks)
    response.status_code = 200 if well else 503
    return {"ready": well, "checks": checks}


def _checked(what: str, look: Callable[[Sessions], str], sessions: Sessions) -> Checked:
    try:
        return {"what": what, "ok": True, "text": look(sessions)}
    except FootFallError as error:
        return {"what": what, "ok": False, "text": error.message}
    except (OSError, RuntimeError, *AccountsUnreadable) as error:
        return {"what": what, "ok": False, "text": str(error)}


def _workers(sessions: Sessions) -> str:
    if not sessions.jobs.ready:
        raise RuntimeError("the workers have ended; start the server again")
    return "take jobs"


def _writable(sessions: Sessions) -> str:
    probe = sessions.folder / f".ready-{secrets.token_hex(4)}"
    try:
        with open(probe, "xb") as file:
            file.write(b"ready")
            file.flush()
            os.fsync(file.fileno())
    finally:
        probe.unlink(missing_ok=True)
    return "can be written"


def _space(sessions: Sessions) -> str:
    free = shutil.disk_usage(sessions.folder).free
    if free < LEAST_FREE:
        raise RuntimeError(f"{free / 2**20:z.0f} MiB are free, at least {LEAST_FREE >> 20} MiB are needed; make room")
    return f"{free / 2**30:z.1f} GiB free"


def _recorded(sessions: Sessions) -> str:
    pending = sum(one.unrecorded for one in sessions.opened())
    if pending:
        raise RuntimeError(f"{pending} events can't be written; see the disk and the log")
    if sessions.opened() or has_log(sessions.folder):
        with looking(sessions.folder) as log:
            # not all that are stored: there may be thousands
            for session in [one.id for one in sessions.opened()] or [_NOBODY]:
                log.about(session)
    return "every event is written"


def _readable(accounts: Accounts) -> str:
    accounts.by_token("of nobody", "")
    return "can be read"


_CHECKS: dict[str, Callable[[Sessions], str]] = {
    "workers": _workers,
    "sessions folder": _writable,
    "disk space": _space,
    "event log": _recorded,
}
