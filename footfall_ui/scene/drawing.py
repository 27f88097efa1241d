"""Follows the current session and brings every drawn thing up to date, in one ordered thread."""

import logging
import queue
import threading
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
import viser

from footfall.core.frames import rotation
from footfall.core.value import Value
from footfall.planning.step.problem import Footfall, PlanResult, StepPlan
from footfall.robot.model import Robot
from footfall.session.live import LiveSession
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.surface import pick
from footfall_ui.scene.footfall import FootfallDrawing
from footfall_ui.scene.ghost import GhostDrawing
from footfall_ui.scene.path import PathDrawing
from footfall_ui.scene.robot import RobotDrawing, leg_links
from footfall_ui.scene.support import SupportDrawing
from footfall_ui.scene.terrain import TerrainDrawing
from footfall_ui.scene.what_if import WhatIfDrawing

_log = logging.getLogger(__name__)
_V = TypeVar("_V", bound=Value)

VIEW_DISTANCE, VIEW_HEIGHT = 6.2, 3.4
"""Of the first view from the middle of the rover [m]."""
VIEW_ASIDE = 0.7
"""Angle between the first view and the leg [rad]."""


class Scene:
    """Draws one session at a time into a viser server.

    Messages of the session only mark what is out of date; the drawing thread does the work, so a
    slow picture delays neither commands nor telemetry.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        server.scene.set_up_direction("+z")
        server.scene.world_axes.visible = False
        server.gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
        server.scene.configure_default_lights(enabled=True, cast_shadow=False)
        server.scene.on_click()(self._clicked)
        self._work: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._pending = threading.Lock()
        self._marked: set[str] = set()
        self._live: LiveSession | None = None
        self._unlisten: Callable[[], None] = lambda: None
        self._rover: RobotDrawing | None = None
        self._robot: Robot | None = None
        self._terrain = TerrainDrawing(server)
        self._footfall = FootfallDrawing(server)
        self._ghost = GhostDrawing(server)
        self._path = PathDrawing(server)
        self._support = SupportDrawing(server)
        self._what_if = WhatIfDrawing(server)
        self._thread = threading.Thread(target=self._run, name="scene", daemon=True)
        self._thread.start()

    def follow(self, live: LiveSession) -> None:
        """Draw this session from now on."""
        self._unlisten()
        self._live = live
        self._unlisten = live.listen(self._heard)
        self._work.put(self._new_robot)
        self._mark("rover", "all")

    def close(self) -> None:
        """Stop drawing."""
        self._unlisten()
        self._work.put(None)
        self._thread.join(timeout=10)

    def _heard(self, message: dict) -> None:
        if message["type"] == "telemetry":
            self._mark("rover")
        elif message["type"] in ("event", "view", "preview"):
            self._mark("rover", "all")

    def _mark(self, *parts: str) -> None:
        with self._pending:
            idle = not self._marked
            self._marked.update(parts)
        if idle:
            self._work.put(self._redraw)

    def _run(self) -> None:
        while (job := self._work.get()) is not None:
            try:
                job()
            except Exception:
                # The scene is a view: one thing that can't be drawn must not end the drawing of the rest.
                _log.exception("the scene could not be drawn")

    def _new_robot(self) -> None:
        if self._live is None:
            return
        if self._rover is not None:
            self._rover.remove()
        self._ghost.hide()
        self._what_if.remove()
        self._robot = self._live.robot
        self._look_along(self._live.view.leg)
        self._rover = RobotDrawing(self._server, self._robot)

    def _look_along(self, leg: int) -> None:
        """Where a page that opens looks from: outside the leg that is worked with, a little to its side."""
        if self._robot is None:
            return
        out = self._robot.description.legs[leg].T_base_hip[:2, :2] @ rotation("z", VIEW_ASIDE)[:2, :2]
        self._server.initial_camera.position = (*(VIEW_DISTANCE * out[:, 0]), VIEW_HEIGHT)
        self._server.initial_camera.look_at = (*(0.15 * VIEW_DISTANCE * out[:, 0]), 0.4)

    def _redraw(self) -> None:
        with self._pending:
            marked, self._marked = self._marked, set()
        live = self._live
        if live is None:
            return
        if "rover" in marked:
            self._draw_rover(live)
        if "all" in marked:
            self._draw_ground(live)
            self._draw_what_if(live)
            self._draw_footfall(live)
            self._draw_plan(live)

    def _draw_rover(self, live: LiveSession) -> None:
        if self._rover is None or self._robot is None:
            return
        if live.frame is not None:
            state = live.frame.state
        elif live.state.state is not None:
            state = _read(live, live.state.state, RobotState)
        else:
            self._rover.hide()
            return
        self._rover.place(state.posture, state.T_site_base)
        self._rover.highlight(leg_links(self._robot, live.view.leg))
        if state.mode != "moving":
            self._support.show(self._robot, state)

    def _draw_ground(self, live: LiveSession) -> None:
        dem = _read(live, live.state.dem, Dem) if live.state.dem else None
        # maps of an older terrain or posture are not shown: their green would be a wrong green
        self._terrain.show(dem, live.maps_shown(live.view.leg), live.view.layer)

    def _draw_what_if(self, live: LiveSession) -> None:
        state = live.state
        if state.what_if is None or state.state is None or self._robot is None:
            self._what_if.hide()
        else:
            self._what_if.show(self._robot, _read(live, state.state, RobotState))

    def _draw_footfall(self, live: LiveSession) -> None:
        chosen = live.state.footfall
        if chosen is None or live.state.dem is None or self._robot is None:
            self._footfall.hide()
            return
        answer = live.footfall_answer(chosen)
        if not answer["known"]:
            self._footfall.hide()
            return
        point = np.array([answer["x"], answer["y"], answer["z"]])
        normal = np.array(answer["normal"]) if answer["normal"] else np.array([0.0, 0.0, 1.0])
        self._footfall.show(
            point, normal, self._robot.wheel_radius, _accepted(live, chosen, answer), f"leg {chosen.leg}"
        )

    def _draw_plan(self, live: LiveSession) -> None:
        plan: StepPlan | None = None
        if live.state.plan is not None:
            plan = _read(live, live.state.plan, PlanResult).plan
        if plan is None or self._robot is None:
            self._path.hide()
            self._ghost.hide()
            return
        self._path.show(self._robot, plan)
        if live.view.show_ghost:
            self._ghost.show(self._robot, plan, live.view.scrub)
        else:
            self._ghost.hide()

    def _clicked(self, event: viser.SceneClickEvent) -> None:
        origin, direction = np.array(event.ray_origin), np.array(event.ray_direction)
        self._work.put(lambda: self._choose(origin, direction))

    def _choose(self, origin: np.ndarray, direction: np.ndarray) -> None:
        live = self._live
        if live is None or live.state.dem is None:
            return
        point = pick(_read(live, live.state.dem, Dem), origin, direction)
        if point is not None:
            live.choose_footfall(live.view.leg, float(point[0]), float(point[1]))


def _accepted(live: LiveSession, chosen: Footfall, answer: dict[str, Any]) -> bool | None:
    """What the plan for this footfall says; without one, what the maps say."""
    if live.state.plan is not None:
        result = _read(live, live.state.plan, PlanResult)
        if result.footfall.digest == chosen.digest and result.provenance.parents["dem"] == live.state.dem:
            return result.plan is not None
    return answer["acceptable"]


def _read(live: LiveSession, digest: str, kind: type[_V]) -> _V:
    found = live.get(digest)
    if not isinstance(found, kind):
        raise TypeError(f"{digest} is a {type(found).__name__}, not a {kind.__name__}")
    return found
