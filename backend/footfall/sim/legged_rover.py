"""A kinematic rover of a robot that others described: joints follow commands; nothing has inertia or slips.

Its legs move through whatever is in their way. Feet that stand roll, and carry the chassis where all legs move
together, as :mod:`footfall.sequence.legged_passage` has it for the commands' own prediction. Forces and efforts are
those of static balance, with the least forces that hold it; where none do, a real robot would tip, and this one faults.
Where the description says how every joint gives way it does so: what is commanded are set points, and it rests on them.
"""

from dataclasses import dataclass, replace

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.planning.legged.measured import as_measured, set_points_of
from footfall.planning.legged.rolling import Stood
from footfall.planning.legged.sagging import SprungRest, gives_way_to
from footfall.planning.legged.whole_check import Feet
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.sequence.legged_passage import carried, landed
from footfall.sim.orders import OrderedRover, ramp
from footfall.telemetry.link import AckMessage, CommandMessage
from footfall.telemetry.state import RobotState, TelemetryFrame
from footfall.terrain.dem import Dem


@dataclass
class _Line:
    """The command under way: a straight line of the set points from ``origin`` to ``target`` in ``duration`` seconds.

    rest: how the robot rested when it began, on feet that stood at ``stood``.
    """

    command: CommandMessage
    origin: Array
    target: Array
    duration: float
    rest: SprungRest
    stood: Stood
    elapsed: float = 0.0

    @property
    def share(self) -> float:
        """How much of the line is gone, 0…1."""
        return min(self.elapsed / self.duration, 1.0) if self.duration else 1.0


class SimulatedLeggedRover(OrderedRover[LeggedRobot]):
    """One robot on one terrain, moved on by :meth:`step`. :meth:`stop` freezes the posture at once.

    robot, dem, state: what it is, where it stands, and how. Raises InvalidInput where they don't fit, and where its
    feet can't hold it up.
    """

    def __init__(self, robot: LeggedRobot, dem: Dem, state: RobotState) -> None:
        if state.described is None or state.robot != robot.name or state.described.digest != robot.layout.digest:
            raise InvalidInput(f"the state is of {state.robot}, and its joints are not those of {robot.name}")
        super().__init__(robot)
        self.dem = dem
        self._clock = state.time
        self.posture, self._T = np.array(state.posture), np.array(state.T_site_base)
        self._motion: _Line | None = None
        self._number = 0
        self._stood = Stood(*(np.full((len(robot.legs), 3), np.nan) for _ in range(3)))
        self._put_down()
        self._held = self._statics()
        self.commanded = set_points_of(robot, self._held)

    @property
    def time(self) -> float:
        """Rover clock [s]."""
        return self._clock

    @property
    def fault(self) -> str:
        """Why it is in mode "fault"."""
        return "its feet can't hold it up"

    def _begin(self, command: CommandMessage) -> _Line:
        target, duration = ramp(self.robot, command, self.commanded)
        if command.leg is not None:
            self._stood = Stood(*(part.copy() for part in self._stood))
            self._stood.soles[command.leg] = np.nan
        rest = SprungRest(self.commanded, self.posture, self._T, self._held.wheel_forces)
        return _Line(command, self.commanded.copy(), target, duration, rest, self._stood)

    def stop(self, epoch: int = 0) -> list[AckMessage]:
        """As of any rover; a leg that was moving stands again where its foot is on the ground."""
        said = super().stop(epoch)
        self._put_down()
        return said

    def step(self, dt: float) -> list[AckMessage]:
        """Move on by ``dt`` seconds; "done" where the command ends, "refused" where the robot would tip."""
        if dt < 0:
            raise InvalidInput("time runs forward only", dt=dt)
        self._clock += dt
        motion = self._motion
        if motion is None:
            return []
        motion.elapsed += dt
        share = motion.share
        # at the end exactly the target, not the sum of the steps
        on_line = motion.origin + share * (motion.target - motion.origin)
        self.commanded = motion.target.copy() if share == 1.0 else on_line
        try:
            self._follow(motion)
            if share == 1.0:
                self._motion, self.mode = None, "idle"
                self._put_down()
            self._held = self._on_springs() if self.robot.sags else self._statics()
        except InvalidInput as err:
            self._motion, self.mode = None, "fault"
            return [self._ack(motion.command.id, "refused", err.message)]
        return [self._ack(motion.command.id, "done")] if share == 1.0 else []

    def state(self) -> RobotState:
        """The robot now. In mode "fault" the forces are those of the last moment it could stand."""
        return replace(self._held, time=self.time, posture=self.posture, T_site_base=self._T, mode=self.mode)

    def frame(self) -> TelemetryFrame:
        """The next telemetry frame; its number counts the calls."""
        commanded = self._motion.target if self._motion else self.commanded
        frame = TelemetryFrame(self._number, self.state(), commanded)
        self._number += 1
        return frame

    @property
    def _standing(self) -> list[int]:
        return [leg for leg in self.robot.legs if np.isfinite(self._stood.soles[leg]).all()]

    def _follow(self, motion: _Line) -> None:
        """The joints go to their set points, or rest on them. Raises InvalidInput where nothing holds the robot."""
        standing, rest = self._standing, motion.rest
        if self.robot.sags:
            found = gives_way_to(self.robot, self.dem, self.commanded, rest, motion.stood, standing)
            if found is None:
                raise InvalidInput(f"nothing holds {self.robot.name} on its joints' springs: it would tip or sit down")
            (_, self.posture, self._T, forces), self._stood = found
            self._held = replace(self._held, wheel_forces=forces)
            return
        self.posture = self.commanded.copy()
        if motion.command.kind.moves_all:
            before = rest.q, rest.T_site_base
            self._T, self._stood = carried(self.robot, self.dem, before, self.posture, motion.stood, standing)

    def _put_down(self) -> None:
        """Feet that are in the air stand from now on where they touch the ground."""
        legs = [leg for leg in self.robot.legs if leg not in self._standing]
        for leg, foot in zip(legs, landed(self.robot, self.dem, self.posture, self._T, legs), strict=True):
            for part, place in zip(self._stood, foot, strict=True):
                part[leg] = place

    def _on_springs(self) -> RobotState:
        """As telemetry tells it that rests on its set points."""
        efforts = self.robot.stiffness * (self.commanded - self.posture)
        return replace(self._held, posture=self.posture, T_site_base=self._T, joint_torques=efforts)

    def _statics(self) -> RobotState:
        """As telemetry tells it by static balance. Raises InvalidInput where no forces hold the robot up."""
        feet = Feet(self._standing, self._stood.contacts, self._stood.normals)
        return as_measured(self.robot, self.posture, self._T, feet)
