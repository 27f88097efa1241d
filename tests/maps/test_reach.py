"""Reach against search, brute force and the planner: answers, postures and reasons, and how it comes in parts."""

import itertools

import numba
import numpy as np
import pytest

from benchmarks.numeric_ik import chain, forward, reachable
from footfall.core.errors import Cancelled, InvalidInput
from footfall.core.frames import apply, inverse
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.maps.layers import LIFT
from footfall.maps.leg_collisions import LegCollisions
from footfall.maps.leg_postures import TURNS
from footfall.maps.reach import Reach, reach
from footfall.maps.reach_classes import (
    CLASSES,
    FOOT_COLLISION,
    FREE,
    JOINT_LIMIT,
    NO_GEOMETRY,
    NO_LIFT,
    OUT_OF_RANGE,
    UNKNOWN,
    UNSURE,
    WAYPOINT_COLLISION,
)
from footfall.planning.body.stand import stand
from footfall.planning.scene.ground import Contact, footfall_contact
from footfall.planning.step.target import HEADINGS, candidates
from footfall.robot.description import PARTS, link_name
from footfall.robot.ik import leg_azimuth, solve_leg, wheel_pose_for_contact
from footfall.robot.kinematics import leg_wheel_pose
from footfall.robot.meshes.collision import CollisionScene
from footfall.robot.proof.obstacles import CHASSIS, SELF, TERRAIN
from footfall.robot.proof.obstacles import LEG as LEG_CODE
from footfall.terrain.dem import Dem
from footfall.terrain.generate import rock_field
from footfall.terrain.ground.triangulate import triangulate

LEG = 2
OWN = slice(12, 18)


@pytest.fixture(scope="module")
def dem():
    return rock_field(size=8.0, resolution=0.08, abundance=0.06, largest=0.4, seed=3)


@pytest.fixture(scope="module")
def state(athlete, dem):
    return stand(athlete, dem, yaw=0.2)


@pytest.fixture(scope="module")
def collisions(athlete, dem, state):
    return LegCollisions(athlete, state, LEG, dem)


@pytest.fixture(scope="module")
def whole(athlete, dem, state, collisions):
    return reach(athlete, dem, state, LEG, collisions=collisions)


def holed(dem, seed=4):
    """The same ground with holes, and cut off at the leg's side."""
    heights = dem.heights.copy()
    rng = np.random.default_rng(seed)
    for row, col in rng.integers(0, dem.geometry.cols, (12, 2)):
        heights[row : row + 4, col : col + 5] = np.nan
    return Dem(heights, dem.geometry, "holes", Provenance({}))


def same(a: Reach, b: Reach):
    for name in a.__dataclass_fields__:
        if name != "checks":
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)


def test_a_search_from_many_starts_agrees(athlete, dem, state, rng):
    found = reach(athlete, dem, state, LEG)
    # what is within 1e-4 of a limit is for rounding to decide
    clear = np.flatnonzero(~(np.abs(found.limit_margin) < 1e-4))
    some = rng.permutation(clear)[:240]
    leg, T = chain(athlete, LEG), inverse(state.T_site_base)
    contacts, directions = apply(T, found.contacts[some]), -found.normals[some] @ T[:3, :3].T
    yes = found.solutions[some] > 0
    searched = reachable(leg, contacts, directions, rng)
    assert 50 < yes.sum() < 190
    assert not (searched & ~yes).any()
    # a start leads to a solution only near it; where few do, twenty may all be wrong
    missed = yes & ~searched
    assert missed.mean() < 0.03
    assert reachable(leg, contacts[missed], directions[missed], rng, starts=300).all()


def test_the_search_knows_the_same_leg_as_pin(athlete, rng):
    leg = chain(athlete, LEG)
    qs = rng.uniform(leg.lower, leg.upper, (20, 6))
    contacts, directions, J = forward(leg, qs)
    for q, contact, direction in zip(qs, contacts, directions, strict=True):
        T = leg_wheel_pose(athlete, q, LEG)
        np.testing.assert_allclose(T[:3, 3] + athlete.wheel_radius * T[:3, 0], contact, atol=1e-12)
        np.testing.assert_allclose(T[:3, 0], direction, atol=1e-12)
    step = 1e-6 * np.eye(6)[3]
    moved = [np.concatenate(forward(leg, qs + s)[:2], axis=1) for s in (step, -step)]
    np.testing.assert_allclose((moved[0] - moved[1]) / 2e-6, J[:, :, 3], atol=1e-8)


def test_every_posture_stands_on_its_contact_and_the_other_above_it(athlete, state, whole):
    there = np.isfinite(whole.postures[:, 0])
    assert (there == (whole.solutions > 0)).all()
    for q in (whole.postures, whole.above):
        known = q[np.isfinite(q[:, 0])]
        assert (known >= athlete.lower[OWN]).all()
        assert (known <= athlete.upper[OWN]).all()
    T_site_base = np.asarray(state.T_site_base)
    for i in np.flatnonzero(there):
        T = T_site_base @ leg_wheel_pose(athlete, whole.postures[i], LEG)
        assert np.abs(T[:3, 3] + athlete.wheel_radius * T[:3, 0] - whole.contacts[i]).max() < 1e-8
        assert np.abs(T[:3, 0] + whole.normals[i]).max() < 1e-8
        if np.isfinite(whole.above[i, 0]):
            high = T_site_base @ leg_wheel_pose(athlete, whole.above[i], LEG)
            T[2, 3] += LIFT
            assert np.abs(high - T).max() < 1e-8
        else:
            assert whole.reason[i] in (NO_LIFT, FOOT_COLLISION)


def test_contacts_are_the_planners(athlete, dem, whole, rng):
    for i in rng.permutation(len(whole.rows))[:60]:
        contact = footfall_contact(athlete, dem, *whole.contacts[i, :2])
        assert isinstance(contact, Contact)
        np.testing.assert_allclose(contact.point, whole.contacts[i], atol=1e-9)
        np.testing.assert_allclose(contact.normal, whole.normals[i], atol=1e-8)


def test_the_planner_has_goal_postures_just_where_there_are_solutions(athlete, dem, state, whole, rng):
    for i in rng.permutation(len(whole.rows))[:150]:
        contact = Contact(whole.contacts[i], whole.normals[i])
        goals = candidates(athlete, LEG, contact, np.asarray(state.T_site_base), state.leg(LEG), 0)
        assert bool(goals) == (whole.solutions[i] > 0)
        upright = {goal.branch for goal in goals if goal.lean == 0}
        assert len(upright) == whole.solutions[i]


def test_classes_are_those_of_trying_everything(athlete, dem, state, whole, rng):
    """Free cells are free by the exact meshes; in the others every solution in all the planner's headings collides."""
    T_site_base = np.asarray(state.T_site_base)
    scene = CollisionScene(athlete, state.posture, LEG, T_site_base, triangulate(dem), 0.0, 0.15)
    free = rng.permutation(np.flatnonzero(whole.reason == FREE))[:300]
    assert len(free) > 50
    for i in free:
        assert not scene.collides(whole.postures[i], "true")
        assert not scene.collides(whole.above[i], "raised")
    blocked = np.flatnonzero(np.isin(whole.reason, (FOOT_COLLISION, WAYPOINT_COLLISION, NO_LIFT)))
    azimuth = leg_azimuth(athlete, LEG, T_site_base)
    headings = np.concatenate([azimuth + HEADINGS, azimuth + HEADINGS + np.pi])
    for i in rng.permutation(blocked)[:80]:
        Ts = wheel_pose_for_contact(athlete, whole.contacts[i], whole.normals[i], headings, T_site_base)
        found = solve_leg(athlete, LEG, Ts)
        Ts[:, :3, 3] += LIFT * inverse(T_site_base)[:3, 2]
        high = solve_leg(athlete, LEG, Ts)
        for k, branch in np.argwhere(found.valid):
            # a wrist of the same shoulder and elbow above
            pair = slice(2 * (branch // 2), 2 * (branch // 2) + 2)
            above = high.q[k, pair][high.valid[k, pair]]
            assert scene.collides(found.q[k, branch], "true") or all(scene.collides(q, "raised") for q in above)


def test_what_is_free_is_a_goal_of_the_planner_that_can_start_to_be_lowered(athlete, dem, state, whole, rng):
    T_site_base = np.asarray(state.T_site_base)
    np.testing.assert_array_equal(TURNS, HEADINGS)
    for i in rng.permutation(np.flatnonzero(whole.reason == FREE))[:100]:
        contact = Contact(whole.contacts[i], whole.normals[i])
        goals = candidates(athlete, LEG, contact, T_site_base, state.leg(LEG), 0)
        assert min(np.abs(goal.q - whole.postures[i]).max() for goal in goals if goal.lean == 0) < 1e-8


def test_every_class_is_there_and_its_text_names_the_cause(whole):
    seen = set(np.unique(whole.reason))
    assert {NO_GEOMETRY, JOINT_LIMIT, FOOT_COLLISION, WAYPOINT_COLLISION, FREE} <= seen
    assert not {UNKNOWN, OUT_OF_RANGE, UNSURE} & seen
    texts = {int(reason): {whole.text(i) for i in np.flatnonzero(whole.reason == reason)} for reason in seen}
    assert any("hip yaw" in text for text in texts[JOINT_LIMIT])
    assert any("the hip pitch collides with the chassis there" in text for text in texts[FOOT_COLLISION])
    assert all("20 cm above" in text for text in texts[WAYPOINT_COLLISION])
    assert len({name for name, _ in CLASSES.values()}) == len(CLASSES)
    high = np.flatnonzero(whole.seat > 0.06)
    assert all(f"stands {100 * whole.seat[i]:.0f} cm above the fitted ground" in whole.text(i) for i in high)


def test_what_is_blamed_is_too_close(athlete, dem, state, whole, rng):
    scene = CollisionScene(athlete, state.posture, LEG, np.asarray(state.T_site_base), triangulate(dem), 0.0, 0.15)
    for reason, qs, mode in ((FOOT_COLLISION, whole.postures, "true"), (WAYPOINT_COLLISION, whole.above, "raised")):
        for i in rng.permutation(np.flatnonzero(whole.reason == reason))[:40]:
            part, blame = link_name(LEG, PARTS[whole.link[i]]), int(whole.blame[i])
            hits = [hit for hit in scene.contacts(qs[i], mode) if part in (hit.link_a, hit.link_b)]
            obstacle = {CHASSIS: "base", TERRAIN: "terrain", SELF: f"leg{LEG}"}.get(blame, f"leg{blame - LEG_CODE}")
            assert any(hit.link_b.startswith(obstacle) for hit in hits)


def test_seat_and_support_go_with_postures(whole):
    there = np.isfinite(whole.postures[:, 0])
    assert (np.isfinite(whole.seat) == there).all()
    assert (whole.seat[there] >= -1e-3).all()
    assert ((whole.support[there] >= 0) & (whole.support[there] <= 1)).all()
    assert (whole.support[there] == 1).any()


@pytest.mark.parametrize("stride", [2, 3, 7])
def test_a_coarse_answer_is_part_of_the_whole(athlete, dem, state, stride):
    for ground in (dem, holed(dem)):
        checks = LegCollisions(athlete, state, LEG, dem)
        coarse = reach(athlete, ground, state, LEG, collisions=checks, stride=stride)
        full = reach(athlete, ground, state, LEG, collisions=checks)
        some = (full.rows % stride == 0) & (full.cols % stride == 0)
        assert 0 < some.sum() == len(coarse.rows) < len(full.rows)
        for name in ("rows", "cols", "contacts", "normals", "reason", "blame", "solutions", "postures", "seat"):
            np.testing.assert_array_equal(getattr(coarse, name), getattr(full, name)[some], err_msg=name)


def test_a_sketch_says_the_same_or_unsure_and_builds_no_meshes(athlete, dem, state, whole):
    checks = LegCollisions(athlete, state, LEG, dem).with_certificate()
    sketch = reach(athlete, dem, state, LEG, collisions=checks.sketch())
    assert "scene" not in vars(checks)
    told = sketch.reason != UNSURE
    # a posture that needs no meshes goes before a preferred one that does: the cell's answer stays
    assert (sketch.reason[told] == whole.reason[told]).all()
    assert sketch.checks == 0
    assert 0.8 < told.mean() < 1.0


def test_the_same_question_has_the_same_answer(athlete, dem, state, whole):
    again = reach(athlete, dem, state, LEG, collisions=LegCollisions(athlete, state, LEG, dem))
    same(whole, again)
    threads = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        same(whole, reach(athlete, dem, state, LEG, collisions=LegCollisions(athlete, state, LEG, dem)))
    finally:
        numba.set_num_threads(threads)


def test_a_certificate_saves_checks_and_changes_no_class(athlete, dem, state, whole):
    scene = CollisionScene(athlete, state.posture, LEG, np.asarray(state.T_site_base), triangulate(dem), 0.0, 0.15)
    asked = []

    def certified(qs, terrain):
        """Conservative, with gaps."""
        asked.append(terrain)
        free = np.array([not scene.collides(q, terrain) for q in qs], bool)
        return free & (np.floor(qs[:, 0] * 300) % 4 > 0)

    found = reach(athlete, dem, state, LEG, collisions=LegCollisions(athlete, state, LEG, dem, certified=certified))
    assert set(asked) == {"true", "raised"}
    np.testing.assert_array_equal(found.reason, whole.reason)
    assert found.checks < 0.6 * whole.checks
    for i in np.flatnonzero(found.reason == FREE)[::10]:
        assert not scene.collides(found.postures[i], "true")
        assert not scene.collides(found.above[i], "raised")


def test_with_the_proof_of_clearance_the_classes_are_the_same_by_few_meshes(athlete, dem, state, whole):
    found = reach(athlete, dem, state, LEG, collisions=LegCollisions(athlete, state, LEG, dem).with_certificate())
    np.testing.assert_array_equal(found.reason, whole.reason)
    assert found.checks < 0.5 * whole.checks


@pytest.mark.parametrize("bound", [0, 150])
def test_what_a_bound_on_checks_leaves_open_is_unsure_and_never_free(athlete, dem, state, whole, bound):
    few = reach(athlete, dem, state, LEG, collisions=LegCollisions(athlete, state, LEG, dem, most_checks=bound))
    assert few.checks <= bound
    unsure = few.reason == UNSURE
    assert unsure.any()
    np.testing.assert_array_equal(few.reason[~unsure], whole.reason[~unsure])
    if bound == 0:
        assert not (few.reason == FREE).any()
    assert "has not been found out" in few.text(int(np.flatnonzero(unsure)[0]))


def test_without_collision_checks_nothing_is_free(athlete, dem, state, whole):
    found = reach(athlete, dem, state, LEG)
    assert set(np.unique(found.reason)) == {NO_GEOMETRY, JOINT_LIMIT, UNSURE}
    np.testing.assert_array_equal(found.reason == UNSURE, whole.solutions > 0)
    np.testing.assert_array_equal(found.solutions, whole.solutions)
    assert found.checks == 0


def test_holes_and_the_edge_of_the_map_are_unknown(athlete, dem, state):
    ground = holed(dem)
    found = reach(athlete, ground, state, LEG)
    classes = found.classes(ground)
    centers = ground.geometry.centers()
    unknown_cells = centers[np.isnan(ground.heights)]
    west, south, east, north = ground.geometry.bounds
    for row, col in np.argwhere(np.ones(ground.geometry.shape, bool))[::37]:
        x, y = centers[row, col]
        edge = min(x - west, east - x, y - south, north - y)
        hole = np.linalg.norm(unknown_cells - (x, y), axis=1).min()
        if np.isnan(ground.heights[row, col]):
            assert classes[row, col] == UNKNOWN
        elif min(edge, hole) < athlete.wheel_radius - ground.geometry.resolution:
            assert classes[row, col] in (UNKNOWN, OUT_OF_RANGE)
        elif min(edge, hole) > athlete.wheel_radius + 2 * ground.geometry.resolution:
            assert classes[row, col] != UNKNOWN
    assert len(found.unknown)
    heights = np.full_like(dem.heights, np.nan)
    heights[0, 0] = 0.0
    nothing = reach(athlete, Dem(heights, dem.geometry, "nothing", Provenance({})), state, LEG)
    assert len(nothing.rows) == len(nothing.unknown) == 0
    away = Dem(dem.heights, GridGeometry(100.0, 100.0, 0.08, *dem.geometry.shape), "away", Provenance({}))
    empty = reach(athlete, away, state, LEG)
    assert len(empty.rows) == len(empty.unknown) == 0
    assert set(np.unique(empty.classes(away))) == {OUT_OF_RANGE}


def test_in_range_is_what_a_stretched_leg_reaches(athlete, dem, state, whole):
    hip = apply(state.T_site_base, athlete.description.legs[LEG].T_base_hip[:3, 3])
    points = np.dstack([dem.geometry.centers(), dem.heights])
    near = np.linalg.norm(points - hip, axis=2) <= athlete.leg_length(LEG)
    assert (whole.classes(dem)[~near] == OUT_OF_RANGE).all()
    assert near.sum() == len(whole.rows) + len(whole.unknown)
    assert len(set(zip(whole.rows.tolist(), whole.cols.tolist(), strict=True))) == len(whole.rows)
    assert all(a < b for a, b in itertools.pairwise(zip(whole.rows.tolist(), whole.cols.tolist(), strict=True)))


def test_progress_rises_and_cancels(athlete, dem, state, collisions):
    seen = []
    reach(athlete, dem, state, LEG, lambda fraction, text: seen.append(fraction), collisions)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0

    def stop(fraction, text):
        if fraction > 0.5:
            raise Cancelled("enough")

    with pytest.raises(Cancelled):
        reach(athlete, dem, state, LEG, stop, collisions)


def test_bad_input_is_refused(athlete, dem, state):
    with pytest.raises(InvalidInput, match="legs 0 to 5"):
        reach(athlete, dem, state, 6)
    with pytest.raises(InvalidInput, match="legs 0 to 5"):
        LegCollisions(athlete, state, 6, dem)
    with pytest.raises(InvalidInput, match="stride"):
        reach(athlete, dem, state, LEG, stride=0)
    with pytest.raises(InvalidInput, match="lift"):
        reach(athlete, dem, state, LEG, lift=0.0)
    with pytest.raises(InvalidInput, match="most_checks"):
        LegCollisions(athlete, state, LEG, dem, most_checks=-1)
