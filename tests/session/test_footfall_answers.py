"""What is said of a chosen footfall: by the footing that decides, with the margin that decides."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from footfall.core.value import Provenance
from footfall.maps.layers import REACHABLE_STABLE, REACHABLE_UNSTABLE, MapStack
from footfall.session.products.judged_footfall import judge_footfall
from footfall.terrain.from_arrays import from_heights

SAYS = {
    "footing": REACHABLE_STABLE,
    "footing_friction": REACHABLE_UNSTABLE,
    "margin": 0.4,
    "margin_conservative": 0.3,
    "margin_lifted": 0.35,
    "margin_friction": -0.05,
    "margin_friction_conservative": -0.2,
    "torque_ratio": 1.25,
}
FRICTION = ("footing_friction", "margin_friction", "margin_friction_conservative", "torque_ratio")


@pytest.fixture
def judged(tiny):
    """judged(without=(), **changes) → the answer at the middle of maps that say the same everywhere."""
    dem = tiny.dem()

    def judge(stability="plain", without=(), **changes):
        layers = {
            name: np.full(dem.geometry.shape, amount, np.uint8 if name.startswith("footing") else np.float32)
            for name, amount in {**SAYS, **changes}.items()
            if name not in without
        }
        maps = MapStack(dem.geometry, 1, stability, layers, Provenance({}))
        return judge_footfall(dem, 0.3, 1, 0.0, 0.0, maps)

    return judge


def test_friction_decides_where_it_was_computed(judged):
    answer = judged()
    assert (answer["acceptable"], answer["footing"]) == (False, "reachable but unstable")
    assert answer["margin"] == pytest.approx(-0.05)
    reason, elsewhere = answer["reasons"]
    assert elsewhere.startswith("no place on the leg's map is reachable and stable")
    for words in ("plain margin 0.400 m", "in the air 0.350 m", "with friction -0.050 m", "1.25 of a torque limit"):
        assert words in reason
    without = judged(without=FRICTION)
    assert (without["acceptable"], without["footing"], without["reasons"]) == (True, "reachable and stable", [])
    assert without["margin"] == pytest.approx(0.4)


def test_the_conservative_margin_where_that_was_asked_for(judged):
    answer = judged("conservative")
    assert answer["margin"] == pytest.approx(-0.2)
    assert "conservative margin 0.300 m" in answer["reasons"][0]
    assert judged("conservative", without=FRICTION)["margin"] == pytest.approx(0.3)


def test_too_weak_a_motor_is_named_though_every_margin_is_fine(judged):
    reason, _ = judged(margin_friction=0.3)["reasons"]
    assert "1.25 of a torque limit" in reason


def test_a_margin_that_is_unknown_is_null(judged):
    assert judged(margin_friction=np.nan, footing_friction=REACHABLE_STABLE)["margin"] is None


def test_maps_of_another_time_decide_nothing(tiny, judged):
    dem = tiny.dem()
    maps = MapStack(dem.geometry, 1, "plain", {"footing": np.full((8, 8), 3, np.uint8)}, Provenance({}))
    answer = judge_footfall(dem, 0.3, 1, 0.0, 0.0, maps, "the terrain has changed since")
    assert (answer["acceptable"], answer["footing"], answer["margin"]) == (None, None, None)
    assert "out of date: the terrain has changed since" in answer["reasons"][0]


def test_unknown_ground_is_refused_whatever_the_maps_say(tiny):
    heights = np.array(tiny.dem().heights)
    heights[3:6, 3:6] = np.nan
    dem = replace(tiny.dem(), heights=heights)
    layers = {"footing": np.full((8, 8), REACHABLE_STABLE, np.uint8), "margin": np.full((8, 8), 0.4, np.float32)}
    answer = judge_footfall(dem, 0.3, 1, 0.0, 0.0, MapStack(dem.geometry, 1, "plain", layers, Provenance({})))
    assert (answer["acceptable"], answer["known"], answer["z"]) == (False, False, None)
    assert "the ground there is not known" in answer["reasons"][0]


@given(data=st.data(), x=st.floats(-4.4, 4.4), y=st.floats(-4.4, 4.4))
def test_the_nearest_place_where_the_leg_may_stand_is_told(data, x, y):
    dem = from_heights(np.zeros((8, 8)), 1.0, -3.5, -3.5)
    footing = data.draw(arrays(np.uint8, (8, 8), elements=st.integers(0, REACHABLE_STABLE)))
    maps = MapStack(
        dem.geometry,
        1,
        "plain",
        {"footing": footing, "margin": np.zeros((8, 8), np.float32), "hindrance": np.zeros((8, 8), np.uint8)},
        Provenance({}),
    )
    answer = judge_footfall(dem, 0.3, 1, x, y, maps)
    if answer["acceptable"]:
        assert answer["nearest"] is None
        return
    green = [
        (math.dist((x, y), (dem.geometry.xs[col], dem.geometry.ys[row])), row, col)
        for row in range(8)
        for col in range(8)
        if footing[row, col] == REACHABLE_STABLE
    ]
    nearest = answer["nearest"]
    if not green:
        assert nearest is None
        assert "try another leg" in answer["reasons"][-1]
        return
    assert nearest is not None
    assert nearest["away"] == pytest.approx(min(green)[0])
    assert math.dist((x, y), (nearest["x"], nearest["y"])) == pytest.approx(nearest["away"])
    assert judge_footfall(dem, 0.3, 1, nearest["x"], nearest["y"], maps)["acceptable"]
    assert f"{nearest['away']:.2f} m away, at ({nearest['x']:.2f}, {nearest['y']:.2f})" in answer["reasons"][-1]
