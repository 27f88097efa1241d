"""Newer ground makes of a session's products out of date what looked at ground that changed, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from footfall.core.errors import Conflict
from footfall.robot.ik import contact_point
from footfall.session.gate import checks
from footfall.session.jobs.requests import RouteRequest
from footfall.session.products import compared
from footfall.session.products.kinds import ROUTE
from footfall.session.replay.recompute import replay
from footfall.telemetry.state import TelemetryFrame
from tests.support.chassis_ground import wavy

LEG = 2
FAR = (-3.8, -3.8, 0.2, 0.3)
"""A rock in the corner where leg 2 is not: x, y, radius, height [m]."""


def heard(live, number, state):
    live.rover.take_telemetry(TelemetryFrame(number, replace(state, time=float(number)), state.posture))


@pytest.fixture
def made(live, athlete, standing, monkeypatch):
    """The session with maps and a plan of leg 2, commands of it and a route, of a rover that is heard."""
    for module in (compared, checks):  # however slow the machine
        monkeypatch.setattr(module, "STALE_AFTER", 1e9)
    live.rover.connected(lambda text: None)
    heard(live, 0, standing)
    live.maps.compute(LEG).finish()
    x, y, _ = contact_point(athlete, standing.posture, LEG, standing.T_site_base)
    live.plans.step(LEG, (float(x + 0.1), float(y + 0.1))).finish()
    live.sequences.make(as_commanded=True)
    live.stances.ask(ROUTE, RouteRequest((0.8, 0.3))).finish()
    assert fitting(live) == {"maps", "plan", "sequence", "route"}
    return live


def fitting(live):
    told = live.fits.up_to_date()
    of_maps = {"maps"} if told["maps"][str(LEG)]["fits"] else set()
    return of_maps | {name for name in ("plan", "sequence", "route") if told[name]["fits"]}


def taken_again(dem, **otherwise):
    return replace(dem, name="new images", true_north=(0.1, 0.1, 0.1), **otherwise)


def test_new_images_of_the_same_ground_keep_all_but_what_is_sent(made, dem, standing):
    footfall = made.get(made.state.plan).footfall
    before = made.maps.footfall_answer(footfall)
    shown = made.state.maps[str(LEG)]
    made.terrains.load(taken_again(dem, heights=dem.heights + np.float32(0.004)))
    assert made.state.dem != dem.digest
    assert fitting(made) == {"maps", "plan", "route"}
    fit = made.fits.up_to_date()["maps"][str(LEG)]
    assert (fit["verdict"], fit["partly"], fit["ground"]) == ("fresh", False, {"area": 0.0, "by": 0.0})
    assert made.maps.shown(LEG).digest == shown
    assert made.fits.maps_changed(LEG) is None
    assert made.fits.maps_changed(LEG, "age").all()  # which is of the looking
    after = made.maps.footfall_answer(footfall)
    assert (after["acceptable"], after["footing"], after["maps_current"]) == (before["acceptable"], *_of(before))
    assert made.maps.suggest(LEG, count=1) is not None
    # the gate goes by the map itself
    assert made.fits.up_to_date()["sequence"]["reason"] == "the terrain has changed since"
    heard(made, 1, standing)
    with pytest.raises(Conflict, match="the terrain has changed since"):
        made.commands.arm()
    assert replay(made.export_bundle()).ok


def _of(answer):
    return answer["footing"], answer["maps_current"]


def test_a_changed_corner_marks_that_corner_alone(made, dem):
    changed = wavy(rocks=[FAR], half=4.0)
    made.terrains.load(changed)
    assert fitting(made) == {"plan", "route"}
    fit = made.fits.up_to_date()["maps"][str(LEG)]
    assert (fit["fits"], fit["verdict"], fit["partly"]) == (False, "differs", True)
    differs = np.abs(changed.heights - dem.heights) > 0.01
    assert fit["ground"]["area"] == pytest.approx(0.01 * differs.sum())
    assert fit["ground"]["by"] == pytest.approx(np.abs(changed.heights - dem.heights).max(), abs=1e-6)
    assert fit["reason"].startswith("the terrain has changed since: by up to 0.")
    marked, grid = made.fits.maps_changed(LEG), dem.geometry
    assert marked[differs].all()
    away = np.hypot(grid.xs - FAR[0], (grid.ys - FAR[1])[:, None])
    assert not marked[away > 1.5].any()
    assert made.maps.shown(LEG) is not None
    # a footfall is judged by the maps where they hold, and there alone
    footfall = made.get(made.state.plan).footfall
    assert made.maps.footfall_answer(footfall)["maps_current"]
    there = made.maps.footfall_answer(replace(footfall, x=FAR[0], y=FAR[1]))
    assert not there["maps_current"]
    assert there["footing"] is None
    assert "out of date: the terrain has changed since: by up to" in there["reasons"][0]
    with pytest.raises(Conflict, match="the terrain has changed since"):
        made.maps.suggest(LEG)
    # as it was before
    made.terrains.load(dem)
    assert fitting(made) == {"maps", "plan", "sequence", "route"}
    assert replay(made.export_bundle()).ok


def test_changed_ground_under_the_leg_leaves_nothing(made, athlete, standing):
    x, y, _ = contact_point(athlete, standing.posture, LEG, standing.T_site_base)
    made.terrains.load(wavy(rocks=[(x + 0.3, y + 0.3, 0.3, 0.4)], half=4.0))
    assert fitting(made) == set()
    fit = made.fits.up_to_date()["maps"][str(LEG)]
    assert not fit["partly"]
    assert made.maps.shown(LEG) is made.fits.maps_changed(LEG) is None
    assert not made.maps.footfall_answer(made.get(made.state.plan).footfall)["maps_current"]


def test_ground_that_is_forgotten_under_the_plan_is_no_longer_as_it_was(made, dem, athlete, standing):
    x, y, _ = contact_point(athlete, standing.posture, LEG, standing.T_site_base)
    made.terrains.load(wavy(hole=(x + 0.2, y + 0.2, 0.25), half=4.0))
    assert "plan" not in fitting(made)
    assert "became known or unknown" in made.fits.up_to_date()["plan"]["reason"]


def test_a_leg_that_moved_leaves_what_is_of_the_chassis_alone(made, standing):
    posture = standing.posture.copy()
    posture[6 * LEG + 1] += 0.1
    heard(made, 1, replace(standing, posture=posture))
    assert fitting(made) == {"route"}
    assert made.fits.up_to_date()["plan"]["reason"].startswith("the rover moved since: ")
    # and the chassis, a little and much
    T_site_base = standing.T_site_base.copy()
    T_site_base[0, 3] += 0.2
    heard(made, 2, replace(standing, T_site_base=T_site_base))
    assert fitting(made) == set()
    # a moved rover on ground that changed in a corner has no maps that hold in part
    made.terrains.load(wavy(rocks=[FAR], half=4.0))
    assert not made.fits.up_to_date()["maps"][str(LEG)]["partly"]
    heard(made, 3, standing)
    assert made.fits.up_to_date()["maps"][str(LEG)]["partly"]


def test_a_rover_that_is_not_heard_leaves_it_open(made):
    assert made.fits.up_to_date()["unheard"] == ""
    made.rover.disconnected()
    told = made.fits.up_to_date()
    assert "last heard" in told["unheard"]
    assert told["plan"]["fits"]
    assert {told[name]["verdict"] for name in ("plan", "route")} == {"unknown"}
