"""Reachability, stability and footing against one cell at a time, and their colours."""

from dataclasses import replace

import numpy as np
import pytest

from footfall.balance.forces import distribute
from footfall.balance.support import margin, support_margin
from footfall.balance.tip_over import tip_over
from footfall.balance.torques import contact_points, torque_margin
from footfall.core.errors import Cancelled, InvalidInput, NotFound
from footfall.core.frames import apply
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.maps import reach_classes
from footfall.maps.binding import NOTHING, binding_text
from footfall.maps.colors import FOOTING, PURPLE_GREEN, REACH, UNKNOWN_RGB, VIRIDIS, layer_legend, layer_rgb
from footfall.maps.layers import (
    COLLISION,
    LAYERS,
    NO_SOLUTION,
    OUT_OF_RANGE,
    REACHABLE_STABLE,
    REACHABLE_UNSTABLE,
    UNKNOWN,
    UNSURE,
    MapSettings,
)
from footfall.maps.reach import reach
from footfall.planning.body.stand import stand
from footfall.planning.step.leg_maps import compute_maps
from footfall.robot.ik import contact_point, solve_leg, wheel_pose_for_contact
from footfall.robot.kinematics import center_of_mass, wheel_centers
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import normal_at

LEG = 2


@pytest.fixture(scope="module")
def dem():
    grid = GridGeometry(-4.0, -4.0, 0.08, 101, 101)
    x, y = np.moveaxis(grid.centers(), -1, 0)
    heights = 0.1 * np.sin(1.4 * x + 0.2) * np.cos(1.2 * y) + 0.03 * x
    hole = np.hypot(x + 1.6, y - 1.3) < 0.3
    heights[hole] = np.nan
    return Dem(heights.astype(np.float32), grid, "waves", Provenance({}))


@pytest.fixture(scope="module")
def state(athlete, dem):
    return stand(athlete, dem, yaw=0.2)


@pytest.fixture(scope="module")
def stack(athlete, dem, state):
    return compute_maps(athlete, dem, state, LEG, MapSettings(friction=True))


CLASSES = ("footing", "footing_friction", "reach_class", "hindrance", "binding", "binding_lost")


def hip(robot, state):
    return apply(state.T_site_base, robot.description.legs[LEG].T_base_hip[:3, 3])


def test_every_layer_is_there_with_its_parents(athlete, dem, state, stack):
    assert set(stack.layers) == set(LAYERS)
    assert dict(stack.provenance.parents) == {"dem": dem.digest, "state": state.digest, "robot": athlete.digest}
    assert stack.stability == "plain"
    assert all(layer.dtype == (np.uint8 if name in CLASSES else np.float32) for name, layer in stack.layers.items())


def test_layers_with_friction_are_made_only_when_asked_for(athlete, dem, state, stack):
    geometric = compute_maps(athlete, dem, state, LEG)
    left_out = {"margin_friction", "margin_friction_conservative", "torque_ratio", "footing_friction"}
    assert set(stack.layers) - set(geometric.layers) == left_out
    for name in set(geometric.layers) - {"quality"}:
        np.testing.assert_array_equal(geometric.layers[name], stack.layers[name])


def test_a_preview_is_every_fourth_cell_and_changes_nothing(athlete, dem, state, stack):
    seen = []
    made = compute_maps(athlete, dem, state, LEG, MapSettings(friction=True), preview=seen.append)
    assert made.digest == stack.digest
    (coarse,) = seen
    assert coarse.geometry.resolution == pytest.approx(4 * dem.geometry.resolution)
    np.testing.assert_allclose(coarse.geometry.xs, dem.geometry.xs[::4])
    told = coarse.layers["reach_class"] != reach_classes.UNSURE
    assert told.mean() > 0.9
    for name, layer in coarse.layers.items():
        np.testing.assert_array_equal(layer[told], stack.layers[name][::4, ::4][told], err_msg=name)


def test_without_collision_checks_nothing_is_green(athlete, dem, state, stack):
    unsure = compute_maps(athlete, dem, state, LEG, MapSettings(collisions=False)).layers["footing"]
    assert (unsure == UNSURE).any()
    assert not np.isin(unsure, (REACHABLE_STABLE, REACHABLE_UNSTABLE, COLLISION)).any()
    green = stack.layers["footing"] == REACHABLE_STABLE
    assert (unsure[green] == UNSURE).all()


def test_footing_and_margin_agree_with_one_cell_at_a_time(athlete, dem, state, stack, rng):
    points = dem.geometry.centers()
    here = hip(athlete, state)
    for conservative in (False, True):
        stack = compute_maps(athlete, dem, state, LEG, MapSettings(conservative=conservative))
        seen = set()
        for cell in rng.permutation(points.size // 2)[:1500]:
            row, col = np.unravel_index(cell, dem.geometry.shape)
            footing = int(stack.layers["footing"][row, col])
            contact = np.array([*points[row, col], dem.heights[row, col]], float)
            seen.add(footing)
            if np.isnan(contact[2]):
                assert footing == UNKNOWN
                continue
            if np.linalg.norm(contact - here) > athlete.leg_length(LEG):
                assert footing == OUT_OF_RANGE
                assert stack.layers["solutions"][row, col] == 0
                continue
            near = np.hypot(*(points - contact[:2]).transpose(2, 0, 1))
            hole = np.isnan(dem.heights) & (near < athlete.wheel_radius + 2 * dem.geometry.resolution)
            if hole.any():
                # in the disc, or just beside it
                surely = (np.isnan(dem.heights) & (near < athlete.wheel_radius)).any()
                assert footing == UNKNOWN or not surely
                continue
            normal = normal_at(dem, contact[0], contact[1], athlete.wheel_radius)
            heading = np.arctan2(contact[1] - here[1], contact[0] - here[0])
            poses = wheel_pose_for_contact(
                athlete, contact, normal, np.array([heading, heading + np.pi]), state.T_site_base
            )
            found = solve_leg(athlete, LEG, poses)
            count = int(found.valid.any(axis=0).sum())
            assert stack.layers["solutions"][row, col] == count
            if count == 0:
                assert footing == NO_SOLUTION
                assert np.isnan(stack.layers["margin"][row, col])
                continue
            why = stack.layers["reach_class"][row, col]
            if why in (reach_classes.FOOT_COLLISION, reach_classes.WAYPOINT_COLLISION):
                assert footing == COLLISION
            elif why == reach_classes.NO_LIFT:
                assert footing == UNSURE
            else:
                assert why == reach_classes.FREE
                stable = min(float(stack.margin[row, col]), float(stack.layers["margin_lifted"][row, col])) >= 0
                assert footing == (REACHABLE_STABLE if stable else REACHABLE_UNSTABLE)
        assert {UNKNOWN, OUT_OF_RANGE, NO_SOLUTION, COLLISION, REACHABLE_STABLE} <= seen


def test_margins_agree_with_one_cell_at_a_time(athlete, dem, state, stack, rng):
    found = reach(athlete, dem, state, LEG, collisions=None)
    solved = np.flatnonzero(np.isfinite(found.postures).all(axis=1))
    others = [leg for leg in athlete.legs if leg != LEG]
    # where a wheel touches decides the normal, and the normal where it touches
    fixed = apply(state.T_site_base, wheel_centers(athlete, state.posture)[others])
    for _ in range(10):
        normals = np.array([normal_at(dem, c[0], c[1], athlete.wheel_radius) for c in fixed])
        fixed = contact_points(athlete, state.posture, state.T_site_base, others, normals)
    unsure = compute_maps(athlete, dem, state, LEG, MapSettings(collisions=False, friction=True)).layers
    for i in rng.permutation(solved)[:60]:
        row, col = found.rows[i], found.cols[i]
        q = state.posture.copy()
        q[6 * LEG : 6 * LEG + 6] = found.postures[i]
        assert contact_point(athlete, q, LEG, state.T_site_base, found.normals[i]) == pytest.approx(
            found.contacts[i], abs=1e-9
        )
        com = apply(state.T_site_base, center_of_mass(athlete, q))
        feet, ups = np.vstack([fixed, found.contacts[i]]), np.vstack([normals, found.normals[i]])
        for name, conservative in (("margin", False), ("margin_conservative", True)):
            assert unsure[name][row, col] == pytest.approx(margin(feet, com[:2], conservative), abs=1e-5)
        binds = support_margin(feet, com[:2]).feet
        if binds is not None:
            a, b = sorted([*others, LEG][foot] for foot in binds)
            assert binding_text("binding", int(unsure["binding"][row, col])) == f"the edge between legs {a} and {b}"
        assert unsure["tip_energy"][row, col] == pytest.approx(tip_over(feet, com, athlete.mass).energy, rel=1e-4)
        held = distribute(feet, ups, com, athlete.mass) is not None
        assert held or float(unsure["margin_friction"][row, col]) <= 1e-3
        expected = torque_margin(athlete, q, state.T_site_base, [*others, LEG], ups)
        assert unsure["torque_ratio"][row, col] == pytest.approx(expected.ratio, rel=1e-4)


def test_where_the_leg_stands_it_can_stand(athlete, dem, state, stack):
    contact = contact_point(athlete, state.posture, LEG, state.T_site_base)
    row, col = dem.geometry.cell(contact[0], contact[1])
    assert stack.layers["footing"][row, col] in (REACHABLE_STABLE, UNKNOWN)
    for leg in athlete.legs:
        at = contact_point(athlete, state.posture, leg, state.T_site_base)
        row, col = dem.geometry.cell(at[0], at[1])
        footing = compute_maps(athlete, dem, state, leg).layers["footing"][row, col]
        assert footing in (REACHABLE_STABLE, UNKNOWN)


def test_a_stricter_margin_turns_green_to_orange(athlete, dem, state, stack):
    least = float(np.nanmedian(stack.layers["margin"]))
    # of footfalls alone: lifted from here, no leg leaves the others such a margin
    footfalls = MapSettings(friction=True, lift_off=False)
    strict = compute_maps(athlete, dem, state, LEG, replace(footfalls, stable_margin=least))
    plain_footing, strict_footing = stack.layers["footing"], strict.layers["footing"]
    assert ((plain_footing == REACHABLE_STABLE) & (strict_footing == REACHABLE_UNSTABLE)).any()
    assert ((strict_footing == REACHABLE_STABLE) <= (plain_footing == REACHABLE_STABLE)).all()
    conservative = compute_maps(athlete, dem, state, LEG, replace(footfalls, conservative=True))
    assert conservative.stability == "conservative"
    for plain, less in (("margin", "margin_conservative"), ("margin_friction", "margin_friction_conservative")):
        known = np.isfinite(stack.layers[plain])
        assert (stack.layers[less][known] <= stack.layers[plain][known] + 1e-6).all()
    assert ((conservative.layers["footing"] == REACHABLE_STABLE) <= (plain_footing == REACHABLE_STABLE)).all()


def test_the_same_input_gives_the_same_digest(athlete, dem, state, stack):
    assert compute_maps(athlete, dem, state, LEG, MapSettings(friction=True)).digest == stack.digest
    assert compute_maps(athlete, dem, state, LEG, MapSettings(window=0.6, friction=True)).digest != stack.digest


def test_far_from_the_map_everything_is_out_of_range(athlete, dem, state):
    away = GridGeometry(100.0, 100.0, 0.08, 101, 101)
    stack = compute_maps(athlete, Dem(dem.heights, away, "away", Provenance({})), state, LEG)
    assert set(np.unique(stack.layers["footing"])) == {UNKNOWN, OUT_OF_RANGE}
    assert np.isnan(stack.layers["margin"]).all()


def test_progress_rises_to_one_and_cancels(athlete, dem, state):
    seen = []
    compute_maps(athlete, dem, state, LEG, progress=lambda fraction, text: seen.append(fraction))
    assert seen == sorted(seen)
    assert seen[-1] == 1.0

    def stop(fraction, text):
        if fraction > 0.6:
            raise Cancelled("enough")

    with pytest.raises(Cancelled):
        compute_maps(athlete, dem, state, LEG, progress=stop)


def test_bad_input_is_refused_by_name(athlete, dem, state):
    with pytest.raises(InvalidInput, match="legs 0 to 5"):
        compute_maps(athlete, dem, state, 6)
    body = {name: getattr(state, name) for name in state.__dataclass_fields__}
    other = type(state)(**{**body, "robot": "someone"})
    with pytest.raises(InvalidInput, match="the robot is athlete"):
        compute_maps(athlete, dem, other, LEG)


def test_no_heading_of_the_wheel_reaches_more(athlete, dem, state):
    found = reach(athlete, dem, state, LEG)
    some = slice(0, None, 23)
    any_heading = np.zeros((len(found.rows[some]), 8), bool)
    for heading in np.deg2rad(np.arange(0, 360, 15)):
        poses = wheel_pose_for_contact(
            athlete, found.contacts[some], found.normals[some], np.full(len(any_heading), heading), state.T_site_base
        )
        any_heading |= solve_leg(athlete, LEG, poses).valid
    assert (found.solutions[some] == any_heading.sum(axis=1)).all()


def test_reach_puts_the_wheel_on_the_ground_inside_limits(athlete, dem, state):
    found = reach(athlete, dem, state, LEG)
    has = found.solutions > 0
    assert has.any()
    assert (~has).any()
    no_way = np.isin(found.reason, (reach_classes.NO_GEOMETRY, reach_classes.JOINT_LIMIT))
    assert (no_way == ~has).all()
    assert np.isnan(found.postures[~has]).all()
    lower, upper = athlete.lower[6 * LEG : 6 * LEG + 6], athlete.upper[6 * LEG : 6 * LEG + 6]
    assert (found.postures[has] >= lower).all()
    assert (found.postures[has] <= upper).all()


def test_colours_tell_the_classes_apart(stack):
    for name, table in (("footing", FOOTING), ("footing_friction", FOOTING), ("reach_class", REACH)):
        rgb = layer_rgb(stack, name)
        for one, (_, color) in table.items():
            assert (rgb[stack.layers[name] == one] == color).all()
        legend = layer_legend(stack, name)
        assert len({text for text, _ in legend}) == len({color for _, color in legend}) == len(table)
        assert len({text[0] for text, _ in legend}) == len(table)
        colors = np.array([color for _, color in legend], float)
        apart = np.linalg.norm(colors[:, None] - colors, axis=2) + 1000 * np.eye(len(colors))
        assert apart.min() > 25


def test_the_binding_feet_and_the_lost_leg_are_named_and_coloured(athlete, dem, state, stack):
    strict = compute_maps(athlete, dem, state, LEG, MapSettings(conservative=True))
    for maps, name in ((stack, "binding"), (strict, "binding"), (strict, "binding_lost")):
        codes = maps.layers[name]
        known = np.isfinite(maps.margin)
        assert (codes[known] != NOTHING).all()
        assert (codes[~known] == NOTHING).all()
        legend = layer_legend(maps, name)
        assert len(legend) == len({text for text, _ in legend}) == len({color for _, color in legend})
        assert len(legend) == len(np.unique(codes))
    assert (stack.layers["binding_lost"] == NOTHING).all()


def test_what_stops_the_leg_is_named_and_coloured(stack):
    codes, reasons = stack.layers["hindrance"], stack.layers["reach_class"]
    legend = layer_legend(stack, "hindrance")
    rgb = layer_rgb(stack, "hindrance").reshape(-1, 3)
    assert {color for _, color in legend} == {tuple(int(c) for c in color) for color in np.unique(rgb, axis=0)}
    assert len({text for text, _ in legend}) == len(legend) == len(np.unique(codes))
    assert (reach_classes.hindrance_text(int(codes[reasons == reach_classes.FREE][0]))) == "nothing"
    at_limit = [
        reach_classes.hindrance_text(int(code)) for code in np.unique(codes[reasons == reach_classes.JOINT_LIMIT])
    ]
    assert at_limit
    assert all(text.endswith("at its limit") for text in at_limit)
    hit = [
        reach_classes.hindrance_text(int(code)) for code in np.unique(codes[reasons == reach_classes.FOOT_COLLISION])
    ]
    assert hit
    assert all(text.startswith("hits ") for text in hit)


@pytest.mark.parametrize("layer", [name for name in LAYERS if name not in CLASSES])
def test_unknown_has_its_own_colour_in_every_layer(stack, layer):
    rgb = layer_rgb(stack, layer)
    assert rgb.dtype == np.uint8
    assert rgb.shape == (*stack.geometry.shape, 3)
    unknown = np.isnan(stack.layers[layer])
    if LAYERS[layer].group != "Ground":
        unknown = stack.layers["footing"] == UNKNOWN
    assert (rgb[unknown] == UNKNOWN_RGB).all()
    if layer != "certainty":
        assert unknown.any()
    if LAYERS[layer].group == "Ground":
        assert not (rgb[~unknown] == UNKNOWN_RGB).all(axis=-1).any()
    unit = LAYERS[layer].unit
    assert all(unit in text for text, _ in layer_legend(stack, layer)[:5])


def test_no_ramp_comes_near_the_colours_with_a_meaning_of_their_own():
    for ramp in (VIRIDIS, PURPLE_GREEN):
        at = np.linspace(0, 1, len(ramp))
        along = np.stack([np.interp(np.linspace(0, 1, 400), at, ramp[:, i]) for i in range(3)], axis=1)
        assert np.linalg.norm(along - UNKNOWN_RGB, axis=1).min() > 30


def test_a_layer_that_does_not_exist_is_named(stack):
    with pytest.raises(NotFound, match="no layer 'beauty'; the stack has goodness"):
        layer_rgb(stack, "beauty")
    with pytest.raises(NotFound):
        layer_legend(stack, "beauty")
