"""Whether images still show where the rover is: when they came, and whether it has moved since."""

import numpy as np

from footfall.session.answers.sessions import LookAnswer, SinceThen
from footfall.session.core import SessionCore
from footfall.session.gate.checks import STALE_AFTER, UNHEARD_SINCE
from footfall.session.products.up_to_date import SENT
from footfall.session.rover.linked import LinkedRover
from footfall.telemetry.joint_layout import joint_in_words
from footfall.telemetry.state import RobotState


def taken_at(core: SessionCore, snapshot: str) -> float | None:
    """When a snapshot, by its digest, reached the server [s since 1970]; None where it never came as one."""
    return next(
        (
            event.time
            for event in reversed(core.events())
            if event.type == "snapshot_taken" and event.payload.get("digest") == snapshot
        ),
        None,
    )


def seen_at(core: SessionCore, terrain: str) -> float:
    """When the newest images in a terrain reached the server [s since 1970]; of one without, since when it is there."""
    made = next(
        event
        for event in reversed(core.events())
        if event.payload.get("digest") == terrain and event.type != "terrain_undone"
    )
    parents = made.payload.get("parents", {})
    if "dem" in parents:
        return seen_at(core, parents["dem"])
    taken = taken_at(core, parents["snapshot"]) if "snapshot" in parents else None
    return made.time if taken is None else taken


def moved_since(core: SessionCore, rover: LinkedRover, then: RobotState) -> SinceThen:
    """``moved``: whether the rover stands otherwise than then, None where that is not known; ``reason``."""
    frame, age = rover.frame, rover.link.age
    unknown = ""
    if frame is None or age is None:
        unknown = "the rover has sent no telemetry yet"
    elif rover.link.age_since_connected is None:
        unknown = UNHEARD_SINCE
    elif age > STALE_AFTER:
        unknown = f"the latest telemetry is {age:z.0f} s old"
    if unknown or frame is None:
        return {"moved": None, "reason": unknown}
    now = frame.state
    found = core.difference(then.posture, then.T_site_base, now)
    what = found.beyond(*SENT)
    turned = f"moved by {found.turned:+z.3f} m" if found.slides else f"turned by {np.degrees(found.turned):+z.1f}°"
    reasons = {
        "": "",
        "chassis": f"the chassis has moved by {found.moved:z.2f} m since",
        "joint": f"{joint_in_words(found.joint)} has {turned} since",
    }
    return {"moved": bool(what), "reason": reasons[what]}


def latest_look(core: SessionCore, rover: LinkedRover) -> LookAnswer | None:
    """Of the newest images: ``taken``, when they reached the server [s since 1970], and :func:`moved_since` then; None
    before the first.
    """
    for event in reversed(core.events()):
        if event.type == "snapshot_taken":
            return {"taken": event.time, **moved_since(core, rover, core.typed(RobotState, event.payload["state"]))}
    return None
