"""How what is asked of robots that others described is made from its parents (:mod:`.product_recipes`)."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

from footfall.core.progress import Progress
from footfall.core.value import Value
from footfall.session.jobs.requests import DescribedMapRequest, DescribedStepRequest, DescribedWalkRequest

if TYPE_CHECKING:
    from footfall.maps.stack import MapStack
    from footfall.planning.legged.problem import LeggedResult, LeggedState
    from footfall.robot.legged.legged_robot import LeggedRobot
    from footfall.sequence.commands import Sequence
    from footfall.terrain.dem import Dem

_Made = TypeVar("_Made", "MapStack", "LeggedResult", "Sequence")


def maps(parents: Mapping[str, Any], settings: DescribedMapRequest, progress: Progress) -> Value:
    """robot, dem, state; DescribedMapRequest → MapStack."""
    from footfall.planning.legged.leg_maps import compute_maps

    robot, ground, start = from_feet(parents)
    return on_map(compute_maps(robot, ground, start, settings.leg, settings.settings, progress), ground, parents)


def step(parents: Mapping[str, Any], settings: DescribedStepRequest, progress: Progress) -> Value:
    """robot, dem, state; DescribedStepRequest → LeggedResult."""
    from footfall.planning.legged.step import plan_step

    robot, ground, start = from_feet(parents)
    chosen = settings.footfall
    found = plan_step(robot, ground, start, chosen.leg, (chosen.x, chosen.y), settings.settings)
    return on_map(found, ground, parents)


def walk(parents: Mapping[str, Any], settings: DescribedWalkRequest, progress: Progress) -> Value:
    """robot, dem, state, the route where it goes along one; DescribedWalkRequest → LeggedResult."""
    from footfall.planning.legged.walk import plan_walk

    robot, ground, start = from_feet(parents)
    along = parents["route"].plan if "route" in parents else None
    found = plan_walk(robot, ground, start, settings.goal, settings.settings, progress, along)
    return on_map(found, ground, parents)


def from_feet(parents: Mapping[str, Any]) -> "tuple[LeggedRobot, Dem, LeggedState]":
    """Robot, the ground as the feet that bear have it, and the state on it that plans begin from."""
    from footfall.planning.legged.measured import standing_state
    from footfall.planning.legged.under_feet import ground_told

    robot, state = parents["robot"], parents["state"]
    ground = ground_told(robot, parents["dem"], state)
    return robot, ground, standing_state(robot, ground, state)


def on_map(made: _Made, ground: "Dem", parents: Mapping[str, Any]) -> _Made:
    """What was made on that ground, with the session's terrain for its parent: nobody else knows the ground."""
    from footfall.planning.legged.under_feet import from_map

    if ground is parents["dem"]:
        return made
    return replace(made, provenance=from_map(made.provenance, ground, parents["dem"]))
