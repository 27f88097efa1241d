"""Follows the current session and brings every drawn thing up to date, in one ordered thread."""

from collections.abc import Callable

import numpy as np
import viser

from footfall.planning.execution.problem import ExecutionResult
from footfall.planning.gait.problem import GaitResult
from footfall.planning.walk.problem import WalkPlan
from footfall.session.access.acting import acting
from footfall.session.access.identity import Identity
from footfall.session.live import LiveSession
from footfall.session.products.kinds import WALK
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall_ui.scene.age import AgeDrawing
from footfall_ui.scene.any_robot import leg_name, size, sole_radius
from footfall_ui.scene.around import AroundDrawing
from footfall_ui.scene.clicks import choose
from footfall_ui.scene.contours import ContoursDrawing
from footfall_ui.scene.drawn import server_of
from footfall_ui.scene.failing import FailingDrawing
from footfall_ui.scene.footfall import FootfallDrawing
from footfall_ui.scene.ghost import GhostDrawing
from footfall_ui.scene.goal import GoalDrawing
from footfall_ui.scene.hand import HandPart
from footfall_ui.scene.labels import labels_of
from footfall_ui.scene.of_session import accepted, played, read, step_plan, walk_here
from footfall_ui.scene.path import PathDrawing
from footfall_ui.scene.redrawing import Redrawing
from footfall_ui.scene.route import RouteDrawing
from footfall_ui.scene.rover import RoverPart
from footfall_ui.scene.sag import SagDrawing
from footfall_ui.scene.shadow import ShadowDrawing
from footfall_ui.scene.suggested import SuggestedDrawing
from footfall_ui.scene.swept import SweptDrawing
from footfall_ui.scene.tape import TapeDrawing
from footfall_ui.scene.terrain import TerrainDrawing
from footfall_ui.scene.tether import TetherDrawing
from footfall_ui.scene.tracks import TracksDrawing
from footfall_ui.scene.walk import WalkDrawing
from footfall_ui.scene.what_if import WhatIfDrawing
from footfall_ui.visitors import Visitors

MOVING = ("rover", "shadow", "torques", "forces", "support", "collision", "predicted", "look", "labels")
"""The parts that follow telemetry."""


class Scene:
    """Draws a session for a page of viser, as chosen there, or for a whole server, as chosen last. What it hears only
    marks what is out of date: a thread draws, and a slow picture delays neither commands nor telemetry.
    """

    def __init__(
        self,
        server: viser.ViserServer | viser.ClientHandle,
        visitors: Visitors | None = None,
        who: Identity | None = None,
    ) -> None:
        """visitors: who sits at which page, None: nobody knows; who: at this one, None: at any."""
        self._server, self._visitors, self._who = server, visitors or Visitors(), who
        server.scene.on_click()(self._clicked)
        self._live: LiveSession | None = None
        self._unlisten: Callable[[], None] = lambda: None
        self._rover = RoverPart(server, self._turned)
        self._terrain = TerrainDrawing(server)
        self._footfall = FootfallDrawing(server)
        self._suggested = SuggestedDrawing(server)
        self._ghost = GhostDrawing(server)
        self._swept = SweptDrawing(server)
        self._path = PathDrawing(server)
        self._what_if = WhatIfDrawing(server)
        self._sag = SagDrawing(server)
        self._walk = WalkDrawing(server)
        self._tether = TetherDrawing(server)
        self._failing = FailingDrawing(server)
        self._tape = TapeDrawing(server)
        self._hand = HandPart(server, lambda: self._live, self._visitors)
        parts: dict[str, Callable[[LiveSession], None]] = {
            "robot": self._draw_robot,
            "rover": self._rover.draw,
            "ground": self._draw_ground,
            "age": AgeDrawing(server).draw,
            "contours": ContoursDrawing(server).draw,
            "tracks": TracksDrawing(server).draw,
            "shadow": ShadowDrawing(server).draw,
            "around": AroundDrawing(server, lambda: self._visitors.theme_of(self._who)).draw,
            "torques": self._rover.draw_torques,
            "forces": self._rover.draw_forces,
            "support": self._rover.draw_support,
            "cameras": self._rover.draw_cameras,
            "what if": self._draw_what_if,
            "footfall": self._draw_footfall,
            "suggestions": self._draw_suggestions,
            "plan": self._draw_plan,
            "walk": self._draw_walk,
            "tether": self._draw_tether,
            "failing": self._draw_failing,
            "goal": GoalDrawing(server).draw,
            "route": RouteDrawing(server).draw,
            "collision": self._rover.draw_collision,
            "ghost": self._draw_ghost,
            "swept": self._draw_swept,
            "sag": self._draw_sag,
            "predicted": self._rover.draw_predicted,
            "tape": self._draw_tape,
            "look": self._rover.look,
            "hand": self._hand.draw,
            "labels": lambda _: labels_of(server).arrange(server),
        }
        self._redrawing = Redrawing({name: self._of_session(draw) for name, draw in parts.items()})
        labels_of(server).follow(server, lambda: self._redrawing.mark("labels"), lambda: self._visitors.size_of(who))
        self._undress = self._visitors.listen(who, lambda: self._redrawing.mark("around", "labels"))

    def is_of(self, who: Identity) -> bool:
        """Whether it is that page's."""
        return self._who is not None and self._who.seat == who.seat

    def follow(self, live: LiveSession) -> None:
        """Draw this session from now on."""
        self._unlisten()
        self._live = live
        self._unlisten = live.listen(self._heard)
        self._redrawing.mark()

    def close(self) -> None:
        """Stop drawing."""
        self._unlisten()
        self._undress()
        self._hand.close()
        self._redrawing.close()

    def _heard(self, message: dict) -> None:
        if message["type"] == "telemetry":
            self._redrawing.mark(*MOVING)
        elif message["type"] == "hand":
            self._redrawing.mark("hand", "what if")
        elif message["type"] == "view" and not self._concerns(message["seat"]):
            return
        elif message["type"] in ("event", "view", "preview", "fits"):
            self._redrawing.mark()

    def _concerns(self, seat: str) -> bool:
        return self._who is None or self._live is None or self._live.choices.concerns(self._who, seat)

    def _of_session(self, draw: Callable[[LiveSession], None]) -> Callable[[], None]:
        def drawn() -> None:
            if self._live is not None:
                with acting(self._who):
                    draw(self._live)

        return drawn

    def _draw_robot(self, live: LiveSession) -> None:
        if self._rover.is_of(live):
            return
        for drawing in (self._ghost, self._swept, self._path, self._failing):
            drawing.hide()
        for copy in (self._what_if, self._sag):
            copy.remove()
        self._rover.take(live)

    # -- the ground and what is chosen on it ---------------------------------------------------

    def _draw_ground(self, live: LiveSession) -> None:
        dem = read(live, live.state.dem, Dem) if live.state.dem else None
        # where maps are of older ground or another posture they are not shown: their green would be a wrong green
        leg, layer = live.choices.view.leg, live.choices.view.layer
        self._terrain.show(
            dem, live.maps.shown(leg), layer, live.fits.maps_changed(leg, layer or ""), live.choices.view.opacity
        )

    def _draw_what_if(self, live: LiveSession) -> None:
        state, dragged = live.state, self._hand.stance(live)
        if dragged is not None:
            self._what_if.show(live.any_robot, dragged)
        elif state.what_if is None or state.state is None:
            self._what_if.hide()
        else:
            self._what_if.show(live.any_robot, read(live, state.state, RobotState))

    def _draw_footfall(self, live: LiveSession) -> None:
        chosen = live.choices.now.footfall
        if chosen is None or live.state.dem is None:
            self._footfall.hide()
            return
        answer = live.maps.footfall_answer(chosen)
        if not answer["known"]:
            self._footfall.hide()
            return
        point = np.array([answer["x"], answer["y"], answer["z"]])
        normal = np.array(answer["normal"]) if answer["normal"] else np.array([0.0, 0.0, 1.0])
        robot, leg = live.any_robot, chosen.leg
        yes = accepted(live, chosen, answer)
        self._footfall.show(point, normal, sole_radius(robot, leg), yes, leg_name(robot, leg), size(robot))

    def _draw_suggestions(self, live: LiveSession) -> None:
        found = live.maps.suggestions_shown(live.choices.view.leg) if live.choices.view.shown.suggestions else None
        if found is None:
            self._suggested.hide()
        else:
            self._suggested.show(found)

    def _draw_tape(self, live: LiveSession) -> None:
        self._tape.show(live.choices.view.tape if live.choices.view.shown.tape else (), size(live.any_robot))

    # -- what is planned -----------------------------------------------------------------------

    def _draw_plan(self, live: LiveSession) -> None:
        plan = step_plan(live)
        if plan is None:
            self._path.hide()
        else:
            self._path.show(live.any_robot, plan)

    def _draw_walk(self, live: LiveSession) -> None:
        result = walk_here(live)
        if result is None:
            self._walk.hide()
        else:
            self._walk.show(live.any_robot, result)

    def _draw_tether(self, live: LiveSession) -> None:
        result = walk_here(live)
        plan = None if result is None else result.plan or result.partial
        if not isinstance(plan, WalkPlan) or plan.tethered is None:
            self._tether.hide()
        else:
            follows = live.choices.view.show_ghost and live.review.played == live.state.newest(WALK)
            self._tether.show(plan, plan.tethered, live.choices.view.scrub if follows else 0.0)

    def _draw_failing(self, live: LiveSession) -> None:
        result = walk_here(live)
        if isinstance(result, GaitResult):
            self._failing.show(live.robot, result)
        else:
            self._failing.hide()

    def _draw_ghost(self, live: LiveSession) -> None:
        motion = played(live)
        if motion is None or not live.choices.view.show_ghost:
            self._ghost.hide()
        else:
            self._ghost.show(live.any_robot, motion, live.choices.view.scrub)

    def _draw_swept(self, live: LiveSession) -> None:
        motion = played(live) if live.choices.view.shown.swept else None
        if motion is None or live.review.played is None:
            self._swept.hide()
        else:
            self._swept.show(live.any_robot, motion, live.review.played)

    def _draw_sag(self, live: LiveSession) -> None:
        chosen = live.state.execution
        done = None if chosen is None else read(live, chosen, ExecutionResult).execution
        if done is None:
            self._sag.hide()
        else:
            # the ghost of its commands is this very motion
            follows = live.choices.view.show_ghost and live.review.played == live.state.plan
            self._sag.show(live.robot, done, live.choices.view.scrub if follows else None)

    # -- clicks --------------------------------------------------------------------------------

    def _turned(self) -> None:
        def freed() -> None:
            if self._live is None:
                return
            with acting(self._who):
                if not self._live.choices.view.follows:
                    self._live.choices.set_view(look="free")

        self._redrawing.soon(freed)

    def _clicked(self, event: viser.SceneClickEvent) -> None:
        origin, direction = np.array(event.ray_origin), np.array(event.ray_direction)
        who = self._visitors.of(server_of(self._server), event.client_id)

        def chosen() -> None:
            if self._live is not None:
                with acting(who):
                    choose(self._live, origin, direction)

        self._redrawing.soon(chosen)
