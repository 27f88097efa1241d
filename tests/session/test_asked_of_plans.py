"""What a walk by itself was asked for holds of its commands, and of the steps that it takes besides."""

import pytest

from footfall.core.errors import Conflict
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.looking.how_to_see import LIFTED
from footfall.planning.walk.problem import WalkGoal, WalkSettings
from footfall.session.loop_looking import up_and_back
from footfall.session.loop_pieces import Pieces
from footfall.session.loop_settings import LoopSettings
from footfall.telemetry.state import TelemetryFrame

GOAL = WalkGoal(1.0, 0.0)


def pieces_of(live, walk):
    return Pieces(live, GOAL, LoopSettings(walk=walk), lambda job, text: text, lambda: live.get(live.state.state))


def test_it_is_commanded_on_the_ground_that_it_was_asked_for_and_with_what_it_carries(live):
    assert pieces_of(live, WalkSettings()).commanded.digest == ExecutionSettings().digest
    balance = pieces_of(live, WalkSettings(friction=0.3, payload_mass=20.0)).commanded.compliance.balance
    assert (balance.friction, balance.payload_mass) == (0.3, 20.0)


@pytest.mark.parametrize("support", ["required", "preferred"])
def test_a_leg_is_lifted_to_look_as_the_walk_was_asked_for(live, standing, monkeypatch, support):
    asked = []

    def step(leg, target, settings):
        asked.append(settings)
        raise Conflict("none is planned")

    monkeypatch.setattr(live.plans, "step", step)
    walk = WalkSettings(friction=0.3, support=support)
    live.rover.take_telemetry(TelemetryFrame(0, standing, standing.posture))
    assert up_and_back(live, 2, walk, lambda job, text: text) == "leg 2 can't be lifted to look: none is planned"
    [one] = asked
    assert (one.lift, one.friction, one.conservative) == (LIFTED, 0.3, support == "required")
