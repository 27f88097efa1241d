"""The commands ``footfall terrain …``: built from images, read, converted, blended, made ready for collision checks."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from footfall.cli import terminal
from footfall.cli.terminal import Json, Pair, Reporting, bar
from footfall.core.errors import InvalidInput
from footfall.core.progress import Progress, part

if TYPE_CHECKING:
    from footfall.robot.model import Robot
    from footfall.telemetry.state import RobotState
    from footfall.terrain.dem import Dem
    from footfall.terrain.scan import ScanSettings
    from footfall.terrain.terrain_settings import TerrainSettings

terrain_app = typer.Typer(
    cls=Reporting, rich_markup_mode=None, no_args_is_help=True, help="Terrain from images or files."
)

Scale = Annotated[float, typer.Option("--scale", help="Multiply all coordinates.")]
PoseOption = Annotated[
    str | None, typer.Option("--pose", help="Where a scan's sensor was: x,y,z,qw,qx,qy,qz [m].", metavar="X,Y,Z,QW,…")
]
Up = Annotated[str | None, typer.Option("--up", help="Axis of a scan that points up: z, y, x, -z, -y, -x.")]
Unit = Annotated[str | None, typer.Option("--unit", help="Unit of a scan: m, cm, mm, km, ft, us-ft.")]
MostError = Annotated[
    float | None, typer.Option("--most-error", help="Height error that is accepted of a mesh [m]; 0.1 m if not said.")
]


@terrain_app.command("build")
def build(
    files: Annotated[
        list[Path] | None,
        typer.Argument(
            help="Session folder or zip that holds images; or left and right image. Last, without --out: the file "
            "to write.",
            metavar="[BUNDLE | LEFT RIGHT] [OUT]",
        ),
    ] = None,
    images: Annotated[
        Path | None,
        typer.Option(help="Folder of stereo pairs, NAME_left.png and NAME_right.png (docs/calibration.md)."),
    ] = None,
    calibration: Annotated[
        list[Path] | None,
        typer.Option(
            help="With --images: FootFall's calibration file, or twice, left and right camera_info of ROS. With LEFT "
            "RIGHT: JSON with focal_length, cx, cy [px], baseline [m], rectified."
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="File to write; its ending decides the format.")
    ] = None,
    cameras: Annotated[str | None, typer.Option(help="With --images: only these pairs, such as front,rear.")] = None,
    robot: Annotated[
        str | None, typer.Option(help="With --images: whose cameras they are; its body is taken out.")
    ] = None,
    state: Annotated[
        Path | None, typer.Option(help="With --robot: how it stood, JSON as `state` in docs/rover-link.md.")
    ] = None,
    scan: Annotated[
        Path | None, typer.Option(help="Scan: PLY, PCD, LAS, LAZ, XYZ, CSV, VTK; or depth image: npz, 16-bit PNG.")
    ] = None,
    pose: PoseOption = None,
    up: Up = None,
    unit: Unit = None,
    vegetation: Annotated[
        bool, typer.Option("--leave-out-vegetation", help="With --scan: leave out returns above the ground.")
    ] = False,
    keep_outliers: Annotated[bool, typer.Option("--keep-outliers", help="With --scan: keep lone returns.")] = False,
    resolution: Annotated[float, typer.Option(help="Cell size [m].")] = 0.02,
    half_size: Annotated[float, typer.Option(help="How far the map reaches to each side [m].")] = 4.0,
    min_range: Annotated[float, typer.Option(help="Nearest ground that is looked for [m].")] = 1.0,
    max_range: Annotated[float, typer.Option(help="Farthest ground that is looked for [m].")] = 8.0,
    max_skew: Annotated[float, typer.Option(help="Most time between both images of a pair [s].")] = 0.02,
    matcher: Annotated[str, typer.Option(help='"3way" or "hh" (more accurate, slower).')] = "3way",
    refine: Annotated[
        bool, typer.Option("--refine", help="First turn cameras and pairs as all images together say.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Build the ground from a recorded session, one photographed pair, a folder of calibrated pairs, or a scan.

    A pair that can't be used is left out, and named with the reason.
    """
    from footfall.io.pair_files import read_calibrated_pair
    from footfall.io.terrain_files import require_terrain_file, write_terrain
    from footfall.terrain.photographs import terrain_from_pairs
    from footfall.terrain.scan import ScanSettings
    from footfall.terrain.terrain_settings import TerrainSettings

    sources, out = _sources_and_out(files or [], out)
    require_terrain_file(out)
    if scan is not None:
        if sources or images is not None or refine:
            raise InvalidInput("--scan is built alone: leave out BUNDLE, LEFT RIGHT, --images and --refine")
        settings = ScanSettings(resolution=resolution, outliers=not keep_outliers, vegetation=vegetation)
        _write_scan(scan, out, settings, unit, up, pose, calibration or [], as_json)
        return
    if (pose, up, unit, vegetation, keep_outliers) != (None, None, None, False, False):
        raise InvalidInput("--pose, --up, --unit, --leave-out-vegetation and --keep-outliers belong to --scan")
    if images is None and (cameras, robot, state) != (None, None, None):
        raise InvalidInput("--cameras, --robot and --state belong to --images")
    settings = TerrainSettings(
        resolution=resolution,
        half_size=half_size,
        min_range=min_range,
        max_range=max_range,
        max_skew=max_skew,
        matcher=matcher,
    )
    with bar("terrain") as progress:
        match sources, images, calibration or []:
            case [bundle], None, []:
                dem = _of_session(bundle, settings, refine, progress)
            case [left, right], None, [one]:
                if refine:
                    raise InvalidInput("--refine is for several pairs: one has nothing to be compared with")
                dem = terrain_from_pairs([read_calibrated_pair(left, right, one)], settings, progress)
            case [], Path(), [_, *_] as given:
                shown = _in_view(robot, state)
                dem = _of_folder(images, given, cameras, shown, settings, refine, progress)
            case _:
                raise InvalidInput("give BUNDLE, or LEFT RIGHT with --calibration, or --images with --calibration")
    write_terrain(dem, out)
    terminal.show_terrain(dem, as_json, out)


def _sources_and_out(files: list[Path], out: Path | None) -> tuple[list[Path], Path]:
    """What is read, and the file to write: the last of ``files`` without ``out``."""
    if out is not None:
        return files, out
    if not files:
        raise InvalidInput("say which file to write, with --out")
    return files[:-1], files[-1]


def _of_session(bundle: Path, settings: "TerrainSettings", refine: bool, progress: Progress) -> "Dem":
    """The ground in the images of a recorded session. refine: first turn cameras as all images together say."""
    from footfall.cli.recorded import RecordedSession
    from footfall.terrain.build import build_terrain
    from footfall.terrain.pairs.bundle_adjustment import refine as refine_pairs

    session = RecordedSession(bundle)
    snapshot = session.snapshot()
    if refine:
        pairs, found = refine_pairs(snapshot.pairs, part(progress, 0.0, 0.3))
        snapshot, progress = replace(snapshot, pairs=pairs), part(progress, 0.3, 1.0)
        typer.echo(found.text, err=True)
    return build_terrain(session.robot(), snapshot, settings, progress)


def _of_folder(
    images: Path,
    calibration: list[Path],
    cameras: str | None,
    shown: "tuple[Robot | None, RobotState | None]",
    settings: "TerrainSettings",
    refine: bool,
    progress: Progress,
) -> "Dem":
    """The ground in a folder of stereo pairs. shown: the robot that is to be taken out, and how it stood."""
    from footfall.io.photograph_files import read_photographs
    from footfall.terrain.photographs import terrain_from_photographs

    body, stood = shown
    names = None if cameras is None else cameras.split(",")
    photographs = read_photographs(images, calibration, names, None if stood is None else stood.T_site_base)
    return terrain_from_photographs(photographs, settings, progress, body, stood, refine)


def _write_scan(
    path: Path,
    out: Path,
    settings: "ScanSettings",
    unit: str | None,
    up: str | None,
    pose: str | None,
    calibration: list[Path],
    as_json: bool,
) -> None:
    from footfall.core.misread import place_of
    from footfall.core.strict_json import read_json
    from footfall.io.scan_terrain import read_scan_terrain
    from footfall.io.terrain_files import write_terrain

    if not path.is_file():
        raise InvalidInput(f"there is no scan {path}")
    if len(calibration) > 1:
        raise InvalidInput("a depth image has one calibration")
    members = None
    if calibration:
        try:
            members = read_json(calibration[0].read_bytes())
        except (OSError, ValueError, RecursionError) as err:
            raise InvalidInput(f"{calibration[0]} can't be read as JSON{place_of(err)}") from err
        if not isinstance(members, dict):
            raise InvalidInput(f"{calibration[0].name} needs a JSON object")
    dem = read_scan_terrain(path, settings, unit=unit, up=up, pose=_pose(pose), calibration=members)
    write_terrain(dem, out)
    terminal.show_terrain(dem, as_json, out)


def _pose(text: str | None) -> list[float] | None:
    if text is None:
        return None
    try:
        return [float(number) for number in text.split(",")]
    except ValueError as err:
        raise InvalidInput(f"--pose needs x,y,z,qw,qx,qy,qz, not {text!r}") from err


def _in_view(robot: str | None, state: Path | None) -> "tuple[Robot | None, RobotState | None]":
    """The robot that the images show and how it stood; both or neither."""
    from footfall.io.robot_files import load_robot
    from footfall.telemetry.fields import parse_object
    from footfall.telemetry.link_state import state_from

    if robot is None and state is None:
        return None, None
    if robot is None or state is None:
        raise InvalidInput("--robot needs --state, how it stood, and --state needs --robot")
    body = load_robot(robot)
    return body, state_from(parse_object(state.read_bytes()), body.leg_count)


@terrain_app.command("info")
def info(
    path: Annotated[Path, typer.Argument(help="Terrain file.")],
    scale: Scale = 1.0,
    resolution: Annotated[float | None, typer.Option(help="Cell size [m], for meshes.")] = None,
    most_error: MostError = None,
    up: Up = None,
    unit: Unit = None,
    pose: PoseOption = None,
    as_json: Json = False,
) -> None:
    """Say what a terrain file holds."""
    from footfall.io.terrain_files import read_terrain

    dem = read_terrain(
        path, scale=scale, resolution=resolution, most_error=most_error, up=up, unit=unit, pose=_pose(pose)
    )
    terminal.show_terrain(dem, as_json)


@terrain_app.command("convert")
def convert(
    source: Annotated[Path, typer.Argument(help="Terrain file to read.")],
    out: Annotated[Path, typer.Argument(help="Terrain file to write; its ending decides the format.")],
    scale: Scale = 1.0,
    resolution: Annotated[float | None, typer.Option(help="Cell size [m].")] = None,
    center: Annotated[bool, typer.Option("--center", help="Move the middle to (0, 0).")] = False,
    size: Annotated[Pair | None, typer.Option(help="East and north extent of an image [m].")] = None,
    height_range: Annotated[Pair | None, typer.Option(help="Heights of black and white [m].")] = None,
    most_error: MostError = None,
    up: Up = None,
    unit: Unit = None,
    pose: PoseOption = None,
    as_json: Json = False,
) -> None:
    """Read one terrain format and write another."""
    from footfall.io.terrain_files import read_terrain, require_terrain_file, write_terrain

    require_terrain_file(out)
    dem = read_terrain(
        source,
        scale=scale,
        resolution=resolution,
        center=center or None,
        size=size,
        height_range=height_range,
        most_error=most_error,
        up=up,
        unit=unit,
        pose=_pose(pose),
    )
    write_terrain(dem, out)
    terminal.show_terrain(dem, as_json, out)


@terrain_app.command("blend")
def blend(
    local: Annotated[Path, typer.Argument(help="Map from images: GeoTIFF or npz that says how sure it is.")],
    external: Annotated[Path, typer.Argument(help="Ground known from elsewhere, such as a GeoTIFF from orbit.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="Terrain file to write; its ending decides the format.")],
    deviation: Annotated[float, typer.Option(help="How unsure EXTERNAL is where it does not say so itself [m].")] = 0.5,
    time: Annotated[float, typer.Option(help="When EXTERNAL was measured [s since 1970].")] = 0.0,
    seam: Annotated[float, typer.Option(help="Width of the transition [m].")] = 1.0,
    reach: Annotated[float, typer.Option(help="Reach of the result from the middle of LOCAL [m]; 0: as LOCAL.")] = 0.0,
    level: Annotated[bool, typer.Option("--level", help="First raise EXTERNAL to LOCAL: its zero is another.")] = False,
    origin: Annotated[Pair | None, typer.Option(help="East and north of the site in EXTERNAL [m].")] = None,
    scale: Annotated[float, typer.Option(help="Multiply all coordinates of EXTERNAL.")] = 1.0,
    as_json: Json = False,
) -> None:
    """Lay ground known from elsewhere under a map, without a step between them."""
    from footfall.io.terrain_files import read_terrain, require_terrain_file, write_terrain
    from footfall.terrain.fusion.blend import blend as run
    from footfall.terrain.terrain_settings import BlendSettings

    require_terrain_file(out)
    settings = BlendSettings(deviation=deviation, time=time, level=level, seam=seam, reach=reach)
    dem = run(read_terrain(local), read_terrain(external, scale=scale, center=origin), settings)
    write_terrain(dem, out)
    terminal.show_terrain(dem, as_json, out)


@terrain_app.command("collision")
def collision(
    path: Annotated[Path, typer.Argument(help="Terrain file.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="Mesh to write: .ply, .obj, .stl or .off.")],
    raise_by: Annotated[float, typer.Option("--raise", help="Heights go up by this [m].")] = 0.15,
    buffer: Annotated[float, typer.Option(help="What stands grows by this [m].")] = 0.0,
    tolerance: Annotated[float, typer.Option(help="Most height error of the simplified mesh [m].")] = 0.01,
    as_json: Json = False,
) -> None:
    """Write the ground as collision checks may see it: grown, raised, with fewer triangles.

    The mesh lies nowhere below that ground, and above it by no more than the error that is printed, which is measured.
    """
    from footfall.io.terrain_files import read_terrain, require_mesh_file, write_collision_mesh
    from footfall.terrain.ground.simplified import simplified
    from footfall.terrain.ground.views import CollisionView, collision_view

    require_mesh_file(out)
    made = simplified(collision_view(read_terrain(path), CollisionView(raise_by, buffer)), tolerance)
    write_collision_mesh(made, out)
    count = len(made.mesh.triangles)
    if as_json:
        about = {"triangles": count, "triangles_before": made.triangles_before, "error": made.error}
        terminal.show({**about, "tolerance": tolerance, "written": str(out)})
        return
    typer.echo(f"{count} of {made.triangles_before} triangles, at most {1e3 * made.error:z.2f} mm above the ground")
    typer.echo(f"written to {out}")
