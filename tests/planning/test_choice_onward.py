"""By what a walk in a closed loop chooses how to go on, and what of a table commands can be made of."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput
from footfall.planning.choice.actions import ACTIONS, ASIDE, RIPPLE, TRIPOD, WALK, WAVE
from footfall.planning.choice.choice_settings import ChoiceSettings
from footfall.planning.choice.mdp import SeenTransition
from footfall.planning.choice.onward import CHOOSERS, COMMANDED, GAITS, PLANNER, TABLE, require_chooser, way_of
from footfall.planning.choice.policy import learned
from footfall.planning.choice.state import Features, StateSpace

SETTINGS = ChoiceSettings(space=StateSpace((0.5,)), actions=ACTIONS)
ROBOT = "0" * 32
EASY = Features(0.9)


def table(**worth):
    """A table that has so seen each action in every state, for good."""
    size = SETTINGS.space.size
    seen = [SeenTransition(s, ACTIONS.index(name), reward, s) for s in range(size) for name, reward in worth.items()]
    return learned(seen, SETTINGS, ROBOT, 1)


def unasked():
    raise AssertionError("no ground is to be looked at")


def test_without_a_table_no_ground_is_looked_at():
    assert way_of(PLANNER, None, unasked) == (WALK, CHOOSERS[PLANNER])
    assert way_of(GAITS, table(wave=-1.0, walk=1.0), unasked) == (WAVE, CHOOSERS[GAITS])


@given(st.permutations(ACTIONS))
def test_the_best_that_can_be_commanded_is_taken(order):
    """Second method: the first of the order that moves one foot at a time."""
    policy = table(**{name: float(-place) for place, name in enumerate(order)})
    action, why = way_of(TABLE, policy, lambda: EASY)
    assert action == next(name for name in order if name in COMMANDED)
    assert f"the table has {order[0]} as best" in why
    assert ("several feet at once" in why) == (order[0] in (TRIPOD, RIPPLE))
    assert ("goes aside" in why) == (order[0] in ASIDE)


def test_where_neither_was_tried_it_is_the_walk_planner():
    assert way_of(TABLE, table(tripod=1.0), lambda: EASY)[0] == WALK


def test_all_of_a_table_s_own_actions_are_its_choices():
    policy = table(wave=0.0, ripple=0.5, tripod=0.5, walk=0.2)
    assert policy.best_of(EASY, ACTIONS) == policy.choose(EASY) == RIPPLE
    assert (policy.choices == ACTIONS.index(RIPPLE)).all()
    assert (np.isfinite(policy.action_values) == [one not in ASIDE for one in ACTIONS]).all()


def test_refusals():
    require_chooser(PLANNER, None, ROBOT)
    require_chooser(TABLE, table(walk=1.0), ROBOT)
    with pytest.raises(InvalidInput, match=", ".join(CHOOSERS)):
        require_chooser("whim", None, ROBOT)
    with pytest.raises(InvalidInput, match="--policy"):
        require_chooser(TABLE, None, ROBOT)
    with pytest.raises(InvalidInput, match="learned for robot"):
        require_chooser(TABLE, table(walk=1.0), "1" * 32)
