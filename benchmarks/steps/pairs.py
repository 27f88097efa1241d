"""Raw searches beside Klampt's, problem by problem: ``python -m benchmarks.steps.pairs "steep fractal" --seeds 5``.

Both in turn in one process, in processor time; the medians are those that ``footfall bench step`` prints of a family.
"""

import argparse

import numpy as np

from benchmarks.steps.families import MAKERS
from benchmarks.steps.figures import Raw, beside_klampt, chosen


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0] if __doc__ else None)
    parser.add_argument("families", nargs="*", metavar="FAMILY", help=f"of {', '.join(MAKERS)}; none: all")
    parser.add_argument("--seeds", type=int, default=3)
    asked = parser.parse_args()
    found: dict[str, list[Raw]] = {}
    for row in chosen(None):
        family = row.problem.family
        if row.straight or not row.solvable or family not in (asked.families or MAKERS):
            continue
        raw = beside_klampt(row.problem, tuple(range(1, asked.seeds + 1)))
        if isinstance(raw, str):
            print(f"{row.problem.name}: left out, {raw}")
            continue
        found.setdefault(family, []).append(raw)
        print(f"{row.problem.name}: {1e3 * raw.ours:.2f} ms, Klampt's {1e3 * raw.defaults:.1f} ms, {raw.ratio:.0f} ×")
    for family, raws in found.items():
        ours, ratio = (float(np.median([getattr(raw, name) for raw in raws])) for name in ("ours", "ratio"))
        print(f"{family}, {len(raws)} problems: median {1e3 * ours:.2f} ms, {ratio:.0f} ×")


if __name__ == "__main__":
    main()
