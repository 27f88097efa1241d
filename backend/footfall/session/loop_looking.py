"""How a walk in a closed loop looks: by images, and by commands that lift a leg so that images show what it hides."""

import time
from collections.abc import Callable
from typing import NamedTuple

from footfall.core.errors import Conflict, FootFallError
from footfall.planning.step.problem import PlanResult, StepSettings
from footfall.sequence.commands import Sequence
from footfall.session.core import present
from footfall.session.jobs.job import Job
from footfall.session.parts import SessionParts
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

IMAGES_WITHIN = 600.0
"""A rover that sent no images after this sends none [s]."""


class UpAndBack(NamedTuple):
    """sequence: digest of the commands; up: after how many of its rows the leg is up."""

    sequence: str
    up: int


def take_images(
    live: SessionParts, pairs: tuple[str, ...] | None, until: Callable[[Callable[[], bool], str], None]
) -> None:
    """Ask the rover for images and wait for them; ``until`` waits for what is told. Raises Conflict where none come."""
    before = live.state.snapshot
    live.rover.request_images(pairs)
    since = time.monotonic()
    until(lambda: live.state.snapshot != before or time.monotonic() - since > IMAGES_WITHIN, "images")
    if live.state.snapshot == before:
        raise Conflict(f"the rover sent no images within {IMAGES_WITHIN:z.0f} s")


def up_and_back(live: SessionParts, leg: int, finish: Callable[[Job, str], str]) -> UpAndBack | str:
    """The commands that lift a leg straight up from where it stands and put it back, or why there are none.

    finish: waits for a job, told what it makes, and gives its result's digest. Raises Conflict where there is no
    ground, or no telemetry.
    """
    from footfall.maps.standing import contacts
    from footfall.planning.looking.how_to_see import LIFTED

    state = live.typed(RobotState, live.stances.freeze())
    dem = live.typed(Dem, present(live.state.dem, "there is no terrain any more"))
    x, y, _ = contacts(live.robot, dem, state.posture, state.T_site_base, [leg]).points[0]
    try:
        job = live.plans.step(leg, (float(x), float(y)), StepSettings(lift=LIFTED))
        plan = finish(job, f"the way of leg {leg} up and back")
        found = live.typed(PlanResult, plan)
        if found.plan is None:
            return f"leg {leg} can't be lifted to look: {found.reason}"
        sequence = live.sequences.make(plan)
    except FootFallError as error:
        return f"leg {leg} can't be lifted to look: {error.message}"
    phases = [one.phase for one in live.typed(Sequence, sequence).commands]
    return UpAndBack(sequence, len(phases) - phases[::-1].index("lift"))
