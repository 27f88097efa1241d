"""``footfall plan walk`` with a robot that others described: a stance, a walk, its checks."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import typer

from footfall import terminal
from footfall.core.errors import InvalidInput
from footfall.core.value import fields_of
from footfall.planning.legged.problem import LeggedPlan, LeggedResult, LeggedSettings
from footfall.planning.step.problem import Status
from footfall.planning.walk.problem import WalkGoal
from footfall.robot.legged.legged_robot import LeggedRobot


def plan_legged_walk(
    robot: LeggedRobot,
    terrain: Path,
    goal: WalkGoal,
    at: tuple[float, float, float],
    settings: LeggedSettings,
    out: Path | None,
    as_json: bool,
    others: Mapping[str, bool],
) -> None:
    """Plan and show; exit code 1 where the answer is no. at: x, y [m] and yaw [rad] of the stance.

    others: option → whether it was given, of those that are ATHLETE's alone. Raises InvalidInput where one was.
    """
    from footfall.io.artifacts import encode
    from footfall.io.terrain_files import read_terrain
    from footfall.planning.legged.stand import stand
    from footfall.planning.legged.walk import plan_walk

    given = [option for option, was_given in others.items() if was_given]
    if given:
        raise InvalidInput(f"{', '.join(given)} can't be planned with {robot.name}: only with ATHLETE's legs")
    dem = read_terrain(terrain)
    state = stand(robot, dem, *at, settings=settings)
    began = time.monotonic()
    with terminal.bar("walk") as progress:
        result = plan_walk(robot, dem, state, goal, settings, progress)
    seconds = time.monotonic() - began
    if out is not None:
        out.write_bytes(encode(result))
    _show(result, seconds, as_json)
    raise typer.Exit(0 if result.status is Status.FOUND else 1)


def _show(result: LeggedResult, seconds: float, as_json: bool) -> None:
    if as_json:
        figures = None if result.plan is None else _figures(result.plan)
        terminal.show({**fields_of(result), "digest": result.digest, "figures": figures, "seconds": seconds})
        return
    typer.echo(f"{result.status.value}: {result.reason}" if result.reason else result.status.value)
    terminal.show_checks(result.checks)
    for text in result.unchecked:
        typer.echo(f"  not checked: {text}")
    if result.plan is not None:
        told = _figures(result.plan)
        way = f"{told['foot_moves']} foot moves, the chassis goes {told['chassis_way']:z.2f} m"
        typer.echo(f"{way}, digest {result.plan.digest}")
    typer.echo(f"planned in {seconds:z.2f} s")


def _figures(plan: LeggedPlan) -> dict[str, Any]:
    """What a walk comes to; chassis_way [m]."""
    return {"foot_moves": len(plan.moves), "waypoints": len(plan.waypoints), "chassis_way": plan.chassis_way}
