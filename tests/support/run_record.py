"""What a run of the tests spent its time on, file by file, and which tests were asked twice.

Tests of ``tests/browser`` and ``tests/faults`` drive a real browser, or break real servers: one that fails is asked
once more. Each that needed it is listed with its reason, and :func:`main` fails where they are three or more in the
parts of one ``make test``.
"""

import os
import sys
import time
from collections import defaultdict
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest

ASKED_TWICE = Path("test-outputs") / "asked-twice.txt"
TOO_MANY = 3
FILES_SHOWN = 20
MAY_BE_ASKED_TWICE = ("browser", "faults")
"""Folders of tests."""


def spent() -> tuple[float, float]:
    """Seconds on the wall, and of the processor: of this process and of its children that have ended."""
    used = os.times()
    return time.perf_counter(), used.user + used.system + used.children_user + used.children_system


REASON = 400
"""Signs of a reason that are told."""


class RunRecord:
    """A pytest plugin; with xdist the workers measure and the controller tells."""

    def __init__(self) -> None:
        self.phases: dict[str, tuple[float, float]] = {}
        self.files: dict[str, list[float]] = defaultdict(lambda: [0.0, 0.0, 0.0, 0])
        self.asked_twice: list[tuple[str, str]] = []

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_setup(self) -> Generator[None, Any, Any]:
        return (yield from self._measured("setup"))

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_call(self) -> Generator[None, Any, Any]:
        return (yield from self._measured("call"))

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_teardown(self) -> Generator[None, Any, Any]:
        return (yield from self._measured("teardown"))

    def _measured(self, phase: str) -> Generator[None, Any, Any]:
        wall, processor = spent()
        try:
            return (yield)
        finally:
            wall_after, processor_after = spent()
            self.phases[phase] = wall_after - wall, processor_after - processor

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self, item: pytest.Item, call: Any) -> Generator[None, Any, Any]:
        report = yield
        report.user_properties.append(("spent", list(self.phases.pop(report.when, (0.0, 0.0)))))
        return report

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Called where it is told: in the process itself, or in the controller of several."""
        of_file = self.files[report.nodeid.partition("::")[0]]
        told: Any = next((told for name, told in reversed(report.user_properties) if name == "spent"), (0.0, 0.0))
        wall, processor = told
        computing = min(wall, processor)
        if report.when == "call":
            of_file[1] += wall - computing
            of_file[2] += computing
            of_file[3] += report.outcome != "rerun"
        else:
            of_file[0] += wall
        if report.outcome == "rerun":
            said = [line[1:].strip() for line in report.longreprtext.splitlines() if line.startswith("E ")]
            # a browser's first line does not say of what it waited
            self.asked_twice.append((report.nodeid, " · ".join(said)[:REASON] or "no reason was given"))

    def pytest_terminal_summary(self, terminalreporter: Any, config: pytest.Config) -> None:
        if hasattr(config, "workerinput"):
            return
        tell = terminalreporter.write_line
        rows = sorted(self.files.items(), key=lambda one: -sum(one[1][:3]))
        setup, waiting, computing, cases = (sum(row[i] for _, row in rows) for i in range(4))
        tell("")
        tell(f"where the time went: the slowest {FILES_SHOWN} of {len(rows)} files [s]; waiting: not on the processor")
        tell(f"{'set-up':>8} {'waiting':>8} {'computing':>9} {'cases':>6}  file")
        for name, row in rows[:FILES_SHOWN]:
            tell(f"{row[0]:8.1f} {row[1]:8.1f} {row[2]:9.1f} {row[3]:6.0f}  {name}")
        tell(f"{setup:8.1f} {waiting:8.1f} {computing:9.1f} {cases:6.0f}  all files")
        for name, reason in self.asked_twice:
            tell(f"asked twice: {name}: {reason}")
        if self.asked_twice:
            ASKED_TWICE.parent.mkdir(exist_ok=True)
            with ASKED_TWICE.open("a") as file:
                file.writelines(f"{name}: {reason}\n" for name, reason in self.asked_twice)


def may_be_asked_twice(item: pytest.Item) -> bool:
    """Whether a test is of a folder whose tests drive what is not the project's own."""
    return item.path.parent.name in MAY_BE_ASKED_TWICE


def main() -> int:
    """List what the parts of this run asked twice; 1 where they are too many."""
    told = ASKED_TWICE.read_text().splitlines() if ASKED_TWICE.exists() else []
    ASKED_TWICE.unlink(missing_ok=True)
    for line in told:
        print(f"asked twice: {line}", file=sys.stderr)
    if len(told) < TOO_MANY:
        return 0
    print(f"{len(told)} tests had to be asked twice; {TOO_MANY} or more fail the run", file=sys.stderr)
    return 1


if __name__ == "__main__":
    raise SystemExit(main())
