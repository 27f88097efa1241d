"""What the scene as it is drawn now costs: a layer switched and a ghost moved, paired with an earlier source.

``python -m benchmarks.scene_before TREE``: TREE is a folder with another state of this source, as ``git worktree add``
makes it, whose kernels are compiled. Both are served at once, each by its own source in a process of its own, and
asked in turns; told is the median of the ratios of each pair, now over before. Bytes are those that one page is sent;
when the last of them came is wall-clock time. No browser draws: what a picture takes is in ``scene_frames``.
"""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import viser

from benchmarks.console.apart import served_apart
from benchmarks.console.scene_line import LAYERS, Switching, switching
from benchmarks.timing import machine

NAMES = ("layer shown before, shown again", "another place of the ghost")

Pair = tuple[tuple[int, float], tuple[int, float]]
"""Bytes, and seconds until the last of them, now and before."""


def in_turns(count: int) -> Iterator[tuple[int, int]]:
    """Which of the two is asked first, and which then: each is first as often."""
    return iter([(0, 1), (1, 0)] * (count // 2))


def taken(pages: tuple[Switching, Switching], count: int) -> tuple[list[Pair], list[Pair]]:
    """Pairs of what a layer takes, and a place of the ghost, now and before."""
    layers, places = [], []
    for i, order in enumerate(in_turns(count)):
        took = {number: pages[number].switched(LAYERS[(i + 1) % 2]) for number in order}
        layers.append((took[0], took[1]))
        took = {number: pages[number].moved(0.2 + 0.6 * i / count) for number in order}
        places.append((took[0], took[1]))
    return layers, places


def row(name: str, unit: str, pairs: list[tuple[float, float]]) -> str:
    """Medians of both, and of the ratios of each pair, with the least and the largest."""
    found = np.array(pairs, float)
    ratios = found[:, 0] / found[:, 1]
    now, before = np.median(found, axis=0)
    return (
        f"{name:<36}{now:>z12.4g}{before:>z12.4g}  {unit:<6}"
        f"{np.median(ratios):>z8.2f}  ({ratios.min():z.2f} to {ratios.max():z.2f}, {len(pairs)} pairs)"
    )


def main() -> int:
    """Prints the ratios."""
    parser = argparse.ArgumentParser(
        description="what switching layers and moving the ghost take, beside another source"
    )
    parser.add_argument("tree", type=Path, help="a folder with that source, its kernels compiled")
    parser.add_argument("--pairs", type=int, default=10, help="how often each is asked of both, an even number")
    asked = parser.parse_args()
    about = machine()
    print(
        f"{about['processor']}, {about['cores']} cores, viser {viser.__version__}; beside {asked.tree.resolve().name}"
    )
    print(f"{'':<36}{'now':>12}{'before':>12}  {'':<6}{'ratio':>8}")
    with (
        served_apart(rover=False) as now,
        served_apart(rover=False, tree=asked.tree.resolve()) as before,
        now.client() as of_now,
        before.client() as of_before,
        switching(now, of_now) as one,
        switching(before, of_before) as other,
    ):
        for name, pairs in zip(NAMES, taken((one, other), asked.pairs), strict=True):
            print(row(name, "bytes", [(a[0], b[0]) for a, b in pairs]))
            print(row("  the last of them after", "s", [(a[1], b[1]) for a, b in pairs]), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
