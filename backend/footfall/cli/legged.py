"""``footfall plan step``, ``plan walk`` and ``map`` with a robot that others described."""

import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import numpy as np
import typer
from numpy.typing import NDArray

from footfall.cli import terminal
from footfall.core.errors import InvalidInput
from footfall.core.value import fields_of
from footfall.maps.refusals import NOTHING, REFUSALS
from footfall.planning.answers import Status
from footfall.planning.legged.problem import LeggedPlan, LeggedResult, LeggedSettings, LeggedState
from footfall.planning.walk.problem import WalkGoal

if TYPE_CHECKING:
    from footfall.robot.legged.legged_robot import LeggedRobot
    from footfall.sim.physics.legged_verdict import LeggedReport
    from footfall.sim.physics.physics_settings import PhysicsSettings
    from footfall.terrain.dem import Dem

SERVED = "athlete"


def served_robot(robot: str, terrain: Path | None, sim: bool) -> "tuple[LeggedRobot, Dem | None] | None":
    """A robot that others described, and its ground, which a new session is to be about; None: none was asked for.

    sim: whether its rover is simulated. Raises InvalidInput for one whose ground nobody will see, for a terrain without
    a robot, and for another robot of ATHLETE's build.
    """
    from footfall.io.any_robot import is_legged, load_legged
    from footfall.io.robot_files import read_description
    from footfall.io.terrain_files import read_terrain

    if is_legged(robot):
        body = load_legged(robot)
        if terrain is not None:
            return body, read_terrain(terrain)
        if not body.description.cameras:
            raise InvalidInput(f"{Path(robot).name} has no cameras to see the ground: give it one with --terrain")
        if sim:
            raise InvalidInput("a simulated rover needs ground to stand on: give it with --terrain, or --no-sim")
        return body, None
    if robot != SERVED:
        if Path(robot).suffix:
            read_description(robot)  # a file that is not there, or is no description, says so itself
        raise InvalidInput(f"a server has the robot of its session, not {robot}; leave out --robot")
    if terrain is not None:
        raise InvalidInput("--terrain goes with --robot; sessions of ATHLETE load their ground in the page")
    return None


def plan_legged_walk(
    robot: "LeggedRobot",
    terrain: Path,
    goal: WalkGoal,
    at: tuple[float, float, float],
    settings: LeggedSettings,
    out: Path | None,
    as_json: bool,
    others: Mapping[str, bool],
    circulating: bool = False,
    along: Path | None = None,
) -> None:
    """Plan and show; exit code 1 where the answer is no. at: x, y [m] and yaw [rad] of the stance.

    others: option → whether it was given, of those that are ATHLETE's alone. Raises InvalidInput where one was.
    circulating: with legs that pass through the body. along: file of a route.
    """
    from footfall.cli.recorded import route_of
    from footfall.planning.legged.circulate import plan_circulating
    from footfall.planning.legged.walk import plan_walk

    _refuse_given(others, f"be planned with {robot.name}")
    if circulating and along is not None:
        raise InvalidInput("a circulating walk goes around nothing: leave out --along")
    dem, state = _stance(robot, terrain, at, settings)
    route = None if along is None else route_of(along, robot, dem)
    began = time.monotonic()
    with terminal.bar("walk") as progress:
        if circulating:
            result = plan_circulating(robot, dem, state, goal, settings, progress)
        else:
            result = plan_walk(robot, dem, state, goal, settings, progress, route)
    _answer(result, time.monotonic() - began, out, as_json)


def plan_legged_step(
    path: str,
    terrain: Path,
    leg: int,
    target: tuple[float, float],
    at: tuple[float, float, float],
    settings: LeggedSettings,
    out: Path | None,
    as_json: bool,
    others: Mapping[str, bool],
) -> None:
    """Plan and show; exit code 1 where the answer is no. target: x, y [m].

    at, others: as in :func:`plan_legged_walk`.
    """
    from footfall.io.any_robot import load_legged
    from footfall.planning.legged.step import plan_step

    robot = load_legged(path)
    _refuse_given(others, f"be planned with {robot.name}")
    robot.require_leg(leg)
    dem, state = _stance(robot, terrain, at, settings)
    began = time.monotonic()
    result = plan_step(robot, dem, state, leg, target, settings)
    _answer(result, time.monotonic() - began, out, as_json)


def _stance(
    robot: "LeggedRobot", terrain: Path, at: tuple[float, float, float], settings: LeggedSettings
) -> "tuple[Dem, LeggedState]":
    """The ground of a terrain file, and the robot standing on it."""
    from footfall.io.terrain_files import read_terrain
    from footfall.planning.legged.stand import stand

    dem = read_terrain(terrain)
    return dem, stand(robot, dem, *at, settings=settings)


def _answer(result: LeggedResult, seconds: float, out: Path | None, as_json: bool) -> NoReturn:
    """Write and show; exit code 1 where the answer is no."""
    from footfall.io.artifacts import encode
    from footfall.io.whole_files import write_whole

    if out is not None:
        write_whole(out, encode(result))
    _show(result, seconds, as_json)
    raise typer.Exit(0 if result.status is Status.FOUND else 1)


def make_legged_map(
    path: str,
    terrain: Path,
    leg: int,
    at: tuple[float, float, float],
    conservative: bool,
    out: Path | None,
    layer: str | None,
    as_json: bool,
    others: Mapping[str, bool],
) -> None:
    """Map, write and show. at: x, y [m] and yaw [rad] of the stance; layer: for files that take one.

    others: as in :func:`plan_legged_walk`.
    """
    from footfall.io.any_robot import load_legged
    from footfall.io.map_files import write_maps
    from footfall.planning.legged.leg_maps import compute_maps
    from footfall.planning.legged.step import unchecked

    robot = load_legged(path)
    _refuse_given(others, f"be had in maps of {robot.name}")
    robot.require_leg(leg)
    settings = LeggedSettings(conservative=conservative)
    dem, state = _stance(robot, terrain, at, settings)
    with terminal.bar("maps") as progress:
        stack = compute_maps(robot, dem, state, leg, settings, progress)
    if out is not None:
        write_maps(stack, out, layer)
    counts = Counter(stack.layers["refused_by"].ravel().tolist())
    cell = stack.geometry.resolution**2
    area = {REFUSALS[code].name: counts[code] * cell for code in sorted(counts)}
    if as_json:
        answer = {"digest": stack.digest, "leg": leg, "leg_name": robot.leg_names[leg], "layers": list(stack.layers)}
        written = None if out is None else str(out)
        answer |= {"area_m2": area, "not_lifted": stack.not_lifted, "unchecked": unchecked(robot), "written": written}
        terminal.show(answer)
        return
    typer.echo(f"leg {robot.leg_names[leg]}: a step leads to {area.get(REFUSALS[NOTHING].name, 0.0):z.3f} m²")
    for code in sorted(set(counts) - {NOTHING}):
        typer.echo(f"  {area[REFUSALS[code].name]:z.3f} m² {REFUSALS[code].name}: {REFUSALS[code].text}")
    if stack.not_lifted:
        typer.echo(f"⊘ leg {robot.leg_names[leg]} can't step anywhere: {stack.not_lifted}")
    for text in unchecked(robot):
        typer.echo(f"  not checked: {text}")
    if out is not None:
        typer.echo(f"written to {out}")


def judge_legged(
    path: str, source: Path, terrain: Path | None, physics: "PhysicsSettings", as_json: bool, others: Mapping[str, bool]
) -> NoReturn:
    """``footfall referee``; exit code 1 where something did not hold. others: as in :func:`plan_legged_walk`."""
    from footfall.cli.recorded import sequence_of
    from footfall.io.any_robot import load_legged
    from footfall.io.terrain_files import read_terrain
    from footfall.sim.physics.legged_referee import legged_referee

    robot = load_legged(path)
    _refuse_given(others, f"be simulated with {robot.name}")
    if terrain is None:
        raise InvalidInput(f"{source.name} says nothing of the ground: give --terrain")
    sequence = sequence_of(source, Path(path), terrain)
    with terminal.bar("referee") as progress:
        found = legged_referee(robot, sequence, read_terrain(terrain), physics, progress=progress)
    if as_json:
        terminal.show({"passed": found.passed, "report": asdict(found)})
    else:
        _tell(found, len(sequence.commands))
    raise typer.Exit(0 if found.passed else 1)


def _tell(found: "LeggedReport", rows: int) -> None:
    say = typer.echo
    say("passed" if found.passed else "failed")
    for text in found.failures:
        say(f"  NO  {text}")
    say(f"{found.commands} of {rows} commands done in {found.seconds:z.1f} s")
    say(f"feet that stand were off the ground for {found.air.max():z.2f} s and slipped {_mm(found.slip)} at most")
    if found.touched:
        say(f"feet were put down at most {_mm(found.touch)} from their places")
    say(
        f"chassis at most {_mm(found.drift)} beside, {_mm(found.sink)} below and {found.lean:z.3f} rad from the plan; "
        f"at rest it stood {_mm(found.settled)} below"
    )
    say("efforts have no limits" if np.isnan(found.effort) else f"largest effort {found.effort:.0%} of its limit")
    for text in found.assumed:
        say(f"  assumed: {text}")


def _mm(sizes: "float | NDArray[np.float64]") -> str:
    return f"{1000 * np.nanmax(sizes):z.1f} mm"


def _refuse_given(others: Mapping[str, bool], what: str) -> None:
    given = [option for option, was_given in others.items() if was_given]
    if given:
        raise InvalidInput(f"{', '.join(given)} can't {what}: only with ATHLETE's legs")


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
        of_plan = _figures(result.plan)
        way = f"{of_plan['foot_moves']} foot moves, the chassis goes {of_plan['chassis_way']:z.2f} m"
        typer.echo(f"{way}, digest {result.plan.digest}")
    typer.echo(f"planned in {seconds:z.2f} s")


def _figures(plan: LeggedPlan) -> dict[str, float]:
    """What a walk comes to; chassis_way [m]."""
    return {"foot_moves": len(plan.moves), "waypoints": len(plan.waypoints), "chassis_way": plan.chassis_way}
