"""The command ``footfall referee``: a sequence carried out by a simulated rover with masses and springs, and judged."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from footfall.balance.friction import FRICTION
from footfall.cli import terminal
from footfall.cli.legged import judge_legged
from footfall.cli.terminal import Json, RobotName, bar
from footfall.core.errors import InvalidInput

if TYPE_CHECKING:
    from footfall.robot.description import Payload
    from footfall.robot.model import Robot
    from footfall.sequence.commands import Sequence
    from footfall.sim.physics.verdict import RefereeReport
    from footfall.terrain.dem import Dem


def run_referee(
    context: typer.Context,
    source: Annotated[
        Path,
        typer.Argument(help="Session folder or zip, or the .npz of `footfall plan … --out`.", metavar="SEQUENCE"),
    ],
    terrain: Annotated[
        Path | None, typer.Option(help="Terrain file that is the world; otherwise the first that the session loaded.")
    ] = None,
    gravity: Annotated[str, typer.Option(help="earth, moon or mars.")] = "earth",
    friction: Annotated[float, typer.Option(help="Between wheels and ground.")] = FRICTION,
    stiffness: Annotated[
        float, typer.Option(help="Of the joints, times that of the description, or that which is assumed.")
    ] = 1.0,
    wheels: Annotated[float, typer.Option(help="Of the wheels, times that of the description.")] = 1.0,
    mass: Annotated[float, typer.Option(help="Of every link and the payload, times that of the description.")] = 1.0,
    spread: Annotated[float, typer.Option(help="Joints and wheels differ by 1 ± this, by chance.")] = 0.0,
    payload: Annotated[
        float | None,
        typer.Option(help="Mass on the deck [kg]; otherwise what was planned with, else the description's."),
    ] = None,
    wheel_shape: Annotated[str, typer.Option(help="How a wheel meets the ground: sphere or crowned.")] = "sphere",
    seed: Annotated[int, typer.Option(help="Same seed, same spread.")] = 0,
    robot: RobotName = "athlete",
    as_json: Json = False,
) -> None:
    """Carry out a sequence in physics and judge what came of it; exit code 1 where something did not hold."""
    from footfall.balance.balance_settings import gravity_named
    from footfall.io.any_robot import is_legged
    from footfall.robot.description import with_payload
    from footfall.robot.model import Robot
    from footfall.sim.physics.laden import laden
    from footfall.sim.physics.physics_settings import PhysicsSettings
    from footfall.sim.physics.referee import referee
    from footfall.sim.physics.verdict import RefereeSettings

    physics = PhysicsSettings(
        gravity=gravity_named(gravity),
        friction=friction,
        stiffness_scale=stiffness,
        stiffness_spread=spread,
        wheel_scale=wheels,
        wheel_spread=spread,
        mass_scale=mass,
        wheel_shape=wheel_shape,
        seed=seed,
    )
    if is_legged(robot):
        others = {
            "--wheels": wheels != 1.0,
            "--spread": spread != 0.0,
            "--payload": payload is not None,
            "--wheel-shape": wheel_shape != PhysicsSettings().wheel_shape,
            "--seed": seed != 0,
        }
        judge_legged(robot, source, terrain, physics, as_json, others)
    body, sequence, dem = _given(source, terrain, robot, bool(terminal.typed(context, ["robot"])))
    body = laden(body, sequence) if payload is None else Robot(with_payload(body.description, payload))
    with bar("referee") as progress:
        report = referee(body, sequence, dem, RefereeSettings(physics), progress=progress)
    if as_json:
        terminal.show({"passed": report.passed, "payload": body.description.payload, "report": report})
    else:
        _tell(report, len(sequence.commands), body.description.payload)
    raise typer.Exit(0 if report.passed else 1)


def _given(source: Path, terrain: Path | None, robot: str, named: bool) -> "tuple[Robot, Sequence, Dem]":
    """Robot, sequence and world: a session has all three, a stored plan its sequence only.

    named: whether the robot was named. Raises InvalidInput where a session is of another one.
    """
    from footfall.cli.recorded import RecordedSession, sequence_of
    from footfall.io.robot_files import load_robot
    from footfall.io.terrain_files import read_terrain

    if source.suffix == ".npz":
        if terrain is None:
            raise InvalidInput(f"{source.name} says nothing of the ground: give --terrain")
        return load_robot(robot), sequence_of(source), read_terrain(terrain)
    recorded = RecordedSession(source)
    if named and load_robot(robot).digest != recorded.state.robot:
        raise InvalidInput(f"{source.name} is a session of another robot than {robot}: leave out --robot")
    dem = recorded.world() if terrain is None else read_terrain(terrain)
    return recorded.robot(), recorded.sequence(), dem


def _tell(report: "RefereeReport", rows: int, payload: "Payload | None") -> None:
    say = typer.echo
    say("passed" if report.passed else "failed")
    if payload is not None:
        say("carried {:g} kg, their centre at ({:g}, {:g}, {:g}) m in base".format(payload.mass, *payload.position))
    for text in report.failures:
        say(f"  NO  {text}")
    for event in report.events:
        off = "" if event.off != event.off else f", {1000 * event.off:z.0f} mm from its goal"
        place = "{:z.3f} {:z.3f} {:z.3f}".format(*event.point)
        say(f"  {event.time:z6.2f} s  row {event.row + 1:<3} {event.kind} of wheel {event.leg} at {place}{off}")
    say(f"{report.commands} of {rows} commands done in {report.ended[-1] if len(report.ended) else 0.0:z.1f} s")
    if report.clearance == report.clearance:
        say(f"least height of the swinging leg over the ground {1000 * report.clearance:z.0f} mm")
    say(f"supporting wheels slipped at most {1000 * report.slip.max():z.1f} mm")
    if len(report.chassis):
        far, low = 1000 * report.chassis.max(), 1000 * report.sag.max()
        say(f"chassis at most {far:z.0f} mm from where it should be, {low:z.0f} mm too low")
    say(f"largest torque {report.torque.max():.0%} of its limit")
