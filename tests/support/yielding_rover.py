"""A rover that gives way, at the end of a session's link: it is at once where its springs let it rest."""

import json
from dataclasses import replace
from typing import Any

import numpy as np

from footfall.planning.compliance.compliance_settings import ComplianceSettings
from footfall.planning.compliance.compliant_rover import CompliantRover, RestingRover
from footfall.planning.compliance.predict import advanced
from footfall.sequence.commands import AtRest
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.sequence.yielding import follow
from footfall.telemetry.state import TelemetryFrame


class YieldingRover:
    """Stands on the terrain of a session, put down as the posture of ``state`` commands it.

    wheel_scale: of the stiffness of its wheels. shift: of its telemetry, told otherwise than it stands: (legs × 6,)
    [rad] that is added to its posture.
    """

    def __init__(self, live: Any, state: Any, wheel_scale: float = 1.0) -> None:
        self.live, self.dem = live, live.get(live.state.dem)
        self.settings = ComplianceSettings(wheel_scale=wheel_scale)
        self.springs = CompliantRover(live.robot, self.dem, self.settings)
        self.rest: RestingRover = self.springs.let_down(state.posture, state.T_site_base)
        self.shift = np.zeros_like(self.rest.posture)
        self.number, self.sent = 0, []
        live.rover.link._clock = lambda: (
            0.1 * self.number
        )  # telemetry is as old as the rover says, however slow the machine
        live.rover.connected(self.hears)
        self.tells()

    @property
    def state(self) -> Any:
        """As its telemetry has it."""
        found = self.springs.state(self.rest, 0.1 * self.number)
        return replace(found, posture=found.posture + self.shift)

    def hears(self, text: str) -> None:
        message = json.loads(text)
        if message["type"] == "command":
            self.sent.append(message)

    def tells(self) -> None:
        self.number += 1
        self.live.rover.take_telemetry(TelemetryFrame(self.number, self.state, self.rest.commanded))

    def goes(self, set_points: Any) -> None:
        """Stands at other set points."""
        self.rest = advanced(self.springs, self.rest, set_points)
        self.tells()

    def carries_out(self, rows: int) -> None:
        """The next rows of what is being sent."""
        sequence = self.live.get(self.live.commands.gate["sequence"])
        for _ in range(rows):
            message = self.sent[-1]
            command = sequence.commands[message["row"]]
            at_rest = AtRest(self.springs.state(self.rest), self.rest.commanded)
            way = follow(
                self.live.robot, at_rest, (command,), self.dem, SequenceSettings(compliance=self.settings), fitted=False
            )
            assert not way.rows[0].reason
            self.rest = way.rows[0].rests[-1]
            self.live.rover.take_acknowledgement(message["id"], "done")
            self.tells()
            self.live.rover.commanding.look()

    def carries_out_all(self) -> None:
        """The present sequence, armed and sent."""
        self.tells()
        self.live.commands.send(self.live.commands.arm()["token"])
        self.carries_out(len(self.live.get(self.live.state.sequence).commands))
        assert self.live.commands.gate["state"] == "idle"
