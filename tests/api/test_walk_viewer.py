"""`footfall view`: a walk of a robot that others described, in browsers of this computer and no others."""

import signal
import subprocess
import threading
from pathlib import Path

import httpx
import numpy as np
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from footfall.core.errors import Conflict, InvalidInput
from footfall.io.any_robot import load_legged
from footfall.io.artifacts import decode
from footfall.io.terrain_files import read_terrain, write_terrain
from footfall.planning.answers import Status
from footfall.planning.legged.footfalls import footfalls
from footfall.planning.legged.problem import LeggedResult
from footfall.robot.legged.posture import placed
from footfall.terrain.generate import plane
from footfall_ui.viser_door import open_on_this_computer
from footfall_ui.walk_viewer import STEPS, WalkViewer, checks_text
from tests.support.command_line import FOOTFALL, run
from tests.support.drawing import PROTOCOL
from tests.support.urdf import written
from tests.support.waiting import BOUND, until
from tests.support.walkers import ring


@pytest.fixture(scope="module")
def walked(tmp_path_factory) -> Path:
    """A folder with a hexapod, level ground, and a walk on it."""
    folder = tmp_path_factory.mktemp("walked")
    run("robot", "init", written(folder, ring(6)), "--samples", 20)
    write_terrain(plane(4.0, 0.1), folder / "level.tif")
    asked = ["plan", "walk", folder / "level.tif", "--robot", folder / "robot.toml", "--goal", 0.08, 0]
    run(*asked, "--time-limit", 1e6, "--out", folder / "walk.npz")
    return folder


@pytest.fixture(scope="module")
def parts(walked):
    result = decode((walked / "walk.npz").read_bytes())
    assert isinstance(result, LeggedResult)
    return load_legged(walked / "robot.toml"), read_terrain(walked / "level.tif"), result


@pytest.fixture
def server():
    server = open_on_this_computer(0)
    yield server
    server.stop()


def asked(folder: Path) -> list[str]:
    return ["--robot", str(folder / "robot.toml"), "--terrain", str(folder / "level.tif")]


def test_the_scrubber_goes_through_the_walk(server, parts):
    robot, dem, result = parts
    plan = result.plan
    viewer = WalkViewer(server, robot, dem, result)
    try:
        names = set(server.scene._handle_from_node_name)
        assert {f"/walk/{number}" for number in range(1, len(plan.moves) + 1)} <= names
        assert {f"/robot/{body}" for body in range(len(robot.body_names))} <= names
        assert viewer.moment == 0.0
        for number, footfall in enumerate(footfalls(robot, plan), 1):
            viewer.next()
            # the scrubber has a thousand steps, so it may be a little short of it
            shown = server.scene._handle_from_node_name
            at, q = plan.Ts_site_base[footfall.row], plan.waypoints[footfall.row]
            np.testing.assert_allclose(shown["/robot"].position, at[:3, 3], atol=0.01)
            for body, T_base_body in enumerate(placed(robot, q).Ts_base_body):
                np.testing.assert_allclose(shown[f"/robot/{body}"].position, T_base_body[:3, 3], atol=0.01)
            np.testing.assert_allclose(shown[f"/walk/{number}"].position[:2], footfall.point[:2], atol=1e-6)
            assert viewer.in_words(footfall.row).startswith(f"foot move {number} of {len(plan.moves)}: leg ")
        viewer.next()
        assert viewer.moment == 1.0
        end = np.array(server.scene._handle_from_node_name["/robot"].position)
        np.testing.assert_allclose(end, plan.end.T_site_base[:3, 3], atol=1e-6)
        viewer.previous()
        assert 0.0 < viewer.moment < 1.0
        viewer.play()
        until(lambda: viewer.moment == 1.0, "the end of the walk")
    finally:
        viewer.close()


def test_it_closes_while_the_walk_comes_to_its_end(server, parts, monkeypatch):
    robot, dem, result = parts
    viewer = WalkViewer(server, robot, dem, result)
    closing = threading.Thread(target=viewer.close, daemon=True)

    def comes_to_the_end(step: int) -> None:
        viewer._scrubber.value = STEPS
        if not closing.is_alive():
            closing.start()
        until(viewer._ended.is_set, "closing to begin")

    monkeypatch.setattr(viewer, "_go", comes_to_the_end)
    viewer.play()
    until(lambda: closing.ident is not None, "the end of the walk")
    closing.join(BOUND)
    assert not closing.is_alive()


def test_checks_are_told_with_sign_margin_and_what_was_not_checked(parts):
    _, _, result = parts
    text = checks_text(result)
    for check in result.checks:
        assert f"| {'●' if check.holds else '✕'} {check.name} |" in text
    for unchecked in result.unchecked:
        assert f"▲ not checked: {unchecked}" in text


def test_a_walk_without_motion_is_refused(server, parts):
    robot, dem, result = parts
    still = LeggedResult(Status.GOAL_INVALID, None, "the goal is off the map", (), (), (), result.provenance)
    with pytest.raises(InvalidInput, match="no motion to look at: the goal is off the map"):
        WalkViewer(server, robot, dem, still)


def test_only_pages_of_this_computer_are_answered(server):
    port = server.get_port()
    url = f"http://127.0.0.1:{port}"

    def page(**headers: str) -> int:
        return httpx.get(url, headers=headers, trust_env=False, verify=False).status_code

    assert page() == page(Origin=url) == page(Host=f"localhost:{port}") == 200
    assert page(Host="other.example") == page(Host=f"other.example:{port}") == 403
    assert page(Origin="http://other.example") == page(Origin="null") == page(Origin=f"http://localhost:{port}") == 403
    with connect(f"ws://127.0.0.1:{port}", subprotocols=[PROTOCOL], origin=Origin(url), proxy=None, max_size=None):
        pass
    with pytest.raises(InvalidStatus) as refused:
        connect(f"ws://127.0.0.1:{port}", subprotocols=[PROTOCOL], origin=Origin("http://other.example"), proxy=None)
    assert refused.value.response.status_code == 403
    with pytest.raises(Conflict, match=f"port {port} can't be had"):
        open_on_this_computer(port)


def test_the_command_says_where_and_ends_when_asked(walked):
    command = [*FOOTFALL, "view", str(walked / "walk.npz"), *asked(walked), "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        said = process.stdout.readline().strip()
        try:
            assert said.startswith("walk.npz is shown on http://127.0.0.1:"), said
            assert httpx.get(said.split()[-1], trust_env=False, verify=False).status_code == 200
        finally:
            process.send_signal(signal.SIGINT)
            assert process.wait(BOUND) == 0


def test_what_can_not_be_shown_is_refused(walked, tmp_path):
    walk = walked / "walk.npz"
    assert "is no robot.toml" in run("view", walk, "--robot", "athlete", *asked(walked)[2:], code=2).stderr
    assert "there is no file" in run("view", tmp_path / "none.npz", *asked(walked), code=2).stderr
    write_terrain(plane(5.0, 0.1), tmp_path / "other.tif")
    other = [*asked(walked)[:3], str(tmp_path / "other.tif")]
    assert "was planned with another terrain" in run("view", walk, *other, code=2).stderr
    (tmp_path / "bad.npz").write_bytes(b"nothing")
    assert "holds no plan of FootFall" in run("view", tmp_path / "bad.npz", *asked(walked), code=2).stderr
