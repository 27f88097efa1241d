"""Smoothed walks: good by other means too, never dearer than they were found, with the footfalls that they had."""

from dataclasses import replace
from itertools import count, pairwise
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import footfall
from benchmarks.walks.terrains import TRAINING, terrain
from footfall.core.errors import InvalidInput, NotFound
from footfall.core.value import Provenance, flatten, unflatten
from footfall.planning.answers import Status
from footfall.planning.motion import BODY
from footfall.planning.walk import plan as planning
from footfall.planning.walk import smooth
from footfall.planning.walk.assemble import walk_of
from footfall.planning.walk.body_way import At, BodyWay, Fails, body_way
from footfall.planning.walk.foot_move import Moved, foot_move
from footfall.planning.walk.footprint import footprint, height_above_feet
from footfall.planning.walk.problem import Stance, WalkGoal, WalkResult, WalkSettings
from footfall.planning.walk.recheck.recheck_settings import RecheckSettings
from footfall.planning.walk.recheck.walk import recheck_walk
from footfall.planning.walk.smooth_kernel import METRES_A_RADIAN, OFF_HEIGHT, ROOMY_MARGIN
from footfall.planning.walk.smoothing import MOST_ROUNDS, Smoothing
from footfall.planning.walk.world import World
from footfall.planning.watch import OutOfTime, Watch
from footfall.terrain.dem import Dem

GOAL = WalkGoal(1.2, 0.0, 0.0)
AS_FOUND = Smoothing(rounds=0)
COARSE = RecheckSettings(way=0.01, turn=0.01, hold=0.1)
GROUND = (("smooth", TRAINING[3]), ("rocks", TRAINING[1]), ("steep", TRAINING[2]))


def walked(robot, dem, smoothing, goal=GOAL) -> Any:
    settings = WalkSettings(seed=3, time_limit=600.0, smoothing=smoothing)
    result = planning.plan_walk(robot, dem, standing(robot, dem), goal, settings=settings)
    assert result.status is Status.FOUND, result.reason
    return result


def standing(robot, dem):
    return footfall.stand(robot, dem, posture="crouch")


def failed(robot, dem, plan):
    return {
        one.name for one in recheck_walk(robot, dem, plan, every=COARSE, state=standing(robot, dem)) if not one.holds
    }


class Caught(NamedTuple):
    """What is given to be smoothed."""

    dem: Dem
    world: World
    start: At
    moves: list[Moved]
    closing: BodyWay
    height: float


@pytest.fixture(scope="module", params=GROUND, ids=lambda one: one[0])
def ground(request):
    return terrain(*request.param)


@pytest.fixture(scope="module")
def both(athlete, ground):
    """A walk as it is found, and smoothed."""
    return walked(athlete, ground, AS_FOUND), walked(athlete, ground, Smoothing(rounds=4))


@pytest.fixture(scope="module")
def caught(athlete):
    dem, given = terrain(*GROUND[0]), []

    def catch(*arguments):
        given.append(arguments[:-1])
        return *arguments[2:4], None

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(planning, "smoothed", catch)
        walked(athlete, dem, Smoothing())
    return Caught(dem, *given[0])


def smoothed(caught: Caught) -> tuple[Any, Any, Any]:
    return smooth.smoothed(*caught[1:], Watch())


def plan_of(way, closing, start, world):
    return walk_of(GOAL, start, way, closing, Provenance({}, world.settings, world.settings.seed))


def test_a_smoothed_walk_is_good_by_other_means_too(athlete, ground, both):
    assert failed(athlete, ground, both[1].plan) == set()


@pytest.mark.parametrize("posture", ["crouch", "tall"])
def test_walks_near_a_posture_are_good_by_other_means_too(athlete, posture):
    dem = terrain(*GROUND[0])
    assert failed(athlete, dem, walked(athlete, dem, Smoothing(posture=posture, nominal=2.0)).plan) == set()


def test_a_smoothed_walk_costs_less_than_the_same_as_found(both):
    found, smoothed = both
    assert found.smoothed is None
    assert smoothed.smoothed.after.cost < smoothed.smoothed.before.cost
    assert smoothed.smoothed.after.foot_moves <= smoothed.smoothed.before.foot_moves


def test_what_is_told_of_smoothing_is_what_the_walks_come_to(both):
    found, smoothed = both
    for told, plan in ((smoothed.smoothed.before, found.plan), (smoothed.smoothed.after, smoothed.plan)):
        assert told.foot_moves == plan.foot_moves
        assert told.chassis_way == pytest.approx(plan.chassis_way)
        assert told.turning == pytest.approx(sum(np.abs(b - a).max() for a, b in pairwise(plan.waypoints)))
        assert told.least_margin == pytest.approx(plan.margins.min())
        assert told.largest_torque == pytest.approx(plan.torques.max())


def cost_of(plan, height, asked) -> float:
    """Second method: of a plan's rows, without what is asked about the robot."""
    total = asked.foot_move * plan.foot_moves
    least = plan.provenance.settings.least_margin
    for number in range(plan.foot_moves + 1):
        own = np.flatnonzero(plan.moves == number)
        # a way begins where the one before it ends
        rows = own if number == 0 else np.concatenate([own[:1] - 1, own])
        body = rows[: 1 + sum(plan.phases[row] == BODY for row in rows[1:])]
        turned = [Rotation.from_matrix(R).inv() for R in plan.Ts_site_base[body, :3, :3]]
        turns = [(one * other.inv()).magnitude() for one, other in pairwise(turned)]
        way = sum(np.linalg.norm(b[:3, 3] - a[:3, 3]) for a, b in pairwise(plan.Ts_site_base[body]))
        total += asked.way * (way + METRES_A_RADIAN * sum(turns))
        total += asked.turning * sum(np.abs(b - a).max() for a, b in pairwise(plan.waypoints[rows]))
        spare = min(max(plan.margins[own].min() - least, 0.0) / ROOMY_MARGIN, 1.0)
        total += asked.torque * plan.torques[own].max() ** 4 + asked.margin * (1.0 - spare) ** 2
        high = plan.Ts_site_base[own[-1], 2, 3] - plan.stances[number].contacts[:, 2].mean()
        total += asked.nominal * ((high - height) / OFF_HEIGHT) ** 2
    return total


@pytest.mark.parametrize("posture", [None, "stand"])
def test_the_cost_is_that_of_the_plans_rows(athlete, posture):
    dem, asked = terrain(*GROUND[0]), Smoothing(posture=posture, clearance=0.0)
    height = height_above_feet(athlete, athlete.posture(posture)) if posture else footprint(athlete).height
    found, smoothed = (walked(athlete, dem, one) for one in (AS_FOUND, asked))
    for told, plan in ((smoothed.smoothed.before, found.plan), (smoothed.smoothed.after, smoothed.plan)):
        assert told.cost == pytest.approx(cost_of(plan, height, asked), rel=1e-5)


def test_each_leg_has_the_footfalls_that_it_had_or_fewer(both):
    found, smoothed = (result.plan for result in both)
    for leg in range(len(found.stances[0].contacts)):
        had = [
            tuple(stance.contacts[leg]) for one, stance in zip(found.legs, found.stances[1:], strict=True) if one == leg
        ]
        rest = iter(had)
        for one, stance in zip(smoothed.legs, smoothed.stances[1:], strict=True):
            if one == leg:
                # in the same order: looking on never turns back
                assert tuple(stance.contacts[leg]) in rest
    if len(found.legs) == len(smoothed.legs):
        assert found.legs == smoothed.legs
        assert [one.digest for one in found.stances] == [one.digest for one in smoothed.stances]


def test_more_rounds_never_cost_more(athlete, caught):
    costs = []
    asked = caught.world.settings
    try:
        for rounds in (1, 2, 4):
            caught.world.settings = replace(asked, smoothing=Smoothing(rounds=rounds))
            _, _, told = smoothed(caught)
            costs.append(told.after.cost)
    finally:
        caught.world.settings = asked
    assert costs == sorted(costs, reverse=True)
    assert costs[0] < told.before.cost


@pytest.mark.parametrize("size", [0.1, 0.5, 3.0])
def test_whatever_pose_is_proposed_the_walk_stays_good_and_gets_no_dearer(athlete, caught, monkeypatch, size):
    """Poses at random instead of better ones, but for where the goal is."""
    rng, proposed = np.random.default_rng(5), []

    def at_random(now, *rest):
        changes = np.minimum(rest[1], 1.0)
        rest[-1][:] = now + size * rng.standard_normal(6) * changes
        proposed.append(now)
        return 1.0

    monkeypatch.setattr(smooth, "better_pose", at_random)
    way, last, told = smoothed(caught)
    assert len(proposed) > len(way)
    assert told.after.cost <= told.before.cost
    assert failed(athlete, caught.dem, plan_of(way, last, caught.start, caught.world)) == set()


def proposing(by):
    """Instead of a better pose, one that is ``by`` (x, y, z) off [m]."""

    def proposed(now, *rest):
        rest[-1][:] = now
        rest[-1][:3] += by
        return 1.0

    return proposed


@pytest.mark.parametrize("by", [(0.0, 0.0, 3.0), (1.5, 0.0, 0.0), (0.0, 0.0, -1.0)])
def test_a_pose_that_breaks_a_check_is_rejected(caught, monkeypatch, by):
    """Though it would cost less: looks at the cost tell less each time."""
    falling = count(0.0, -1.0)
    monkeypatch.setattr(smooth._Smoothing, "_shorten", lambda self: None)
    monkeypatch.setattr(smooth.Cost, "of", lambda *_: next(falling))
    monkeypatch.setattr(smooth, "better_pose", proposing(by))
    way, last, _ = smoothed(caught)
    assert [one is other for one, other in zip(way, caught.moves, strict=True)] == [True] * len(caught.moves)
    assert last is caught.closing


def test_a_pose_that_costs_no_less_is_rejected(caught, monkeypatch):
    """Though it holds: it is taken as soon as it costs less."""
    monkeypatch.setattr(smooth._Smoothing, "_shorten", lambda self: None)
    monkeypatch.setattr(smooth, "better_pose", proposing((0.0, 0.0, 0.01)))
    monkeypatch.setattr(smooth.Cost, "of", lambda *_: 1.0)
    way, last, _ = smoothed(caught)
    assert [one is other for one, other in zip(way, caught.moves, strict=True)] == [True] * len(caught.moves)
    assert last is caught.closing
    falling = count(0.0, -1.0)
    monkeypatch.setattr(smooth.Cost, "of", lambda *_: next(falling))
    way, _, _ = smoothed(caught)
    assert not any(one is other for one, other in zip(way, caught.moves, strict=True))


def test_a_rover_that_is_at_its_goal_stays(athlete):
    dem = terrain(*GROUND[0])
    here = WalkGoal(0.0, 0.0, 0.0)
    result = walked(athlete, dem, Smoothing(posture="tall"), here)
    assert result.plan.foot_moves == 0
    assert result.plan.chassis_way == 0.0
    assert result.smoothed is None


def test_a_foot_that_goes_forth_and_back_stays(athlete, caught):
    rng, at = np.random.default_rng(2), caught.moves[-1].to
    forth = back = Fails("none was tried")
    for leg in athlete.legs:
        # 3 cm higher, in the air: a walk that stays so would fail
        contacts, wheels = np.array(at.stance.contacts), np.array(at.stance.Ts_site_wheel)
        contacts[leg, 2] += 0.03
        wheels[leg, 2, 3] += 0.03
        away = Stance(contacts, at.stance.normals, wheels, at.stance.branches)
        aim = smooth.Way(caught.start, tuple(caught.moves), caught.closing).vector(len(caught.moves) - 1)
        forth = foot_move(caught.world, at, leg, away, aim, rng)
        back = forth if isinstance(forth, Fails) else foot_move(caught.world, forth.to, leg, at.stance, aim, rng)
        if not isinstance(back, Fails):
            break
    assert not isinstance(forth, Fails), forth
    assert not isinstance(back, Fails), back
    then = body_way(caught.world.around(back.to.T_site_base).checks, back.to, caught.closing.Ts_site_base[-1])
    assert not isinstance(then, Fails), then
    _, _, plain = smoothed(caught)
    way, last, told = smoothed(caught._replace(moves=[*caught.moves, forth, back], closing=then))
    assert told.before.foot_moves == plain.before.foot_moves + 2
    assert told.after.foot_moves <= plain.before.foot_moves
    assert failed(athlete, caught.dem, plan_of(way, last, caught.start, caught.world)) == set()


def test_a_limit_that_passes_while_smoothing_leaves_the_walk_as_good_as_it_is(athlete, caught, monkeypatch):
    better = smooth._Smoothing._better

    def late(self, number):
        if number == len(caught.moves) // 2:
            raise OutOfTime
        better(self, number)

    assert not smoothed(caught)[2].cut_short
    monkeypatch.setattr(smooth._Smoothing, "_better", late)
    way, last, told = smoothed(caught)
    assert told.cut_short
    assert told.after.cost < told.before.cost
    assert failed(athlete, caught.dem, plan_of(way, last, caught.start, caught.world)) == set()


def test_the_chassis_comes_nearer_to_the_posture_that_was_chosen(athlete):
    dem, off = terrain(*GROUND[0]), {}
    for posture in ("crouch", "stand", "tall"):
        wanted = height_above_feet(athlete, athlete.posture(posture))
        for name, smoothing in (("found", AS_FOUND), (posture, Smoothing(posture=posture, nominal=2.0, rounds=3))):
            plan = walked(athlete, dem, smoothing).plan
            ends = [np.flatnonzero(plan.moves == k)[-1] for k in range(plan.foot_moves + 1)]
            high = [plan.Ts_site_base[row, 2, 3] - plan.stances[k].contacts[:, 2].mean() for k, row in enumerate(ends)]
            off[posture, name] = np.abs(np.array(high) - wanted).mean()
        assert off[posture, posture] < off[posture, "found"], off


def test_a_posture_that_the_robot_does_not_have_is_named(athlete):
    dem = terrain(*GROUND[0])
    settings = WalkSettings(smoothing=Smoothing(posture="kneel"))
    with pytest.raises(NotFound, match=r"kneel.*stand, crouch, tall"):
        planning.plan_walk(athlete, dem, standing(athlete, dem), GOAL, settings=settings)


def test_a_posture_that_no_smoothing_comes_near_is_misuse(athlete):
    dem = terrain(*GROUND[0])
    settings = WalkSettings(smoothing=Smoothing(rounds=0, posture="tall"))
    with pytest.raises(InvalidInput, match="ask for 1 round of it or more, or for no posture"):
        planning.plan_walk(athlete, dem, standing(athlete, dem), GOAL, settings=settings)


@pytest.mark.parametrize("wrong", [{"rounds": -1}, {"rounds": MOST_ROUNDS + 1}, {"torque": -0.1}, {"way": np.nan}])
def test_smoothing_that_makes_no_sense_is_misuse(wrong):
    with pytest.raises(InvalidInput):
        Smoothing(**wrong)


def test_settings_from_before_there_was_smoothing_mean_none(both):
    structure, arrays = flatten(WalkSettings(seed=4, smoothing=AS_FOUND))
    assert "smoothing" not in structure["of"]
    assert unflatten(structure, arrays).smoothing.rounds == 0
    structure, arrays = flatten(both[0])
    assert "smoothed" not in structure["of"]
    again = unflatten(*flatten(both[1]))
    assert isinstance(again, WalkResult)
    assert again.digest == both[1].digest
    assert again.smoothed is not None
