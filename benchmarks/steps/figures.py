"""Figures of the problem set: solved shares, times per family, and pairs with OMPL's RRTConnect and Klampt's SBL.

Before anything is timed in a scene one step is planned in it, so that what is prepared once is prepared.
"""

import sys
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
from benchmarks.steps.search import raw_search, situation_of
from benchmarks.timing import Figure
from footfall.planning.step.situation import RAISED

SOLVED_IN = 1.0
"""Processor time within which a solvable problem is to be solved [s]; the wall clock is given ten times that, because
other programs share the machine."""
KLAMPT_LIMIT = 5.0
"""Of one search of Klampt's [s]; one that takes longer counts as that long."""
RAW_SEEDS = (1, 2, 3)
"""Raw searches of one problem; their median counts. One when quick."""
RAW_REPEATS = 5
"""Of each of ours, whose median counts: it is over in less than a millisecond."""


@dataclass(frozen=True)
class Raw:
    """Seconds of one problem's raw searches: ours; Klampt's with its defaults, with our ρ, and as its robots plan."""

    family: str
    ours: float
    defaults: float
    with_our_radius: float
    as_it_comes: float


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
    pairs: list[tuple[Outcome, Outcome]] = []
    obstructed: dict[str, list[StepProblem]] = {}
    for row in chosen(2 if quick else None):
        problem, scene = row.problem, build(row.problem)
        planned(problem, scene, "auto", 10 * SOLVED_IN)
        ours = planned(problem, scene, "auto", 10 * SOLVED_IN)
        families.setdefault(problem.family, []).append(ours)
        if row.solvable:
            solved.append(ours.found and ours.seconds <= SOLVED_IN)
            if not solved[-1]:
                said = ours.result.reason or f"it took {ours.seconds:.2f} s"
                print(f"step.set: {problem.name} is solvable, but: {said}", file=sys.stderr)
        if row.straight or not ours.found:
            continue
        peer = planned(problem, scene, "rrtconnect", 10 * SOLVED_IN)
        if peer.found:
            pairs.append((ours, peer))
        if problem.family in HARD:
            obstructed.setdefault(problem.family, []).append(problem)
    yield Figure("step.set_solved_in_1_s", (float(np.mean(solved)),), "share", 0.995, at_most=False)
    for family, outcomes in families.items():
        times = tuple(one.seconds for one in outcomes if one.found)
        if times:
            yield Figure(f"step.set_certified.{family.replace(' ', '_')}", times, "s")
    yield Figure("step.set_time_to_rrtconnect", tuple(a.seconds / b.seconds for a, b in pairs), "ratio", 1.0)
    yield Figure("step.set_length_to_rrtconnect", tuple(a.length / b.length for a, b in pairs), "ratio", 1.0)
    raws = _raws([one for family in obstructed.values() for one in family[: 1 if quick else None]], quick)
    if raws:
        yield Figure("step.set_raw", tuple(raw.ours for raw in raws), "s")
        ratios = tuple(raw.defaults / raw.ours for raw in raws)
        yield Figure("step.klampt_sbl_defaults_to_raw", ratios, "ratio", 100.0, at_most=False)
        for family in obstructed:
            own = tuple(ratio for raw, ratio in zip(raws, ratios, strict=True) if raw.family == family)
            if own:
                yield Figure(f"step.klampt_sbl_defaults_to_raw.{family.replace(' ', '_')}", own, "ratio")
        yield Figure("step.klampt_sbl_as_its_robots_plan_to_raw", tuple(r.as_it_comes / r.ours for r in raws), "ratio")
        yield Figure("step.klampt_sbl_with_our_radius_to_raw", tuple(r.with_our_radius / r.ours for r in raws), "ratio")


def _raws(problems: list[StepProblem], quick: bool) -> list[Raw]:
    """Of the problems that both search; in a process of its own, so that Klampt can't touch what else is measured."""
    if find_spec("klampt") is None:
        print("step.klampt: left out, klampt is not installed (extra `peers`)", file=sys.stderr)
        return []
    with ProcessPoolExecutor(1, get_context("spawn")) as process:
        asked = [process.submit(beside_klampt, one, RAW_SEEDS[:1] if quick else RAW_SEEDS) for one in problems]
        return [raw for one in asked if (raw := one.result()) is not None]


def beside_klampt(problem: StepProblem, seeds: tuple[int, ...]) -> Raw | None:
    """Raw searches of both between the lifted ends of one problem.

    None where an end is unsure for the compiled search or blocked for Klampt, or the search found nothing.
    """
    numba.set_num_threads(1)
    scene = build(problem)
    ours = planned(problem, scene, "auto", 10 * SOLVED_IN)
    if ours.result.plan is None:
        return None
    situation = situation_of(problem, scene)
    path = swing(ours.result.plan)
    start, goal = path[0], path[-1]
    if situation.first_unsure(np.array([start, goal]), RAISED) < 2:
        return None
    raw = [raw_search(situation, start, goal, seed) for seed in seeds for _ in range(RAW_REPEATS)]
    if any(seconds is None for seconds in raw):
        print(f"step.klampt: {problem.name} left out: our search found nothing", file=sys.stderr)
        return None
    leg = KlamptLeg(scene.robot, scene.state, problem.leg, situation.ground.mesh)
    leg.free(start)  # builds the hierarchies of its meshes
    radius = situation.settings.radius

    def median(search: Callable[[NDArray[np.float64], NDArray[np.float64], int, float], tuple[float, object]]) -> float:
        found = [search(start, goal, seed, KLAMPT_LIMIT) for seed in seeds]
        return float(np.median([seconds if path else max(seconds, KLAMPT_LIMIT) for seconds, path in found]))

    try:
        return Raw(
            problem.family,
            float(np.median([seconds for seconds in raw if seconds is not None])),
            median(leg.search),
            median(lambda a, b, seed, limit: leg.search(a, b, seed, limit, perturbationRadius=radius)),
            median(leg.as_it_comes),
        )
    except RuntimeError as refused:
        print(f"step.klampt: {problem.name} left out: {refused}", file=sys.stderr)
        return None
