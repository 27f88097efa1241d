"""Maps on their way: coarse ones first, newer ones instead of older, and the same again without any work."""

import threading
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from footfall.core.errors import Cancelled, Conflict, InvalidInput
from footfall.core.progress import no_progress
from footfall.maps.layers import MapSettings, MapStack
from footfall.maps.reach_classes import UNSURE
from footfall.maps.stack import COARSE
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.body.stand import stand
from footfall.session.jobs.job import Job
from footfall.session.jobs.local import InlineJobs, Jobs
from footfall.session.log.fold import fold_all
from footfall.session.registry import Sessions
from footfall.session.replay.recompute import replay
from footfall.terrain.generate import plane
from tests.support.waiting import BOUND, until

LEG = 2


@pytest.fixture
def slow(tiny):
    """Ground on which maps show a preview and then take 20 s."""
    return replace(tiny.dem(), name="slow")


@pytest.fixture
def pooled(tmp_path, tiny, athlete, state_of, slow):
    """A session on slow ground whose jobs run in two worker processes."""
    with Sessions(tmp_path / "pooled", jobs=Jobs("tiny_recipes", workers=2), robot=athlete) as sessions:
        live = sessions.create("previews")
        live.stances.set(state_of())
        live.terrains.load(slow)
        yield live


def started(live, leg=LEG, settings=None):
    """A map job whose preview is there."""
    job = live.maps.compute(leg, settings)
    until(lambda: live.maps.shown(leg) is not None, "the maps shown")
    return job


def heard_by(live):
    heard = []
    live.listen(lambda message: heard.append((message["type"], message.get("event", {}).get("type"))))
    return heard


def test_a_preview_comes_from_a_worker_before_the_product_and_is_never_recorded(pooled, tiny):
    heard = heard_by(pooled)
    job = started(pooled)
    shown = pooled.maps.shown(LEG)
    assert not job.ended
    assert (shown.geometry.shape, shown.leg) == (tiny.COARSE.shape, LEG)
    assert pooled.maps.shown(1) is None
    assert not pooled.fits.of_maps(LEG).fits
    assert str(LEG) not in pooled.state.maps
    assert ("preview", None) in heard
    assert ("event", "product") not in heard
    assert not pooled.has(shown.digest)
    answer = pooled.maps.choose_footfall(LEG, 0.0, 0.0)
    assert answer["footing"] is None, "a footfall is never judged by a preview"
    with pytest.raises(Conflict, match=rf"the maps of leg {LEG} are being made, [0-9]+ % so far; ask again") as told:
        pooled.maps.suggest(LEG)
    assert told.value.details == {"job": job.id}
    with pytest.raises(Conflict, match="compute them first"):
        pooled.maps.suggest(1)


def test_the_product_takes_the_place_of_the_preview(pooled, tiny):
    pooled.terrains.load(tiny.dem())
    heard = heard_by(pooled)
    digest = pooled.maps.compute(LEG).finish(BOUND)
    assert pooled.maps.shown(LEG).digest == digest == pooled.state.maps[str(LEG)]
    assert pooled.maps.shown(LEG).geometry.shape == tiny.dem().geometry.shape
    assert heard.index(("preview", None)) < heard.index(("event", "product"))


def test_inline_jobs_show_previews_too(session, tiny):
    shown = []
    session.listen(lambda message: message["type"] == "preview" and shown.append(session.maps.shown(LEG)))
    digest = session.maps.compute(LEG).finish()
    assert shown[0].geometry.shape == tiny.COARSE.shape
    assert shown[-1].digest == digest


def test_a_preview_of_another_terrain_or_state_is_not_shown(pooled, tiny, state_of, slow):
    started(pooled)
    pooled.terrains.load(tiny.dem(0.1))
    assert pooled.maps.shown(LEG) is None
    pooled.terrains.load(slow)
    assert pooled.maps.shown(LEG).geometry.shape == tiny.COARSE.shape
    pooled.stances.set(state_of(0.01))
    assert pooled.maps.shown(LEG) is None
    pooled.stances.set(state_of())
    assert pooled.maps.shown(LEG) is not None


@pytest.mark.parametrize("end", ["cancelled", "superseded"])
def test_a_preview_goes_with_its_job(pooled, end):
    job = started(pooled)
    heard = heard_by(pooled)
    if end == "cancelled":
        job.cancel()
    else:
        pooled.maps.compute(LEG, MapSettings(stable_margin=0.1))
    assert job.wait(BOUND)
    assert job.state == "cancelled"
    until(lambda: ("preview", None) in heard, "the preview")
    if end == "cancelled":
        until(lambda: pooled.maps.shown(LEG) is None, "the maps put away")
    else:
        until(lambda: pooled.maps.shown(LEG) is not None, "the maps shown")
        assert pooled.maps.shown(LEG).provenance.settings.stable_margin == 0.1
    with pytest.raises(Cancelled):
        job.finish()


def test_a_preview_of_maps_that_fail_does_not_stay(session, tiny):
    session.terrains.load(replace(tiny.dem(), name="bad"))
    with pytest.raises(InvalidInput, match="can't be mapped"):
        session.maps.compute(LEG).finish()
    assert session.maps.shown(LEG) is None
    assert session.events()[-1].type == "job_failed"


def test_newer_maps_cancel_older_ones_of_their_leg_only(pooled, tiny):
    older, other = started(pooled), started(pooled, 1)
    pooled.terrains.load(tiny.dem())
    newer = pooled.maps.compute(LEG)
    newer.finish(BOUND)
    assert older.wait(BOUND)
    assert (older.state, other.ended) == ("cancelled", False)
    made = [event.payload["leg"] for event in pooled.events() if event.type == "product"]
    assert made == [LEG]


class Held:
    """A pool whose jobs end when the test says so."""

    def __init__(self):
        self.jobs, self.adopted = [], []

    def submit(
        self, kind, parents, settings, on_done=None, on_change=None, *, on_preview=None, session="", urgent=False
    ):
        self.jobs.append((Job(kind, session, on_done, on_change, on_preview), parents, settings))
        return self.jobs[-1][0]

    def adopt(self, job):
        self.adopted.append(job)

    def close(self):
        pass


@pytest.fixture
def held(tmp_path, tiny, athlete, state_of):
    """(session, pool) whose jobs are ended by hand."""
    pool = Held()
    with Sessions(tmp_path / "held", jobs=cast(Any, pool), robot=athlete) as sessions:
        live = sessions.create("held")
        live.stances.set(state_of())
        live.terrains.load(tiny.dem())
        yield live, pool
        for job, _, _ in pool.jobs:
            if not job.ended:
                job.end(error=Cancelled("the test is over"))


def product_of(tiny, parents, settings):
    return tiny.maps(parents, settings, no_progress)


def test_what_a_superseded_job_still_brings_is_dropped(held, tiny):
    """It was asked to stop when its product was already on the way."""
    live, pool = held
    live.maps.compute(LEG)
    live.maps.compute(LEG, MapSettings(stable_margin=0.1))
    (older, *asked), (newer, *asked_newer) = pool.jobs
    older.preview(product_of(tiny, *asked))
    assert live.maps.shown(LEG) is None
    newer.end(product_of(tiny, *asked_newer))
    older.end(product_of(tiny, *asked))
    assert (older.state, newer.state) == ("cancelled", "done")
    assert live.state.maps == {str(LEG): newer.result}
    assert live.maps.shown(LEG).provenance.settings.stable_margin == 0.1


def test_an_answer_from_before_is_not_undone_by_a_job_that_was_on_its_way(held, tiny):
    live, pool = held
    live.maps.compute(LEG)
    first, *asked = pool.jobs[0]
    first.end(product_of(tiny, *asked))
    live.maps.compute(LEG, MapSettings(stable_margin=0.1))
    second, *asked_second = pool.jobs[1]
    again = live.maps.compute(LEG)
    assert again.result == first.result
    assert len(pool.jobs) == 2, "no work was asked for"
    second.end(product_of(tiny, *asked_second))
    assert second.state == "cancelled"
    assert live.state.maps == {str(LEG): first.result}


def test_a_what_if_of_a_state_that_was_frozen_anew_is_dropped(held, state_of):
    live, pool = held
    refused = []

    def ask():
        with pytest.raises(Conflict, match="another state") as caught:
            live.stances.what_if(BodyShift(dz=-0.1))
        refused.append(caught)

    asking = threading.Thread(target=ask)
    asking.start()
    until(lambda: pool.jobs, "the job")
    frozen = live.stances.set(state_of(0.01))
    pool.jobs[0][0].end(state_of(0.02))
    asking.join(BOUND)
    assert refused
    assert (live.state.state, live.state.what_if) == (frozen, None)


def test_the_same_request_again_is_answered_from_what_was_made(session, monkeypatch):
    other = MapSettings(stable_margin=0.1)
    first = session.maps.compute(LEG).finish()
    changed = session.maps.compute(LEG, other).finish()
    assert first != changed
    count = len(session.events())

    def no_work(*_, **__):
        raise AssertionError("this was made before")

    monkeypatch.setattr(InlineJobs, "submit", no_work)
    again = session.maps.compute(LEG)
    assert (again.state, again.result) == ("done", first)
    (event,) = session.events(count)
    assert (event.type, event.payload["digest"], event.payload["leg"]) == ("product", first, LEG)
    assert session.state.maps == {str(LEG): first}
    assert session.maps.shown(LEG).digest == first
    assert session.jobs[-1] is again
    assert fold_all(session.events()).digest == session.state.digest
    with pytest.raises(AssertionError, match="made before"):
        session.maps.compute(3)


def test_made_before_means_the_same_terrain_state_and_leg(session, tiny, state_of, monkeypatch):
    asked = []
    submit = InlineJobs.submit

    def counted(self, *arguments, **named):
        asked.append(arguments[0])
        return submit(self, *arguments, **named)

    monkeypatch.setattr(InlineJobs, "submit", counted)
    first = session.maps.compute(LEG).finish()
    session.stances.set(state_of(0.01))
    second = session.maps.compute(LEG).finish()
    session.terrains.load(tiny.dem(0.1))
    session.maps.compute(LEG).finish()
    assert asked == ["maps"] * 3
    session.terrains.undo()
    assert session.maps.compute(LEG).finish() == second
    session.stances.set(state_of())
    assert session.maps.compute(LEG).finish() == first
    assert asked == ["maps"] * 3


def test_an_answer_from_before_replays(session, tiny):
    session.maps.compute(LEG).finish()
    session.maps.compute(LEG, MapSettings(stable_margin=0.1)).finish()
    session.maps.compute(LEG).finish()
    session.close()
    report = replay(session.store.folder, recipes=tiny.RECIPES)
    assert report.ok
    assert [product.verdict for product in report.products] == ["same"] * 3
    assert report.products[0].recorded == report.products[2].recorded
    assert report.state is not None
    assert report.state.digest == session.state.digest


def mapped(folder, jobs, robot, dem, state):
    """(what is shown first, what is shown in the end) of real maps."""
    shown = []
    with Sessions(folder, jobs=jobs, robot=robot) as sessions:
        live = sessions.create("real maps")
        live.stances.set(state)
        live.terrains.load(dem)
        live.listen(lambda message: message["type"] == "preview" and shown.append(live.maps.shown(LEG)))
        live.maps.compute(LEG).finish(BOUND)
        made = live.maps.shown(LEG)
        assert made is not None
        return shown[0], made


def test_real_maps_come_coarse_first_and_to_the_same_digest(tmp_path, athlete):
    """The recipes of the product, in a worker process and in this one."""
    dem = plane(size=6.0, resolution=0.1)
    state = stand(athlete, dem)
    digests = []
    for name, jobs in (("pool", Jobs(workers=1)), ("inline", InlineJobs())):
        coarse, made = mapped(tmp_path / name, jobs, athlete, dem, state)
        digests.append(made.digest)
        assert isinstance(coarse, MapStack)
        assert coarse.geometry.resolution == pytest.approx(COARSE * dem.geometry.resolution)
        assert np.isfinite(coarse.layers["limit_margin"]).any()
        told = coarse.layers["reach_class"] != UNSURE
        assert told.mean() > 0.9
        for layer, cells in coarse.layers.items():
            fine = made.layers[layer][::COARSE, ::COARSE]
            np.testing.assert_array_equal(cells[told], fine[told], err_msg=layer)
    assert digests[0] == digests[1]


def test_maps_need_ground_and_a_state(sessions, tiny):
    live = sessions.create("nothing yet")
    with pytest.raises(Conflict, match="no terrain"):
        live.maps.compute(LEG)
    assert live.maps.shown(LEG) is None
    live.terrains.load(tiny.dem())
    with pytest.raises(Conflict, match="telemetry"):
        live.maps.compute(LEG)
    with pytest.raises(Conflict, match="no maps of leg 2"):
        live.maps.suggest(LEG)
