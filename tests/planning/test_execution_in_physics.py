"""A predicted step, executed in physics: chassis, wheels, loads and touch-down are where they were said to be."""

import numpy as np
import pytest

import footfall
from footfall.core.frames import apply
from footfall.planning.answers import Status
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.execution.plan import plan_execution
from footfall.planning.step.problem import StepSettings
from footfall.robot.kinematics import wheel_centers
from footfall.telemetry.link import CommandMessage
from footfall.terrain.generate import plane
from tests.support.chassis_ground import wavy

LEG = 2
SWAY = 1.5
"""Until sway from the swing has died out [s]; the prediction is of a rover at rest."""


class Executing:
    """Sends commands to a rover in physics, one after the other."""

    def __init__(self, rover):
        self.rover, self.sent = rover, 0

    def do(self, name, leg=None, joints=None, duration=0.0, force=None, look=lambda: None):
        self.sent += 1
        message = CommandMessage(f"c{self.sent}", "", self.sent, name, leg, joints, float(duration), force)
        assert self.rover.command(message)[-1].state == "started"
        while self.rover.mode == "moving":
            self.rover.step(0.02)
            look()
        assert self.rover.mode == "idle", self.rover.fault


def test_a_droop_aware_step_goes_in_physics_as_predicted(athlete):
    pytest.importorskip("mujoco")
    from footfall.sim.physics.rover import PhysicalRover

    dem = wavy()
    rover = PhysicalRover(athlete, dem, footfall.stand(athlete, dem))
    executing = Executing(rover)
    executing.do("WAIT", duration=2.0)
    state, commanded = rover.state(), np.array(rover.commanded)
    x, y, _ = apply(state.T_site_base, wheel_centers(athlete, state.posture))[LEG]
    plan = footfall.plan_step(athlete, dem, state, LEG, (x + 0.1, y - 0.2)).plan
    assert plan is not None
    result = plan_execution(athlete, dem, state, plan, ExecutionSettings(mode="droop_aware"), commanded)
    assert result.status is Status.FOUND, result.reason
    done = result.execution
    assert done is not None
    own = slice(6 * LEG, 6 * LEG + 6)
    touched = []

    def feel():
        forces, points = rover.wheel_forces()
        if forces[LEG, 2] > 5.0:
            touched.append(points[LEG])

    def compare(row, most):
        hubs, expected = (
            apply(T, wheel_centers(athlete, q))
            for T, q in ((rover.T_site_base, rover.posture), (done.Ts_site_base[row], done.predicted[row]))
        )
        assert np.linalg.norm(rover.T_site_base[:3, 3] - done.Ts_site_base[row, :3, 3]) < most
        assert np.linalg.norm(hubs - expected, axis=1).max() < 2 * most

    for row in range(1, done.guarded_from + 1):
        executing.do("POSTURE_MOVE", joints=done.commanded[row], duration=done.durations[row])
        if done.pauses[row]:
            executing.do("WAIT", duration=SWAY)
            compare(row, 0.001)
            assert np.abs(rover.wheel_forces()[0] - done.forces[row]).max() < 40.0
    line = done.lowest - done.commanded[done.guarded_from, own]
    way = done.commanded[done.stopped_at, own] - done.commanded[done.guarded_from, own]
    seconds = done.durations[done.guarded_from + 1 : done.stopped_at + 1].sum()
    seconds *= np.abs(line).max() / np.abs(way).max()
    executing.do("LEG_LOWER", LEG, done.lowest, seconds, done.stop_force, feel)
    assert np.abs(rover.commanded[own] - done.commanded[done.stopped_at, own]).max() < 0.02
    for row in range(done.stopped_at + 1, len(done.phases)):
        executing.do("POSTURE_MOVE", joints=done.commanded[row], duration=done.durations[row])
    executing.do("WAIT", duration=SWAY)
    compare(len(done.phases) - 1, 0.003)
    assert np.linalg.norm(touched[0][:2] - done.touch_down[:2]) < 0.005
    assert np.linalg.norm(touched[0][:2] - plan.contact[:2]) < 0.01


@pytest.mark.parametrize(("lift", "leaves"), [(0.05, False), (0.08, False), (0.3, True)])
def test_a_wheel_leaves_the_ground_in_physics_where_it_was_predicted_to(athlete, lift, leaves):
    pytest.importorskip("mujoco")
    from footfall.sim.physics.rover import PhysicalRover

    dem = plane(8.0, 0.05)
    rover = PhysicalRover(athlete, dem, footfall.stand(athlete, dem))
    executing = Executing(rover)
    executing.do("WAIT", duration=2.0)
    state, commanded = rover.state(), np.array(rover.commanded)
    x, y, _ = apply(state.T_site_base, wheel_centers(athlete, state.posture))[LEG]
    low = StepSettings(lift=lift, raise_terrain=0.0, seed=1)
    plan = footfall.plan_step(athlete, dem, state, LEG, (x + 0.05, y - 0.1), settings=low).plan
    assert plan is not None
    settings = ExecutionSettings(mode="as_commanded", most_lift=lift)
    result = plan_execution(athlete, dem, state, plan, settings, commanded)
    # a step whose wheel won't leave the ground is refused, but its prediction is there to look at
    assert (result.status is Status.FOUND) == leaves
    done = result.execution
    assert done is not None
    lifting = [row for row, phase in enumerate(done.phases) if phase in ("unload", "lift")]
    assert (done.forces[lifting, LEG, 2].min() == 0) == leaves
    felt = []

    def feel():
        felt.append(rover.wheel_forces()[0][LEG, 2])

    for row in lifting[1:]:
        executing.do("POSTURE_MOVE", joints=done.commanded[row], duration=done.durations[row], look=feel)
        if not leaves:
            assert abs(felt[-1] - done.forces[row, LEG, 2]) < 20.0
    executing.do("WAIT", duration=SWAY, look=feel)
    assert (min(felt) == 0) == leaves
    assert felt[-1] == pytest.approx(done.forces[lifting[-1], LEG, 2], abs=10.0)
