"""A rover is recorded by a real server; the recording is downloaded, and played into a second session as that rover."""

import asyncio
import io
import itertools
import json
import subprocess
import sys
import threading
from contextlib import closing

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from typer.testing import CliRunner
from websockets.asyncio.server import serve
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from footfall.cli import app
from footfall.core.errors import Conflict, InvalidInput
from footfall.core.frames import transform
from footfall.io.account_store import FILE
from footfall.io.link_images import decode_images, encode_images
from footfall.io.recordings import MEASURED
from footfall.io.recordings.reading import Recording
from footfall.io.recordings.writing import RecordingWriter
from footfall.session.access.accounts import Accounts
from footfall.session.access.identity import Identity, Role
from footfall.session.replay.recordings import replay_recording
from footfall.sim import player as players
from footfall.sim.player import Playback, Player
from footfall.telemetry.images import Camera, ImagePair, Snapshot
from footfall.telemetry.link import SUBPROTOCOL, HelloMessage, encode
from footfall.telemetry.state import TelemetryFrame
from tests.support.frames import JOINTS, digests, moving_frames
from tests.support.server import Running, running_server
from tests.support.undeclared import undeclared
from tests.support.waiting import BOUND, until

COMMAND = [sys.executable, "-c", "from footfall.cli import main; main()", "play"]


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """A running server with an empty session and no rover."""
    with running_server(tmp_path_factory.mktemp("sessions"), prepare=lambda s: s.create("first")) as running:
        yield running


@pytest.fixture(autouse=True)
def no_earlier_rover(plain):
    """The rover of the test before has left."""
    plain.until_rover_left()


def link_of(server: Running) -> str:
    return "ws" + server.api.removeprefix("http") + "/rover"


def say(server: Running, frames: list[TelemetryFrame]) -> None:
    """What a rover says, one frame after the other."""
    live = server.sessions.current
    assert live is not None
    with connect(link_of(server), subprotocols=[Subprotocol(SUBPROTOCOL)], proxy=None) as socket:
        socket.send(encode(HelloMessage("athlete", 6)))
        for frame in frames:
            socket.send(encode(frame))
        until(lambda: live.rover.frame is not None and live.rover.frame.number == frames[-1].number, "the last frame")
    until(lambda: not live.rover.link.connected, "the end of the link")


def recorded(frames: list[TelemetryFrame], path, period: float = 0.1) -> Recording:
    with path.open("wb") as file:
        writer = RecordingWriter(file, JOINTS, {"robot": "athlete", "legs": "6"})
        for i, frame in enumerate(frames):
            writer.frame(frame, round(1e9 * period * i))
        writer.finish()
    return Recording(path)


def listed(server: Running, session: str = "current") -> list[dict]:
    with server.client() as client:
        return client.get(f"/sessions/{session}/recordings").json()["recordings"]


def kept(server: Running, session: str, folder) -> list[TelemetryFrame]:
    """All frames that a session recorded, as downloaded."""
    found: list[TelemetryFrame] = []
    for one in listed(server, session):
        with server.client() as client:
            path = folder / f"{session}-{one['name']}"
            path.write_bytes(client.get(one["url"].removeprefix("/api/v1")).content)
        found += Recording(path).frames()
    return found


def test_record_download_and_play_into_a_second_session(plain, tmp_path):
    frames = [frame for frame in moving_frames(60) if frame.number not in (20, 21, 40)]
    first = plain.sessions.create("recorded")
    say(plain, frames)
    (one,) = until(lambda: listed(plain, first.id), "the recording")
    assert one["finished"] is False
    assert one["name"].endswith(".mcap")
    until(lambda: len(kept(plain, first.id, tmp_path)) == len(frames), "the last chunk on the disk")

    first.close()
    (one,) = listed(plain, first.id)
    assert one["finished"] is True
    assert (one["frames"], one["gaps"], one["restarts"], one["dropped"]) == (57, 3, 0, 0)
    document = plain.app.openapi()
    assert undeclared(one, document["components"]["schemas"]["TelemetryFile"], document) == []
    with plain.client() as client:
        answer = client.get(f"/sessions/{first.id}/recordings/{one['name']}")
        assert answer.headers["content-disposition"] == f'attachment; filename="{one["name"]}"'
        part = client.get(f"/sessions/{first.id}/recordings/{one['name']}", headers={"Range": "bytes=0-7"})
        assert (part.status_code, part.content) == (206, answer.content[:8])
        assert client.get(f"/sessions/{first.id}/recordings/session.json").status_code == 404
    decoded = make_reader(io.BytesIO(answer.content), decoder_factories=[DecoderFactory()])
    positions = [list(message[3].position) for message in decoded.iter_decoded_messages(topics=[MEASURED])]
    assert positions == [frame.state.posture.tolist() for frame in frames]

    path = tmp_path / one["name"]
    path.write_bytes(answer.content)
    second = plain.sessions.create("played")
    command = [*COMMAND, str(path), "--url", link_of(plain), "--rate", "10", "--json"]
    run = subprocess.run(command, capture_output=True, text=True, timeout=BOUND)
    assert run.returncode == 0, run.stderr
    told = json.loads(run.stdout)
    assert told["played"]["frames"] == 57
    assert told["recorded"]["gaps"] == 3
    until(lambda: second.rover.link.frames == 57, "the last frame")
    assert (second.rover.link.gaps, second.rover.link.late, second.rover.link.faults) == (3, 0, 0)
    second.close()
    assert digests(kept(plain, second.id, tmp_path)) == digests(frames)
    (again,) = listed(plain, second.id)
    reports = [replay_recording(one) for one in (path, tmp_path / f"{second.id}-{again['name']}")]
    assert [report.problems for report in reports] == [(), ()]
    assert reports[0].counts == reports[1].counts == {"frames": 57, "gaps": 3, "restarts": 0, "dropped": 0}
    assert reports[0].digest == reports[1].digest


def play(server: Running, recording: Recording, rate: float = 20.0, start: float = 0.0) -> Player:
    return Player(link_of(server), recording, Playback(rate, start))


def test_commands_are_refused_and_a_stop_pauses(plain, tmp_path):
    live = plain.sessions.create("stopped")
    recording = recorded(moving_frames(400), tmp_path / "a.mcap")
    player = play(plain, recording, rate=4.0)
    loops = []

    async def run() -> None:
        loops.append(asyncio.get_running_loop())
        await player.run()

    thread = threading.Thread(target=lambda: asyncio.run(run()))
    thread.start()
    until(lambda: live.rover.frame is not None and live.rover.frame.number > 10, "the recording under way")
    live.commands.stop("look at this")
    until(lambda: live.commands.gate["stop_acknowledged"], "the acknowledgement")
    live.rover.request_images()
    until(lambda: "takes no new images" in live.rover.link.fault, "the refusal of images")
    command = {"type": "command", "id": "c1", "sequence": "s", "row": 0, "name": "WAIT", "leg": None, "joints": None}
    live.rover.link.send(json.dumps({**command, "duration": 1.0, "force": None, "epoch": 0}))
    until(lambda: "c1" in told(live), "the refusal of the command")
    assert told(live)["c1"] == ("refused", players.REFUSAL)
    assert live.rover.frame is not None
    held = live.rover.frame.number
    assert held < 399
    loops[0].call_soon_threadsafe(player.control, "rate 100")
    live.commands.clear_stop()
    thread.join(BOUND)
    assert not thread.is_alive()
    until(lambda: live.rover.frame.number == 399, "the last frame")
    assert (live.rover.link.gaps, live.rover.link.late) == (0, 0)


def told(live) -> dict[str, tuple[str, str]]:
    """Acknowledgements of commands in the recording that is being written."""
    found = {}
    for path in live.rover.recorder.paths():
        try:
            said = list(Recording(path).said())
        except InvalidInput:
            continue  # nothing is on the disk yet
        for one in said:
            if isinstance(one.content, dict) and one.content.get("type") == "ack":
                found[one.content["id"]] = (one.content["state"], one.content["reason"])
    return found


def test_seek_back_and_forth(plain, tmp_path):
    live = plain.sessions.create("sought")
    # so long that the player is not done before it is told to go back
    frames = moving_frames(300)
    recording = recorded(frames, tmp_path / "a.mcap")
    player = play(plain, recording, rate=3.0)
    seen: list[int] = []
    live.listen(lambda message: seen.append(message["frame"].number) if message["type"] == "telemetry" else None)

    async def run() -> None:
        playing = asyncio.create_task(player.run())
        while not seen or seen[-1] < 20:
            assert not playing.done()
            await asyncio.sleep(0.01)
        player.control("seek 14.95")
        player.control("pause")
        paused = -1
        while len(seen) != paused:  # what was on its way has come
            paused = len(seen)
            await asyncio.sleep(0.5)
        assert seen[-1] < 299
        player.control("go")
        while seen[-1] < 155:
            assert not playing.done()
            await asyncio.sleep(0.01)
        player.control("seek 0.5")
        player.control("rate 50")
        await playing

    asyncio.run(run())
    until(lambda: seen[-1] == 299, "the last frame")
    jumps = [(a, b) for a, b in itertools.pairwise(seen) if b != a + 1]
    assert len(jumps) == 2
    assert jumps[0][1] == 150
    assert jumps[1][1] == 5
    assert (player.played.connections, live.rover.link.restarts, live.rover.link.late) == (2, 1, 0)


def test_the_command_is_controlled_by_lines(plain, tmp_path):
    live = plain.sessions.create("controlled")
    recorded(moving_frames(600), tmp_path / "a.mcap")
    command = [*COMMAND, str(tmp_path / "a.mcap"), "--url", link_of(plain), "--control"]
    lines = "dance\nseek 59.5\nrate 50\n"
    run = subprocess.run(command, input=lines, capture_output=True, text=True, timeout=BOUND)
    assert run.returncode == 0, run.stderr
    assert "say pause, go, seek SECONDS or rate FACTOR" in run.stderr
    until(lambda: live.rover.frame is not None and live.rover.frame.number == 599, "the last frame")
    assert 5 <= live.rover.link.frames < 100
    assert run.stdout == f"{live.rover.link.frames} frames and 0 sets of images of athlete played\n"


def test_a_recording_that_goes_back_is_played_as_it_was_taken(plain, tmp_path):
    frames = moving_frames(15, first=30) + moving_frames(15)
    live = plain.sessions.create("restarted")
    player = play(plain, recorded(frames, tmp_path / "a.mcap"))
    asyncio.run(player.run())
    until(lambda: live.rover.link.frames == len(frames), "the last frame")
    live.close()
    assert digests(kept(plain, live.id, tmp_path)) == digests(frames)


def test_images_are_played_too(plain, tmp_path, nav_snapshot):
    live = plain.sessions.create("images")
    path = tmp_path / "a.mcap"
    frames = moving_frames(3)
    with path.open("wb") as file:
        writer = RecordingWriter(file, JOINTS, {"robot": "athlete", "legs": "6"})
        writer.frame(frames[0], 0)
        writer.images(nav_snapshot, 10)
        writer.frame(frames[1], 20)
        writer.finish()
    played = asyncio.run(play(plain, Recording(path)).run())
    assert (played.frames, played.images) == (2, 1)
    until(lambda: live.state.snapshot, "the images")
    assert live.state.snapshot == nav_snapshot.digest
    live.close()
    (again,) = live.rover.recorder.paths()
    (sent,) = [one.content for one in Recording(again).said() if isinstance(one.content, bytes)]
    assert decode_images(sent)[1].digest == nav_snapshot.digest


@pytest.fixture
def nav_snapshot():
    left = np.random.default_rng(0).integers(0, 256, (12, 16), dtype=np.uint8)
    cameras = [
        Camera(side, 16, 12, 20.0, 20.0, 8.0, 6.0, transform(translation=(x, 0.0, 0.0)))
        for side, x in (("l", 0.0), ("r", 0.3))
    ]
    pair = ImagePair("nav0", 5.0, left, left, cameras[0], cameras[1], np.eye(4))
    return decode_images(encode_images("x", Snapshot(moving_frames(1)[0].state, (pair,))))[1]


def test_a_second_rover_is_told_to_the_player(plain, tmp_path, monkeypatch):
    monkeypatch.setattr(players, "PATIENCE", 0.3)
    recording = recorded(moving_frames(5), tmp_path / "a.mcap")
    with connect(link_of(plain), subprotocols=[Subprotocol(SUBPROTOCOL)], proxy=None) as socket:
        socket.send(encode(HelloMessage("athlete", 6)))
        with pytest.raises(Conflict, match="without another rover"):
            asyncio.run(play(plain, recording).run())


def test_a_server_with_accounts_wants_a_rovers_token_of_the_player(tmp_path, monkeypatch):
    monkeypatch.setattr(players, "PATIENCE", 0.3)
    path = tmp_path / "a.mcap"
    recorded(moving_frames(3), path)
    with closing(Accounts(tmp_path / FILE)) as accounts:
        token = accounts.add_token("player", None, Identity("boss", Role.ADMIN, "command line"))
        with running_server(tmp_path / "kept", accounts=accounts, prepare=lambda s: s.create("guarded")) as guarded:
            command = ["play", str(path), "--url", link_of(guarded), "--rate", "100", "--json"]
            refused = CliRunner().invoke(app, command)
            assert (refused.exit_code, "HTTP 403" in refused.stderr) == (2, True), refused.output
            monkeypatch.setenv("FOOTFALL_ROVER_TOKEN", token)
            played = CliRunner().invoke(app, command)
    assert played.exit_code == 0, played.output
    assert json.loads(played.stdout)["played"]["frames"] == 3


def test_a_server_that_leaves_is_told_even_while_paused(tmp_path):
    async def leave(socket) -> None:
        await socket.recv()
        await asyncio.sleep(0.2)
        await socket.close(1001, "good night")

    async def run() -> None:
        async with serve(leave, "127.0.0.1", 0, subprotocols=[Subprotocol(SUBPROTOCOL)]) as server:
            url = f"ws://127.0.0.1:{next(iter(server.sockets)).getsockname()[1]}"
            player = Player(url, recorded(moving_frames(5), tmp_path / "a.mcap"), Playback())
            player.control("pause")
            await asyncio.wait_for(player.run(), 60)

    with pytest.raises(Conflict, match="good night"):
        asyncio.run(run())


def test_the_clock_of_a_playback():
    now = 100.0
    clock = Playback(2.0, 10.0, lambda: now)
    now = 101.0
    assert (clock.position, clock.held) == (10.0, True)
    clock.release(players.LINK)
    now = 104.0
    assert clock.position == 16.0
    assert clock.wait(20.0) == 2.0
    clock.hold(players.PAUSED)
    clock.hold(players.STOPPED)
    now = 110.0
    assert (clock.position, clock.wait(20.0)) == (16.0, None)
    clock.release(players.PAUSED)
    assert clock.held
    clock.release(players.STOPPED)
    clock.set_rate(0.5)
    now = 112.0
    assert clock.position == 17.0
    clock.seek(3.0)
    assert (clock.position, clock.wait(1.0)) == (3.0, 0.0)
    for rate in (0.0, 0.09, 101.0, float("nan")):
        with pytest.raises(InvalidInput, match=r"0\.1 to 100"):
            clock.set_rate(rate)


@pytest.mark.parametrize("line", ["", "seek", "seek far", "rate 0", "rate", "dance"])
def test_what_is_no_control_is_refused(line, tmp_path):
    player = Player("ws://127.0.0.1:9", recorded(moving_frames(2), tmp_path / "a.mcap"), Playback())
    with pytest.raises(InvalidInput):
        player.control(line)


def test_misuse_of_the_command_is_told(tmp_path):
    path = tmp_path / "a.mcap"
    recorded(moving_frames(2), path)
    for arguments, says in (
        ([str(tmp_path / "none.mcap")], "there is no recording"),
        ([str(path), "--rate", "1000"], "0.1 to 100 times"),
        ([str(path), "--from", "7"], "behind its end"),
    ):
        run = CliRunner().invoke(app, ["play", *arguments])
        assert run.exit_code == 2
        assert says in run.stderr
