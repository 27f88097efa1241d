"""A gait as a product of a session: asked for, recorded with its status, told whether it still fits, replayed."""

from footfall.planning.answers import Status
from footfall.planning.gait.problem import GaitSettings
from footfall.planning.walk.problem import WalkGoal
from footfall.session.log.fold import fold_all
from footfall.session.products.kinds import GAIT, SEQUENCE
from footfall.session.replay.recompute import replay
from tests.support.chassis_ground import wavy


def test_gaits_are_asked_for_recorded_and_replayed_to_the_same_digests(live, standing):
    found = live.get(live.walks.plan_gait(WalkGoal(0.4, 0.1), GaitSettings(gait="wave")).finish())
    assert found.status is Status.FOUND, found.reason
    assert found.provenance.parents["state"] == standing.digest
    assert live.state.newest(GAIT) == live.summary()["gait"] == found.digest
    assert live.fits.up_to_date()["gait"]["fits"]

    refused = live.get(live.walks.plan_gait(WalkGoal(0.4, 0.1), GaitSettings(least_margin=2.0)).finish())
    assert refused.status is Status.NO_PATH
    told = live.events()[-1].payload
    assert (told["kind"], told["digest"], told["status"]) == ("gait", refused.digest, "no_path")
    assert told["reason"] == refused.reason
    assert refused.failure.text in refused.reason
    assert refused.failure.posture.shape == (36,)

    # what is only compared leaves what is commanded alone
    assert live.state.newest(SEQUENCE) is None
    assert live.review.played is None
    assert fold_all(live.events()).digest == live.state.digest
    report = replay(live.export_bundle())
    assert report.ok, report.problems
    assert [(one.kind, one.verdict) for one in report.products] == [("gait", "same")] * 2

    live.terrains.load(wavy(half=4.0, seed=1))
    fit = live.fits.up_to_date()["gait"]
    assert not fit["fits"]
    assert fit["reason"].startswith("the terrain has changed since: by up to 0.02 m on ")
