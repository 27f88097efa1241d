"""Runs tests against a mutant, in a copy of the tree: the working tree is never touched.

Each verdict is of a process of its own, forked from one that has loaded the libraries (none of ours), so that it starts
in no time and nothing is left over from the one before.
"""

import math
import os
import resource
import shutil
import signal
import sys
import time
import traceback
from importlib import import_module
from pathlib import Path
from tempfile import mkdtemp
from typing import Literal, NoReturn

import pytest
from hypothesis import Phase, settings

ROOT = Path(__file__).resolve().parents[2]
LEFT_OUT = shutil.ignore_patterns(".git", ".venv", ".hypothesis", "node_modules", "test-outputs", "var")
LOADED = ("numpy", "scipy.optimize", "scipy.spatial", "scipy.ndimage", "numba", "shapely", "httpx", "structlog")
"""Libraries that most judges load."""
DOES_NOT_LOAD = 77
ASLEEP = 50
"""A child that takes so many times its bound by the clock waits for what never comes."""
Verdict = Literal["killed", "survived", "endless", "does not load"]


class WithoutShrinking:
    """A pytest plugin: the first example that fails is enough."""

    def pytest_sessionstart(self) -> None:
        settings.register_profile("mutants", settings(), phases=(Phase.explicit, Phase.generate))
        settings.load_profile("mutants")


class Court:
    """One copy of the tree, where mutants are judged one after the other."""

    def __init__(self, within: str) -> None:
        self.folder = Path(mkdtemp(dir=within))
        self.tree = self.folder / "tree"
        shutil.copytree(ROOT, self.tree, ignore=LEFT_OUT, symlinks=True)
        (self.tree / ".venv").symlink_to((ROOT / ".venv").resolve())
        for library in LOADED:
            import_module(library)

    def verdict(
        self, module: str, source: str, judges: tuple[str, ...], bound: float, interpreted: bool
    ) -> tuple[Verdict, float]:
        """What the judges say of ``source`` in the place of ``module``, and the processor seconds that they took.

        bound: in processor seconds, as a busy machine must not take for endless what is merely slow. interpreted:
        compiled code runs as plain Python, which spares compiling every mutant.
        """
        path = self.tree / "backend" / "footfall" / module
        kept = path.read_bytes()
        path.write_text(source, "utf-8")
        try:
            child = os.fork()
            if child == 0:
                resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(bound), math.ceil(bound) + 1))
                self._judge(module, judges, interpreted)
            status, took = self._waited(child, time.monotonic() + ASLEEP * bound)
        finally:
            path.write_bytes(kept)
        code = os.waitstatus_to_exitcode(status)
        if code in (-signal.SIGXCPU, -signal.SIGKILL):
            return "endless", took
        return ("survived" if code == 0 else "does not load" if code == DOES_NOT_LOAD else "killed"), took

    def _waited(self, child: int, until: float) -> tuple[int, float]:
        """How the child ended, and its processor seconds; it is killed where it waits for ever."""
        while True:
            ended, status, used = os.wait4(child, os.WNOHANG)
            if ended:
                return status, used.ru_utime + used.ru_stime
            if time.monotonic() > until:
                os.killpg(child, signal.SIGKILL)
            time.sleep(0.02)

    def _judge(self, module: str, judges: tuple[str, ...], interpreted: bool) -> NoReturn:
        """All that the child does: it ends with 0 where the tests pass."""
        code = 1
        try:
            code = self._judged(module, judges, interpreted)
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)

    def _judged(self, module: str, judges: tuple[str, ...], interpreted: bool) -> int:
        os.setsid()
        said = os.open(self.folder / "said.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        for stream in (1, 2):
            os.dup2(said, stream)
        os.chdir(self.tree)
        paths = [str(self.tree / "backend"), str(self.tree)]
        sys.path[:] = paths + [one for one in sys.path if one not in (str(ROOT), str(ROOT / "backend"), "")]
        os.environ |= {"PYTHONPATH": os.pathsep.join(paths), "PYTHONDONTWRITEBYTECODE": "1"}
        os.environ.setdefault("FOOTFALL_TEST_BOUND", "20")
        sys.dont_write_bytecode = True
        if interpreted:
            os.environ["NUMBA_DISABLE_JIT"] = "1"
            vars(import_module("numba.core.config"))["DISABLE_JIT"] = True
        for name in [one for one in sys.modules if one.partition(".")[0] in ("benchmarks", "footfall", "tests")]:
            del sys.modules[name]
        try:
            import_module("footfall." + module.removesuffix(".py").replace("/", "."))
        except Exception as err:
            print(f"does not load: {err!r}", flush=True)
            return DOES_NOT_LOAD
        return int(pytest.main(["-x", "-q", "--no-header", "--assert=plain", *judges], plugins=[WithoutShrinking()]))

    def said(self) -> str:
        """What the latest judges printed."""
        return (self.folder / "said.txt").read_text(errors="replace")
