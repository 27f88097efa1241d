"""The compiled check of the whole rover against the meshes: time, how much it certifies, and that it is never wrong.

``python -m benchmarks.rover_check 3000`` asks about that many configurations. Ground: the benchmark's rocks, and
fractals from rolling to steep with cells of 2 to 10 cm; every other rover carries a payload. A third of the
configurations is near the stance, a third has its legs anywhere, and a third lies where the answer turns from clear
to unsure, found by bisection: there the proof has least to spare, so there it would be wrong first.
"""

import itertools
import sys
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import footfall
from benchmarks.clearance import processor_seconds
from benchmarks.scenes import robot, rocks, standing
from benchmarks.timing import SEED, Figure, machine
from footfall.core.arrays import Array, Ints, Mask
from footfall.core.errors import InvalidInput
from footfall.core.frames import rotation
from footfall.planning.body.move_checks import LOCKED
from footfall.planning.scene.ground import Nearby
from footfall.planning.scene.rover_kernel import CLEAR, LIFTED, STANDING, TOUCHING, RoverTables, rovers_are_clear
from footfall.planning.scene.rover_tables import rover_tables
from footfall.planning.scene.whole_body import WholeBody
from footfall.robot.description import PARTS, link_name, with_payload
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.generate import fractal

RAISED = 0.1
_AT_ONCE = 90
"""Configurations of one rover on one ground."""


@dataclass(frozen=True)
class Rovers:
    """n configurations: joints (n, legs × 6), chassis poses (n, 4, 4), how the feet are (n, legs)."""

    qs: Array
    Ts_site_base: Array
    feet: Ints

    def __getitem__(self, rows: Mask | NDArray[np.int64] | slice) -> "Rovers":
        return Rovers(self.qs[rows], self.Ts_site_base[rows], self.feet[rows])

    def __len__(self) -> int:
        return len(self.qs)

    def clear(self, tables: RoverTables) -> Mask:
        return rovers_are_clear(self.qs, self.Ts_site_base, self.feet, RAISED, tables) == CLEAR


@dataclass(frozen=True)
class Case:
    """One rover on one ground: how it stands there, the exact check, and the tables of the compiled one."""

    robot: Robot
    state: RobotState
    body: WholeBody
    tables: RoverTables
    rng: np.random.Generator

    def rovers(self, count: int) -> Rovers:
        """Near the stance, with legs anywhere, and at the edge of what is clear, a third each."""
        near, anywhere = self.drawn(count // 3, 0.12, 0.25), self.drawn(count // 3, 0.5, 0.8)
        pool = self.drawn(6 * count, 0.2, 0.4)
        return joined(near, anywhere, self._edge(pool, count - 2 * (count // 3)))

    def drawn(self, count: int, spread: float, rise: float) -> Rovers:
        """Joints about the stance by ``spread`` [rad], the chassis tilted, and up or down by ``rise`` [m] at most."""
        q = self.state.posture + self.rng.normal(0.0, spread, (count, len(self.state.posture)))
        Ts = np.tile(self.state.T_site_base, (count, 1, 1))
        for T in Ts:
            tilt = rotation("x", self.rng.normal(0.0, 0.08)) @ rotation("y", self.rng.normal(0.0, 0.08))
            T[:3, :3] = rotation("z", self.rng.uniform(-0.5, 0.5)) @ T[:3, :3] @ tilt
        Ts[:, :3, 3] += self.rng.uniform(-rise, rise, (count, 3))
        feet = self.rng.choice([STANDING, TOUCHING, LIFTED], (count, self.robot.leg_count), p=[0.8, 0.1, 0.1])
        return Rovers(np.clip(q, self.robot.lower, self.robot.upper), Ts, feet)

    def _edge(self, pool: Rovers, count: int) -> Rovers:
        clear = pool.clear(self.tables)
        if clear.all() or not clear.any():
            return pool[:0]
        yes, no = (pool[self.rng.choice(np.flatnonzero(which), count)] for which in (clear, ~clear))

        def between(share: Array) -> Rovers:
            Ts = yes.Ts_site_base.copy()
            Ts[:, :3, 3] += share[:, None] * (no.Ts_site_base - yes.Ts_site_base)[:, :3, 3]
            return Rovers(yes.qs + share[:, None] * (no.qs - yes.qs), Ts, yes.feet)

        inside, outside = np.zeros(count), np.ones(count)
        for _ in range(30):
            middle = (inside + outside) / 2
            is_clear = between(middle).clear(self.tables)
            inside, outside = np.where(is_clear, middle, inside), np.where(is_clear, outside, middle)
        return between(inside)


def joined(*parts: Rovers) -> Rovers:
    return Rovers(
        np.concatenate([part.qs for part in parts]),
        np.concatenate([part.Ts_site_base for part in parts]),
        np.concatenate([part.feet for part in parts]),
    )


def on_known_ground(dem: Dem) -> Nearby:
    """Ground without holes as the exact check takes it."""
    return Nearby(dem, np.zeros(dem.heights.shape, bool))


def asked_of_ground(robot: Robot, feet: Ints | Mask) -> tuple[list[str], list[str]]:
    """Links that are held against the ground as it is, and against the raised ground."""
    true = ["base"] if robot.description.payload is None else ["base", "payload"]
    raised = []
    for leg in robot.legs:
        links = raised if feet[leg] == LIFTED else true
        links += [link_name(leg, part) for part in PARTS if feet[leg] != STANDING or part not in LOCKED]
    return true, raised


def least_spare(body: WholeBody, q: Array, T_site_base: Array, feet: Ints | Mask, raised: float) -> tuple[float, float]:
    """By the meshes: least spare distance between parts of the rover, and to the ground [m]."""
    Ts_base_link = body.poses(q[None])
    Ts_site_link = T_site_base @ Ts_base_link
    on_true, on_raised = asked_of_ground(body.robot, feet)
    ground = body.ground_gap(Ts_site_link, on_true, touching=np.flatnonzero(feet == TOUCHING).tolist()).gap.spare
    if on_raised:
        ground = min(ground, body.ground_gap(Ts_site_link, on_raised, raised).gap.spare)
    return body.own_gap(Ts_base_link).gap.spare, ground


def cases() -> Iterator[Case]:
    """Rovers on the benchmark's rocks and on fractals in turn; every other one with payload."""
    rng = np.random.default_rng(SEED)
    loaded = Robot(with_payload(robot().description, 200.0))
    for number in itertools.count():
        rover = loaded if number % 2 else robot()
        if number % 4 == 0:
            ground, state = rocks(), standing()
        else:
            resolution, roughness = float(rng.choice([0.02, 0.05, 0.1])), float(rng.uniform(0.05, 0.3))
            ground = fractal(9.0, resolution, roughness, 0.8, SEED + number)
            try:
                state = footfall.stand(rover, ground)
            except InvalidInput:
                continue
        clearance = float(rng.choice([0.0, 0.01]))
        tables = rover_tables(
            rover, ground.heights, ground.geometry, clearance, np.asarray(state.T_site_base)[:2, 3], 5.0
        )
        yield Case(rover, state, WholeBody(rover, on_known_ground(ground), clearance), tables, rng)


def judged(total: int) -> tuple[int, int, int, int]:
    """Configurations asked about; free ones, and how many of those were unsure; clear ones that are not free.

    What lies at the edge is left out of the first two shares: it was looked for.
    """
    asked = free = unsure = wrong = 0
    for case in cases():
        if asked >= total:
            break
        rovers = case.rovers(min(_AT_ONCE, total - asked))
        clear = rovers.clear(case.tables)
        is_free = np.array(
            [
                min(least_spare(case.body, *one, RAISED)) >= 0.0
                for one in zip(rovers.qs, rovers.Ts_site_base, rovers.feet, strict=True)
            ]
        )
        drawn = np.arange(len(rovers)) < 2 * (min(_AT_ONCE, total - asked) // 3)
        asked += len(rovers)
        free += int((is_free & drawn).sum())
        unsure += int((is_free & drawn & ~clear).sum())
        wrong += int((clear & ~is_free).sum())
    return asked, free, unsure, wrong


def figures(total: int) -> Iterator[Figure]:
    first = next(cases())
    for name, rovers in (("walking", first.drawn(20_000, 0.05, 0.1)), ("anywhere", first.drawn(20_000, 0.5, 0.8))):
        clear = rovers.clear(first.tables)
        for which, some in (("", rovers), ("_clear", rovers[clear])):
            times = processor_seconds(lambda some=some: some.clear(first.tables), 10)
            yield Figure(f"rover_check.{name}{which}", tuple(1e6 * t / len(some) for t in times), "µs", 25.0)
    for resolution, within in itertools.product((0.1, 0.05), (6.0, 10.0)):
        # as large as 100 m at 10 cm
        ground = fractal(1000 * resolution, resolution, 0.1, 0.8, SEED)
        times = processor_seconds(
            lambda ground=ground, within=within: rover_tables(
                robot(), ground.heights, ground.geometry, 0.01, (1.3, 0.2), within
            ),
            10,
        )
        name = f"rover_check.tables_of_{within:g}_m_in_cells_of_{100 * resolution:g}_cm"
        yield Figure(name, tuple(1e3 * t for t in times), "ms")
    asked, free, unsure, wrong = judged(total)
    yield Figure("rover_check.asked", (float(asked),), "count")
    yield Figure("rover_check.unsure_of_the_free", (unsure / max(free, 1),), "share")
    yield Figure("rover_check.false_clear", (float(wrong),), "count", 0.0)


if __name__ == "__main__":
    about = machine()
    print(f"{about['processor']}, {about['cores']} cores, Python {about['python']}, seed {about['seed']}")
    for figure in figures(int(sys.argv[1]) if len(sys.argv) > 1 else 3000):
        row = figure.as_dict()
        print(f"{figure.name:<50} median {row['median']:9.3f} {figure.unit:<6} p95 {row['p95']:9.3f}", flush=True)
