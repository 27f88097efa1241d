"""How a rigid wheel sits: planes, single stones, hollows, and a slow search for the touching height."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.maps.wheel_seat import wheel_seat
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

RADIUS, HALF = 0.242, 0.11


def ground(height, resolution=0.02, size=1.6):
    n = round(size / resolution) + 1
    grid = GridGeometry(-size / 2, -size / 2, resolution, n, n)
    x, y = np.moveaxis(grid.centers(), -1, 0)
    return Dem((height(x, y) + 0.0 * x).astype(np.float32), grid, "test", Provenance({}))


def axle_for(normal, heading):
    axle = np.cross(normal, (np.cos(heading), np.sin(heading), 0.0))
    return axle / np.linalg.norm(axle)


def seat_of(robot, dem, normal=(0, 0, 1), heading=0.0, at=(0.0, 0.0), **more):
    normal = np.asarray(normal, float) / np.linalg.norm(normal)
    point = np.array([*at, height_at(dem, *at)])
    seat, support = wheel_seat(robot, dem, point[None], normal[None], axle_for(normal, heading)[None], **more)
    return seat[0], support[0]


@given(a=st.floats(-0.5, 0.5), b=st.floats(-0.5, 0.5), heading=st.floats(0, 6), fine=st.booleans())
def test_on_a_plane_it_sits_on_the_contact_and_all_carries(athlete, a, b, heading, fine):
    dem = ground(lambda x, y: a * x + b * y, 0.02 if fine else 0.11)
    seat, support = seat_of(athlete, dem, (-a, -b, 1), heading)
    # heights are kept in single precision; on the coarse grid no sample lies under the contact
    assert seat == pytest.approx(0.0, abs=2e-6 if fine else 0.02**2 / (8 * RADIUS))
    assert support == 1.0


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (0.1, 0.04), (-0.16, -0.1), (0.2, 0.0)])
def test_one_stone_lifts_it_by_what_the_round_wheel_leaves_of_it(athlete, x, y):
    tall = 0.09
    dem = ground(lambda u, v: np.where(np.hypot(u - x, v - y) < 0.005, tall, 0.0))
    for heading in (0.0, np.pi / 2):
        along, across = (x, y) if heading == 0.0 else (y, x)
        room = RADIUS - np.sqrt(RADIUS**2 - along**2) if abs(across) <= HALF else np.inf
        point = np.array([[0.0, 0.0, 0.0]])
        seat, support = wheel_seat(
            athlete, dem, point, np.array([[0, 0, 1.0]]), axle_for(np.array([0, 0, 1.0]), heading)[None]
        )
        # beside the stone the ground under the wheel's middle still holds it
        assert seat[0] == pytest.approx(max(tall - room, 0.0), abs=1e-6)
        if seat[0] > 0.03:
            assert support[0] < 0.05


def test_it_spans_a_ditch_and_sinks_into_a_hollow_as_wide_as_itself(athlete):
    ditch = ground(lambda x, y: np.where(np.abs(x) < 0.05, -0.2, 0.0))
    point, up = np.array([[0.0, 0.0, 0.0]]), np.array([[0, 0, 1.0]])
    seat, support = wheel_seat(athlete, ditch, point, up, axle_for(up[0], 0.0)[None])
    sag = RADIUS - np.sqrt(RADIUS**2 - 0.06**2)
    assert seat[0] == pytest.approx(-sag, abs=0.005)
    assert 0.2 < support[0] < 0.8
    # along the ditch the wheel is wider than the ditch and stays up
    seat, _ = wheel_seat(athlete, ditch, point, up, axle_for(up[0], np.pi / 2)[None])
    assert seat[0] == pytest.approx(0.0, abs=1e-6)
    bowl = ground(lambda x, y: np.where(np.hypot(x, y) < 0.5, -0.3, 0.0))
    seat, support = wheel_seat(athlete, bowl, point, up, axle_for(up[0], 0.7)[None])
    assert seat[0] == pytest.approx(-0.3, abs=1e-6)
    assert support[0] == 1.0


@pytest.mark.parametrize("resolution", [0.004, 0.02, 0.06])
def test_agrees_with_a_dense_search_on_rough_ground(athlete, rng, resolution):
    dem = ground(lambda x, y: 0.025 * np.sin(9 * x + 1) * np.cos(11 * y) + 0.01 * np.sin(23 * (x + y)), resolution)
    for _ in range(15):
        normal = rng.normal(size=3) * (0.2, 0.2, 0) + (0, 0, 1)
        normal /= np.linalg.norm(normal)
        heading, at = rng.uniform(0, 6), rng.uniform(-0.3, 0.3, 2)
        axle = axle_for(normal, heading)
        seat, _ = seat_of(athlete, dem, normal, heading, at)
        forward = np.cross(axle, normal)
        contact = np.array([*at, height_at(dem, *at)])
        x, y = (g.ravel() for g in np.meshgrid(*(a + np.arange(-0.4, 0.4, 0.002) for a in at)))
        away = np.column_stack([x, y, height_at(dem, x, y)]) - contact
        under = (np.abs(away @ axle) <= HALF) & (np.abs(away @ forward) < RADIUS)
        rolled = away[under] @ forward
        dense = (away[under] @ normal - (RADIUS - np.sqrt(RADIUS**2 - rolled**2))).max()
        # under the tread's edges ground between samples may touch sooner: 2 cm times the slope, at most 0.6
        assert dense - 0.012 <= seat <= dense + 0.0005


def test_unknown_ground_carries_nothing(athlete):
    dem = ground(lambda x, y: np.where(y > 0.001, np.nan, 0.0))
    seat, support = seat_of(athlete, dem, at=(0.0, 0.0))
    assert seat == pytest.approx(0.0, abs=1e-6)
    assert support == pytest.approx(0.5, abs=0.06)
    nothing = ground(lambda x, y: np.where(np.hypot(x, y) < 0.6, np.nan, 0.0))
    point, up = np.zeros((1, 3)), np.array([[0, 0, 1.0]])
    seat, support = wheel_seat(athlete, nothing, point, up, axle_for(up[0], 0.0)[None])
    assert np.isnan(seat[0])
    assert np.isnan(support[0])
    bad = wheel_seat(athlete, dem, point * np.nan, up, up)
    assert np.isnan(bad).all()


def test_at_the_edge_of_the_map_and_beyond(athlete):
    dem = ground(lambda x, y: 0.0 * x)
    seat, support = seat_of(athlete, dem, at=(0.8, 0.8))
    assert seat == 0.0
    assert 0.2 < support < 0.35
    point, up = np.array([[50.0, 0.0, 0.0]]), np.array([[0, 0, 1.0]])
    assert np.isnan(wheel_seat(athlete, dem, point, up, axle_for(up[0], 0.0)[None])).all()


def test_bad_input_is_refused(athlete):
    dem = ground(lambda x, y: 0.0 * x)
    with pytest.raises(InvalidInput, match=r"\(n, 3\)"):
        wheel_seat(athlete, dem, np.zeros((2, 3)), np.zeros((1, 3)), np.zeros((2, 3)))
    with pytest.raises(InvalidInput, match="tolerance"):
        seat_of(athlete, dem, tolerance=0.5)
