"""How steadily the rover of a session stands: now, and along what is planned.

What judges it loads compiled code, so it loads when first asked.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from footfall.balance.balance_settings import BalanceSettings
from footfall.core.errors import Conflict, NotFound
from footfall.core.value import Value
from footfall.maps.layers import MapSettings
from footfall.planning.step.problem import PlanResult, StepPlan
from footfall.planning.walk.problem import WalkPlan, WalkResult
from footfall.sequence.commands import Sequence
from footfall.session.live import LiveSession
from footfall.session.products.kinds import WALK
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.fusion.on_map import on_map

if TYPE_CHECKING:
    from footfall.maps.support_outlines import Support
    from footfall.sequence.steadiness_course import SteadinessCourse


@dataclass(frozen=True)
class Judged:
    """measured: whether telemetry says so; else it is the state that is planned from. time: of that state [s].

    com: centre of mass, site (3,) [m]; margins: outline → [m], −inf where nothing is held, NaN where not known.
    """

    measured: bool
    time: float
    com: NDArray[np.float64]
    support: "Support"
    margins: dict[str, float]
    friction: float


@dataclass(frozen=True)
class JudgedMotion:
    """least, conservative: what the motion was planned to keep; friction: that it is judged by."""

    motion: StepPlan | WalkPlan | Sequence
    course: "SteadinessCourse"
    friction: float
    least: float
    conservative: bool


def judged(live: LiveSession) -> Judged:
    """The rover as it stands: as telemetry has it, or before it says anything, as is planned from. Raises NotFound."""
    from footfall.balance.payload import loaded
    from footfall.core.frames import apply
    from footfall.maps.support_outlines import bearing, support_of
    from footfall.robot.kinematics import center_of_mass

    state, frame = live.state, live.rover.frame
    dem = None if state.dem is None else live.typed(Dem, state.dem)
    if frame is not None:
        stands = on_map(frame.state, dem)
    elif state.state is not None:
        stands = live.typed(RobotState, state.state)
    else:
        raise NotFound("the rover has sent no telemetry yet, and there is no state to plan from")
    balance = stands_with(live)
    robot = live.robot
    support = support_of(robot, dem, stands.posture, stands.T_site_base, bearing(robot, stands), balance)
    com = apply(stands.T_site_base, loaded(robot, center_of_mass(robot, stands.posture), balance)[1])
    margins = {name: float(found[0]) for name, found in support.margins(com[None, :2]).items()}
    return Judged(frame is not None, stands.time, com, support, margins, balance.friction)


def stands_with(live: LiveSession) -> BalanceSettings:
    """With what the standing rover is judged.

    Friction as in the current maps of the chosen leg, or as delivered; the payload that these were made with, or where
    they name none the present commands.
    """
    from footfall.sequence.steadiness_course import balance_of

    maps = live.maps.shown(live.choices.view.leg)
    settings = None if maps is None else maps.provenance.settings
    said = settings.balance if isinstance(settings, MapSettings) else BalanceSettings()
    carries = said
    if said.payload_mass is None and live.state.sequence is not None:
        commands = live.get(live.state.sequence)
        carries = balance_of(commands) if isinstance(commands, Sequence) else said
    return BalanceSettings(
        friction=said.friction, payload_mass=carries.payload_mass, payload_position=carries.payload_position
    )


def along(live: LiveSession, digest: str) -> JudgedMotion:
    """A plan, a walk or a sequence of the session, on the terrain that it was made on. Raises Conflict, NotFound."""
    from footfall.sequence.steadiness_course import balance_of, course_of

    motion = _motion(live.get(digest), digest)
    made_on = motion.provenance.parents.get("dem")
    if isinstance(motion, Sequence) and (behind := live.state.plan_behind(digest)) is not None:
        made_on = behind.parents["dem"]
    if made_on is None:
        raise Conflict("it names no terrain, so nobody knows what the wheels stand on", digest=digest)
    settings = motion.provenance.settings
    balance = balance_of(motion)
    course = course_of(
        live.robot, live.typed(Dem, made_on), motion, balance, _normal_of_its_slope(live, digest, motion)
    )
    least = float(getattr(settings, "least_margin", 0.0))
    conservative = getattr(settings, "conservative", False) or getattr(settings, "support", "") == "required"
    return JudgedMotion(motion, course, balance.friction, least, bool(conservative))


def _normal_of_its_slope(
    live: LiveSession, digest: str, motion: StepPlan | WalkPlan | Sequence
) -> NDArray[np.float64] | None:
    """(3,) of a walk on a tether, or of commands of one."""
    walk = motion
    if isinstance(motion, Sequence) and motion.tether is not None:
        products = live.state.products
        parents = products[live.state.before_edits(digest)].parents.values()
        walks = (one for one in parents if one in products and products[one].kind == WALK.name)
        walk = next((live.typed(WalkResult, one).plan for one in walks), None)
    tethered = walk.tethered if isinstance(walk, WalkPlan) else None
    return None if tethered is None else tethered.up


def _motion(found: Value, digest: str) -> StepPlan | WalkPlan | Sequence:
    if isinstance(found, WalkResult):
        plan = found.plan or found.partial
        if plan is None:
            raise Conflict(f"there is no walk, so nothing moves: {found.reason}")
        return plan
    if isinstance(found, PlanResult):
        if found.plan is None:
            raise Conflict(f"there is no plan, so nothing moves: {found.reason}")
        return found.plan
    if not isinstance(found, Sequence) or not found.commands:
        raise NotFound(f"{digest} is neither a plan, a walk nor a sequence with commands", digest=digest)
    return found
