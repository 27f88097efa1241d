"""A PostgreSQL server that lasts as long as the tests of one process, where one is installed."""

import os
import shutil
import subprocess
import tempfile
import uuid
from contextlib import closing
from pathlib import Path
from urllib.parse import quote

import psycopg

OTHER = "postgres" if os.getuid() == 0 else None
"""The server refuses to run as root; the package makes this user."""


def installed() -> Path | None:
    """Folder of the newest server's programs."""
    found = [*Path("/usr/lib/postgresql").glob("*/bin"), *(Path(p).parent for p in [shutil.which("initdb")] if p)]
    return max((one for one in found if (one / "initdb").exists() and (one / "postgres").exists()), default=None)


class Postgres:
    """One cluster that listens on a socket in its folder and nowhere else."""

    def __init__(self, programs: Path) -> None:
        self._programs = programs
        self.folder = Path(tempfile.mkdtemp(prefix="footfall-pg-"))
        if OTHER is not None:
            shutil.chown(self.folder, OTHER)
        command = [str(programs / "initdb"), "-D", f"{self.folder}/data", "-U", "tests", "-A", "trust", "--no-sync"]
        self._run([*command, "--no-locale", "-E", "UTF8"])
        # stops the server and removes its files when this process is gone, however that ended
        stop = f"{programs}/pg_ctl stop -w -m immediate -D {self.folder}/data; rm -rf {self.folder}"
        self._end = subprocess.Popen(
            ["/bin/sh", "-c", f"read over; {stop}"], stdin=subprocess.PIPE, user=OTHER, group=OTHER, cwd="/",
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
        )  # fmt: skip
        self.start()

    def start(self) -> None:
        """Returns once it answers."""
        options = f"-k {self.folder} -c listen_addresses= -c shared_buffers=16MB -c max_connections=50"
        self._control("start", "-w", "-o", options, "-l", f"{self.folder}/log")

    def stop(self, mode: str = "fast") -> None:
        """mode: "fast", or "immediate": as if the machine had died."""
        self._control("stop", "-w", "-m", mode)

    def fresh(self) -> str:
        """Address of a schema of its own, empty."""
        name = f"t{uuid.uuid4().hex[:12]}"
        with closing(psycopg.connect(self.address(), autocommit=True)) as database:
            database.execute(f"CREATE SCHEMA {name}".encode())
        return self.address(name)

    def address(self, schema: str | None = None) -> str:
        options = "" if schema is None else f"&options={quote(f'-csearch_path={schema}')}"
        return f"postgresql://tests@/postgres?host={self.folder}{options}"

    def end(self) -> None:
        """Stop it, and remove it."""
        self._end.communicate()

    def _control(self, what: str, *options: str) -> None:
        self._run([str(self._programs / "pg_ctl"), what, "-D", f"{self.folder}/data", *options])

    def _run(self, command: list[str]) -> None:
        done = subprocess.run(
            command, user=OTHER, group=OTHER, cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
            text=True, check=False,
        )  # fmt: skip
        if done.returncode:
            log = self.folder / "log"
            raise RuntimeError(f"{command}: {done.stderr}\n{log.read_text() if log.exists() else ''}")
