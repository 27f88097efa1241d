"""Views of a snapshot are made once for all who ask, kept for the latest, and asked for again after a failure."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import cast

import numpy as np
import pytest

from footfall.core.errors import InvalidImages
from footfall.session.jobs.local import Jobs
from footfall.session.products.image_views import ImageViews
from footfall.session.registry import Sessions
from footfall.telemetry.images import Snapshot


def test_views_are_made_once_for_all_who_ask(tmp_path):
    jobs = Jobs("view_recipes", workers=1)
    with jobs, Sessions(tmp_path, jobs) as sessions:
        live = sessions.open_sample("rock-step")
        taken = cast(Snapshot, live.get(str(live.state.snapshot)))
        one = Snapshot(taken.state, taken.pairs[:1])
        others = [Snapshot(replace(taken.state, mode=mode), taken.pairs[:1]) for mode in ("moving", "stopped")]
        views = ImageViews(sessions)

        def made() -> int:
            return jobs.tally()[("views", "done")].count if ("views", "done") in jobs.tally() else 0

        with pytest.raises(InvalidImages, match="first time"):
            views.of(live, one)
        with ThreadPoolExecutor(8) as threads:
            found = list(threads.map(lambda _: views.of(live, one), range(8)))
        assert made() == 1
        assert all(view is found[0] for view in found)
        assert views.of(live, others[0]).legs == "moving"
        assert views.of(live, one) is found[0]
        assert made() == 2
        views.of(live, others[1])  # the oldest one that nobody asked for since is forgotten
        assert views.of(live, one) is found[0]
        assert made() == 3
        views.of(live, others[0])
        assert made() == 4


def test_silhouettes_are_kept_for_the_posture_and_the_camera(tmp_path):
    with Sessions(tmp_path) as sessions:
        live = sessions.open_sample("rock-step")
        taken = cast(Snapshot, live.get(str(live.state.snapshot)))
        pair = next(pair for pair in taken.pairs if pair.name == "haz1")
        views = ImageViews(sessions)
        left = views.silhouette(live, taken, pair.camera_left)
        assert left.shape == (pair.camera_left.height, pair.camera_left.width)
        assert 0.1 < left.mean() < 0.5
        assert views.silhouette(live, taken, pair.camera_left) is left
        assert not np.array_equal(views.silhouette(live, taken, pair.camera_right), left)
        lifted = np.array(taken.state.posture)
        lifted[1::6] += 0.1
        moved = Snapshot(replace(taken.state, posture=lifted), taken.pairs)
        assert not np.array_equal(views.silhouette(live, moved, pair.camera_left), left)
