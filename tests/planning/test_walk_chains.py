"""Which footfalls a foot comes to from which, and a search that goes by the foot moves that are left."""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from footfall.core.frames import apply
from footfall.planning.answers import Status
from footfall.planning.body.stand import stand
from footfall.planning.walk.chains import APART, joined, moves_left
from footfall.planning.walk.plan import plan_walk
from footfall.planning.walk.problem import Place, WalkGoal, WalkSettings
from footfall.planning.walk.reach import come_to
from footfall.planning.walk.smoothing import Smoothing
from footfall.robot.kinematics import wheel_centers
from tests.support.chassis_ground import wavy

AS_FOUND = WalkSettings(seed=1, smoothing=Smoothing(rounds=0))
some = {"seed": st.integers(0, 1000), "count": st.integers(0, 60), "longest": st.floats(0.1, 3.0)}


def places_of(seed, count):
    """So many places beside the first, with spans."""
    rng = np.random.default_rng(seed)
    xy, low = rng.uniform(-4.0, 4.0, (count + 1, 2)), rng.uniform(0.0, 2.0, count + 1)
    return xy, low, low + rng.uniform(0.0, 1.0, count + 1)


def moves_from(first, xy, low, high, longest, apart):
    """Place → foot moves to it from those of ``first``, move after move, each pair of places asked by itself."""
    moves = dict.fromkeys(first, 0)
    newest = list(first)
    while newest:
        at = newest.pop(0)
        for to in set(range(len(xy))) - moves.keys():
            meets = max(low[at], low[to]) - min(high[at], high[to]) <= apart
            if meets and np.hypot(*(xy[at] - xy[to])) <= longest:
                moves[to] = moves[at] + 1
                newest.append(to)
    return moves


@settings(max_examples=40, derandomize=True, deadline=None)
@given(apart=st.sampled_from([0.0, APART]), **some)
def test_a_foot_goes_on_between_places_that_it_reaches_from_one_part_of_the_way(seed, count, longest, apart):
    """Second method: move after move."""
    xy, low, high = places_of(seed, count)
    came = set(moves_from([0], xy, low, high, longest, apart))
    assert set(np.flatnonzero(joined(xy, low, high, longest, apart)).tolist()) == came
    assert (joined(xy, low, high, longest, np.inf)[1:] == come_to(xy[1:], xy[0], longest)).all()


@settings(max_examples=40, derandomize=True, deadline=None)
@given(**some)
def test_the_foot_moves_that_are_left_are_counted_to_the_nearest_end(seed, count, longest):
    """Second method: move after move, from all ends at once."""
    xy, low, high = places_of(seed, count)
    ends = high >= 2.0
    moves = moves_from(np.flatnonzero(ends).tolist(), xy, low, high, longest, APART)
    left = moves_left(ends, xy, low, high, longest)
    assert left.tolist() == [moves.get(place, np.inf) for place in range(count + 1)]


def test_a_second_attempt_takes_a_foot_aside_that_finds_no_way_on_straight_ahead(athlete):
    """Ground forbidden to leg 0 alone lies across its way, up to 2.75 m to one side; the first attempt, by spans, puts
    the foot before it and tries all that the other feet can do."""
    ground = wavy(half=5.0)
    stood = stand(athlete, ground)
    x = float(apply(stood.T_site_base, wheel_centers(athlete, stood.posture))[0, 0])
    across = tuple(Place(x + 0.9, y, 0.45, leg=0) for y in (-0.7, -0.2, 0.3, 0.8, 1.3, 1.8, 2.3))
    asked = replace(AS_FOUND, forbidden=across, attempts=1)
    once = plan_walk(athlete, ground, stood, WalkGoal(1.6, 0.0), settings=asked)
    assert once.status is Status.NO_PATH
    twice = plan_walk(athlete, ground, stood, WalkGoal(1.6, 0.0), settings=replace(asked, attempts=2))
    assert twice.plan is not None, twice.reason
    put = [stance.contacts[0] for stance in twice.plan.stances]
    assert all(np.hypot(spot[0] - one.x, spot[1] - one.y) > one.radius for spot in put for one in across)
    assert put[-1][0] > x + 0.9
    assert min(spot[1] for spot in put) < -0.7 - 0.45 / 2.0
