"""A walk that is planned anew more firmly asks for more of everything, and never for what makes no sense."""

from dataclasses import replace

from hypothesis import given, settings
from hypothesis import strategies as st

from footfall.planning.walk.problem import WalkSettings
from footfall.planning.walk_execution.firmer import firmer

asked = st.builds(
    WalkSettings,
    least_margin=st.floats(0.0, 0.5),
    friction=st.floats(0.1, 1.5),
    most_torque=st.floats(0.05, 1.0),
    clearance=st.floats(0.0, 0.2),
)


@settings(max_examples=100, derandomize=True, deadline=None)
@given(before=asked, times=st.integers(0, 8))
def test_each_time_asks_for_more_and_is_valid(before, times):
    now, then = firmer(before, times), firmer(before, times + 1)
    now.check()
    assert then.least_margin > now.least_margin
    assert then.friction < now.friction
    assert then.most_torque <= now.most_torque <= before.most_torque
    assert firmer(before, 0).digest == before.digest


@settings(max_examples=100, derandomize=True, deadline=None)
@given(before=asked, times=st.integers(0, 8), too_near=st.integers(0, 8))
def test_only_where_bodies_came_too_near_it_asks_for_more_clearance(before, times, too_near):
    now, then = firmer(before, times, too_near), firmer(before, times, too_near + 1)
    then.check()
    assert firmer(before, times).clearance == before.clearance
    assert then.clearance > now.clearance
    assert replace(then, clearance=now.clearance).digest == now.digest
