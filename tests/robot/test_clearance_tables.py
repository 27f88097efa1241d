"""What the compiled clearance check is given, against the description and the meshes themselves."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from footfall.core.errors import InvalidInput
from footfall.core.frames import rotation_rpy, transform
from footfall.core.grid import GridGeometry
from footfall.robot.description import PARTS, link_name, with_payload
from footfall.robot.kinematics import leg_link_poses, link_poses
from footfall.robot.meshes.bvh import PAYLOAD, TOUCHING_WHEEL, robot_meshes
from footfall.robot.model import Robot
from footfall.robot.proof import clearance as tested
from footfall.robot.proof.clearance import (
    MODES,
    SLACK,
    LegClearance,
    clearance_ground,
    leg_covers,
    leg_reach,
    link_shells,
    radius_classes,
    wheel_drums,
)
from footfall.robot.proof.drum_kernel import HALF, MOST, RADIUS, REQUIRED
from footfall.robot.proof.ground_tables import ground_tables
from footfall.robot.proof.leg_clearance_kernel import NO_GROUND, RAISED_GROUND, TRUE_GROUND
from footfall.robot.proof.shells import CENTER, FIRST, LAST, REACH
from footfall.terrain.generate import plane

EXTRA = 0.03
"""Of a clearance [m]."""
LEG = 2
PART_OF = {name: i for i, name in enumerate(PARTS)}


@pytest.fixture(scope="module")
def loaded(athlete):
    return Robot(with_payload(athlete.description, 150.0, (1.0, 0.8, 0.4), (0.1, 0.0, 0.3)))


@pytest.fixture(scope="module")
def posture(athlete):
    return np.array(athlete.posture("stand"))


T_SITE_BASE = transform(rotation_rpy(0.05, -0.08, 0.7), (0.6, -0.4, 1.4))


@pytest.fixture(scope="module")
def dem():
    return plane(3.0, 0.1)


@pytest.fixture(scope="module")
def ground(athlete, dem):
    return clearance_ground(athlete, dem.heights, dem.geometry, EXTRA)


def checks(robot, posture, ground=None, leg=LEG, **asked):
    return LegClearance(robot, posture, leg, T_SITE_BASE, ground, **asked)


def in_site(robot, posture):
    return {name: T_SITE_BASE @ T for name, T in link_poses(robot, posture).items()}


def frozen_names(robot, leg=LEG):
    payload = [] if robot.description.payload is None else [PAYLOAD]
    return ["base", *payload, *(link_name(other, part) for other in robot.legs if other != leg for part in PARTS)]


@pytest.mark.parametrize("payload", [False, True])
@pytest.mark.parametrize("leg", [0, LEG, 5])
def test_all_that_does_not_move_is_there_in_its_place_with_its_shell(athlete, loaded, posture, payload, leg):
    robot = loaded if payload else athlete
    tables = checks(robot, posture, leg=leg).tables
    names, site, meshes = frozen_names(robot, leg), in_site(robot, posture), robot_meshes(robot.description)
    assert len(tables.frozen) == len(tables.frozen_poses) == len(names)
    for name, pose, (x, y, z, radius, shell) in zip(names, tables.frozen_poses, tables.frozen, strict=True):
        part = name.partition("_")[2] if name not in ("base", PAYLOAD) else name
        T = T_SITE_BASE if name in ("base", PAYLOAD) else site[name]
        assert np.allclose(pose, T[:3], atol=1e-12), name
        assert int(shell) == [*PARTS, "base", PAYLOAD].index(part)
        # a ball around it holds its mesh, and is not much larger
        corners = meshes[part].vertices @ T[:3, :3].T + T[:3, 3]
        away = np.linalg.norm(corners - (x, y, z), axis=1).max()
        assert away <= radius + 1e-9
        assert radius <= 1.2 * away, name
        assert radius == tables.shells[int(shell), REACH]


@pytest.mark.parametrize("extra", [0.0, EXTRA])
def test_the_distances_are_those_of_the_description_with_what_is_asked_more(loaded, posture, extra):
    tables, deltas = checks(loaded, posture, clearance=extra).tables, loaded.description.clearances
    names = frozen_names(loaded)
    assert tables.required.shape == (len(PARTS), len(names))
    for part, row in zip(PARTS, tables.required, strict=True):
        for name, required in zip(names, row, strict=True):
            delta = {"base": deltas.chassis.get(part), PAYLOAD: deltas.payload}.get(name, deltas.other_leg)
            assert required == pytest.approx(-1.0 if delta is None else delta + extra + SLACK, abs=1e-12)
    own = {(PART_OF[pair.part_a], PART_OF[pair.part_b]): pair.distance for pair in deltas.own_leg}
    assert len(tables.own) == len(own)
    for a, b, distance in tables.own:
        assert distance == pytest.approx(own[int(a), int(b)] + extra + SLACK, abs=1e-12)
    assert SLACK == 1e-4


def test_a_rover_without_pairs_of_its_own_leg_has_none(athlete):
    clearances = SimpleNamespace(own_leg=())
    bare: Any = SimpleNamespace(clearances=clearances)
    assert tested._own_pairs(bare, 0.0).shape == (0, 3)


def test_groups_hold_every_frozen_body_once_and_their_balls_hold_what_belongs_to_them(loaded, posture):
    tables = checks(loaded, posture).tables
    covered = []
    for first, last, x, y, z, radius in tables.groups:
        members = range(int(first), int(last))
        covered += members
        reached = [
            np.linalg.norm(tables.frozen[i, :3] - (x, y, z)) + tables.frozen[i, 3] + tables.required[:, members].max()
            for i in members
        ]
        assert radius == pytest.approx(max(reached), abs=1e-12)
        assert np.allclose((x, y, z), tables.frozen[list(members), :3].mean(axis=0))
    assert covered == list(range(len(tables.frozen)))
    assert [int(last - first) for first, last in tables.groups[:, :2]] == [1, 1, *[len(PARTS)] * 5]


def test_where_nothing_is_below_it_a_leg_has_no_balls(athlete, posture):
    tables = checks(athlete, posture).tables
    assert (tables.balls.shape, tables.radii.shape, tables.ground.shape) == ((0, 5), (0,), (0,))
    assert tables.ground_layout.shape == (1, 11)
    assert tables.trees.shape == (2, len(PARTS), 2)
    assert not tables.trees.any()


def test_every_ball_has_the_next_larger_table_and_every_part_its_balls(athlete, posture, ground):
    tables = checks(athlete, posture, ground, clearance=EXTRA).tables
    terrain = athlete.description.clearances.terrain
    covers = tested._covers(tested._ByDigest(athlete.description))
    begin, seen = 0, {}
    for part in (*PARTS, TOUCHING_WHEEL):
        tree = covers[part]
        end = begin + len(tree.radii)
        rows = tables.balls[begin:end]
        assert np.array_equal(rows[:, :3], tree.centers)
        # the wheel that touches needs no distance
        needed = tree.radii + SLACK + (0.0 if part == TOUCHING_WHEEL else terrain[part] + EXTRA)
        chosen = rows[:, 3].astype(int)
        for radius, table in zip(needed, chosen, strict=True):
            assert tables.radii[table] >= radius - 1e-12
            assert table == 0 or tables.radii[table - 1] < radius
            assert (1 - 0.02) * tables.radii[table] <= radius + 1e-12
        assert np.array_equal(rows[:, 4], tree.skip + begin)
        seen[part] = (begin, end)
        begin = end
    assert begin == len(tables.balls)
    for part, (mode_true, mode_raised) in zip(PARTS, np.moveaxis(tables.trees, 1, 0), strict=True):
        assert tuple(mode_raised) == seen[part]
        assert tuple(mode_true) == seen[TOUCHING_WHEEL if part == "wheel" else part]
    assert (TRUE_GROUND, RAISED_GROUND) == (0, 1)


def test_tables_of_the_ground_are_as_many_as_their_radii_need(athlete, ground):
    assert np.array_equal(ground.radii, np.sort(ground.radii))
    assert (ground.radii[:-1] <= (1 - 0.02) * ground.radii[1:] + 1e-12).all()
    needed = np.concatenate(tested._required_radii(athlete.description, EXTRA))
    assert ground.radii[-1] == needed.max()
    assert ground.radii[0] >= needed.min()


def test_a_ground_serves_a_clearance_up_to_that_which_it_was_made_for(athlete, posture, ground):
    assert len(checks(athlete, posture, ground, clearance=EXTRA).tables.balls)
    with pytest.raises(InvalidInput, match="smaller clearance") as caught:
        checks(athlete, posture, ground, clearance=EXTRA + 1e-6)
    assert caught.value.details["clearance"] == EXTRA + 1e-6


def test_each_part_reaches_as_far_as_its_shell_and_its_balls(athlete, posture):
    tables, description = checks(athlete, posture).tables, athlete.description
    covers = tested._covers(tested._ByDigest(description))
    for i, part in enumerate(PARTS):
        middle = tables.shells[i, CENTER : CENTER + 3]
        balls = [covers[part].centers, *([covers[TOUCHING_WHEEL].centers] if part == "wheel" else [])]
        away = [np.linalg.norm(center - middle) for centers in balls for center in centers]
        assert tables.reach[i] == pytest.approx(max(tables.shells[i, REACH], *away), abs=1e-12)
        first, last = int(tables.shells[i, FIRST]), int(tables.shells[i, LAST])
        assert last > first


def test_where_the_leg_begins_and_by_how_much_the_ground_is_raised(athlete, posture):
    tables = checks(athlete, posture, raise_terrain=0.2).tables
    hip = T_SITE_BASE @ athlete.description.legs[LEG].T_base_hip
    assert np.allclose(tables.T_site_hip, hip[:3], atol=1e-12)
    assert tables.lift.tolist() == [0.0, 0.2]


def test_the_reach_of_a_leg_is_that_of_its_balls_wherever_its_links_are(athlete, rng):
    """Against the balls themselves at random postures, and no more than what the leg measures stretched out."""
    covers, leg = tested._covers(tested._ByDigest(athlete.description)), athlete.description.legs[0]
    reach, hip = leg_reach(athlete), leg.T_base_hip[:3, 3]
    farthest = 0.0
    for q in rng.uniform(athlete.lower[:6], athlete.upper[:6], (200, 6)):
        poses = leg_link_poses(athlete, q, 0)
        for part in PARTS:
            T = poses[link_name(0, part)]
            centers = covers[part].centers @ T[:3, :3].T + T[:3, 3]
            farthest = max(farthest, float(np.linalg.norm(centers - hip, axis=1).max()))
    assert 0.8 * reach < farthest <= reach
    sizes = {part: np.linalg.norm(tree.centers, axis=1).max() for part, tree in covers.items()}
    parts = [*PARTS, TOUCHING_WHEEL]
    expected = [reached + sizes[part] for part, reached in zip(parts, [*leg.reaches, leg.reaches[-1]], strict=True)]
    assert reach == pytest.approx(max(expected), abs=1e-12)


def test_the_wheel_that_touches_counts_where_its_balls_reach_farthest(athlete, monkeypatch):
    far = {part: SimpleNamespace(centers=np.array([[0.0, 0.0, 0.1]])) for part in PARTS}
    far[TOUCHING_WHEEL] = SimpleNamespace(centers=np.array([[3.0, 4.0, 0.0], [1.0, 0.0, 0.0]]))
    monkeypatch.setattr(tested, "_covers", lambda key: far)
    assert leg_reach(athlete) == pytest.approx(athlete.description.legs[0].reaches[-1] + 5.0, abs=1e-12)
    table = np.zeros((len(PARTS), len(link_shells(athlete.description)[0][0])))
    assert tested._reaches(athlete.description, table) == pytest.approx(
        [5.0 if part == "wheel" else 0.1 for part in PARTS], abs=1e-12
    )


def test_what_is_asked_for_by_its_description_is_what_the_check_is_given(athlete, posture):
    tables, (table, points) = checks(athlete, posture).tables, link_shells(athlete.description)
    assert np.array_equal(tables.shells, table)
    assert np.array_equal(tables.points, points)
    assert leg_covers(athlete.description).keys() == {*PARTS, TOUCHING_WHEEL}


def test_without_a_word_nothing_more_is_kept_raised_or_asked_of_the_drum(athlete, dem, posture, ground):
    plain = checks(athlete, posture, ground).tables
    told = checks(athlete, posture, ground, clearance=0.0, raise_terrain=0.0, drum=False).tables
    for one, other in zip(plain, told, strict=True):
        assert np.array_equal(one, other)
    assert not plain.drums.any()
    assert plain.drums.shape == checks(athlete, posture, drum=True).tables.drums.shape == (2, MOST + 1)
    assert not checks(athlete, posture, drum=True).tables.drums.any()
    drums = checks(athlete, posture, ground, clearance=EXTRA, drum=True).tables.drums
    assert np.array_equal(drums, wheel_drums(athlete.description, ground, EXTRA))
    least = clearance_ground(athlete, dem.heights, dem.geometry)
    whole = clearance_ground(athlete, dem.heights, dem.geometry, 0.0, None, np.inf)
    assert np.array_equal(least.radii, whole.radii)
    assert np.array_equal(least.cells, whole.cells)
    assert least.radii[-1] == np.concatenate(tested._required_radii(athlete.description, 0.0)).max()


def test_certified_is_asked_over_the_raised_ground_unless_another_is_named(athlete, posture, ground):
    q = posture[None, 6 * LEG : 6 * LEG + 6]
    differ = 0
    for height in np.arange(0.6, 1.6, 0.04):
        leg = LegClearance(athlete, posture, LEG, transform(translation=(0, 0, height)), ground, 0.0, 0.3)
        assert leg.certified(q)[0] == leg.certified(q, "raised")[0]
        differ += leg.certified(q, "true")[0] != leg.certified(q, "raised")[0]
    assert differ > 0


def small_ground(*radii):
    return ground_tables(np.zeros((2, 2)), GridGeometry(0.0, 0.0, 1.0, 2, 2), radii)


@pytest.mark.parametrize("clearance", [0.0, EXTRA])
def test_the_drum_of_each_ground_holds_its_wheel_and_keeps_its_distance(athlete, clearance):
    meshes, delta = robot_meshes(athlete.description), athlete.description.clearances.terrain["wheel"]
    wide = small_ground(0.1, 9.0)
    for mode, name, kept in ((TRUE_GROUND, TOUCHING_WHEEL, 0.0), (RAISED_GROUND, "wheel", delta + clearance)):
        row = wheel_drums(athlete.description, wide, clearance)[mode]
        away = np.abs(meshes[name].vertices - row[CENTER : CENTER + 3])
        out = np.hypot(away[:, 0], away[:, 2]).max()
        assert out <= row[RADIUS] <= 1.04 * out
        assert row[HALF] == pytest.approx(away[:, 1].max(), rel=2e-3)
        assert row[HALF] >= away[:, 1].max() - 1e-12
        assert row[REQUIRED] == pytest.approx(kept + SLACK, abs=1e-12)
        assert row[MOST] == 0.05
        # no more room is told than the ground was made for
        least = float(np.hypot(row[RADIUS], row[HALF]) + row[REQUIRED])
        for more, told in ((0.04, True), (1e-9, True), (-1e-9, False)):
            found = wheel_drums(athlete.description, small_ground(0.1, least + more), clearance)[mode]
            assert found.any() == told
            assert found[MOST] == pytest.approx(max(more, 0.0), abs=1e-12)


def test_a_wheel_that_is_no_drum_is_asked_by_its_balls_alone(athlete, monkeypatch):
    (shell,), points = tested.shells([robot_meshes(athlete.description)["wheel"]])
    wide = small_ground(9.0)
    for disc, inside in ((0.0, points), (shell[tested.DISC], points + 0.1)):
        other = shell.copy()
        other[tested.DISC] = disc
        monkeypatch.setattr(tested, "shells", lambda meshes, one=(other[None], inside): one)
        assert not wheel_drums(athlete.description, wide, 0.0).any()


def test_one_table_serves_radii_that_are_smaller_by_a_share_at_most():
    assert radius_classes(np.array([0.25, 0.5, 1.0, 1.0]), 0.5).tolist() == [1.0, 0.25]
    assert radius_classes(np.array([0.5 - 1e-9, 1.0]), 0.5).tolist() == [1.0, 0.5 - 1e-9]
    assert len(radius_classes(np.array([0.981, 1.0]))) == 1
    assert len(radius_classes(np.array([0.979, 1.0]))) == 2


def test_a_ground_that_was_cut_out_must_hold_all_places_of_the_leg():
    T_site_hip = transform(translation=(3.5, 5.0, 9.0))
    for radius, fits in ((np.inf, True), (7.0, True), (7.0 - 0.9 * SLACK, True), (7.0 - 2 * SLACK, False)):
        # 5 m from (0.5, 1), and 2 m more
        ground: Any = SimpleNamespace(region=np.array([0.5, 1.0, radius]))
        if fits:
            tested._require_region(ground, T_site_hip, 2.0)
            continue
        with pytest.raises(InvalidInput, match="another place") as caught:
            tested._require_region(ground, T_site_hip, 2.0)
        assert caught.value.details == {
            "around": [0.5, 1.0],
            "within": radius,
            "hip": [3.5, 5.0],
            "reach": 2.0,
        }


def test_only_six_joints_a_row_and_known_grounds_are_taken(athlete, posture):
    leg = checks(athlete, posture)
    for wrong in (posture[:6], posture[None, :5], posture[None, :7], posture[None, None, :6]):
        with pytest.raises(InvalidInput, match="n × 6") as caught:
            leg.certified(wrong)
        assert caught.value.details["shape"] == list(np.shape(wrong))
    with pytest.raises(InvalidInput, match="none, true, raised"):
        leg.certified(posture[None, :6], "soft")
    assert leg.certified(np.zeros((0, 6))).shape == (0,)
    assert MODES == {"none": NO_GROUND, "true": TRUE_GROUND, "raised": RAISED_GROUND}


def test_the_ground_counts_where_there_is_one(athlete, posture, ground):
    """Buried, a leg is clear of what it does not know of only."""
    deep = transform(translation=(0.0, 0.0, -1.0))
    q = posture[None, 6 * LEG : 6 * LEG + 6]
    over = LegClearance(athlete, posture, LEG, deep, ground)
    assert over.certified(q, "none").all()
    assert not over.certified(q, "true").any()
    assert not over.certified(q, "raised").any()
    without = LegClearance(athlete, posture, LEG, deep)
    assert all(without.certified(q, mode).all() for mode in MODES)


def test_a_description_is_known_by_its_content(athlete, loaded):
    one, again = tested._ByDigest(athlete.description), tested._ByDigest(athlete.description)
    assert one == again
    assert hash(one) == hash(again)
    assert one != tested._ByDigest(loaded.description)
    assert one != athlete.description
    assert tested._covers(one) is tested._covers(again)
