"""``footfall referee``: exit codes 0, 1 and 2, the text and the JSON."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from footfall.core.frames import apply, transform
from footfall.core.value import Provenance
from footfall.io.artifacts import decode, encode
from footfall.planning.body.stand import stand
from footfall.planning.execution.execution_settings import MODES, ExecutionSettings
from footfall.planning.execution.plan import plan_execution
from footfall.planning.step.plan import plan_step
from footfall.resources import robot_assets_folder
from footfall.robot.description import with_payload
from footfall.robot.ik import solve_leg
from footfall.robot.kinematics import leg_wheel_pose, wheel_centers
from footfall.sequence.commands import Command, Sequence
from footfall.sequence.of_execution import sequence_of_execution
from footfall.sequence.predict import predict
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.sim.physics.laden import LEAST_BOX, laden
from footfall.sim.physics.rover import PhysicalRover
from footfall.terrain.generate import plane
from tests.support.command_line import run

SAMPLE = Path(__file__).resolve().parents[2] / "sample_sessions" / "rock-step"


@pytest.fixture
def up_and_down(athlete, tmp_path) -> Path:
    """A stored sequence: wheel 0 up by 20 cm and down again, 10 cm to the left."""
    posture = athlete.posture("stand")
    joints = []
    for way in ((0.0, 0.0, 0.2), (0.0, 0.1, 0.2), (0.0, 0.1, 0.0)):
        T = leg_wheel_pose(athlete, posture[:6], 0)
        T[:3, 3] += way
        solutions = solve_leg(athlete, 0, T[None])
        found = solutions.q[0][solutions.valid[0]]
        joints.append(found[np.argmin(np.abs(found - posture[:6]).sum(axis=1))])
    phases = ("lift", "swing", "lower")
    commands = tuple(Command("LEG_MOVE", 0, q, 1.0, phase) for q, phase in zip(joints, phases, strict=True))
    height = athlete.wheel_radius - wheel_centers(athlete, posture)[:, 2].min()
    T_site_base = transform(translation=(0.0, 0.0, height))
    sequence = Sequence("athlete", commands, posture, predict(posture, commands), T_site_base, (), Provenance({}))
    path = tmp_path / "sequence.npz"
    path.write_bytes(encode(sequence))
    return path


def test_a_step_passes_on_the_moon_and_fails_on_earth(level, up_and_down):
    said = run("referee", up_and_down, "--terrain", level, "--gravity", "moon").stdout
    assert said.startswith("passed\n")
    assert "lift-off of wheel 0" in said
    assert "touch-down of wheel 0" in said
    assert "3 of 3 commands done" in said
    answer = run("referee", up_and_down, "--terrain", level, "--payload", 300, "--stiffness", 0.5, "--json", code=1)
    about = json.loads(answer.stdout)
    assert about["passed"] is False
    assert "wheel 0 never left the ground" in about["report"]["failures"]
    assert about["report"]["settings"]["physics"]["stiffness_scale"] == 0.5
    assert len(about["report"]["torque"]) == 36


@pytest.fixture(scope="module")
def at_rest(athlete):
    """The frame of a rover in physics that came to rest on level ground, and a step of leg 0 planned from it."""
    dem = plane(size=10.0, resolution=0.1)
    rover = PhysicalRover(athlete, dem, stand(athlete, dem))
    rover.step(2.0)
    frame = rover.frame()
    wheel = apply(frame.state.T_site_base, wheel_centers(athlete, frame.state.posture))[0]
    found = plan_step(athlete, dem, frame.state, 0, (float(wheel[0] - 0.1), float(wheel[1] + 0.1)))
    assert found.plan is not None, found.reason
    return dem, frame, found.plan


@pytest.mark.parametrize("mode", MODES)
def test_what_is_commanded_for_sag_is_judged_by_what_it_predicts(athlete, at_rest, level, mode, tmp_path):
    dem, frame, plan = at_rest
    found = plan_execution(
        athlete, dem, frame.state, plan, ExecutionSettings(mode=mode), commanded=np.array(frame.commanded)
    )
    assert found.execution is not None, found.reason
    commands = sequence_of_execution(found.execution, athlete)
    path = tmp_path / "commands.npz"
    path.write_bytes(encode(commands))
    said = json.loads(run("referee", path, "--terrain", level, "--json").stdout)
    assert said["passed"], said["report"]["failures"]
    assert max(said["report"]["chassis"]) < 0.02
    # the rover sags: held to where it stood before, it would not pass
    assert commands.Ts_site_base is not None
    stays = replace(commands, Ts_site_base=np.tile(commands.T_site_base, (len(commands.commands), 1, 1)))
    path.write_bytes(encode(stays))
    answer = run("referee", path, "--terrain", level, "--json", code=0 if mode == "pose_held" else 1)
    failures = json.loads(answer.stdout)["report"]["failures"]
    assert any("the chassis was" in text for text in failures) == (mode != "pose_held")


def test_a_session_brings_its_ground_along():
    assert run("referee", SAMPLE).stdout.startswith("passed\n")


def test_misuse_is_exit_code_2(level, up_and_down, tmp_path):
    for arguments, text in (
        ([up_and_down], "give --terrain"),
        ([up_and_down, "--terrain", level, "--gravity", "pluto"], "earth, moon, mars"),
        ([up_and_down, "--terrain", level, "--friction", 0], "friction must be above zero"),
        ([up_and_down, "--terrain", level, "--wheel-shape", "square"], "sphere, crowned"),
        ([level, "--terrain", level], "holds no plan"),
        ([tmp_path / "missing.npz", "--terrain", level], "there is no file"),
    ):
        assert text in run("referee", *arguments, code=2).output


def test_the_rover_carries_what_its_commands_were_planned_with(level, up_and_down, tmp_path):
    planned = decode(up_and_down.read_bytes())
    assert isinstance(planned, Sequence)
    place = np.array([0.4, 0.2, 0.3])
    loaded = SequenceSettings(payload_mass=200.0, payload_position=place)
    path = tmp_path / "loaded.npz"
    path.write_bytes(encode(replace(planned, provenance=Provenance({}, loaded))))
    asked = ("--terrain", level, "--gravity", "moon")
    assert "carried 200 kg, their centre at (0.4, 0.2, 0.3) m in base" in run("referee", path, *asked).stdout
    told = [json.loads(run("referee", path, *asked, *more, "--json").stdout) for more in ([], ["--payload", 0])]
    assert (told[0]["payload"]["mass"], told[0]["payload"]["position"]) == (200.0, place.tolist())
    assert told[1]["payload"] is None
    laden, bare = (one["report"] for one in told)
    assert sum(laden["torque"]) > 1.05 * sum(bare["torque"])


def test_the_box_of_a_payload_stays_within_the_usual_one(athlete, up_and_down):
    planned = decode(up_and_down.read_bytes())
    assert isinstance(planned, Sequence)
    assert laden(athlete, planned) is athlete
    usual = with_payload(athlete.description, 1.0).payload
    assert usual is not None
    for place in ((0.4, 0.2, 0.3), (0.0, 0.0, 0.3), (2.0, 0.0, 0.3)):
        settings = SequenceSettings(payload_mass=200.0, payload_position=np.array(place))
        box = laden(athlete, replace(planned, provenance=Provenance({}, settings))).description.payload
        assert box is not None
        out = np.abs(box.position - usual.position) + box.size / 2 - usual.size / 2
        assert (out < 1e-9).all() or (box.size[out >= 1e-9] == LEAST_BOX).all()
    nothing = SequenceSettings(payload_mass=0.0)
    assert laden(athlete, replace(planned, provenance=Provenance({}, nothing))).description.payload is None


def test_a_session_is_judged_with_its_own_robot(athlete, tmp_path):
    description = (robot_assets_folder() / "athlete" / "athlete.toml").parent
    other = tmp_path / "other"
    shutil.copytree(description, other, ignore=shutil.ignore_patterns("*.npz"))
    toml = other / "athlete.toml"
    toml.write_text(toml.read_text().replace("wheel_sink = 0.03", "wheel_sink = 0.02"))
    said = run("referee", SAMPLE, "--robot", toml, code=2).stderr
    assert f"rock-step is a session of another robot than {toml}: leave out --robot" in said
