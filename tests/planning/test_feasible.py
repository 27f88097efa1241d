"""Feasible traversability: laws, and a slow second method that asks the support code of every choice of footfalls."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import maximum_filter

import footfall
from footfall.balance.support import margin
from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry
from footfall.maps.layers import MapSettings
from footfall.planning.body.move import JOINT_RESERVE, REACH_RESERVE
from footfall.planning.route import feasible, feasible_kernel
from footfall.planning.route.leg_places import LEGS, leg_places
from footfall.planning.route.problem import NoGo, RouteSettings
from footfall.robot.ik import solve_leg, wheel_pose_for_contact
from footfall.robot.reserve import joint_reserves, reach_reserves
from footfall.terrain.from_arrays import from_heights

CELL = 0.3
SIZE = 26
ASKED = RouteSettings(resolution=CELL)
STEEP = RouteSettings(resolution=CELL, maps=MapSettings(slope_limit=1.4))
SEEDS = st.integers(0, 2**32 - 1)
LIGHT = settings(max_examples=12, deadline=None)


def ground(heights, **fields):
    return replace(from_heights(np.asarray(heights, np.float32), CELL, 0.0, 0.0, "made"), **fields)


def uneven(seed, size=SIZE):
    """Plates of whole sixteenths of a metre and some blocks: sums and differences are exact."""
    rng = np.random.default_rng(seed)
    plates = rng.integers(0, 5, (size // 2 + 1, size // 2 + 1)) / 16.0
    heights = np.repeat(np.repeat(plates, 2, 0), 2, 1)[:size, :size]
    for _ in range(int(rng.integers(0, 6))):
        row, col = rng.integers(0, size - 4, 2)
        heights[row : row + rng.integers(1, 5), col : col + rng.integers(1, 5)] += rng.integers(1, 32) / 16.0
    return heights


@pytest.fixture(scope="module")
def places(athlete):
    return leg_places(athlete, CELL, ASKED.headings)


def slow(robot, places, feet, heights, trusted, asked):
    """Legs (headings, rows, cols) and what forbids, cell by cell; cells and strokes alone are those of ``places``."""
    rows, cols = heights.shape
    legs, why = np.zeros((asked.headings, rows, cols), int), np.zeros((rows, cols), int)
    azimuths = [math.atan2(leg.T_base_hip[1, 3], leg.T_base_hip[0, 3]) for leg in robot.description.legs]
    cells = range(-places.radius, places.radius + 1)
    disc = [(r, c) for r in cells for c in cells if math.hypot(r, c) <= places.radius]
    for row, col in np.ndindex(rows, cols):
        there = [(row + r, col + c) for r, c in disc if 0 <= row + r < rows and 0 <= col + c < cols]
        if sum(int(trusted[at]) for at in there) < asked.worst * 255 * len(disc):
            why[row, col] = feasible_kernel.UNKNOWN
            continue
        highest = max(heights[at] for at in there if np.isfinite(heights[at]))
        if all(feet[at] == -math.inf for at in there):
            why[row, col] = feasible_kernel.NO_FOOTING
            continue
        if highest - max(feet[at] for at in there) > places.strokes.max():
            why[row, col] = feasible_kernel.TOO_HIGH
            continue
        reasons = set()
        for heading in range(asked.headings):
            choices = [[] for _ in azimuths]
            yaw, half = 2 * math.pi * heading / asked.headings, heading % len(places.count)
            for leg, k in itertools.product(range(LEGS), range(places.rows.shape[2])):
                if k < places.count[half, leg]:
                    r, c = int(places.rows[half, leg, k]), int(places.cols[half, leg, k])
                    at = (row + r, col + c)
                    inside = 0 <= at[0] < rows and 0 <= at[1] < cols
                    if inside and highest - feet[at] <= places.strokes[half, leg, k]:
                        seen = math.atan2(r, c)
                        off = [abs((seen - yaw - one + math.pi) % (2 * math.pi) - math.pi) for one in azimuths]
                        choices[int(np.argmin(off))].append((c, r))
            used = [one for one in choices if one]
            if len(used) < 5:
                reasons.add(feasible_kernel.TOO_FEW)
            elif any(margin(feet_xy, (0.0, 0.0), True) >= -1e-9 for feet_xy in itertools.product(*used)):
                legs[heading, row, col] = len(used)
                reasons.add(feasible_kernel.FREE)
            else:
                reasons.add(feasible_kernel.UNSUPPORTED)
        order = (feasible_kernel.FREE, feasible_kernel.UNSUPPORTED, feasible_kernel.TOO_FEW)
        why[row, col] = next(one for one in order if one in reasons)
    return legs, why


def test_a_slow_second_method_says_the_same_of_sparse_footings(athlete, places):
    seen = set()
    for seed in range(3):
        rng = np.random.default_rng(seed)
        heights = np.where(rng.uniform(size=(SIZE, SIZE)) < 0.05, np.nan, rng.uniform(0.0, 0.5 + seed, (SIZE, SIZE)))
        heights = heights.astype(np.float32)
        share = (0.12, 0.2, 0.3)[seed]
        feet = np.where((rng.uniform(size=heights.shape) < share) & np.isfinite(heights), heights, -np.inf)
        feet = feet.astype(np.float32)
        trusted = np.where(np.isfinite(heights), 255, 0).astype(np.uint8)
        _, _, _, legs, why = feasible._layers(places, heights, feet, trusted, ASKED)
        own, reasons = slow(athlete, places, feet, heights, trusted, ASKED)
        half = ASKED.headings // 2
        np.testing.assert_array_equal(legs, own[:half])
        np.testing.assert_array_equal(legs, own[half:])
        np.testing.assert_array_equal(why, reasons)
        seen |= set(np.unique(why)) | {10 * int(n) for n in np.unique(legs)}
    assert {feasible_kernel.FREE, feasible_kernel.TOO_FEW, feasible_kernel.UNSUPPORTED, 0, 50, 60} <= seen


def plain(robot, places, feet, highest, headings):
    """Legs that find footfalls that support (headings / 2, rows, cols), and how many find any: one place at a time."""
    rows, cols = highest.shape
    azimuths = sorted(math.atan2(*leg.T_base_hip[1::-1, 3]) % (2 * math.pi) for leg in robot.description.legs)
    padded = np.pad(feet, places.radius, constant_values=-np.inf)
    legs, found = (np.zeros((len(places.count), rows, cols), int) for _ in range(2))
    for heading in range(len(legs)):
        # how far beside its azimuth a leg's footfalls are, counter-clockwise: the least and the most [rad]
        least, most = np.full((LEGS, rows, cols), math.inf), np.full((LEGS, rows, cols), -math.inf)
        for leg, azimuth in enumerate(azimuths):
            for k in range(places.count[heading, leg]):
                r, c = int(places.rows[heading, leg, k]), int(places.cols[heading, leg, k])
                row, col = places.radius + r, places.radius + c
                there = highest - padded[row : row + rows, col : col + cols] <= places.strokes[heading, leg, k]
                off = math.remainder(math.atan2(r, c) - azimuth - 2 * math.pi * heading / headings, 2 * math.pi)
                least[leg][there] = np.minimum(least[leg][there], off)
                most[leg][there] = np.maximum(most[leg][there], off)
        has = most > -math.inf
        found[heading] = has.sum(axis=0)
        legs[heading] = np.where(has.all(axis=0), LEGS, 0)
        for missing in range(LEGS):
            pairs = (((missing + behind) % LEGS, (missing + behind + 3) % LEGS) for behind in (-2, -1))
            within = np.all([most[a] >= least[b] - 1e-9 for a, b in pairs], axis=0)
            legs[heading][(found[heading] == LEGS - 1) & ~has[missing] & within] = LEGS - 1
    return legs, found


@LIGHT
@given(SEEDS, st.sampled_from([4, 8, 16]), st.sampled_from([0.1, 0.25, 0.6]), st.floats(1.2, 2.2))
def test_looking_at_one_place_after_the_other_says_the_same(athlete, seed, headings, share, relief):
    rng = np.random.default_rng(seed)
    places, asked = leg_places(athlete, CELL, headings), replace(ASKED, headings=headings, worst=1e-6)
    heights = rng.uniform(0.0, 0.4, rng.integers(1, 40, 2)).astype(np.float32)
    # footings in patches, so that legs lack them in whole sectors, about as far below what stands high as legs reach
    bare = np.kron(rng.uniform(size=(14, 14)) < 0.3, np.ones((3, 3), bool))[: heights.shape[0], : heights.shape[1]]
    high = rng.uniform(size=heights.shape) < 0.02
    heights[high], bare = relief, bare | high
    feet = np.where((rng.uniform(size=heights.shape) < share) & ~bare, heights, np.float32(-np.inf))
    trusted = np.full(heights.shape, 255, np.uint8)
    _, height, _, legs, why = feasible._layers(places, heights, feet, trusted, asked)
    disc = np.hypot(*np.indices((2 * places.radius + 1,) * 2) - places.radius) <= places.radius
    highest = maximum_filter(heights.astype(np.float64), footprint=disc, mode="constant", cval=-np.inf)
    own, found = plain(athlete, places, feet.astype(np.float64), highest, headings)
    np.testing.assert_array_equal(legs, own)
    np.testing.assert_array_equal(why == feasible_kernel.FREE, own.any(axis=0))
    few = np.isin(why, (feasible_kernel.TOO_FEW, feasible_kernel.NO_FOOTING, feasible_kernel.TOO_HIGH))
    np.testing.assert_array_equal(few, (found < LEGS - 1).all(axis=0))
    np.testing.assert_allclose(np.asarray(height, np.float64), highest + places.room, atol=1e-5)


def test_legs_reach_their_places_and_no_deeper(athlete):
    """Inverse kinematics of the leg that stands there, the body turned to the heading."""
    places = leg_places(athlete, CELL, 16)
    hips = [leg.T_base_hip for leg in athlete.description.legs]
    clearance = athlete.description.clearances.terrain["wheel"]
    checked = 0
    for heading, leg in np.ndindex(places.count.shape):
        yaw = 2.0 * math.pi * heading / 16
        for k in range(0, places.count[heading, leg], 3):
            x, y = places.cols[heading, leg, k] * CELL, places.rows[heading, leg, k] * CELL
            x, y = math.cos(yaw) * x + math.sin(yaw) * y, math.cos(yaw) * y - math.sin(yaw) * x
            own = int(np.argmax([hip[:2, 3] @ (x, y) for hip in hips]))
            out = (x, y) - hips[own][:2, 3]
            stroke = places.strokes[heading, leg, k]
            depths = places.room + np.append(np.linspace(0.02 - clearance, stroke - 0.02, 20), stroke + 0.06)
            contacts = np.column_stack([np.full(21, x), np.full(21, y), -depths])
            poses = wheel_pose_for_contact(athlete, contacts, (0, 0, 1), math.atan2(out[1], out[0]), np.eye(4))
            solved = solve_leg(athlete, own, poses)
            postures = np.zeros((21, 8, 6 * athlete.leg_count))
            postures[..., 6 * own : 6 * own + 6] = np.nan_to_num(solved.q)
            spare = reach_reserves(athlete, postures)[..., own] >= REACH_RESERVE - 2e-3
            spare &= joint_reserves(athlete, postures)[..., 6 * own : 6 * own + 6].min(axis=-1) >= JOINT_RESERVE - 2e-2
            reached = (solved.valid & spare).any(axis=1)
            assert reached[:-1].all(), (heading, leg, k)
            assert not reached[-1], (heading, leg, k)
            checked += 1
    assert checked > 50


def test_flat_ground_is_feasible_and_costs_what_travel_costs(athlete, places):
    found = feasible.feasible_ground(athlete, ground(np.full((SIZE, SIZE), 2.5)), ASKED)
    inner = np.s_[..., places.radius + 1 : -places.radius - 1, places.radius + 1 : -places.radius - 1]
    assert (found.legs[inner] == LEGS).all()
    assert (found.forbidden[inner] == 0).all()
    assert found.headings == 8
    for heading in (None, *range(8)):
        assert (found.costs(heading)[inner] == 1.0).all()
    assert np.allclose(found.height[inner], 2.5 + places.room)
    assert (found.costs() >= 1.0).all()


@LIGHT
@given(SEEDS, st.integers(1, 24), st.integers(1, 24))
def test_raising_what_stands_high_never_lowers_a_cost(athlete, seed, level, more):
    heights = uneven(seed)
    raised = heights + (more / 16.0) * (heights >= level / 16.0)
    before, after = (feasible.feasible_ground(athlete, ground(z), STEEP) for z in (heights, raised))
    for heading in (None, *range(4)):
        assert (after.costs(heading) >= before.costs(heading)).all()


@LIGHT
@given(SEEDS, st.sampled_from([8, 16]))
def test_turned_ground_has_the_turned_result(athlete, seed, headings):
    asked = replace(STEEP, headings=headings)
    heights = uneven(seed)
    heights[5:7, 9:12] = np.nan
    plain, turned = (feasible.feasible_ground(athlete, ground(z), asked) for z in (heights, np.rot90(heights)))
    # rows go north, so rot90 turns the ground clockwise
    np.testing.assert_array_equal(turned.forbidden, np.rot90(plain.forbidden))
    for heading in range(headings):
        np.testing.assert_array_equal(
            turned.costs((heading - headings // 4) % headings), np.rot90(plain.costs(heading))
        )


@LIGHT
@given(SEEDS)
def test_nothing_needs_to_be_searched_where_relief_is_under_the_stroke(athlete, places, seed):
    heights = uneven(seed).astype(np.float32)
    feet = feasible._footings(athlete, GridGeometry(0.0, 0.0, CELL, SIZE, SIZE), heights, STEEP)
    trusted = np.full(heights.shape, 255, np.uint8)
    short = feasible._layers(places, heights, feet, trusted, STEEP)
    full = feasible._layers(places, heights, feet, trusted, STEEP, search_all=True)
    for one, other in zip(short, full, strict=True):
        np.testing.assert_array_equal(one, other)


@LIGHT
@given(SEEDS)
def test_what_is_brought_up_to_date_is_what_is_computed_anew(athlete, seed):
    rng = np.random.default_rng(seed)
    heights = uneven(seed, 150)
    times = rng.uniform(0.0, 2e5, heights.shape)
    times[0, 0] = 3e5
    variance, count = np.full(heights.shape, 1e-4, np.float32), np.ones(heights.shape, np.uint16)
    memory = {"variance": variance, "count": count, "source": np.ones(heights.shape, np.uint8), "sources": ("made",)}
    asked = replace(ASKED, no_go=(NoGo(9.0, 9.0, 1.5),))
    before = feasible.feasible_ground(athlete, ground(heights, time=times, **memory), asked)
    newer = heights.copy()
    row, col = rng.integers(1, 140, 2)
    newer[row : row + 3, col : col + 9] += 1.0
    row, col = rng.integers(1, 140, 2)
    newer[row : row + 4, col : col + 2] = np.nan
    times = times.copy()
    times[rng.integers(1, 140), rng.integers(1, 140)] = 3e5
    dem = ground(newer, time=times, **memory)
    assert feasible.updated(athlete, dem, before).digest == feasible.feasible_ground(athlete, dem, asked).digest


def test_only_what_the_rover_covers_from_what_changed_is_computed_again(athlete, monkeypatch):
    heights = np.zeros((400, 400))
    before = feasible.feasible_ground(athlete, ground(heights), ASKED)
    computed = []
    layers = feasible._layers
    monkeypatch.setattr(feasible, "_layers", lambda p, g, *rest: computed.append(g.size) or layers(p, g, *rest))
    assert feasible.updated(athlete, ground(heights), before).digest == before.digest
    assert computed == []
    heights[200, 200] = 1.0
    newer = feasible.updated(athlete, ground(heights), before)
    assert 0 < sum(computed) < 0.2 * heights.size
    assert newer.relief[200, 200] == 1.0


def test_unknown_and_old_ground_cost_more(athlete, places):
    middle, flat = SIZE // 2, np.zeros((SIZE, SIZE))
    hole = flat.copy()
    hole[middle, middle] = np.nan
    cost = feasible.feasible_ground(athlete, ground(hole), ASKED).costs()[middle, middle]
    assert 1.0 < cost < 1.1
    times = np.full(flat.shape, 1e6)
    times[:, : SIZE // 2] -= ASKED.fades
    dem = ground(flat, time=times)
    found = feasible.feasible_ground(athlete, dem, replace(ASKED, worst=0.05)).costs()
    west, east = (found[middle, at] for at in (places.radius + 1, SIZE - places.radius - 2))
    assert found[middle, SIZE // 2] > 1.2
    assert 1.0 <= east < west <= 2.02


def test_what_forbids_a_cell_is_told(athlete):
    size, middle = 40, 20
    cases = {
        feasible_kernel.UNKNOWN: np.nan,
        feasible_kernel.TOO_HIGH: 3.0,
    }
    for code, height in cases.items():
        heights = np.zeros((size, size))
        heights[middle, middle] = height
        if code == feasible_kernel.UNKNOWN:
            heights[2:-2, 2:-2] = np.nan
        found = feasible.feasible_ground(athlete, ground(heights), ASKED)
        assert found.forbidden[middle, middle] == code
        assert not any(found.may(heading)[middle, middle] for heading in range(8))
        assert math.isinf(found.costs()[middle, middle])
    rough = np.indices((size, size)).sum(axis=0) % 2
    found = feasible.feasible_ground(athlete, ground(rough), replace(ASKED, no_go=(NoGo(9.0, 6.0, 0.5),)))
    assert found.forbidden[middle, middle] == feasible_kernel.NO_FOOTING
    assert found.forbidden[20, 30] == feasible.MARKED_OFF
    assert set(feasible.FORBIDDEN) == {*range(1, feasible.MARKED_OFF + 1)}


def test_other_robots_cells_and_settings_are_refused(athlete):
    found = feasible.feasible_ground(athlete, ground(np.zeros((4, 4))), ASKED)
    other = footfall.load_robot("athlete")
    stranger = replace(found, provenance=replace(found.provenance, parents={"robot": "another"}))
    with pytest.raises(InvalidInput, match="for the robot that it was computed for"):
        feasible.updated(other, ground(np.zeros((4, 4))), stranger)
    with pytest.raises(InvalidInput, match="too coarse"):
        leg_places(athlete, 3.0, 8)
    for bad, said in (
        ({"cost": "cheap"}, "goodness or feasible"),
        ({"headings": 6}, "multiple of 4"),
        ({"fades": 0.0}, "fades"),
    ):
        with pytest.raises(InvalidInput, match=said):
            replace(ASKED, **bad)
