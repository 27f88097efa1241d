"""Chooses the seeds of the set and looks long for solutions: ``python -m benchmarks.steps.solvability``.

A seed is left out where the rover can't stand so, the leg can't be lifted, or it can't be lowered onto the target: then
there is nothing to search. In the hard families it is left out too where a straight swing will do.
"""

import argparse
import time
from collections import Counter

from benchmarks.steps import known
from benchmarks.steps.families import COUNTS, HARD, MAKERS, OUT_OF_REACH, problem
from benchmarks.steps.known import Known, fingerprint
from benchmarks.steps.problem import build, is_here
from benchmarks.steps.search import pose, solved
from benchmarks.steps.unsolvable import out_of_reach, shut_in
from footfall.core.errors import InvalidInput

LIMIT = 60.0
"""Longest search for one problem [s of processor time]."""
MOST_SEEDS = 600
"""Seeds looked at for one family."""


def family(name: str, limit: float) -> list[Known]:
    """The problems of one family, and what is known of them; prints how many seeds were left out, and why."""
    begin, rows, left_out = time.process_time(), [], Counter[str]()
    for seed in range(MOST_SEEDS):
        if len(rows) == COUNTS[name]:
            break
        one = problem(name, seed)
        try:
            scene = build(one)
        except InvalidInput:
            left_out["the rover can't stand so"] += 1
            continue
        if name == OUT_OF_REACH:
            far = out_of_reach(one, scene)
            if far is None:
                left_out["it is not proven to be too far"] += 1
            else:
                rows.append(Known(one, fingerprint(one, scene), False, 0, "unsolvable", far, 0.0))
            continue
        posed = pose(one, scene)
        if isinstance(posed, str):
            left_out[posed] += 1
            continue
        straight = posed.line_is_free
        if name in HARD and straight:
            left_out["a straight swing will do"] += 1
            continue
        if name == "around a leg" and not posed.a_leg_is_near:
            left_out["no leg is near"] += 1
            continue
        started = time.process_time()
        proof = shut_in(posed)
        by = solved(posed, limit) if proof is None else None
        seconds = time.process_time() - started
        rows.append(
            Known(
                one,
                fingerprint(one, scene),
                straight,
                len(posed.downs),
                "solvable" if by else "unsolvable" if proof else "unknown",
                by or proof or f"nothing in {limit:g} s",
                seconds,
            )
        )
        if not by:
            print(f"  {one.name}: {rows[-1].by}", flush=True)
    counts, free = Counter(row.known for row in rows), sum(row.straight for row in rows)
    reasons = "; ".join(f"{count} {why}" for why, count in left_out.most_common())
    print(
        f"{name}: {len(rows)} problems, {', '.join(f'{count} {what}' for what, count in counts.items())}, "
        f"{free} by a straight swing; {time.process_time() - begin:.0f} s; left out: {reasons or 'none'}",
        flush=True,
    )
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("families", nargs="*", default=list(MAKERS), help="all where none is named")
    parser.add_argument("--limit", type=float, default=LIMIT, help="processor time for one problem [s]")
    chosen = parser.parse_args()
    rows = {name: [row for row in known.known() if row.problem.family == name] for name in MAKERS}
    for name in chosen.families:
        if is_here(problem(name, 0)):
            rows[name] = family(name, chosen.limit)
        else:
            print(f"{name}: kept as it is, its ground is not in ../shared/data")
        known.write([row for name in MAKERS for row in rows[name]])


if __name__ == "__main__":
    main()
