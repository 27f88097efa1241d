"""The comparison of the old rules of thumb: a rule that asks for more never makes more steps plannable."""

import numpy as np
import pytest

import footfall
from benchmarks import heuristics
from benchmarks.heuristics import BARE, RULES, plannable
from benchmarks.scenes import robot
from footfall.planning.step.problem import StepSettings

STRICTER = [
    (BARE, RULES["waypoints_20cm"]),
    (RULES["waypoints_20cm"], RULES["raised_15cm"]),
    (RULES["waypoints_20cm"], RULES["buffer_5cm"]),
    (RULES["buffer_5cm"], {**RULES["buffer_5cm"], "clearance": 0.08}),
    ({**RULES["raised_and_buffer"], "clearance": 0.0}, RULES["raised_and_buffer"]),
    ({**RULES["raised_and_buffer"], "raise_terrain": 0.0}, RULES["raised_and_buffer"]),
]
"""What is asked for, and a rule that asks for all that and more."""
NARROW = [(3, -2.12, -0.48), (3, -1.8, 0.76), (4, -0.36, -1.56)]
"""Footfalls between rocks."""


@pytest.fixture(scope="module")
def steps():
    """Footfalls of two legs around where their feet are, drawn without asking a map or a planner."""
    rng = np.random.default_rng(7)
    place = [(3, -1.9, 0.1), (4, -0.9, -1.7)]
    drawn = [(leg, x + rng.uniform(-0.6, 0.6), y + rng.uniform(-0.6, 0.6)) for leg, x, y in place for _ in range(8)]
    return NARROW + drawn


def test_asking_for_more_never_makes_more_plannable(steps):
    lost = 0
    for laxer, stricter in STRICTER:
        can, still = ([plannable(step, rule) for step in steps] for rule in (laxer, stricter))
        assert all(a or not b for a, b in zip(can, still, strict=True)), (laxer, stricter)
        lost += sum(can) - sum(still)
    assert lost > 0
    assert any(plannable(step, BARE) for step in steps[len(NARROW) :])


def test_a_buffer_forbids_what_comes_nearer_than_it_without():
    for leg, x, y in NARROW:
        settings = StepSettings(**RULES["waypoints_20cm"], seed=1, time_limit=20.0)  # type: ignore[arg-type]
        found = footfall.plan_step(robot(), *heuristics.scene(), leg, (x, y), settings=settings)
        assert found.plan is not None
        assert min(check.margin for check in found.checks if "collision" in check.name) < 0.05
        assert not plannable((leg, x, y), RULES["buffer_5cm"])


def test_the_figures_count_what_each_rule_loses(monkeypatch):
    monkeypatch.setattr(heuristics, "problems", lambda count: [*NARROW, (3, 3.0, 3.0)])
    counts = {figure.name: figure.samples[0] for figure in heuristics.figures(True)}
    assert counts == {
        "heuristics.problems": 4,
        "heuristics.unplannable_without_any": 1,
        "heuristics.waypoints_20cm_makes_unplannable": 0,
        "heuristics.raised_15cm_makes_unplannable": 0,
        "heuristics.buffer_5cm_makes_unplannable": 3,
        "heuristics.raised_and_buffer_makes_unplannable": 3,
    }
