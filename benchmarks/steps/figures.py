"""Figures of the problem set: solved shares, times per family, and pairs with OMPL's RRTConnect and Klampt's SBL.

Before anything is timed in a scene one step is planned in it, so that what is prepared once is prepared.
"""

import sys
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from importlib.util import find_spec
from multiprocessing import get_context

import numba
import numpy as np
from numpy.typing import NDArray

from benchmarks.steps.families import HARD, MAKERS
from benchmarks.steps.klampt_peer import KlamptLeg
from benchmarks.steps.known import Known, known
from benchmarks.steps.problem import StepProblem, build, is_here
from benchmarks.steps.quality import Outcome, planned, swing
from benchmarks.steps.search import raw_search, situation_of, unsure_ends
from benchmarks.timing import Figure
from footfall.planning.answers import Status

SOLVED_IN = 1.0
"""Processor time within which a solvable problem is to be solved [s]; the wall clock is given ten times that, because
other programs share the machine."""
REFUSED = (Status.GOAL_INVALID, Status.NO_PATH)
"""What a problem without a solution is to be answered with: not that the time was up."""
KLAMPT_LIMIT = 5.0
"""Of one search of Klampt's [s]; one that takes longer counts as that long."""
WORST_FAMILY = 50.0
"""How many times as long Klampt's search takes at least, at the median of each family."""
RAW_WITHIN = {"steep fractal": 0.001}
"""What the median of our searches is to keep to, of families with a floor of their own [s]."""
RAW_SEEDS = (1, 2, 3)
"""Raw searches of one problem; their median counts. One when quick."""
RAW_REPEATS = 5
"""Of each of ours, whose median counts: it is over in less than a millisecond."""


@dataclass(frozen=True)
class Raw:
    """Seconds of one problem's raw searches: ours; Klampt's with its defaults, with our ρ, and as its robots plan.

    unsure: whether ours had to leave an end first that is free, but not surely.
    """

    family: str
    unsure: bool
    ours: float
    defaults: float
    with_our_radius: float
    as_it_comes: float

    @property
    def ratio(self) -> float:
        """Klampt's with its defaults over ours."""
        return self.defaults / self.ours


def chosen(per_family: int | None) -> list[Known]:
    """Of each family so many problems (None: all) whose ground is on this machine; says what is left out."""
    rows = []
    for family in MAKERS:
        own = [row for row in known() if row.problem.family == family]
        here = [row for row in own if is_here(row.problem)]
        if len(here) < len(own):
            print(f"step.set: {family} left out, its ground is not in ../shared/data", file=sys.stderr)
        rows += here[:per_family]
    return rows


def figures(quick: bool) -> Iterator[Figure]:
    families: dict[str, list[Outcome]] = {}
    solved: list[bool] = []
    pairs: list[tuple[Outcome, Outcome]] = []  # of blocked problems: ours, and RRTConnect's
    certified: list[float] = []
    unknown: list[bool] = []
    refusals: list[tuple[bool, float]] = []
    obstructed: dict[str, list[StepProblem]] = {}
    for row in chosen(2 if quick else None):
        problem, scene = row.problem, build(row.problem)
        planned(problem, scene, "auto", 10 * SOLVED_IN)
        ours = planned(problem, scene, "auto", 10 * SOLVED_IN)
        if row.unsolvable:
            refusals.append((ours.result.status in REFUSED, ours.seconds))
            continue
        if row.known == "unknown":
            unknown.append(ours.found)
        families.setdefault(problem.family, []).append(ours)
        if row.solvable:
            solved.append(ours.found and ours.seconds <= SOLVED_IN)
            if not solved[-1]:
                said = ours.result.reason or f"it took {ours.seconds:.2f} s"
                print(f"step.set: {problem.name} is solvable, but: {said}", file=sys.stderr)
        if row.straight or not ours.found:
            continue
        certified.append(ours.seconds)
        peer = planned(problem, scene, "rrtconnect", 10 * SOLVED_IN)
        pairs.append((ours, peer))
        obstructed.setdefault(problem.family, []).append(problem)
    yield Figure("step.set_solved_in_1_s", (float(np.mean(solved)),), "share", 0.995, at_most=False)
    if unknown:
        yield Figure("step.set_unknown_solved", (float(np.mean(unknown)),), "share")
    refused, until = zip(*refusals, strict=True)
    yield Figure("step.set_unsolvable_refused", (float(np.mean(refused)),), "share", 1.0, at_most=False)
    yield Figure("step.set_unsolvable_time", until, "s")
    yield Figure("step.set_certified", tuple(certified), "s", 0.015, p95_at_most=0.05)
    for family, outcomes in families.items():
        times = tuple(one.seconds for one in outcomes if one.found)
        if times:
            yield Figure(f"step.set_certified.{_row(family)}", times, "s")
    both = [(ours, peer) for ours, peer in pairs if peer.found]
    yield Figure("step.set_rrtconnect_solves_too", (len(both) / len(pairs),), "share")
    yield Figure("step.set_time_to_rrtconnect", tuple(a.seconds / b.seconds for a, b in both), "ratio", 1.0)
    yield Figure("step.set_length_to_rrtconnect", tuple(a.length / b.length for a, b in both), "ratio", 1.0)
    yield from _raw_figures([one for family in obstructed.values() for one in family[: 1 if quick else None]], quick)


def _raw_figures(problems: list[StepProblem], quick: bool) -> Iterator[Figure]:
    """Raw searches, ours and Klampt's, of all that both search.

    On standard error what is left out, and why, and in which family Klampt comes nearest.
    """
    if find_spec("klampt") is None:
        print("step.klampt: left out, klampt is not installed (extra `peers`)", file=sys.stderr)
        return
    answers = _raws(problems, quick)
    raws = [raw for raw in answers if isinstance(raw, Raw)]
    reasons = Counter(why for why in answers if isinstance(why, str))
    told = "; ".join(f"{count} left out: {why}" for why, count in reasons.items()) or "none left out"
    print(f"step.klampt: {len(raws)} of {len(problems)} problems compared; {told}", file=sys.stderr)
    yield Figure("step.klampt_compared", (len(raws) / len(problems),), "share")
    if not raws:
        return
    name, hard = "step.klampt_sbl_defaults_to_raw", [raw for raw in raws if raw.family in HARD]
    if hard:
        yield Figure("step.set_raw", tuple(raw.ours for raw in hard), "s", 0.003, p95_at_most=0.01)
        yield Figure(name, tuple(raw.ratio for raw in hard), "ratio", 100.0, at_most=False)
    for ends, unsure in (("sure", False), ("unsure", True)):
        own = [raw for raw in raws if raw.unsure == unsure]
        if own:
            yield Figure(f"step.set_raw.{ends}_ends", tuple(raw.ours for raw in own), "s")
            yield Figure(f"{name}.{ends}_ends", tuple(raw.ratio for raw in own), "ratio")
    yield Figure(f"{name}.all_families", tuple(raw.ratio for raw in raws), "ratio", WORST_FAMILY, at_most=False)
    medians: dict[str, float] = {}
    for family in dict.fromkeys(raw.family for raw in raws):
        own = [raw for raw in raws if raw.family == family]
        medians[family] = float(np.median([raw.ratio for raw in own]))
        yield Figure(f"step.set_raw.{_row(family)}", tuple(raw.ours for raw in own), "s", RAW_WITHIN.get(family))
        yield Figure(f"{name}.{_row(family)}", tuple(r.ratio for r in own), "ratio", WORST_FAMILY, at_most=False)
    worst = min(medians, key=lambda family: medians[family])
    print(f"step.klampt: worst family {worst}, {medians[worst]:.0f} times", file=sys.stderr)
    yield Figure(f"{name}.worst_family", (medians[worst],), "ratio", WORST_FAMILY, at_most=False)
    yield Figure("step.klampt_sbl_as_its_robots_plan_to_raw", tuple(r.as_it_comes / r.ours for r in raws), "ratio")
    yield Figure("step.klampt_sbl_with_our_radius_to_raw", tuple(r.with_our_radius / r.ours for r in raws), "ratio")


def _row(family: str) -> str:
    return family.replace(" ", "_")


def _raws(problems: list[StepProblem], quick: bool) -> list[Raw | str]:
    """Of each problem; in a process of its own, so that Klampt can't touch what else is measured."""
    with ProcessPoolExecutor(1, get_context("spawn")) as process:
        asked = [process.submit(beside_klampt, one, RAW_SEEDS[:1] if quick else RAW_SEEDS) for one in problems]
        return [one.result() for one in asked]


def beside_klampt(problem: StepProblem, seeds: tuple[int, ...]) -> Raw | str:
    """Raw searches of both between the lifted ends of one problem, or why there are none."""
    numba.set_num_threads(1)
    scene = build(problem)
    ours = planned(problem, scene, "auto", 10 * SOLVED_IN)
    if ours.result.plan is None:
        return "no step was planned, so there are no ends"
    path = swing(ours.result.plan)
    start, goal = path[0], path[-1]
    situation = situation_of(problem, scene).for_swing(start, goal)
    raw_search(situation, start, goal, seeds[0])  # prepares what the meshes near unsure ends need
    raw = [raw_search(situation, start, goal, seed) for seed in seeds for _ in range(RAW_REPEATS)]
    if any(seconds is None for seconds in raw):
        return "our search found nothing"
    leg = KlamptLeg(scene.robot, scene.state, problem.leg, situation.ground.mesh)
    leg.free(start)  # builds the hierarchies of its meshes
    radius = situation.settings.radius

    def median(search: Callable[[NDArray[np.float64], NDArray[np.float64], int, float], tuple[float, object]]) -> float:
        found = [search(start, goal, seed, KLAMPT_LIMIT) for seed in seeds]
        return float(np.median([seconds if path else max(seconds, KLAMPT_LIMIT) for seconds, path in found]))

    try:
        return Raw(
            problem.family,
            unsure_ends(situation, start, goal) > 0,
            float(np.median([seconds for seconds in raw if seconds is not None])),
            median(leg.search),
            median(lambda a, b, seed, limit: leg.search(a, b, seed, limit, perturbationRadius=radius)),
            median(leg.as_it_comes),
        )
    except RuntimeError as refused:
        return str(refused)
