"""``footfall serve`` with sessions and accounts in PostgreSQL: the same answers, work by a worker, nothing left."""

import os
import signal
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import httpx

from footfall.session.access.account_stores import account_store
from footfall.session.access.accounts import Accounts
from footfall.session.access.identity import LOCAL, Role
from footfall.session.storage.databases import bind, binding
from footfall.session.storage.verify import verify
from tests.support.command_line import run
from tests.support.waiting import BOUND, until

FOOTFALL = str(Path(sys.executable).with_name("footfall"))


def test_a_server_on_postgres_works_through_its_worker_and_leaves_a_whole_log(postgres, tmp_path):
    command = [FOOTFALL, "serve", "--port", "0", "--no-sim", "--data", str(tmp_path)]
    environment = {**os.environ, "FOOTFALL_STORE": postgres.fresh()}
    bind(tmp_path, environment["FOOTFALL_STORE"])
    with closing(Accounts(account_store(tmp_path))) as accounts:
        accounts.add("ada", Role.ADMIN, "a long and good one", LOCAL)
    token = run("accounts", "token", "add", "test", "--account", "ada", "--data", tmp_path).stdout.splitlines()[0]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        try:
            assert process.stdout is not None
            url = process.stdout.readline().split()[-1]
            assert httpx.get(f"{url}/api/v1/me", trust_env=False, verify=False).status_code == 401
            bearer = {"authorization": f"Bearer {token}"}
            with httpx.Client(
                base_url=f"{url}/api/v1", headers=bearer, timeout=BOUND, trust_env=False, verify=False
            ) as client:
                assert client.get("me").json()["name"] == "ada"
                note = client.post("sessions/current/notes", json={"text": "kept"})
                assert note.status_code in (200, 201), note.text
                # made by a worker's process; the answer waits for it
                predicted = client.put("sessions/current/what-if", json={"dz": 0.01})
                assert predicted.status_code == 200, predicted.text
                assert predicted.json()["shift"]["dz"] == 0.01
                session = client.get("sessions/current").json()["id"]
                run("accounts", "token", "revoke", "test", "--data", tmp_path)
                until(lambda: client.get("me").status_code == 401, "the end of the token")
        finally:
            process.send_signal(signal.SIGTERM)
        assert process.wait(BOUND) == 0
    assert binding(tmp_path) is not None
    assert not list(tmp_path.glob("*.sqlite*"))
    assert not [one for one in verify(tmp_path, [session]) if one.harmful]
    assert not list((tmp_path / "jobs").iterdir())
