"""From the request of a step to its ghost: a real server, worker processes, requests over HTTP.

The time of a step is from the request until its ghost is handed to the scene: planning in a worker, storing and logging
the product, telling the scene, and the drawing thread's way to the ghost. The page that looks is no browser: it throws
away what it hears. Wall-clock times.
"""

import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import httpx
import numpy as np

import footfall
from benchmarks.console.scene_line import looking
from benchmarks.scenes import robot
from benchmarks.step import targets
from benchmarks.timing import Figure
from footfall.planning.answers import Status
from footfall.session.jobs.local import Jobs
from footfall.session.registry import Sessions
from footfall.terrain.generate import plane
from footfall_ui.app import Server, create_app
from footfall_ui.listening import address_of, listen
from footfall_ui.scene.ghost import GhostDrawing

SESSION = "/sessions/current"
PAGE = "ghosts"
WARMING = 15.0
"""How long the operator does something else first [s]; the workers load their compiled code meanwhile."""


@contextmanager
def console() -> Iterator[httpx.Client]:
    """A client of a server with a scene, whose session has open ground and the state that the rover stands in."""
    with (
        TemporaryDirectory(prefix="footfall-bench-") as folder,
        Jobs(warm=True) as jobs,
        closing(listen("127.0.0.1", 0)) as listening,
        Sessions(Path(folder), jobs) as sessions,
    ):
        live, ground = sessions.create("console"), plane(size=8.0, resolution=0.02)
        live.terrains.load(ground, "made for the benchmark")
        live.stances.set(footfall.stand(live.robot, ground))
        ready = threading.Event()
        server = Server(create_app(sessions, scene=True), listening, lambda _: ready.set())
        thread = threading.Thread(target=server.run, name="server")
        thread.start()
        try:
            if not ready.wait(60):
                raise RuntimeError("the server did not start within 60 s")
            url = address_of(listening)
            known = {"base_url": f"{url}/api/v1", "headers": {"FootFall-Page": PAGE}}
            with looking(url, PAGE), httpx.Client(**known, timeout=60, trust_env=False) as client:
                yield client
        finally:
            server.should_exit = True
            thread.join(timeout=20)


class Ghosts:
    """Hears when another ghost is handed to the scene."""

    def __init__(self) -> None:
        self.shown, self.at, self._last = threading.Event(), 0.0, b""

    def heard(self, motion: object) -> None:
        waypoints = np.asarray(motion.waypoints).tobytes()  # type: ignore[attr-defined]
        if waypoints != self._last:
            self.at, self._last = time.perf_counter(), waypoints
            self.shown.set()


def step(client: httpx.Client, ghosts: Ghosts, leg: int, x: float, y: float) -> float:
    """Seconds from the request of a plan to its ghost."""
    ghosts.shown.clear()
    begin = time.perf_counter()
    answer = client.post(f"{SESSION}/plans", json={"leg": leg, "target": [x, y]})
    if answer.status_code != 202:
        raise RuntimeError(answer.text)
    if not ghosts.shown.wait(60):
        raise RuntimeError(f"no ghost of leg {leg} stepping to ({x:.2f}, {y:.2f}) within 60 s")
    return ghosts.at - begin


def figures(quick: bool) -> Iterator[Figure]:
    ground = plane(size=8.0, resolution=0.02)
    standing = footfall.stand(robot(), ground)
    asked = [
        (leg, x, y)
        for leg, x, y in targets(ground, standing, 8 if quick else 24)
        if footfall.plan_step(robot(), ground, standing, leg, (x, y)).status is Status.FOUND
    ]
    ghosts = Ghosts()
    drawn = GhostDrawing.show

    def show(self: GhostDrawing, robot: object, motion: object, moment: float) -> None:
        drawn(self, robot, motion, moment)  # type: ignore[arg-type]
        ghosts.heard(motion)

    with patch.object(GhostDrawing, "show", show), console() as client:
        time.sleep(WARMING)
        yield Figure("console.first_step_to_ghost", (step(client, ghosts, *asked[0]),), "s")
        times = tuple(step(client, ghosts, *one) for one in asked[1:])
        yield Figure("console.step_to_ghost", times, "s", 0.15)
