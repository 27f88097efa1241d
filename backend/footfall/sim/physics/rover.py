"""The rover in physics: set points move, joints and wheels give way, the ground pushes back.

A command moves the set points of the joint servos; where the joints and the chassis go is for physics. The methods are
those of the kinematic :class:`footfall.sim.rover.SimulatedRover`, so either may stand at the rover's end of the link.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.frames import rotation_from_quat_wxyz, rotation_rpy, transform
from footfall.robot.model import Robot
from footfall.sim.orders import OrderedRover, ramp
from footfall.sim.physics.contacts import Touches, chassis_on_ground, crossed, on_wheels, touches
from footfall.sim.physics.lowering import TouchSense
from footfall.sim.physics.model import build_model
from footfall.sim.physics.physics_settings import TIME_STEP, PhysicsSettings
from footfall.sim.physics.settle import settle
from footfall.telemetry.link import AckMessage, CommandMessage
from footfall.telemetry.state import RobotState, TelemetryFrame
from footfall.terrain.dem import Dem

LOOKED_AFTER = 5
"""Time steps between two looks at whether the rover has tipped."""


DIVERGED = "the simulation of the rover diverged: it stands still from here on"


@dataclass
class _Motion:
    """The command under way: set points on a straight line from ``origin`` to ``target`` in ``ticks`` time steps."""

    command: CommandMessage
    origin: Array
    target: Array
    ticks: int
    sense: TouchSense | None
    done: int = 0

    @property
    def share(self) -> float:
        return min(1.0, self.done / self.ticks) if self.ticks else 1.0


class PhysicalRover(OrderedRover[Robot]):
    """One rover on one terrain, moved on by :meth:`step` in steps of TIME_STEP; what is left over waits for the next.

    :meth:`stop` freezes the set points at once; the joints come to rest within half a second. A command is done when
    its set points have arrived (LEG_LOWER: or the wheel has touched); the joints follow them within a few tenths of a
    second.

    robot, dem, state: what it is, where it stands, and how; ``settled`` says how far from there it came to rest.
    Raises InvalidInput where they don't fit, or the rover does not stay there.
    """

    def __init__(self, robot: Robot, dem: Dem, state: RobotState, settings: PhysicsSettings | None = None) -> None:
        if state.robot != robot.name or state.leg_count != robot.leg_count:
            raise InvalidInput(f"the state is of {state.robot} with {state.leg_count} legs, the robot is {robot.name}")
        super().__init__(robot)
        self.dem = dem
        self.settings = settings or PhysicsSettings()
        self.physics = build_model(robot, dem, self.settings)
        self._data = mujoco.MjData(self.physics.model)
        self.commanded, self.settled = settle(
            robot, self.physics, self._data, state.posture, state.T_site_base, self.settings
        )
        self._start_time = state.time
        self._ticks = 0
        self._owed = 0.0
        self._motion: _Motion | None = None
        self._number = 0
        self._fault = ""
        self._sound = self._data.qpos.copy()

    @property
    def time(self) -> float:
        """Rover clock [s]."""
        return self._start_time + self._ticks * TIME_STEP

    @property
    def posture(self) -> Array:
        """Where the joints are, without the encoders' noise, (legs × 6,) [rad]."""
        return self._data.qpos[self.physics.joints]

    @property
    def T_site_base(self) -> Array:
        """Where the chassis is, without noise, (4, 4)."""
        return transform(rotation_from_quat_wxyz(self._data.qpos[3:7]), self._data.qpos[:3])

    @property
    def torques(self) -> Array:
        """Of the joint servos: stiffness × (set point − angle), (legs × 6,) [N·m]."""
        return self.physics.stiffness * (self.commanded - self.posture)

    @property
    def fault(self) -> str:
        """Why it is in mode "fault", or ""."""
        return self._fault

    def wheel_forces(self) -> tuple[Array, Array]:
        """Force of the ground on each wheel and where it acts, without noise: (legs, 3) [N], (legs, 3) [m] or NaN."""
        return on_wheels(self.physics, touches(self._data))

    def touches(self) -> Touches:
        """What touches what."""
        return touches(self._data)

    def rims(self) -> tuple[Array, Array, Array]:
        """Of every wheel's rim: centre, velocity there, spin; (legs, 3) each, site [m], [m/s], [rad/s]."""
        rims = self.physics.rims
        centers, spins = self._data.xpos[rims], self._data.cvel[rims, :3]
        # MuJoCo tells velocities at the centre of mass of the whole rover
        arms = centers - self._data.subtree_com[self.physics.model.body_rootid[rims]]
        return centers, self._data.cvel[rims, 3:] + crossed(spins, arms), spins

    def _begin(self, command: CommandMessage) -> _Motion:
        target, duration = ramp(self.robot, command, self.commanded)
        sense = None if command.force is None else TouchSense(command.force)
        ticks = int(np.ceil(duration / TIME_STEP - 1e-9))
        return _Motion(command, self.commanded.copy(), target, ticks, sense)

    def step(self, dt: float) -> list[AckMessage]:
        """Move on by ``dt`` seconds; "done" where the command ends, "refused" where the rover tips."""
        if dt < 0:
            raise InvalidInput("time runs forward only", dt=dt)
        self._owed += dt
        said = []
        while self._owed >= TIME_STEP * (1 - 1e-9):
            self._owed -= TIME_STEP
            said += self._tick()
        return said

    def state(self) -> RobotState:
        """The rover now, as its sensors measure it; asked twice at one moment it is the same."""
        noise = self.settings.noise
        rng = self._noise_rng(2)
        turn = rotation_rpy(*(noise.orientation * rng.standard_normal(3)))
        T = self.T_site_base
        forces, _ = self.wheel_forces()
        return RobotState(
            robot=self.robot.name,
            time=self.time,
            posture=self.posture + noise.encoder * rng.standard_normal(6 * self.robot.leg_count),
            T_site_base=transform(turn @ T[:3, :3], T[:3, 3] + noise.position * rng.standard_normal(3)),
            wheel_forces=forces + noise.force * rng.standard_normal(forces.shape),
            joint_torques=self.torques,
            mode=self.mode,
        )

    def frame(self) -> TelemetryFrame:
        """The next telemetry frame; its number counts the calls, its ``commanded`` are the present set points."""
        frame = TelemetryFrame(self._number, self.state(), self.commanded)
        self._number += 1
        return frame

    def _tick(self) -> list[AckMessage]:
        motion = self._motion
        if motion is not None:
            motion.done += 1
            # exactly the target at the end, not the sum of the steps
            share = motion.share
            self.commanded = motion.target if share == 1.0 else motion.origin + share * (motion.target - motion.origin)
        self._data.ctrl[:] = self.commanded
        if self._fault != DIVERGED:
            mujoco.mj_step(self.physics.model, self._data)
        self._ticks += 1
        if self._ticks % LOOKED_AFTER == 0 and self.mode != "fault":
            self._fault = self._fallen()
            if self._fault:
                self._motion, self.mode = None, "fault"
                return [self._ack(motion.command.id, "refused", self._fault)] if motion else []
        if self._motion is None or motion is None:
            return []
        if motion.done < motion.ticks and not self._touched(motion):
            return []
        self._motion, self.mode = None, "idle"
        return [self._ack(motion.command.id, "done")]

    def _touched(self, motion: _Motion) -> bool:
        if motion.sense is None or motion.command.leg is None:
            return False
        forces, _ = self.wheel_forces()
        noise = self.settings.noise.force
        error = noise * self._noise_rng(3).standard_normal() if noise else 0.0
        return motion.sense.touched(float(forces[motion.command.leg, 2]) + error)

    def _fallen(self) -> str:
        if not np.isfinite(self._data.qpos).all():
            # telemetry goes on from the last moment that made sense
            mujoco.mj_resetData(self.physics.model, self._data)
            self._data.qpos[:] = self._sound
            mujoco.mj_forward(self.physics.model, self._data)
            return DIVERGED
        self._sound = self._data.qpos.copy()
        lean = float(np.arccos(np.clip(self.T_site_base[2, 2], -1.0, 1.0)))
        if lean > self.settings.tip_tilt:
            return f"the rover has tipped: its chassis leans by {np.rad2deg(lean):z.0f}°"
        if chassis_on_ground(self.physics, self.touches()):
            return "the rover has come down: its chassis or payload is on the ground"
        return ""

    def _noise_rng(self, purpose: int) -> np.random.Generator:
        return np.random.default_rng([self.settings.seed, purpose, self._ticks])
