"""Suggested footfalls against a brute-force choice, and what is said of them and of refused cells."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import footfall
from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry
from footfall.maps import layers as footing
from footfall.maps import reach_classes
from footfall.maps.quality import LIMIT, LegSituation, quality, situation_of
from footfall.maps.quality_settings import MOST, RAMPS, QualitySettings
from footfall.maps.spoken import spoken
from footfall.maps.suggest import NOT_CLEARED, explain, suggest
from footfall.terrain.generate import rock_field

ROWS, COLS = 24, 31
GRID = GridGeometry(-1.5, -1.2, 0.1, ROWS, COLS)
HERE = LegSituation(hip=(0.0, 0.0, 1.8), foot=(0.5, 0.0, 0.0), length=5.0, towards=(1.0, 1.0))


def random_layers(seed) -> dict[str, Any]:
    """Layers of chance, a part of the cells refused by each constraint."""
    rng = np.random.default_rng(seed)
    layers: dict[str, Any] = {
        name: rng.uniform(min(ramp), max(ramp), (ROWS, COLS)).astype(np.float32)
        for name, ramp in RAMPS.items()
        if name != "advance"
    }
    layers["height"] = rng.uniform(-0.6, 1.4, (ROWS, COLS))
    layers["height"][rng.random((ROWS, COLS)) < 0.1] = np.nan
    layers["reach_class"] = np.where(
        rng.random((ROWS, COLS)) < 0.7, reach_classes.FREE, rng.integers(0, 9, (ROWS, COLS))
    ).astype(np.uint8)
    return layers


def even_layers(**amounts) -> dict[str, Any]:
    """The same amounts everywhere."""
    layers: dict[str, Any] = {name: np.full((ROWS, COLS), amount, np.float32) for name, amount in amounts.items()}
    layers.setdefault("height", np.zeros((ROWS, COLS)))
    layers["footing"] = np.full((ROWS, COLS), footing.REACHABLE_STABLE, np.uint8)
    return layers


def ask(layers, settings=None, here=HERE):
    return quality(GRID, layers, here, settings or QualitySettings())


def brute_force(found, count, separation):
    """Cells sorted by score, row and column, each taken if it is far enough from all taken before."""
    cells = [(-found.score[row, col], row, col) for row in range(ROWS) for col in range(COLS)]
    taken = []
    for negative, row, col in sorted(cells):
        apart = all(np.hypot(row - r, col - c) * GRID.resolution >= separation - 1e-9 for r, c in taken)
        if negative < 0 and apart and len(taken) < count:
            taken.append((row, col))
    return taken


@given(st.integers(0, 10_000), st.integers(1, MOST), st.sampled_from([0.0, 0.05, 0.1, 0.25, 0.3, 0.9]))
def test_suggestions_are_the_best_cells_far_enough_apart(seed, count, separation):
    found = ask(random_layers(seed))
    answer = suggest(found, count, separation)
    chosen = [(one.row, one.col) for one in answer.footfalls]
    assert chosen == brute_force(found, count, separation)
    assert chosen
    scores = [one.score for one in answer.footfalls]
    assert scores == sorted(scores, reverse=True)
    assert scores[0] == found.score.max()
    places = np.array([(one.x, one.y) for one in answer.footfalls])
    between = np.linalg.norm(places[:, None] - places, axis=-1)[~np.eye(len(places), dtype=bool)]
    assert (between >= separation - 1e-9).all()
    assert bool(answer.reason) == (len(chosen) < count)


@given(st.integers(0, 10_000), st.integers(1, 12), st.sampled_from([0.6, 1.5]))
def test_places_lie_nearer_to_each_other_only_where_nothing_else_is_left(seed, count, separation):
    found = ask(random_layers(seed))
    far = suggest(found, count, separation).footfalls
    filled = suggest(found, count, separation, strictly=False)
    places = [(one.row, one.col) for one in filled.footfalls]
    assert len(set(places)) == len(places) == min(count, int((found.score > 0).sum()))
    assert {(one.row, one.col) for one in far} <= set(places)
    scores = [one.score for one in filled.footfalls]
    assert scores == sorted(scores, reverse=True)
    assert min(scores) > 0
    assert bool(filled.reason) == (len(far) < count)
    if len(far) < count:
        # nowhere is a place that lies so far from those that do
        assert all(
            min(np.hypot(row - one.row, col - one.col) for one in far) * GRID.resolution < separation
            for row, col in np.argwhere(found.score > 0)
        )
        assert f"only {len(far)} lie" in filled.reason


@given(st.integers(0, 10_000))
def test_suggestions_break_no_constraint(seed):
    layers = random_layers(seed)
    settings = QualitySettings()
    for one in suggest(ask(layers, settings), 20, 0.0).footfalls:
        at = (one.row, one.col)
        assert layers["reach_class"][at] == reach_classes.FREE
        assert one.z is not None
        assert one.z == layers["height"][at]
        assert settings.lowest <= one.z - HERE.hip[2] <= settings.highest
        assert np.linalg.norm(np.array([one.x, one.y, one.z]) - HERE.hip) <= HERE.length
        assert not one.unknown
        assert (one.x, one.y) == (GRID.xs[one.col], GRID.ys[one.row])
        for name, amount in one.amounts.items():
            assert one.factors[name] > 0
            if name != "advance":
                assert amount == layers[name][at]


def test_ties_go_to_the_first_row_then_column():
    layers = even_layers(slope=0.1, support=0.9)
    chosen = suggest(ask(layers, here=replace(HERE, towards=None)), 3, 0.2).footfalls
    assert [(one.row, one.col) for one in chosen] == [(0, 0), (0, 2), (0, 4)]


def test_the_order_of_layers_changes_nothing():
    layers = random_layers(3)
    assert suggest(ask(layers)).footfalls == suggest(ask(dict(reversed(layers.items())))).footfalls


def test_unknown_ground_is_offered_only_when_allowed_and_then_marked():
    layers = even_layers(slope=0.3, support=0.6)
    layers["slope"][10, 12] = 0.0
    layers["support"][10, 12] = 1.0
    layers["height"][10, 12] = np.nan
    assert all(not one.unknown for one in suggest(ask(layers), MOST, 0.0).footfalls)
    best = suggest(ask(layers, QualitySettings(allow_unknown=True)), 1).footfalls[0]
    assert (best.row, best.col) == (10, 12)
    assert best.unknown
    assert best.z is None
    assert best.reasons[0] == "unknown ground, not known: height"


@pytest.mark.parametrize(("layer", "code"), [("footing", footing.UNSURE), ("reach_class", reach_classes.UNSURE)])
def test_cells_not_cleared_of_collisions_are_marked(layer, code):
    layers = even_layers(slope=0.1)
    layers[layer] = np.full((ROWS, COLS), code, np.uint8)
    assert not suggest(ask(layers)).footfalls
    found = ask(layers, QualitySettings(accept_unsure=True))
    assert NOT_CLEARED in suggest(found, 1).footfalls[0].reasons
    assert explain(found, 3, 3).verdict.endswith(NOT_CLEARED)
    cleared = ask(even_layers(slope=0.1), QualitySettings(accept_unsure=True))
    assert NOT_CLEARED not in suggest(cleared, 1).footfalls[0].reasons


def test_reasons_have_numbers_units_and_limits():
    layers = even_layers(slope=np.radians(4), step=0.03, support=0.62, age=3000.0, margin=1.7)
    settings = QualitySettings(ramps={"slope": (np.radians(25), 0.0)})
    reasons = suggest(ask(layers, settings), 1).footfalls[0].reasons
    assert reasons[0].startswith(
        "good: slope 4° (limit 25°), step 3 cm (limit 25 cm), margin 1.7 m (least 0 mm), advance"
    )
    assert reasons[-1] == "weakest: support 62 % (least 50 %)"
    heavy = QualitySettings(weights={"age": 100.0})
    assert suggest(ask(layers, heavy), 1).footfalls[0].reasons[-1] == "weakest: age 50 min (best up to 0 s)"


def test_perfect_ground_has_nothing_against_it():
    layers = even_layers(slope=0.0, support=1.0)
    one = suggest(ask(layers, here=replace(HERE, towards=None)), 1).footfalls[0]
    assert one.score == 1
    assert one.reasons == ("good: slope 0° (limit 25°), support 100 % (least 50 %)", "nothing speaks against it")


def test_nothing_acceptable_says_what_refuses_and_what_to_try():
    layers = even_layers(slope=0.6, step=0.01)
    layers["footing"][:, :20] = footing.NO_SOLUTION
    layers["height"][:4] = np.nan
    answer = suggest(ask(layers))
    assert answer.footfalls == ()
    assert sum(answer.refused.values()) == ROWS * COLS
    assert answer.reason == (
        "no footfall: of 744 cells 124 are not known well enough, 400 are without a posture inside the joint limits, "
        "220 are at or beyond the limit of a factor (slope: 220); "
        "try: widen that limit, or set the factor's weight to 0"
    )
    wider = QualitySettings(ramps={"slope": (0.8, 0.0)})
    assert suggest(ask(layers, wider)).footfalls


def test_fewer_than_asked_for_says_why():
    answer = suggest(ask(even_layers(slope=0.1)), 5, 2.0)
    assert 0 < len(answer.footfalls) < 5
    assert answer.reason == (
        f"{len(answer.footfalls)} of 5: each of the 744 acceptable cells lies within 2 m of one of these; "
        "try a smaller separation"
    )


def test_explain_names_every_layer_with_its_amount():
    layers = {**random_layers(5), "goodness": np.full((ROWS, COLS), 0.7, np.float32)}
    layers["footing"] = np.full((ROWS, COLS), footing.REACHABLE_STABLE, np.uint8)
    layers["reach_class"][:] = reach_classes.FREE
    layers["height"][6, 7] = 0.123
    layers["slope"][6, 7] = np.radians(8)
    settings = QualitySettings(weights={"roughness": 0.0})
    said = explain(ask(layers, settings), 6, 7)
    for name in [*layers, "advance"]:
        assert any(line.startswith(name.replace("_", " ") + " ") for line in said.lines), name
    assert "slope 8° (limit 25°), 0.68 of 1" in said.lines
    assert "height 12.3 cm" in said.lines
    assert "goodness 0.7" in said.lines
    assert "footing reachable and stable" in said.lines
    assert "reach class free" in said.lines
    assert "roughness does not count: its weight is 0" in said.lines
    assert f"roughness {spoken(layers['roughness'][6, 7], 'm')}" in said.lines
    assert said.verdict.startswith(f"acceptable, score {said.score:.2f}; weakest: ")
    assert (said.x, said.y) == (GRID.xs[7], GRID.ys[6])


@pytest.mark.parametrize(
    ("layer", "amount", "verdict"),
    [
        (
            "slope",
            np.radians(31),
            "refused, at or beyond the limit of a factor: slope 31° (limit 25°); widen that limit",
        ),
        ("height", np.nan, "refused, not known well enough: height; look there"),
        ("support", np.nan, "refused, not known well enough: support; look there"),
        ("footing", footing.UNKNOWN, "refused, not known well enough: reach; look there"),
        ("height", 1.5, "too high or too low for the body: -30 cm over the hip (allowed -2.3 m to -50 cm); change"),
        ("height", -5.0, "refused, out of reach: 6.8 m from the hip (limit 5 m); move the body"),
        ("footing", footing.REACHABLE_UNSTABLE, "refused, not stable: stability margin 2 cm; shift the body"),
        (
            "reach_class",
            reach_classes.JOINT_LIMIT,
            "limits: every posture that gets there turns a joint past its limit;",
        ),
        (
            "reach_class",
            reach_classes.FOOT_COLLISION,
            "refused, in collision: every posture tried there, the wheel upright, collides;",
        ),
        ("reach_class", reach_classes.UNSURE, "refused, not cleared of collisions: joint angles exist;"),
    ],
)
def test_explain_names_what_refuses(layer, amount, verdict):
    layers = even_layers(slope=0.1, support=0.9, margin=0.02)
    layers["reach_class"] = np.full((ROWS, COLS), reach_classes.FREE, np.uint8)
    row, col = 12, 15  # straight under the hip
    layers[layer][row, col] = amount
    found = ask(layers)
    said = explain(found, row, col)
    assert verdict in said.verdict
    assert said.score == 0
    assert said.refused == found.refused[row, col] > 0
    assert explain(found, 0, 0).refused == 0


@pytest.mark.parametrize(
    ("amounts", "told"),
    [
        ({"margin": 0.02, "margin_lifted": 0.3}, "stability margin 2 cm"),
        ({"margin": 0.3, "margin_lifted": -0.02}, "margin while the leg is in the air -2 cm"),
        ({"margin": 0.3, "margin_lifted": 0.2, "torque_ratio": 1.3}, "1.30 of a torque limit"),
        (
            {"margin": -0.1, "margin_lifted": 0.2, "torque_ratio": 1.3},
            "stability margin -10 cm, 1.30 of a torque limit",
        ),
        ({"margin": -0.1, "margin_lifted": 0.2, "torque_ratio": np.inf}, "stability margin -10 cm"),
    ],
)
def test_what_is_not_stable_is_told_by_what_refuses_it(amounts, told):
    layers = even_layers(slope=0.1, **amounts)
    layers["footing"][:] = footing.REACHABLE_UNSTABLE
    assert explain(ask(layers), 12, 15).verdict.startswith(f"refused, not stable: {told}; shift the body")


def test_amounts_are_spoken_in_units_of_their_size():
    assert spoken(np.radians(4.04), "rad") == "4.04°"
    assert [spoken(size, "m") for size in (0.0042, 0.031, 1.234, -0.3)] == ["4.2 mm", "3.1 cm", "1.23 m", "-30 cm"]
    assert [spoken(size, "s") for size in (30, 600, 36000)] == ["30 s", "10 min", "10 h"]
    assert spoken(0.854, "share") == "85.4 %"
    assert spoken(3, "") == "3"
    assert spoken(np.nan, "m") == "unknown"


def test_bad_questions_are_told_what_would_be_right():
    found = ask(even_layers(slope=0.1))
    counts: list[Any] = [0, MOST + 1, 2.5]
    for count in counts:
        with pytest.raises(InvalidInput, match="between 1 and 50"):
            suggest(found, count)
    for separation in (-0.1, np.nan, np.inf):
        with pytest.raises(InvalidInput, match="separation can't be negative"):
            suggest(found, 3, separation)
    for row, col in ((-1, 0), (0, COLS), (ROWS, 0)):
        with pytest.raises(InvalidInput, match="outside the grid"):
            explain(found, row, col)


def test_on_the_maps_of_a_rover_among_rocks(athlete):
    dem = rock_field(size=8.0, resolution=0.05, abundance=0.06, largest=0.5, seed=20081)
    state = footfall.stand(athlete, dem)
    maps = footfall.compute_maps(athlete, dem, state, leg=1)
    used = ("slope", "roughness", "step", "goodness", "certainty", "age", "height_sd", "margin", "footing")
    layers = {**{name: np.asarray(maps.layers[name]) for name in used}, "height": dem.heights}
    here = situation_of(athlete, state, 1, towards=(1.0, 0.0))
    found = quality(dem.geometry, layers, here, QualitySettings())
    answer = suggest(found, 5, 0.3)
    assert len(answer.footfalls) == 5
    for one in answer.footfalls:
        assert layers["footing"][one.row, one.col] == footing.REACHABLE_STABLE
        assert layers["goodness"][one.row, one.col] > 0
        assert one.x > here.foot[0]
    assert sum(answer.refused.values()) == (found.score == 0).sum()
    # slope, roughness and step have the limits of goodness here; the margin of stable cells is no limit
    stable = layers["footing"] == footing.REACHABLE_STABLE
    assert ((found.refused == LIMIT) == (stable & (layers["goodness"] == 0))).all()
    worst = float(np.quantile(layers["slope"][stable & (layers["slope"] > 0)], 0.8))
    strict = quality(dem.geometry, layers, here, QualitySettings(ramps={"slope": (worst, 0.0)}))
    steep = layers["slope"].astype(float) >= worst
    assert ((strict.refused == LIMIT) == (stable & (steep | (layers["goodness"] == 0)))).all()
    assert (strict.refused == LIMIT).any()
    assert set(answer.left_out) == {"support", "limit_margin", "age", "height_sd"}
