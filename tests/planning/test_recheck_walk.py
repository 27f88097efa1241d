"""The recheck of a walk: a good one passes by other means too, and each check refuses what was broken on purpose."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import footfall
from footfall.balance.forces import distribute
from footfall.balance.support import margins
from footfall.balance.torques import torque_margin
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, rotation, transform
from footfall.core.value import fields_of
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.walk.problem import LIFT, SWING, Place, Stance, WalkGoal, WalkPlan
from footfall.planning.walk.recheck.apart import MovingBody, distance, nearest
from footfall.planning.walk.recheck.clearances import LOCKED, ClearanceCheck
from footfall.planning.walk.recheck.holding import friction_margin, pyramids
from footfall.planning.walk.recheck.recheck_settings import RecheckSettings
from footfall.planning.walk.recheck.stretches import MotionStretch, stretches
from footfall.planning.walk.recheck.walk import recheck_walk
from footfall.robot.description import with_payload
from footfall.robot.ik import contact_point, solve_leg
from footfall.robot.kinematics import center_of_mass, link_poses, wheel_pose
from footfall.robot.meshes import shapes
from footfall.robot.meshes.collision import TERRAIN, posture_collisions
from footfall.robot.model import Robot
from footfall.terrain.ground.triangulate import triangulate
from footfall.terrain.rocks import add_rocks
from tests.support.chassis_ground import wavy
from tests.support.walks import BY_HAND, FootMove, walk_by_hand

ROOM = Path(footfall.__file__).parent / "planning" / "walk" / "recheck"
COARSE = RecheckSettings(way=0.01, turn=0.01, hold=0.5)
"""For what a broken walk shows at its waypoints."""
MOVES = (
    FootMove(BodyShift(0.05, 0.0, -0.4, 0.0, 0.02, 0.03), 0, (0.0, 0.8)),
    FootMove(BodyShift(dx=0.1), 3, (0.2, 0.0)),
    FootMove(None, 1, (0.2, 0.0)),
    FootMove(BodyShift(dx=0.05)),
)


@pytest.fixture(scope="module")
def ground():
    return wavy([(1.0, 1.2, 0.3, 0.2)])


@pytest.fixture(scope="module")
def start(athlete, ground):
    return footfall.stand(athlete, ground)


@pytest.fixture(scope="module")
def walk(athlete, ground, start):
    return walk_by_hand(athlete, ground, start, MOVES)


@pytest.fixture(scope="module")
def checks(athlete, ground, start, walk):
    return {one.name: one for one in recheck_walk(athlete, ground, walk, state=start)}


def failed(robot, dem, plan, settings=BY_HAND, every=COARSE, state=None):
    """Names of the checks that fail."""
    return {one.name for one in recheck_walk(robot, dem, plan, settings, every, state=state) if not one.holds}


def changed(plan: WalkPlan, **replaced) -> WalkPlan:
    return replace(plan, **replaced)


def with_joint(plan, waypoint, joint, by):
    waypoints = np.array(plan.waypoints)
    waypoints[waypoint, joint] += by
    return changed(plan, waypoints=waypoints)


def with_waypoint(plan, after, posture):
    """The walk with one more waypoint after another one, of the phase and foot move of the next."""

    def grown(array, row):
        return np.insert(np.asarray(array), after + 1, row, axis=0)

    phases = list(plan.phases)
    phases.insert(after + 1, phases[after + 1])
    return changed(
        plan,
        waypoints=grown(plan.waypoints, posture),
        Ts_site_base=grown(plan.Ts_site_base, plan.Ts_site_base[after]),
        moves=grown(plan.moves, plan.moves[after + 1]),
        phases=tuple(phases),
        margins=grown(plan.margins, plan.margins[after]),
        torques=grown(plan.torques, plan.torques[after]),
    )


def with_stances(plan, change):
    """The walk with every stance as ``change(number, fields)`` makes it; fields: copies of the arrays by name."""
    stances = []
    for number, stance in enumerate(plan.stances):
        fields = {name: np.array(one) for name, one in fields_of(stance).items()}
        change(number, fields)
        stances.append(Stance(**fields))
    return changed(plan, stances=tuple(stances))


def with_description(robot, **replaced) -> Robot:
    return Robot(replace(robot.description, **replaced))


def first(plan, phase, move=0):
    """The first waypoint of a phase of a foot move."""
    return next(i for i in range(1, len(plan.phases)) if plan.phases[i] == phase and plan.moves[i] == move)


def test_a_good_walk_passes(checks, walk):
    assert not [one for one in checks.values() if not one.holds]
    assert set(checks) == {
        "phases",
        "stances",
        "goal",
        "start",
        "contact",
        "joint limits",
        "continuity",
        "support",
        "friction",
        "torque",
        "self collision",
        "terrain collision",
    }
    assert walk.foot_moves == 3


def test_margins_at_waypoints_are_those_of_other_methods(athlete, checks, walk):
    """Support and torque of the whole walk can be no better than what the balance layer finds at any waypoint."""
    assert checks["support"].margin <= walk.margins.min() + 1e-9
    assert checks["support"].margin >= walk.margins.min() - 0.01
    # pyramids of sixteen sides hold at least as much as those of eight, in other directions
    assert 1.0 - checks["torque"].margin == pytest.approx(walk.torques.max(), abs=0.03)


@pytest.mark.parametrize("conservative", [False, True])
def test_polygons_are_those_of_the_balance_layer(athlete, ground, walk, conservative):
    settings = replace(BY_HAND, support="required" if conservative else "ignored")
    found = {one.name: one for one in recheck_walk(athlete, ground, walk, settings, COARSE)}["support"].margin
    own = np.min([_margin(athlete, walk, at, conservative) for at in range(len(walk.phases))])
    # between waypoints the centre of mass may come a little nearer
    assert own - 0.02 <= found <= own + 1e-9


def _margin(robot, plan, at, conservative):
    stance, move = plan.stances[plan.moves[at]], int(plan.moves[at])
    feet = [leg for leg in robot.legs if plan.phases[at] == "body" or leg != plan.legs[move]]
    com_site = apply(plan.Ts_site_base[at], center_of_mass(robot, plan.waypoints[at]))
    return margins(stance.contacts[feet], com_site[None, :2], conservative)[0]


def test_a_payload_counts(athlete, ground, walk):
    """As heavy a load as the rover itself far in front: what the other layers say of it, the recheck says too."""
    loaded = Robot(with_payload(athlete.description, 300.0, (0.4, 0.4, 0.3), (0.8, 0.0, 0.15)))
    found = {one.name: one for one in recheck_walk(loaded, ground, walk, BY_HAND, COARSE)}
    at = len(walk.phases) - 1
    held = torque_margin(
        loaded, walk.waypoints[at], walk.Ts_site_base[at], loaded.legs, walk.stances[-1].normals, BY_HAND.friction
    )
    assert 1.0 - found["torque"].margin >= held.ratio - 0.03
    own = np.min([_margin(loaded, walk, at, False) for at in range(len(walk.phases))])
    assert own - 0.02 <= found["support"].margin <= own + 1e-9


def test_links_are_clear_at_waypoints_by_the_whole_robot_check(athlete, ground, walk):
    for at in range(0, len(walk.phases), 7):
        assert not posture_collisions(athlete, walk.waypoints[at], walk.Ts_site_base[at], triangulate(ground))


@pytest.mark.parametrize(("slid", "seen"), [(0.0005, False), (0.003, True), (0.01, True)])
def test_a_wheel_that_slides_is_seen(athlete, ground, walk, slid, seen):
    """A wheel that keeps its direction, at one waypoint in the middle of a move of the chassis."""
    at, own = first(walk, "body") + 3, slice(12, 18)
    T_base_wheel = wheel_pose(athlete, walk.waypoints[at], 2)
    T_base_wheel[0, 3] += slid
    found = solve_leg(athlete, 2, T_base_wheel[None]).q[0]
    nearest = found[int(np.nanargmin(np.abs(found - walk.waypoints[at, own]).max(axis=1)))]
    waypoints = np.array(walk.waypoints)
    waypoints[at, own] = nearest
    assert failed(athlete, ground, changed(walk, waypoints=waypoints)) == ({"contact"} if seen else set())


def test_a_wheel_that_turns_by_a_degree_is_seen(athlete, ground, walk):
    assert failed(athlete, ground, with_joint(walk, first(walk, "body") + 3, 17, np.deg2rad(1.0))) == {"contact"}


def test_a_wheel_that_slides_while_another_leg_swings_is_seen(athlete, ground, walk):
    """A leg that does not belong to the foot move moves: its wheel slides, and the phase is not what it says."""
    broken = with_joint(walk, first(walk, SWING), 12, 0.01)
    assert failed(athlete, ground, broken) == {"phases"}


@pytest.mark.parametrize("sunk", [-0.08, 0.05])
def test_a_wheel_without_ground_under_it_is_seen(athlete, ground, walk, sunk):
    """Ground that is too high cuts the wheel, too."""
    contact = walk.stances[0].contacts[2]
    grid = ground.geometry
    near = np.hypot(grid.xs - contact[0], (grid.ys - contact[1])[:, None]) < 0.6
    heights = np.where(near, ground.heights + np.float32(sunk), ground.heights)
    moved = replace(ground, heights=heights.astype(np.float32))
    assert failed(athlete, moved, walk) == ({"contact"} if sunk < 0 else {"contact", "terrain collision"})


def test_a_normal_that_the_ground_does_not_have_is_seen(athlete, ground, walk):
    def lean(number, fields):
        fields["normals"][4] = Rotation.from_euler("x", 6.0, degrees=True).apply(fields["normals"][4])

    # the rim's lowest point along it is elsewhere, too
    assert failed(athlete, ground, with_stances(walk, lean)) == {"contact"}


def test_a_limit_that_is_passed_is_seen(athlete, ground, walk):
    upper = np.array(athlete.upper)
    upper[1] = walk.waypoints[:, 1].max() - 0.01
    narrow = with_description(athlete, upper=upper, postures={})
    assert failed(narrow, ground, walk) == {"joint limits"}


def test_support_is_asked_for_as_the_settings_say(athlete, ground, walk, checks):
    settings = replace(BY_HAND, least_margin=checks["support"].margin + 0.01)
    assert failed(athlete, ground, walk, settings) == {"support"}


def test_a_weight_outside_the_feet_is_seen(athlete, ground, walk):
    """A load beside the rover takes the centre of mass out of the polygon; no forces hold that."""
    beside = Robot(with_payload(athlete.description, 5000.0, (0.1, 0.1, 0.1), (2.4, 0.0, 1.0)))
    assert {"support", "friction"} <= failed(beside, ground, walk)


def test_friction_that_does_not_hold_is_seen(athlete, ground, walk):
    assert failed(athlete, ground, walk, replace(BY_HAND, friction=1e-4)) == {"friction"}


def test_a_motor_that_is_too_weak_is_seen(athlete, ground, walk):
    weak = np.array(athlete.torque_limits)
    weak[1] = 100.0
    assert failed(with_description(athlete, torque_limits=weak), ground, walk) == {"torque"}


def test_more_torque_than_asked_for_is_seen(athlete, ground, walk, checks):
    settings = replace(BY_HAND, most_torque=0.99 - checks["torque"].margin)
    assert failed(athlete, ground, walk, settings) == {"torque"}


def test_a_leg_that_swings_into_the_chassis_is_seen(athlete, ground, walk):
    at = first(walk, SWING)
    posture = np.array(walk.waypoints[at - 1])
    posture[0] += 1.5
    assert failed(athlete, ground, with_waypoint(walk, at - 1, posture)) == {"self collision"}


@pytest.mark.parametrize(("above", "seen"), [(-0.06, False), (-0.01, True), (0.06, True)])
def test_a_rock_under_the_swing_is_seen(athlete, ground, walk, above, seen):
    """Only between waypoints: the wheel passes over it, 2 cm away at least."""
    at = first(walk, SWING)
    middle = 0.5 * (walk.waypoints[at - 1] + walk.waypoints[at])
    lowest = contact_point(athlete, middle, 0, walk.Ts_site_base[at])
    x, y = np.rint(lowest[:2] / ground.geometry.resolution) * ground.geometry.resolution
    strewn = add_rocks(ground, [(x, y, 0.25, lowest[2] + above)])
    assert failed(athlete, strewn, walk) == ({"terrain collision"} if seen else set())


def test_ground_under_the_chassis_is_seen(athlete, ground, walk):
    height = walk.Ts_site_base[-1][2, 3] - 0.22
    assert failed(athlete, add_rocks(ground, [(0.2, 0.0, 0.6, height - 0.1)]), walk) == set()
    assert failed(athlete, add_rocks(ground, [(0.2, 0.0, 0.6, height - 0.03)]), walk) == {"terrain collision"}


def test_a_rover_under_the_ground_is_seen(athlete, ground, walk):
    buried = replace(ground, heights=(ground.heights + np.float32(9.0)).astype(np.float32))
    assert failed(athlete, buried, walk) == {"contact", "terrain collision"}


def test_ground_that_nobody_saw_is_not_free(athlete, ground, walk):
    """A hole in a wall is as high as the wall."""
    walled = add_rocks(ground, [(0.2, 0.0, 1.2, 3.0)])
    grid = walled.geometry
    hole = np.hypot(grid.xs - 0.2, grid.ys[:, None]) < 0.45
    holed = replace(walled, heights=np.where(hole, np.float32(np.nan), walled.heights).astype(np.float32))
    assert failed(athlete, holed, walk) == {"terrain collision"}


def test_phases_out_of_order_are_seen(athlete, ground, walk):
    phases = list(walk.phases)
    at = first(walk, "lower")
    phases[at] = LIFT
    assert failed(athlete, ground, changed(walk, phases=tuple(phases))) == {"phases"}


def test_a_foot_move_that_is_left_out_is_seen(athlete, ground, walk):
    moves = np.where(walk.moves >= 1, walk.moves + 1, walk.moves)
    broken = changed(walk, moves=moves, legs=(0, 2, 3, 1), stances=(*walk.stances[:2], *walk.stances[1:]))
    assert failed(athlete, ground, broken) == {"phases"}


def test_a_chassis_that_moves_during_a_step_is_seen(athlete, ground, walk):
    poses = np.array(walk.Ts_site_base)
    poses[first(walk, SWING), 2, 3] += 0.001
    assert failed(athlete, ground, changed(walk, Ts_site_base=poses)) == {"phases"}


def test_stances_that_differ_by_two_feet_are_seen(athlete, ground, walk):
    def creep(number, fields):
        if number >= 2:
            fields["contacts"][5, 0] += 5e-4
            fields["Ts_site_wheel"][5, 0, 3] += 5e-4

    assert failed(athlete, ground, with_stances(walk, creep)) == {"stances"}


def test_a_leg_on_another_branch_is_seen(athlete, ground, walk):
    def turn_over(number, fields):
        fields["branches"][4] ^= 2

    assert failed(athlete, ground, with_stances(walk, turn_over)) == {"continuity"}


def test_another_start_is_seen(athlete, ground, walk, start):
    posture = np.array(start.posture)
    posture[3] += 0.01
    assert failed(athlete, ground, walk, state=replace(start, posture=posture)) == {"start"}
    elsewhere = np.array(start.T_site_base)
    elsewhere[0, 3] += 0.01
    assert failed(athlete, ground, walk, state=replace(start, T_site_base=elsewhere)) == {"start"}


@pytest.mark.parametrize(("dx", "dyaw"), [(0.2, 0.0), (0.0, 0.2), (0.0, 2 * np.pi - 0.2)])
def test_a_goal_that_is_not_reached_is_seen(athlete, ground, walk, dx, dyaw):
    goal = WalkGoal(walk.goal.x + dx, walk.goal.y, (walk.goal.yaw or 0.0) + dyaw)
    assert failed(athlete, ground, changed(walk, goal=goal)) == {"goal"}


def test_places_are_asked_for_as_the_settings_say(athlete, ground, walk):
    x, y, _ = (float(one) for one in walk.stances[1].contacts[0])
    for good, bad in (
        ({"forbidden": (Place(x, y, 0.1, 1),)}, {"forbidden": (Place(x, y, 0.1),)}),
        ({"pinned": (Place(x, y, 0.1, 0),)}, {"pinned": (Place(x, y, 0.1, 1),)}),
    ):
        assert failed(athlete, ground, walk, replace(BY_HAND, **good)) == set()
        assert failed(athlete, ground, walk, replace(BY_HAND, **bad)) == {"footfalls"}


def test_a_walk_of_another_robot_is_misuse(athlete, ground, walk):
    for other in (changed(walk, waypoints=walk.waypoints[:, :30]), changed(walk, legs=(0, 6, 1))):
        with pytest.raises(InvalidInput, match="joints"):
            recheck_walk(athlete, ground, other)


def test_a_walk_that_stays_where_it_is_is_looked_at(athlete, ground, start):
    stays = walk_by_hand(athlete, ground, start, ())
    found = {one.name: one for one in recheck_walk(athlete, ground, stays, state=start)}
    assert all(one.holds for one in found.values())
    assert np.isfinite([found[name].margin for name in ("contact", "support", "friction", "torque")]).all()
    moved = np.array(stays.Ts_site_base)
    moved[0, 0, 3] += 0.01
    assert failed(athlete, ground, changed(stays, Ts_site_base=moved)) == {"contact"}


@given(st.integers(0, 10_000), st.floats(0.0, 0.3))
def test_the_least_distance_along_a_motion_is_that_of_all_samples(seed, asked):
    rng = np.random.default_rng(seed)
    one, other = MovingBody(shapes.box((0.3, 0.2, 0.5))), MovingBody(shapes.cylinder_y(0.2, 0.2, 12, (0.3, 0.0, 0.0)))
    count, still = 150, np.tile(np.eye(4), (150, 1, 1))
    Ts = still.copy()
    Ts[:, :3, 3] = np.linspace(rng.uniform(-1.5, 1.5, 3), rng.uniform(-1.5, 1.5, 3), count)
    Ts[:, :3, :3] = Rotation.from_rotvec(np.linspace(rng.uniform(-2, 2, 3), rng.uniform(-2, 2, 3), count)).as_matrix()
    every = np.array([distance(one.shape, still[i], other.shape, Ts[i]) for i in range(count)]) - asked
    found = nearest(one.shape, still, other, Ts, asked, np.full(count, -np.inf), 0.4)
    if every.min() >= 0.4:
        assert found is None
    elif every.min() <= 0:
        assert found is not None
        assert found.spare <= 0
        assert found.spare == pytest.approx(every[found.at])
    else:
        assert found is not None
        assert every.min() <= found.spare <= every.min() + 0.001


def test_single_postures_are_clear_where_the_whole_robot_check_says(athlete, ground, walk, rng):
    """Second method: all pairs of meshes with security margins at once. Legs reach over each other and into rocks."""
    found = {True: 0, False: 0}
    for _ in range(40):
        posture = athlete.posture("stand") + np.tile([0.7, 0.4, 0.5, 0.5, 0.5, 0.5], 6) * rng.uniform(-1, 1, 36)
        T_site_base = transform(rotation("z", rng.uniform(-3, 3)), (*rng.uniform(-0.3, 0.3, 2), rng.uniform(0.7, 1.6)))
        stretch = MotionStretch(
            athlete, 0, 1, (), posture[None], T_site_base[None], np.array([1]), np.zeros(1), ("body",)
        )
        clearances = ClearanceCheck(athlete, ground, walk, 0.05)
        clearances.look(stretch, lambda: None)
        own, terrain = (one.holds for one in clearances.checks())
        collisions = posture_collisions(athlete, posture, T_site_base, triangulate(ground))
        pairs = [(one.link_a, one.link_b) for one in collisions]
        assert own == (not [pair for pair in pairs if TERRAIN not in pair])
        loose = [pair for pair in pairs if TERRAIN in pair and not any(link.endswith(LOCKED) for link in pair)]
        assert terrain == (not loose)
        found[own] += 1
        found[terrain] += 1
    assert min(found.values()) >= 8


def test_samples_are_dense_and_where_kinematics_has_them(athlete, walk):
    every = RecheckSettings(way=0.003, turn=0.004)
    found = list(stretches(athlete, walk, every))
    assert [one.moving for one in found] == [(), (0,), (), (3,), (1,), ()]
    assert [one.move for one in found] == [0, 0, 1, 1, 2, 3]
    for one in found:
        assert np.abs(np.diff(one.qs, axis=0)).max() <= every.turn + 1e-9
        assert np.linalg.norm(np.diff(one.Ts_site_base[:, :3, 3], axis=0), axis=1).max() <= every.way + 1e-9
        for at in (0, len(one.qs) // 2, len(one.qs) - 1):
            poses = link_poses(athlete, one.qs[at])
            for link, Ts in one.Ts_base_link.items():
                assert np.allclose(Ts[at], poses[link], atol=1e-9)
            com = apply(one.Ts_site_base[at], center_of_mass(athlete, one.qs[at]))
            assert np.allclose(one.coms_site[at], com, atol=1e-9)
    ends = np.concatenate([one.qs[[0, -1]] for one in found])
    assert np.allclose(ends[1:-1:2], ends[2::2], rtol=0, atol=1e-12)
    assert np.allclose(ends[[0, -1]], walk.waypoints[[0, -1]], rtol=0, atol=1e-12)


@given(st.integers(0, 10_000), st.floats(0.1, 1.0))
def test_friction_holds_where_forces_are_found(seed, friction):
    """Second method: the nearest forces by non-negative least squares, in pyramids of half as many sides."""
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0, 2 * np.pi, 5))
    contacts = np.column_stack([2 * np.cos(angles), 2 * np.sin(angles), rng.uniform(-0.4, 0.4, 5)])
    normals = np.column_stack([rng.uniform(-0.6, 0.6, (5, 2)), np.ones(5)])
    com = np.array([*rng.uniform(-1.5, 1.5, 2), 0.8])
    margin = friction_margin(contacts, pyramids(normals, friction), com)
    forces = distribute(contacts, normals / np.linalg.norm(normals, axis=1, keepdims=True), com, 1.0, friction=friction)
    # eight sides hold at least 0.92 of the cone, sixteen at most all of it
    if forces is not None:
        assert margin >= -0.02
    if margin >= 0:
        assert distribute(contacts, normals, com, 1.0, friction=friction / np.cos(np.pi / 8)) is not None
        assert friction_margin(contacts, pyramids(normals, 1.2 * friction), com) >= margin - 1e-9


def test_nothing_of_the_planner_judges_its_walks():
    """What the recheck imports of the project is named here; none of it plans, solves or certifies."""
    allowed = {
        "footfall.balance.payload",
        "footfall.balance.balance_settings",
        "footfall.balance.tether",
        "footfall.core.arrays",
        "footfall.core.bounds",
        "footfall.core.errors",
        "footfall.core.frames",
        "footfall.core.grid",
        "footfall.core.mesh",
        "footfall.core.value",
        "footfall.planning.answers",
        "footfall.planning.motion",
        "footfall.planning.walk.problem",
        "footfall.robot.meshes",
        "footfall.robot.meshes.bvh",
        "footfall.robot.description",
        "footfall.robot.leg_branches",
        "footfall.robot.model",
        "footfall.robot.tolerance",
        "footfall.telemetry.state",
        "footfall.terrain.dem",
        "footfall.terrain.ground.surface",
        "footfall.terrain.ground.triangulate",
        "footfall.terrain.ground.unseen",
    }
    used = set()
    for path in ROOM.glob("*.py"):
        for part in ast.walk(ast.parse(path.read_text())):
            if isinstance(part, ast.ImportFrom):
                used.add(part.module)
            elif isinstance(part, ast.Import):
                used |= {alias.name for alias in part.names}
    own = {name for name in used if name and name.startswith("footfall")}
    assert own
    assert not {name for name in own if not name.startswith("footfall.planning.walk.recheck")} - allowed
