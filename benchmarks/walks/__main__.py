"""Walks of 2.75 m straight ahead over generated ground: ``python -m benchmarks.walks --terrains 10 --recheck``.

Every start that is attempted counts: where the rover can't stand, or no walk is found, the reason is printed. One walk
of each family goes before and is not counted, as it loads what is compiled. ``--recheck`` judges each walk by other
means; that time is not the planner's.
"""

import argparse
import json
import math
import sys
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from benchmarks.timing import machine
from benchmarks.walks.attempts import SMOOTHING, attempt
from benchmarks.walks.summary import Attempt, summary
from benchmarks.walks.terrains import FAMILIES, REPORTED, SIZES, TRAINING, Slopes
from footfall.core.value import fields_of
from footfall.planning.walk.smoothing import WalkFigures


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.walks", description=__doc__)
    parser.add_argument("--terrains", type=int, default=10, help="of each family")
    parser.add_argument("--seeds", type=int, default=1, help="of the planner, on each terrain")
    parser.add_argument("--only", action="append", choices=tuple(FAMILIES), help="this family; may be given again")
    parser.add_argument("--metres", type=float, choices=tuple(SIZES), default=2.75, help="length of the walks")
    parser.add_argument("--limit", type=float, default=60.0, help="wall clock of one walk [s]")
    parser.add_argument("--training", action="store_true", help="terrains to look at while planners are made")
    parser.add_argument("--recheck", action="store_true")
    parser.add_argument("--rounds", type=int, default=SMOOTHING.rounds, help="of smoothing; 0: walks as they are found")
    parser.add_argument("--posture", help="whose height the smoothed chassis comes near")
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    smoothing = replace(SMOOTHING, rounds=asked.rounds, posture=asked.posture)
    about, numbers = machine(), TRAINING if asked.training else REPORTED
    if not asked.json:
        print(f"{about['processor']}, {about['cores']} cores, Python {about['python']}")
    told: dict[str, dict[str, Any]] = {}
    every: list[Attempt] = []
    for family in asked.only or list(FAMILIES):
        metres = max(asked.metres, FAMILIES[family].least)
        attempt(family, TRAINING[-1], 0, metres, asked.limit, smoothing=smoothing)
        own: list[Attempt] = []
        for number in numbers[: asked.terrains]:
            for seed in range(asked.seeds):
                own.append(attempt(family, number, seed, metres, asked.limit, asked.recheck, smoothing))
                print(_line(own[-1]), file=sys.stderr, flush=True)
        told[family] = summary(own, metres)
        every += own
        if not asked.json:
            _print(family, told[family])
    if asked.json:
        report = {"machine": about, "families": told, "attempts": [vars(one) for one in every]}
        print(json.dumps(_plain(report), indent=2, allow_nan=False))
    missed = any(False in wanted.values() for row in told.values() if isinstance(wanted := row.get("wanted"), dict))
    return 1 if missed or any(row["recheck_failed"] for row in told.values()) else 0


def _plain(one: Any) -> Any:
    """What JSON can hold: no number where there is none."""
    if isinstance(one, Slopes):
        return _plain(vars(one))
    if isinstance(one, WalkFigures):
        return _plain(fields_of(one))
    if isinstance(one, Mapping):
        return {name: _plain(part) for name, part in one.items()}
    if isinstance(one, (list, tuple)):
        return [_plain(part) for part in one]
    return None if isinstance(one, float) and not math.isfinite(one) else one


def _line(one: Attempt) -> str:
    told = f"{one.wall:.2f} s, {one.foot_moves} foot moves, margin {one.margin:.3f} m, torque {one.torque:.2f}"
    bad = "".join(f"\n  recheck: {bad}" for bad in one.failed or ())
    reason = "" if one.found else f": {one.reason}"
    return f"{one.family} {one.terrain}, seed {one.seed}: {one.status}, {told}{reason}{bad}"


def _print(family: str, row: Mapping[str, Any]) -> None:
    print(f"\n{family}: {row['attempts']} attempts, terrains {_span(row['terrains'])}, seeds {_span(row['seeds'])}")
    slope = f"median {_number(row['slope_median'])}°, 95 % below {_number(row['slope_p95'])}°"
    print(f"  slope under a wheel, of the terrain in the middle: {slope}")
    print(f"  solved {row['solved']:.1%}; not: {row['unsolved'] or 'none'}, median {_number(row['unsolved_wall'])} s")
    for name, unit, chosen in (
        ("wall", "s", ("median", "p95", "most")),
        ("processor", "s", ("median", "p95", "most")),
        ("foot_moves", "", ("median", "p95", "most")),
        ("way", "m", ("median", "p95", "most")),
        ("margin", "m", ("median", "least")),
        ("torque", "of the limit", ("median", "most")),
    ):
        figures = row[name]
        also = f"; {2 * figures['median']:g} steps" if name == "foot_moves" and figures["median"] is not None else ""
        print(f"  {name:<11}" + ", ".join(f"{one} {_number(figures[one])}" for one in chosen) + f" {unit}{also}")
    for name, (before, after) in row["smoothing"].items():
        print(f"  mean {name.replace('_', ' ')}: {_number(before)} as found, {_number(after)} smoothed")
    print(f"  rechecked {row['rechecked']}, failed {row['recheck_failed']}, median {_number(row['recheck_wall'])} s")
    wanted = row.get("wanted")
    if isinstance(wanted, dict):
        print(
            "  wanted: " + ", ".join(f"{name} {'holds' if held else 'DOES NOT HOLD'}" for name, held in wanted.items())
        )


def _span(numbers: object) -> str:
    return f"{numbers[0]}…{numbers[-1]}" if isinstance(numbers, list) and len(numbers) > 1 else str(numbers)


def _number(one: object) -> str:
    return "–" if one is None else f"{one:.3g}"


if __name__ == "__main__":
    raise SystemExit(main())
