"""A session leads a rover in physics through a step: gate, every command, and how soft the rover turns out to be."""

from typing import Any

import numpy as np
import pytest

import footfall
from footfall.core.errors import Conflict
from footfall.core.frames import apply
from footfall.planning.compliance.compliance_settings import ComplianceSettings
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.robot.kinematics import wheel_centers
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.session.replay.recompute import replay
from footfall.terrain.generate import plane
from tests.support.physical_link import Linked

LEG = 2


@pytest.mark.parametrize("stiffness", [1.0, 0.85])
def test_a_step_is_led_through_physics(tmp_path, athlete, stiffness):
    pytest.importorskip("mujoco")
    from footfall.sim.physics.physics_settings import Noise, PhysicsSettings
    from footfall.sim.physics.rover import PhysicalRover

    dem = plane(size=10.0, resolution=0.1)
    settings = PhysicsSettings(stiffness_scale=stiffness, noise=Noise(encoder=1e-4, position=1e-3, force=5.0))
    rover = PhysicalRover(athlete, dem, footfall.stand(athlete, dem), settings)
    rover.step(2.0)
    with Sessions(tmp_path / "sessions", jobs=InlineJobs(), robot=athlete) as sessions:
        live: Any = sessions.create("physics")
        live.terrains.load(dem)
        linked = Linked(live, rover)
        state = live.get(live.stances.freeze())
        x, y, _ = apply(state.T_site_base, wheel_centers(athlete, state.posture))[LEG]
        live.plans.step(LEG, (x + 0.1, y - 0.3)).finish()
        with pytest.raises(Conflict, match="nothing was sent"):
            live.executions.sag()
        live.executions.plan(settings=ExecutionSettings(mode="droop_aware")).finish()
        sequence = live.get(live.sequences.make(live.executions.found()))
        linked.report()
        live.commands.send(live.commands.arm()["token"])
        linked.run()
        assert {one.state for one in live.state.commands} == {"done"}
        assert len(live.state.commands) == len(sequence.commands)
        away = np.linalg.norm(rover.T_site_base[:3, 3] - sequence.poses[-1][:3, 3])
        assert away < (0.004 if stiffness == 1.0 else 0.02)
        assert rover.wheel_forces()[0][LEG, 2] > 1000
        sag = live.executions.sag()
        # how it stood at rest has told of its softness in part
        assert 0.97 < sag.ratio < (1.03 if stiffness == 1.0 else 1.0 / stiffness + 0.02)
        assert sag.ratio > (0.0 if stiffness == 1.0 else 1.01)
        assert sag.assumed.digest == ComplianceSettings().digest
        assert [sequence.commands[row].name for row in sag.rows] == ["WAIT"] * len(sag.rows)
        report = replay(live.export_bundle())
        assert report.ok, report.as_dict()
