"""Runs the benchmarks by area and prints every figure; ``footfall bench`` and ``make bench`` call this."""

import json
from collections.abc import Callable, Iterator

from benchmarks import (
    attacks,
    clearance,
    compliance,
    console,
    greens,
    heuristics,
    limbs,
    many_sessions,
    maps,
    operations,
    physics,
    referee,
    route,
    scans,
    stand,
    step,
    terrain,
)
from benchmarks.timing import Figure, machine, promised
from benchmarks.walks import area as walks

AREAS: dict[str, Callable[[bool], Iterator[Figure]]] = {
    "terrain": terrain.figures,
    "maps": maps.figures,
    "greens": greens.figures,
    "clearance": clearance.figures,
    "scans": scans.figures,
    "stand": stand.figures,
    "limb": limbs.figures,
    "step": step.figures,
    "route": route.figures,
    "heuristics": heuristics.figures,
    "compliance": compliance.figures,
    "physics": physics.figures,
    "referee": referee.figures,
    "console": console.figures,
    "operations": operations.figures,
    "attacks": attacks.figures,
    "sessions": many_sessions.figures,
    "walk": walks.figures,
}


def main(areas: list[str] | None = None, quick: bool = False, as_json: bool = False) -> int:
    """Measure the areas (all when none is named). Returns 0 when every floor holds, of medians and of p95, else 1."""
    results: dict[str, dict[str, object]] = {}
    about = machine()
    if not as_json:
        print(f"{about['processor']}, {about['cores']} cores, Python {about['python']}, seed {about['seed']}")
        print("  ".join(f"{name} {number}" for name, number in about["libraries"].items()))  # type: ignore[union-attr]
        print(f"{'figure':<58}{'median':>12}{'p95':>12}  {'unit':<7}{'n':>4}  floor")
    for area in areas or list(AREAS):
        for figure in AREAS[area](quick):
            row = figure.as_dict()
            results[figure.name] = row
            if not as_json:
                print(
                    f"{figure.name:<58}{row['median']:>12.4g}{row['p95']:>12.4g}  "
                    f"{figure.unit:<7}{row['n']:>4}  {promised(row)}",
                    flush=True,
                )
    if as_json:
        print(json.dumps({"machine": about, "figures": results}, indent=2))
    missed = any(False in (row["holds"], row["p95_holds"]) for row in results.values())
    return 1 if missed else 0
