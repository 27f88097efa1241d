"""`footfall accounts …`, and a server that asks for them, over TLS, with its own simulated rover."""

import json
import shutil
import socket
import ssl
import subprocess
from datetime import datetime, timedelta
from pathlib import Path

import httpx
import pytest
from typer.testing import CliRunner

from footfall.cli import app
from tests.support.command_line import FOOTFALL
from tests.support.waiting import BOUND, until

PASSWORD = "a long and good one"


def run(data: Path, *arguments: object, code: int = 0, given: str | None = None):
    result = CliRunner().invoke(app, ["accounts", *map(str, arguments), "--data", str(data)], input=given)
    assert result.exit_code == code, result.output
    return result


def test_accounts_are_made_changed_and_removed(tmp_path):
    assert "first account" in run(tmp_path, "add", "vic", code=2, given=PASSWORD).stderr
    run(tmp_path, "add", "ada", "--role", "admin", given=PASSWORD)
    run(tmp_path, "add", "vic", given=PASSWORD)
    run(tmp_path, "role", "vic", "planner")
    run(tmp_path, "password", "vic", given="quite another one\n")
    listed = json.loads(run(tmp_path, "list", "--json").stdout)
    assert [(one["name"], one["role"]) for one in listed] == [("ada", "admin"), ("vic", "planner")]
    assert "planner" in run(tmp_path, "list").stdout
    assert "last admin" in run(tmp_path, "remove", "ada", code=2).stderr
    run(tmp_path, "remove", "vic")
    assert "12 to 1024" in run(tmp_path, "add", "ben", code=2, given="short").stderr
    assert "there is no account vic" in run(tmp_path, "role", "vic", "viewer", code=2).stderr
    acts = [one["act"] for one in json.loads(run(tmp_path, "audit", "--json").stdout)]
    assert acts == ["account added", "account added", "role changed", "password changed", "account removed"]
    assert "from command line: account removed vic" in run(tmp_path, "audit", "--after", 3).stdout


def test_a_token_is_shown_once(tmp_path):
    run(tmp_path, "add", "ada", "--role", "admin", given=PASSWORD)
    text = run(
        tmp_path, "token", "add", "night-script", "--account", "ada", "--role", "viewer", "--days", 7
    ).stdout.strip()
    assert text.startswith("footfall_")
    run(tmp_path, "token", "add", "gateway", "--rover")
    assert "(--rover)" in run(tmp_path, "token", "add", "both", "--rover", "--account", "ada", code=2).stderr
    listed = run(tmp_path, "token", "list")
    assert text not in listed.output + run(tmp_path, "audit").output
    assert "ada, at most viewer" in listed.stdout
    found = json.loads(run(tmp_path, "token", "list", "--json").stdout)
    lasts = timedelta(seconds=found[1]["expires"] - datetime.now().timestamp())
    assert timedelta(days=6.9) < lasts <= timedelta(days=7)
    run(tmp_path, "token", "revoke", "night-script")
    assert "night-script" not in run(tmp_path, "token", "list").stdout


def test_serve_wants_the_accounts_it_was_told_of(tmp_path):
    result = CliRunner().invoke(app, ["serve", "--accounts", "--port", "0", "--data", str(tmp_path)])
    assert (result.exit_code, "accounts add" in result.stderr) == (2, True)


def test_serve_says_that_foxglove_asks_for_no_login_though_there_are_accounts(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setattr("footfall_ui.app.serve", lambda *_, on_ready, **__: on_ready("http://127.0.0.1:1"))
    (tmp_path / "kept").mkdir()
    asked = ["serve", "--data", "~/kept", "--foxglove", "8765"]
    assert "login" not in CliRunner().invoke(app, asked).stdout
    run(Path("~/kept"), "add", "ada", "--role", "admin", given=PASSWORD)
    assert "it asks for no login" in CliRunner().invoke(app, asked).stdout


@pytest.fixture
def certificate(tmp_path) -> tuple[Path, Path]:
    openssl = shutil.which("openssl")
    if openssl is None:
        pytest.skip("openssl, which makes the certificate of this test, is not on this machine")
    made = tmp_path / "cert.pem", tmp_path / "key.pem"
    command = [openssl, "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes"]
    command += ["-days", "2", "-subj", "/CN=ground.example", "-addext", "subjectAltName=IP:127.0.0.1"]
    subprocess.run([*command, "-out", str(made[0]), "-keyout", str(made[1])], check=True, capture_output=True)
    return made


def test_a_server_with_accounts_and_tls(tmp_path, certificate):
    """Started as an operator does: its own rover comes in with a token of its own, a script with one from the CLI."""
    data = tmp_path / "sessions"
    run(data, "add", "ada", "--role", "admin", given=PASSWORD)
    token = run(data, "token", "add", "script", "--account", "ada").stdout.strip()
    command = [*FOOTFALL, "serve", "--accounts", "--port", "0", "--data", str(data)]
    command += ["--tls-cert", str(certificate[0]), "--tls-key", str(certificate[1])]
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        command += ["--foxglove", str(probe.getsockname()[1])]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        url = server.stdout.readline().split()[-1]
        assert url.startswith("https://127.0.0.1:")
        assert "it asks for no login: whoever is on this machine may look" in server.stdout.readline()
        believed = ssl.create_default_context(cafile=str(certificate[0]))
        with httpx.Client(base_url=url, verify=believed, timeout=BOUND, trust_env=False) as client:
            assert client.get("/api/v1/info").status_code == 401
            entered = client.post("/api/v1/login", json={"name": "ada", "password": PASSWORD}, headers={"Origin": url})
            cookie = entered.headers["set-cookie"]
            assert cookie.startswith("__Host-footfall=")
            assert "Secure" in cookie
            client.cookies.clear()
            client.headers["Authorization"] = f"Bearer {token}"

            def linked() -> bool:
                return client.get("/api/v1/info").json()["rover_link"]["linked"]

            until(linked, "the server's own rover on the link")
        told = subprocess.run(["ps", "-wweo", "args"], capture_output=True, text=True, check=True).stdout
        rovers = [one for one in told.splitlines() if url.removeprefix("https://") in one]
        assert len(rovers) == 1
        assert "footfall.sim" in rovers[0]
        assert "footfall_" not in rovers[0]
    finally:
        server.terminate()
        _, said = server.communicate(timeout=BOUND)
    assert PASSWORD not in said
    assert token not in said
