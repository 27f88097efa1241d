"""Goals ordered otherwise, planners in turn or at once: ``python -m benchmarks.steps.choices --per-family 7``.

What planning a step decides without asking, measured against what it could do instead, on the problem set:

- the order of the goal postures: as planning ranks them (planning/step/target.py), by their clearance, or by it among
  those on the start's branch only. The clearance of a goal is what the leg has to spare there beyond δ, with its wheel
  on the ground.
- the planners of ``auto``: one after the other, as they are, or all at once. The best that a race could do is the time
  of the quickest that leads to a plan, as if every planner had a core of its own.

Times are processor time of one thread, the least of three; what a scene prepares once is prepared before.
"""

import argparse
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from unittest import mock

import numpy as np
from numpy.typing import NDArray

from benchmarks.steps.figures import chosen
from benchmarks.steps.known import Known
from benchmarks.steps.problem import Scene, StepProblem, build
from benchmarks.steps.quality import Outcome, planned
from benchmarks.steps.search import situation_of
from footfall.planning.step import goals
from footfall.planning.step.planners import AUTO
from footfall.planning.step.problem import StepPlan
from footfall.planning.step.situation import Situation
from footfall.planning.step.target import Candidate, candidates

LIMIT = 10.0
"""Wall clock of one plan [s]."""
REPEATS = 3
SAME = 1e-3
"""Clearances that differ by less are alike [m]."""

Order = Callable[[Situation, list[Candidate], int], list[Candidate]]


def by_clearance(situation: Situation, found: list[Candidate], branch: int) -> list[Candidate]:
    return sorted(found, key=lambda one: -goal_clearance(situation, one.q))


def by_clearance_on_branch(situation: Situation, found: list[Candidate], branch: int) -> list[Candidate]:
    return sorted(found, key=lambda one: (one.branch // 2 != branch // 2, -goal_clearance(situation, one.q)))


ORDERS: dict[str, Order | None] = {
    "as it is: branch, then motion": None,
    "clearance": by_clearance,
    "branch, then clearance": by_clearance_on_branch,
}


@dataclass(frozen=True)
class Planned:
    """outcome: of auto; seconds: of the motion as fast as joints may turn; goal: clearance where the leg stands [m]."""

    outcome: Outcome
    seconds: float
    goal: float


def goal_clearance(situation: Situation, q: NDArray[np.float64]) -> float:
    """What a leg posture (6,) has to spare beyond δ with its wheel on the ground [m]; negative: it collides."""
    own, ground = situation.footing.solids, situation.footing.over_ground
    return min(own.own_gap(q[None])[1].spare, ground.gap(q[None], 0.0, touching=True)[1].spare)


def planned_in_order(problem: StepProblem, scene: Scene, order: Order | None) -> Planned:
    """The step planned by auto with the goals in an order; None: that of planning."""
    situation = situation_of(problem, scene)

    def ordered(*asked: object) -> list[Candidate]:
        found = candidates(*asked)  # type: ignore[arg-type]
        return found if order is None else order(situation, found, asked[-1])  # type: ignore[arg-type]

    with mock.patch.object(goals, "candidates", ordered):
        outcome = quickest(problem, scene, "auto")
    plan = outcome.result.plan
    if plan is None:
        return Planned(outcome, np.nan, np.nan)
    return Planned(outcome, _duration(scene, plan), goal_clearance(situation, _leg(plan)[-1]))


def quickest(problem: StepProblem, scene: Scene, planner: str) -> Outcome:
    """One planner's answer, with the least time of a few."""
    found = [planned(problem, scene, planner, LIMIT) for _ in range(REPEATS)]
    return replace(found[0], seconds=min(one.seconds for one in found))


def orders(rows: Sequence[Known], scenes: Sequence[Scene]) -> dict[str, list[Planned]]:
    return {
        name: [planned_in_order(row.problem, scene, order) for row, scene in zip(rows, scenes, strict=True)]
        for name, order in ORDERS.items()
    }


def told_orders(found: dict[str, list[Planned]]) -> list[str]:
    """A table of medians over the problems that all orders solve, and one of what changes in single problems."""
    columns = {name: _columns(of) for name, of in found.items()}
    every = np.all([np.isfinite(of["seconds"]) for of in columns.values()], axis=0)
    lines = [
        f"Goals in three orders, {len(every)} problems, medians over the {int(every.sum())} that all solve:",
        "",
        "| order of the goals | solved | clearance at the goal | clearance of the plan | length | duration | time |",
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    for name, of in columns.items():
        goal, plan, length, seconds, time = (
            float(np.median(of[column][every])) for column in ("goal", "plan", "length", "seconds", "time")
        )
        solved = int(np.isfinite(of["seconds"]).sum())
        lines.append(
            f"| {name} | {solved} | {1e3 * goal:.0f} mm | {1e3 * plan:.1f} mm | {length:.2f} rad | {seconds:.1f} s "
            f"| {1e3 * time:.1f} ms |"
        )
    now = columns[next(iter(columns))]
    lines.append("")
    for name, of in list(columns.items())[1:]:
        more = of["plan"][every] - now["plan"][every]
        longer = of["seconds"][every] / now["seconds"][every]
        lines.append(
            f"By {name}, against the order as it is: clearance of the plan larger in {_share(more > SAME)}, smaller in "
            f"{_share(more < -SAME)}, alike in the rest; the motion takes {np.median(longer):.2f} times as long "
            f"(median; 95 %: {np.percentile(longer, 95):.2f}), more than twice as long in {_share(longer > 2)}."
        )
    return lines


def told_race(rows: Sequence[Known], scenes: Sequence[Scene]) -> list[str]:
    """Which planner of auto leads to the plan, and how much sooner the quickest of all would."""
    auto, best, by, first = [], [], Counter[str](), Counter[str]()
    for row, scene in zip(rows, scenes, strict=True):
        whole = quickest(row.problem, scene, "auto")
        alone = {name: quickest(row.problem, scene, name) for name in AUTO}
        times = {name: one.seconds for name, one in alone.items() if one.found}
        if whole.result.plan is None or not times:
            continue
        by[whole.result.plan.planner] += 1
        first[min(times, key=lambda name: times[name])] += 1
        auto.append(whole.seconds)
        best.append(min(times.values()))
    took, least = 1e3 * np.array(auto), 1e3 * np.array(best)
    gain = took - least
    return [
        f"The planners of auto, {len(auto)} problems solved: "
        + ", ".join(f"{name} {by[name]}" for name in AUTO)
        + " lead to the plan; the quickest alone would be "
        + ", ".join(f"{name} {first[name]}" for name in AUTO)
        + ".",
        f"One after the other: median {np.median(took):.1f} ms, 95 % {np.percentile(took, 95):.1f} ms, at most "
        f"{took.max():.0f} ms. The quickest alone: median {np.median(least):.1f} ms, 95 % "
        f"{np.percentile(least, 95):.1f} ms, at most {least.max():.0f} ms. A race could gain {np.median(gain):.1f} ms "
        f"(median; 95 % {np.percentile(gain, 95):.1f} ms, at most {gain.max():.0f} ms).",
    ]


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
    rows = [row for row in chosen(parser.parse_args().per_family) if not row.unsolvable]
    scenes = [build(row.problem) for row in rows]
    print("\n".join([*told_orders(orders(rows, scenes)), "", *told_race(rows, scenes)]))


if __name__ == "__main__":
    main()
