"""``footfall sessions``: list, back up, verify and prune, with exit codes and JSON for machines."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from footfall.cli import app
from footfall.io.bundles import read_bundle
from footfall.maps.layers import MapSettings
from footfall.session.storage.store import SessionStore

SAMPLES = Path(__file__).resolve().parents[2] / "sample_sessions"


@pytest.fixture
def data(tmp_path):
    SessionStore.take_in(tmp_path / "data" / "one", read_bundle(SAMPLES / "edited-export")).close()
    return tmp_path / "data"


def run(*arguments):
    return CliRunner().invoke(app, ["sessions", *map(str, arguments)])


def test_a_whole_folder_verifies_and_can_be_backed_up(data, tmp_path):
    assert (run("verify", "--data", data).exit_code, run("verify", "--data", data).stdout) == (0, "whole\n")
    done = run("backup", "--to", tmp_path / "copy", "--data", data, "--json")
    assert done.exit_code == 0
    assert json.loads(done.stdout) == {"ok": True, "folder": str(tmp_path / "copy"), "findings": []}
    assert run("verify", "one", "--data", tmp_path / "copy").exit_code == 0
    again = run("backup", "--to", tmp_path / "copy", "--data", data)
    assert again.exit_code == 2
    assert "is there already" in again.stderr
    listed = json.loads(run("--data", tmp_path / "copy", "--json").stdout)["sessions"]
    assert [(one["id"], one["events"]) for one in listed] == [("one", 13)]


def test_each_finding_is_a_line_and_harm_is_exit_code_1(data, tmp_path):
    damaged, gone, *_ = sorted((data / "one" / "artifacts").glob("*.npz"))
    damaged.write_bytes(b"damaged")
    gone.unlink()
    (data / "one" / "artifacts" / ".x.partial").touch()
    found = run("verify", "--data", data)
    assert found.exit_code == 1
    lines = found.stdout.splitlines()
    assert lines[-1] == "NOT whole"
    assert [line for line in lines if line.startswith("BAD ") and damaged.name in line]
    assert [line for line in lines if line.startswith("BAD ") and gone.stem in line]
    assert [line for line in lines if line.startswith("note") and ".x.partial" in line]
    told = json.loads(run("verify", "--data", data, "--json").stdout)
    assert not told["ok"]
    assert {one["kind"] for one in told["findings"]} >= {"artifact", "missing", "unfinished"}
    assert run("backup", "--to", tmp_path / "copy", "--data", data).exit_code == 1
    assert (tmp_path / "copy" / "one" / "head").is_file()
    assert run("verify", "--data", tmp_path / "nowhere").exit_code == 2
    assert "no session two" in run("verify", "two", "--data", data).stderr


def test_prune_says_first_and_removes_with_yes(data):
    store = SessionStore(data / "one")
    orphan = data / "one" / "artifacts" / f"{store.put(MapSettings(window=0.77))}.npz"
    store.close()
    told = run("prune", "--data", data)
    assert told.exit_code == 0
    assert orphan.name in told.stdout
    assert "--yes" in told.stdout
    assert orphan.exists()
    done = json.loads(run("prune", "--data", data, "--yes", "--json").stdout)
    assert (done["removed"], len(done["removals"]), orphan.exists()) == (True, 1, False)
    assert run("prune", "--data", data, "--sessions-older-than", 0, "--yes").exit_code == 0
    assert json.loads(run("--data", data, "--json").stdout)["sessions"] == []


def test_a_session_of_the_data_folder_replays_like_its_bundle(data):
    told = CliRunner().invoke(app, ["replay", str(data / "one"), "--no-check", "--json"])
    bundle = CliRunner().invoke(app, ["replay", str(SAMPLES / "edited-export"), "--no-check", "--json"])
    assert told.exit_code == bundle.exit_code == 0
    assert [*json.loads(told.stdout)["bundles"].values()] == [*json.loads(bundle.stdout)["bundles"].values()]


def test_sessions_that_can_not_be_opened_are_listed_with_the_reason(data):
    (data / "footfall.sqlite").unlink()
    listed = run("--data", data)
    assert listed.exit_code == 0
    assert "one  one  None  it can't be read: its events are not in footfall.sqlite" in listed.stdout
