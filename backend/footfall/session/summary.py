"""A session as plain JSON, for a page that opens."""

from dataclasses import asdict
from typing import Any, cast

import numpy as np

from footfall.core.value import fields_of
from footfall.planning.body.body_shift import BodyShift, PredictedState
from footfall.session.answers.choices import FootfallAnswer
from footfall.session.answers.plans import EndsAnswer
from footfall.session.answers.sessions import SessionAnswer, ShiftAnswer, TerrainInSummary
from footfall.session.parts import SessionParts
from footfall.session.products.kinds import KINDS
from footfall.session.products.snapshot_age import latest_look, seen_at
from footfall.terrain.dem import Dem


def summary(session: SessionParts, loop: dict[str, Any] | None) -> SessionAnswer:
    """Everything about a session but the content of its values, which are named by digest. loop: its latest walk."""
    state, up_to_date, choices = session.state, session.fits.up_to_date(), session.choices.now
    answer = {
        "id": session.id,
        "name": state.name,
        "robot": {"name": state.robot_name, "digest": state.robot},
        "events": len(session.events()),
        "state": state.state,
        "what_if": _what_if(session),
        "after": _after(session),
        "ends": _ends(session),
        **{kind.name: state.newest(kind) for kind in KINDS.values() if kind.is_answer},
        "snapshot": state.snapshot,
        "pairs": _pairs(session),
        "look": latest_look(session, session.rover),
        "dem": state.dem,
        "terrain": _terrain(session),
        "can_undo_terrain": bool(state.terrain_history),
        "maps": dict(state.maps),
        "maps_current": {leg: fit["fits"] for leg, fit in up_to_date["maps"].items()},
        "up_to_date": up_to_date,
        "footfall": None if choices.footfall is None else fields_of(choices.footfall),
        "footfall_answer": _footfall_answer(session),
        "points": None if choices.points is None else fields_of(choices.points),
        "hand": session.hand.as_dict(),
        **session.choices.undoable,
        "plan": {
            "digest": state.plan,
            "status": state.plan_status,
            "reason": state.plan_reason,
            "compared": [one.plan for one in state.alternatives],
            "doubt": session.plans.doubt(),
        },
        "execution": {
            "digest": state.execution,
            "status": state.execution_status,
            "reason": state.execution_reason,
        },
        "queue": session.queues.answer(),
        "joint_scale": state.joint_scale,
        "way_of_commands": asdict(session.executions.way_of_commands()),
        "sequence": state.sequence,
        "commands_carried_out": session.review.commands_carried_out,
        "to_command": session.review.to_command,
        "commands_of_another_plan": session.review.commands_of_another_plan,
        "played": session.review.played,
        "planned_for": session.review.planned_for,
        "walking": session.walks.walking_answer(),
        "can_undo": bool(state.sequence_history),
        "can_redo": bool(state.sequence_ahead),
        "exports": [fields_of(one) for one in state.exports],
        "stop": fields_of(state.stop),
        "gate": session.commands.gate,
        "conn": session.commands.conn,
        "run": session.commands.run,
        "commands": [fields_of(one) for one in state.commands],
        "notes": [fields_of(one) for one in state.notes],
        "view": asdict(choices.view),
        "link": session.rover.link.as_dict(),
        "jobs": [job.as_dict() for job in session.jobs],
        "plan_matches_rover": session.review.plan_matches_rover(),
        "unrecorded": session.unrecorded,
        "walk_loop": loop,
    }
    return cast(SessionAnswer, answer)  # its members of each kind have names that no type can say


def _what_if(session: SessionParts) -> ShiftAnswer | None:
    """The shift that the planning state has against how the rover stands; None where that is what it is."""
    if session.state.what_if is None or session.state.state is None:
        return None
    shifted = session.typed(PredictedState, session.state.state)
    asked = shifted.provenance.settings
    dx, dy, dz, droll, dpitch, dyaw = (asked if isinstance(asked, BodyShift) else BodyShift()).vector.tolist()
    return {"dx": dx, "dy": dy, "dz": dz, "droll": droll, "dpitch": dpitch, "dyaw": dyaw}


def _after(session: SessionParts) -> str | None:
    """The plan or sequence from whose end it is planned; None where that is not so."""
    if session.state.what_if is None or session.state.state is None:
        return None
    return session.typed(PredictedState, session.state.state).provenance.parents.get("after")


def _ends(session: SessionParts) -> EndsAnswer:
    """What it would be gone on from, and what it is planned from the end of; None: nothing."""
    go_on, after = session.plans.planned_end(), _after(session)
    return {
        "go_on": None if go_on is None else session.plans.end_answer(go_on),
        "after": None if after is None else session.plans.end_answer(after),
    }


def _pairs(session: SessionParts) -> list[str]:
    """Names of the pairs of the present snapshot."""
    for event in reversed(session.events()):
        if event.type == "snapshot_taken":
            return list(event.payload["pairs"])
    return []


def _terrain(session: SessionParts) -> TerrainInSummary | None:
    """What the present terrain is, how much of it is known (0…1), since when it is it, and when it was seen last."""
    digest = session.state.dem
    if digest is None:
        return None
    dem = session.typed(Dem, digest)
    made = next(event.time for event in reversed(session.events()) if event.payload.get("digest") == digest)
    geometry = dem.geometry
    return {
        "name": dem.name,
        "rows": geometry.rows,
        "cols": geometry.cols,
        "resolution": geometry.resolution,
        "bounds": list(geometry.bounds),
        "known": float(np.isfinite(dem.heights).mean()),
        "left_out": dict(dem.left_out),
        "time": made,
        "seen": seen_at(session, digest),
    }


def _footfall_answer(session: SessionParts) -> FootfallAnswer | None:
    """What terrain and maps say now of the chosen footfall."""
    chosen = session.choices.now.footfall
    return None if chosen is None or session.state.dem is None else session.maps.footfall_answer(chosen)
