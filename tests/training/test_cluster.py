"""Routes made by a cluster of processes that others started: the same table, and none lost with it."""

import os
import signal
import subprocess
import sys
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import pytest

from footfall.core.errors import InvalidInput, WorkerLost
from tests.support.waiting import BOUND, until
from tests.training.test_learning import SEEDS, made, table
from training import cluster, gait_policy
from training.cluster import made_by_many
from training.command import exit_code
from training.finished import Finished, completed

ROOT = Path(__file__).resolve().parents[2]
TASKS = [(str(seed), seed) for seed in SEEDS]


@contextmanager
def dask_cluster(folder: Path):
    """A scheduler on a free port and one worker; its process, and its address."""
    folder.mkdir()
    file = folder / "scheduler.json"
    started = []

    def start(what, *arguments):
        with (folder / f"{what}.log").open("w") as log:
            command = [sys.executable, "-m", f"distributed.cli.dask_{what}", *arguments]
            environment = {**os.environ, "PYTHONPATH": f"{ROOT / 'backend'}{os.pathsep}{ROOT}"}
            started.append(subprocess.Popen(command, cwd=folder, env=environment, stdout=log, stderr=log))

    def logs():
        return [path.read_text()[-2000:] for path in folder.glob("*.log")]

    try:
        ports = ("--port", "0", "--dashboard-address", "127.0.0.1:0")
        start("scheduler", "--host", "127.0.0.1", *ports, "--scheduler-file", str(file))
        until(file.exists, "a scheduler", seen=logs)
        options = ("--nthreads", "1", "--no-nanny", "--dashboard-address", "127.0.0.1:0", "--host", "127.0.0.1")
        start("worker", "--scheduler-file", str(file), *options)
        address = f"tcp://127.0.0.1:{_port(file)}"
        yield started[0], address
    finally:
        for process in started:
            process.kill()
            process.wait(BOUND)


def _port(file: Path) -> str:
    return file.read_text().split("127.0.0.1:")[1].split('"')[0]


def made_at_the_gate(gate, task):
    """All but the first wait until the file ``gate`` is there."""
    if task[1] != SEEDS[0]:
        until(Path(gate).exists, "the gate")
    return made(task)


def test_a_cluster_makes_the_same_table_and_one_that_is_lost_costs_nothing_that_is_finished(tmp_path):
    alone = table(tmp_path / "alone.jsonl", 1)
    path, gate, finished = tmp_path / "routes.jsonl", tmp_path / "gate", []
    with dask_cluster(tmp_path / "first") as (scheduler, address):

        def lost_after_one(text):
            finished.append(text)
            scheduler.send_signal(signal.SIGKILL)

        make = partial(made_at_the_gate, str(gate))
        with pytest.raises(WorkerLost, match="the same command goes on"):
            list(completed(Finished(path, {"made": 1}), TASKS, make, lost_after_one, scheduler=address))
    assert len(finished) == 1
    assert (str(SEEDS[0])) in Finished(path, {"made": 1})
    gate.touch()
    again = []
    with dask_cluster(tmp_path / "second") as (_, address):
        list(completed(Finished(path, {"made": 1}), TASKS, make, again.append, scheduler=address))
    assert len(again) == len(TASKS) - 1
    assert table(path, 1) == alone


def test_workers_of_another_program_are_refused(tmp_path, monkeypatch):
    with dask_cluster(tmp_path / "cluster") as (_, address):
        monkeypatch.setattr(cluster, "program", lambda: "0" * 32)
        with pytest.raises(InvalidInput, match="another FootFall"):
            list(made_by_many(TASKS, made, 1, address))


def test_what_is_no_scheduler_is_told_before_anything_is_asked(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["x", "--out", str(tmp_path / "a.npz"), "--scheduler", "tcp://127.0.0.1:1"])
    assert exit_code(gait_policy.main) == 1
    assert "no scheduler answers at tcp://127.0.0.1:1; start one with" in capsys.readouterr().err


def test_a_module_that_differs_makes_another_program(tmp_path, monkeypatch):
    class Package:
        __path__ = (str(tmp_path),)

    monkeypatch.setattr(cluster, "footfall", Package)
    found = set()
    for text in ("a = 1\n", "a = 2\n"):
        (tmp_path / "module.py").write_text(text)
        cluster.program.cache_clear()
        found.add(cluster.program())
    cluster.program.cache_clear()
    assert len(found) == 2
