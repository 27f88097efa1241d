"""``plan_walk`` and the peer of 2006 over the same terrains and seeds: ``python -m benchmarks.walks.peer_2006``.

Walks of 2.75 m on smooth ground, not smoothed by either, in processor time: what else runs hardly counts. Every walk of
the peer is rechecked; that is not timed.
"""

import argparse
import time

import numpy as np

import footfall
from benchmarks.scenes import robot
from benchmarks.walks.peer_2006.plan import peer_walk
from benchmarks.walks.peer_2006.ratio import paired_ratio
from benchmarks.walks.terrains import REPORTED, start_of, terrain
from footfall.core.errors import InvalidInput
from footfall.planning.walk.plan import plan_walk
from footfall.planning.walk.problem import WalkGoal, WalkSettings
from footfall.planning.walk.recheck.walk import recheck_walk
from footfall.planning.walk.smoothing import Smoothing

METRES = 2.75
FLOOR = 20.0
"""The median ratio is at least this."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--terrains", type=int, default=5)
    parser.add_argument("--seeds", type=int, default=2, help="of each terrain")
    parser.add_argument("--limit", type=float, default=120.0, help="of each planner [s]; the peer's in processor time")
    asked = parser.parse_args()
    _pair(0, 0, 10.0)  # loads what is compiled
    ours, peers, no_start = [], [], 0
    for number in REPORTED[: asked.terrains]:
        for seed in range(asked.seeds):
            times = _pair(number, seed, asked.limit)
            if times is None:
                no_start += 1
                continue
            ours.append(times[0])
            peers.append(times[1])
    own, peer = np.array(ours), np.array(peers)
    print(
        f"solved: plan_walk {np.isfinite(own).sum()}, peer {np.isfinite(peer).sum()} of {len(own)}; no start {no_start}"
    )
    both = np.isfinite(own)
    if both.any():
        ratio = paired_ratio(peer[both], own[both], asked.limit)
        print(
            f"peer / plan_walk, processor time: median {ratio.median:.1f} (95 %: {ratio.low:.1f}…{ratio.high:.1f}), "
            f"{ratio.at_least} of {both.sum()} at the limit, which counts as {asked.limit:g} s: there at least; "
            f"floor {FLOOR:g}: {'holds' if ratio.median >= FLOOR else 'is not shown'}"
        )
    print("the minutes told in 2006 (14 for 66 steps on smooth ground) are of other hardware, ground and goal")
    return 0


def _pair(number: int, seed: int, limit: float) -> tuple[float, float] | None:
    """Times of plan_walk and of the peer [s], inf where none was found; None without a start."""
    dem, (x, y) = terrain("smooth", number, METRES), start_of(METRES)
    try:
        state = footfall.stand(robot(), dem, x, y)
    except InvalidInput:
        return None
    goal = WalkGoal(x + METRES, y, 0.0)
    settings = WalkSettings(time_limit=limit, seed=seed, smoothing=Smoothing(rounds=0))
    begun = time.process_time()
    plan = plan_walk(robot(), dem, state, goal, settings=settings).plan
    between = time.process_time()
    peer = peer_walk(robot(), dem, state, goal, settings)
    times = between - begun, time.process_time() - between
    checks = recheck_walk(robot(), dem, peer, settings, state=state) if peer else ()
    failed = [f"{one.name} {one.margin:.3g}" for one in checks if not one.holds]
    told = [
        f"{took:.2f} s, {2 * walk.foot_moves} steps" if walk else "none"
        for took, walk in zip(times, (plan, peer), strict=True)
    ]
    judged = failed or ("nothing" if peer else "not asked")
    print(
        f"smooth {number} seed {seed}: plan_walk {told[0]}; peer {told[1]}; recheck fails: {judged}",
        flush=True,
    )
    return times[0] if plan else np.inf, times[1] if peer else np.inf


if __name__ == "__main__":
    raise SystemExit(main())
