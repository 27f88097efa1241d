"""The set: which seeds of each family belong to it, and what is known of each problem's solvability.

``known.csv`` is written by ``python -m benchmarks.steps.solvability``. A problem counts as solvable if a certified
motion was found for it, as unsolvable if that is proven (benchmarks/steps/unsolvable.py), otherwise as unknown.
"""

import csv
import hashlib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.steps.families import problem
from benchmarks.steps.problem import Scene, StepProblem

FILE = Path(__file__).with_name("known.csv")
COLUMNS = ("family", "seed", "ground", "straight", "goals", "known", "by", "seconds")


@dataclass(frozen=True)
class Known:
    """ground: fingerprint of terrain and target; straight: whether a straight swing is free; goals: postures that the
    wheel can be lowered to; known: "solvable", "unsolvable" or "unknown"; by: what found the solution, or what proves
    that there is none; seconds: of processor time."""

    problem: StepProblem
    ground: str
    straight: bool
    goals: int
    known: str
    by: str
    seconds: float

    @property
    def solvable(self) -> bool:
        return self.known == "solvable"

    @property
    def unsolvable(self) -> bool:
        return self.known == "unsolvable"


def fingerprint(problem: StepProblem, scene: Scene) -> str:
    """Of heights to 0.1 mm and everything else that the problem says: the same on every machine."""
    heights = np.nan_to_num(np.round(scene.dem.heights.astype(np.float64) * 1e4), nan=-(2.0**31)).astype(np.int64)
    told = f"{problem.name} {problem.leg} {problem.posture} {problem.load}"
    numbers = np.round([*problem.place, *problem.target, *np.ravel(problem.turned)], 6)
    return hashlib.sha256(heights.tobytes() + told.encode() + (numbers + 0.0).tobytes()).hexdigest()[:16]


@cache
def known() -> tuple[Known, ...]:
    """The whole set, family by family."""
    with FILE.open(newline="") as file:
        rows = list(csv.DictReader(file))
    return tuple(
        Known(
            problem(row["family"], int(row["seed"])),
            row["ground"],
            row["straight"] == "free",
            int(row["goals"]),
            row["known"],
            row["by"],
            float(row["seconds"]),
        )
        for row in rows
    )


def write(rows: list[Known]) -> None:
    with FILE.open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        for row in rows:
            straight = "free" if row.straight else "blocked"
            one = row.problem
            table.writerow(
                (one.family, one.seed, row.ground, straight, row.goals, row.known, row.by, f"{row.seconds:.2f}")
            )
