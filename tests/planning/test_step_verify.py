"""The recheck of a path, part by part, on stand-ins: what is sampled, what is asked of which sample, what is told.

Whether whole plans pass it, and bad ones don't, is in ``test_step_plan.py`` and ``test_step_fast.py``.
"""

from dataclasses import replace
from itertools import pairwise
from math import inf, isnan
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from footfall.core.frames import transform
from footfall.core.grid import GridGeometry
from footfall.planning.scene.solids import Gap
from footfall.planning.step import verify
from footfall.planning.step.situation import NO_GROUND, RAISED, TRUE
from footfall.planning.step.verify import (
    _AT_ONCE,
    FINER,
    LITTLE,
    OFF_LINE,
    SAMPLING,
    TORQUE_SAMPLING,
    UNDER,
    _Path,
)
from footfall.robot.kinematics import center_of_mass, link_poses, wheel_pose

LEG = 3
OWN = slice(6 * LEG, 6 * LEG + 6)
PHASES = ("lift", "lift", "swing", "lower")
STATE: Any = SimpleNamespace(T_site_base=transform(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]), (0.4, -0.3, 1.5)))


def path_of(*joint: float, phases: tuple[str, ...] = PHASES) -> _Path:
    """Whose first joint goes through these angles, the others half as far."""
    shares = np.array([1.0, 0.5, -0.5, 0.5, 0.5, -0.5])
    return verify._sampled(np.array(joint)[:, None] * shares, phases)


# -- samples -----------------------------------------------------------------------------------


def test_samples_are_dense_begin_and_end_at_waypoints_and_lie_on_the_lines(rng):
    q_path = np.cumsum(rng.normal(0, 0.05, (6, 6)), axis=0)
    path = verify._sampled(q_path, ("lift", "lift", "swing", "swing", "lower", "lower"))
    assert np.bincount(path.segments).tolist() == [
        int(np.ceil(np.abs(b - a).max() / SAMPLING)) + 1 for a, b in pairwise(q_path)
    ]
    for segment in range(5):
        there = path.segments == segment
        qs, shares = path.qs[there], path.fractions[there]
        assert np.array_equal(qs[0], q_path[segment])
        assert np.allclose(qs[-1], q_path[segment + 1], atol=1e-15)
        assert np.abs(np.diff(qs, axis=0)).max() <= SAMPLING + 1e-12
        assert np.allclose(shares, np.linspace(0, 1, len(shares)))
        expected = [(1 - t) * q_path[segment] + t * q_path[segment + 1] for t in shares]
        assert np.allclose(qs, expected, atol=1e-14)


def test_a_segment_without_a_change_has_its_two_ends():
    path = path_of(0.1, 0.1, 0.1 + 3.5 * SAMPLING, 0.1)
    assert path.segments.tolist() == [0, 0, *[1] * 5, *[2] * 5]
    assert path.fractions.tolist() == [0, 1, 0, 0.25, 0.5, 0.75, 1, 0, 0.25, 0.5, 0.75, 1]


def test_a_sample_belongs_to_the_phase_that_its_segment_leads_through_and_says_where_it_is():
    path = path_of(0.0, 4 * SAMPLING, 8 * SAMPLING, 12 * SAMPLING)
    assert path.swings.tolist() == [False] * 5 + [True] * 5 + [False] * 5
    assert path.phase_is("lift").tolist() == [True] * 5 + [False] * 10
    assert path.phase_is("lower").tolist() == [False] * 10 + [True] * 5
    assert path.where(1) == "lift, 25% of the way to waypoint 1"
    assert path.where(7) == "swing, 50% of the way to waypoint 2"
    assert path.where(14) == "lower, 100% of the way to waypoint 3"


def test_torques_are_asked_at_every_waypoint_and_at_every_tenth_sample_between():
    every = round(TORQUE_SAMPLING / SAMPLING)
    path = path_of(0.0, 24.5 * SAMPLING, 31 * SAMPLING, 31 * SAMPLING)
    chosen = verify._torque_samples(path)
    found = [(int(path.segments[at]), round(float(path.fractions[at]), 9)) for at in chosen]
    # a place that comes twice is asked once; the last segment stays where it is
    assert found == [(0, 0.0), (0, 0.4), (0, 0.8), (0, 1.0), (1, 1.0)]
    assert every == 10
    assert np.abs(np.diff(path.qs[chosen], axis=0)).max() <= TORQUE_SAMPLING + 1e-12
    assert verify._places_on_segment(path.segments).tolist() == [*range(26), *range(8), 0, 1]


# -- joints ------------------------------------------------------------------------------------


@pytest.mark.parametrize(("joint", "side"), [(0, "lower"), (2, "upper"), (5, "upper"), (5, "lower")])
def test_the_joint_with_the_least_room_is_named_with_its_place(athlete, joint, side):
    limit, inwards = float(getattr(athlete, side)[OWN][joint]), 1.0 if side == "lower" else -1.0
    base = 0.5 * (athlete.lower + athlete.upper)[OWN]
    for spare in (-0.01, 0.0, 0.01):
        q_path = np.array([base, base, base])
        q_path[1, joint] = limit + inwards * spare
        check = verify._limits(athlete, LEG, verify._sampled(q_path, ("lift", "swing", "lower")))
        assert check.margin == pytest.approx(spare, abs=1e-9)
        # at the limit itself rounding decides
        assert check.holds == (spare > 0) or spare == 0.0
        assert (check.name, check.unit) == ("joint limits", "rad")
        assert check.where == f"{athlete.joint_names[6 * LEG + joint]}, swing, 100% of the way to waypoint 1"


def test_a_joint_at_its_limit_is_inside(athlete):
    q = 0.5 * (athlete.lower + athlete.upper)[OWN]
    q[1] = athlete.upper[OWN][1]
    check = verify._limits(athlete, LEG, verify._sampled(np.array([q, q]), ("lift", "lift")))
    assert (check.holds, check.margin) == (True, 0.0)


# -- clearances: what is asked where -------------------------------------------------------------


class Asked:
    """A collision check that remembers what it was asked. at: first joint [rad] of what it hits, within reach of it."""

    def __init__(self, at: float | None = None, reach: float = 0.0, slope: float = 1.0) -> None:
        self.at, self.reach, self.slope, self.calls = at, reach, slope, []

    def distance(self, qs):
        return self.slope * (np.abs(qs[:, 0] - self.at) - self.reach)

    def __call__(self, qs, more):
        self.calls.append((qs[:, 0].copy(), more))
        if self.at is None:
            return None
        bad = np.flatnonzero(self.distance(qs) < more)
        return (int(bad[0]), "hip with rock") if len(bad) else None


def least(*spares: float):
    """Gaps of waypoints, told by their first joint."""

    def gap(qs):
        found = [spares[round(q / 0.1)] for q in qs[:, 0]]
        at = int(np.argmin(found))
        return at, Gap(found[at], "shin to rock")

    return gap


FOUR = np.array([0.0, 0.1, 0.2, 0.3])[:, None] * np.array([1.0, 0.5, 0.5, 0.5, 0.5, 0.5])
FREE = np.ones(4, bool)


def clearance(hit, gap, unsure=None, chosen=FREE, pulses=None):
    path = verify._sampled(FOUR, PHASES)
    doubtful = np.ones(len(path.qs), bool) if unsure is None else unsure
    pulse = (lambda: None) if pulses is None else (lambda: pulses.append(1))
    return verify._clearance("self collision", path, doubtful, hit, FOUR, chosen, gap, pulse), path


def test_a_free_path_tells_the_least_gap_of_its_waypoints():
    check, _ = clearance(Asked(), least(0.3, 0.2, 0.05, 0.4))
    assert (check.name, check.holds, check.margin, check.unit) == ("self collision", True, 0.05, "m")
    assert check.where == "shin to rock, beyond δ, at waypoint 2 (swing)"


def test_only_waypoints_that_are_chosen_count():
    chosen = np.array([False, True, False, True])
    check, _ = clearance(Asked(), least(-1.0, 0.2, -1.0, 0.1), chosen=chosen)
    assert (check.holds, check.margin) == (True, 0.1)
    assert "at waypoint 3 (lower)" in check.where
    none, _ = clearance(Asked(), least(-1.0, -1.0, -1.0, -1.0), chosen=np.zeros(4, bool))
    assert (none.holds, none.margin, none.where) == (True, inf, "nothing of the path")


def test_a_gap_of_nothing_holds_and_less_does_not():
    assert clearance(Asked(), least(1, 1, 0.0, 1))[0].holds
    broken, _ = clearance(Asked(), least(1, 1, -1e-9, 1))
    assert (broken.holds, broken.margin) == (False, -1e-9)


def test_a_collision_between_waypoints_has_no_size_and_says_where_it_is():
    check, path = clearance(Asked(at=0.15, reach=1e-6), least(1.0, 1.0, 1.0, 1.0))
    first = int(np.flatnonzero(np.abs(path.qs[:, 0] - 0.15) < 1e-6)[0])
    assert not check.holds
    assert isnan(check.margin)
    assert check.where == f"hip with rock: {path.where(first)}"
    # with a size where a waypoint shows one
    sized, _ = clearance(Asked(at=0.15, reach=1e-6), least(1.0, 1.0, -0.02, 1.0))
    assert (sized.holds, sized.margin) == (False, -0.02)
    assert sized.where.startswith("hip with rock")
    # none where the waypoint just keeps its clearance
    assert isnan(clearance(Asked(at=0.15, reach=1e-6), least(1.0, 1.0, 0.0, 1.0))[0].margin)


def test_only_doubtful_samples_are_asked_some_at_a_time_and_all_of_them():
    path = verify._sampled(FOUR, PHASES)
    unsure = np.zeros(len(path.qs), bool)
    unsure[5:] = True
    assert len(path.qs) < 2 * _AT_ONCE
    long = verify._sampled(np.array([0.0, 0.9, 1.0, 1.1])[:, None] * FOUR[1] / 0.1, PHASES)
    for one, doubtful in ((path, unsure), (long, np.ones(len(long.qs), bool))):
        hit, pulses = Asked(), []
        verify._clearance("", one, doubtful, hit, FOUR, FREE, least(1, 1, 1, 1), lambda told=pulses: told.append(1))
        plain = np.concatenate([qs for qs, more in hit.calls if more == 0.0])
        assert np.array_equal(plain, one.qs[doubtful, 0])
        assert max(len(qs) for qs, _ in hit.calls) <= _AT_ONCE
        assert len(pulses) == -(-int(doubtful.sum()) // _AT_ONCE) + 1
    hit = Asked(at=0.0, reach=9.0)
    assert clearance(hit, least(1, 1, 1, 1), np.zeros(len(path.qs), bool))[0].holds
    assert hit.calls == []


def test_a_hit_in_a_later_part_is_told_where_it_is():
    q_path = np.array([0.0, 0.9, 1.8, 2.7])[:, None] * FOUR[1] / 0.1
    path = verify._sampled(q_path, PHASES)
    hit = Asked(at=0.8, reach=1e-6)
    every = np.ones(len(path.qs), bool)
    check = verify._clearance("", path, every, hit, q_path, np.zeros(4, bool), least(), lambda: None)
    at = int(np.argmin(np.abs(path.qs[:, 0] - 0.8)))
    assert at > _AT_ONCE
    assert check.where == f"hip with rock: {path.where(at)}"
    # nothing is asked once it is known
    assert max(qs.max() for qs, _ in hit.calls) < path.qs[-1, 0]


# -- between samples -----------------------------------------------------------------------------


def beside(hit, which=None, path=None):
    path = verify._sampled(FOUR, PHASES) if path is None else path
    part = np.arange(len(path.qs)) if which is None else np.array(which)
    return verify._hit_beside(path, part, hit), path, part


@pytest.mark.parametrize("share", [0.3, 0.7])
def test_what_dips_between_two_samples_is_found_from_the_one_that_has_little_to_spare(share):
    """The samples have room, the place between them has none."""
    at = (10 + share) * SAMPLING
    hit = Asked(at=at, reach=2e-4, slope=0.5)
    found, path, part = beside(hit)
    assert found is not None
    assert (hit.distance(path.qs) > 0).all()
    assert found[1] == "hip with rock"
    assert abs(path.qs[part[found[0]], 0] - at) < SAMPLING


def test_between_samples_the_way_is_looked_at_in_tenths_with_a_hundredth_to_spare():
    hit = Asked(at=10 * SAMPLING, reach=-0.5 * LITTLE)
    found, path, _ = beside(hit, [10])
    assert found is None
    assert (FINER, LITTLE) == (10, 1e-3)
    between = [(qs, more) for qs, more in hit.calls if more != LITTLE]
    assert [more for _, more in between] == [LITTLE / FINER**2] * 2
    for (qs, _), sign in zip(between, (-1, 1), strict=True):
        assert np.allclose(qs, path.qs[10, 0] + sign * SAMPLING * np.arange(1, FINER) / FINER)
    # where there is more than that to spare nobody looks
    far = Asked(at=10 * SAMPLING, reach=-1.01 * LITTLE)
    assert beside(far, [10])[0] is None
    assert len(far.calls) == 1


def test_no_way_leads_over_a_waypoint_or_over_an_end():
    """The next sample of another segment is the same place; what comes after the last, or before the first, is none."""
    path = verify._sampled(FOUR, PHASES)
    last_of_first = int(np.flatnonzero(path.segments == 0)[-1])
    alone = verify._sampled(FOUR[:2], ("lift", "lift"))
    places = [(path, at, 1) for at in (0, last_of_first, last_of_first + 1, len(path.qs) - 1)]
    places += [(path, 1, 2), (path, 5, 2), (alone, 0, 1), (alone, 1, 2), (alone, len(alone.qs) - 1, 1)]
    for one, at, sides in places:
        hit = Asked(at=float(one.qs[at, 0]), reach=-0.5 * LITTLE)
        assert beside(hit, [at], one)[0] is None
        assert len(hit.calls) == 1 + sides, at


def test_every_sample_with_little_to_spare_is_looked_at_until_one_is_beside_a_collision():
    path = verify._sampled(FOUR, PHASES)
    looked = []

    def narrow(qs, more):
        """Little to spare at samples 3, 4 and 12; a collision just before the last of them."""
        if more == LITTLE:
            near = [i for i, q in enumerate(qs[:, 0]) if round(q / SAMPLING) in (3, 4, 12)]
            return (near[0], "near") if near else None
        looked.append(round(float(qs[0, 0]) / SAMPLING, 1))
        return (0, "hip with rock") if 11.0 < qs[0, 0] / SAMPLING < 12.0 else None

    found = verify._hit_beside(path, np.arange(20), narrow)
    assert found == (12, "hip with rock")
    assert looked == [2.9, 3.1, 3.9, 4.1, 11.9]
    # its number counts among the part
    assert verify._hit_beside(path, np.arange(10, 20), narrow) == (2, "hip with rock")
    assert verify._hit_beside(path, np.arange(0, 5), narrow) is None


def test_a_collision_beside_a_sample_breaks_the_clearance():
    at = 10.5 * SAMPLING
    check, _ = clearance(Asked(at=at, reach=2e-4, slope=0.3), least(1.0, 1.0, 1.0, 1.0))
    assert not check.holds
    assert check.where.startswith("hip with rock: lift, ")


# -- clearances: which samples, which ground -----------------------------------------------------


class Standins:
    """Of a situation whose certificate is sure of some samples only."""

    def __init__(self, sure_over_ground, sure_without) -> None:
        self.asked: dict[str, list] = {"own": [], "true": [], "raised": []}
        self.gaps: dict[str, list] = {"own": [], "true": [], "raised": []}
        self.modes: list[tuple[int, int]] = []

        def clear(qs, mode):
            self.modes.append((mode, len(qs)))
            return (sure_without if mode == NO_GROUND else sure_over_ground)(qs[:, 0], mode)

        def own(qs, more):
            self.asked["own"].append(qs[:, 0])

        def over(qs, raised, touching, more):
            assert touching == (raised == 0.0)
            assert raised in (0.0, 0.25)
            self.asked["true" if touching else "raised"].append(qs[:, 0])

        def gap_of(name):
            def gap(qs):
                self.gaps[name] += [round(q / 0.1) for q in qs[:, 0]]
                return 0, Gap(0.1, name)

            return gap

        def over_gap(qs, raised, touching):
            assert touching == (raised == 0.0)
            return gap_of("true" if touching else "raised")(qs)

        footing = SimpleNamespace(
            certificate=SimpleNamespace(clear=clear),
            solids=SimpleNamespace(own_collision=own, own_gap=gap_of("own")),
            over_ground=SimpleNamespace(collision=over, gap=over_gap),
        )
        self.situation: Any = SimpleNamespace(footing=footing, settings=SimpleNamespace(raise_terrain=0.25))

    def looked_at(self, name) -> set[int]:
        return {round(float(q) / SAMPLING) for qs in self.asked[name] for q in qs}


def test_the_swing_is_asked_over_raised_ground_the_rest_over_the_true_one():
    path = verify._sampled(FOUR, PHASES)
    standins = Standins(lambda q, mode: np.zeros(len(q), bool), lambda q, mode: np.zeros(len(q), bool))
    checks = verify._clearances(standins.situation, path, FOUR, lambda: None)
    assert [check.name for check in checks] == [
        "self collision",
        "terrain collision in lift and lower",
        "terrain collision in swing, raised 0.25 m",
    ]
    assert all(check.holds and check.margin == 0.1 for check in checks)
    assert standins.looked_at("own") == set(range(61))
    assert standins.looked_at("true") == {*range(21), *range(40, 61)}
    assert standins.looked_at("raised") == set(range(20, 41))
    # a waypoint ends one phase and begins the next: the ends of the swing are asked for both
    assert standins.gaps == {"own": [0, 1, 2, 3], "true": [0, 1, 2, 3], "raised": [1, 2]}
    swinging = int(path.swings.sum())
    assert standins.modes[:2] == [(RAISED, swinging), (TRUE, len(path.qs) - swinging)]


def test_what_is_proven_is_not_asked_of_meshes_and_no_more_than_that_is_left_out():
    path = verify._sampled(FOUR, PHASES)
    proven = Standins(lambda q, mode: np.ones(len(q), bool), lambda q, mode: np.ones(len(q), bool))
    assert all(check.holds for check in verify._clearances(proven.situation, path, FOUR, lambda: None))
    assert proven.asked == {"own": [], "true": [], "raised": []}
    # unsure over the ground at samples 10…12 and 25…27, with itself at 11 and 26 of them
    over_ground = [*range(10, 13), *range(25, 28)]

    def without(q, mode):
        return ~np.isin(np.rint(q / SAMPLING), [11, 26, 50])

    some = Standins(lambda q, mode: ~np.isin(np.rint(q / SAMPLING), over_ground), without)
    verify._clearances(some.situation, path, FOUR, lambda: None)
    assert some.looked_at("own") == {11, 26}
    assert some.looked_at("true") == {10, 11, 12}
    assert some.looked_at("raised") == {25, 26, 27}


# -- kinematics, by those of the whole rover -----------------------------------------------------


def whole(athlete, q):
    posture = np.array(athlete.posture("stand"))
    posture[OWN] = q
    return posture


@pytest.mark.parametrize("side", [(0.0, 0.0), (-0.02, 0.08), (0.05, -0.04)])
def test_how_far_the_wheel_leaves_the_vertical_while_it_lifts_and_lowers(athlete, side):
    base = np.array(athlete.posture("stand"))[OWN]
    q_path = np.array([base, base, base, base, base, base, base])
    q_path[1, 0] += 0.03  # to one side and to the other while it lifts
    q_path[2, 0] -= 0.02
    q_path[3, 0] += 0.3  # as it likes in the swing
    q_path[4, 0] += side[0]
    q_path[5, 0] += side[1]
    phases = ("lift", "lift", "lift", "swing", "swing", "lower", "lower")
    tilted: Any = SimpleNamespace(T_site_base=transform(_turned(0.2), (0.0, 0.0, 1.5)))
    for state in (STATE, tilted):
        up = np.linalg.inv(state.T_site_base)[:3, 2]
        path = verify._sampled(q_path, phases)
        check = verify._straight(athlete, state, LEG, path)
        away = {}
        for at in np.flatnonzero(~path.swings):
            foot = q_path[0] if path.segments[at] < 2 else q_path[-1]
            there, start = (wheel_pose(athlete, whole(athlete, q), LEG)[:3, 3] for q in (path.qs[at], foot))
            away[int(at)] = float(np.linalg.norm(np.cross(there - start, up)))
        worst = max(away, key=lambda at: away[at])
        assert check.margin == pytest.approx(OFF_LINE - away[worst], abs=1e-9)
        assert not check.holds
        assert check.where == path.where(worst)
        assert (check.name, check.unit) == ("straight lift and lower", "m")


def _turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def test_a_wheel_may_leave_the_vertical_by_just_as_much(athlete, monkeypatch):
    base = np.array(athlete.posture("stand"))[OWN]
    path = verify._sampled(np.array([base, base + np.array([0.01, 0, 0, 0, 0, 0])]), ("lift", "lift"))
    away = OFF_LINE - verify._straight(athlete, STATE, LEG, path).margin
    monkeypatch.setattr(verify, "OFF_LINE", away)
    assert verify._straight(athlete, STATE, LEG, path).holds


def test_a_wheel_may_leave_the_vertical_by_two_millimetres(athlete):
    base = np.array(athlete.posture("stand"))[OWN]
    reach = np.linalg.norm(
        wheel_pose(athlete, whole(athlete, base + np.array([1e-4, 0, 0, 0, 0, 0])), LEG)[:3, 3]
        - wheel_pose(athlete, whole(athlete, base), LEG)[:3, 3]
    )
    for share in (0.97, 1.03):
        end = base.copy()
        end[0] += 1e-4 * share * OFF_LINE / reach
        for phase in ("lift", "lower"):
            check = verify._straight(athlete, STATE, LEG, verify._sampled(np.array([base, end]), (phase, phase)))
            assert check.holds == (share < 1), phase
            assert check.margin == pytest.approx((1 - share) * OFF_LINE, abs=1e-5)


def test_a_path_that_neither_lifts_nor_lowers_is_straight(athlete):
    base = np.array(athlete.posture("stand"))[OWN]
    swing = verify._sampled(np.array([base, base + 0.1]), ("swing", "swing"))
    check = verify._straight(athlete, STATE, LEG, swing)
    assert (check.holds, check.margin, check.where) == (True, OFF_LINE, "nowhere")


@pytest.mark.parametrize("conservative", [False, True])
def test_balance_is_the_least_margin_along_the_path(athlete, conservative):
    from footfall.balance.moving_leg import moment_without

    stand = np.array(athlete.posture("stand"))
    base = stand[OWN]
    path = verify._sampled(np.array([base, base + 0.2, base - 0.1]), ("lift", "swing", "lower"))
    normals, offsets = np.array([[1.0, 0.0], [0.0, 1.0], [-0.6, -0.8]]), np.array([0.6, 0.2, 0.7])
    footing: Any = SimpleNamespace(moment=moment_without(athlete, stand, LEG), normals=normals, offsets=offsets)
    margins = []
    for q in path.qs:
        com = (STATE.T_site_base @ np.append(center_of_mass(athlete, whole(athlete, q)), 1.0))[:2]
        margins.append(min(offset - normal @ com for normal, offset in zip(normals, offsets, strict=True)))
    for least_margin in (min(margins) - 1e-6, min(margins) + 1e-6):
        settings: Any = SimpleNamespace(least_margin=least_margin, conservative=conservative)
        check = verify._balance(athlete, STATE, LEG, settings, footing, path)
        assert check.margin == pytest.approx(min(margins) - least_margin, abs=1e-9)
        assert check.holds == (least_margin < min(margins))
        assert check.unit == "m"
        assert check.where == path.where(int(np.argmin(margins)))
        assert check.name == f"balance ({'conservative' if conservative else 'support'} polygon)"


def test_torque_is_told_where_it_is_worst_and_over_which_ground_nobody_has_seen(monkeypatch):
    path = path_of(0.0, 25 * SAMPLING, 32 * SAMPLING, 36 * SAMPLING)
    due = verify._torque_samples(path)
    seen = []

    def worst(stance, feet, friction, qs):
        seen.append((stance, friction, qs))
        return 2, held

    monkeypatch.setattr(verify, "worst_held", worst)
    feet = SimpleNamespace(seen=np.array([True, False, True, True, False]))
    situation: Any = SimpleNamespace(
        stance="the stance",
        others=(0, 1, 2, 4, 5),
        footing=SimpleNamespace(feet=feet),
        settings=SimpleNamespace(friction=0.7),
    )
    for held in (
        SimpleNamespace(holds=True, joint_name="knee", ratio=0.8, feasible=True),
        SimpleNamespace(holds=False, joint_name="knee", ratio=1.3, feasible=True),
        SimpleNamespace(holds=False, joint_name="", ratio=inf, feasible=False),
    ):
        check = verify._torque(situation, path)
        assert (check.name, check.holds, check.unit) == ("torque", held.holds, "of the limit")
        assert check.margin == pytest.approx(1 - held.ratio) if held.feasible else isnan(check.margin)
        where = f"{held.joint_name or verify.NOTHING_HOLDS}, {path.where(int(due[2]))}"
        assert check.where == f"{where}; ground taken as level under legs 1, 5, where it is unknown"
        stance, friction, qs = seen.pop()
        assert (stance, friction) == ("the stance", 0.7)
        assert np.array_equal(qs, path.qs[due])
    feet.seen[:] = True
    assert verify._torque(situation, path).where.endswith(path.where(int(due[2])))


# -- ground that nobody saw ----------------------------------------------------------------------


def test_unknown_ground_is_counted_within_reach_of_the_leg_along_the_whole_path(athlete):
    """Against every cell's distance to the links of the whole rover; cells at the border may differ."""
    base = np.array(athlete.posture("stand"))[OWN]
    path = verify._sampled(np.array([base, base + np.array([0.6, 0, 0, 0, 0, 0])]), ("swing", "swing"))
    grid = GridGeometry(-4.0, -4.0, 0.1, 81, 81)
    ground: Any = SimpleNamespace(dem=SimpleNamespace(geometry=grid), filled=np.zeros(grid.shape, bool))
    none = verify._unknown(athlete, STATE, LEG, ground, path)
    assert (none.holds, isnan(none.margin), none.unit, none.where) == (True, True, "", "none")
    assert none.name == "unknown ground under the path"
    parts = [name for name in link_poses(athlete, whole(athlete, base)) if name.startswith(f"leg{LEG}")]
    places = []
    for q in path.qs[::10]:
        poses = link_poses(athlete, whole(athlete, q))
        ends = [(STATE.T_site_base @ poses[name])[:2, 3] for name in parts]
        places += [a + t * (b - a) for a, b in pairwise(ends) for t in np.linspace(0, 1, 5)]
    cells = grid.centers().reshape(-1, 2)
    away = np.min([np.linalg.norm(cells - place, axis=1) for place in places], axis=0).reshape(grid.shape)
    # places are rounded to 0.1 m
    surely, perhaps = away <= UNDER - 0.08, away <= UNDER + 0.08
    assert surely.sum() > 50
    for filled in (surely, perhaps, np.ones(grid.shape, bool)):
        check = verify._unknown(athlete, STATE, LEG, replace_filled(ground, filled), path)
        count = int(check.where.split()[0])
        assert (check.holds, isnan(check.margin)) == (True, True)
        assert "taken as high as their highest known neighbour" in check.where
        assert (surely & filled).sum() <= count <= (perhaps & filled).sum()
    assert verify._unknown(athlete, STATE, LEG, replace_filled(ground, ~perhaps), path).where == "none"


def replace_filled(ground, filled) -> Any:
    return SimpleNamespace(dem=ground.dem, filled=filled)


def test_checks_come_in_one_order_and_are_about_the_leg_that_moves(athlete, monkeypatch):
    base = np.array(athlete.posture("stand"))
    waypoints = np.array([base, base])
    waypoints[1, OWN] += 0.1
    told = {}
    for name in ("_limits", "_clearances", "_straight", "_balance", "_torque", "_unknown"):

        def part(*args, name=name):
            told[name] = args
            return [name] if name == "_clearances" else name

        monkeypatch.setattr(verify, name, part)
    situation: Any = SimpleNamespace(
        robot=athlete, state=STATE, leg=LEG, settings="settings", footing="footing", ground="ground"
    )
    dem: Any = None
    checks = verify.recheck(situation, dem, waypoints, ("lift", "swing"))
    assert checks == ("_limits", "_clearances", "_straight", "_balance", "_torque", "_unknown")
    path = told["_limits"][2]
    assert np.array_equal(path.qs[[0, -1]], waypoints[:, OWN])
    assert path.phases == ("lift", "swing")
    assert np.array_equal(told["_clearances"][2], waypoints[:, OWN])
    assert replace(path).qs is path.qs
