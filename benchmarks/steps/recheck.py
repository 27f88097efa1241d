"""Plans over seeded random problems, rechecked with plain meshes: ``python -m benchmarks.steps.recheck --plans 1000``.

The certificate of clearances has no part in it: every posture of a path, no joint changing by more than 0.002 rad from
one to the next, is asked of coal's meshes (robot/collision.py). Scenes are those of the set and of further seeds of its
families; in each, several legs step onto several random targets.
"""

import argparse
import itertools
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.steps.families import MAKERS, problem
from benchmarks.steps.problem import Scene, StepProblem, beside_hip, build, is_here
from benchmarks.steps.quality import planned
from benchmarks.steps.search import situation_of
from benchmarks.timing import SEED, Figure
from footfall.core.errors import InvalidInput
from footfall.planning.step.edges import samples
from footfall.planning.step.problem import StepPlan
from footfall.planning.step.situation import RAISED, TRUE
from footfall.robot.collision import CollisionScene

STEP = 0.002
"""Largest change of a joint between rechecked postures [rad]."""
TARGETS = 25
"""Random targets of one scene and leg: building a scene costs more than a plan."""


@dataclass(frozen=True)
class Rechecked:
    """postures: how many were asked; bad: what collided first, where; empty if nothing did."""

    problem: StepProblem
    postures: int
    bad: str


def random_plans(seed: int) -> Iterator[tuple[StepProblem, Scene, StepPlan]]:
    """Plans without end: the families in turn, one scene after the other, random targets in each."""
    rng = np.random.default_rng(seed)
    for number in itertools.count(10_000):
        for family in MAKERS:
            one = problem(family, number)
            if not is_here(one):
                continue
            try:
                scene = build(one)
            except InvalidInput:
                continue
            for _ in range(TARGETS):
                target = beside_hip(one.place, one.leg, rng.uniform(0.3, 1.3), rng.uniform(-1.3, 1.3))
                asked = replace(one, target=target)
                plan = planned(asked, scene, "auto", 5.0, seed=int(rng.integers(1000))).result.plan
                if plan is not None:
                    yield asked, scene, plan


def rechecked(asked: StepProblem, scene: Scene, plan: StepPlan, meshes: CollisionScene) -> Rechecked:
    own = slice(6 * asked.leg, 6 * asked.leg + 6)
    count = 0
    for i in range(1, len(plan.phases)):
        mode = RAISED if plan.phases[i] == "swing" else TRUE
        for at, q in samples(plan.waypoints[i - 1, own], plan.waypoints[i, own], STEP):
            count += 1
            if meshes.collides(q, mode):
                hit = meshes.contacts(q, mode)[0]
                where = f"{hit.link_a} – {hit.link_b} {hit.distance:.4f} of {hit.required:.3f} m"
                return Rechecked(asked, count, f"{where}, {plan.phases[i]}, {at:.0%} of the way to waypoint {i}")
    return Rechecked(asked, count, "")


def recheck(plans: int, seed: int = SEED) -> Iterator[Rechecked]:
    last, meshes = None, None
    for asked, scene, plan in itertools.islice(random_plans(seed), plans):
        if meshes is None or scene is not last:
            situation = situation_of(asked, scene)
            state, settings = scene.state, situation.settings
            ground = situation.ground.mesh
            meshes = CollisionScene(
                scene.robot, state.posture, asked.leg, state.T_site_base, ground, 0.0, settings.raise_terrain
            )
            last = scene
        yield rechecked(asked, scene, plan, meshes)


def figures(quick: bool) -> Iterator[Figure]:
    """How many accepted paths fail the meshes: 20 of them when quick, 10 000 else."""
    bad, postures, begin = 0, 0, time.process_time()
    plans = 20 if quick else 10_000
    for one in recheck(plans):
        postures += one.postures
        if one.bad:
            bad += 1
            print(f"step.recheck: {one.problem.name} {one.problem.target}: {one.bad}", file=sys.stderr)
    yield Figure("step.recheck_failed_paths", (float(bad),), f"of {plans}", 0.0)
    yield Figure("step.recheck_postures", (float(postures),), "count")
    yield Figure("step.recheck_seconds_a_path", ((time.process_time() - begin) / plans,), "s")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plans", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--minutes", type=float, default=np.inf, help="stop after so long")
    asked = parser.parse_args()
    begin, used, done, postures, bad = time.monotonic(), time.process_time(), 0, 0, 0
    for one in recheck(asked.plans, asked.seed):
        done, postures = done + 1, postures + one.postures
        if one.bad:
            bad += 1
            print(f"{one.problem}: {one.bad}", flush=True)
        late = time.monotonic() - begin > 60 * asked.minutes
        if done % 100 == 0 or late or done == asked.plans:
            each = (time.process_time() - used) / done
            print(f"{bad} of {done} paths fail, {postures} postures, {each:.2f} s a path", flush=True)
        if late:
            break
    return 1 if bad else 0


if __name__ == "__main__":
    raise SystemExit(main())
