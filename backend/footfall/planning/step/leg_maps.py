"""The maps of one leg, with what planning knows of all their cells at once: whether the leg can be lifted at all."""

from collections.abc import Callable

from footfall.core.progress import Progress, no_progress
from footfall.maps.layers import MapSettings, MapStack
from footfall.maps.stack import map_stack
from footfall.planning.answers import No
from footfall.planning.step.footing import LegStance
from footfall.planning.step.lift_off import lift_off
from footfall.planning.step.problem import StepSettings
from footfall.planning.watch import Watch
from footfall.robot.model import Robot
from footfall.robot.tolerance import state_inside
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem


def compute_maps(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    leg: int,
    settings: MapSettings | None = None,
    progress: Progress = no_progress,
    preview: Callable[[MapStack], None] | None = None,
) -> MapStack:
    """Map where ``leg`` can step to: traversability, reachability, stability and quality of each cell of the terrain.

    See ``map_stack``. Where the settings ask for it (``lift_off``, with ``collisions``) no cell is green for a leg that
    a step could not begin with; why is told once, in ``not_lifted``.

    Args:
        robot: the rover.
        dem: the ground, in site.
        state: how the rover stands.
        leg: number of the leg that is to step, from 0.
        settings: with what cells are judged; None: as delivered.
        progress: called with a fraction 0…1 and a text; what it raises ends the work.
        preview: called with maps of every fourth cell before the fine ones are made; None: there are none.

    Returns:
        Layers (rows, cols) on the grid of the terrain; the same input gives the same digest.

    Raises:
        InvalidInput: the rover has no such leg, or the state is of another robot.
    """
    settings = settings or MapSettings()
    return map_stack(
        robot, dem, state, leg, settings, progress, preview, lambda: why_not_lifted(robot, dem, state, leg, settings)
    )


def why_not_lifted(robot: Robot, dem: Dem, state: RobotState, leg: int, settings: MapSettings) -> str:
    """What a step of the leg would be refused for wherever it went, by the planner's own check; empty where nothing."""
    asked = StepSettings(
        lift=settings.lift,
        raise_terrain=settings.raise_terrain,
        clearance=settings.clearance,
        conservative=settings.conservative,
        least_margin=settings.stable_margin,
        friction=settings.balance.friction,
    )
    found = lift_off(LegStance(robot, dem, state_inside(robot, state), leg), asked, Watch(), to_plan=False)
    return found.reason if isinstance(found, No) else ""
