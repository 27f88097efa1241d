"""Measured figures: medians and p95 of repeated calls, and ratios to a peer measured in the same run."""

import os
import platform
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np

SEED = 20081
LIBRARIES = (
    "numpy",
    "scipy",
    "pin",
    "coal",
    "ompl",
    "opencv-python-headless",
    "numba",
    "highspy",
    "mujoco-core",
    "trimesh",
    "embreex",
)


@dataclass(frozen=True)
class Figure:
    """One measured quantity.

    floor: what its median must reach; at_most: which side is good; p95_at_most: what its p95 must not exceed. None:
    nothing is promised.
    """

    name: str
    samples: tuple[float, ...]
    unit: str
    floor: float | None = None
    at_most: bool = True
    p95_at_most: float | None = None

    def as_dict(self) -> dict[str, object]:
        """holds, p95_holds: None where nothing is promised."""
        median, p95 = float(np.median(self.samples)), float(np.percentile(self.samples, 95))
        holds = None if self.floor is None else bool(median <= self.floor if self.at_most else median >= self.floor)
        return {
            "median": median,
            "p95": p95,
            "unit": self.unit,
            "n": len(self.samples),
            "floor": self.floor,
            "holds": holds,
            "p95_at_most": self.p95_at_most,
            "p95_holds": None if self.p95_at_most is None else p95 <= self.p95_at_most,
        }


def promised(row: Mapping[str, object]) -> str:
    """What a row of :meth:`Figure.as_dict` must reach and whether it does; empty where nothing is promised."""
    told = []
    for name, asked, held in (("", "floor", "holds"), ("p95 ", "p95_at_most", "p95_holds")):
        if row[asked] is not None:
            told.append(f"{name}{row[asked]:g} {'holds' if row[held] else 'DOES NOT HOLD'}")
    return ", ".join(told)


def seconds(call: Callable[[], object], n: int, warm: bool = True) -> tuple[float, ...]:
    """Wall-clock seconds of ``n`` calls, after one that is not counted."""
    if warm:
        call()
    times = []
    for _ in range(n):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return tuple(times)


def paired(name: str, ours: Callable[[], object], peer: Callable[[], object], n: int) -> Figure:
    """Ratio ours / peer, the two in turn, so that the drift of the machine cancels."""
    ours()
    peer()
    ratios = tuple(seconds(ours, 1, warm=False)[0] / seconds(peer, 1, warm=False)[0] for _ in range(n))
    return Figure(name, ratios, "ratio")


def machine() -> dict[str, object]:
    """Processor, Python and library versions, and the seed of every random problem."""
    model = platform.processor() or "unknown"
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text().splitlines():
            if line.startswith("model name"):
                model = line.partition(":")[2].strip()
                break

    return {
        "processor": model,
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
        "libraries": {name: version(name) for name in LIBRARIES},
        "seed": SEED,
    }
