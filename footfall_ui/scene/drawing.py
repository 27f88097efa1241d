"""Follows the current session and brings every drawn thing up to date, in one ordered thread."""

from collections.abc import Callable

import numpy as np
import viser

from footfall.core.frames import rotation
from footfall.planning.execution.problem import ExecutionResult
from footfall.planning.gait.problem import GaitResult
from footfall.planning.step.problem import PlanResult, StepPlan
from footfall.planning.walk.problem import WalkPlan
from footfall.robot.model import Robot
from footfall.sequence.commands import Sequence
from footfall.session.access.acting import acting
from footfall.session.access.identity import Identity
from footfall.session.live import LiveSession
from footfall.session.products.kinds import WALK
from footfall.session.steadiness import friction_of
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall_ui.scene.age import AgeDrawing
from footfall_ui.scene.around import AroundDrawing
from footfall_ui.scene.cameras import CamerasDrawing
from footfall_ui.scene.clicks import choose
from footfall_ui.scene.collision import CollisionDrawing, colliding
from footfall_ui.scene.contours import ContoursDrawing
from footfall_ui.scene.drawn import server_of
from footfall_ui.scene.failing import FailingDrawing
from footfall_ui.scene.footfall import FootfallDrawing
from footfall_ui.scene.forces import ForcesDrawing
from footfall_ui.scene.ghost import GhostDrawing
from footfall_ui.scene.goal import GoalDrawing
from footfall_ui.scene.hand import HandPart
from footfall_ui.scene.labels import labels_of
from footfall_ui.scene.look import Eye, Looking
from footfall_ui.scene.of_session import accepted, played, read, rover_state, walk_here
from footfall_ui.scene.path import PathDrawing
from footfall_ui.scene.predicted import PredictedDrawing, alongside, row_under_way
from footfall_ui.scene.redrawing import Redrawing
from footfall_ui.scene.robot import RobotDrawing, leg_links
from footfall_ui.scene.route import RouteDrawing
from footfall_ui.scene.sag import SagDrawing
from footfall_ui.scene.shadow import ShadowDrawing
from footfall_ui.scene.suggested import SuggestedDrawing
from footfall_ui.scene.support import SupportDrawing
from footfall_ui.scene.swept import SweptDrawing
from footfall_ui.scene.tape import TapeDrawing
from footfall_ui.scene.terrain import TerrainDrawing
from footfall_ui.scene.tether import TetherDrawing
from footfall_ui.scene.torque import TorqueDrawing
from footfall_ui.scene.tracks import TracksDrawing
from footfall_ui.scene.walk import WalkDrawing
from footfall_ui.scene.what_if import WhatIfDrawing
from footfall_ui.visitors import Visitors

VIEW_DISTANCE, VIEW_HEIGHT = 6.2, 3.4
"""Of the first view from the middle of the rover [m]."""
VIEW_ASIDE = 0.7
"""Angle between the first view and the leg [rad]."""
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
        self._drawn: LiveSession | None = None
        self._unlisten: Callable[[], None] = lambda: None
        self._rover: RobotDrawing | None = None
        self._torques: TorqueDrawing | None = None
        self._cameras: CamerasDrawing | None = None
        self._robot: Robot | None = None
        self._terrain = TerrainDrawing(server)
        self._footfall = FootfallDrawing(server)
        self._suggested = SuggestedDrawing(server)
        self._ghost = GhostDrawing(server)
        self._swept = SweptDrawing(server)
        self._path = PathDrawing(server)
        self._forces = ForcesDrawing(server)
        self._support = SupportDrawing(server)
        self._collision = CollisionDrawing(server)
        self._predicted = PredictedDrawing(server)
        self._what_if = WhatIfDrawing(server)
        self._sag = SagDrawing(server)
        self._walk = WalkDrawing(server)
        self._tether = TetherDrawing(server)
        self._failing = FailingDrawing(server)
        self._tape = TapeDrawing(server)
        self._looking = Looking(server)
        self._hand = HandPart(server, lambda: self._live, self._visitors)
        parts: dict[str, Callable[[LiveSession], None]] = {
            "robot": self._draw_robot,
            "rover": self._draw_rover,
            "ground": self._draw_ground,
            "age": AgeDrawing(server).draw,
            "contours": ContoursDrawing(server).draw,
            "tracks": TracksDrawing(server).draw,
            "shadow": ShadowDrawing(server).draw,
            "around": AroundDrawing(server, lambda: self._visitors.theme_of(self._who)).draw,
            "torques": self._draw_torques,
            "forces": self._draw_forces,
            "support": self._draw_support,
            "cameras": self._draw_cameras,
            "what if": self._draw_what_if,
            "footfall": self._draw_footfall,
            "suggestions": self._draw_suggestions,
            "plan": self._draw_plan,
            "walk": self._draw_walk,
            "tether": self._draw_tether,
            "failing": self._draw_failing,
            "goal": GoalDrawing(server).draw,
            "route": RouteDrawing(server).draw,
            "collision": self._draw_collision,
            "ghost": self._draw_ghost,
            "swept": self._draw_swept,
            "sag": self._draw_sag,
            "predicted": self._draw_predicted,
            "tape": self._draw_tape,
            "look": self._draw_look,
            "hand": self._hand.draw,
            "labels": lambda _: labels_of(server).arrange(server),
        }
        self._redrawing = Redrawing({name: self._of_session(draw) for name, draw in parts.items()})
        labels_of(server).follow(server, lambda: self._redrawing.mark("labels"))
        self._undress = self._visitors.listen(who, lambda: self._redrawing.mark("around"))

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

    # -- the rover -----------------------------------------------------------------------------

    def _draw_robot(self, live: LiveSession) -> None:
        if live is self._drawn:
            return
        for drawing in (self._torques, self._cameras, self._ghost, self._predicted, self._swept, self._path):
            if drawing is not None:
                drawing.hide()
        for copy in (self._rover, self._what_if, self._sag):
            if copy is not None:
                copy.remove()
        for drawing in (self._support, self._forces, self._collision, self._failing):
            drawing.hide()
        if live.described is not None:
            self._robot, self._rover, self._torques, self._cameras, self._drawn = None, None, None, None, live
            return
        self._robot = live.robot
        if self._drawn is None or self._drawn.id != live.id:  # of its past the view stays
            self._look_along(live.choices.view.leg)
        if self._drawn is not None:  # a page that opens takes the look that it shows as chosen
            self._looking.forget(live.choices.view.looks)
        self._rover = RobotDrawing(self._server, self._robot)
        self._torques = TorqueDrawing(self._server, self._robot)
        self._cameras = CamerasDrawing(self._server, self._robot.description)
        self._drawn = live

    def _look_along(self, leg: int) -> None:
        """Where a page that opens looks from: outside the leg that is worked with, a little to its side."""
        if self._robot is None:
            return
        out = self._robot.description.legs[leg].T_base_hip[:2, :2] @ rotation("z", VIEW_ASIDE)[:2, :2]
        away = VIEW_DISTANCE * out[:, 0]
        self._looking.begin(Eye(np.array([*away, VIEW_HEIGHT]), np.array([*(0.15 * away), 0.4])))

    def _draw_rover(self, live: LiveSession) -> None:
        if self._rover is None or self._robot is None:
            return
        state = rover_state(live)
        if state is None:
            self._rover.hide()
            return
        self._rover.place(state.posture, state.T_site_base)
        self._rover.highlight(leg_links(self._robot, live.choices.view.leg), self._colliding(live))

    def _draw_torques(self, live: LiveSession) -> None:
        state = rover_state(live)
        if self._torques is None:
            return
        if state is None or not live.choices.view.shown.torques:
            self._torques.hide()
        else:
            self._torques.show(state)

    def _draw_forces(self, live: LiveSession) -> None:
        state = rover_state(live)
        if state is None or self._robot is None or not live.choices.view.shown.forces:
            self._forces.hide()
        else:
            self._forces.show(self._robot, state, live.choices.view.leg)

    def _draw_support(self, live: LiveSession) -> None:
        state = rover_state(live)
        if state is None or self._robot is None or not live.choices.view.shown.support:
            self._support.hide()
        else:
            dem = read(live, live.state.dem, Dem) if live.state.dem else None
            self._support.show(self._robot, state, dem, friction_of(live), live.choices.view.shown.region)

    def _draw_cameras(self, live: LiveSession) -> None:
        if self._cameras is None:
            return
        (self._cameras.show if live.choices.view.shown.cameras else self._cameras.hide)()

    def _draw_predicted(self, live: LiveSession) -> None:
        row, run, frame = row_under_way(live.state), live.state.run, live.rover.frame
        shown = live.choices.view.shown.predicted
        if row is None or run is None or frame is None or self._robot is None or not shown:
            self._predicted.hide()
            return
        sequence = read(live, run.sequence, Sequence)
        self._predicted.show(self._robot, alongside(self._robot, sequence, row, frame.state))

    def _draw_look(self, live: LiveSession) -> None:
        state, view = rover_state(live), live.choices.view
        if state is not None and self._robot is not None:
            self._looking.look(view.look, view.looks, self._robot, state, view.leg)

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
        if dragged is not None and self._robot is not None:
            self._what_if.show(self._robot, dragged)
        elif state.what_if is None or state.state is None or self._robot is None:
            self._what_if.hide()
        else:
            self._what_if.show(self._robot, read(live, state.state, RobotState))

    def _draw_footfall(self, live: LiveSession) -> None:
        chosen = live.choices.now.footfall
        if chosen is None or live.state.dem is None or self._robot is None:
            self._footfall.hide()
            return
        answer = live.maps.footfall_answer(chosen)
        if not answer["known"]:
            self._footfall.hide()
            return
        point = np.array([answer["x"], answer["y"], answer["z"]])
        normal = np.array(answer["normal"]) if answer["normal"] else np.array([0.0, 0.0, 1.0])
        self._footfall.show(
            point, normal, self._robot.wheel_radius, accepted(live, chosen, answer), f"leg {chosen.leg}"
        )

    def _draw_suggestions(self, live: LiveSession) -> None:
        found = live.maps.suggestions_shown(live.choices.view.leg) if live.choices.view.shown.suggestions else None
        if found is None:
            self._suggested.hide()
        else:
            self._suggested.show(found)

    def _draw_tape(self, live: LiveSession) -> None:
        self._tape.show(live.choices.view.tape if live.choices.view.shown.tape else ())

    # -- what is planned -----------------------------------------------------------------------

    def _draw_plan(self, live: LiveSession) -> None:
        plan: StepPlan | None = None
        if live.state.plan is not None:
            plan = read(live, live.state.plan, PlanResult).plan
        if plan is None or self._robot is None:
            self._path.hide()
            return
        self._path.show(self._robot, plan)

    def _draw_walk(self, live: LiveSession) -> None:
        result = walk_here(live)
        if result is None:
            self._walk.hide()
        else:
            self._walk.show(result)

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
        if isinstance(result, GaitResult) and self._robot is not None:
            self._failing.show(self._robot, result)
        else:
            self._failing.hide()

    def _colliding(self, live: LiveSession) -> tuple[str, ...]:
        if live.state.plan is None or self._robot is None:
            return ()
        return colliding(read(live, live.state.plan, PlanResult), self._robot.description.meshes)

    def _draw_collision(self, live: LiveSession) -> None:
        state, pair = rover_state(live), self._colliding(live)
        if state is None or not pair or self._robot is None:
            self._collision.hide()
        else:
            self._collision.show(self._robot, state, pair)

    def _draw_ghost(self, live: LiveSession) -> None:
        motion = played(live)
        if motion is None or self._robot is None or not live.choices.view.show_ghost:
            self._ghost.hide()
        else:
            self._ghost.show(self._robot, motion, live.choices.view.scrub)

    def _draw_swept(self, live: LiveSession) -> None:
        motion = played(live) if live.choices.view.shown.swept else None
        if motion is None or live.review.played is None or self._robot is None:
            self._swept.hide()
        else:
            self._swept.show(self._robot, motion, live.review.played)

    def _draw_sag(self, live: LiveSession) -> None:
        chosen = live.state.execution
        done = None if chosen is None else read(live, chosen, ExecutionResult).execution
        if done is None or self._robot is None:
            self._sag.hide()
        else:
            # the ghost of its commands is this very motion
            follows = live.choices.view.show_ghost and live.review.played == live.state.plan
            self._sag.show(self._robot, done, live.choices.view.scrub if follows else None)

    # -- clicks --------------------------------------------------------------------------------

    def _clicked(self, event: viser.SceneClickEvent) -> None:
        origin, direction = np.array(event.ray_origin), np.array(event.ray_direction)
        who = self._visitors.of(server_of(self._server), event.client_id)

        def chosen() -> None:
            if self._live is not None:
                with acting(who):
                    choose(self._live, origin, direction)

        self._redrawing.soon(chosen)
