"""A kinematic rover: joints follow commands at their speed limits; nothing has inertia, nothing bends or slips.

The legs move through whatever is in their way: this rover has no physics. The chassis stays where it is, but where all
legs move together the standing wheels carry it. A wheel that is lowered stops where it touches the ground. Its
wheel forces and joint torques are those of the statics of the moment (:mod:`footfall.sim.statics`). Where no
forces of the standing feet can hold it up, a real rover would tip, and this one faults.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from footfall.balance.friction import FRICTION
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.maps.standing import wheel_gaps
from footfall.robot.model import Robot
from footfall.sequence.passage import carried, touch
from footfall.sim.orders import OrderedRover, ramp
from footfall.sim.statics import CONTACT_GAP, loads
from footfall.telemetry.link import AckMessage, CommandMessage
from footfall.telemetry.state import RobotState, TelemetryFrame
from footfall.terrain.dem import Dem


@dataclass
class _Motion:
    """The command under way: a straight joint-space line from ``origin`` to ``target`` in ``duration`` seconds.

    T_origin: T_site_base at its start. standing: legs that carry the chassis along; known: (legs,), those that do so
    whatever the terrain says. ends: share of the line that is gone when the wheel touches.
    """

    command: CommandMessage
    origin: Array
    target: Array
    duration: float
    T_origin: Array
    standing: tuple[int, ...] = ()
    known: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, bool))
    ends: float = 1.0
    elapsed: float = 0.0

    @property
    def share(self) -> float:
        """How much of the line is gone, 0…1."""
        return min(self.elapsed / self.duration, 1.0) if self.duration else 1.0


class SimulatedRover(OrderedRover[Robot]):
    """One rover on one terrain, moved on by :meth:`step`. :meth:`stop` freezes the posture at once.

    robot, dem, state: what it is, where it stands, and how. Raises InvalidInput where they don't fit.
    """

    def __init__(self, robot: Robot, dem: Dem, state: RobotState, friction: float = FRICTION) -> None:
        if state.robot != robot.name or state.leg_count != robot.leg_count:
            raise InvalidInput(f"the state is of {state.robot} with {state.leg_count} legs, the robot is {robot.name}")
        super().__init__(robot)
        self.dem = dem
        self._clock = state.time
        self.posture = np.array(state.posture)
        self._resting = np.array(state.posture)  # in which each leg was last known to stand
        self._loaded = np.asarray(state.wheel_forces)[:, 2] > 0
        self._T_site_base = np.array(state.T_site_base)
        self._friction = friction
        self._motion: _Motion | None = None
        self._number = 0
        self._loads = self._statics()

    @property
    def time(self) -> float:
        """Rover clock [s]."""
        return self._clock

    @property
    def T_site_base(self) -> Array:
        """Pose of the chassis (4, 4)."""
        return self._T_site_base

    @property
    def fault(self) -> str:
        """Why it is in mode "fault"."""
        return "its feet can't hold it up"

    def _begin(self, command: CommandMessage) -> _Motion:
        origin = self.posture.copy()
        target, duration = ramp(self.robot, command, origin)
        motion = _Motion(command, origin, target, duration, self._T_site_base)
        if command.kind.moves_all:
            motion.known = self._known_to_stand()
            gaps = wheel_gaps(self.robot, self.dem, origin, self._T_site_base, self.robot.legs)
            motion.standing = tuple(np.flatnonzero(motion.known | (gaps <= CONTACT_GAP)).tolist())
        elif command.kind.ends_by_force and command.leg is not None:
            motion.ends = touch(self.robot, self.dem, self._T_site_base, origin, target, command.leg)
        return motion

    def step(self, dt: float) -> list[AckMessage]:
        """Move on by ``dt`` seconds; "done" where the command ends, "refused" where the rover would tip."""
        if dt < 0:
            raise InvalidInput("time runs forward only", dt=dt)
        self._clock += dt
        motion = self._motion
        if motion is None:
            return []
        motion.elapsed += dt
        share = min(motion.share, motion.ends)
        # at the end exactly the target, not the sum of the steps
        line = motion.origin + share * (motion.target - motion.origin)
        self.posture = motion.target.copy() if share == 1.0 else line
        self._follow(motion)
        if share >= motion.ends:
            self._motion = None
            self.mode = "idle"
            return [self._tip_over(motion) or self._ack(motion.command.id, "done")]
        tipped = self._tip_over(motion)
        return [tipped] if tipped else []

    def state(self) -> RobotState:
        """The rover now. In mode "fault" the forces are those of the last moment it could stand."""
        forces, torques = self._loads
        return RobotState(
            robot=self.robot.name,
            time=self.time,
            posture=self.posture,
            T_site_base=self._T_site_base,
            wheel_forces=forces,
            joint_torques=torques,
            mode=self.mode,
        )

    def frame(self) -> TelemetryFrame:
        """The next telemetry frame; its number counts the calls."""
        commanded = self._motion.target if self._motion else self.posture
        frame = TelemetryFrame(self._number, self.state(), commanded)
        self._number += 1
        return frame

    def _follow(self, motion: _Motion) -> None:
        """The chassis goes where the standing wheels let it; they stand as before, with other joints."""
        if not motion.standing:
            return
        self._T_site_base, holding = carried(self.robot, motion.T_origin, motion.origin, self.posture, motion.standing)
        for leg in holding:
            if motion.known[leg]:
                self._resting[6 * leg : 6 * leg + 6] = self.posture[6 * leg : 6 * leg + 6]

    def _known_to_stand(self) -> NDArray[np.bool_]:
        """Wheels that carried load at the start and have not moved: they stand, whatever a coarse terrain says."""
        return (self.posture == self._resting).reshape(-1, 6).all(axis=1) & self._loaded

    def _tip_over(self, motion: _Motion) -> AckMessage | None:
        try:
            self._loads = self._statics()
        except InvalidInput as err:
            self._motion = None
            self.mode = "fault"
            return self._ack(motion.command.id, "refused", err.message)
        return None

    def _statics(self) -> tuple[Array, Array]:
        known = self._known_to_stand()
        return loads(self.robot, self.dem, self.posture, self._T_site_base, self.moving_leg, known, self._friction)
