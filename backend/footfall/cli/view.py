"""The command ``footfall view``: a walk of a robot that others described, in a browser of this computer."""

import signal
import sys
import threading
from pathlib import Path
from typing import Annotated

import typer

from footfall.core.errors import InvalidInput


def view_walk(
    walk: Annotated[Path, typer.Argument(help="The .npz of `footfall plan walk … --out`.", metavar="WALK")],
    robot: Annotated[Path, typer.Option(help="The robot.toml that it was planned with.")],
    terrain: Annotated[Path, typer.Option(help="The terrain file that it was planned on.")],
    port: Annotated[
        int, typer.Option(help="Port to listen on, of this computer alone; 0 takes a free one.", min=0, max=65535)
    ] = 8090,
) -> None:
    """Show a walk of a robot of your own until Ctrl-C: the robot on its ground, each footfall, one scrubber.

    What is drawn are the shapes that the planner checked. Nothing here moves a robot.
    """
    from footfall.cli.recorded import legged_walk_of
    from footfall.io.any_robot import is_legged, load_legged
    from footfall.io.terrain_files import read_terrain
    from footfall_ui.viser_door import open_on_this_computer
    from footfall_ui.walk_viewer import WalkViewer

    if not is_legged(str(robot)):
        raise InvalidInput(f"{robot} is no robot.toml; walks of ATHLETE are on the page of `footfall serve`")
    own, dem = load_legged(robot), read_terrain(terrain)
    result = legged_walk_of(walk, own, dem)
    server = open_on_this_computer(port)
    viewer = WalkViewer(server, own, dem, result)
    ended = threading.Event()
    for asked in (signal.SIGINT, signal.SIGTERM):
        signal.signal(asked, lambda *_: ended.set())
    typer.echo(f"{walk.name} is shown on http://127.0.0.1:{server.get_port()}")
    sys.stdout.flush()
    ended.wait()
    viewer.close()
    server.stop()
