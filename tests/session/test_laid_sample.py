"""A sample that tests lay into a data folder is the session that opening the sample makes."""

from footfall.io.bundles import read_bundle
from footfall.session.jobs.local import InlineJobs
from footfall.session.live import LiveSession
from footfall.session.registry import Sessions
from tests.support.laid_sample import lay_sample


def told(sessions: Sessions, live: LiveSession) -> tuple[dict, dict, list]:
    """What a session says of itself but its id, its files, and its log but for when each event was."""
    bundle = read_bundle(sessions.export_bundle(live.id))
    files = {name: read() for name, read in bundle.files.items()}
    return {**live.summary(), "id": ""}, files, [(one["type"], one["payload"]) for one in bundle.records]


def test_a_laid_sample_is_as_an_opened_one(tmp_path):
    session = lay_sample("rock-step", tmp_path / "laid")
    with Sessions(tmp_path / "laid", InlineJobs()) as sessions:
        laid = told(sessions, sessions.open(session))
    with Sessions(tmp_path / "opened", InlineJobs()) as sessions:
        opened = told(sessions, sessions.open_sample("rock-step"))
    assert len(laid[1]) > 5
    assert laid == opened
