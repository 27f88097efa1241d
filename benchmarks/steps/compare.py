"""All planners side by side over the whole set: ``python -m benchmarks.steps.compare --table PAGE --plot PICTURE``.

Each planner gets each problem once with one seed, but those that are known to have no solution: they are asked of auto
alone, which has to say no. In every scene a step is planned first that is not counted, so that no planner pays for
preparing it; the first problem is planned by all of them first, so that none pays for loading what it alone needs.
"""

import argparse
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.steps.families import MAKERS
from benchmarks.steps.figures import chosen
from benchmarks.steps.known import Known
from benchmarks.steps.problem import build
from benchmarks.steps.quality import Outcome, planned
from benchmarks.timing import machine

ORDER = ("line", "fast", "astar", "sbl", "rrtconnect", "kpiece", "bitstar", "auto", "race")
LABELS = {
    "line": "line",
    "fast": "fast (compiled SBL)",
    "astar": "A*",
    "sbl": "SBL",
    "rrtconnect": "RRTConnect (OMPL)",
    "kpiece": "KPIECE1 (OMPL)",
    "bitstar": "BIT* (OMPL)",
    "auto": "auto",
    "race": "race",
}
SEED = 1
BEGIN, END = "<!-- measured: begin -->", "<!-- measured: end -->"
"""What stands between these lines of the page is written anew; the rest is left as it is."""

Outcomes = dict[str, list[Outcome]]


def measured(rows: Sequence[Known], limit: float) -> Outcomes:
    """Of every planner the outcome of each problem; ``limit``: wall clock of one plan [s]."""
    outcomes: Outcomes = {planner: [] for planner in ORDER}
    for number, row in enumerate(rows):
        scene = build(row.problem)
        # a straight line alone does not fill the tables that every search asks
        for planner in ORDER if number == 0 else ("line", "auto"):
            planned(row.problem, scene, planner, limit, SEED)
        for planner in ORDER:
            outcomes[planner].append(planned(row.problem, scene, planner, limit, SEED))
        if number % 20 == 19:
            print(f"{number + 1} of {len(rows)} problems, {time.process_time():.0f} s", flush=True)
    return outcomes


def tables(rows: Sequence[Known], outcomes: Outcomes, limit: float) -> str:
    """The three tables in Markdown."""
    blocked = np.array([not row.straight for row in rows])
    found = {planner: np.array([one.found for one in outcomes[planner]]) for planner in ORDER}
    about, unknown = machine(), sum(not row.solvable for row in rows)
    lines = [
        f"{len(rows)} problems, {unknown} of them *unknown*, {int(blocked.sum())} without a free straight swing; one "
        f"seed ({SEED}); at most {limit:g} s of wall clock a plan. {about['processor']}, {about['cores']} cores, other "
        "programs beside; "
        f"Python {about['python']}, "
        + ", ".join(f"{name} {about['libraries'][name]}" for name in ("ompl", "coal", "numba"))  # type: ignore[index]
        + ".",
        "",
        "All problems:",
        "",
        "| planner | solved | median time | 95 % | slowest found |",
        "| --- | ---: | ---: | ---: | ---: |",
    ]
    for planner in ORDER:
        times = 1e3 * _of(outcomes[planner], "seconds")[found[planner]]
        lines.append(
            f"| {LABELS[planner]} | {found[planner].sum()} of {len(rows)} | {np.median(times):.1f} ms "
            f"| {np.percentile(times, 95):.0f} ms | {times.max():.0f} ms |"
        )
    searching = [planner for planner in ORDER if planner != "line"]
    every = blocked & np.all([found[planner] for planner in searching], axis=0)
    lines += [
        "",
        f"The {int(every.sum())} problems without a free straight swing that all of these solve (medians):",
        "",
        "| planner | time | length | clearance | smoothness |",
        "| --- | ---: | ---: | ---: | ---: |",
    ]
    for planner in searching:
        of = [one for one, chosen_ in zip(outcomes[planner], every, strict=True) if chosen_]
        medians = {name: float(np.median(_of(of, name))) for name in ("seconds", "length", "clearance", "smoothness")}
        lines.append(
            f"| {LABELS[planner]} | {1e3 * medians['seconds']:.1f} ms | {medians['length']:.2f} rad "
            f"| {1e3 * medians['clearance']:.1f} mm | {medians['smoothness']:.2f} rad |"
        )
    lines += ["", "Solved, family by family:", ""]
    lines += ["| family | " + " | ".join(LABELS[planner] for planner in ORDER) + " |"]
    lines += ["| --- |" + " ---: |" * len(ORDER)]
    families = np.array([row.problem.family for row in rows])
    for family in MAKERS:
        own = families == family
        if own.any():
            counts = " | ".join(f"{int(found[planner][own].sum())}" for planner in ORDER)
            lines.append(f"| {family} ({int(own.sum())}) | {counts} |")
    return "\n".join(lines) + "\n"


def refusals(rows: Sequence[Known], limit: float) -> str:
    """What auto answers to problems without a solution, in Markdown."""
    lines = [
        "",
        f"{len(rows)} problems are proven to have no solution; `auto` answers:",
        "",
        "| family | problems | answer | median time | slowest |",
        "| --- | ---: | --- | ---: | ---: |",
    ]
    found: dict[tuple[str, str], list[float]] = {}
    for row in rows:
        scene = build(row.problem)
        planned(row.problem, scene, ORDER[0], limit, SEED)
        one = planned(row.problem, scene, "auto", limit, SEED)
        found.setdefault((row.problem.family, one.result.status.value), []).append(one.seconds)
    for (family, answer), seconds in found.items():
        times = 1e3 * np.array(seconds)
        lines.append(f"| {family} | {len(times)} | {answer} | {np.median(times):.1f} ms | {times.max():.0f} ms |")
    return "\n".join(lines) + "\n"


def plot(rows: Sequence[Known], outcomes: Outcomes, path: Path) -> None:
    """Left: share solved over time. Right: length over that of the shortest path found for the problem."""
    import matplotlib as mpl
    from matplotlib.figure import Figure as Picture

    mpl.rcParams["svg.hashsalt"] = "footfall"
    picture = Picture(figsize=(10, 4), layout="constrained")
    left, right = picture.subplots(1, 2)
    blocked = np.array([not row.straight for row in rows])
    searching = [planner for planner in ORDER if planner != "line"]
    lengths = {planner: _of(outcomes[planner], "length")[blocked] for planner in searching}
    with np.errstate(invalid="ignore"):
        shortest = np.nanmin(np.stack([*lengths.values(), np.full(int(blocked.sum()), np.inf)]), axis=0)
    for planner in ORDER:
        times = np.sort([one.seconds for one in outcomes[planner] if one.found])
        left.step(1e3 * times, 100 * np.arange(1, len(times) + 1) / len(rows), where="post", label=LABELS[planner])
    left.set(xscale="log", xlabel="processor time [ms]", ylabel="problems solved [%]", ylim=(0, 101))
    left.grid(alpha=0.3)
    left.legend(fontsize=8, loc="lower right")
    ratios = [(lengths[planner] / shortest)[np.isfinite(lengths[planner])] for planner in searching]
    right.boxplot(ratios, orientation="horizontal", showfliers=False, whis=(5, 95))
    right.set_yticks(range(1, len(searching) + 1), [LABELS[planner] for planner in searching], fontsize=8)
    right.set(xlabel="length of the swing / shortest found for the problem")
    right.grid(axis="x", alpha=0.3)
    picture.savefig(path, metadata={"Date": None})


def _of(outcomes: Sequence[Outcome], name: str) -> NDArray[np.float64]:
    return np.array([getattr(one, name) for one in outcomes], float)


def _put(page: Path, text: str) -> None:
    whole = page.read_text() if page.exists() else f"# Planners\n\n{BEGIN}\n{END}\n"
    before, rest = whole.split(BEGIN)
    page.write_text(f"{before}{BEGIN}\n{text}{END}{rest.split(END)[1]}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--table", type=Path, help="page whose measured part is written anew")
    parser.add_argument("--plot", type=Path, help="picture that is written, .svg or .png")
    parser.add_argument("--limit", type=float, default=5.0, help="wall clock of one plan [s]")
    parser.add_argument("--per-family", type=int, help="only so many problems of each family")
    asked = parser.parse_args()
    everything = chosen(asked.per_family)
    rows = [row for row in everything if not row.unsolvable]
    outcomes = measured(rows, asked.limit)
    text = tables(rows, outcomes, asked.limit)
    text += refusals([row for row in everything if row.unsolvable], asked.limit)
    print(text)
    for row, one in zip(rows, outcomes["auto"], strict=True):
        if row.solvable and not one.found:
            print(f"solvable, but auto says: {row.problem.name}: {one.result.reason}")
    if asked.table:
        _put(asked.table, text)
    if asked.plot:
        plot(rows, outcomes, asked.plot)


if __name__ == "__main__":
    main()
