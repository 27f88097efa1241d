"""The rover in physics: how much faster than the clock it runs, how long it takes to come to rest, and the referee.

Times are processor time: the simulation runs on one thread, and other programs add little to it. A factor is seconds of
the simulated world for one second of the processor.
"""

import time
from collections.abc import Iterator

import numpy as np

from benchmarks.scenes import robot, rocks, standing
from benchmarks.timing import Figure
from footfall.core.frames import transform
from footfall.core.value import Provenance
from footfall.robot.kinematics import wheel_centers
from footfall.sequence.commands import Command, Sequence
from footfall.sequence.predict import predict
from footfall.sim.physics.physics_settings import PhysicsSettings
from footfall.sim.physics.referee import referee
from footfall.sim.physics.rover import PhysicalRover
from footfall.sim.physics.verdict import RefereeSettings
from footfall.telemetry.link import CommandMessage
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.generate import plane

PERIOD = 0.1
"""Between two telemetry frames [s]."""


def on_plane() -> RobotState:
    posture = robot().posture("stand")
    height = robot().wheel_radius - wheel_centers(robot(), posture)[:, 2].min()
    T_site_base = transform(translation=(0.0, 0.0, height))
    return RobotState(robot().name, 0.0, posture, T_site_base, np.zeros((6, 3)), np.zeros(36), "idle")


def settling(dem: Dem, state: RobotState, count: int) -> tuple[float, ...]:
    """Seconds until a rover stands at rest, from a state and a terrain."""
    times = []
    for _ in range(count):
        begin = time.process_time()
        PhysicalRover(robot(), dem, state)
        times.append(time.process_time() - begin)
    return tuple(times)


def running(dem: Dem, state: RobotState, settings: PhysicsSettings, count: int) -> tuple[float, ...]:
    """Factors over a second of lifting and lowering a leg each, with telemetry ten times a second."""
    rover = PhysicalRover(robot(), dem, state, settings)
    down = rover.commanded[:6].copy()
    up = down - np.array([0.0, 0.15, 0.0, 0.0, 0.0, 0.0])
    factors = []
    for i in range(count):
        rover.command(CommandMessage(f"c{i}", "", i, "LEG_MOVE", 0, down if i % 2 else up, 0.9))
        begin = time.process_time()
        for _ in range(round(1.0 / PERIOD)):
            rover.step(PERIOD)
            rover.frame()
        factors.append(1.0 / (time.process_time() - begin))
    return tuple(factors)


def refereeing(count: int) -> tuple[float, ...]:
    """Factors of the referee over a leg lifted, turned and lowered."""
    state = on_plane()
    ways = {"lift": (0.0, -0.2), "swing": (0.1, -0.2), "lower": (0.1, 0.0)}
    commands = tuple(
        Command("LEG_MOVE", 0, state.posture[:6] + np.array([yaw, pitch, 0, 0, 0, 0]), 2.0, phase)
        for phase, (yaw, pitch) in ways.items()
    )
    start = state.posture
    sequence = Sequence(robot().name, commands, start, predict(start, commands), state.T_site_base, (), Provenance({}))
    factors = []
    for _ in range(count):
        begin = time.process_time()
        report = referee(robot(), sequence, plane(size=12.0, resolution=0.05), RefereeSettings())
        factors.append((report.ended[-1] + report.settings.rest) / (time.process_time() - begin))
    return tuple(factors)


def figures(quick: bool) -> Iterator[Figure]:
    count = 3 if quick else 10
    yield Figure("physics.settle_plane", settling(plane(size=12.0, resolution=0.05), on_plane(), count), "s", 1.0)
    yield Figure("physics.settle_rocks_2cm", settling(rocks(), standing(), count), "s", 3.0)
    grounds = {"plane_5cm": (plane(size=12.0, resolution=0.05), on_plane()), "rocks_2cm": (rocks(), standing())}
    for shape in ("sphere", "crowned"):
        for name, (dem, state) in grounds.items():
            factors = running(dem, state, PhysicsSettings(wheel_shape=shape), count)
            yield Figure(f"physics.real_time_{shape}_{name}", factors, "x", 2.0, at_most=False)
    yield Figure("physics.referee", refereeing(count), "x")
