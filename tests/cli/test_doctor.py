"""The doctor finds what would stop the work, says what to do, and changes nothing."""

import json
import os
import re
import shutil
import socket
import subprocess
from collections import namedtuple
from contextlib import closing
from importlib.metadata import version

import psycopg
import pytest
from typer.testing import CliRunner

from footfall.cli import app, doctor
from footfall.io.sign_on_file import FILE
from footfall.resources import sample_sessions_folder
from footfall.session.storage import postgres_look
from footfall.session.storage.databases import bind, binding
from footfall.session.storage.postgres_schema import SCHEMAS, TABLES
from tests.support.command_line import FOOTFALL
from tests.support.provider import CLIENT, SECRET, provider


def looked(what: str, folder) -> doctor.Diagnosis:
    (found,) = [one for one in doctor.examine(folder) if one.what == what]
    return found


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """What other tests look at is left out here."""
    for slow in ("_robot", "_process", "_browser"):
        monkeypatch.setattr(doctor, slow, lambda: "not looked at")
    monkeypatch.setattr(doctor, "LIBRARIES", {"numpy": "numpy"})


def test_this_installation_is_examined_whole(tmp_path):
    """In a process of its own, where nothing is left out."""
    done = subprocess.run([*FOOTFALL, "doctor", "--data", str(tmp_path), "--json"], capture_output=True, text=True)
    told = json.loads(done.stdout)
    # another program may have a port of FootFall's
    assert {one["what"] for one in told["findings"] if not one["ok"]} <= {"ports"}
    assert done.returncode == (0 if told["ok"] else 1)
    found = {one["what"]: one["text"] for one in told["findings"]}
    for library in (
        "numpy",
        "scipy",
        "pin",
        "coal",
        "ompl",
        "opencv-python-headless",
        "viser",
        "fastapi",
        "mujoco-core",
    ):
        assert found[library] == version(library)
    assert found["robot"].startswith("athlete, 6 legs, 850 kg, digest ")
    assert found["browser"] in {shutil.which(name) for name in doctor.BROWSERS}
    assert re.fullmatch(r"\d+\.\d GiB free", found["disk space"])
    assert (found["worker processes"], found["loopback"]) == ("can be started", "works")
    assert all(str(port) in found["ports"] for port in doctor.PORTS)
    samples = {one.parent.name for one in sample_sessions_folder().glob("*/session.json")}
    assert {*found["sample sessions"].split(", ")} == samples


def test_a_folder_that_is_missing_will_be_made_and_is_not_made_now(tmp_path):
    folder = tmp_path / "a" / "b"
    assert looked("sessions folder", folder) == doctor.Diagnosis("sessions folder", True, f"{folder} will be made")
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
        assert looked("ports", tmp_path) == doctor.Diagnosis("ports", True, f"{port} is in use, choose another: a test")


def test_the_command_gives_one_document_and_looks_at_the_folder_that_is_named(tmp_path):
    run = CliRunner().invoke(app, ["doctor", "--json", "--data", str(tmp_path / "x")])
    document = json.loads(run.stdout)
    assert document["ok"] is (run.exit_code == 0)
    assert {one["what"]: one["text"] for one in document["findings"]}[
        "sessions folder"
    ] == f"{tmp_path / 'x'} will be made"


def test_without_a_database_server_or_a_provider_it_says_what_there_is_instead(tmp_path):
    assert looked("database", tmp_path) == doctor.Diagnosis("database", True, "SQLite, in the sessions folder")
    assert looked("login provider", tmp_path) == doctor.Diagnosis(
        "login provider", True, "none (oidc.toml); accounts are local"
    )


def refused(folder, store) -> str:
    (found,) = [one for one in doctor.examine(folder, store) if one.what == "database"]
    assert not found.ok
    return found.text


def test_a_database_server_is_looked_at_and_nothing_is_changed(tmp_path, postgres):
    url = postgres.fresh()
    with closing(psycopg.connect(url)) as database:
        version = database.info.server_version // 10_000
    (fresh,) = [one for one in doctor.examine(tmp_path / "new", url) if one.what == "database"]
    assert fresh.ok
    assert fresh.text.startswith(f"PostgreSQL {version}, no tables yet")
    assert not (tmp_path / "new").exists()
    with closing(psycopg.connect(url)) as database:
        assert database.execute("SELECT count(*) FROM pg_tables WHERE schemaname = current_schema()").fetchone() == (0,)
    bind(tmp_path / "bound", url)
    told = looked("database", tmp_path / "bound").text
    assert told == f"PostgreSQL {version}, tables {len(SCHEMAS)}, 0 sessions: {url}"
    assert "belongs to another data folder" in refused(tmp_path / "new", url)
    assert "holds no tables of FootFall" in refused(tmp_path / "bound", postgres.fresh())


def test_what_keeps_a_database_server_from_being_used_is_said(tmp_path, postgres, monkeypatch):
    assert "names no database server" in refused(tmp_path, "mysql://here")
    assert "must not hold a password" in refused(tmp_path, "postgresql://me:secret@here/footfall")
    silent = refused(tmp_path, "postgresql://me@127.0.0.1:9/footfall")
    assert "can't be used" in silent
    assert "does the server run" in silent
    url = postgres.fresh()
    bind(tmp_path, url)
    with closing(psycopg.connect(url, autocommit=True)) as database:
        database.execute("INSERT INTO schema_versions VALUES (99, '', 0)")
    assert "later version of FootFall" in looked("database", tmp_path).text
    with closing(psycopg.connect(url, autocommit=True)) as database:
        database.execute(f"DROP TABLE {', '.join(TABLES)}".encode())
    assert "holds no tables of FootFall" in looked("database", tmp_path).text
    monkeypatch.setattr(postgres_look, "OLDEST", 1000)
    assert "FootFall needs 1000 or later" in looked("database", tmp_path).text
    assert binding(tmp_path) is not None


def test_the_store_of_the_environment_is_looked_at(tmp_path, monkeypatch):
    monkeypatch.setenv("FOOTFALL_STORE", "postgresql://me@127.0.0.1:9/footfall")
    run = CliRunner().invoke(app, ["doctor", "--data", str(tmp_path)])
    assert run.exit_code == 1
    assert "postgresql://me@127.0.0.1:9/footfall can't be used" in run.stdout


def provider_file(folder, issuer: str) -> None:
    path = folder / FILE
    path.write_text(
        f'issuer = "{issuer}"\nclient_id = "{CLIENT}"\nclient_secret = "{SECRET}"\n[roles]\nviewer = ["a"]\n'
    )
    path.chmod(0o600)


def test_a_login_provider_is_asked(tmp_path):
    with provider() as issuing:
        provider_file(tmp_path, issuing.issuer)
        said = doctor.Diagnosis("login provider", True, f"{issuing.issuer} answers, and signs with 1 key")
        assert looked("login provider", tmp_path) == said
        issuing.keys = []
        assert "has to tell 1 to 100 keys" in looked("login provider", tmp_path).text
        issuing.claimed_issuer = "https://elsewhere.example"
        assert "says that it is 'https://elsewhere.example'" in looked("login provider", tmp_path).text
    gone = looked("login provider", tmp_path)
    assert not gone.ok
    assert f"nobody can log in with {issuing.issuer}" in gone.text
    assert "local accounts work meanwhile" in gone.text
    (tmp_path / FILE).chmod(0o644)
    assert "chmod 600" in looked("login provider", tmp_path).text


def test_an_extra_that_is_missing_is_named(tmp_path, monkeypatch):
    def missing(name: str):
        raise ModuleNotFoundError(f"No module named {name!r}")

    monkeypatch.setattr(doctor, "LIBRARIES", {})
    monkeypatch.setattr(doctor, "import_module", missing)
    assert "pip install 'footfall[postgres]'" in refused(tmp_path, "postgresql://me@here/footfall")
    provider_file(tmp_path, "http://127.0.0.1:9")
    assert "pip install 'footfall[oidc]'" in looked("login provider", tmp_path).text
