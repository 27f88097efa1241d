"""Plans over seeded random problems, rechecked with plain meshes: ``python -m benchmarks.steps.recheck --plans 1000``.

The certificate of clearances has no part in it: every posture of a path, no joint changing by more than 0.002 rad from
one to the next, is asked of coal's meshes (meshes/collision.py). Scenes are those of the set's families, of further
seeds; in each, one leg steps onto several random targets. Every scene draws from a generator of its own, so a long run
may be stopped and gone on with: ``--state FILE`` keeps what each scene gave, one line a scene.
"""

import argparse
import itertools
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.kept import KeptRun, digest_of
from benchmarks.steps.families import MAKERS, problem
from benchmarks.steps.problem import Scene, StepProblem, beside_hip, build, is_here
from benchmarks.steps.quality import planned
from benchmarks.steps.search import situation_of
from benchmarks.timing import SEED, Figure
from footfall.core.errors import InvalidInput
from footfall.planning.joint_path import samples
from footfall.planning.step.problem import StepPlan
from footfall.planning.step.situation import RAISED, TRUE
from footfall.robot.meshes.collision import CollisionScene

STEP = 0.002
"""Largest change of a joint between rechecked postures [rad]."""
TARGETS = 25
"""Random targets of one scene: building a scene costs more than a plan."""
FIRST = 10_000
"""The families' first seed for a scene here; those of the set are far below."""
GROUND = ("terrain/dem.py", "terrain/generate.py", "terrain/rocks.py", "terrain/ground")
"""What makes ground, and asks it; how it is seen in images is no part of a plan."""
JUDGED = ("core", "robot", "balance", "planning", *GROUND)
"""What makes the plans, or the meshes that judge them."""
SCENES = tuple(f"steps/{name}.py" for name in ("families", "problem", "quality", "recheck"))
"""Benchmarks that say what is planned, and how it is judged."""


@dataclass(frozen=True)
class Rechecked:
    """postures: how many were asked; bad: what collided first, where; empty if nothing did."""

    problem: StepProblem
    postures: int
    bad: str


@dataclass(frozen=True)
class Tally:
    """Of one scene, or of several: paths, postures asked, seconds of processor time, and what failed."""

    paths: int = 0
    postures: int = 0
    seconds: float = 0.0
    bad: tuple[str, ...] = ()

    def __add__(self, other: "Tally") -> "Tally":
        return Tally(
            self.paths + other.paths,
            self.postures + other.postures,
            self.seconds + other.seconds,
            self.bad + tuple(other.bad),
        )


def scene_plans(number: int, seed: int) -> Iterator[tuple[StepProblem, Scene, StepPlan]]:
    """Accepted plans onto random targets in the ``number``-th scene; none where its ground is not on this machine."""
    rng = np.random.default_rng((seed, number))
    one = problem(tuple(MAKERS)[number % len(MAKERS)], FIRST + number // len(MAKERS))
    if not is_here(one):
        return
    try:
        scene = build(one)
    except InvalidInput:
        return
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


def recheck(number: int, seed: int = SEED, most: int = TARGETS) -> Tally:
    """At most so many plans of the ``number``-th scene, rechecked."""
    meshes, found, begin = None, Tally(), time.process_time()
    for asked, scene, plan in itertools.islice(scene_plans(number, seed), most):
        if meshes is None:
            situation = situation_of(asked, scene)
            state, settings = scene.state, situation.settings
            ground = situation.ground.mesh
            meshes = CollisionScene(
                scene.robot, state.posture, asked.leg, state.T_site_base, ground, 0.0, settings.raise_terrain
            )
        one = rechecked(asked, scene, plan, meshes)
        found += Tally(1, one.postures, 0.0, (f"{asked}: {one.bad}",) if one.bad else ())
    return replace(found, seconds=time.process_time() - begin)


def tallies(plans: int, seed: int, state: Path | None = None) -> Iterator[Tally]:
    """What all scenes up to each gave together, until so many plans are rechecked; ``state`` is gone on with.

    Raises InvalidInput where the state is of another seed or of other code than this.
    """
    run = KeptRun(state, {"seed": seed, "code": digest_of(JUDGED, SCENES)}) if state is not None else None
    done = [Tally(**part) for part in run.parts] if run is not None else []
    total = sum(done, Tally())
    yield total
    for number in itertools.count(len(done)):
        if total.paths >= plans:
            return
        # a state holds whole scenes, so that it can be gone on with
        found = recheck(number, seed, TARGETS if run is not None else plans - total.paths)
        if run is not None:
            run.add(asdict(found))
        total += found
        yield total


def figures(quick: bool) -> Iterator[Figure]:
    """How many accepted paths fail the meshes: 20 of them when quick, 10 000 else."""
    plans = 20 if quick else 10_000
    *_, total = tallies(plans, SEED)
    for bad in total.bad:
        print(f"step.recheck: {bad}", file=sys.stderr)
    yield Figure("step.recheck_failed_paths", (float(len(total.bad)),), f"of {plans}", 0.0)
    yield Figure("step.recheck_postures", (float(total.postures),), "count")
    yield Figure("step.recheck_seconds_a_path", (total.seconds / total.paths,), "s")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plans", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--minutes", type=float, default=np.inf, help="stop after so long")
    parser.add_argument("--state", type=Path, help="file that a run is kept in, and gone on with")
    asked = parser.parse_args()
    begin, total, told = time.monotonic(), Tally(), 0
    for total in tallies(asked.plans, asked.seed, asked.state):
        for bad in total.bad[told:]:
            print(bad)
        told = len(total.bad)
        each = total.seconds / max(total.paths, 1)
        print(f"{told} of {total.paths} paths fail, {total.postures} postures, {each:.2f} s a path", flush=True)
        if time.monotonic() - begin > 60 * asked.minutes:
            break
    return 1 if total.bad else 0


if __name__ == "__main__":
    raise SystemExit(main())
