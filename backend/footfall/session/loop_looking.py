"""How a walk in a closed loop looks: by images, and by commands that lift a leg so that images show what it hides."""

import time
from collections.abc import Callable
from typing import NamedTuple

from footfall.core.errors import Conflict, FootFallError
from footfall.planning.step.problem import PlanResult, StepSettings
from footfall.planning.walk.problem import WalkSettings
from footfall.sequence.commands import Sequence
from footfall.session.answers.sessions import SinceThen
from footfall.session.core import present
from footfall.session.jobs.job import Job
from footfall.session.parts import SessionParts
from footfall.session.products.snapshot_age import moved_since
from footfall.telemetry.images import Snapshot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.terrain_settings import TerrainSettings

Until = Callable[[Callable[[], bool], str], None]
IMAGES_WITHIN = 600.0
"""A rover that sent no images after this sends none [s]."""


class UpAndBack(NamedTuple):
    """sequence: digest of the commands; up: after how many of its rows the leg is up."""

    sequence: str
    up: int


def take_images(live: SessionParts, pairs: tuple[str, ...] | None, until: Until) -> None:
    """Ask the rover for images of where it stands, and wait for them; ``until`` waits for what is told.

    Others may come, for which somebody asked before it moved: the rover takes one request at a time, so it is asked
    again. Raises Conflict where none come.
    """
    since, others = time.monotonic(), ""
    while time.monotonic() - since <= IMAGES_WITHIN:
        before = live.state.snapshot
        live.rover.request_images(pairs)
        until(lambda before=before: live.state.snapshot != before or time.monotonic() - since > IMAGES_WITHIN, "images")
        if live.state.snapshot != before:
            found = _moved_since(live, until)
            if not found["moved"]:
                return
            others = f" of where it stands: {found['reason']}"
    raise Conflict(f"the rover sent no images within {IMAGES_WITHIN:z.0f} s{others}")


def build_map(live: SessionParts, settings: TerrainSettings, finish: Callable[[Job, str], str]) -> None:
    """Build the ground of the newest images; once more where somebody has changed the map meanwhile.

    finish: waits for a job, told what it makes. Raises what the job ends with.
    """
    while True:
        before = live.state.dem
        try:
            finish(live.terrains.build(settings), "the ground made of the images")
            return
        except Conflict:
            if live.state.dem == before:
                raise


def _moved_since(live: SessionParts, until: Until) -> SinceThen:
    """Whether the newest images show how the rover stands, by telemetry that is new."""
    taken = live.typed(Snapshot, present(live.state.snapshot, "there are no images")).state
    until(lambda: moved_since(live, live.rover, taken)["moved"] is not None, "telemetry that is new")
    return moved_since(live, live.rover, taken)


def up_and_back(live: SessionParts, leg: int, walk: WalkSettings, finish: Callable[[Job, str], str]) -> UpAndBack | str:
    """The commands that lift a leg straight up from where it stands and put it back, or why there are none.

    walk: how the loop's walks are planned; finish: waits for a job, told what it makes, and gives its result's digest.
    Raises Conflict where there is no ground, or no telemetry.
    """
    from footfall.maps.standing import contacts
    from footfall.planning.looking.how_to_see import LIFTED

    if walk.payload_mass is not None:
        return f"leg {leg} can't be lifted to look: no step knows the {walk.payload_mass:g} kg that its walk carries"
    state = live.typed(RobotState, live.stances.freeze())
    dem = live.typed(Dem, present(live.state.dem, "there is no terrain any more"))
    x, y, _ = contacts(live.robot, dem, state.posture, state.T_site_base, [leg]).points[0]
    try:
        asked = StepSettings(lift=LIFTED, conservative=walk.support == "required", friction=walk.friction)
        job = live.plans.step(leg, (float(x), float(y)), asked)
        plan = finish(job, f"the way of leg {leg} up and back")
        found = live.typed(PlanResult, plan)
        if found.plan is None:
            return f"leg {leg} can't be lifted to look: {found.reason}"
        sequence = live.sequences.make(plan)
    except FootFallError as error:
        return f"leg {leg} can't be lifted to look: {error.message}"
    phases = [one.phase for one in live.typed(Sequence, sequence).commands]
    return UpAndBack(sequence, len(phases) - phases[::-1].index("lift"))
