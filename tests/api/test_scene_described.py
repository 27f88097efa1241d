"""The scene of a session about a robot that others described: a real session, a real viser server, no page."""

import threading
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, NamedTuple, cast

import numpy as np
import pinocchio as pin
import pytest
import viser

import footfall
from footfall.balance.support import margins
from footfall.core.frames import apply, quat_wxyz
from footfall.maps.support_outlines import bearing
from footfall.planning.legged.measured import measured_at_rest, standing_state
from footfall.planning.legged.problem import LeggedPlan, LeggedResult
from footfall.planning.walk.problem import WalkGoal
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.sequence.of_legged import make_legged_sequence
from footfall.session.jobs.local import InlineJobs
from footfall.session.live import LiveSession
from footfall.session.log.fold_commands import CommandRecord
from footfall.session.registry import Sessions
from footfall.session.tracks import tracks
from footfall.telemetry.state import RobotState, TelemetryFrame
from footfall.terrain.dem import Dem
from footfall.terrain.generate import fractal
from footfall.terrain.ground.surface import height_at
from footfall_ui.scene import Scene
from footfall_ui.scene.any_robot import MASS, REACH, SMALLEST, heft, reach, size, sole_radius
from footfall_ui.scene.clicks import choose
from footfall_ui.scene.forces import METRES_PER_NEWTON, force_arrows
from footfall_ui.scene.ghost import motion_of
from footfall_ui.scene.look import eye_of, first_eye, followed
from footfall_ui.scene.predicted import alongside
from footfall_ui.scene.robot import BODY, CHOSEN, GHOST
from footfall_ui.scene.support import stance_of
from footfall_ui.scene.swept import swept_poses
from footfall_ui.scene.tracks import OVER, print_lines
from tests.support.described import robot_of, seeing
from tests.support.waiting import BOUND, until

LEG = 1
DOWN = np.array([0.0, 0.0, -1.0])


class Viewed(NamedTuple):
    """A session with its robot and ground, and the scene that draws it."""

    live: LiveSession
    robot: LeggedRobot
    dem: Dem
    state: RobotState
    server: viser.ViserServer
    scene: Scene

    def handle(self, name: str) -> Any:
        """Waits for a thing of the scene, and until it is drawn to its end."""
        until(lambda: self.server.scene.get_handle_by_name(name), name)
        for _ in range(2):
            done = threading.Event()
            self.scene._redrawing.soon(done.set)
            assert done.wait(BOUND)
        return until(lambda: self.server.scene.get_handle_by_name(name), name)

    def gone(self, name: str) -> None:
        until(lambda: self.server.scene.get_handle_by_name(name) is None, f"the end of {name}")


@pytest.fixture(scope="module", params=[4, 6], ids=["four legs", "six legs"])
def viewed(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Viewed]:
    robot, dem = robot_of(request.param)[1], fractal(2.4, 0.1, roughness=0.01, seed=3)
    robot = seeing(robot) if request.param == 6 else robot
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    with Sessions(tmp_path_factory.mktemp("sessions"), jobs=InlineJobs()) as sessions:
        live = sessions.create("described", robot)
        live.terrains.load(dem, "made for the tests")
        state = measured_at_rest(robot, dem, 0.1, 0.05, 0.3)
        live.stances.set(state)
        scene = Scene(server)
        scene.follow(live)
        yield Viewed(live, robot, dem, state, server, scene)
        scene.close()
    server.stop()


@pytest.fixture(scope="module")
def walk(viewed: Viewed) -> LeggedPlan:
    """A walk of a few centimetres, in the session."""
    x, y, _ = viewed.state.T_site_base[:3, 3]
    job = viewed.live.described_plans.walk(WalkGoal(x + 0.05, y))
    job.finish()
    result = viewed.live.get(viewed.live.state.latest["described_walk"])
    assert isinstance(result, LeggedResult)
    assert result.plan is not None, result.reason
    return result.plan


def bodies(robot: LeggedRobot, posture: np.ndarray) -> list[np.ndarray]:
    """T_base_body of every body but the base, by pin's own forward kinematics of the model."""
    data = robot.pin_model.createData()
    pin.forwardKinematics(robot.pin_model, data, np.asarray(posture, float))
    return [T.homogeneous for T in list(data.oMi)[1:]]


def soles(robot: LeggedRobot, posture: np.ndarray, T_site_base: np.ndarray) -> np.ndarray:
    """Centres of soles in site, by pin's own forward kinematics."""
    data = robot.pin_model.createData()
    pin.framesForwardKinematics(robot.pin_model, data, np.asarray(posture, float))
    return np.array([apply(T_site_base, data.oMf[one].translation) for one in robot.foot_frames])


def stands(server: viser.ViserServer, robot: LeggedRobot, name: str, posture: np.ndarray, T: np.ndarray) -> bool:
    """Whether what is drawn under a name stands so, to a tenth of a millimetre."""
    found = server.scene.get_handle_by_name(f"/{name}")
    if found is None or not found.visible:
        return False
    wanted = [(f"/{name}", T), *((f"/{name}/{body}", T_) for body, T_ in enumerate(bodies(robot, posture), 1))]
    for node, T_node in wanted:
        handle = server.scene.get_handle_by_name(node)
        assert handle is not None, node
        turned = abs(abs(float(np.dot(handle.wxyz, quat_wxyz(T_node[:3, :3])))) - 1.0)
        if np.abs(np.array(handle.position) - T_node[:3, 3]).max() > 1e-4 or turned > 1e-6:
            return False
    return True


def test_it_stands_where_the_session_has_it_with_its_leg_coloured(viewed: Viewed) -> None:
    live, robot, _, state, server, _ = viewed
    live.choices.set_view(leg=LEG)
    until(lambda: stands(server, robot, "rover", state.posture, state.T_site_base), "the robot")
    own = range(1 + robot.slices[LEG].start, 1 + robot.slices[LEG].stop)

    def colours() -> dict[int, tuple[int, ...]]:
        shown = ((body, server.scene.get_handle_by_name(f"/rover/{body}/0")) for body in range(len(robot.shapes)))
        return {body: tuple(cast(Any, mesh).color) for body, mesh in shown if mesh is not None}

    drawn = {body for body, shapes in enumerate(robot.shapes) if shapes}
    wanted = {body: CHOSEN if body in own else BODY for body in drawn}
    until(lambda: colours() == wanted, "the colours of the chosen leg")


def test_telemetry_moves_it(viewed: Viewed) -> None:
    live, robot, _, state, server, _ = viewed
    posture = np.array(state.posture)
    posture[robot.slices[0]] += 0.05
    pose = np.array(state.T_site_base)
    pose[0, 3] += 0.03
    for number, moved in enumerate((replace(state, posture=posture, T_site_base=pose), state), 1):
        live.rover.take_telemetry(TelemetryFrame(number, moved, moved.posture))
        until(lambda m=moved: stands(server, robot, "rover", m.posture, m.T_site_base), "the robot that moved")


def test_switches_show_what_such_robots_have(viewed: Viewed) -> None:
    live, server = viewed.live, viewed.server
    live.choices.set_view(leg=LEG, shown={"forces": True, "support": True, "torques": True, "cameras": True})
    names = ["/forces/arrows", "/forces/text", "/support/plain", "/support/friction", "/support/margin", "/shadow"]
    for name in names:
        viewed.handle(name)
    assert viewed.handle("/forces/text").text.startswith(f"leg {viewed.robot.leg_names[LEG]}: ")
    pairs = viewed.robot.description.cameras
    for pair in pairs:
        field = viewed.handle(f"/rover/cameras/{pair.name}/field")
        np.testing.assert_allclose(field.position, pair.camera_left.T_base_camera[:3, 3], atol=1e-6)
        assert field.scale == pytest.approx(0.5 * size(viewed.robot))
    assert len(pairs) == (7 if len(viewed.robot.legs) == 6 else 0)
    live.choices.set_view(shown={"forces": False, "support": False, "cameras": False})
    for name in names[:-1]:
        viewed.gone(name)
    assert server.scene.get_handle_by_name("/rover/torques/good") is None
    for pair in pairs:
        viewed.gone(f"/rover/cameras/{pair.name}/field")


def test_footfalls_and_way_of_a_walk_lie_where_its_plan_has_them(viewed: Viewed, walk: LeggedPlan) -> None:
    robot = viewed.robot
    rows = [row for row, phase in enumerate(walk.phases) if phase == "lower"]
    ends = [row for row in rows if row + 1 == len(walk.phases) or walk.phases[row + 1] != "lower"]
    assert len(ends) == len(walk.moves) >= len(robot.legs)
    for number, (row, leg) in enumerate(zip(ends, walk.moves, strict=True), 1):
        label = viewed.handle(f"/walk/{number}")
        assert label.text == f"{number}: {robot.leg_names[leg]}"
        sole = soles(robot, walk.waypoints[row], walk.Ts_site_base[row])[leg]
        assert np.array(label.position)[:2] == pytest.approx(sole[:2], abs=1e-6)
        above = label.position[2] - height_at(viewed.dem, *sole[:2])
        assert 0.0 <= above < 0.02 * reach(robot)
    end = viewed.handle("/walk/end")
    assert end.text == f"walk: {len(walk.moves)} foot moves"
    assert np.array(end.position) == pytest.approx(walk.Ts_site_base[-1, :3, 3])
    viewed.handle("/walk/chassis")


def test_a_ghost_begins_and_ends_as_the_plan_does(viewed: Viewed, walk: LeggedPlan) -> None:
    live, robot, _, _, server, _ = viewed
    for scrub, row in ((0.0, 0), (1.0, -1)):
        live.choices.set_view(plays="walk", show_ghost=True, scrub=scrub)
        posture, T_site_base = walk.waypoints[row], walk.Ts_site_base[row]
        until(lambda q=posture, T=T_site_base: stands(server, robot, "ghost", q, T), f"the ghost at {scrub:g}")
    mesh = viewed.handle("/ghost/0/0")
    assert (tuple(mesh.color), mesh.opacity) == (GHOST, 0.55)
    live.choices.set_view(show_ghost=False)
    viewed.gone("/ghost")


def test_swept_samples_begin_and_end_as_the_plan_does(viewed: Viewed, walk: LeggedPlan) -> None:
    motion = motion_of(walk)
    assert motion is not None
    poses = swept_poses(viewed.robot, motion, 3)
    assert set(poses) == {str(body) for body, shapes in enumerate(viewed.robot.shapes) if shapes}
    for at, row in ((0, 0), (-1, -1)):
        T = walk.Ts_site_base[row]
        for body, T_base_body in enumerate(bodies(viewed.robot, walk.waypoints[row]), 1):
            if str(body) in poses:
                assert poses[str(body)][at] == pytest.approx(T @ T_base_body, abs=1e-9)


def test_a_click_chooses_the_footfall_and_a_step_there_is_drawn(viewed: Viewed) -> None:
    live, robot, dem, state, *_ = viewed
    live.choices.set_view(leg=LEG, shown={"tape": False})
    sole = soles(robot, state.posture, state.T_site_base)[LEG]
    x, y = sole[0] + 0.02, sole[1] + 0.02
    choose(live, np.array([x, y, 3.0]), DOWN)
    chosen = live.choices.now.footfall
    assert chosen is not None
    assert (chosen.leg, chosen.x, chosen.y) == (LEG, pytest.approx(x), pytest.approx(y))
    text = viewed.handle("/footfall/text")
    assert text.text == f"leg {robot.leg_names[LEG]}"
    assert np.array(text.position)[:2] == pytest.approx((x, y), abs=0.1)
    mark = viewed.handle("/footfall/mark")
    around = np.asarray(mark.points).reshape(-1, 3) + np.array(mark.position)
    assert np.ptp(around[:, 2]) < 0.6 * size(robot)
    rim = np.hypot(*(around[:64, :2] - (x, y)).T)
    assert rim == pytest.approx(sole_radius(robot, LEG), rel=0.05)

    live.described_plans.step(LEG).finish()
    result = live.get(live.state.latest["described_step"])
    assert isinstance(result, LeggedResult)
    assert result.plan is not None, result.reason
    path = viewed.handle("/plan/path")
    drawn = np.asarray(path.points).reshape(-1, 2, 3) + np.array(path.position)
    end = soles(robot, result.plan.waypoints[-1], result.plan.Ts_site_base[-1])[LEG]
    assert drawn[-1, 1] == pytest.approx(end, abs=1e-5)
    assert end[:2] == pytest.approx((x, y), abs=0.01)
    assert end[2] - robot.radii[LEG] == pytest.approx(float(height_at(dem, *end[:2])), abs=0.01)


def test_maps_of_the_chosen_leg_colour_the_ground_until_it_stands_elsewhere(viewed: Viewed) -> None:
    live, state = viewed.live, viewed.state
    live.choices.set_view(leg=LEG, layer="footing")
    live.maps.compute(LEG).finish()
    coloured = f"/terrain/{live.state.maps[str(LEG)]}/footing"
    until(lambda: viewed.handle(coloured).visible, "the maps on the ground")
    pose = np.array(state.T_site_base)
    pose[0, 3] += 0.2
    for number, there in enumerate((replace(state, T_site_base=pose), state), 10):
        live.rover.take_telemetry(TelemetryFrame(number, there, there.posture))
        live.choices.set_view(opacity=1.0)
        if there is state:
            until(lambda: viewed.handle(coloured).visible, "the maps where it stands again as they are for")
        else:
            viewed.gone(coloured)


def test_a_click_sets_the_goal_where_its_page_asked_for_one(viewed: Viewed) -> None:
    live, robot, dem, _, *_ = viewed
    live.choices.set_view(goal=(0.2, 0.1))
    flag = viewed.handle("/goal/flag")
    points = np.asarray(flag.points).reshape(-1, 3) + np.array(flag.position)
    assert points[:, 2].min() == pytest.approx(float(height_at(dem, 0.2, 0.1)), abs=1e-5)
    assert np.ptp(points[:, 2]) == pytest.approx(size(robot), abs=1e-5)
    live.choices.set_view(goal=None)
    viewed.gone("/goal/flag")


def test_support_is_that_of_the_soles(viewed: Viewed) -> None:
    _, robot, dem, state, *_ = viewed
    stance = stance_of(robot, state, dem)
    feet = standing_state(robot, dem, state)
    assert bearing(robot, state) == list(robot.legs)
    assert stance.support.points == pytest.approx(feet.contacts)
    com = pin.centerOfMass(robot.pin_model, robot.pin_model.createData(), np.asarray(state.posture))
    assert stance.margins["plain"] == pytest.approx(float(margins(feet.contacts, stance.com[None, :2])[0]))
    # the base weighs and lies at the origin of its frame in these robots, which pin leaves out
    moving = robot.mass - robot.pin_model.inertias[0].mass
    assert stance.com == pytest.approx(apply(state.T_site_base, com * moving / robot.mass), abs=1e-6)
    assert stance.margins["friction"] > 0
    one = np.zeros((len(robot.legs), 3))
    one[0, 2] = 100.0
    assert stance_of(robot, replace(state, wheel_forces=one), dem).text == "margin: too few feet stand"


def test_without_ground_under_a_foot_it_is_taken_as_level(viewed: Viewed) -> None:
    _, robot, dem, state, *_ = viewed
    sole = soles(robot, state.posture, state.T_site_base)[LEG]
    heights = dem.heights.copy()
    row, col = (int(one) for one in dem.geometry.cell(sole[0], sole[1]))
    heights[row - 1 : row + 2, col - 1 : col + 2] = np.nan
    stance = stance_of(robot, state, replace(dem, heights=heights))
    assert stance.support.assumed == (LEG,)
    assert stance.support.points[LEG] == pytest.approx(sole - [0.0, 0.0, robot.radii[LEG]])
    level = stance_of(robot, state)
    assert np.isnan(level.margins["friction"])
    assert level.margins["plain"] == pytest.approx(stance.margins["plain"], abs=0.01)


def test_arrows_show_each_foot_its_share_of_the_weight(viewed: Viewed) -> None:
    _, robot, _, state, *_ = viewed
    arrows = force_arrows(robot, state)
    assert arrows.legs == tuple(robot.legs)
    lengths = np.linalg.norm(arrows.points[:, 1] - arrows.points[:, 0], axis=1)
    # as ATHLETE's arrows are long beside it
    assert lengths.sum() / reach(robot) == pytest.approx(METRES_PER_NEWTON * MASS * 9.81 / REACH, rel=0.05)
    assert heft(robot) == robot.mass / MASS
    unloaded = replace(state, wheel_forces=np.zeros((len(robot.legs), 3)))
    assert force_arrows(robot, unloaded).legs == ()


def test_each_look_sees_what_it_is_named_for_from_no_farther_than_fits(viewed: Viewed) -> None:
    _, robot, _, state, *_ = viewed
    foot, base = soles(robot, state.posture, state.T_site_base)[LEG], state.T_site_base[:3, 3]
    first = first_eye(robot, LEG, state)
    away = np.linalg.norm(first.position - base)
    assert 1.2 * reach(robot) < away < 3.0 * reach(robot)
    # from outside, on the leg's side
    assert (first.position - base)[:2] @ (foot - base)[:2] > 0
    assert np.linalg.norm(first.target - base) < reach(robot)
    top, along, beside = (eye_of(look, robot, state, LEG) for look in ("top", "leg", "wheel"))
    assert top is not None
    assert along is not None
    assert beside is not None
    assert top.position[:2] == pytest.approx(base[:2], abs=0.02)
    assert 2.0 * reach(robot) < top.position[2] - base[2] < 4.0 * reach(robot)
    assert along.target == pytest.approx(foot)
    assert beside.target == pytest.approx(foot)
    assert np.linalg.norm(beside.position - base) > np.linalg.norm(foot - base)
    assert followed("follow", robot, state, LEG) == pytest.approx(base)
    assert followed("wheel", robot, state, LEG) == pytest.approx(foot)


def test_a_print_lies_on_the_ground_where_a_foot_was_put_down(viewed: Viewed, walk: LeggedPlan) -> None:
    _, robot, dem, _, *_ = viewed
    sequence = make_legged_sequence(walk, robot, dem)
    done = [CommandRecord(str(row), "it", 1, row, "done", "", 0.0) for row in range(len(sequence.commands))]
    steps = tracks(done, {"it": sequence}.__getitem__)
    assert [one.leg for one in steps] == list(walk.moves)
    lines = print_lines(robot, dem, steps[-1])
    sole = soles(robot, steps[-1].posture, steps[-1].T_site_base)[steps[-1].leg]
    assert np.hypot(*(lines[..., :2] - sole[:2]).reshape(-1, 2).T) == pytest.approx(sole_radius(robot, 0))
    over = lines[..., 2] - height_at(dem, lines[..., 0], lines[..., 1])
    assert over == pytest.approx(OVER * size(robot))


def test_measured_is_compared_with_the_nearest_predicted_place(viewed: Viewed, walk: LeggedPlan) -> None:
    _, robot, dem, state, *_ = viewed
    sequence = make_legged_sequence(walk, robot, dem)
    row = next(row for row, one in enumerate(sequence.commands) if one.phase == "swing")
    begin, end = sequence.predicted[row - 1], sequence.predicted[row]
    measured = replace(state, posture=begin + 0.25 * (end - begin), T_site_base=sequence.poses[row])
    there = alongside(robot, sequence, row, measured)
    assert there.posture == pytest.approx(measured.posture, abs=1e-9)
    assert there.text.startswith(f"row {row + 1}: ")


def test_a_robot_of_which_nothing_is_known_is_hidden_and_makes_room_for_another(tmp_path, athlete) -> None:
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    with Sessions(tmp_path, jobs=InlineJobs()) as sessions:
        live = sessions.create("nowhere", robot_of(6)[1])
        scene = Scene(server)
        try:
            scene.follow(live)
            body = until(lambda: server.scene.get_handle_by_name("/rover/0"), "the robot")
            assert not cast(Any, server.scene.get_handle_by_name("/rover")).visible
            scene.follow(sessions.create("athlete", athlete))
            until(lambda: server.scene.get_handle_by_name("/rover/wheel"), "the other robot")
            assert server.scene.get_handle_by_name("/rover/0") is not body
        finally:
            scene.close()
    server.stop()


def test_drawings_are_sized_as_athletes_are(athlete) -> None:
    assert (size(athlete), heft(athlete)) == (1.0, 1.0)
    assert reach(athlete) == pytest.approx(REACH, abs=0.01)
    assert athlete.mass == pytest.approx(MASS)
    ambler = footfall.load_robot("ambler")
    assert isinstance(ambler, LeggedRobot)
    assert size(ambler) > 1.5
    assert sole_radius(ambler, 0) == SMALLEST * reach(ambler)  # a point: it would not be seen


def test_a_point_foot_that_slides_is_told_in_millimetres() -> None:
    ambler = footfall.load_robot("ambler")
    assert isinstance(ambler, LeggedRobot)
    joints = len(ambler.joint_names)
    still = np.zeros(joints)
    slides = ambler.joint_names.index(ambler.layout.sliding[0])
    at = np.zeros(joints)
    at[slides] = 0.012
    sequence = cast(
        Any, SimpleNamespace(start=still, T_site_base=np.eye(4), predicted=still[None], poses=np.eye(4)[None])
    )
    state = cast(Any, SimpleNamespace(posture=at, T_site_base=np.eye(4)))
    text = alongside(ambler, sequence, 0, state).text
    assert text == f"row 1: {ambler.layout.sliding[0].replace('_', ' ')} +12.0 mm, chassis 0 mm from predicted"


def test_a_footfall_in_hand_has_a_handle_and_a_ring_of_the_foots_size(viewed: Viewed) -> None:
    x, y, _ = soles(viewed.robot, viewed.state.posture, viewed.state.T_site_base)[LEG]
    viewed.live.maps.choose_footfall(LEG, float(x), float(y))
    viewed.live.hand.hold("footfall")
    ring = viewed.handle("/hand/ring")
    assert np.ptp(ring.points[..., 0]) / 2 == pytest.approx(sole_radius(viewed.robot, LEG), rel=0.02)
    viewed.handle("/hand/handle")
    viewed.live.hand.put_down()
    viewed.gone("/hand/ring")
