"""The measured clearance of a rover in physics against where its wheel truly is, and against what was predicted."""

from typing import Any

import numpy as np
import pytest

import footfall
from footfall.core.frames import apply
from footfall.robot.kinematics import wheel_centers
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.session.wheel_clearance import clearances
from footfall.terrain.generate import plane
from tests.support.physical_link import Linked

LEG = 2


@pytest.mark.parametrize("stiffness", [1.0, 0.7])
def test_the_wheel_is_where_it_is_measured_to_be(tmp_path, athlete, stiffness):
    pytest.importorskip("mujoco")
    from footfall.sim.physics.physics_settings import Noise, PhysicsSettings
    from footfall.sim.physics.rover import PhysicalRover

    dem = plane(size=10.0, resolution=0.1)
    noise = Noise(encoder=1e-3, position=3e-3, orientation=1e-3, force=5.0)
    settings = PhysicsSettings(stiffness_scale=stiffness, noise=noise)
    rover = PhysicalRover(athlete, dem, footfall.stand(athlete, dem), settings)
    rover.step(2.0)
    errors, wheels, looks = [], [], [0]
    with Sessions(tmp_path / "sessions", jobs=InlineJobs(), robot=athlete) as sessions:
        live: Any = sessions.create("physics")
        live.terrains.load(dem)
        linked = Linked(live, rover)
        state = live.get(live.stances.freeze())
        x, y, _ = apply(state.T_site_base, wheel_centers(athlete, state.posture))[LEG]
        live.plans.step(LEG, (x + 0.1, y - 0.3)).finish()
        live.sequences.make(live.executions.plan().finish())
        linked.report()
        live.commands.send(live.commands.arm()["token"])

        def look() -> None:
            looks[0] += 1
            if looks[0] % 5:
                return
            for wheel in clearances(live, live.rover).wheels:
                assert wheel.leg == LEG
                assert wheel.seen is not None
                hub = apply(rover.T_site_base, wheel_centers(athlete, rover.posture))[LEG]
                errors.append((wheel.seen.clearance - (hub[2] - athlete.wheel_radius)) / wheel.seen.uncertainty)
                wheels.append(wheel)

        linked.run(look)
    assert len(wheels) > 50
    # errors in units of what holds 95 of 100 cases: the joints of the standing wheels make that rather too wide
    assert np.mean(np.abs(errors) < 1) > 0.93
    assert 0.3 < np.std(errors) < 1 / 1.96
    assert all(wheel.predicted is not None and wheel.commanded > wheel.predicted for wheel in wheels)
    lower = np.median([wheel.predicted - wheel.seen.clearance for wheel in wheels])
    assert lower == pytest.approx(0.0, abs=0.003) if stiffness == 1.0 else lower > 0.003
