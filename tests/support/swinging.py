"""Runs whose rover is told to be at the end of a swing, by their records alone: no gate, no rover, no clock."""

from dataclasses import replace

import numpy as np

from footfall.core.frames import apply
from footfall.robot.kinematics import wheel_centers
from footfall.sequence.commands import Sequence
from footfall.sequence.moved_legs import moved_legs
from footfall.session.live import LiveSession
from footfall.telemetry.state import RobotState, TelemetryFrame

BORNE = 2000.0
"""What a standing wheel is told to bear [N]."""


class Swinging:
    """Runs of the present sequence of a session; ``row`` is the first of its rows that swing, ``leg`` the leg there."""

    def __init__(self, live: LiveSession) -> None:
        assert live.state.sequence is not None
        assert live.state.state is not None
        self._live, self._digest = live, live.state.sequence
        sequence = live.typed(Sequence, self._digest)
        self.phases = [one.phase for one in sequence.commands]
        self.row = self.phases.index("swing")
        leg = moved_legs(sequence)[self.row]
        assert leg is not None
        self.leg = leg
        self._set_points = (sequence.predicted if sequence.commanded is None else sequence.commanded)[self.row]
        forces = np.tile((0.0, 0.0, BORNE), (len(live.description.legs), 1))
        forces[self.leg] = 0.0
        self._state = replace(
            live.typed(RobotState, live.state.state),
            posture=sequence.predicted[self.row],
            T_site_base=sequence.poses[self.row],
            wheel_forces=forces,
            mode="moving",
        )
        self._told = len(live.events())

    def begin(self, run: int) -> None:
        started = {"run": run, "sequence": self._digest, "rows": len(self.phases), "mark": "m"}
        self._live.folded_log.record("run_started", started)

    def send(self, run: int, row: int) -> None:
        sent = {"id": f"m-{run}-{row}", "sequence": self._digest, "run": run, "row": row}
        self._live.folded_log.record("command_sent", sent)

    def end(self, run: int) -> None:
        self._live.folded_log.record("run_ended", {"run": run, "outcome": "done", "reason": ""})

    def tell(self, time: float, lower: float = 0.0) -> float:
        """At ``time`` the chassis is by ``lower`` [m] lower than planned; returns the height of the wheel's rim [m]."""
        T = self._state.T_site_base.copy()
        T[2, 3] -= lower
        state = replace(self._state, time=time, T_site_base=T)
        self._told += 1
        self._live.rover.take_telemetry(TelemetryFrame(self._told, state, self._set_points))
        robot = self._live.robot
        return float(apply(T, wheel_centers(robot, state.posture))[self.leg, 2] - robot.wheel_radius)
