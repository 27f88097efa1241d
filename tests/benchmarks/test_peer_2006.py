"""The peer of 2006 finds a short walk on flat ground that the independent recheck passes."""

import footfall
from benchmarks.scenes import robot
from benchmarks.walks.peer_2006.plan import peer_walk
from benchmarks.walks.terrains import start_of, terrain
from footfall.planning.walk.problem import WalkGoal, WalkSettings
from footfall.planning.walk.recheck.walk import recheck_walk


def test_a_short_walk_on_flat_ground_passes_the_recheck() -> None:
    dem, (x, y) = terrain("flat", 0), start_of(2.75)
    state = footfall.stand(robot(), dem, x, y)
    goal, settings = WalkGoal(x + 0.5, y, 0.0), WalkSettings(time_limit=600.0, seed=1)
    plan = peer_walk(robot(), dem, state, goal, settings)
    assert plan is not None
    assert plan.foot_moves > 0
    failed = [one for one in recheck_walk(robot(), dem, plan, settings, state=state) if not one.holds]
    assert not failed, failed
