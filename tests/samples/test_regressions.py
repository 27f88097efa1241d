"""What FootFall once got wrong, from files of that kind: sample_sessions/regressions."""

import re

import pytest

import footfall
from footfall.core.errors import InvalidBundle
from footfall.io.bundles import read_bundle
from footfall.resources import sample_sessions_folder
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.session.replay.recordings import replay_recording
from tests.support.command_line import run

FOLDER = sample_sessions_folder() / "regressions"
BUNDLES = {
    "legs-in-each-other.zip": ["plan"],
    "stop-carried-along.zip": [],
    "half-a-character.zip": [],
}


@pytest.fixture
def sessions(tmp_path):
    with Sessions(tmp_path, jobs=InlineJobs(), recording=None) as sessions:
        yield sessions


def test_each_is_documented_and_tested():
    there = {path.name for path in FOLDER.iterdir()} - {"README.md"}
    assert there == {*BUNDLES, "endless-run.zip", "cut-short.mcap.part"}
    table = (FOLDER / "README.md").read_text()
    assert {*re.findall(r"^\| `(\S+)` \|", table, re.MULTILINE)} == there


@pytest.mark.parametrize("name", BUNDLES)
def test_replay(name):
    report = footfall.replay(FOLDER / name)
    assert report.ok, report.as_dict()
    assert [product.kind for product in report.products] == BUNDLES[name]
    assert {product.verdict for product in report.products} <= {"same", "equal_within"}


def test_legs_in_each_other_are_no_start():
    (plan,) = (
        record["payload"]
        for record in read_bundle(FOLDER / "legs-in-each-other.zip").records
        if record["payload"].get("kind") == "plan"
    )
    assert plan["status"] == "start_invalid"
    assert re.search(r"leg2_\w+ .*leg3_\w+|leg3_\w+ .*leg2_\w+", plan["reason"])
    assert re.search(r"\d\.\d{3} m", plan["reason"])


def test_a_stop_that_was_carried_along_is_in_force(sessions):
    live = sessions.import_bundle((FOLDER / "stop-carried-along.zip").read_bytes())
    assert live.commands.gate["stopped"]
    assert live.state.stop.reason.startswith("still in force from session ")
    assert live.state.stop.reason.endswith(": dust storm")
    heard = []
    live.rover.connected(heard.append)
    assert '"stop"' in heard[0]


def test_half_a_character_is_told_and_goes_out_again(sessions):
    live = sessions.import_bundle((FOLDER / "half-a-character.zip").read_bytes())
    assert [note.text for note in live.state.notes] == ["cold \ud800 cameras"]
    again = sessions.import_bundle(live.export_bundle())
    assert [note.text for note in again.state.notes] == ["cold \ud800 cameras"]
    assert r"\ud800" in run("replay", FOLDER / "half-a-character.zip", "--json").output


def test_a_run_without_end_is_refused_and_shown_by_nobody(sessions):
    with pytest.raises(InvalidBundle, match=r"event 2 \(run_started\) .* at most 100000 rows"):
        sessions.import_bundle((FOLDER / "endless-run.zip").read_bytes())
    assert sessions.list() == []
    report = footfall.replay(FOLDER / "endless-run.zip")
    assert not report.ok
    assert "at most 100000 rows" in report.problems[0]


def test_a_recording_that_was_cut_short_is_read_as_far_as_it_goes():
    report = replay_recording(FOLDER / "cut-short.mcap.part")
    assert report.ok, report.problems
    assert report.counts == {"frames": 50, "gaps": 5, "restarts": 1, "dropped": 0}
    assert "it was cut short" in " ".join(report.lines())
    assert (report.commands, report.stops) == ({"started": 1}, 1)
