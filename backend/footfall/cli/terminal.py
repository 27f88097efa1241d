"""How the command line speaks: progress bars, results as text or JSON, one clear line for each error."""

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from typer.core import TyperGroup

from footfall.api.bodies.jsonable import dumps
from footfall.core.errors import FootFallError, InvalidInput
from footfall.core.interrupted import came_of_interrupt
from footfall.core.progress import Progress as Report
from footfall.core.value import fields_of
from footfall.io.whole_files import require_writable
from footfall.planning.answers import Check, Status
from footfall.planning.execution.execution_settings import MODES, ExecutionSettings
from footfall.planning.execution.problem import ExecutionResult
from footfall.planning.step.problem import PlanResult
from footfall.planning.walk.problem import WalkResult
from footfall.planning.walk_execution.problem import WalkExecutionResult
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

if TYPE_CHECKING:
    from footfall.balance.tether import Tether
    from footfall.robot.model import Robot

Pair = tuple[float, float]
RobotName = Annotated[str, typer.Option("--robot", help="Name of a robot, or path of a description.")]
AtX = Annotated[float, typer.Option("--x", help="Where the rover stands [m].")]
AtY = Annotated[float, typer.Option("--y", help="Where the rover stands [m].")]
AtYaw = Annotated[float, typer.Option("--yaw", help="Its heading [rad].")]
LegNumber = Annotated[int, typer.Option("--leg", help="Which leg, 0….")]
Conservative = Annotated[bool, typer.Option("--conservative", help="Balance must survive the loss of any one leg.")]

_WANTS_JSON = "footfall.json"
TYPED = "COMMANDLINE"
"""What click calls the source of an option that was typed."""


def _remember(context: typer.Context, wanted: bool) -> bool:
    context.find_root().meta[_WANTS_JSON] = wanted
    return wanted


Json = Annotated[bool, typer.Option("--json", help="One JSON document on stdout.", callback=_remember, is_eager=True)]


def writable(out: Path | None) -> Path | None:
    """Refuse, before the work, a file that can't be written: the callback of an option."""
    if out is not None:
        require_writable(out)
    return out


def typed(context: typer.Context, names: Iterable[str]) -> list[str]:
    """Those of some parameters of a command that were typed, as options."""
    sources = {name: context.get_parameter_source(name) for name in names}
    return [f"--{name.replace('_', '-')}" for name, one in sources.items() if one is not None and one.name == TYPED]


def refuse_typed(context: typer.Context, names: Iterable[str], why: str) -> None:
    """Raises InvalidInput for options that say nothing here: passed over without a word, they would mislead."""
    if found := typed(context, names):
        raise InvalidInput(f"{', '.join(found)} {why}")


class Reporting(TyperGroup):
    """Turns FootFall's errors into one line on stderr (JSON on stdout where asked for) and exit code 2."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except SystemError as error:
            if came_of_interrupt(error):
                raise KeyboardInterrupt from error
            raise
        except OSError as error:
            typer.echo(f"footfall: {error.filename or 'the system'}: {error.strerror or error}", err=True)
            raise typer.Exit(2) from error
        except FootFallError as error:
            if ctx.find_root().meta.get(_WANTS_JSON):
                show({"error": {"kind": error.kind, "message": error.message, "details": error.details}})
            typer.echo(f"footfall: {error.message}", err=True)
            raise typer.Exit(2) from error


def show(document: Any) -> None:
    """One JSON document on stdout."""
    typer.echo(dumps(document))


def say(text: str, as_json: bool) -> None:
    """A line for a person; nothing where a program reads."""
    if not as_json:
        typer.echo(text)


@contextmanager
def bar(what: str) -> Iterator[Report]:
    """A progress bar on stderr, gone when the work is done; nothing where stderr is no terminal."""
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[text]}"), TimeElapsedColumn())
    console = Console(file=sys.stderr)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as shown:
        task = shown.add_task(what, total=1.0, text="")

        def report(fraction: float, text: str) -> None:
            shown.update(task, completed=fraction, text=text)

        yield report


def stance(
    robot: str, terrain: Path, x: float, y: float, yaw: float, tether: "Tether | None" = None
) -> "tuple[Robot, Dem, RobotState]":
    """Robot, terrain file and the robot standing on it, or hanging on a tether."""
    from footfall.io.robot_files import load_robot
    from footfall.io.terrain_files import read_terrain
    from footfall.planning.walk.stand_to_walk import stand

    body, dem = load_robot(robot), read_terrain(terrain)
    return body, dem, stand(body, dem, x=x, y=y, yaw=yaw, tether=tether)


def show_terrain(dem: Dem, as_json: bool, written: Path | None = None) -> None:
    """What a terrain is."""
    from footfall.api.routes.terrains import about_terrain

    about = about_terrain(dem)
    if as_json:
        show({**about, "written": None if written is None else str(written)})
        return
    west, south, east, north = dem.geometry.bounds
    typer.echo(f"{dem.name}: {about['cols']} × {about['rows']} cells of {dem.geometry.resolution:g} m")
    typer.echo(f"east {west:z.2f} … {east:z.2f} m, north {south:z.2f} … {north:z.2f} m")
    typer.echo(f"heights {about['lowest']:z.3f} … {about['highest']:z.3f} m, {about['known']:.1%} of the cells known")
    if (turned := dem.true_north) is not None:
        middle, least, most = turned
        typer.echo(
            f"true north is turned {middle:+z.1f}° clockwise from y in the middle, "
            f"{least:+z.1f}° … {most:+z.1f}° over it"
        )
    if dem.height_error is not None:
        error = dem.height_error
        typer.echo(f"95 % of it within {error.p95:z.3f} m of the mesh's own surface, at most {error.most:z.3f} m off")
    for pair, reason in dem.left_out.items():
        typer.echo(f"left out {pair}: {reason}")
    if written is not None:
        typer.echo(f"written to {written}")


def show_plan(result: PlanResult, done: ExecutionResult | None, as_json: bool) -> None:
    """The answer to a request for a step, with its checks; done: how it is commanded, None: as it was planned."""
    if as_json:
        show({**fields_of(result), "digest": result.digest, "commands": commands_made(result, done)})
        return
    typer.echo(f"{result.status.value}: {result.reason}" if result.reason else result.status.value)
    show_checks(result.checks)
    if result.plan is None:
        return
    typer.echo(f"{len(result.plan.waypoints)} waypoints by {result.plan.planner}, digest {result.plan.digest}")
    if done is None:
        typer.echo("as commanded: the rover sags; touch-down is not predicted")
        return
    title, text = MODES[mode_of(done)]
    if done.status is Status.FOUND and done.execution is not None:
        typer.echo(f"{title}: {text} Touch-down {done.execution.touch_down_offset:z.3f} m from the planned contact.")
    else:
        typer.echo(f"it can't be commanded {title}: {done.reason}; --as-commanded predicts no sag")
        show_checks(done.checks)


def commands_made(
    result: PlanResult | WalkResult, done: ExecutionResult | WalkExecutionResult | None
) -> dict[str, object]:
    """How a step or a walk is commanded; done: None: as it was planned."""
    if done is None:
        return {"mode": "rigid", "status": result.status, "reason": "", "digest": None}
    answer = {"status": done.status, "reason": done.reason, "digest": done.digest, "checks": done.checks}
    return {"mode": mode_of(done), **answer}


def mode_of(done: ExecutionResult | WalkExecutionResult) -> str:
    """In which mode it was asked for."""
    asked = done.provenance.settings
    return asked.mode if isinstance(asked, ExecutionSettings) else ExecutionSettings().mode


def show_checks(checks: tuple[Check, ...]) -> None:
    """Each with its margin, and where it is least."""
    for check in checks:
        size = "" if check.margin != check.margin else f"{check.margin:+.4g} {check.unit}"
        typer.echo(f"  {'ok' if check.holds else 'NO':<3} {check.name:<24} {size:<16} {check.where}")
