"""Terrains of a session one upon the other: merged, cleared, undone, and replayed."""

from dataclasses import replace

import numpy as np
import pytest

from footfall.core.errors import Conflict, InvalidBundle, InvalidTerrain
from footfall.planning.body.stand import stand
from footfall.session.jobs.local import InlineJobs
from footfall.session.log.event import next_event
from footfall.session.log.fold import fold, fold_all
from footfall.session.products.kinds import BLEND, CLEAR, TERRAIN
from footfall.session.registry import Sessions
from footfall.session.replay.recompute import replay
from footfall.sim.render import render_snapshot
from footfall.telemetry.state import TelemetryFrame
from footfall.terrain.fusion.clear import Area
from footfall.terrain.generate import rock_field
from footfall.terrain.terrain_settings import TerrainSettings
from tests.support.jobs import meanwhile

COARSE = TerrainSettings(resolution=0.04, matcher="3way", keep=True)


@pytest.fixture(scope="module")
def snapshots(athlete):
    """Two, from two places."""
    world = rock_field(12.0, 0.04, smallest=0.1, largest=0.5, seed=3)
    states = [replace(stand(athlete, world, x=0.3 * i), time=100.0 * i) for i in range(2)]
    return [render_snapshot(athlete, state, world, seed=i, scale=0.5, pairs=["nav0"]) for i, state in enumerate(states)]


@pytest.fixture
def session(athlete, tmp_path):
    with Sessions(tmp_path / "sessions", jobs=InlineJobs(), robot=athlete) as opened:
        yield opened.create("memory")


def test_a_second_snapshot_is_merged_and_can_be_undone(session, snapshots):
    session.rover.take_images(snapshots[0])
    first = session.terrains.build(COARSE).finish()
    assert "map" not in session.state.products[first].parents
    session.rover.take_images(snapshots[1])
    second = session.terrains.build(COARSE).finish()
    assert session.state.products[second].parents["map"] == first
    times = session.get(second).time
    assert {0.0, 100.0} <= set(np.unique(times[np.isfinite(times)]))
    # the same images again replace their own part; they are no new evidence
    assert session.terrains.build(COARSE).finish() == second
    assert session.state.products[second].parents["map"] == first

    cleared = session.terrains.clear(Area(center=tuple(snapshots[1].state.T_site_base[:2, 3] + (2.0, 0.0)), radius=0.5))
    assert np.isfinite(session.get(cleared).heights).sum() < np.isfinite(session.get(second).heights).sum()
    assert session.state.dem == cleared
    assert session.terrains.undo() == second
    assert session.terrains.undo() == first == session.state.dem
    with pytest.raises(Conflict, match="no earlier terrain"):
        session.terrains.undo()

    report = replay(session.export_bundle())
    assert report.ok, report.problems
    assert [product.verdict for product in report.products] == ["same"] * len(report.products)
    assert fold_all(session.events()).digest == session.state.digest


def test_ground_is_as_old_as_its_newest_images_whenever_it_was_built(session, snapshots):
    def seen() -> float:
        return session.summary()["terrain"]["seen"]

    world = rock_field(4.0, 0.1, seed=3)
    session.terrains.load(world, "a file")
    assert seen() == session.events()[-1].time
    for snapshot in snapshots:
        session.rover.take_images(snapshot)
        session.terrains.build(COARSE).finish()
    first, second = (event.time for event in session.events() if event.type == "snapshot_taken")
    assert session.terrains.build(replace(COARSE, resolution=0.05)).finish() == session.state.dem
    assert seen() == second
    session.terrains.clear(Area(center=(2.0, 0.0), radius=0.5))
    session.terrains.blend(world).finish()
    assert seen() == second
    for _ in range(4):
        session.terrains.undo()
    assert seen() == first


def test_when_a_map_is_started_anew(session, snapshots):
    session.rover.take_images(snapshots[0])
    session.terrains.build(COARSE).finish()
    session.rover.take_images(snapshots[1])
    for settings in (replace(COARSE, keep=False), replace(COARSE, resolution=0.05)):
        made = session.terrains.build(settings).finish()
        assert "map" not in session.state.products[made].parents
    session.terrains.load(rock_field(8.0, 0.04, seed=1))
    made = session.terrains.build(COARSE).finish()
    assert "map" not in session.state.products[made].parents


def test_what_was_changed_while_images_are_merged_is_not_lost(session, snapshots):
    area = Area(center=tuple(snapshots[1].state.T_site_base[:2, 3] + (2.0, 0.0)), radius=0.5)
    session.rover.take_images(snapshots[0])
    first = session.terrains.build(COARSE).finish()
    session.rover.take_images(snapshots[1])
    meanwhile(session, TERRAIN, lambda: session.terrains.clear(area))
    with pytest.raises(Conflict, match="the terrain has changed") as caught:
        session.terrains.build(COARSE).finish()
    cleared = session.state.dem
    assert caught.value.details == {"yours": first, "present": cleared}
    assert session.state.products[cleared].kind == CLEAR.name
    # asked again it is laid onto what is there by now
    both = session.terrains.build(COARSE).finish()
    assert session.state.products[both].parents["map"] == cleared
    # a new map takes the place of any other
    meanwhile(session, TERRAIN, lambda: session.terrains.clear(area))
    anew = session.terrains.build(replace(COARSE, keep=False)).finish()
    assert session.state.dem == anew


def test_images_that_were_merged_while_ground_is_changed_are_not_lost(session, snapshots):
    area = Area(center=tuple(snapshots[1].state.T_site_base[:2, 3] + (2.0, 0.0)), radius=0.5)
    session.rover.take_images(snapshots[0])
    session.terrains.build(COARSE).finish()
    session.rover.take_images(snapshots[1])
    meanwhile(session, CLEAR, lambda: session.terrains.build(COARSE).finish())
    with pytest.raises(Conflict, match="the terrain has changed"):
        session.terrains.clear(area)
    merged = session.state.dem
    assert session.state.products[merged].parents["snapshot"] == snapshots[1].digest
    meanwhile(session, BLEND, lambda: session.terrains.undo())
    with pytest.raises(Conflict, match="the terrain has changed"):
        session.terrains.blend(rock_field(4.0, 0.1, seed=3)).finish()
    assert session.state.dem != merged
    # the same, made twice at once, is no other
    meanwhile(session, TERRAIN, lambda: session.terrains.build(COARSE).finish())
    assert session.terrains.build(COARSE).finish() == session.state.dem == merged


def test_what_can_not_be_cleared_is_refused(session, snapshots):
    with pytest.raises(Conflict, match="no terrain"):
        session.terrains.clear(Area(center=(0.0, 0.0), radius=1.0))
    dem = rock_field(4.0, 0.1, seed=1)
    session.terrains.load(dem)
    with pytest.raises(InvalidTerrain, match="nothing to clear"):
        session.terrains.clear(Area(center=(90.0, 0.0), radius=1.0))
    assert session.state.dem == dem.digest


def test_an_undo_that_does_not_fit_the_log_is_refused(session):
    session.terrains.load(rock_field(4.0, 0.1, seed=1))
    with pytest.raises(InvalidBundle):
        fold(session.state, next_event(session.events()[-1], 9e9, "terrain_undone", {"digest": "0" * 32}))


def test_the_rover_stands_where_the_map_says(session, snapshots):
    """A wrong pose moves the images and the state that is planned from alike, and telemetry after it."""
    session.rover.take_images(snapshots[0])
    session.terrains.build(COARSE).finish()
    true = snapshots[1].state.T_site_base
    told = true + np.array([[0, 0, 0, 0.03], [0, 0, 0, -0.02], [0, 0, 0, 0.02], [0, 0, 0, 0]])
    pairs = tuple(replace(pair, T_site_base=told) for pair in snapshots[1].pairs)
    state = replace(snapshots[1].state, T_site_base=told)
    session.rover.take_images(replace(snapshots[1], state=state, pairs=pairs))
    dem = session.get(session.terrains.build(COARSE).finish())
    planned = session.get(session.state.state)
    assert np.allclose(planned.T_site_base, dem.correction @ told, atol=1e-12)
    assert abs(planned.T_site_base[2, 3] - true[2, 3]) < 0.005
    assert np.array_equal(planned.posture, state.posture)
    frozen = session.state.state
    session.rover.take_telemetry(TelemetryFrame(1, state, state.posture))
    assert session.stances.freeze() == frozen
    session.terrains.undo()
    session.rover.take_images(replace(snapshots[1], state=state, pairs=pairs))
    session.terrains.build(COARSE).finish()
    assert session.state.state == frozen
    session.terrains.build(replace(COARSE, keep=False)).finish()
    assert np.array_equal(session.get(session.state.state).T_site_base, told)
    assert replay(session.export_bundle()).ok


def test_pairs_that_could_not_be_used_are_told_to_the_end(session, snapshots):
    """From the link, through the log, to the map and the event of the product."""
    reason = "pair haz1: the left camera gave no image"
    session.rover.take_images(replace(snapshots[0], left_out={"haz1": reason}))
    made = session.terrains.build(COARSE).finish()
    dem = session.get(made)
    assert dict(dem.left_out) == {"haz1": reason}
    assert dem.name.endswith("without haz1 (the left camera gave no image)")
    told = {event.type: event.payload.get("left_out") for event in session.events()}
    assert told["snapshot_taken"] == told["product"] == {"haz1": reason}
    # the next snapshot had no such trouble: its map does not tell of it
    session.rover.take_images(snapshots[1])
    assert not session.get(session.terrains.build(COARSE).finish()).left_out
    assert [product.verdict for product in replay(session.export_bundle()).products] == ["same", "same"]
