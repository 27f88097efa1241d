"""Figures of this tree beside those of an earlier revision: ``python -m benchmarks.revisions REVISION AREA…``.

The revision is laid out in a folder of its own, with its own benchmarks, and both sources are compiled first. Then the
areas run in turns, before, now, now, before, so that a machine that grows slower or faster weighs on both alike. A
pair is one run of each; its ratio is this tree's median over the revision's. Figures that only one of them has are
named below the table. ``--quick`` makes fewer repetitions, ``--pairs`` more pairs.
"""

import argparse
import io
import json
import os
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from footfall.processor import NEEDED, choices

ROOT = Path(__file__).resolve().parents[1]

Run = Mapping[str, float]
"""Name of a figure → its median, of one run."""


@dataclass(frozen=True)
class Compared:
    """A figure of both. before, now: its medians of each run; ratios: now over before, of each pair."""

    name: str
    before: tuple[float, ...]
    now: tuple[float, ...]

    @property
    def ratios(self) -> tuple[float, ...]:
        """NaN where both are 0, infinite where only the earlier one is."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return tuple((np.array(self.now) / np.array(self.before)).tolist())

    def __str__(self) -> str:
        low, middle, high = min(self.ratios), float(np.median(self.ratios)), max(self.ratios)
        sizes = f"{np.median(self.before):>12.4g}{np.median(self.now):>12.4g}"
        return f"{self.name:<58}{sizes}{middle:>8.3f}  {low:.3f} to {high:.3f}"


def archive_of(revision: str, repository: Path, *folders: str) -> tarfile.TarFile:
    """What git has of a revision, in these folders or in all; raises CalledProcessError where there is none such."""
    asked = ["git", "archive", "--format=tar", revision, "--", *folders]
    packed = subprocess.run(asked, cwd=repository, check=True, stdout=subprocess.PIPE).stdout
    return tarfile.open(fileobj=io.BytesIO(packed))


def lay_out(revision: str, folder: Path, repository: Path = ROOT) -> Path:
    """Write what git has of a revision into a folder; raises CalledProcessError where there is no such revision."""
    with archive_of(revision, repository) as archive:
        archive.extractall(folder, filter="data")
    return folder


def called(source: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run ``footfall`` of a source with this tree's libraries; its exit code tells of floors and is not looked at.

    It chooses its arithmetic itself.
    """
    path = os.pathsep.join([str(source / "backend"), str(source)])
    kept = {name: text for name, text in os.environ.items() if name not in choices(NEEDED)}
    program = "from footfall.cli import app; app()"
    return subprocess.run(
        [sys.executable, "-c", program, *arguments],
        cwd=source,
        env={**kept, "PYTHONPATH": path},
        stdout=subprocess.PIPE,
        text=True,
        check=False,
    )


def run_of(source: Path, areas: Sequence[str], quick: bool) -> Run:
    """The medians of one run; raises ValueError with what was printed where that is no table of figures."""
    printed = called(source, "bench", "--json", *areas, *(["--quick"] if quick else [])).stdout
    try:
        figures = json.loads(printed)["figures"]
    except (ValueError, KeyError) as error:
        raise ValueError(f"{source}: the benchmarks printed no figures: {printed[-500:]!r}") from error
    return {name: row["median"] for name, row in figures.items()}


def in_turns(before: Path, now: Path, pairs: int) -> Iterator[Path]:
    """Whose turn it is: before, now, now, before, and so on."""
    for pair in range(pairs):
        yield from (before, now) if pair % 2 == 0 else (now, before)


def compared(before: Sequence[Run], now: Sequence[Run]) -> list[Compared]:
    """The figures that every run has."""
    names = [name for name in now[0] if all(name in run for run in (*before, *now))]
    return [Compared(name, *(tuple(run[name] for run in runs) for runs in (before, now))) for name in names]


def of_one_only(before: Sequence[Run], now: Sequence[Run]) -> dict[str, list[str]]:
    """Figures that not every run has, by which side lacks them."""
    every = {name: None for run in (*now, *before) for name in run}
    sides = {"before": before, "now": now}
    return {side: [name for name in every if not all(name in run for run in runs)] for side, runs in sides.items()}


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and print. Returns 1 where the two have no figure in common, else 0."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("revision")
    parser.add_argument("areas", nargs="+")
    parser.add_argument("--pairs", type=int, default=2)
    parser.add_argument("--quick", action="store_true")
    asked = parser.parse_args(arguments)
    if asked.pairs < 1:
        parser.error("--pairs must be at least 1")
    with tempfile.TemporaryDirectory() as folder:
        before = lay_out(asked.revision, Path(folder))
        runs: dict[Path, list[Run]] = {before: [], ROOT: []}
        for source in runs:
            called(source, "compile")
        for source in in_turns(before, ROOT, asked.pairs):
            runs[source].append(run_of(source, asked.areas, asked.quick))
        rows, lacking = compared(runs[before], runs[ROOT]), of_one_only(runs[before], runs[ROOT])
    print(f"{'figure':<58}{'before':>12}{'now':>12}{'ratio':>8}  of {asked.pairs} pairs")
    print(*rows, sep="\n")
    for side, names in lacking.items():
        if names:
            print(f"not measured {side}: {', '.join(names)}")
    return 0 if rows else 1


if __name__ == "__main__":
    sys.exit(main())
