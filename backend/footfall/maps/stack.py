"""All map layers for one leg."""

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, no_progress, part
from footfall.core.value import Provenance
from footfall.maps.layers import (
    NO_SOLUTION,
    OUT_OF_RANGE,
    REACHABLE_STABLE,
    REACHABLE_UNSTABLE,
    UNKNOWN,
    MapSettings,
    MapStack,
)
from footfall.maps.reach import reach
from footfall.maps.stability import stability
from footfall.maps.traversability import traversability
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem


def compute_maps(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    leg: int,
    settings: MapSettings | None = None,
    progress: Progress = no_progress,
) -> MapStack:
    """Traversability, reachability and stability of ``leg`` on the cells of the terrain.

    In "solutions" and "margin", NaN stands for unknown ground and, in "margin", also for cells that the
    leg can't reach; "footing" tells them apart. Cells beyond the leg's length have 0 solutions. The same
    input gives the same digest. Raises InvalidInput for a leg that does not exist or a state of another
    robot.
    """
    settings = settings or MapSettings()
    leg = robot.require_leg(leg)
    if state.robot != robot.name or state.leg_count != robot.leg_count:
        raise InvalidInput(
            f"the state is of {state.robot} with {state.leg_count} legs, "
            f"the robot is {robot.name} with {robot.leg_count}"
        )
    ground = traversability(dem, settings, part(progress, 0.0, 0.5))
    reached = reach(robot, dem, state, leg, part(progress, 0.5, 0.9))
    margins = stability(robot, dem, state, leg, reached, settings.conservative)
    progress(0.95, "stability")

    known = np.isfinite(dem.heights)
    footing = np.where(known, OUT_OF_RANGE, UNKNOWN).astype(np.uint8)
    solutions = np.where(known, np.float32(0), np.float32(np.nan))
    margin = np.full(dem.geometry.shape, np.nan, np.float32)
    at = (reached.rows, reached.cols)
    footing[at] = np.where(
        reached.solutions == 0,
        NO_SOLUTION,
        np.where(margins >= settings.stable_margin, REACHABLE_STABLE, REACHABLE_UNSTABLE),
    )
    solutions[at] = reached.solutions
    margin[at] = margins
    unknown = tuple(reached.unknown.T)
    footing[unknown] = UNKNOWN
    solutions[unknown] = np.nan

    layers: dict[str, NDArray[np.generic]] = {
        "slope": ground.slope,
        "roughness": ground.roughness,
        "step": ground.step,
        "goodness": ground.goodness,
        "certainty": ground.certainty,
        **memory_layers(dem),
        "solutions": solutions,
        "margin": margin,
        "footing": footing,
    }
    parents = {"dem": dem.digest, "state": state.digest, "robot": robot.digest}
    stack = MapStack(
        geometry=dem.geometry,
        leg=leg,
        stability="conservative" if settings.conservative else "plain",
        layers=layers,
        provenance=Provenance(parents, settings),
    )
    progress(1.0, "maps")
    return stack


def memory_layers(dem: Dem) -> dict[str, NDArray[np.float32]]:
    """ "age" [s] and "height_sd" [m] of each cell, (rows, cols); NaN where unknown or where the terrain doesn't say."""
    nothing = np.full(dem.geometry.shape, np.nan, np.float32)
    age, deviation = nothing, nothing
    if dem.time is not None and np.isfinite(dem.time).any():
        age = (np.nanmax(dem.time) - dem.time).astype(np.float32)
    if dem.variance is not None:
        deviation = np.sqrt(dem.variance)
    return {"age": age, "height_sd": deviation}
