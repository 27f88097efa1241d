"""Goals in either order, planners one after the other or in a race: ``python -m benchmarks.steps.choices``.

What an operator may choose of a step beside the footfall, on the problem set:

- the order of the goal postures: the shortest motion first, or the most room. The clearance of a goal is what the leg
  has to spare there beyond δ, with its wheel on the ground.
- the planners of ``auto`` one after the other, or all planners in a race.

Times are processor time of one thread, the least of three; what a scene prepares once is prepared before.
"""

import argparse
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.steps.figures import chosen
from benchmarks.steps.known import Known
from benchmarks.steps.problem import Scene, StepProblem, build
from benchmarks.steps.quality import Outcome, planned
from benchmarks.steps.search import situation_of
from footfall.planning.step.problem import GOAL_ORDERS, StepPlan

LIMIT = 30.0
"""Wall clock of one plan [s]."""
REPEATS = 3
SAME = 1e-3
"""Clearances that differ by less are alike [m]."""


@dataclass(frozen=True)
class Planned:
    """outcome: of auto; seconds: of the motion as fast as joints may turn; goal: clearance where the leg stands [m]."""

    outcome: Outcome
    seconds: float
    goal: float


def quickest(problem: StepProblem, scene: Scene, planner: str, goals: str = "motion") -> Outcome:
    """One planner's answer, with the least time of a few."""
    found = [planned(problem, scene, planner, LIMIT, goals=goals) for _ in range(REPEATS)]
    return replace(found[0], seconds=min(one.seconds for one in found))


def in_order(problem: StepProblem, scene: Scene, goals: str) -> Planned:
    """The step planned by auto with the goals in an order."""
    outcome = quickest(problem, scene, "auto", goals)
    plan = outcome.result.plan
    if plan is None:
        return Planned(outcome, np.nan, np.nan)
    return Planned(outcome, _duration(scene, plan), situation_of(problem, scene).spare(_leg(plan)[-1]))


def orders_table(rows: Sequence[Known], scenes: Sequence[Scene]) -> list[str]:
    """A table of medians over the problems that both orders solve, and what changes in single problems."""
    columns = {
        goals: _columns([in_order(row.problem, scene, goals) for row, scene in zip(rows, scenes, strict=True)])
        for goals in GOAL_ORDERS
    }
    every = np.all([np.isfinite(of["seconds"]) for of in columns.values()], axis=0)
    lines = [
        f"Goals in either order, {len(every)} problems, medians over the {int(every.sum())} that both solve:",
        "",
        "| `goals` | solved | clearance at the goal | clearance of the plan | length | duration | time | 95 % |",
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    for goals, of in columns.items():
        goal, plan, length, seconds, time = (
            float(np.median(of[column][every])) for column in ("goal", "plan", "length", "seconds", "time")
        )
        solved = int(np.isfinite(of["seconds"]).sum())
        lines.append(
            f"| `{goals}` | {solved} | {1e3 * goal:.0f} mm | {1e3 * plan:.1f} mm | {length:.2f} rad | {seconds:.1f} s "
            f"| {1e3 * time:.1f} ms | {1e3 * float(np.percentile(of['time'][every], 95)):.1f} ms |"
        )
    now, other = (columns[goals] for goals in GOAL_ORDERS)
    more, longer = other["plan"][every] - now["plan"][every], other["seconds"][every] / now["seconds"][every]
    costs = 1e3 * (other["time"] - now["time"])[every]
    lines += [
        "",
        f"By clearance the clearance of the plan is larger in {_share(more > SAME)}, smaller in "
        f"{_share(more < -SAME)}, alike in the rest; the motion takes {np.median(longer):.2f} times as long "
        f"(median; 95 %: {np.percentile(longer, 95):.2f}), more than twice as long in {_share(longer > 2)}; planning "
        f"takes {np.median(costs):.1f} ms longer (median; 95 %: {np.percentile(costs, 95):.1f} ms).",
    ]
    return lines


def race_table(rows: Sequence[Known], scenes: Sequence[Scene]) -> list[str]:
    """What auto and a race solve and refuse, how soon, and who wins."""
    lines = [
        f"One after the other or in a race, {len(rows)} problems:",
        "",
        "| planner | solved | by | median time | 95 % | slowest | refused | median time | slowest |",
        "| --- | ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    outcomes = {
        name: [quickest(row.problem, scene, name) for row, scene in zip(rows, scenes, strict=True)]
        for name in ("auto", "race")
    }
    for name, of in outcomes.items():
        plans = [one.result.plan for one in of if one.result.plan is not None]
        by = ", ".join(f"{planner} {count}" for planner, count in Counter(plan.planner for plan in plans).most_common())
        times = 1e3 * np.array([one.seconds for one in of if one.found])
        no = 1e3 * np.array([one.seconds for one in of if not one.found])
        refused = f"{np.median(no):.1f} ms | {no.max():.0f} ms" if len(no) else "– | –"
        lines.append(
            f"| `{name}` | {len(plans)} | {by} | {np.median(times):.1f} ms | {np.percentile(times, 95):.1f} ms "
            f"| {times.max():.0f} ms | {len(no)} | {refused} |"
        )
    differ = [
        f"{row.problem.name}: {_told(auto)}, {_told(race)}"
        for row, auto, race in zip(rows, *outcomes.values(), strict=True)
        if _by(auto) != _by(race)
    ]
    return [*lines, "", "Another planner (auto, race): " + ("; ".join(differ) or "nowhere") + "."]


def _by(outcome: Outcome) -> str:
    return outcome.result.plan.planner if outcome.result.plan else outcome.result.status.value


def _told(outcome: Outcome) -> str:
    return f"{_by(outcome)} after {1e3 * outcome.seconds:.0f} ms"


def _columns(found: list[Planned]) -> dict[str, NDArray[np.float64]]:
    return {
        "goal": np.array([one.goal for one in found]),
        "plan": np.array([one.outcome.clearance for one in found]),
        "length": np.array([one.outcome.length for one in found]),
        "seconds": np.array([one.seconds for one in found]),
        "time": np.array([one.outcome.seconds for one in found]),
    }


def _share(which: NDArray[np.bool_]) -> str:
    return f"{int(which.sum())} of {len(which)}"


def _leg(plan: StepPlan) -> NDArray[np.float64]:
    return plan.waypoints[:, 6 * plan.leg : 6 * plan.leg + 6]


def _duration(scene: Scene, plan: StepPlan) -> float:
    """Seconds of the whole motion with every piece as fast as its slowest joint may be."""
    limits = scene.robot.speed_limits[6 * plan.leg : 6 * plan.leg + 6]
    return float((np.abs(np.diff(_leg(plan), axis=0)) / limits).max(axis=1).sum())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0] if __doc__ else None)
    parser.add_argument("--per-family", type=int, help="only so many problems of each family")
    rows = chosen(parser.parse_args().per_family)
    scenes = [build(row.problem) for row in rows]
    can = [(row, scene) for row, scene in zip(rows, scenes, strict=True) if not row.unsolvable]
    print("\n".join([*orders_table(*zip(*can, strict=True)), "", *race_table(rows, scenes)]))


if __name__ == "__main__":
    main()
