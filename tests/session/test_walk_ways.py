"""How each piece of a walk by itself is gone: chosen, recorded with its cost, and why a gait was refused."""

from dataclasses import replace

import numpy as np
import pytest

from footfall.core.errors import InvalidInput
from footfall.io.policies import shipped_policy
from footfall.planning.body.stand import stand
from footfall.planning.choice.actions import ACTIONS, TRIPOD, WALK, WAVE
from footfall.planning.choice.choice_settings import ChoiceSettings
from footfall.planning.choice.mdp import SeenTransition
from footfall.planning.choice.onward import GAITS, TABLE
from footfall.planning.choice.policy import learned
from footfall.planning.choice.state import StateSpace
from footfall.planning.walk.problem import WalkGoal
from footfall.session import loop_ways
from footfall.session.products import kinds
from footfall.session.replay.recompute import replay
from tests.session.test_walk_loop import GOAL, UNSEEN, RigidRover, ended, rover
from tests.support.chassis_ground import wavy

__all__ = ["rover"]
HOLE = (2.8, 0.1, 0.4)
"""Unknown ground where the foot ahead would come down: x, y, radius [m]."""
IN_GAITS = replace(UNSEEN, choose_by=GAITS)


def chosen(live):
    return [event.payload for event in live.events() if event.type == "way_chosen"]


def walks_of(live):
    return [live.get(digest) for digest, made in live.state.products.items() if made.kind == kinds.WALK.name]


def test_on_smooth_ground_a_wave_is_gone_and_no_walk_is_searched(live, rover):
    loop = live.walk_to(GOAL, IN_GAITS)
    assert ended(loop)[0] == "arrived"
    ways = chosen(live)
    assert [(one["action"], one["planners"], one["refused"]) for one in ways] == [(WAVE, [WAVE], None)] * len(ways)
    told = loop.as_dict()
    assert (told["choose_by"], told["planners"], told["chosen"]) == (GAITS, {WAVE: len(ways)}, ways[-1])
    for one, found in zip(ways, walks_of(live), strict=True):
        plan = found.plan
        assert (one["walk"], one["foot_moves"]) == (found.digest, len(plan.legs))
        # at most twice as slow where phases end, and 5 s from one foot move to the next
        fastest = (np.abs(np.diff(plan.waypoints, axis=0)) / (0.8 * live.robot.speed_limits)).max(axis=1).sum()
        assert fastest <= one["motion"] - 5.0 * one["foot_moves"] <= 2.0 * fastest
    assert np.hypot(*(rover.state.T_site_base[:2, 3] - (GOAL.x, GOAL.y))) <= GOAL.within
    report = replay(live.export_bundle())
    assert report.ok, report.problems


def test_left_to_the_walk_planner_no_gait_is_tried(live, rover):
    loop = live.walk_to(GOAL, UNSEEN)
    assert ended(loop)[0] == "arrived"
    assert {(one["by"], one["action"], *one["planners"]) for one in chosen(live)} == {("planner", WALK, WALK)}
    assert loop.as_dict()["planners"] == {WALK: len(chosen(live))}


def test_where_a_check_fails_the_walk_planner_goes_and_the_log_says_which(live, athlete):
    dem = wavy(half=4.0, hole=HOLE)
    live.terrains.load(dem)
    standing = stand(athlete, dem)
    bare = replace(standing, wheel_forces=np.zeros_like(standing.wheel_forces), joint_torques=np.zeros(36))
    live.stances.set(bare)
    with RigidRover(live, bare):
        loop = live.walk_to(GOAL, IN_GAITS)
        assert ended(loop)[0] == "arrived"
    first = chosen(live)[0]
    assert (first["action"], first["planners"], first["found"]) == (WALK, [WAVE, WALK], True)
    refused, wave = first["refused"], walks_of(live)[0]
    assert wave.plan is None
    [blocked] = wave.blocked
    assert (refused["gait"], refused["check"], refused["leg"]) == (WAVE, blocked.check_name, blocked.leg)
    assert (refused["step"], refused["lacks"], refused["unit"]) == (blocked.move + 1, blocked.lacks, blocked.unit)
    assert refused["reason"].startswith(f"step {refused['step']} (leg ")
    size = f"{refused['lacks']:.3g} {refused['unit']}"
    assert f"fails {refused['check']} of leg {refused['leg']} by {size}" in refused["reason"]
    report = replay(live.export_bundle())
    assert report.ok, report.problems


def tripods(robot):
    """A table that has tripods as best, then waves."""
    settings = ChoiceSettings(space=StateSpace(()))
    worth = {TRIPOD: 2.0, WAVE: 1.0, WALK: 0.0}
    states = range(settings.space.size)
    seen = [SeenTransition(s, ACTIONS.index(name), reward, s) for s in states for name, reward in worth.items()]
    return learned(seen, settings, robot, 1)


def test_a_table_chooses_of_what_can_be_commanded_and_goes_with_the_session(live, rover):
    policy = tripods(live.robot_digest)
    loop = live.walk_to(WalkGoal(0.8, 0.0), replace(UNSEEN, choose_by=TABLE, policy=policy))
    assert ended(loop)[0] == "arrived"
    ways = chosen(live)
    # the first piece is as long as those that the table was learned of
    assert np.hypot(*(walks_of(live)[0].plan.Ts_site_base[-1, :2, 3])) <= policy.settings.ahead + 1e-6
    assert len(ways) >= 2
    assert {(one["action"], one["table"]) for one in ways} == {(WAVE, policy.digest)}
    assert "the table has tripod as best" in ways[0]["why"]
    assert "several feet at once" in ways[0]["why"]
    assert live.get(policy.digest).digest == policy.digest


def test_without_a_table_of_one_s_own_the_robot_s_is_taken(live, rover):
    shipped = shipped_policy(live.robot_digest)
    assert shipped is not None
    loop = live.walk_to(WalkGoal(0.8, 0.0), replace(UNSEEN, choose_by=TABLE))
    assert ended(loop)[0] == "arrived"
    assert {one["table"] for one in chosen(live)} == {shipped.digest}
    assert "the table has" in chosen(live)[0]["why"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"choose_by": TABLE, "policy": tripods("0" * 32)}, "learned for robot 00000000"),
        ({"choose_by": "whim"}, "chosen by one of"),
    ],
    ids=["another robot's table", "no such"],
)
def test_what_can_t_choose_begins_nothing(live, rover, change, said):
    with pytest.raises(InvalidInput, match=said):
        live.walk_to(GOAL, replace(UNSEEN, **change))
    assert live.walk_loop is None
    assert rover.sent == []


def test_by_a_table_nothing_begins_for_a_robot_that_has_none(live, rover, monkeypatch):
    monkeypatch.setattr(loop_ways, "shipped_policy", lambda _: None)
    with pytest.raises(InvalidInput, match="no learned table"):
        live.walk_to(GOAL, replace(UNSEEN, choose_by=TABLE))
    assert live.walk_loop is None
    assert rover.sent == []
