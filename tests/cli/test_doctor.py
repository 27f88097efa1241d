"""The doctor finds what would stop the work, says what to do, and changes nothing."""

import json
import os
import shutil
import socket
from collections import namedtuple

import pytest
from typer.testing import CliRunner

from footfall import doctor
from footfall.cli import app


def looked(what: str, folder) -> doctor.Finding:
    (found,) = [one for one in doctor.examine(folder) if one.what == what]
    return found


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """What other tests look at is left out here."""
    for slow in ("_robot", "_process", "_browser"):
        monkeypatch.setattr(doctor, slow, lambda: "not looked at")
    monkeypatch.setattr(doctor, "LIBRARIES", {"numpy": "numpy"})


def test_a_folder_that_is_missing_will_be_made_and_is_not_made_now(tmp_path):
    folder = tmp_path / "a" / "b"
    assert looked("sessions folder", folder) == doctor.Finding("sessions folder", True, f"{folder} will be made")
    assert not folder.parent.exists()


def test_a_folder_is_tried_and_left_as_it_was(tmp_path):
    tmp_path.chmod(0o700)
    assert looked("sessions folder", tmp_path).text == f"{tmp_path} can be written"
    tmp_path.chmod(0o755)
    assert "other users" in looked("sessions folder", tmp_path).text
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_written_says_what_to_do(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda *_: False)
    found = looked("sessions folder", tmp_path)
    assert not found.ok
    assert "choose another one with --data" in found.text


def test_a_full_disk_is_found(tmp_path, monkeypatch):
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage(1 << 40, 1 << 40, 1 << 30))
    found = looked("disk space", tmp_path / "not" / "yet")
    assert (found.ok, found.text) == (False, "RuntimeError: 1.0 GiB are free, at least 2 GiB are needed")


def test_a_port_in_use_is_told_and_no_failure(tmp_path, monkeypatch):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen(1)
        port = taken.getsockname()[1]
        monkeypatch.setattr(doctor, "PORTS", {port: "a test"})
        assert looked("ports", tmp_path) == doctor.Finding("ports", True, f"{port} is in use, choose another: a test")


def test_the_command_gives_one_document_and_looks_at_the_folder_that_is_named(tmp_path):
    run = CliRunner().invoke(app, ["doctor", "--json", "--data", str(tmp_path / "x")])
    document = json.loads(run.stdout)
    assert document["ok"] is (run.exit_code == 0)
    assert {one["what"]: one["text"] for one in document["findings"]}[
        "sessions folder"
    ] == f"{tmp_path / 'x'} will be made"
