"""The rover as telemetry tells of it: its links, what works on them and on its wheels, and from where it is seen."""

import numpy as np
import viser

from footfall.core.frames import rotation
from footfall.planning.step.problem import PlanResult
from footfall.robot.model import Robot
from footfall.sequence.commands import Sequence
from footfall.session.live import LiveSession
from footfall.session.steadiness import friction_of
from footfall.terrain.dem import Dem
from footfall_ui.scene.cameras import CamerasDrawing
from footfall_ui.scene.collision import CollisionDrawing, colliding
from footfall_ui.scene.forces import ForcesDrawing
from footfall_ui.scene.look import Eye, Looking
from footfall_ui.scene.of_session import read, rover_state
from footfall_ui.scene.predicted import PredictedDrawing, alongside, row_under_way
from footfall_ui.scene.robot import RobotDrawing, leg_links
from footfall_ui.scene.support import SupportDrawing
from footfall_ui.scene.torque import TorqueDrawing

VIEW_DISTANCE, VIEW_HEIGHT = 6.2, 3.4
"""Of the first view from the middle of the rover [m]."""
VIEW_ASIDE = 0.7
"""Angle between the first view and the leg [rad]."""


class RoverPart:
    """Draws one session's rover at a time. robot: that session's; None where it can't be drawn."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self.robot: Robot | None = None
        self._server = server
        self._of: LiveSession | None = None
        self._rover: RobotDrawing | None = None
        self._torques: TorqueDrawing | None = None
        self._cameras: CamerasDrawing | None = None
        self._forces = ForcesDrawing(server)
        self._support = SupportDrawing(server)
        self._collision = CollisionDrawing(server)
        self._predicted = PredictedDrawing(server)
        self._looking = Looking(server)

    def is_of(self, live: LiveSession) -> bool:
        """Whether it is that session's rover."""
        return live is self._of

    def take(self, live: LiveSession) -> None:
        """Draw that session's from now on."""
        for drawing in (self._torques, self._cameras):
            if drawing is not None:
                drawing.hide()
        for drawing in (self._predicted, self._support, self._forces, self._collision):
            drawing.hide()
        if self._rover is not None:
            self._rover.remove()
        if live.described is not None:
            self.robot, self._rover, self._torques, self._cameras, self._of = None, None, None, None, live
            return
        self.robot = live.robot
        if self._of is None or self._of.id != live.id:  # of its past the view stays
            self._look_along(self.robot, live.choices.view.leg)
        if self._of is not None:  # a page that opens takes the look that it shows as chosen
            self._looking.forget(live.choices.view.looks)
        self._rover = RobotDrawing(self._server, self.robot)
        self._torques = TorqueDrawing(self._server, self.robot)
        self._cameras = CamerasDrawing(self._server, self.robot.description)
        self._of = live

    def _look_along(self, robot: Robot, leg: int) -> None:
        """Where a page that opens looks from: outside the leg that is worked with, a little to its side."""
        out = robot.description.legs[leg].T_base_hip[:2, :2] @ rotation("z", VIEW_ASIDE)[:2, :2]
        away = VIEW_DISTANCE * out[:, 0]
        self._looking.begin(Eye(np.array([*away, VIEW_HEIGHT]), np.array([*(0.15 * away), 0.4])))

    def draw(self, live: LiveSession) -> None:
        """Its links where telemetry has them."""
        if self._rover is None or self.robot is None:
            return
        state = rover_state(live)
        if state is None:
            self._rover.hide()
            return
        self._rover.place(state.posture, state.T_site_base)
        self._rover.highlight(leg_links(self.robot, live.choices.view.leg), self._colliding(live))

    def draw_torques(self, live: LiveSession) -> None:
        state = rover_state(live)
        if self._torques is None:
            return
        if state is None or not live.choices.view.shown.torques:
            self._torques.hide()
        else:
            self._torques.show(state)

    def draw_forces(self, live: LiveSession) -> None:
        state = rover_state(live)
        if state is None or self.robot is None or not live.choices.view.shown.forces:
            self._forces.hide()
        else:
            self._forces.show(self.robot, state, live.choices.view.leg)

    def draw_support(self, live: LiveSession) -> None:
        state = rover_state(live)
        if state is None or self.robot is None or not live.choices.view.shown.support:
            self._support.hide()
        else:
            dem = read(live, live.state.dem, Dem) if live.state.dem else None
            self._support.show(self.robot, state, dem, friction_of(live), live.choices.view.shown.region)

    def draw_cameras(self, live: LiveSession) -> None:
        if self._cameras is None:
            return
        (self._cameras.show if live.choices.view.shown.cameras else self._cameras.hide)()

    def draw_predicted(self, live: LiveSession) -> None:
        """Where it was to be in the row that it carries out."""
        row, run, frame = row_under_way(live.state), live.state.run, live.rover.frame
        shown = live.choices.view.shown.predicted
        if row is None or run is None or frame is None or self.robot is None or not shown:
            self._predicted.hide()
            return
        sequence = read(live, run.sequence, Sequence)
        self._predicted.show(self.robot, alongside(self.robot, sequence, row, frame.state))

    def draw_collision(self, live: LiveSession) -> None:
        """The names of what a refused plan would have brought together."""
        state, pair = rover_state(live), self._colliding(live)
        if state is None or not pair or self.robot is None:
            self._collision.hide()
        else:
            self._collision.show(self.robot, state, pair)

    def look(self, live: LiveSession) -> None:
        """Turn the view as the page has asked."""
        state, view = rover_state(live), live.choices.view
        if state is not None and self.robot is not None:
            self._looking.look(view.look, view.looks, self.robot, state, view.leg)

    def _colliding(self, live: LiveSession) -> tuple[str, ...]:
        if live.state.plan is None or self.robot is None:
            return ()
        return colliding(read(live, live.state.plan, PlanResult), self.robot.description.meshes)
