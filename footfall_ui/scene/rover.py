"""The rover as telemetry tells of it: its links, what works on them and on its wheels, and from where it is seen."""

from collections.abc import Callable

import viser

from footfall.planning.step.problem import PlanResult
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.sequence.commands import Sequence
from footfall.session.live import LiveSession
from footfall.session.steadiness import stands_with
from footfall.terrain.dem import Dem
from footfall_ui.scene.any_robot import DrawnRobot, drawn_robot, leg_parts
from footfall_ui.scene.cameras import CamerasDrawing
from footfall_ui.scene.collision import CollisionDrawing, colliding
from footfall_ui.scene.forces import ForcesDrawing
from footfall_ui.scene.look import Looking, first_eye
from footfall_ui.scene.of_session import read, rover_state
from footfall_ui.scene.predicted import PredictedDrawing, alongside, row_under_way
from footfall_ui.scene.support import SupportDrawing
from footfall_ui.scene.torque import TorqueDrawing


class RoverPart:
    """Draws one session's rover at a time; torques of robots of ATHLETE's build alone."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle, turned: Callable[[], None]) -> None:
        """turned: called when the operator has turned the view away from the look that was asked for."""
        self._server = server
        self._of: LiveSession | None = None
        self._rover: DrawnRobot | None = None
        self._torques: TorqueDrawing | None = None
        self._cameras: CamerasDrawing | None = None
        self._forces = ForcesDrawing(server)
        self._support = SupportDrawing(server)
        self._collision = CollisionDrawing(server)
        self._predicted = PredictedDrawing(server)
        self._looking = Looking(server, turned)
        self._unseen = False

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
        robot = live.any_robot
        if self._of is None or self._of.id != live.id:  # of its past the view stays
            self._looking.begin(first_eye(robot, live.choices.view.leg))
            self._unseen = live.described is not None
        if self._of is not None:  # a page that opens takes the look that it shows as chosen
            self._looking.forget(live.choices.view.looks)
        self._rover = drawn_robot(self._server, robot)
        athletes = None if isinstance(robot, LeggedRobot) else robot
        self._torques = None if athletes is None else TorqueDrawing(self._server, athletes)
        self._cameras = CamerasDrawing(self._server, robot)
        self._of = live

    def draw(self, live: LiveSession) -> None:
        """Its links where telemetry has them."""
        if self._rover is None:
            return
        state = rover_state(live)
        if state is None:
            self._rover.hide()
            return
        self._rover.place(state.posture, state.T_site_base)
        self._rover.highlight(leg_parts(live.any_robot, live.choices.view.leg), _colliding(live))

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
        if state is None or not live.choices.view.shown.forces:
            self._forces.hide()
        else:
            self._forces.show(live.any_robot, state, live.choices.view.leg)

    def draw_support(self, live: LiveSession) -> None:
        state = rover_state(live)
        if state is None or not live.choices.view.shown.support:
            self._support.hide()
        else:
            dem = read(live, live.state.dem, Dem) if live.state.dem else None
            self._support.show(live.any_robot, state, dem, stands_with(live), live.choices.view.shown.region)

    def draw_cameras(self, live: LiveSession) -> None:
        if self._cameras is None:
            return
        (self._cameras.show if live.choices.view.shown.cameras else self._cameras.hide)()

    def draw_predicted(self, live: LiveSession) -> None:
        """Where it was to be in the row that it carries out."""
        row, run, frame = row_under_way(live.state), live.state.run, live.rover.frame
        shown = live.choices.view.shown.predicted
        if row is None or run is None or frame is None or not shown:
            self._predicted.hide()
            return
        sequence = read(live, run.sequence, Sequence)
        robot = live.any_robot
        self._predicted.show(robot, alongside(robot, sequence, row, frame.state))

    def draw_collision(self, live: LiveSession) -> None:
        """The names of what a refused plan would have brought together."""
        state, pair = rover_state(live), _colliding(live)
        if state is None or not pair:
            self._collision.hide()
        else:
            self._collision.show(live.robot, state, pair)

    def look(self, live: LiveSession) -> None:
        """Turn the view as the page has asked."""
        state, view = rover_state(live), live.choices.view
        if state is None:
            return
        if self._unseen:  # a small robot is not in sight of a view that looks elsewhere
            self._looking.begin(first_eye(live.any_robot, view.leg, state))
            self._unseen = False
        self._looking.look(view.look, view.looks, live.any_robot, state, view.leg)


def _colliding(live: LiveSession) -> tuple[str, ...]:
    """Names of links, of robots of ATHLETE's build: no others have a plan of this kind."""
    if live.state.plan is None:
        return ()
    return colliding(read(live, live.state.plan, PlanResult), live.description.meshes)
