"""Runs of robots that others described, compared with their prediction; springs that are softer are simulated."""

from dataclasses import replace

import numpy as np
import pytest

import footfall
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply
from footfall.planning.legged.measured import as_measured
from footfall.planning.legged.problem import LeggedSettings
from footfall.planning.legged.stand import stand
from footfall.planning.legged.step import plan_step
from footfall.planning.legged.whole_check import Feet
from footfall.robot.legged.posture import placed
from footfall.sequence import legged_foretold as legged_foretold_module
from footfall.sequence.commands import AtRest
from footfall.sequence.foretold import SPRINGS
from footfall.sequence.legged_foretold import RIGID, legged_foretold, legged_outcome
from footfall.sequence.legged_passage import landed, legged_passages
from footfall.sequence.outcome import CHASSIS
from footfall.telemetry.state import RobotState
from footfall.terrain.generate import fractal
from tests.support.described import robot_of, sprung

STIFF = 300.0
LEG = 1


@pytest.fixture(scope="module", params=["sags", "rigid"])
def run(request):
    """A robot of four legs, its ground, and the commands of a step of leg 1, predicted by itself."""
    _, robot = robot_of(4)
    robot = sprung(robot, STIFF) if request.param == "sags" else robot
    dem = fractal(4.0, 0.1, roughness=0.02, seed=3)
    state = stand(robot, dem)
    result = plan_step(
        robot, dem, state, LEG, tuple(state.soles[LEG, :2] + (0.05, 0.02)), LeggedSettings(time_limit=1e6)
    )
    assert result.plan is not None, result.reason
    return robot, dem, footfall.make_sequence(result.plan, robot, dem)


def telemetry(robot, dem, q, T, forces=None) -> RobotState:
    """The robot at rest as it would tell of itself; forces: on its feet, None: those of least norm."""
    places = landed(robot, dem, q, T, list(robot.legs))
    standing = [leg for leg, (sole, _, _) in enumerate(places) if np.isfinite(sole).all()]
    feet = Feet(standing, *(np.array([one[part] for one in places]) for part in (1, 2)))
    state = as_measured(robot, q, T, feet)
    return state if forces is None else replace(state, wheel_forces=forces)


def ended(robot, dem, sequence):
    """The end of the commands, as another rover of the same build may carry them out."""
    return legged_passages(robot, sequence.start, sequence.T_site_base, sequence.commands, dem, sequence.at_rest)[-1]


def compared(robot, dem, sequence, last, state=None):
    state = state or telemetry(robot, dem, last.after, last.T_after, last.forces)
    return legged_outcome(robot, dem, sequence, state, last.asked, 3, len(sequence.commands))


def by_name(made):
    return {(one.quantity, one.leg): one for one in made.differences}


def test_what_goes_as_predicted_is_good_and_tells_every_load(run):
    robot, dem, sequence = run
    made = compared(robot, dem, sequence, ended(robot, dem, sequence))
    assert made.verdict == "as_predicted"
    found = by_name(made)
    assert [name for name, _ in found] == ["touch-down", *["load"] * 4, "drift", "sink"]
    assert found["touch-down", LEG].text.startswith(f"leg {robot.leg_names[LEG]} stands")
    assert (
        max(abs(found[key].difference) for key in (("touch-down", LEG), ("drift", CHASSIS), ("sink", CHASSIS))) < 1e-6
    )
    loads = [found["load", leg] for leg in robot.legs]
    if made.rigid:
        assert made.sags is False
        assert {one.verdict for one in loads} == {"not_told"}
        return
    assert max(abs(one.difference) for one in loads) < 1e-3
    normals = legged_foretold(robot, dem, sequence, len(sequence.commands)).normals
    assert sum(one.predicted * normal[2] for one, normal in zip(loads, normals, strict=True)) == pytest.approx(
        robot.mass * 9.80665, rel=0.02
    )


def test_a_foot_that_stands_elsewhere_differs_and_says_what_to_do(run):
    robot, dem, sequence = run
    last = ended(robot, dem, sequence)
    q = last.after.copy()
    q[robot.slices[LEG]][0] += 0.3
    at = telemetry(robot, dem, last.after, last.T_after, last.forces)
    made = compared(robot, dem, sequence, last, replace(at, posture=q))
    assert made.verdict == "differs"
    off = by_name(made)["touch-down", LEG]
    there, here = (apply(last.T_after, placed(robot, one).soles)[LEG, :2] for one in (q, last.after))
    assert off.measured == pytest.approx(np.linalg.norm(there - here), abs=1e-6)
    assert off.verdict == "differs"
    assert (off.advice == RIGID) == made.rigid


def test_a_load_that_is_not_measured_is_never_good(run):
    robot, dem, sequence = run
    last = ended(robot, dem, sequence)
    silent = telemetry(robot, dem, last.after, last.T_after, np.zeros((4, 3)))
    made = compared(robot, dem, sequence, last, silent)
    assert {one.verdict for one in made.differences if one.quantity == "load"} == {"not_told"}
    assert (made.verdict == "not_told") == (not made.rigid)


def test_springs_that_are_softer_than_said_are_within_what_it_is_unsure_of(run, monkeypatch):
    robot, dem, sequence = run
    if sequence.at_rest is None:
        last = ended(robot, dem, sequence)
        made = legged_outcome(
            robot, dem, sequence, telemetry(robot, dem, last.after, last.T_after), last.after - 0.01, 1, 2
        )
        assert made.sags is True
        return
    soft = sprung(robot, (1 - SPRINGS) * STIFF)
    before = sequence.at_rest.state
    rest = AtRest(before, before.posture + before.joint_torques / soft.stiffness)
    gave = ended(soft, dem, replace(sequence, at_rest=rest))
    assert not gave.fell
    found = by_name(compared(robot, dem, sequence, gave))
    sink, touch = found["sink", CHASSIS], found["touch-down", LEG]
    assert sink.verdict == touch.verdict == found["drift", CHASSIS].verdict == "as_predicted"
    # of the springs alone
    for one in ("UNEXPLAINED", "UNSTATED_SD", "SLIDES"):
        monkeypatch.setattr(legged_foretold_module, one, 0.0)
    springs = by_name(compared(robot, dem, sequence, gave))["sink", CHASSIS]
    assert springs.difference == pytest.approx(springs.uncertainty, rel=0.1)
    assert springs.difference > 1e-4


def test_rows_that_are_not_there_are_refused(run):
    robot, dem, sequence = run
    last = ended(robot, dem, sequence)
    with pytest.raises(InvalidInput, match="has no row 0 to compare"):
        legged_outcome(robot, dem, sequence, telemetry(robot, dem, last.after, last.T_after), last.asked, 1, 0)
