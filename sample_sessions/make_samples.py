"""Makes the sample sessions anew: ``python -m sample_sessions.make_samples [NAME…]``.

Each is a whole session done by script, with the same jobs as in the browser. The rover is simulated: it stands on
generated ground, and its images are ray-cast. Needed after a change that alters recorded products on purpose.
"""

import io
import shutil
import sys
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from footfall.processor import LATE, choose_arithmetic  # isort: skip (it comes before numpy)

import numpy as np

import footfall
from benchmarks.walks.rappel import hanging
from benchmarks.walks.terrains import terrain
from footfall.core.frames import apply
from footfall.maps.layers import MapSettings
from footfall.planning.answers import Status
from footfall.planning.step.problem import StepSettings
from footfall.planning.walk.problem import WalkGoal, WalkPlan, WalkResult, WalkSettings, foot_moves_in_words
from footfall.planning.watch import patience
from footfall.robot.kinematics import wheel_centers
from footfall.robot.model import Robot
from footfall.sequence.commands import Command, Sequence
from footfall.sequence.edit import Edit
from footfall.session.jobs.local import InlineJobs
from footfall.session.live import LiveSession
from footfall.session.registry import Sessions
from footfall.sim.physics.rover import PhysicalRover
from footfall.sim.render import render_snapshot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.generate import fractal
from footfall.terrain.rocks import add_rocks

HERE = Path(__file__).resolve().parent
HEIGHT_STEP = 2.0**-11
"""[m]"""
LONG = 100.0
"""So many times its limit each plan may take: a machine that compiles kernels meanwhile makes the same sample."""


def wheel(robot: Robot, state: RobotState, leg: int) -> np.ndarray:
    """Where the wheel of a leg is, seen from above [m]."""
    return apply(state.T_site_base, wheel_centers(robot, state.posture))[leg, :2]


def rocky_world(robot: Robot) -> tuple[Dem, RobotState]:
    """Gentle ground with a 0.3 m rock beside the wheel of leg 2, as in the field test, and some farther off.

    Its heights are in steps of HEIGHT_STEP: a sample that brings it along stays small.
    """
    level = fractal(size=9.0, resolution=0.025, roughness=0.02, hurst=0.9, seed=11)
    beside = wheel(robot, footfall.stand(robot, level), 2) + (0.42, -0.12)
    rocks = np.array(
        [
            [*beside, 0.30, 0.15],
            [2.9, 1.4, 0.5, 0.25],
            [0.4, 3.2, 0.4, 0.2],
            [-3.1, -0.9, 0.36, 0.18],
            [0.9, -3.3, 0.6, 0.3],
            [-2.6, 2.7, 0.3, 0.15],
        ]
    )
    rocky = add_rocks(level, rocks)
    world = replace(rocky, heights=(np.round(rocky.heights / HEIGHT_STEP) * HEIGHT_STEP).astype(np.float32))
    return world, at_rest(robot, world)


def at_rest(robot: Robot, world: Dem) -> RobotState:
    """How the rover in physics stands at the origin: as the one that comes with the session will, when it is opened."""
    return PhysicalRover(robot, world, footfall.stand(robot, world)).state()


def looked_around(session: LiveSession, scale: float = 1.0) -> RobotState:
    """How the rover stands in the rocky world, of which it has built a map from images; scale: their size."""
    world, state = rocky_world(session.robot)
    session.terrains.load(world, "the simulated rover's world")
    session.rover.take_images(render_snapshot(session.robot, state, world, seed=1, scale=scale))
    session.terrains.build().finish()
    return state


def rock_step(session: LiveSession) -> None:
    """From nine image pairs to exported commands: leg 2 steps over a rock."""
    state = looked_around(session)
    session.maps.compute(2).finish()
    x, y = wheel(session.robot, state, 2) + (0.75, -0.25)
    session.maps.choose_footfall(2, float(x), float(y))
    plan = session.plans.step(settings=StepSettings(seed=1)).finish()
    require(session, Status.FOUND)
    session.sequences.export(session.sequences.make(plan), "seqjson")
    session.add_note("Leg 2 over the rock, as in the field test of 2008.")


def rock_walk(session: LiveSession) -> None:
    """From image pairs of half the size to the commands of a whole walk: one metre ahead, among the rocks."""
    looked_around(session, scale=0.5)
    walk = session.walks.plan(WalkGoal(1.0, 0.0, 0.0), WalkSettings(seed=2)).finish()
    plan = walk_of(session, walk)
    sequence = session.walks.command(walk, 0, plan.foot_moves + 1)
    session.sequences.export(sequence, "csv")
    session.add_note(f"{foot_moves_in_words(plan)}, and the chassis is a metre farther.")


def rappel(session: LiveSession) -> None:
    """Down 2.75 m of an irregular slope of 60°, on a tether. No model says how a rover sags on one: nothing is sent."""
    metres = 2.75
    slope = terrain("rappel", 0, metres)
    tether, begin, end, yaw = hanging(slope, "rappel", metres)
    session.terrains.load(slope, "an irregular slope of 60°")
    session.stances.set(footfall.stand(session.robot, slope, *begin, yaw, tether=tether))
    walk = session.walks.plan(WalkGoal(*end, yaw), WalkSettings(seed=1), tether=tether).finish()
    session.add_note(f"{foot_moves_in_words(walk_of(session, walk))} down the slope, on a tether.")


def fractal_step(session: LiveSession) -> None:
    """A step on fractal ground, searched by SBL, with the support that survives the loss of any leg."""
    world = fractal(size=7.0, resolution=0.04, roughness=0.06, hurst=0.8, seed=5)
    state = at_rest(session.robot, world)
    session.terrains.load(world, "fractal ground")
    session.stances.set(state)
    session.maps.compute(1, MapSettings(conservative=True)).finish()
    x, y = wheel(session.robot, state, 1) + (-0.45, -0.15)
    session.maps.choose_footfall(1, float(x), float(y))
    session.plans.step(settings=StepSettings(planner="sbl", seed=7)).finish()
    require(session, Status.FOUND)
    session.sequences.make()


def refused_step(session: LiveSession) -> None:
    """A footfall that the maps colour red is asked for all the same; the answer says why not."""
    world = fractal(size=7.0, resolution=0.04, roughness=0.03, hurst=0.9, seed=8)
    state = footfall.stand(session.robot, world)
    session.terrains.load(world, "fractal ground")
    session.stances.set(state)
    session.maps.compute(0).finish()
    x, y = wheel(session.robot, state, 0) + (0.8, 0.0)
    session.maps.choose_footfall(0, float(x), float(y))
    session.plans.step(settings=StepSettings(seed=1)).finish()
    require(session, Status.GOAL_INVALID)
    session.add_note("Out of the leg's reach: the body would have to move first.")


def edited_export(session: LiveSession) -> None:
    """A sequence is edited, undone, edited again and exported in every format."""
    world = fractal(size=6.0, resolution=0.04, roughness=0.02, hurst=0.9, seed=9)
    state = footfall.stand(session.robot, world)
    session.terrains.load(world, "fractal ground")
    session.stances.set(state)
    x, y = wheel(session.robot, state, 4) + (0.25, 0.2)
    session.maps.choose_footfall(4, float(x), float(y))
    session.plans.step(settings=StepSettings(planner="line", seed=1)).finish()
    require(session, Status.FOUND)
    made = session.sequences.make(as_commanded=True)  # rows that every format can hold
    sequence = session.get(made)
    assert isinstance(sequence, Sequence)
    commands = sequence.commands
    slower = Command("LEG_MOVE", 4, commands[0].joints, commands[0].duration + 2.0, commands[0].phase)
    session.sequences.edit(made, Edit("set", 0, slower))
    session.sequences.undo()
    waiting = session.sequences.edit(made, Edit("insert", 1, Command("WAIT", None, None, 3.0)))
    final = session.sequences.edit(waiting, Edit("set", 0, slower))
    for form in ("json", "csv", "seqjson"):
        session.sequences.export(final, form)


def walk_of(session: LiveSession, digest: str) -> WalkPlan:
    """The walk that was planned; where none was found, the script has to be looked at."""
    found = session.get(digest)
    assert isinstance(found, WalkResult)
    if found.plan is None:
        sys.exit(f"{session.name}: {found.status}, {found.reason}")
    return found.plan


def require(session: LiveSession, status: Status) -> None:
    """The scripts are made for one outcome; anything else means that they have to be looked at."""
    if session.state.plan_status != status.value:
        sys.exit(f"{session.name}: {session.state.plan_status}, {session.state.plan_reason}")


SAMPLES: dict[str, tuple[str, Callable[[LiveSession], None]]] = {
    "rock-step": ("Stepping over a rock", rock_step),
    "rock-walk": ("A walk of one metre, from images", rock_walk),
    "rappel": ("Down a slope of 60° on a tether", rappel),
    "fractal-step": ("A step on fractal ground", fractal_step),
    "refused-step": ("A step refused", refused_step),
    "edited-export": ("A sequence edited and exported", edited_export),
}


def main(names: list[str]) -> None:
    if not choose_arithmetic():
        sys.exit(LATE)
    for name in names or list(SAMPLES):
        title, script = SAMPLES[name]
        with tempfile.TemporaryDirectory() as work, Sessions(Path(work), jobs=InlineJobs(), recording=None) as sessions:
            session = sessions.create(title)
            with patience(LONG):
                script(session)
            bundle = session.export_bundle()
            shutil.rmtree(HERE / name, ignore_errors=True)
            zipfile.ZipFile(io.BytesIO(bundle)).extractall(HERE / name)
        size = sum(file.stat().st_size for file in (HERE / name).rglob("*") if file.is_file())
        print(f"{name}: {size / 1e6:.2f} MB")


if __name__ == "__main__":
    main(sys.argv[1:])
