"""The commands ``footfall robot init`` and ``footfall robot check``: a robot that others described."""

from pathlib import Path
from typing import Annotated

import typer

from footfall.cli import terminal
from footfall.cli.terminal import Json, Reporting, bar, say
from footfall.core.errors import InvalidInput

robot_app = typer.Typer(
    cls=Reporting, rich_markup_mode=None, no_args_is_help=True, help="Bring a robot of your own: propose, and check."
)
Packages = Annotated[
    list[Path] | None, typer.Option("--packages", help="A folder that holds packages of meshes; may be given again.")
]


@robot_app.command("init")
def init(
    urdf: Annotated[Path, typer.Argument(help="URDF file, xacro expanded.")],
    out: Annotated[Path | None, typer.Option("--out", help="File to write; otherwise robot.toml beside it.")] = None,
    packages: Packages = None,
    samples: Annotated[
        int, typer.Option(help="Postures in which collisions are looked for.", min=1, max=100_000)
    ] = 200,
    seed: Annotated[int, typer.Option(help="Same seed, same postures.", min=0)] = 0,
    hanging: Annotated[
        bool, typer.Option("--hanging", help="Judge limbs where their ends hang lowest: legs that zero stretches out.")
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Write over a file that is there.")] = False,
    as_json: Json = False,
) -> None:
    """Propose a robot.toml beside a URDF: legs, feet, groups, a posture, collisions, clearances; for you to edit."""
    from footfall.io.urdf.proposal import proposal
    from footfall.io.urdf.read import read_urdf
    from footfall.io.whole_files import require_writable, write_whole
    from footfall.robot.legged.find_legs import legged_model
    from footfall.robot.legged.touching import touching

    target = out or urdf.parent / "robot.toml"
    require_writable(target)
    if target.exists() and not force:
        raise InvalidInput(f"{target} is there already; --force writes over it, --out names another", file=str(target))
    folders = packages or []
    with bar("robot") as progress:
        progress(0.1, "reading")
        model = legged_model(read_urdf(urdf, folders), hanging)
        progress(0.3, "collisions")
        found = touching(model.tree, samples, seed)
    write_whole(target, proposal(model, urdf, target, found, folders).encode())
    if as_json:
        legs = [{"name": leg.name, "foot": leg.foot, "sole": leg.sole.kind, "group": leg.group} for leg in model.legs]
        pairs = {"always": len(found.always), "sometimes": len(found.sometimes), "never": len(found.never)}
        answer = {"name": model.tree.name, "written": str(target), "mass": model.tree.mass, "legs": legs}
        terminal.show({**answer, "left_out": model.left_out, "pairs": pairs, "samples": samples, "seed": seed})
        return
    for leg in model.legs:
        joints = f"{len(leg.joints)} joints to {leg.foot}, {leg.sole.kind}, group {leg.group}"
        typer.echo(f"leg {leg.name}: {joints}{f'; doubtful: {leg.doubt}' if leg.doubt else ''}")
    for limb, why in model.left_out.items():
        typer.echo(f"no leg: {limb}: {why}")
    typer.echo(f"written to {target}; read it, edit it, then: footfall robot check {target}")


@robot_app.command("check")
def check(
    path: Annotated[Path, typer.Argument(help="URDF file, or robot.toml beside one.")],
    packages: Packages = None,
    as_json: Json = False,
) -> None:
    """Say what is good, doubtful or unusable in a robot's description; exit code 1 where something is unusable."""
    from footfall.io.urdf.examine import examine
    from footfall.robot.legged.finding import SIGNS, Grade

    findings = examine(path, packages or [])
    counts = {grade: sum(one.grade is grade for one in findings) for grade in Grade}
    usable = not counts[Grade.UNUSABLE]
    if as_json:
        counted = {grade.name.lower(): count for grade, count in counts.items()}
        terminal.show({"ok": usable, "counts": counted, "findings": findings})
    for one in findings:
        where = f" {one.where}:" if one.where else ""
        say(f"{SIGNS[one.grade]} {one.grade.value:<13} {one.check_name:<11}{where} {one.text}", as_json)
    say(", ".join(f"{count} {grade.value}" for grade, count in counts.items()), as_json)
    raise typer.Exit(0 if usable else 1)
