"""Footfall quality: the mean against a plain loop, its laws, the constraints, and what bad input is told."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry
from footfall.core.value import flatten, unflatten
from footfall.maps import layers as footing
from footfall.maps import reach_classes
from footfall.maps.quality import (
    COLLISION,
    ELEVATION,
    LIMIT,
    POSTURE,
    RANGE,
    REFUSALS,
    UNKNOWN,
    UNSTABLE,
    UNSURE,
    LegSituation,
    quality,
    situation_of,
)
from footfall.maps.quality_settings import (
    FACTORS,
    PREFERENCE_LEAST,
    RAMPS,
    UNKNOWN_COUNTS_AS,
    WEIGHTS,
    QualitySettings,
    factor_of,
)

ROWS, COLS = 9, 12
GRID = GridGeometry(-0.5, -0.4, 0.1, ROWS, COLS)
HERE = LegSituation(hip=(0.0, 0.0, 1.8), foot=(0.1, 0.2, 0.0), length=3.0, towards=(3.0, -4.0))
MEASURED = tuple(name for name in FACTORS if name != "advance")
factors = st.sampled_from(MEASURED)
seeds = st.integers(0, 10_000)


def all_layers(rng, beyond=0.1):
    """Every layer; amounts run from ``beyond`` of the way from worst to best to as much beyond the best."""
    layers = {
        "height": 0.2 * rng.random((ROWS, COLS)),
        "reach_class": np.full((ROWS, COLS), reach_classes.FREE, np.uint8),
    }
    for name in MEASURED:
        worst, best = RAMPS[name]
        layers[name] = (worst + (best - worst) * rng.uniform(beyond, 1 + beyond, (ROWS, COLS))).astype(np.float32)
    return layers


def score_of(layers, settings=None, here=HERE):
    return quality(GRID, layers, here, settings or QualitySettings()).score


def plain_score(layers, settings, row, col):
    """The geometric mean as it is written down, one cell at a time."""
    product, total = 1.0, 0.0
    for name, weight in settings.weights.items():
        if name == "advance":
            x, y = GRID.x0 + col * GRID.resolution - HERE.foot[0], GRID.y0 + row * GRID.resolution - HERE.foot[1]
            amount = 0.6 * x - 0.8 * y
        else:
            amount = float(layers[name][row, col])
        worst, best = settings.ramps[name]
        share = min(max((amount - worst) / (best - worst), 0.0), 1.0)
        if not FACTORS[name].limit:
            share = PREFERENCE_LEAST + (1 - PREFERENCE_LEAST) * share
        product *= share**weight
        total += weight
    return product ** (1 / total)


@pytest.mark.parametrize("beyond", [0.1, -0.1])
def test_score_is_the_weighted_geometric_mean(rng, beyond):
    layers = all_layers(rng, beyond)
    settings = QualitySettings(weights={name: rng.uniform(0.1, 3) for name in FACTORS})
    found = quality(GRID, layers, HERE, settings)
    expected = [[plain_score(layers, settings, row, col) for col in range(COLS)] for row in range(ROWS)]
    np.testing.assert_allclose(found.score, expected, rtol=1e-9)
    assert found.counted == tuple(FACTORS)
    assert ((found.refused == LIMIT) == (found.score == 0)).all()
    assert (found.score == 0).any() == (beyond < 0)


@given(seeds, factors, st.floats(0, 1))
def test_a_better_amount_never_lowers_the_score(seed, name, share):
    layers = all_layers(np.random.default_rng(seed), -0.1)
    better = {**layers, name: (layers[name] + share * (RAMPS[name][1] - layers[name])).astype(np.float32)}
    towards_best = np.sign(RAMPS[name][1] - RAMPS[name][0])
    improved = (better[name] - layers[name]) * towards_best >= 0
    before, after = score_of(layers), score_of(better)
    assert improved.any()
    assert (after[improved] >= before[improved] * (1 - 1e-12)).all()


@given(seeds, factors)
def test_a_weight_of_zero_removes_the_factor_and_its_veto(seed, name):
    rng = np.random.default_rng(seed)
    layers = all_layers(rng)
    settings = QualitySettings(weights={name: 0.0})
    spoilt = {**layers, name: np.where(rng.random((ROWS, COLS)) < 0.5, np.nan, 1e6).astype(np.float32)}
    without = {other: layer for other, layer in layers.items() if other != name}
    expected = score_of(layers, settings)
    assert (expected > 0).all()
    assert np.array_equal(score_of(spoilt, settings), expected)
    assert np.array_equal(score_of(without, settings), expected)
    assert np.array_equal(score_of(without), expected)


@given(seeds, st.floats(0.01, 100))
def test_only_the_proportions_of_the_weights_count(seed, scale):
    layers = all_layers(np.random.default_rng(seed))
    scaled = QualitySettings(weights={name: scale * weight for name, weight in WEIGHTS.items()})
    np.testing.assert_allclose(score_of(layers, scaled), score_of(layers), rtol=1e-9)


@given(seeds, factors)
def test_a_limit_is_a_veto_and_a_preference_is_not(seed, name):
    layers = all_layers(np.random.default_rng(seed))
    layers[name][4, 5] = RAMPS[name][0] + (RAMPS[name][0] - RAMPS[name][1])
    found = quality(GRID, layers, HERE, QualitySettings())
    if FACTORS[name].limit:
        assert found.score[4, 5] == 0
        assert found.refused[4, 5] == LIMIT
    else:
        assert found.score[4, 5] > 0
        assert found.refused[4, 5] == 0


def test_the_order_of_layers_changes_nothing_and_turning_the_grid_turns_the_score(rng):
    layers = all_layers(rng)
    expected = score_of(layers)
    assert np.array_equal(score_of(dict(reversed(layers.items()))), expected)
    turned = LegSituation(hip=HERE.hip, foot=(-0.1, -0.2, 0.0), length=3.0, towards=(-3.0, 4.0))
    grid = GridGeometry(-GRID.xs[-1], -GRID.ys[-1], 0.1, ROWS, COLS)
    found = quality(grid, {name: layer[::-1, ::-1] for name, layer in layers.items()}, turned, QualitySettings())
    np.testing.assert_allclose(found.score[::-1, ::-1], expected, rtol=1e-9)


def test_moving_towards_the_goal_is_better(rng):
    layers = {name: layer for name, layer in all_layers(rng).items() if name in ("height", "reach_class")}
    east = score_of(layers, here=LegSituation((0.0, 0.0, 1.8), (0.0, 0.0, 0.0), 3.0, (2.0, 0.0)))
    assert (np.diff(east, axis=1) >= 0).all()
    assert (np.diff(east, axis=0) == 0).all()
    assert east[0, -1] > east[0, 0] > 0


@pytest.mark.parametrize(
    ("layer", "code", "refusal"),
    [
        ("reach_class", reach_classes.UNKNOWN, UNKNOWN),
        ("reach_class", reach_classes.OUT_OF_RANGE, RANGE),
        ("reach_class", reach_classes.NO_GEOMETRY, POSTURE),
        ("reach_class", reach_classes.JOINT_LIMIT, POSTURE),
        ("reach_class", reach_classes.NO_LIFT, POSTURE),
        ("reach_class", reach_classes.FOOT_COLLISION, COLLISION),
        ("reach_class", reach_classes.WAYPOINT_COLLISION, COLLISION),
        ("reach_class", reach_classes.UNSURE, UNSURE),
        ("footing", footing.UNKNOWN, UNKNOWN),
        ("footing", footing.OUT_OF_RANGE, RANGE),
        ("footing", footing.NO_SOLUTION, POSTURE),
        ("footing", footing.REACHABLE_UNSTABLE, UNSTABLE),
        ("footing", footing.COLLISION, COLLISION),
        ("footing", footing.UNSURE, UNSURE),
        ("height", np.nan, UNKNOWN),
        ("height", 1.31, ELEVATION),
        ("height", -0.51, ELEVATION),
        ("height", 1.29, 0),
        ("height", -0.49, 0),
        ("slope", np.nan, UNKNOWN),
        ("margin", 0.0, LIMIT),
        ("age", np.nan, 0),
    ],
)
def test_each_constraint_refuses_its_cell_alone(rng, layer, code, refusal):
    layers = all_layers(rng)
    layers["footing"] = np.full((ROWS, COLS), footing.REACHABLE_STABLE, np.uint8)
    layers[layer][3, 7] = code
    found = quality(GRID, layers, HERE, QualitySettings())
    expected = np.zeros((ROWS, COLS))
    expected[3, 7] = refusal
    assert (found.refused == expected).all()
    assert ((found.score > 0) == (expected == 0)).all()


def test_classes_cover_every_class_of_the_reach_map(rng):
    """A class added there must be refused or accepted here on purpose."""
    layers = all_layers(rng)
    for code in reach_classes.CLASSES:
        layers["reach_class"][:] = code
        assert (quality(GRID, layers, HERE, QualitySettings()).refused == 0).all() == (code == reach_classes.FREE)


def test_the_leg_is_only_so_long(rng):
    short = LegSituation(hip=(0.0, 0.0, 0.8), foot=(0.0, 0.0, 0.0), length=0.9, towards=None)
    layers = all_layers(rng)
    found = quality(GRID, layers, short, QualitySettings())
    x, y = np.meshgrid(GRID.xs, GRID.ys)
    away = np.linalg.norm(np.stack([x, y, layers["height"] - 0.8]), axis=0)
    assert ((found.refused == RANGE) == (away > 0.9)).all()
    assert 0 < (away > 0.9).sum() < away.size


def test_cells_not_cleared_of_collisions_can_be_accepted(rng):
    layers = all_layers(rng)
    layers["reach_class"][2] = reach_classes.UNSURE
    assert (quality(GRID, layers, HERE, QualitySettings()).refused[2] == UNSURE).all()
    assert (quality(GRID, layers, HERE, QualitySettings(accept_unsure=True)).refused == 0).all()


def test_unknown_ground_is_refused_or_counts_as_poor(rng):
    layers = all_layers(rng)
    layers["support"][3, 3] = np.nan
    layers["height"][5, 5] = np.nan
    allowed = quality(GRID, layers, HERE, QualitySettings(allow_unknown=True))
    assert np.argwhere(allowed.unknown).tolist() == [[3, 3], [5, 5]]
    assert (allowed.refused == 0).all()
    worst, best = RAMPS["support"]
    poor = {
        **layers,
        "support": np.where(np.isnan(layers["support"]), worst + UNKNOWN_COUNTS_AS * (best - worst), layers["support"]),
    }
    assert allowed.score[3, 3] == pytest.approx(score_of(poor)[3, 3], rel=1e-6)
    refused = quality(GRID, layers, HERE, QualitySettings())
    assert np.argwhere(refused.refused == UNKNOWN).tolist() == [[3, 3], [5, 5]]
    assert (refused.score[refused.unknown] == 0).all()


def test_missing_layers_are_left_out_and_said_so(rng):
    layers = all_layers(rng)
    del layers["support"]
    layers["age"][:] = np.nan
    still = LegSituation(HERE.hip, HERE.foot, HERE.length)
    found = quality(GRID, layers, still, QualitySettings(weights={"step": 0}))
    assert found.left_out == {
        "step": "its weight is 0",
        "support": "no such layer is given",
        "age": "it is not known anywhere",
        "advance": "no goal direction is given",
    }
    assert set(found.counted) == set(FACTORS) - set(found.left_out)


def test_amounts_come_in_the_units_of_the_factors(rng):
    layers = all_layers(rng)
    amounts = quality(GRID, layers, HERE, QualitySettings()).amounts(np.array([2 * COLS + 3]))
    assert amounts["slope"][0] == layers["slope"][2, 3]
    assert amounts["advance"][0] == pytest.approx(0.6 * (-0.2 - 0.1) - 0.8 * (-0.2 - 0.2))


def test_ramps_rise_and_fall():
    settings = QualitySettings()
    assert factor_of("slope", np.array([0.0, 0.218, 0.436, 1.0]), settings) == pytest.approx([1, 0.5, 0, 0])
    assert factor_of("support", np.array([0.4, 0.5, 0.75, 1.0]), settings) == pytest.approx([0, 0, 0.5, 1])
    assert factor_of("age", np.array([7200.0, 0.0]), settings) == pytest.approx([PREFERENCE_LEAST, 1])


def test_settings_are_equal_when_they_mean_the_same():
    given_some = QualitySettings(weights={"slope": 3}, ramps=json.loads('{"step": [1, 0]}'))
    given_all = QualitySettings(
        weights=dict(reversed({**WEIGHTS, "slope": 3.0}.items())), ramps={**RAMPS, "step": (1.0, 0.0)}
    )
    assert given_some.digest == given_all.digest != QualitySettings().digest
    assert unflatten(*flatten(given_some)).digest == given_some.digest


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"weights": {"beauty": 1.0}}, "no factor is called 'beauty'; there are slope"),
        ({"weights": {"slope": -1.0}}, "weight of slope must be a finite number of at least 0"),
        ({"weights": {"slope": math.nan}}, "weight of slope"),
        ({"weights": {"slope": "much"}}, "must be numbers"),
        ({"weights": {"slope": [1.0, 2.0]}}, "weight of slope"),
        ({"weights": [1.0]}, "weights must name factors"),
        ({"weights": dict.fromkeys(FACTORS, 0)}, "every weight is 0"),
        ({"ramps": {"slope": (0.1, 0.1)}}, "two different finite numbers"),
        ({"ramps": {"slope": (0.1, math.inf)}}, "two different finite numbers"),
        ({"ramps": {"slope": 0.1}}, "two different finite numbers"),
        ({"lowest": -0.5, "highest": -1.0}, "lowest must be below highest"),
        ({"lowest": math.nan}, "lowest must be below highest"),
    ],
)
def test_bad_settings_are_told_what_would_be_right(changes, told):
    with pytest.raises(InvalidInput, match=told):
        QualitySettings(**changes)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"hip": (0.0, 0.0)}, "hip needs 3"),
        ({"foot": (0.0, math.nan, 0.0)}, "foot needs 3"),
        ({"length": 0.0}, "length must be above zero"),
        ({"towards": (0.0, 0.0)}, "goal direction"),
        ({"towards": (1.0, math.inf)}, "goal direction"),
    ],
)
def test_bad_situations_are_told_what_would_be_right(changes, told):
    with pytest.raises(InvalidInput, match=told):
        LegSituation(**{"hip": HERE.hip, "foot": HERE.foot, "length": 3.0, **changes})


def test_bad_layers_are_told_what_would_be_right(rng):
    layers = all_layers(rng)
    cases = [
        ({name: layers[name] for name in layers if name != "height"}, '"height" and one of'),
        ({name: layers[name] for name in layers if name != "reach_class"}, '"height" and one of'),
        ({**layers, "slope": layers["slope"][:-1]}, "'slope' needs one number for each cell"),
        ({**layers, "slope": layers["slope"].astype(str)}, "'slope' needs one number for each cell"),
        (
            {**layers, "reach_class": layers["reach_class"] + np.uint8(2)},
            "'reach_class' holds whole numbers from 0 to 9",
        ),
        ({**layers, "reach_class": layers["reach_class"].astype(float)}, "'reach_class' holds whole numbers"),
        ({**layers, "footing": np.full((ROWS, COLS), 8, np.uint8)}, "'footing' holds whole numbers from 0 to 7"),
    ]
    for bad, told in cases:
        with pytest.raises(InvalidInput, match=told):
            quality(GRID, bad, HERE, QualitySettings())
    only = {name: layers[name] for name in ("height", "reach_class")}
    with pytest.raises(InvalidInput, match="no factor with a weight above 0 is known"):
        quality(GRID, only, LegSituation(HERE.hip, HERE.foot, HERE.length), QualitySettings())


def test_every_refusal_has_a_name_and_a_remedy():
    assert list(REFUSALS) == sorted(REFUSALS)
    assert all(what and remedy for what, remedy in REFUSALS.values())


def test_the_situation_of_a_standing_rover(athlete):
    import footfall
    from footfall.terrain.generate import plane

    state = footfall.stand(athlete, plane(size=8.0, resolution=0.1, height=0.3))
    here = situation_of(athlete, state, 2, towards=(1.0, 0.0))
    assert here.foot[2] == pytest.approx(0.3, abs=1e-6)
    angle = np.radians(120)
    assert here.hip[:2] == pytest.approx([1.229 * np.cos(angle), 1.229 * np.sin(angle)], abs=1e-6)
    # the foot stands outside the hip, on the same line from the middle
    assert np.arctan2(here.foot[1], here.foot[0]) == pytest.approx(angle, abs=1e-6)
    assert np.hypot(*here.foot[:2]) > 1.229
    with pytest.raises(InvalidInput):
        situation_of(athlete, state, 6)
