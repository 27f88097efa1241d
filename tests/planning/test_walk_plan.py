"""Whole walks: found, good by other means too, the same again, and refused with what failed and by how much."""

import re
import subprocess
import sys
from dataclasses import replace
from itertools import count, pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import footfall
from footfall.core.errors import Cancelled, InvalidInput
from footfall.core.grid import GridGeometry
from footfall.planning import watch
from footfall.planning.answers import Status
from footfall.planning.motion import BODY
from footfall.planning.step.problem import StepSettings
from footfall.planning.walk.assemble import checks_of
from footfall.planning.walk.plan import plan_walk
from footfall.planning.walk.problem import MOST_ATTEMPTS, Place, WalkGoal, WalkSettings, foot_moves_in_words
from footfall.planning.walk.recheck.recheck_settings import RecheckSettings
from footfall.planning.walk.recheck.walk import recheck_walk
from footfall.planning.walk.search import FIRST_TRIED, TRIED_A_METRE
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import rock_field
from tests.support.chassis_ground import lifted
from tests.support.waiting import BOUND

GRID = GridGeometry(-4.0, -4.5, 0.1, 91, 121)
GOAL = WalkGoal(1.2, 0.0, 0.0)
SETTINGS = WalkSettings(seed=3, time_limit=600.0)
"""A limit that no search here comes near: what it does depends on the seed alone."""
COARSE = RecheckSettings(way=0.01, turn=0.01, hold=0.1)


def smooth(ridge=0.0, hole=None):
    """Gentle slopes; ridge: how high one across the map is [m]; hole: (x, y, radius) that is unknown."""
    x, y = np.meshgrid(GRID.xs, GRID.ys)
    rng, z = np.random.default_rng(0), np.zeros(x.shape)
    for _ in range(8):
        often, way = rng.uniform(0.5, 2.2), rng.uniform(0.0, 6.28)
        z += 0.03 * np.sin(often * (x * np.cos(way) + y * np.sin(way)) + rng.uniform(0.0, 6.0)) / often
    z = np.where(np.abs(x - 3.2) < 0.25, z + ridge, z)
    if hole is not None:
        z[np.hypot(x - hole[0], y - hole[1]) < hole[2]] = np.nan
    return from_heights(z.astype(np.float32), GRID.resolution, GRID.x0, GRID.y0, "smooth")


@pytest.fixture(scope="module")
def ground():
    return smooth()


@pytest.fixture(scope="module")
def start(athlete, ground):
    return footfall.stand(athlete, ground)


@pytest.fixture(scope="module")
def told():
    """What was told while the walk was planned: (fraction, text)."""
    return []


@pytest.fixture(scope="module")
def found(athlete, ground, start, told):
    return plan_walk(athlete, ground, start, GOAL, settings=SETTINGS, progress=lambda *one: told.append(one))


@pytest.fixture
def slow_clock(monkeypatch):
    """Every look at the clock takes a second."""
    looks = count()
    monkeypatch.setattr(watch, "time", SimpleNamespace(monotonic=lambda: float(next(looks))))


def failed(robot, dem, plan, state, every=COARSE):
    return {one.name for one in recheck_walk(robot, dem, plan, every=every, state=state) if not one.holds}


def planned(result) -> Any:
    """The plan of a walk that was found."""
    assert result.status is Status.FOUND, result.reason
    return result.plan


def off(plan, goal):
    """How far the chassis is from a goal at the end [m], and how far turned [rad]."""
    T = plan.Ts_site_base[-1]
    turn = np.arctan2(T[1, 0], T[0, 0]) - (goal.yaw or 0.0)
    return np.hypot(T[0, 3] - goal.x, T[1, 3] - goal.y), abs(np.arctan2(np.sin(turn), np.cos(turn)))


def test_a_walk_is_found_and_good_by_other_means_too(athlete, ground, start, found):
    assert found.status is Status.FOUND, found.reason
    assert found.reason == ""
    assert all(check.holds for check in found.checks)
    checks = recheck_walk(athlete, ground, found.plan, state=start)
    assert [one for one in checks if not one.holds] == []
    assert {"start", "goal", "contact", "support", "torque", "self collision", "terrain collision"} <= {
        one.name for one in checks
    }


def test_margins_and_torques_of_a_walk_are_no_better_than_told(athlete, ground, start, found):
    """The recheck finds at least the margin that the planner told, and no more torque."""
    checks = {one.name: one for one in recheck_walk(athlete, ground, found.plan, every=COARSE, state=start)}
    told = {one.name: one for one in found.checks}
    assert told["balance (support polygon)"].margin == pytest.approx(
        float(found.plan.margins.min()) - SETTINGS.least_margin
    )
    assert checks["support"].margin == pytest.approx(told["balance (support polygon)"].margin, abs=0.02)
    assert checks["torque"].margin >= told["torque"].margin - 0.02


def test_a_walk_that_begins_with_less_than_it_is_to_keep_says_so(found):
    """The walk of other settings stands for one that begins so: what it has less of is only not to get less."""
    margin, torque = float(found.plan.margins.min()), float(found.plan.torques.max())
    asked = replace(SETTINGS, least_margin=margin + 0.02, most_torque=torque - 0.02)
    for settings, says in ((SETTINGS, False), (asked, True)):
        for check in checks_of(found.plan, settings)[:2]:
            assert check.where.endswith("with less than is asked for, which gets no less on the way") == says
            assert (check.margin < 0.0) == says


def test_the_chassis_ends_within_the_goals_tolerance(found):
    away, turned = off(found.plan, GOAL)
    assert away <= GOAL.within
    assert turned <= GOAL.turned
    assert found.plan.goal == found.goal == GOAL


def test_each_stance_has_one_foot_elsewhere_and_the_chassis_stays_while_it_moves(found):
    plan = found.plan
    for leg, (one, other) in zip(plan.legs, pairwise(plan.stances), strict=True):
        apart = np.abs(one.contacts - other.contacts).max(axis=1)
        assert np.flatnonzero(apart > 1e-9).tolist() == [leg]
        assert apart[leg] <= SETTINGS.longest
    for i in range(1, len(plan.phases)):
        still = np.array_equal(plan.Ts_site_base[i], plan.Ts_site_base[i - 1])
        assert still or plan.phases[i] == BODY


def test_the_same_arguments_give_the_same_walk(athlete, ground, start, found):
    again = plan_walk(athlete, ground, start, GOAL, settings=SETTINGS)
    assert again.digest == found.digest
    assert plan_walk(athlete, ground, start, (1.2, 0.0, 0.0), settings=SETTINGS).digest == found.digest
    assert plan_walk(athlete, ground, start, GOAL, 3, replace(SETTINGS, seed=8)).digest == found.digest
    other = plan_walk(athlete, ground, start, GOAL, 8, SETTINGS)
    assert not np.array_equal(planned(other).waypoints, found.plan.waypoints)


def test_a_fresh_process_finds_the_same_walk(athlete, ground, start, found):
    program = (
        "import footfall, tests.planning.test_walk_plan as here\n"
        "robot, dem = footfall.load_robot('athlete'), here.smooth()\n"
        "found = here.plan_walk(robot, dem, footfall.stand(robot, dem), here.GOAL, settings=here.SETTINGS)\n"
        "print(found.digest)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=BOUND)
    assert done.stdout.strip() == found.digest


def test_progress_is_told_and_never_falls(told, found):
    fractions = [fraction for fraction, _ in told]
    assert fractions[0] == 0.0
    assert fractions[-1] == 1.0
    assert fractions == sorted(fractions)
    texts = [text for _, text in told]
    assert texts[0] == "looking at the ground"
    assert "searching for foot moves" in texts
    assert any("foot moves planned" in text for text in texts)


@pytest.mark.parametrize("when", ["looking", "searching", "planned"])
def test_a_cancelled_walk_ends_wherever_it_is(athlete, ground, start, when):
    def progress(_, text):
        if when in text:
            raise Cancelled("no longer wanted")

    with pytest.raises(Cancelled):
        plan_walk(athlete, ground, start, GOAL, settings=SETTINGS, progress=progress)


def test_no_foot_is_put_on_forbidden_ground_and_one_on_each_pinned_place(athlete, ground, start, found):
    first, leg = found.plan.stances[1].contacts[found.plan.legs[0]], found.plan.legs[-1]
    last = found.plan.stances[-1].contacts[leg]
    forbidden = (Place(float(first[0]), float(first[1])), Place(float(last[0]), float(last[1]), 0.3, leg))
    x, y = start.T_site_base[:2, 3] + (found.plan.stances[0].contacts[0, :2] + (0.4, -0.1))
    pinned = (Place(float(x), float(y), 0.1),)
    settings = replace(SETTINGS, forbidden=forbidden, pinned=pinned)
    plan = planned(plan_walk(athlete, ground, start, GOAL, settings=settings))
    put = [(leg, stance.contacts[leg]) for leg, stance in zip(plan.legs, plan.stances[1:], strict=True)]
    for place in forbidden:
        away = [np.hypot(at[0] - place.x, at[1] - place.y) for leg, at in put if place.leg in (None, leg)]
        assert min(away) > place.radius
    assert min(np.hypot(at[0] - x, at[1] - y) for _, at in put) < 1e-9
    assert failed(athlete, ground, plan, start) == set()
    # neither was so by chance
    before = zip(found.plan.legs, found.plan.stances[1:], strict=True)
    assert min(np.hypot(*(stance.contacts[leg, :2] - (x, y))) for leg, stance in before) > 0.1


def test_no_leg_is_put_where_only_it_may_not_be(athlete, ground, start, found):
    """Each place that a leg was put on is forbidden to it: the walk is another, and avoids them all."""
    forbidden = tuple(
        Place(float(stance.contacts[leg, 0]), float(stance.contacts[leg, 1]), 0.15, leg)
        for leg, stance in zip(found.plan.legs, found.plan.stances[1:], strict=True)
    )
    plan = planned(plan_walk(athlete, ground, start, GOAL, settings=replace(SETTINGS, forbidden=forbidden)))
    for leg, stance in zip(plan.legs, plan.stances[1:], strict=True):
        for place in forbidden:
            away = np.hypot(stance.contacts[leg, 0] - place.x, stance.contacts[leg, 1] - place.y)
            assert place.leg != leg or away > place.radius


def test_feet_are_put_on_pinned_places_though_the_chassis_is_at_the_goal(athlete, ground, start):
    here, pins = WalkGoal(0.0, 0.0, 0.0), (Place(2.0, 1.2), Place(-2.0, -1.2))
    plan = planned(plan_walk(athlete, ground, start, here, settings=replace(SETTINGS, pinned=pins)))
    put = [stance.contacts[leg, :2] for leg, stance in zip(plan.legs, plan.stances[1:], strict=True)]
    for pin in pins:
        assert min(np.hypot(*(one - (pin.x, pin.y))) for one in put) < 1e-9
    assert failed(athlete, ground, plan, start) == set()


def between(plan, *legs):
    """A place between the feet of some legs as a walk begins, as x and y."""
    x, y = plan.stances[0].contacts[list(legs), :2].mean(axis=0)
    return float(x), float(y)


def put_by(plan, x, y):
    """Which legs a walk puts on a place."""
    put = zip(plan.legs, plan.stances[1:], strict=True)
    return {leg for leg, stance in put if np.hypot(*(stance.contacts[leg, :2] - (x, y))) < 1e-9}


@pytest.mark.parametrize(("leg", "feet"), [(0, (0, 1)), (1, (0, 1)), (None, (0, 1)), (5, (4, 5)), (2, (1, 2))])
def test_a_leg_is_put_on_the_place_that_is_pinned_for_it_though_that_is_behind(
    athlete, ground, start, found, leg, feet
):
    """It leads its leg back, aside or far behind the others; without it the walk is another's."""
    x, y = between(found.plan, *feet)
    settings = replace(SETTINGS, pinned=(Place(x, y, 0.1, leg),))
    plan = planned(plan_walk(athlete, ground, start, GOAL, settings=settings))
    assert put_by(plan, x, y) & set(athlete.legs if leg is None else (leg,))
    assert not put_by(found.plan, x, y)
    assert failed(athlete, ground, plan, start) == set()


def test_places_that_are_pinned_along_the_way_are_met_in_one_walk(athlete, ground, start):
    pins = (Place(2.9, 1.9, 0.1), Place(-0.8, -1.6, 0.1), Place(3.6, -0.1, 0.1, 0), Place(1.6, 1.3, 0.1, 1))
    plan = planned(plan_walk(athlete, ground, start, (2.5, 0.0), settings=replace(SETTINGS, pinned=pins)))
    for pin in pins:
        assert put_by(plan, pin.x, pin.y) & set(athlete.legs if pin.leg is None else (pin.leg,))
    assert failed(athlete, ground, plan, start) == set()


def test_a_pinned_place_that_no_leg_comes_to_is_refused_before_any_search(athlete, ground, start, found):
    (x, y), (far_x, far_y) = between(found.plan, 0, 1), between(found.plan, 3)
    for settings, said in (
        ({"pinned": (Place(far_x, far_y, 0.1, 0),)}, "out of reach of leg 0"),
        ({"pinned": (Place(x, y, 0.1, 0),), "forbidden": (Place(x, y, 0.1, 0),)}, "out of reach of leg 0"),
        (
            {"pinned": (Place(x, y, 0.1),), "forbidden": tuple(Place(x, y, 0.1, leg) for leg in range(6))},
            "out of reach of every leg",
        ),
    ):
        answer = plan_walk(athlete, ground, start, GOAL, settings=replace(SETTINGS, **settings))
        assert (answer.status, answer.partial) == (Status.GOAL_INVALID, None)
        assert re.search(rf"{said} .*it comes no nearer than \d\.\d\d m to it", answer.reason)


@pytest.mark.parametrize("leg", [-1, 6])
@pytest.mark.parametrize("what", ["forbidden", "pinned"])
def test_a_place_of_a_leg_that_there_is_not_is_misuse(athlete, ground, start, what, leg):
    settings = replace(SETTINGS, **{what: (Place(1.0, 0.5, 0.2, leg),)})
    with pytest.raises(InvalidInput, match=rf"said of leg {leg}: athlete has legs 0 to 5"):
        plan_walk(athlete, ground, start, GOAL, settings=settings)


@pytest.mark.parametrize(("within", "turned"), [(0.02, 1.0), (0.5, 0.01)])
def test_a_goal_that_is_narrow_is_met(athlete, ground, start, within, turned):
    goal = WalkGoal(1.2, 0.1, 0.1, within, turned)
    plan = planned(plan_walk(athlete, ground, start, goal, settings=SETTINGS))
    away, off_heading = off(plan, goal)
    assert away <= within
    assert off_heading <= turned


def refused(result, status, *words) -> Any:
    """The walk that comes nearest, of a request that is refused so."""
    assert result.status is status, result
    assert result.plan is None
    for word in words:
        assert word in result.reason, result.reason
    return result.partial


def test_a_goal_off_the_map_is_refused_with_how_far(athlete, ground, start):
    refused(
        plan_walk(athlete, ground, start, (10.0, 0.0)), Status.OFF_MAP, "(10, 0)", "2 m off the map", "x -4.00…8.00 m"
    )


def test_a_goal_on_unknown_ground_is_refused(athlete, start):
    result = plan_walk(athlete, smooth(hole=(3.0, 0.0, 0.5)), start, (3.0, 0.0))
    refused(result, Status.UNKNOWN_GROUND, "(3, 0) is unknown", "take images")


def test_a_walk_begins_with_all_wheels_on_the_ground(athlete, ground, start):
    result = plan_walk(athlete, ground, lifted(athlete, start, [1, 4]), GOAL)
    refused(result, Status.START_INVALID, "all wheels on the ground", "legs 1, 4 are not")


def test_a_limit_that_ends_before_a_foot_moves_gives_no_walk(athlete, ground, start, slow_clock):
    result = plan_walk(athlete, ground, start, GOAL, settings=replace(SETTINGS, time_limit=1.0))
    refused(result, Status.TIME_LIMIT, "after 0 foot moves", "1 s passed", "within 1.20 m with 0 foot moves")
    assert result.partial is None
    assert result.blocked == ()


def test_a_limit_on_the_way_gives_a_partial_walk_that_is_good_but_for_the_goal(athlete, ground, start, slow_clock):
    result = plan_walk(athlete, ground, start, GOAL, settings=replace(SETTINGS, time_limit=16.0))
    partial = refused(result, Status.TIME_LIMIT, "16 s passed")
    assert partial.foot_moves > 0
    away, _ = off(partial, GOAL)
    assert f"comes within {away:.2f} m with {foot_moves_in_words(partial)}" in result.reason
    assert GOAL.within < away < 1.2
    assert failed(athlete, ground, partial, start) == {"goal"}


def test_what_is_not_found_in_time_says_which_pinned_place_had_no_foot(athlete, ground, start, slow_clock):
    pins = (Place(2.3, 1.0, 0.1), Place(-0.8, -1.6, 0.1))
    result = plan_walk(athlete, ground, start, GOAL, settings=replace(SETTINGS, time_limit=12.0, pinned=pins))
    partial = refused(result, Status.TIME_LIMIT)
    unmet = [pin for pin in pins if not put_by(partial, pin.x, pin.y)]
    assert unmet
    assert [f"no foot on the pinned place ({pin.x:g}, {pin.y:g})" in result.reason for pin in pins] == [
        pin in unmet for pin in pins
    ]


def test_attempts_end_a_search_after_so_many_foot_moves(athlete, ground, start):
    """A margin that no stance has: all attempts come to nothing, each may try twice as much as the one before."""

    def tried(attempts):
        settings = replace(SETTINGS, least_margin=9.0, attempts=attempts, time_limit=1e6)
        result = plan_walk(athlete, ground, start, (0.6, 0.0), settings=settings)
        assert result.status is Status.NO_PATH
        return int(re.findall(r"after (\d+) foot moves were tried", result.reason)[0])

    one, two = tried(1), tried(2)
    assert 0 < one <= FIRST_TRIED + 0.7 * TRIED_A_METRE + 1
    assert one < two <= 3 * (FIRST_TRIED + 0.7 * TRIED_A_METRE + 1)
    for none in (0, MOST_ATTEMPTS + 1):
        with pytest.raises(InvalidInput, match=f"1 to {MOST_ATTEMPTS} attempts"):
            replace(SETTINGS, attempts=none)


def test_what_failed_most_is_counted_wherever_it_was(athlete, ground, start):
    settings = replace(SETTINGS, least_margin=9.0, attempts=1, time_limit=1e6)
    result = plan_walk(athlete, ground, start, (0.6, 0.0), settings=settings)
    tried = int(re.findall(r"after (\d+) foot moves were tried", result.reason)[0])
    told = [int(one) for one in re.findall(r"(\d+) times", result.reason)]
    assert sum(told) == tried
    assert told == sorted(told, reverse=True)
    # place by place there is more than is told of single ones
    assert sum(one.count for one in result.blocked) < tried


def test_a_refusal_names_what_is_nearer_at_the_start_than_is_asked_for(athlete, ground, start):
    """With as much clearance as it says to ask for at most nothing is nearer, with 2 mm more something is."""

    def refused(clearance):
        asked = replace(SETTINGS, clearance=clearance, least_margin=9.0, attempts=1)
        result = plan_walk(athlete, ground, start, GOAL, settings=asked)
        assert result.status is not Status.FOUND
        return re.search(r"; where it begins, .* and .* lack (\S+) m of .*: ask for (\S+) m", result.reason)

    said = refused(0.3)
    assert said
    lacks, most = float(said[1]), float(said[2])
    assert lacks + most == pytest.approx(0.3, abs=0.002)
    assert refused(most) is None
    assert refused(most + 0.002)


@pytest.mark.parametrize("height", [0.0, -1.0, np.nan, np.inf])
def test_a_height_that_no_chassis_has_over_its_feet_is_misuse(height):
    with pytest.raises(InvalidInput, match="height must be above zero"):
        replace(SETTINGS, height=height)


def test_a_goal_behind_a_wall_is_not_found_and_what_blocks_is_told(athlete, start, slow_clock):
    wall, told = smooth(ridge=3.0), []
    settings = replace(SETTINGS, time_limit=600.0)
    result = plan_walk(athlete, wall, start, (5.6, 0.0), settings=settings, progress=lambda *one: told.append(one[0]))
    partial = refused(result, Status.TIME_LIMIT)
    counts = [one.count for one in result.blocked]
    assert counts
    assert counts == sorted(counts, reverse=True)
    first = result.blocked[0]
    assert first.leg in athlete.legs
    assert f"{first.check_name} of leg {first.leg}" in result.reason
    # more than one search was begun, and what is told of them does not fall
    assert int(re.findall(r"after (\d+) foot moves were tried", result.reason)[0]) > FIRST_TRIED + 5.6 * TRIED_A_METRE
    assert told == sorted(told)
    # the chassis stays on this side
    assert partial.Ts_site_base[-1, 0, 3] < 3.0
    assert failed(athlete, wall, partial, start) == {"goal"}


def test_a_pinned_place_without_ground_is_refused(athlete, start):
    settings = replace(SETTINGS, pinned=(Place(2.5, 0.5),))
    result = plan_walk(athlete, smooth(hole=(2.5, 0.5, 0.4)), start, GOAL, settings=settings)
    refused(result, Status.GOAL_INVALID, "pinned place (2.5, 0.5)")


def test_forbidden_ground_everywhere_is_refused(athlete, ground, start):
    settings = replace(SETTINGS, forbidden=(Place(0.0, 0.0, 30.0),))
    refused(
        plan_walk(athlete, ground, start, GOAL, settings=settings), Status.GOAL_INVALID, "no foot can be put anywhere"
    )


def test_a_heading_without_ground_for_a_foot_is_refused_with_the_leg(athlete, ground, start):
    # at the edge of the map
    result = plan_walk(athlete, ground, start, (7.9, 0.0, 0.0), settings=SETTINGS)
    refused(result, Status.GOAL_INVALID, "would have no place to stand at the goal", "choose another goal or heading")


@pytest.mark.parametrize("goal", [(1.0, 0.0), (-0.6, 0.0), (0.0, 0.8)])
def test_a_rover_that_stands_tall_over_rocks_gets_on(athlete, goal):
    """Its legs are nearly straight: on the way down to where it would walk, wrists would pass straight."""
    rocks = rock_field(size=9.0, resolution=0.05, abundance=0.03, largest=0.4, seed=7)
    tall = footfall.stand(athlete, rocks)
    assert tall.T_site_base[2, 3] > 1.85
    result = plan_walk(athlete, rocks, tall, goal, settings=SETTINGS)
    assert result.plan is not None, result.reason
    assert np.hypot(*(result.plan.Ts_site_base[-1, :2, 3] - goal)) <= 0.15
    assert failed(athlete, rocks, result.plan, tall) == set()


@pytest.mark.parametrize("goal", [(np.nan, 0.0), (1.0, np.inf), (1.0, 0.0, np.nan), (1.0,), (1.0, 2.0, 3.0, 4.0)])
def test_a_goal_that_makes_no_sense_is_misuse(athlete, ground, start, goal):
    with pytest.raises(InvalidInput, match="goal needs"):
        plan_walk(athlete, ground, start, goal)


def test_the_state_of_another_robot_is_misuse(athlete, ground, start):
    with pytest.raises(InvalidInput, match="state is of other"):
        plan_walk(athlete, ground, replace(start, robot="other"), GOAL)


def test_settings_of_a_step_are_misuse(athlete, ground, start):
    settings: Any = StepSettings()
    with pytest.raises(InvalidInput, match="WalkSettings"):
        plan_walk(athlete, ground, start, GOAL, settings=settings)
