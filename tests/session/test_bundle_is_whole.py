"""What is handed on is whole: a session whose artifacts are missing is refused, never served as good."""

import shutil

import pytest

from footfall.core.errors import Conflict, InvalidBundle
from footfall.io.bundles import ARTIFACTS, read_bundle
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from tests.support.sequences import SAMPLES


@pytest.fixture
def sessions(tmp_path, athlete):
    with Sessions(tmp_path, jobs=InlineJobs(), robot=athlete) as made:
        yield made


@pytest.mark.parametrize("open_now", [True, False])
def test_a_session_that_lacks_artifacts_is_not_exported(sessions, open_now):
    live = sessions.open_sample("rock-step")
    whole = read_bundle(sessions.export_bundle(live.id))
    assert whole.files
    if not open_now:
        sessions.create("another")
    lost = sorted((sessions.folder / live.id / ARTIFACTS).glob("*.npz"))[:2]
    kept = [path.read_bytes() for path in lost]
    for path in lost:
        path.unlink()
    with pytest.raises(Conflict, match="events name are missing") as refused:
        sessions.export_bundle(live.id)
    assert set(refused.value.details["missing"]) <= {path.stem for path in lost}
    assert refused.value.details["count"] > 0
    for path, content in zip(lost, kept, strict=True):
        path.write_bytes(content)
    assert read_bundle(sessions.export_bundle(live.id)).files.keys() == whole.files.keys()


def test_a_bundle_without_its_artifacts_is_not_taken_in(sessions, tmp_path):
    bare = tmp_path / "bare"
    shutil.copytree(SAMPLES / "rock-step", bare, ignore=shutil.ignore_patterns("*.npz"))
    before = [one["id"] for one in sessions.list()]
    with pytest.raises(InvalidBundle):
        sessions.import_bundle(bare)
    assert [one["id"] for one in sessions.list()] == before
