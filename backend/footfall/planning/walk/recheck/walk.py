"""The recheck of a whole walk by other means than those it was planned with.

Nothing of the planner's checks is used: links are where pin has them, distances are those of coal's meshes, support
polygons are hulls, friction and torques linear programs, and the ground is its one triangulation. Clearances are those
of the robot's description; what a planner kept beyond them is its own matter. What the settings ask for (polygon and
margin, friction, largest torque, places) is asked for here too.
"""

from collections.abc import Callable

from footfall.core.errors import InvalidInput
from footfall.planning.answers import Check
from footfall.planning.walk.problem import CheckedMotion, WalkSettings
from footfall.planning.walk.recheck import order
from footfall.planning.walk.recheck.clearances import ClearanceCheck
from footfall.planning.walk.recheck.feet import Branches, ContactCheck, limits
from footfall.planning.walk.recheck.holding import HoldingCheck, turned
from footfall.planning.walk.recheck.recheck_settings import RecheckSettings
from footfall.planning.walk.recheck.stretches import stretches
from footfall.planning.walk.recheck.tethering import Tethering
from footfall.robot.description import ON_DECK, with_payload
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

EVERY = RecheckSettings()


def recheck_walk(
    robot: Robot,
    dem: Dem,
    plan: CheckedMotion,
    settings: WalkSettings | None = None,
    every: RecheckSettings = EVERY,
    pulse: Callable[[], None] = lambda: None,
    state: RobotState | None = None,
) -> tuple[Check, ...]:
    """Every check of a walk; it is good if all hold.

    settings: None: those that it was planned with. every: how densely it is looked at. pulse: called often; may raise.
    state: where the rover stands; None: its start is not compared. A walk whose phases are out of order is not sampled:
    of it only the checks of its order come back. Raises InvalidInput where it is of a robot with another number of
    joints.
    """
    moved = {leg for group in plan.groups for leg in group}
    feet = {len(stance.contacts) for stance in plan.stances}
    if plan.waypoints.shape[1:] != robot.lower.shape or feet != {robot.leg_count} or not moved <= {*robot.legs}:
        raise InvalidInput(f"this walk is not one of {robot.name}: it has another number of joints or feet")
    if settings is None:
        planned = plan.provenance.settings
        settings = planned if isinstance(planned, WalkSettings) else WalkSettings()
    first = [order.phases(robot, plan), order.stances(robot, plan), order.goal(plan)]
    first += [order.footfalls(plan, settings)] if settings.forbidden or settings.pinned else []
    first += [order.start(plan, state)] if state is not None else []
    if not first[0].holds:
        return tuple(first)
    contacts, branches = ContactCheck(robot, plan), Branches(plan)
    carrying = _carrying(robot, settings)
    holding = HoldingCheck(carrying, plan, settings, every.hold)
    clearances = ClearanceCheck(robot, dem, plan, every.watched)
    tethered = plan.tethered
    tethering = None if tethered is None else Tethering(robot, dem, plan, tethered)
    for number in range(len(plan.stances)):
        contacts.grounded(dem, number)
        clearances.grounded(number)
    for stretch in stretches(carrying, plan, every):
        pulse()
        contacts.stood(stretch)
        branches.look(stretch)
        holding.look(stretch, pulse)
        clearances.look(stretch, pulse)
        if tethering is not None:
            tethering.look(stretch, turned(stretch, every.hold), pulse)
    return (
        *first,
        contacts.worst.check("contact", "m"),
        limits(robot, plan),
        branches.check(),
        *holding.checks(),
        *clearances.checks(),
        *(tethering.checks() if tethering is not None else ()),
    )


def _carrying(robot: Robot, settings: WalkSettings) -> Robot:
    """The robot as if its description carried what the settings say: for weights alone, its box may be another."""
    if settings.payload_mass is None:
        return robot
    own, place = robot.description.payload, settings.payload_position
    if place is None:
        place = ON_DECK if own is None else own.position
    return Robot(with_payload(robot.description, settings.payload_mass, position=place))
