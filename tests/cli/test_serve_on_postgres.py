"""``footfall serve`` with its sessions in PostgreSQL: the same answers, work through the queue, nothing left behind."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import httpx

from footfall.session.storage.databases import binding
from footfall.session.storage.verify import verify

FOOTFALL = str(Path(sys.executable).with_name("footfall"))


def test_a_server_on_postgres_works_through_its_worker_and_leaves_a_whole_log(postgres, tmp_path):
    command = [FOOTFALL, "serve", "--port", "0", "--no-sim", "--data", str(tmp_path)]
    environment = {**os.environ, "FOOTFALL_STORE": postgres.fresh()}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        try:
            assert process.stdout is not None
            url = process.stdout.readline().split()[-1]
            with httpx.Client(base_url=f"{url}/api/v1", timeout=60, trust_env=False) as client:
                note = client.post("sessions/current/notes", json={"text": "kept"})
                assert note.status_code in (200, 201), note.text
                # made by a worker's process; the answer waits for it
                predicted = client.put("sessions/current/what-if", json={"dz": 0.01})
                assert predicted.status_code == 200, predicted.text
                assert predicted.json()["shift"]["dz"] == 0.01
                session = client.get("sessions/current").json()["id"]
        finally:
            process.send_signal(signal.SIGTERM)
        assert process.wait(60) == 0
    assert binding(tmp_path) is not None
    assert not (tmp_path / "footfall.sqlite").exists()
    assert not [one for one in verify(tmp_path, [session]) if one.harmful]
    assert not list((tmp_path / "jobs").iterdir())
