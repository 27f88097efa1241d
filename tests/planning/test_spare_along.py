"""How near a walk comes to ground and rover, and how old its footfalls' ground is: for who looks at it."""

from dataclasses import replace

import numpy as np
import pytest

from footfall.planning.body.stand import stand
from footfall.planning.scene.whole_body import GROUND_FAR, WholeBody
from footfall.planning.walk.spare_along import seen_before, spare_along
from tests.support.chassis_ground import wavy
from tests.support.short_walks import LEG, short_walk


@pytest.fixture(scope="module")
def ground():
    return wavy()


@pytest.fixture(scope="module")
def walk(athlete, ground):
    return short_walk(athlete, ground, stand(athlete, ground))


def test_parts_are_the_phases_of_the_foot_moves_one_after_the_other(athlete, ground, walk):
    found = spare_along(athlete, ground, walk)
    assert [part.first for part in found] == [0, *(part.last for part in found[:-1])]
    assert found[-1].last == len(walk.waypoints) - 1
    for part in found:
        assert len({(walk.moves[row], walk.phases[row]) for row in range(part.first + 1, part.last + 1)}) == 1
        assert part.first <= part.waypoint <= part.last
        assert 0.0 <= part.spare <= GROUND_FAR


def test_it_is_no_more_than_meshes_measure_and_nearly_that(athlete, ground, walk, monkeypatch):
    """The second method: exact distances of coal's meshes, over the same samples."""
    proven = spare_along(athlete, ground, walk)
    monkeypatch.setattr(WholeBody, "own_at_least", WholeBody.own_gap)
    monkeypatch.setattr(WholeBody, "ground_at_least", WholeBody.ground_gap)
    measured = spare_along(athlete, ground, walk)
    for one, other in zip(proven, measured, strict=True):
        assert one.spare <= other.spare + 1e-6
        assert one.spare == pytest.approx(other.spare, abs=5e-3)


def test_ground_that_rises_under_a_swing_takes_what_was_to_spare(athlete, ground, walk):
    """A block as high as the wheel is lifted, under the middle of its way: it was free, and is not any more."""
    at, to = (stance.contacts[LEG] for stance in walk.stances)
    x, y = np.meshgrid(ground.geometry.xs, ground.geometry.ys)
    middle = 0.5 * (at + to)
    heights = ground.heights.copy()
    heights[np.hypot(x - middle[0], y - middle[1]) < 0.2] += 1.0
    swing = next(i for i, part in enumerate(spare_along(athlete, ground, walk)) if walk.phases[part.last] == "swing")
    before, after = (spare_along(athlete, dem, walk)[swing] for dem in (ground, replace(ground, heights=heights)))
    assert before.spare > 0
    assert not after.spare > 0


def test_unknown_ground_counts_as_high_as_its_highest_neighbour(athlete, ground, walk):
    unknown = replace(ground, geometry=replace(ground.geometry, x0=100.0))
    for part, known in zip(spare_along(athlete, unknown, walk), spare_along(athlete, ground, walk), strict=True):
        assert 0.0 <= part.spare <= known.spare + 0.02


def test_ages_are_those_under_the_feet_that_are_put_down(athlete, ground, walk):
    x, y = np.meshgrid(ground.geometry.xs, ground.geometry.ys)
    put = walk.stances[1].contacts[LEG]
    near = np.hypot(x - put[0], y - put[1]) < 0.1
    older = replace(ground, time=np.where(near, 1000.0, 4600.0))
    assert seen_before(athlete, older, walk) == pytest.approx([3600.0])
    assert seen_before(athlete, ground, walk) == pytest.approx([0.0])


def test_a_walk_without_foot_moves_has_no_ages(athlete, ground, walk):
    rows = walk.moves == walk.foot_moves
    none = replace(
        walk,
        legs=(),
        stances=walk.stances[-1:],
        waypoints=walk.waypoints[rows],
        Ts_site_base=walk.Ts_site_base[rows],
        moves=np.zeros(int(rows.sum()), int),
        phases=tuple(phase for phase, row in zip(walk.phases, rows, strict=True) if row),
        margins=walk.margins[rows],
        torques=walk.torques[rows],
    )
    assert not len(seen_before(athlete, ground, none))
    assert len(spare_along(athlete, ground, none)) == 1
