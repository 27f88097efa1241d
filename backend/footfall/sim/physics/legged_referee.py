"""Physics as the referee of robots that others described: commands are carried out, and what came of it judged."""

from collections.abc import Mapping
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, quat_wxyz, rotation_from_quat_wxyz, transform, turn_of
from footfall.core.progress import Progress, no_progress
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall.sequence.commands import Command, Sequence
from footfall.sequence.legged_passage import asked_for
from footfall.sim.physics.contacts import Touches, crossed, touches
from footfall.sim.physics.legged_model import TICK, build_legged
from footfall.sim.physics.legged_verdict import LeggedLimits, LeggedReport, legged_failures
from footfall.sim.physics.physics_settings import PhysicsSettings
from footfall.sim.physics.referee import IN_AIR
from footfall.terrain.dem import Dem

REST = 1.0
"""Seconds in which the robot comes to rest on its joints before the first command, and after the last."""

TIPPED = 0.3
"""A chassis that is turned by more than this from how the plan has it has tipped [rad]."""


def legged_referee(
    robot: LeggedRobot,
    sequence: Sequence,
    dem: Dem,
    physics: PhysicsSettings | None = None,
    limits: LeggedLimits | None = None,
    progress: Progress = no_progress,
) -> LeggedReport:
    """Carry a sequence out from a robot at rest in the posture that it starts from.

    Raises InvalidInput for the sequence of another robot.
    """
    if sequence.robot != robot.name or sequence.start.shape != (len(robot.joint_names),):
        raise InvalidInput(f"the sequence is for {sequence.robot}, the robot is {robot.name}")
    body = LeggedBody(robot, dem, sequence.start, sequence.T_site_base, physics)
    body.commanded = sequence.set_points_before(0).copy()
    run = _Run(robot, sequence, body)
    run.rest()
    run.begin()
    for row in range(len(sequence.commands)):
        progress(row / len(sequence.commands), f"row {row + 1}")
        run.carry_out(row)
        if run.tipped:
            break
    else:
        run.rest()
    found = run.report()
    return replace(found, failures=legged_failures(robot, found, limits or LeggedLimits()))


class LeggedBody:
    """A robot in physics that holds its joints at ``commanded`` (joints,) [rad or m]."""

    def __init__(
        self, robot: LeggedRobot, dem: Dem, posture: Array, T_site_base: Array, settings: PhysicsSettings | None = None
    ) -> None:
        self.robot, self.physics = robot, build_legged(robot, dem, settings or PhysicsSettings())
        self.data = mujoco.MjData(self.physics.model)
        self.data.qpos[:3], self.data.qpos[3:7] = T_site_base[:3, 3], quat_wxyz(T_site_base[:3, :3])
        self.data.qpos[self.physics.joints] = posture
        self.commanded = np.array(posture)
        self._leg_of = np.full(len(robot.body_names), -1)
        self._leg_of[[robot.slices[leg].stop for leg in robot.legs]] = robot.legs

    @property
    def T_site_base(self) -> Array:
        return transform(rotation_from_quat_wxyz(self.data.qpos[3:7]), self.data.qpos[:3])

    @property
    def posture(self) -> Array:
        return self.data.qpos[self.physics.joints].copy()

    @property
    def soles(self) -> Array:
        """Centres of the soles in site, (legs, 3) [m]."""
        return self.data.geom_xpos[self.physics.soles].copy()

    def tick(self) -> Touches:
        """One time step, and what touches what then."""
        self.data.ctrl[:] = self.commanded
        mujoco.mj_step(self.physics.model, self.data)
        return touches(self.data)

    def legs_on_ground(self, touching: Touches) -> NDArray[np.int64]:
        """The leg whose foot touches the ground, for each contact (n,); −1 where it is no foot, or no ground."""
        bodies = self.physics.bodies[touching.geoms]
        legs = np.where(bodies.min(axis=1) < 0, self._leg_of[bodies.max(axis=1)], -1)
        away = touching.points - self.data.geom_xpos[self.physics.soles[legs]]
        return np.where((away**2).sum(axis=1) <= self.physics.near[legs] ** 2, legs, -1)

    def sliding(self, touching: Touches, legs: NDArray[np.int64]) -> Array:
        """Speed of the feet's material over the ground at contacts of theirs (n,) [m/s]."""
        velocities = np.zeros((len(self.robot.legs), 6))
        for leg in set(legs.tolist()):
            geom = int(self.physics.soles[leg])
            mujoco.mj_objectVelocity(self.physics.model, self.data, mujoco.mjtObj.mjOBJ_GEOM, geom, velocities[leg], 0)
        arms = touching.points - self.data.geom_xpos[self.physics.soles[legs]]
        speeds = velocities[legs, 3:] + crossed(velocities[legs, :3], arms)
        across = speeds - (speeds * touching.normals).sum(axis=1)[:, None] * touching.normals
        return np.sqrt((across**2).sum(axis=1))

    def named(self, one: int, other: int) -> str:
        """What two geoms are."""
        bodies = sorted((int(self.physics.bodies[one]), int(self.physics.bodies[other])), reverse=True)
        return " and ".join("the ground" if body < 0 else self.robot.body_names[body] for body in bodies)


class _Run:
    """A sequence on its way, and what was seen of it."""

    def __init__(self, robot: LeggedRobot, sequence: Sequence, body: LeggedBody) -> None:
        self.robot, self.sequence, self.body = robot, sequence, body
        legs = len(robot.legs)
        self.row, self.moving, self.tipped, self.done = -1, -1, "", 0
        self.lifted = False
        self.touch = np.full(legs, np.nan)
        self.stayed: list[tuple[int, int]] = []
        self.begin()

    def rest(self) -> None:
        self.moving = -1
        for _ in range(round(REST / TICK)):
            self._tick()

    def begin(self) -> None:
        """What is judged begins here."""
        legs = len(self.robot.legs)
        self.settled = float(self.sequence.T_site_base[2, 3] - self.body.data.qpos[2])
        self.air, self.spell, self.slip, self.slipped = (np.zeros(legs) for _ in range(4))
        self.air_row = np.full(legs, -1, np.int64)
        self.contacts: dict[str, tuple[int, float]] = {}
        self.drift, self.sink, self.lean, self.effort = 0.0, self.settled, 0.0, 0.0

    def carry_out(self, row: int) -> None:
        command = self.sequence.commands[row]
        leg = -1 if command.leg is None else command.leg
        if leg != self.moving:
            self.lifted = False
        self.row, self.moving = row, leg
        origin, target = self.body.commanded, asked_for(self.robot, self.body.commanded, command)
        begin, end = self._planned(row - 1), self._planned(row)
        ticks = max(int(np.ceil(command.duration / TICK - 1e-9)), 1)
        for tick in range(1, ticks + 1):
            share = tick / ticks
            self.body.commanded = target if tick == ticks else origin + share * (target - origin)
            self._tick()
            self._compare((1 - share) * begin[:3, 3] + share * end[:3, 3], (end if share > 0.5 else begin)[:3, :3])
            if self.tipped:
                return
        self.done = row + 1
        last = row + 1 == len(self.sequence.commands) or self.sequence.commands[row + 1].leg != command.leg
        if leg >= 0 and last:
            self._put_down(leg, row)

    def report(self) -> LeggedReport:
        return LeggedReport(
            commands=self.done,
            seconds=float(sum(one.duration for one in self.sequence.commands[: self.done])),
            tipped=self.tipped,
            contacts=tuple((names, row, force) for names, (row, force) in self.contacts.items()),
            air=self.air,
            air_row=self.air_row,
            slip=self.slip,
            touch=self.touch,
            stayed=tuple(self.stayed),
            settled=self.settled,
            drift=self.drift,
            sink=self.sink,
            lean=self.lean,
            effort=self.effort if np.isfinite(self.robot.efforts).any() else float("nan"),
            assumed=self.body.physics.assumed,
        )

    def _planned(self, row: int) -> Array:
        return self.sequence.T_site_base if row < 0 else self.sequence.poses[row]

    def _put_down(self, leg: int, row: int) -> None:
        if not self.lifted and any(one.phase in IN_AIR for one in self._foot_move(leg, row)):
            self.stayed.append((leg, row))
        place = apply(self.sequence.poses[row], placed(self.robot, self.sequence.predicted[row]).soles[leg])
        off = float(np.linalg.norm((place - self.body.soles[leg])[:2]))
        self.touch[leg] = np.fmax(self.touch[leg], off)

    def _foot_move(self, leg: int, row: int) -> list[Command]:
        first = row
        while first > 0 and self.sequence.commands[first - 1].leg == leg:
            first -= 1
        return list(self.sequence.commands[first : row + 1])

    def _compare(self, place: Array, R_planned: Array) -> None:
        position = self.body.data.qpos[:3]
        if not np.isfinite(self.body.data.qpos).all():
            self.tipped = f"row {self.row + 1}: the simulation diverged"
            return
        self.drift = max(self.drift, float(np.hypot(*(position - place)[:2])))
        self.sink = max(self.sink, float(place[2] - position[2]))
        turned = turn_of(self.body.T_site_base[:3, :3].T @ R_planned)
        self.lean = max(self.lean, turned)
        if turned > TIPPED:
            self.tipped = (
                f"row {self.row + 1}: it tipped, the chassis is turned {turned:z.2f} rad from how it should be"
            )

    def _tick(self) -> None:
        touching = self.body.tick()
        share = np.abs(self.body.data.actuator_force) / self.robot.efforts
        self.effort = max(self.effort, float(share.max()))
        sliding = self._look(touching)
        for leg in self.robot.legs:
            pressed = leg in sliding
            if leg == self.moving:
                self.spell[leg] = self.slipped[leg] = 0.0
                self.lifted |= not pressed and self.sequence.commands[self.row].phase in IN_AIR
                continue
            self.spell[leg] = 0.0 if pressed else self.spell[leg] + TICK
            self.slipped[leg] += sliding.get(leg, 0.0) * TICK
            if self.spell[leg] > self.air[leg]:
                self.air[leg], self.air_row[leg] = self.spell[leg], self.row
        self.slip = np.maximum(self.slip, self.slipped)

    def _look(self, touching: Touches) -> Mapping[int, float]:
        """Legs whose feet press on the ground, with how fast they slide over it [m/s]; takes unplanned contacts."""
        pushes = np.abs((touching.forces * touching.normals).sum(axis=1))
        touching = touching.only(pushes > 0)
        legs = self.body.legs_on_ground(touching)
        for k in np.flatnonzero(legs < 0):
            names = self.body.named(*touching.geoms[k])
            row, most = self.contacts.get(names, (self.row, 0.0))
            self.contacts[names] = row, max(most, float(pushes[pushes > 0][k]))
        feet, legs = touching.only(legs >= 0), legs[legs >= 0]
        sliding: dict[int, float] = {}
        for leg, speed in zip(legs.tolist(), self.body.sliding(feet, legs).tolist(), strict=True):
            sliding[leg] = max(sliding.get(leg, 0.0), speed)
        return sliding
