"""Whether a small robot moved is judged by its own size, wherever it is asked: by the gate, by products, of images."""

from dataclasses import replace

import numpy as np
import pytest

from footfall.core.frames import transform
from footfall.planning.legged.measured import measured_at_rest
from footfall.planning.legged.problem import LeggedSettings
from footfall.session.gate.checks import POSE_TOLERANCE, START_TOLERANCE
from footfall.session.jobs.local import InlineJobs
from footfall.session.jobs.product_recipes import PRODUCTS
from footfall.session.jobs.requests import DescribedMapRequest
from footfall.session.products.kinds import DESCRIBED_MAPS
from footfall.session.products.snapshot_age import moved_since
from footfall.session.products.up_to_date import MEASURED, PLACE_TOLERANCE, SENT, difference, near_enough_in_words
from footfall.session.registry import Sessions
from footfall.session.replay.recompute import replay
from footfall.telemetry.joint_layout import JointLayout
from footfall.telemetry.state import RobotState, TelemetryFrame
from footfall.terrain.generate import fractal
from tests.support.described import robot_of

LEGS = 4


@pytest.fixture
def live(tmp_path):
    with Sessions(tmp_path, jobs=InlineJobs()) as sessions:
        session = sessions.create("small", robot_of(LEGS)[1])
        session.terrains.load(fractal(2.4, 0.2, roughness=0.0, seed=3), "made for the tests")
        session.rover.connected(lambda _: None)
        yield session


def further(state: RobotState, east: float) -> RobotState:
    return replace(state, T_site_base=transform(None, (east, 0.0, 0.0)) @ state.T_site_base)


def hear(live, number: int, state: RobotState) -> None:
    live.rover.take_telemetry(TelemetryFrame(number, replace(state, time=float(number)), state.posture))


def test_images_and_stances_are_of_a_robot_that_stands_as_near_as_it_is_small(live):
    stands = measured_at_rest(live.any_robot, live.get(live.state.dem))
    reach = live.reach
    assert 0.1 < reach < 0.6
    hear(live, 0, stands)
    frozen = live.stances.standing_now()["state"]
    # less than a small robot may be measured off, and what only a large one may be
    hear(live, 1, further(stands, 0.8 * reach * PLACE_TOLERANCE))
    assert not live.stances.moved_since_frozen()
    assert live.stances.standing_now()["state"] == frozen
    hear(live, 2, further(stands, 1.2 * reach * PLACE_TOLERANCE))
    assert live.stances.moved_since_frozen()
    assert live.stances.standing_now()["state"] != frozen
    for number, share, moved in ((3, 0.8, False), (4, 1.2, True)):
        hear(live, number, further(stands, share * reach * POSE_TOLERANCE))
        assert moved_since(live, live.rover, stands)["moved"] is moved


def test_maps_that_ran_out_of_time_need_not_come_out_the_same(live):
    stands = measured_at_rest(live.any_robot, live.get(live.state.dem))
    hear(live, 0, stands)
    recipe = PRODUCTS["described_maps"]

    def replayed(recorded: float, again: float):
        request = DescribedMapRequest(0, LeggedSettings(time_limit=recorded))
        digest = live.stances.ask(DESCRIBED_MAPS, request, leg=0).finish()

        def make(parents, settings, progress):
            return recipe(parents, replace(settings, settings=LeggedSettings(time_limit=again)), progress)

        report = replay(live.export_bundle(), recipes={**PRODUCTS, "described_maps": make})
        (found,) = [one for one in report.products if one.recorded == digest]
        return found.verdict, found.text, report.ok

    enough, none = 600.0, 1e-9
    verdict, text, ok = replayed(none, enough)
    assert (verdict, ok) == ("not_reproducible", True)
    assert "ran into its time limit when it was recorded" in text
    assert replayed(enough, enough)[0] == "same"
    verdict, text, ok = replayed(0.9 * enough, none)
    assert (verdict, ok) == ("different", False)
    assert "ran into its time limit in this replay" in text


def test_a_joint_that_slides_may_be_off_by_a_share_of_the_reach():
    layout, reach = JointLayout(("a", "b", "c"), (("a0",), ("turns",), ("slides",)), ("slides",)), 0.25
    state = RobotState("r", 0.0, np.zeros(3), np.eye(4), np.zeros((3, 3)), np.zeros(3), "idle", described=layout)

    def off(turned: float, slid: float):
        now = replace(state, posture=np.array((0.0, turned, slid)))
        return difference(state.posture, state.T_site_base, now, layout.joint_names, reach, layout.sliding)

    assert off(0.9 * START_TOLERANCE, 0.9 * reach * START_TOLERANCE).beyond(*SENT) == ""
    slid = off(0.9 * START_TOLERANCE, -1.1 * reach * START_TOLERANCE)
    assert (slid.joint, slid.slides, slid.beyond(*SENT)) == ("slides", True, "joint")
    near = off(0.0, 0.9 * reach * START_TOLERANCE)
    assert near.beyond(*MEASURED) == "joint"
    assert f"{POSE_TOLERANCE * reach:.2g} m and {START_TOLERANCE * reach:.2g} m;" in near_enough_in_words(near)
