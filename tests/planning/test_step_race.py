"""Planners in a race: turns, what each may look, who wins, and how it ends."""

import itertools
import subprocess
import sys
from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.steps.known import known
from benchmarks.steps.problem import build
from benchmarks.steps.recheck import rechecked
from benchmarks.steps.search import situation_of
from footfall.core.errors import Cancelled
from footfall.planning.answers import Status
from footfall.planning.body.stand import stand
from footfall.planning.step import plan
from footfall.planning.step.goals import MOST_GOALS
from footfall.planning.step.plan import plan_step
from footfall.planning.step.planners import REGISTRY, PlannerAnswer
from footfall.planning.step.problem import StepSettings
from footfall.planning.step.turns import AUTO, FIRST_LOOKS, GROWTH, RACE, Turns
from footfall.planning.watch import OutOfTime, OutOfTurn, Watch
from footfall.robot.meshes.collision import CollisionScene
from tests.support.chassis_ground import wavy

OPEN_TARGET, ROCK_TARGET = (2.05, 0.45), (1.95, 0.55)
TRAP = "bug trap 27"
"""``fast`` finds no sure posture beside the start of its swing where it looks at no wheel's own shape."""


def asked_of(problem, scene, planner):
    settings = StepSettings(planner=planner, seed=1, steep_ground=False)
    return plan_step(scene.robot, scene.dem, scene.state, problem.leg, problem.target, settings=settings, explain=True)


@pytest.fixture(scope="module")
def rocky(athlete):
    dem = wavy([(2.15, 0.33, 0.12, 0.4)], half=4.0, resolution=0.05)
    return dem, stand(athlete, dem)


@pytest.fixture(scope="module")
def level(athlete):
    dem = wavy(half=4.0, resolution=0.05)
    return dem, stand(athlete, dem)


@pytest.fixture(scope="module")
def trap():
    problem = next(row.problem for row in known() if row.problem.name == TRAP)
    return problem, build(problem)


@pytest.fixture(scope="module")
def raced(trap):
    problem, scene = trap
    return asked_of(problem, scene, "race")


class Entrants:
    """In place of the planners: they look and look, and some come to an end."""

    def __init__(self, monkeypatch, finds=None, fails=None):
        self.looks = Counter()
        self._finds, self._fails = finds or {}, fails or {}
        self._line = REGISTRY["line"]
        for name in RACE:
            monkeypatch.setitem(REGISTRY, name, lambda swing, name=name: self._search(name, swing))

    def _search(self, name, swing):
        ends = self._finds.get(name, self._fails.get(name, np.inf))
        for _ in range(ends) if np.isfinite(ends) else itertools.count():
            self.looks[name] += 1
            swing.space.tick()
        if name in self._finds:
            return self._line(swing)
        return PlannerAnswer(None, lambda: f"{name} has looked everywhere")


# --- turns ----------------------------------------------------------------------------------------------------------


@given(st.dictionaries(st.sampled_from(RACE), st.integers(1, 6), min_size=len(RACE)))
def test_who_has_not_failed_has_one_turn_in_each_round_and_more_looks_each_time(last):
    turns, given_ = Turns("race"), []
    for turn in turns:
        given_.append(turn)
        if turn.number == last[turn.planner]:
            turns.has_failed(turn.planner)
    for number, of in itertools.groupby(given_, key=lambda turn: turn.number):
        of = list(of)
        assert [turn.planner for turn in of] == [name for name in RACE if last[name] >= number]
        assert {turn.looks for turn in of} == {FIRST_LOOKS * GROWTH ** (number - 1)}
    assert Counter(turn.planner for turn in given_) == last
    # all that a planner was given is less than this many times its last turn
    for name in RACE:
        looks = [turn.looks for turn in given_ if turn.planner == name]
        assert sum(looks) < GROWTH / (GROWTH - 1) * looks[-1]


@pytest.mark.parametrize(("asked", "names"), [("auto", AUTO), ("sbl", ("sbl",))])
def test_without_a_race_each_has_one_turn_without_end(asked, names):
    turns, given_ = Turns(asked), []
    for turn in turns:
        given_.append((turn.planner, turn.looks))
        turns.has_failed(turn.planner)
    assert given_ == [(name, np.inf) for name in names]


@given(st.integers(0, 50), st.lists(st.integers(1, 20), max_size=20))
def test_a_turn_ends_at_the_first_look_beyond_it_and_not_after_it(most, looks):
    watch, made = Watch(), 0
    with_turn = itertools.accumulate(looks)
    try:
        with watch.at_most(most):
            for one in looks:
                watch.tick(one)
                made += one
        assert sum(looks) <= most
    except OutOfTurn:
        assert made <= most < next(total for total in with_turn if total > made)
    for _ in range(100):
        watch.tick()


def test_time_that_is_up_is_told_before_a_turn_that_is(monkeypatch):
    watch = Watch(time_limit=-1.0)
    with pytest.raises(OutOfTime), watch.at_most(0):
        watch.tick()


# --- who wins -------------------------------------------------------------------------------------------------------


def test_it_finds_what_fast_does_not_and_says_who_failed_who_ran_out_and_who_won(trap, raced):
    problem, scene = trap
    assert asked_of(problem, scene, "fast").plan is None
    assert raced.status is Status.FOUND, raced.reason
    found = raced.plan
    assert found.planner in set(RACE) - {"line", "fast"}
    assert all(check.holds for check in raced.checks)
    situation = situation_of(problem, scene)
    meshes = CollisionScene(
        scene.robot, scene.state.posture, problem.leg, scene.state.T_site_base, situation.ground.mesh, 0.0, 0.15
    )
    assert rechecked(problem, scene, found, meshes).bad == ""
    told = {one.text.split()[0]: one for one in raced.decisions if one.about == "planner"}
    assert "too narrow for the compiled check" in told["fast"].text
    assert [name for name, one in told.items() if one.taken] == [found.planner]
    assert f"{found.planner} found the swing in turn " in told[found.planner].text


def test_the_winner_found_what_it_finds_alone(trap, raced):
    problem, scene = trap
    alone = asked_of(problem, scene, raced.plan.planner).plan
    assert alone is not None
    assert np.array_equal(alone.waypoints, raced.plan.waypoints)


def test_the_same_race_ends_the_same_again_and_in_another_process(trap, raced):
    code = (
        "from tests.planning.test_step_race import *\n"
        f"problem = next(row.problem for row in known() if row.problem.name == {TRAP!r})\n"
        "print(asked_of(problem, build(problem), 'race').plan.digest)"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()
    problem, scene = trap
    again = asked_of(problem, scene, "race").plan
    assert again is not None
    assert again.digest == out == raced.plan.digest


def test_a_step_that_the_first_planners_find_costs_no_race(athlete, rocky):
    dem, state = rocky
    auto, race = (plan_step(athlete, dem, state, 0, ROCK_TARGET, name, seed=1) for name in ("auto", "race"))
    assert auto.plan is not None
    assert race.plan is not None
    assert race.plan.planner == auto.plan.planner == "fast"
    assert np.array_equal(race.plan.waypoints, auto.plan.waypoints)


def test_points_are_passed_in_a_race(athlete, rocky):
    dem, state = rocky
    result = plan_step(athlete, dem, state, 0, ROCK_TARGET, "race", seed=1, through=[(1.9, 0.1, 0.85)])
    assert result.status is Status.FOUND, result.reason
    assert all(check.holds for check in result.checks)


def test_the_others_are_given_no_more_looks_than_their_turns(athlete, level, monkeypatch):
    entrants = Entrants(monkeypatch, finds={"sbl": 3 * FIRST_LOOKS}, fails={"line": 1, "kpiece": FIRST_LOOKS + 1})
    dem, state = level
    result = plan_step(athlete, dem, state, 0, OPEN_TARGET, "race", explain=True)
    assert result.status is Status.FOUND, result.reason
    assert result.plan is not None
    assert result.plan.planner == "sbl"
    # with 1, 2 and 4 times the first looks sbl wins in its third turn, and each turn ends at the look beyond it
    two, three = (MOST_GOALS * sum(FIRST_LOOKS * GROWTH**k + 1 for k in range(n)) for n in (2, 3))
    wins = MOST_GOALS * sum(FIRST_LOOKS * GROWTH**k + 1 for k in range(2)) + 3 * FIRST_LOOKS
    fails = MOST_GOALS * 2 * (FIRST_LOOKS + 1)
    assert entrants.looks == {
        "line": MOST_GOALS,
        "fast": three,
        "astar": three,
        "sbl": wins,
        "rrtconnect": two,
        "kpiece": fails,
        "bitstar": two,
    }
    told = {one.text.split()[0]: one.text for one in result.decisions if one.about == "planner"}
    assert told["line"].endswith("line has looked everywhere")
    assert told["kpiece"].endswith("kpiece has looked everywhere")
    for name, looks in (("fast", 4), ("astar", 4), ("rrtconnect", 2), ("bitstar", 2)):
        assert told[name].endswith(f"goal postures: its last turn, of {looks * FIRST_LOOKS} looks, ended")
    assert told["sbl"] == "sbl found the swing in turn 3 of the race"


# --- how it ends without a plan -------------------------------------------------------------------------------------


def test_where_all_have_failed_each_says_why(athlete, level, monkeypatch):
    Entrants(monkeypatch, fails={name: 700 * (i + 1) for i, name in enumerate(RACE)})
    dem, state = level
    result = plan_step(athlete, dem, state, 0, OPEN_TARGET, "race", explain=True)
    assert result.status is Status.NO_PATH
    assert [one.text.split()[0] for one in result.decisions] == list(RACE)
    for name in RACE:
        assert f"{name} has looked everywhere" in result.reason
    assert "looks, ended" not in result.reason


def test_real_planners_on_a_problem_without_solution_say_why(monkeypatch):
    row = next(row for row in known() if row.unsolvable and row.problem.family == "past a hanging plate")
    scene, few = build(row.problem), StepSettings(planner="race", milestones=30, seed=1)
    asked = scene.robot, scene.dem, scene.state, row.problem.leg, row.problem.target
    proven = plan_step(*asked, settings=few, explain=True)
    assert proven.status is Status.NO_PATH
    assert "can't pass" in proven.reason
    assert [one.text.split()[0] for one in proven.decisions] == ["line", "fast"]
    monkeypatch.setattr(plan, "shut_in", lambda *some: "")
    result = plan_step(*asked, settings=few, explain=True)
    assert result.status is Status.NO_PATH
    assert [one.text.split()[0] for one in result.decisions] == list(RACE)
    for one in result.decisions:
        assert one.text.split(" goal postures: ")[1] in result.reason


def test_time_ends_a_race(athlete, level, monkeypatch):
    Entrants(monkeypatch)
    dem, state = level
    limited = StepSettings(planner="race", time_limit=0.3)
    result = plan_step(athlete, dem, state, 0, OPEN_TARGET, settings=limited)
    assert result.status is Status.TIME_LIMIT
    assert result.reason.startswith("0.3 s passed while planning the swing with ")


def test_a_race_is_cancelled_in_the_middle_and_reports_until_then(athlete, level, monkeypatch):
    Entrants(monkeypatch)
    dem, state = level
    told = []

    def progress(fraction, text):
        told.append((fraction, text))
        if sum("kpiece" in text for _, text in told) > 2 * MOST_GOALS:
            raise Cancelled("stop")

    with pytest.raises(Cancelled):
        plan_step(athlete, dem, state, 0, OPEN_TARGET, "race", progress=progress)
    assert [fraction for fraction, _ in told] == sorted(fraction for fraction, _ in told)
    assert told[-1][0] < 0.75
    assert {name for name in RACE if any(text.endswith(f"with {name}") for _, text in told)} == set(RACE)
