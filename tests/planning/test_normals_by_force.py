"""The normal under a wheel that stands still: none with which it would slip, and the map's wherever that may be."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import footfall
from footfall.planning.compliance.compliant_rover import CompliantRover
from footfall.planning.compliance.from_telemetry import (
    HELD_SHARE,
    LIKELY_SHARE,
    MOST_TILT,
    MOST_TILT_UNSEEN,
    holding_normals,
    measured,
)
from footfall.planning.compliance.predict import advanced
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import plane

FRICTION = 0.6
directions = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(0.05, 1.0)).map(
    lambda v: np.array(v) / np.linalg.norm(v)
)


def angle(a, b):
    return np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)


@settings(max_examples=300, derandomize=True, deadline=None)
@given(normal=directions, force=directions, size=st.floats(1.0, 3000.0), most=st.sampled_from([MOST_TILT, 0.7]))
def test_a_normal_is_tilted_only_where_it_must_be_and_no_more_than_it_may(normal, force, size, most):
    away = angle(normal, force)
    slips, likely = away - np.arctan(HELD_SHARE * FRICTION), away - np.arctan(LIKELY_SHARE * FRICTION)
    assume(min(abs(slips), abs(likely - most)) > 1e-6)
    (found,), (tilted,) = holding_normals(normal[None], size * force[None], FRICTION, np.array([most]))
    assert tilted == (slips > 0.0 and likely <= most)
    if not tilted:
        assert np.array_equal(found, normal)
        return
    assert np.linalg.norm(found) == pytest.approx(1.0)
    # towards the force, in the plane of both, and no farther than friction takes
    assert angle(found, force) == pytest.approx(np.arctan(LIKELY_SHARE * FRICTION), abs=1e-6)
    assert angle(found, normal) == pytest.approx(likely, abs=1e-6)


def test_a_wheel_that_bears_nothing_has_the_maps_normal():
    (found,), (tilted,) = holding_normals(np.array([[0.0, 0.0, 1.0]]), np.zeros((1, 3)), FRICTION, np.array([1.0]))
    assert found.tolist() == [0.0, 0.0, 1.0]
    assert not tilted


@pytest.fixture(scope="module")
def stood(athlete):
    flat = plane(size=12.0, resolution=0.05)
    state = footfall.stand(athlete, flat)
    rest = CompliantRover(athlete, flat).let_down(state.posture, state.T_site_base)
    return CompliantRover(athlete, flat).state(rest), rest


@pytest.fixture(scope="module")
def beside_a_rock(stood):
    """The map of that ground with a rock beside the wheel of leg 5, and which of its cells nobody saw: under the wheel.

    Its rim would be 3 cm inside the rock: images have it wider than it is.
    """
    hub = stood[1].hubs[5]
    x = np.arange(-6.0, 6.0 + 1e-9, 0.05)
    east, north = np.meshgrid(x - hub[0], x - hub[1])
    rock = np.sqrt(np.maximum(0.0, 0.3**2 - (east - 0.3) ** 2 - north**2))
    unseen = np.hypot(east, north) < 0.12
    return from_heights(np.where(unseen, 0.0, rock).astype(np.float32), 0.05, -6.0, -6.0, "a rock"), unseen


def use(rest):
    sideways = rest.forces - rest.loads[:, None] * rest.normals
    return np.linalg.norm(sideways, axis=1) / (FRICTION * np.maximum(rest.loads, 1e-9))


def test_a_wheel_on_ground_that_nobody_saw_stands_as_it_was_measured(athlete, stood, beside_a_rock):
    state, rest = stood
    dem, unseen = beside_a_rock
    taken = measured(CompliantRover(athlete, dem, unseen=unseen), state, rest.commanded)
    assert taken.by_force.tolist() == [False] * 5 + [True]
    # the map alone has it lean against the rock, and slip off
    assert angle(taken.normals[5], np.array([0.0, 0.0, 1.0])) < MOST_TILT_UNSEEN
    assert np.abs(taken.forces - state.wheel_forces).max() < 30.0
    assert use(taken).max() < HELD_SHARE
    assert np.allclose(taken.posture, state.posture, atol=1e-6)


def test_where_all_was_seen_the_map_is_believed(athlete, stood, beside_a_rock):
    state, rest = stood
    taken = measured(CompliantRover(athlete, beside_a_rock[0]), state, rest.commanded)
    assert not taken.by_force.any()
    assert use(taken)[5] > HELD_SHARE


def test_the_normal_stays_while_the_wheel_stands_and_goes_where_it_lifts(athlete, stood, beside_a_rock):
    state, rest = stood
    dem, unseen = beside_a_rock
    rover = CompliantRover(athlete, dem, unseen=unseen)
    taken = measured(rover, state, rest.commanded)
    target = np.array(rest.commanded)
    target[2] += 0.01
    later = advanced(rover, taken, target)
    assert later.settled
    assert later.by_force.tolist() == taken.by_force.tolist()
    assert np.array_equal(later.normals[5], taken.normals[5])
    in_the_air = rover.after(replace(later, forces=np.where(np.arange(6)[:, None] == 5, 0.0, later.forces)), target)
    assert not in_the_air.by_force[5]
