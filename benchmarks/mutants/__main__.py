"""``make mutants``: of small mistakes in the modules where a wrong green is worst, how many their tests notice.

Exit code 1 where they notice less than FLOOR of a module's. A mutant that computes the same stands in
``equivalent.toml`` with the reason, and isn't counted; one that doesn't even load isn't either.
"""

import argparse
import os
import tomllib
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import repeat
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.mutants.judge import ROOT, Court, Verdict
from benchmarks.mutants.make import Mutant, mutants, places

FLOOR = 0.85
SEED = 20081
EQUIVALENT = Path(__file__).with_name("equivalent.toml")
SHORTEST_BOUND = 30.0
"""Of the judges, in processor seconds."""


@dataclass(frozen=True)
class Case:
    """A module and its judges. interpreted: judged without compiling."""

    module: str
    judges: tuple[str, ...]
    interpreted: bool = False


CASES = (
    Case("session/gate/machine.py", ("tests/session/test_gate_transitions.py",)),
    Case(
        "balance/support.py",
        (
            "tests/balance/test_support_edges.py",
            "tests/balance/test_support_scale.py",
            "tests/balance/test_support.py",
        ),
    ),
    Case(
        "balance/support_kernel.py",
        (
            "tests/balance/test_support_scale.py",
            "tests/balance/test_support_edges.py",
            "tests/balance/test_support.py::test_a_compiled_loop_is_told_what_has_no_margin",
        ),
        interpreted=True,
    ),
    Case("planning/step/verify.py", ("tests/planning/test_step_verify.py",)),
    Case("sequence/rules.py", ("tests/sequence/test_row_rules.py",)),
    Case("robot/proof/clearance.py", ("tests/robot/test_clearance_tables.py",)),
)

_court: Court | None = None


def main() -> int:
    """Judge the mutants of every module, or of those that are named, and print what became of them."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.mutants", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("modules", nargs="*", help="such as balance/support.py; all without")
    parser.add_argument("--most", type=int, default=150, help="of a module; more are sampled")
    parser.add_argument("--seed", type=int, default=SEED, help="of the sample")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args()
    unknown = set(options.modules) - {case.module for case in CASES}
    if unknown:
        parser.error(f"no judges are known for {', '.join(sorted(unknown))}; there are {[one.module for one in CASES]}")
    known = equivalents()
    good = True
    with (
        TemporaryDirectory(prefix="footfall-mutants-") as folder,
        ProcessPoolExecutor(options.jobs, get_context("fork"), initializer=_begin, initargs=(folder,)) as lanes,
    ):
        for case in CASES:
            if not options.modules or case.module in options.modules:
                good &= _told(case, lanes, known, options.most, options.seed)
    return 0 if good else 1


def equivalents() -> set[tuple[str, str, str]]:
    """Mutants that compute the same: module, what was there, what it becomes."""
    rows = tomllib.loads(EQUIVALENT.read_text("utf-8")).get("mutant", [])
    return {(row["module"], row["was"], row["becomes"]) for row in rows}


def _told(case: Case, lanes: ProcessPoolExecutor, known: set[tuple[str, str, str]], most: int, seed: int) -> bool:
    """Whether the judges of a module notice enough; prints what they let pass."""
    source = (ROOT / "backend" / "footfall" / case.module).read_text("utf-8")
    chosen = mutants(case.module, source, known, most, seed)
    whole, took, said = lanes.submit(_judged, case, source, 300.0).result()
    if whole != "survived":
        print(f"{case.module}: the judges don't pass the module as it is ({whole}):\n{said}")
        return False
    bound = SHORTEST_BOUND + 5 * took
    count = Counter[Verdict]()
    for one, verdict in zip(chosen, lanes.map(_judged_mutant, repeat(case), chosen, repeat(bound)), strict=True):
        count[verdict] += 1
        if verdict == "survived":
            print(f"  survived, {case.module} line {one.line} ({one.operator}):", flush=True)
            print(f"    - {one.was}\n    + {one.becomes}", flush=True)
    killed, judged = count["killed"] + count["endless"], len(chosen) - count["does not load"]
    share = killed / judged
    print(
        f"{case.module}: {killed} of {judged} killed, {share:.1%}; {len(chosen)} looked at of {len(places(source))} "
        f"that can be made, {count['does not load']} don't load, {count['endless']} went on for ever",
        flush=True,
    )
    if share < FLOOR:
        print(f"{case.module}: {share:.1%} is less than {FLOOR:.0%}: write tests for the survivors")
    return share >= FLOOR


def _begin(folder: str) -> None:
    global _court
    _court = Court(folder)


def _judged(case: Case, source: str, bound: float) -> tuple[Verdict, float, str]:
    if _court is None:
        raise RuntimeError("no copy of the tree was made")
    verdict, took = _court.verdict(case.module, source, case.judges, bound, case.interpreted)
    return verdict, took, _court.said()


def _judged_mutant(case: Case, mutant: Mutant, bound: float) -> Verdict:
    return _judged(case, mutant.source, bound)[0]


if __name__ == "__main__":
    raise SystemExit(main())
