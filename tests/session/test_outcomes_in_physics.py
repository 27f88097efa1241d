"""What came of a run, told by the session: rovers in physics on the ground of the map, and on other ground."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import footfall
from footfall.core.frames import apply
from footfall.planning.body.body_shift import BodyShift
from footfall.robot.kinematics import wheel_centers
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.session.replay.recompute import replay
from footfall.terrain.generate import plane
from tests.support.physical_link import Linked

LEG = 2


def stepped(tmp_path, athlete, dem, world=None, as_commanded=False, shift=None):
    """What came of a step, or a ``shift`` of the chassis, on ``world`` that was planned on ``dem``; ``world`` is told
    the step's goal [m].
    """
    pytest.importorskip("mujoco")
    from footfall.sim.physics.physics_settings import Noise, PhysicsSettings
    from footfall.sim.physics.rover import PhysicalRover

    stands = footfall.stand(athlete, dem)
    x, y, _ = apply(stands.T_site_base, wheel_centers(athlete, stands.posture))[LEG]
    goal = (float(x) + 0.1, float(y) - 0.3)
    truth = dem if world is None else world(dem, goal)
    settings = PhysicsSettings(noise=Noise(encoder=1e-4, position=1e-3, force=5.0))
    rover = PhysicalRover(athlete, truth, stands, settings)
    rover.step(2.0)
    with Sessions(tmp_path / "sessions", jobs=InlineJobs(), robot=athlete) as sessions:
        live: Any = sessions.create("physics")
        live.terrains.load(dem)
        linked = Linked(live, rover)
        live.stances.freeze()
        planned = live.plans.step(LEG, goal).finish() if shift is None else live.stances.plan_body_move(shift).finish()
        live.sequences.make(planned, as_commanded=as_commanded)
        linked.report()
        assert live.outcomes.latest()["state"] == "none"
        live.commands.send(live.commands.arm()["token"])
        linked.run()
        assert live.state.run.outcome == "done"
        assert live.outcomes.latest()["state"] == "waiting"
        for _ in range(50):
            rover.step(0.04)
            linked.report()
        told = live.commands.run["compared"]
        report = replay(live.export_bundle())
        assert report.ok, report.as_dict()
        assert [event.payload["kind"] for event in live.events() if event.type == "product"][-1] == "outcome"
    return told


def of(told, quantity):
    return [one for one in told["differences"] if one["quantity"] == quantity]


def lowered(by):
    def world(dem, goal):
        grid = dem.geometry
        xs = grid.x0 + (np.arange(grid.cols) + 0.5) * grid.resolution
        ys = grid.y0 + (np.arange(grid.rows) + 0.5) * grid.resolution
        near = np.hypot(xs[None] - goal[0], ys[:, None] - goal[1]) < 0.25
        return replace(dem, heights=np.where(near, dem.heights - np.float32(by), dem.heights))

    return world


def test_a_step_with_the_pose_held_goes_as_predicted(tmp_path, athlete):
    told = stepped(tmp_path, athlete, plane(size=10.0, resolution=0.1))
    assert (told["state"], told["verdict"], told["rigid"]) == ("compared", "as_predicted", False), told
    assert {one["quantity"] for one in told["differences"]} == {"touch-down", "load", "drift", "sink"}
    assert len(of(told, "load")) == athlete.leg_count
    assert [one["leg"] for one in of(told, "touch-down")] == [LEG]
    assert all(one["advice"] == "" for one in told["differences"])
    # what is called good is good
    assert of(told, "touch-down")[0]["measured"] < 0.01
    assert max(abs(one["difference"]) for one in of(told, "load")) < 40


def test_ground_lower_than_the_map_says_is_told_with_the_numbers(tmp_path, athlete):
    told = stepped(tmp_path, athlete, plane(size=10.0, resolution=0.1), lowered(0.03))
    assert told["verdict"] == "differs"
    load = of(told, "load")[LEG]
    assert load["verdict"] == "differs"
    assert load["difference"] < -load["uncertainty"] < 0
    assert f"leg {LEG} bears {load['measured']:.0f} N, predicted {load['predicted']:.0f}" in load["text"]
    assert "build the terrain anew" in load["advice"]


def test_a_map_that_knows_its_errors_is_not_blamed_for_them(tmp_path, athlete):
    flat = plane(size=10.0, resolution=0.1)
    unsure = replace(flat, variance=np.full(flat.heights.shape, 0.02**2, np.float32))
    told = stepped(tmp_path, athlete, unsure, lowered(0.02))
    assert {one["verdict"] for one in of(told, "load")} == {"as_predicted"}, told
    assert told["verdict"] == "as_predicted"


def test_a_sagging_rover_commanded_as_rigid_is_never_called_good(tmp_path, athlete):
    told = stepped(tmp_path, athlete, plane(size=10.0, resolution=0.1), as_commanded=True)
    assert (told["verdict"], told["rigid"]) == ("differs", True)
    touch = of(told, "touch-down")[0]
    assert touch["verdict"] == "differs"
    assert touch["advice"].startswith("make the next commands with the pose held")
    assert {one["verdict"] for one in of(told, "load")} == {"not_told"}
    assert all(one["predicted"] is None and "which was not predicted" in one["text"] for one in of(told, "load"))


SHIFT = BodyShift(dx=0.06, dz=-0.1)


def test_a_move_of_the_chassis_with_the_pose_held_goes_as_predicted(tmp_path, athlete):
    told = stepped(tmp_path, athlete, plane(size=10.0, resolution=0.1), shift=SHIFT)
    assert (told["verdict"], told["rigid"]) == ("as_predicted", False), told
    assert [one["quantity"] for one in told["differences"]] == ["load"] * athlete.leg_count + ["drift", "sink"]
    [drift], [sink] = of(told, "drift"), of(told, "sink")
    # what is called good is good: the chassis is where it was meant to, which was not asked of the prediction
    assert abs(drift["measured"] - 0.06) < 0.01
    assert abs(sink["measured"] - 0.1) < 0.01
    assert max(abs(one["difference"]) for one in of(told, "load")) < 40


def test_a_move_of_the_chassis_commanded_as_rigid_is_never_called_good(tmp_path, athlete):
    told = stepped(tmp_path, athlete, plane(size=10.0, resolution=0.1), as_commanded=True, shift=SHIFT)
    assert told["rigid"]
    assert told["verdict"] in ("differs", "not_told")
    assert {one["verdict"] for one in of(told, "load")} == {"not_told"}
