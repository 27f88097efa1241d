"""What the view's switches and looks make of the scene: a real session, a real viser server, no page."""

import threading
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import viser

from footfall.core.errors import Conflict, InvalidInput, NotFound
from footfall.core.frames import apply
from footfall.planning.body.stand import stand
from footfall.robot.kinematics import wheel_centers
from footfall.sequence.commands import Sequence
from footfall.session.access.acting import acting
from footfall.session.access.identity import LOCAL
from footfall.session.core import present
from footfall.session.jobs.local import InlineJobs
from footfall.session.log.fold_commands import CommandRecord
from footfall.session.registry import Sessions
from footfall.session.tracks import tracks
from footfall.session.view import SWITCHES, ViewState
from footfall.telemetry.state import TelemetryFrame
from footfall.terrain.ground.contours import contour_step
from footfall.terrain.ground.surface import height_at
from footfall_ui.scene import Scene
from footfall_ui.scene.clicks import choose
from footfall_ui.scene.goal import POLE
from footfall_ui.scene.look import Eye, Looking, Preset, eye_of
from footfall_ui.scene.tracks import HALF, OVER, PRINTS, TracksDrawing, print_lines
from tests.support.chassis_ground import wavy
from tests.support.sequences import recorded
from tests.support.waiting import BOUND, until

DOWN = np.array([0.0, 0.0, -1.0])


@pytest.fixture(scope="module")
def ground():
    return wavy(half=3.0)


@pytest.fixture(scope="module")
def state(athlete, ground):
    stood = stand(athlete, ground)
    torques = 0.1 * athlete.torque_limits
    torques[14] = 0.9 * athlete.torque_limits[14]
    return replace(stood, wheel_forces=np.tile([0.0, 0.0, 1400.0], (6, 1)), joint_torques=torques)


@pytest.fixture(scope="module")
def viewed(tmp_path_factory, ground, state):
    """(session, there): ``there(name)`` waits for a thing of the scene, or with False for its end."""
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    with Sessions(tmp_path_factory.mktemp("sessions"), jobs=InlineJobs()) as sessions:
        live = sessions.create("viewed")
        live.terrains.load(ground, "made for the tests")
        live.stances.set(state)
        scene = Scene(server)
        scene.follow(live)

        def there(name, shown=True):
            return until(lambda: (server.scene.get_handle_by_name(name) is not None) == shown, f"{name}: {shown}")

        yield live, there, scene, server
        scene.close()
    server.stop()


def settle(scene):
    """Until what was marked before is drawn: the second job runs after the parts of the first one's turn."""
    for _ in range(2):
        done = threading.Event()
        scene._redrawing.soon(done.set)
        assert done.wait(BOUND)


def test_each_switch_shows_its_thing(viewed, ground):
    live, there, _, _ = viewed
    things = {
        "torques": ["/torque/worst", "/rover/torques/good"],
        "forces": ["/forces/arrows", "/forces/text"],
        "support": ["/support/plain", "/support/conservative", "/support/com", "/support/margin"],
        "region": ["/support/friction"],
        "cameras": ["/rover/cameras/haz0/field"],
        "tape": ["/tape/lines", "/tape/text"],
    }
    live.choices.set_view(shown=dict.fromkeys(things, True), tape=[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    for names in things.values():
        assert all(there(name) for name in names)
    for switch, names in things.items():
        live.choices.set_view(shown={switch: False})
        assert all(there(name, shown=False) for name in names)
        others = [name for other in things if other != switch for name in things[other]]
        live.choices.set_view(shown={switch: True})
        assert all(there(name) for name in [*names, *others])


def test_the_hatching_is_made_once_for_each_terrain(viewed, ground):
    live, there, scene, server = viewed
    state = live.state.state
    newest = np.where(np.isfinite(ground.heights), 1e9, np.nan)
    newest[0, 0] += 7200.0
    known = np.isfinite(newest)
    remembered = {
        "variance": known.astype(np.float32),
        "count": known.astype(np.uint16),
        "source": known.astype(np.uint8),
    }
    live.terrains.load(replace(ground, time=newest, sources=("nav0",), **remembered), "an hour old")
    live.choices.set_view(shown={"age": True})
    assert there("/age")
    made = server.scene.get_handle_by_name("/age")
    for shown in (False, True):
        live.choices.set_view(shown={"age": shown})
        settle(scene)
        assert server.scene.get_handle_by_name("/age") is made
        assert made.visible is shown
    live.terrains.load(ground, "made for the tests")
    assert there("/age", shown=False)
    live.choices.set_view(shown={"age": False})
    assert live.state.state == state


def test_contour_lines_are_made_once_for_each_terrain_and_say_how_far_apart_they_are(viewed, ground):
    live, there, scene, server = viewed
    live.choices.set_view(shown={"contours": True})
    there("/contours/text")
    made = server.scene.get_handle_by_name("/contours/text")
    assert made.text == f"contour lines every {contour_step(ground):g} m"
    for shown in (False, True, False):
        live.choices.set_view(shown={"contours": shown})
        settle(scene)
        assert server.scene.get_handle_by_name("/contours/text") is made
        assert made.visible is shown


def test_a_print_lies_on_the_ground_where_a_wheel_was_put_down(viewed, athlete, ground):
    _, _, _, server = viewed
    sequence = recorded()
    row = max(row for row, one in enumerate(sequence.commands) if one.phase == "lower")
    done = CommandRecord("0", "put down", 1, row, "done", "", 0.0)
    products = {"put down": sequence, "dem": ground}
    (step,) = tracks([done], products.__getitem__)
    lines = print_lines(athlete, ground, step)
    assert len(lines)
    assert np.abs(lines[..., 2] - height_at(ground, lines[..., 0], lines[..., 1]) - OVER).max() < 1e-9
    hub = apply(step.T_site_base, wheel_centers(athlete, step.posture))[step.leg]
    assert np.linalg.norm(lines[..., :2] - hub[:2], axis=2).max() <= np.hypot(*HALF) + 1e-9

    def session(commands, shown=True):
        view = SimpleNamespace(shown=SimpleNamespace(tracks=shown))
        state = SimpleNamespace(dem="dem", commands=commands)
        choices = SimpleNamespace(view=view)
        return cast(Any, SimpleNamespace(state=state, choices=choices, any_robot=athlete, get=products.__getitem__))

    drawing = TracksDrawing(server)
    for commands, shown, there in (((), True, False), ((done,), True, True), ((done,), False, False)):
        drawing.draw(session(commands, shown))
        assert (server.scene.get_handle_by_name(PRINTS) is not None) == there


def test_a_click_measures_while_the_tape_is_out(viewed):
    live, _, _, _ = viewed
    live.choices.set_view(shown={"tape": True}, tape=[])
    before = live.state.footfall
    for x in (0.2, 1.2):
        choose(live, np.array([x, 0.5, 9.0]), DOWN)
    assert live.state.footfall is before
    (x0, y0, _), (x1, y1, _) = live.choices.view.tape
    assert (x1 - x0, y1 - y0) == pytest.approx((1.0, 0.0))
    choose(live, np.array([0.0, 0.0, 9.0]), DOWN)
    assert len(live.choices.view.tape) == 1
    live.choices.set_view(shown={"tape": False})
    choose(live, np.array([0.2, 0.5, 9.0]), DOWN)
    assert live.state.footfall is not None
    assert live.state.footfall.x == pytest.approx(0.2)


def test_telemetry_without_motion_draws_nothing_anew(viewed, state, rng):
    live, there, scene, server = viewed
    live.choices.set_view(shown={"support": True, "forces": True})
    live.rover.take_telemetry(TelemetryFrame(1, state, state.posture))
    assert there("/support/margin")
    until(lambda: live.rover.frame is not None, "telemetry")
    names = ("/support/plain", "/support/margin", "/forces/arrows", "/rover/torques/good", "/torque/worst")
    assert all(there(name) for name in names)
    settle(scene)
    before = [server.scene.get_handle_by_name(name) for name in names]
    for number in range(2, 6):
        noisy = replace(state, time=float(number), posture=state.posture + rng.uniform(-5e-4, 5e-4, 36))
        live.rover.take_telemetry(TelemetryFrame(number, noisy, noisy.posture))
    settle(scene)
    assert [server.scene.get_handle_by_name(name) for name in names] == before
    rover = server.scene.get_handle_by_name("/rover")
    assert rover is not None
    pose = np.array(state.T_site_base)
    pose[0, 3] += 0.3
    moved = replace(state, time=9.0, T_site_base=pose)
    live.rover.take_telemetry(TelemetryFrame(9, moved, moved.posture))
    until(lambda: abs(rover.position[0] - pose[0, 3]) < 1e-6, "the rover at its new place")
    until(lambda: server.scene.get_handle_by_name("/support/margin") is not before[1], "the new margin")
    until(lambda: server.scene.get_handle_by_name("/forces/arrows") is not before[2], "the new arrows")


def test_a_scene_shows_a_session_as_it_was_and_lets_nobody_change_that(tmp_path):
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    with Sessions(tmp_path, jobs=InlineJobs()) as sessions:
        live = sessions.open_sample("rock-step")
        planned = next(event for event in live.events() if event.type == "product" and event.payload["kind"] == "plan")
        past = live.as_of(planned.seq - 1)
        assert past.only_looked_at
        assert (past.state.plan, live.state.plan) == (None, planned.payload["digest"])
        assert past.state.dem == live.state.dem
        assert len(past.events()) == planned.seq
        scene = Scene(server)
        scene.follow(live)

        def there(name, shown=True):
            return until(lambda: (server.scene.get_handle_by_name(name) is not None) == shown, f"{name}: {shown}")

        assert there("/plan/path")
        scene.follow(past)
        assert there("/plan/path", shown=False)
        events = len(live.events())
        choose(past, np.array([0.2, 0.5, 9.0]), DOWN)
        with pytest.raises(Conflict):
            past.maps.choose_footfall(2, 0.2, 0.5)
        assert len(live.events()) == events
        scene.follow(live)
        assert there("/plan/path")
        for none in (-1, events):
            with pytest.raises(NotFound):
                live.as_of(none)
        scene.close()
    server.stop()


def test_a_stepped_session_shows_its_plan_suggestions_and_run(tmp_path):
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    with Sessions(tmp_path, jobs=InlineJobs()) as sessions:
        live = sessions.open_sample("rock-step")
        scene = Scene(server)
        scene.follow(live)

        def there(name, shown=True):
            return until(lambda: (server.scene.get_handle_by_name(name) is not None) == shown, f"{name}: {shown}")

        leg = live.choices.now.view.leg
        live.choices.set_view(shown={"swept": True})
        assert there("/plan/path")
        assert there(f"/swept/leg{leg}_wheel")
        assert server.scene.get_handle_by_name("/suggested/marks") is None
        live.maps.compute(leg).finish()
        live.maps.suggest(leg, show=True)
        assert there("/suggested/marks")
        live.choices.set_view(leg=(leg + 1) % 6)  # they are not that leg's
        assert there("/suggested/marks", shown=False)

        # the sequence goes: its first row is under way
        sequence = live.get(present(live.state.sequence, "no sequence"))
        assert isinstance(sequence, Sequence)
        assert sequence.at_rest is not None
        start = sequence.at_rest.state
        live.rover.connected(lambda text: None)
        live.rover.take_telemetry(TelemetryFrame(1, start, sequence.at_rest.set_points))
        until(lambda: live.rover.frame is not None, "telemetry")
        assert there("/predicted", shown=False)
        live.commands.send(live.commands.arm()["token"])
        assert there("/predicted")
        label = there("/predicted-text")
        assert label is not None
        live.commands.abort()
        live.rover.disconnected()
        assert there("/predicted", shown=False)
        assert there("/predicted-text", shown=False)
        scene.close()
    server.stop()


def test_a_look_turns_every_page_once_and_then_goes_along(athlete, state):
    class Camera:
        update_timestamp = 1.0

        def __init__(self):
            self.position, self.look_at = np.array([9.0, 9.0, 9.0]), np.zeros(3)

    class Loop:
        def call_soon_threadsafe(self, run):
            run()

    class Page:
        camera = Camera()

    class Server:
        def get_clients(self):
            return {0: Page()}

        def get_event_loop(self):
            return Loop()

    looking, camera = Looking(cast(Any, Server())), Page.camera
    looking.look("free", 0, athlete, state, 2)
    assert camera.position == pytest.approx([9.0, 9.0, 9.0])
    looking.look("wheel", 1, athlete, state, 2)
    eye = eye_of("wheel", athlete, state, 2)
    assert eye is not None
    assert camera.position == pytest.approx(eye.position)
    assert camera.look_at == pytest.approx(eye.target)
    camera.position = camera.position + np.array([0.0, 0.0, 1.0])  # turned by hand
    pose = np.array(state.T_site_base)
    pose[:3, 3] += [0.5, 0.2, 0.0]
    looking.look("wheel", 1, athlete, replace(state, T_site_base=pose), 2)
    assert camera.position == pytest.approx(eye.position + np.array([0.5, 0.2, 1.0]))
    assert camera.look_at == pytest.approx(eye.target + np.array([0.5, 0.2, 0.0]))
    looking.look("top", 2, athlete, state, 2)
    at = camera.position
    looking.look("top", 2, athlete, replace(state, T_site_base=pose), 2)
    assert camera.position is at


def test_a_preset_is_left_when_a_page_that_was_there_is_turned_away():
    class Camera:
        update_timestamp = 1.0
        position, look_at = np.array([9.0, 9.0, 9.0]), np.zeros(3)

    def at(position):
        camera.position = np.array(position)
        return cast(Any, camera)

    eye, camera = Eye(np.array([0.0, 0.0, 5.0]), np.zeros(3)), Camera()
    preset = Preset(eye, 0.02)
    preset.take(cast(Any, camera))
    assert camera.position == pytest.approx(eye.position)
    # what it tells from before it got there
    assert not preset.is_left_by(at([9.0, 9.0, 9.0]))
    assert not preset.is_left_by(at([0.0, 0.01, 5.0]))
    assert preset.is_left_by(at([0.0, 0.03, 5.0]))
    # a page that stands there already does not say so again
    preset = Preset(eye, 0.02)
    preset.take(at(eye.position))
    assert preset.is_left_by(at([0.0, 1.0, 5.0]))


def test_a_view_refuses_what_it_does_not_have():
    view = ViewState()
    for wrong in (
        {"shown": {"stars": True}},
        {"shown": {"tape": 1}},
        {"look": "up"},
        {"tape": [[0.0, 1.0]]},
        {"opacity": 0.1},
        {"a": 1},
    ):
        with pytest.raises(InvalidInput):
            view.changed(**wrong)
    assert view.changed(look="top").changed(look="top").looks == 2
    changed = view.changed(shown={"swept": True})
    assert [name for name in SWITCHES if getattr(changed.shown, name) != getattr(view.shown, name)] == ["swept"]


def test_switches_and_looks_over_rest(client):
    view = "/sessions/current/view"
    before = client.get(view).json()
    after = client.put(view, json={"shown": {"cameras": True}, "look": "top"}).json()
    assert after["shown"] == {**before["shown"], "cameras": True}
    assert (after["look"], after["looks"]) == ("top", before["looks"] + 1)
    assert client.put(view, json={"shown": {"cameras": False}}).json()["shown"] == before["shown"]
    for wrong in ({"shown": {"stars": True}}, {"shown": {"tape": 1}}, {"look": "up"}, {"tape": [[0.0, 1.0]]}):
        answer = client.put(view, json=wrong)
        assert answer.status_code == 422, answer.text
        assert answer.headers["content-type"] == "application/problem+json"


def test_a_click_sets_the_goal_of_a_walk_for_the_page_that_asked_and_once(viewed, ground):
    live, there, scene, server = viewed
    mine, others = replace(LOCAL, page="mine"), replace(LOCAL, page="another")

    def click(who, x, y):
        with acting(who):
            choose(live, np.array([x, y, 9.0]), DOWN)

    click(mine, 0.2, 0.5)
    assert live.choices.view.goal is None
    live.choices.set_view(goal_page="mine")
    click(others, 0.3, 0.5)
    click(replace(LOCAL, page=""), 0.35, 0.5)
    assert live.choices.view.goal is None
    assert live.state.footfall.x == pytest.approx(0.35)
    click(mine, 1.5, -0.5)
    assert live.choices.view.goal == pytest.approx((1.5, -0.5))
    assert live.state.footfall.x == pytest.approx(0.35)
    click(mine, 0.1, 0.5)
    assert live.choices.view.goal == pytest.approx((1.5, -0.5))
    assert live.state.footfall.x == pytest.approx(0.1)

    assert there("/goal/flag")
    label = server.scene.get_handle_by_name("/goal/text")
    assert label.position == pytest.approx((1.5, -0.5, float(height_at(ground, 1.5, -0.5)) + POLE))
    live.choices.set_view(goal=None)
    settle(scene)
    assert server.scene.get_handle_by_name("/goal/flag") is None


def test_a_click_into_the_sky_chooses_nothing_and_its_page_hears_so(viewed):
    live, _, _, _ = viewed
    heard, chosen = [], live.state.footfall
    unlisten = live.listen(lambda message: heard.append(message) if message["type"] == "missed" else None)
    who = replace(LOCAL, page="mine")
    with acting(who):
        choose(live, np.array([0.2, 0.5, 9.0]), -DOWN)
        choose(live, np.array([900.0, 0.0, 9.0]), DOWN)
    unlisten()
    assert [(one["missed"], one["seat"]) for one in heard] == [({"terrain": True}, who.seat)] * 2
    assert live.state.footfall is chosen
