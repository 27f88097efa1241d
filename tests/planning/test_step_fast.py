"""The compiled parts of step planning: they answer as the meshes do, and find and shorten paths that are free."""

import itertools
import subprocess
import sys
from dataclasses import replace
from functools import partial

import coal
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.steps.families import problem
from benchmarks.steps.problem import build
from benchmarks.steps.search import Posed, pose
from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.torque_candidates import torque_ratios_in_the_air
from footfall.balance.torques import torque_check
from footfall.core.frames import transform
from footfall.core.value import flatten, unflatten
from footfall.planning.answers import Status
from footfall.planning.body.stand import stand
from footfall.planning.joint_path import largest_change, length, samples
from footfall.planning.latest_results import LatestResults
from footfall.planning.scene import ground_tiles
from footfall.planning.scene.certificate import Certificate
from footfall.planning.scene.ground import Nearby
from footfall.planning.scene.leg_free_kernel import balance_bend, balanced_span, edge_is_sure, margin_at
from footfall.planning.scene.lift import vertical
from footfall.planning.scene.solids import FAR
from footfall.planning.step.footing import LegStance, ground_near
from footfall.planning.step.plan import plan_step
from footfall.planning.step.problem import StepSettings
from footfall.planning.step.search.edges import Space
from footfall.planning.step.search.fast import fast
from footfall.planning.step.search.sbl_kernel import (
    AROUND,
    COUNT,
    GROWING,
    HALFWAY,
    JOINED,
    MOST_TURNS,
    TURNED,
    grow,
    planted,
    route,
)
from footfall.planning.step.search.shortcut_kernel import shortened
from footfall.planning.step.situation import NO_GROUND, RAISED, TRUE, Situation
from footfall.planning.step.verify import SAMPLING, recheck
from footfall.robot.description import PARTS, with_payload
from footfall.robot.kinematics import link_poses
from footfall.robot.meshes.bvh import bvh
from footfall.robot.meshes.collision import CollisionScene
from footfall.robot.model import Robot
from footfall.robot.proof.clearance import MODES
from footfall.robot.proof.leg_clearance_kernel import place_leg
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import from_heights
from tests.support.chassis_ground import wavy

TARGET = (1.95, 0.55)
ground = partial(wavy, half=4.0, resolution=0.05)


@pytest.fixture(scope="module")
def rocky(athlete):
    dem = ground([(2.15, 0.33, 0.12, 0.4)], seed=3)
    return dem, stand(athlete, ground([(2.15, 0.33, 0.12, 0.4)]))


def situation_of(robot, dem, state, leg=0, **asked):
    near = ground_near(LegStance(robot, dem, state, leg))
    assert isinstance(near, Nearby)
    return Situation(robot, dem, state, leg, near, StepSettings(**asked))


def scene_of(situation):
    s = situation.settings
    return CollisionScene(
        situation.robot,
        situation.state.posture,
        situation.leg,
        situation.T_site_base,
        situation.ground.mesh,
        s.clearance,
        s.raise_terrain,
    )


def postures(situation, rng, count):
    """Near the stance, some where they stand, and anywhere in the limits."""
    base = np.array(situation.state.leg(situation.leg)) - (0, 0.25, 0, 0, 0, 0)
    spread = rng.choice((0.05, 0.3), (count, 1))
    near = np.clip(base + rng.normal(0, 1, (count, 6)) * spread, situation.lower, situation.upper)
    return np.concatenate([near, rng.uniform(situation.lower, situation.upper, (count // 2, 6))])


def posed(q, certificate):
    poses = np.empty((len(PARTS), 3, 4))
    place_leg(q, certificate.clearance.T_site_hip, certificate.clearance.lengths, poses)
    return poses


def lifted(situation):
    """The leg straight above where it stands."""
    q = np.array(situation.state.leg(situation.leg))
    up = vertical(situation.robot, situation.leg, situation.T_site_base, q, 0.2)
    assert not isinstance(up, str)
    return up[-1]


def space_of(situation, sure=True):
    return Space(
        situation.lower,
        situation.upper,
        lambda q: situation.free(q, RAISED),
        0.01,
        first_unsure=(lambda qs: situation.first_unsure(qs, RAISED)) if sure else lambda qs: 0,
    )


# --- the same answers ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("leg", "hole", "load", "asked"),
    [
        (0, None, False, {}),
        (0, (1.7, 0.2, 0.25), False, {"clearance": 0.02}),
        (3, None, True, {"conservative": True, "least_margin": 0.01}),
        (1, None, False, {"raise_terrain": 0.0, "least_margin": 0.3}),
    ],
)
def test_the_verdicts_are_those_of_the_meshes_with_few_questions_to_them(athlete, rng, leg, hole, load, asked):
    rover = Robot(with_payload(athlete.description, 200.0)) if load else athlete
    dem = ground([(2.15, 0.33, 0.12, 0.4), (-2.2, -0.4, 0.12, 0.4)], hole)
    situation = situation_of(rover, dem, stand(rover, ground()), leg, **asked)
    scene = scene_of(situation)
    certificate = situation.footing.certificate
    free = sure = asked_about = 0
    for terrain in (TRUE, RAISED):
        for q in postures(situation, rng, 150):
            expected = not scene.collides(q, terrain) and situation.margin(q) >= situation.settings.least_margin
            assert situation.collides(q, terrain) == scene.collides(q, terrain)
            before = situation.mesh_queries
            assert situation.free(q, terrain) == expected
            free += expected
            asked_about += expected and situation.mesh_queries > before
            sure += expected and certificate.first_unsure(q[None], terrain) == 1
            if certificate.first_unsure(q[None], terrain) == 1:
                assert expected
                assert certificate.clear(q[None], terrain).all()
    assert free > 10
    assert sure > 0.85 * free
    assert asked_about == free - sure


def test_the_compiled_margin_is_that_of_pin(athlete, rocky, rng):
    dem, state = rocky
    for conservative in (False, True):
        situation = situation_of(athlete, dem, state, 4, conservative=conservative)
        certificate = situation.footing.certificate
        for q in postures(situation, rng, 20):
            found = margin_at(posed(q, certificate), certificate.body)
            assert found == pytest.approx(situation.margin(q), abs=1e-9)


def test_along_a_balanced_span_the_margin_is_kept(athlete, rocky, rng):
    dem, state = rocky
    free = situation_of(athlete, dem, state, 4)
    cut = 0
    for q in postures(free, rng, 40):
        least = free.margin(q) - rng.choice([0.001, 0.01])
        certificate = situation_of(athlete, dem, state, 4, least_margin=max(least, 0.0)).footing.certificate
        d = rng.normal(0, 1, 6)
        arguments = posed(q, certificate), d, balance_bend(d, certificate.clearance.lengths, certificate.body)
        found = balanced_span(*arguments, 0.5, certificate.body)
        assert found >= 0.0 or least < 0.0
        cut += 0.0 < found < 0.5
        for s in (-found, found, *rng.uniform(-found, found, 5)) if found >= 0.0 else ():
            assert free.margin(q + s * d) >= max(least, 0.0)
    assert cut > 20


def test_outside_limits_and_off_balance_nothing_is_sure(athlete, rocky):
    dem, state = rocky
    q = lifted(situation_of(athlete, dem, state))
    assert situation_of(athlete, dem, state).first_unsure(q[None], RAISED) == 1
    assert situation_of(athlete, dem, state, least_margin=3.0).first_unsure(q[None], RAISED) == 0
    assert situation_of(athlete, dem, state).first_unsure(q[None] + np.eye(6)[:1] * 9, RAISED) == 0
    assert situation_of(athlete, dem, state).first_unsure(np.full((1, 6), np.nan), RAISED) == 0


@given(seed=st.integers(0, 10_000))
def test_what_is_sure_changes_no_answer_about_an_edge(seed):
    rng = np.random.default_rng(seed)
    discs = np.column_stack([rng.uniform(-1, 1, (4, 2)), rng.uniform(0.05, 0.4, 4)])

    def free(q):
        return bool((np.hypot(*(discs[:, :2] - q).T) > discs[:, 2]).all())

    def first_unsure(qs):
        away = np.hypot(*(discs[:, None, :2] - qs).transpose(2, 0, 1)) - discs[:, None, 2]
        unsure = np.flatnonzero((away.min(axis=0) <= 0.1) | (np.abs(qs) > 1).any(axis=1))
        return int(unsure[0]) if len(unsure) else len(qs)

    asked = []
    slow = Space(-np.ones(2), np.ones(2), free)
    quick = Space(-np.ones(2), np.ones(2), lambda q: asked.append(q) or free(q), first_unsure=first_unsure)
    path = rng.uniform(-1.05, 1.05, (4, 2))
    for a, b in itertools.pairwise(path):
        assert quick.edge_is_free(a, b) == slow.edge_is_free(a, b)
        assert quick.first_blocked(a, b) == slow.first_blocked(a, b)
    assert quick.path_is_free(path) == slow.path_is_free(path)
    assert quick.checked == slow.checked
    assert len(asked) <= quick.checked


# --- ground in tiles ------------------------------------------------------------------------------------------------


def test_tiles_are_the_ground_as_far_as_distances_tell(athlete, rocky, rng):
    situation = situation_of(athlete, *rocky)
    tiles, whole = situation.ground.tiles, bvh(situation.ground.mesh)
    ball = bvh(athlete.description.meshes["leg0_wheel"])
    middle = situation.ground.dem.geometry.centers().reshape(-1, 2).mean(axis=0)
    request = coal.DistanceRequest()
    for _ in range(12):
        at = np.append(middle + rng.uniform(-1.5, 1.5, 2), rng.uniform(0.4, 0.8))
        T = coal.Transform3s(np.eye(3), at)
        expected = coal.distance(ball, T, whole, coal.Transform3s(), request, coal.DistanceResult())
        corners = athlete.description.meshes["leg0_wheel"].vertices + at
        bounds = tiles.distances(corners.min(axis=0)[None], corners.max(axis=0)[None])[0]
        found = []
        for tile, bound in enumerate(bounds):
            if bound > expected + 0.3:
                continue
            shape, T_site_tile = tiles.shape(tile)
            T_tile = coal.Transform3s(T_site_tile[:3, :3], T_site_tile[:3, 3])
            found.append(coal.distance(ball, T, shape, T_tile, request, coal.DistanceResult()))
            assert found[-1] >= bound - 1e-9
        assert min(found) == pytest.approx(expected, abs=1e-9)
    triangles = sum(tiles.shape(i)[0].num_tris for i in range(len(bounds)))
    assert triangles == len(situation.ground.mesh.triangles)


def test_crops_of_one_map_share_tiles(athlete, rocky):
    dem, _ = rocky
    crop = ground_tiles.GroundTiles(dem)
    every = {id(crop.shape(i)[0]) for i in range(49)}
    shifted = replace(
        dem,
        heights=np.ascontiguousarray(dem.heights[7:, 11:]),
        geometry=replace(
            dem.geometry, x0=dem.geometry.x0 + 0.55, y0=dem.geometry.y0 + 0.35, rows=161 - 7, cols=161 - 11
        ),
    )
    other = ground_tiles.GroundTiles(shifted)
    shared = sum(id(other.shape(i)[0]) in every for i in range(49))
    assert shared >= 25


def test_reports_about_the_ground_are_those_of_the_scene(athlete, rocky, rng):
    situation = situation_of(athlete, *rocky)
    scene, over_ground = scene_of(situation), situation.footing.over_ground
    reported = 0
    for q in postures(situation, rng, 80):
        for terrain, lift in ((TRUE, 0.0), (RAISED, 0.15)):
            expected = [hit for hit in scene.contacts(q, terrain) if hit.link_b == "terrain"]
            found = over_ground.contacts(q, lift, terrain == TRUE)
            reported += len(found)
            touched, expected_touched = (
                {hit.link_a: hit for hit in hits if hit.distance >= 0} for hits in (found, expected)
            )
            assert touched.keys() == expected_touched.keys()
            for link, hit in touched.items():
                assert hit.distance == pytest.approx(expected_touched[link].distance, abs=1e-6)
                assert hit.required == expected_touched[link].required
            # of a link that cuts the surface it is moot whether its middle is above
            below, expected_below = (
                {h.link_a for h in hits if h.distance < 0} - touched.keys() for hits in (found, expected)
            )
            assert below == expected_below
    assert reported > 40


def test_the_margins_are_the_least_distances_of_all_pairs(athlete, rocky, rng):
    dem, state = rocky
    situation = situation_of(athlete, dem, state)
    deltas, meshes = athlete.description.clearances, athlete.description.meshes
    whole, request = bvh(situation.ground.mesh), coal.DistanceRequest()

    def apart(a, T_a, b, T_b):
        poses = (coal.Transform3s(T[:3, :3], T[:3, 3]) for T in (T_a, T_b))
        return max(coal.distance(a, next(poses), b, next(poses), request, coal.DistanceResult()), 0.0)

    qs = lifted(situation) + rng.normal(0, 0.1, (3, 6))
    ground, rover = [], []
    for q in qs:
        poses = link_poses(athlete, situation.posture(q))
        for part in PARTS:
            shape, T = bvh(meshes[f"leg0_{part}"]), poses[f"leg0_{part}"]
            ground.append(apart(shape, situation.T_site_base @ T, whole, np.eye(4)) - deltas.terrain[part])
            if part in deltas.chassis:
                rover.append(apart(shape, T, bvh(meshes["base"]), poses["base"]) - deltas.chassis[part])
            for leg in range(1, 6):
                for other in PARTS:
                    link = f"leg{leg}_{other}"
                    rover.append(apart(shape, T, bvh(meshes[link]), poses[link]) - deltas.other_leg)
        for pair in deltas.own_leg:
            a, b = (f"leg0_{part}" for part in (pair.part_a, pair.part_b))
            rover.append(apart(bvh(meshes[a]), poses[a], bvh(meshes[b]), poses[b]) - pair.distance)
    assert situation.footing.over_ground.gap(qs, 0.0, touching=False)[1].spare == pytest.approx(min(ground), abs=1e-6)
    assert min(rover) < FAR
    assert situation.footing.solids.own_gap(qs)[1].spare == pytest.approx(min(rover), abs=1e-6)


def test_a_step_builds_the_ground_it_comes_near_to(athlete):
    dem = ground(seed=8, resolution=0.02)
    state = stand(athlete, ground())
    ground_tiles._hierarchy.cache_clear()
    result = plan_step(athlete, dem, state, 0, (2.05, 0.45), planner="line")
    assert result.status is Status.FOUND, result.reason
    near = ground_near(LegStance(athlete, dem, state, 0))
    assert isinstance(near, Nearby)
    every = near.tiles.distances(np.zeros((1, 3)), np.zeros((1, 3))).shape[1]
    assert 0 < ground_tiles._hierarchy.cache_info().misses < every / 3


# --- torque ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("friction", [0.6, 0.05])
def test_torque_ratios_of_many_postures_are_those_of_each(athlete, rng, friction):
    x = np.arange(-4, 4.01, 0.1)
    dem = from_heights((0.15 * np.meshgrid(x, x)[0]).astype(np.float32), 0.1, -4, -4, "slope")
    state = stand(athlete, dem)
    situation = situation_of(athlete, dem, state, 2)
    qs, feet = postures(situation, rng, 12), situation.footing.feet
    balance = BalanceSettings(friction=friction)
    found = torque_ratios_in_the_air(
        athlete, np.asarray(state.posture), situation.T_site_base, situation.others, feet.normals, 2, qs, balance
    )
    for q, ratio in zip(qs, found, strict=True):
        check = torque_check(
            athlete, situation.posture(q), situation.T_site_base, situation.others, feet.normals, balance
        )
        assert ratio == pytest.approx(check.ratio, rel=1e-7)
    assert np.isinf(found).all() == (friction == 0.05)


# --- the compiled search --------------------------------------------------------------------------------------------


def grown(situation, start, goal, seed, milestones=3000):
    trees, certificate = planted(start, goal, milestones), situation.footing.certificate
    rng, outcome = np.random.Generator(np.random.PCG64(seed)), GROWING
    while outcome == GROWING:
        outcome = grow(trees, rng, 0.4, 0.01, 16, certificate.clearance, certificate.body, MODES[RAISED])
        yield trees, outcome


@pytest.fixture(scope="module")
def narrow(athlete):
    """A swing past a rock that the straight line does not pass."""
    dem = ground([(2.15, 0.33, 0.12, 0.4)])
    situation = situation_of(athlete, dem, stand(athlete, dem))
    start, space, rng = lifted(situation), space_of(situation), np.random.default_rng(11)
    assert space.is_sure(start)
    for _ in range(5000):
        goal = start + rng.uniform(-1, 1, 6) * (1.0, 0.4, 0.4, 0.2, 0.4, 0.2)
        if np.abs(goal - start)[0] > 0.5 and space.is_sure(goal) and not space.edge_is_free(start, goal):
            return situation, start, goal
    pytest.fail("no blocked swing was found")


@pytest.mark.parametrize("seed", range(4))
def test_trees_stay_trees(narrow, seed):
    situation, start, goal = narrow
    outcome, trees = GROWING, planted(start, goal, 1)
    for trees, outcome in grown(situation, start, goal, seed):  # noqa: B007
        count = trees.numbers[COUNT]
        for i in range(count):
            root, steps = i, 0
            while trees.parent[root] >= 0:
                root, steps = trees.parent[root], steps + 1
                assert steps < count
            assert root == trees.side[i]
        assert [trees.tally[side].sum() for side in (0, 1)] == [(trees.side[:count] == side).sum() for side in (0, 1)]
    assert outcome == JOINED
    path = route(trees)
    assert np.array_equal(path[0], start)
    assert np.array_equal(path[-1], goal)
    exact = space_of(situation, sure=False)
    assert exact.path_is_free(path)


def test_the_first_milestones_are_sure_and_around_the_middle_of_start_and_goal(narrow):
    situation, start, goal = narrow
    middle, reach = (start + goal) / 2, AROUND * 0.4
    placed = 0
    for seed in range(8):
        *_, (trees, _) = grown(situation, start, goal, seed)
        first = trees.q[2 : min(trees.numbers[COUNT], HALFWAY)]
        placed += len(first)
        assert (np.abs(first - middle) <= reach + 1e-12).all()
        assert situation.first_unsure(first, RAISED) == len(first)
    assert placed >= 8


@pytest.fixture(scope="module")
def past_a_plate():
    """A swing past a plate that hangs from the deck: without turns each search of 1000 milestones fails."""
    asked = problem("past a hanging plate", 27)
    posed = pose(asked, build(asked))
    assert isinstance(posed, Posed)
    return posed.situation, posed.up[-1], posed.downs[0][-1]


@pytest.mark.parametrize("seed", range(4))
def test_what_a_turn_joins_differs_in_the_first_joint_and_is_free_all_the_way(past_a_plate, seed):
    situation, start, goal = past_a_plate
    *_, (trees, outcome) = grown(situation, start, goal, seed, 200)
    assert outcome == JOINED
    exact = space_of(situation, sure=False)
    assert exact.path_is_free(route(trees))
    q, turned = trees.q[: trees.numbers[COUNT]], 0
    for a, b in itertools.pairwise(q[2:]):
        if np.array_equal(a[1:], b[1:]):
            turned += 2
            assert {a[0], b[0]} == {start[0], goal[0]}
            assert exact.edge_is_free(a, b)
    assert turned == trees.numbers[TURNED] > 0
    assert turned <= MOST_TURNS * len(q) + 2


@pytest.mark.parametrize("seed", range(3))
def test_shortcuts_keep_the_ends_and_stay_free(narrow, seed):
    situation, start, goal = narrow
    *_, (trees, _) = grown(situation, start, goal, seed)
    path, certificate = route(trees), situation.footing.certificate
    rng = np.random.Generator(np.random.PCG64(seed))
    arguments = (certificate.clearance, certificate.body, MODES[RAISED])
    kept = shortened(path, rng, 0, 0.01, *arguments)
    found = shortened(path, rng, 60, 0.01, *arguments)
    assert length(found) <= length(kept) <= length(path)
    assert length(found) < 0.9 * length(path)
    for out in (kept, found):
        assert np.array_equal(out[0], start)
        assert np.array_equal(out[-1], goal)
        # finer than it was checked, by the meshes: what is cut between two checked places is less than a check asks
        for a, b in itertools.pairwise(out):
            assert all(situation.free(q, RAISED) for _, q in samples(a, b, 0.004))


def test_a_compiled_edge_is_free_for_the_meshes_and_blocked_where_something_is_unsure(narrow, rng):
    situation, start, goal = narrow
    certificate, space = situation.footing.certificate, space_of(situation, sure=False)
    answers = []
    while len(answers) < 60:
        a, b = start + rng.normal(0, 0.2, 6), goal + rng.normal(0, 0.2, 6)
        if situation.first_unsure(np.array([a, b]), RAISED) < 2:
            continue
        found = edge_is_sure(a, b, 0.01, certificate.clearance, certificate.body, MODES[RAISED])
        dense = a + np.linspace(0, 1, parts := int(np.ceil(largest_change(a, b) / 0.0005)))[:, None] * (b - a)
        assert found or situation.first_unsure(dense, RAISED) < parts
        # half as far apart as the search looks
        assert not found or all(space.is_free(q) for q in dense[::10])
        answers.append(found)
    assert 0 < sum(answers) < 60
    nowhere = certificate.clearance, certificate.body, MODES[RAISED]
    assert edge_is_sure(start, start, 0.01, *nowhere)


def search(narrow, seed=1, milestones=3000, start=None, space=None):
    situation, first, goal = narrow
    space = space or space_of(situation)
    return fast(
        space,
        situation.footing.certificate,
        first if start is None else start,
        goal,
        radius=0.4,
        milestones=milestones,
        seed=seed,
    )


def test_same_seed_same_path_and_another_seed_another(narrow):
    first, again, other = search(narrow), search(narrow), search(narrow, seed=2)
    assert not isinstance(first, str)
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    assert space_of(narrow[0], sure=False).path_is_free(first)


def test_too_few_milestones_are_told(narrow):
    found = search(narrow, milestones=1)
    assert isinstance(found, str)
    assert "1 milestones" in found


def test_from_an_unsure_start_the_search_escapes(narrow):
    situation, start, _ = narrow

    def first_unsure(qs):
        here = np.flatnonzero((qs == start).all(axis=1))
        return min(situation.first_unsure(qs, RAISED), int(here[0]) if len(here) else len(qs))

    space = Space(
        situation.lower, situation.upper, lambda q: situation.free(q, RAISED), 0.01, first_unsure=first_unsure
    )
    path = search(narrow, space=space)
    assert not isinstance(path, str)
    assert np.array_equal(path[0], start)
    assert 0 < largest_change(path[0], path[1]) <= 0.4
    assert space_of(situation, sure=False).path_is_free(path)
    blind = Space(situation.lower, situation.upper, lambda q: situation.free(q, RAISED), 0.01)
    assert "start" in search(narrow, space=blind)


# --- whole plans ----------------------------------------------------------------------------------------------------


def test_a_plan_is_the_same_cold_warm_and_in_another_process(athlete):
    code = (
        "import numpy as np, footfall\n"
        "from footfall.terrain.from_arrays import from_heights\n"
        "x=np.arange(-4,4.025,.05); X,Y=np.meshgrid(x,x)\n"
        "h=.4*np.sqrt(np.maximum(0,1-((X-2.15)**2+(Y-.33)**2)/.12**2))\n"
        "dem=from_heights(h.astype(np.float32),.05,-4.,-4.,'rock'); r=footfall.load_robot('athlete')\n"
        "print(footfall.plan_step(r,dem,footfall.stand(r,dem),leg=0,target=(1.95,.55),planner='fast',seed=4).digest)"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()
    x = np.arange(-4, 4.025, 0.05)
    X, Y = np.meshgrid(x, x)
    heights = 0.4 * np.sqrt(np.maximum(0, 1 - ((X - 2.15) ** 2 + (Y - 0.33) ** 2) / 0.12**2))
    dem = from_heights(heights.astype(np.float32), 0.05, -4.0, -4.0, "rock")
    state = stand(athlete, dem)
    for _ in range(2):
        result = plan_step(athlete, dem, state, 0, TARGET, planner="fast", seed=4)
        assert result.status is Status.FOUND, result.reason
        assert result.digest == out


def test_another_ground_is_not_mistaken_for_the_last(athlete):
    """What is kept of a stance belongs to its ground: a rock put in the way is seen."""
    open_dem, rock_dem = ground(), ground([(2.15, 0.33, 0.12, 0.4)])
    state = stand(athlete, open_dem)
    answers = [plan_step(athlete, dem, state, 0, TARGET, planner="line") for dem in (open_dem, rock_dem, open_dem)]
    assert [answer.status for answer in answers] == [Status.FOUND, Status.NO_PATH, Status.FOUND]
    copies = [unflatten(*flatten(one)) for one in (open_dem, state)]
    assert isinstance(copies[0], Dem)
    assert isinstance(copies[1], RobotState)
    same = LegStance(athlete, open_dem, state, 0), LegStance(athlete, copies[0], copies[1], 0)
    assert same[0].content == same[1].content
    assert ground_near(same[0]) is ground_near(same[1])


def test_large_ground_and_ground_with_holes_are_prepared_for_one_leg(athlete):
    """Both ways to prepare the ground say the same of the same places."""
    small = ground([(2.15, 0.33, 0.12, 0.4)])
    state = stand(athlete, small)
    wide = np.pad(small.heights, 60)
    large = from_heights(wide, 0.05, -7.0, -7.0, "large")
    near = [situation_of(athlete, dem, state) for dem in (small, large)]
    rng = np.random.default_rng(2)
    qs = np.concatenate([postures(near[0], rng, 200), postures(near[0], rng, 200)])
    for terrain in (TRUE, RAISED, NO_GROUND):
        answers = [one.footing.certificate.clear(qs, terrain) for one in near]
        assert np.array_equal(answers[0], answers[1])
    assert isinstance(near[0].footing.certificate, Certificate)
    assert np.allclose(near[0].T_site_base, transform(near[1].T_site_base[:3, :3], near[1].T_site_base[:3, 3]))


def test_the_last_results_are_kept_and_nothing_else():
    made = []
    kept = LatestResults(2)
    for content in ("a", "b", "a", "c", "a", "b"):
        assert kept.get(content, lambda content=content: made.append(content) or content.upper()) == content.upper()
    assert made == ["a", "b", "c", "b"]


@pytest.mark.parametrize("seed", range(4))
def test_the_recheck_says_what_the_meshes_say_at_every_sample(athlete, rocky, seed):
    """A plan bent more and more: the clearance checks hold where every sample of the path is free for the meshes."""
    dem, state = rocky
    plan = plan_step(athlete, dem, state, 0, TARGET, seed=seed).plan
    assert plan is not None
    situation = situation_of(athlete, dem, state)
    solids, over_ground, rng = situation.footing.solids, situation.footing.over_ground, np.random.default_rng(seed)
    swing = [i for i, phase in enumerate(plan.phases) if phase == "swing"][:-1]
    answers = set()
    for size in (0.0, 0.05, 0.15, 0.3, 0.5):
        bent = plan.waypoints.copy()
        bent[swing, :6] += rng.normal(0, size, (len(swing), 6))
        holds = [check.holds for check in recheck(situation, dem, bent, plan.phases)[1:4]]
        qs, phases = bent[:, :6], np.array(plan.phases[1:])
        dense = [np.array([q for _, q in samples(a, b, SAMPLING)]) for a, b in itertools.pairwise(qs)]
        own = all(solids.own_collision(part) is None for part in dense)
        ground_free = [
            all(
                over_ground.collision(part, lift, touching) is None
                for part, its in zip(dense, phases, strict=True)
                if its in which
            )
            for which, lift, touching in ((("lift", "lower"), 0.0, True), (("swing",), 0.15, False))
        ]
        assert holds == [own, *ground_free]
        answers.add(tuple(holds))
    assert (True, True, True) in answers
