"""The compiled clearance check against the exact one: how much it certifies, how fast, and that it is never wrong.

Ground: the benchmark's rocks, and rolling ground with a rock beside each wheel, with holes cut out; stances at random,
with and without payload. A third of the joint vectors is uniform within the limits, a third near the stance
with the leg lifted, and a third lies where the answer turns from certified to unsure, found by bisection: there the
proof has least to spare, so there it would be wrong first. On steep ground half lie where the ground alone decides.
"""

import itertools
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

import footfall
from benchmarks.scenes import robot, rocks, standing
from benchmarks.stances import random_stance
from benchmarks.timing import SEED, Figure
from footfall.core.errors import InvalidInput
from footfall.robot.description import with_payload
from footfall.robot.leg_frames import PART_COUNT
from footfall.robot.meshes.collision import GROUND_MODES, CollisionScene
from footfall.robot.model import Robot
from footfall.robot.proof.clearance import MODES, LegClearance, clearance_ground, leg_reach
from footfall.robot.proof.leg_clearance_kernel import LegTables, leg_stays_clear, place_leg
from footfall.robot.proof.leg_span_kernel import UNSURE, WORK, line_bends, span_of_own_parts, span_to_others
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import fractal
from footfall.terrain.ground.triangulate import triangulate

RAISED = 0.15
Draw = Callable[[int, str], NDArray[np.float64]]
_AT_ONCE = 2000
"""Joint vectors for one leg in one stance and one ground mode."""


@dataclass(frozen=True)
class Case:
    """One leg in one stance: the exact check, the compiled one, and seeded joint vectors to ask both about."""

    robot: Robot
    leg: int
    posture: NDArray[np.float64]
    exact: CollisionScene
    compiled: LegClearance
    rng: np.random.Generator

    def joints(self, count: int, mode: str) -> NDArray[np.float64]:
        """(count, 6): uniform, near the stance, and at the edge of what is certified."""
        lower, upper = (limits[6 * self.leg : 6 * self.leg + 6] for limits in (self.robot.lower, self.robot.upper))
        uniform = self.rng.uniform(lower, upper, (count // 3, 6))
        lifted = self.posture[6 * self.leg : 6 * self.leg + 6] - (0, 0.35, 0, 0, 0, 0)
        near = np.clip(lifted + self.rng.normal(0.0, 0.3, (count // 3, 6)), lower, upper)
        pool = np.concatenate([uniform, near, self.rng.uniform(lower, upper, (count, 6))])
        sure = self.compiled.certified(pool, mode)
        return np.concatenate([uniform, near, self._edge(pool, sure, count - len(uniform) - len(near), mode)])

    def near_ground(self, count: int, mode: str) -> NDArray[np.float64]:
        """(count, 6) about the leg lifted by little, half of them where the ground turns certified to unsure."""
        lower, upper = (limits[6 * self.leg : 6 * self.leg + 6] for limits in (self.robot.lower, self.robot.upper))
        lifted = self.posture[6 * self.leg : 6 * self.leg + 6] - (0, 0.2, 0, 0, 0, 0)
        pool = np.clip(lifted + self.rng.normal(0.0, 0.2, (4 * count, 6)), lower, upper)
        pool = pool[self.compiled.certified(pool, "none")]
        sure = self.compiled.certified(pool, mode)
        return np.concatenate([pool[: count // 2], self._edge(pool, sure, count - count // 2, mode)])

    def _edge(self, pool: NDArray[np.float64], sure: NDArray[np.bool_], count: int, mode: str) -> NDArray[np.float64]:
        """(count, 6) certified ones next to ones that are not; none where all of a pool are alike."""
        if not sure.any() or sure.all():
            return np.empty((0, 6))
        inside, outside = (self.rng.choice(pool[which], count) for which in (sure, ~sure))
        for _ in range(30):
            middle = (inside + outside) / 2
            yes = self.compiled.certified(middle, mode)[:, None]
            inside, outside = np.where(yes, middle, inside), np.where(yes, outside, middle)
        return inside


def cases() -> Iterator[Case]:
    """Stances in turn on the benchmark's rocks and on random ground; every leg's turn, every other one with payload."""
    rng = np.random.default_rng(SEED)
    loaded = Robot(with_payload(robot().description, 200.0))
    for number in itertools.count():
        rover = loaded if number % 2 else robot()
        stance = None if number % 3 == 0 else random_stance(SEED + number)
        state, dem = (standing(), rocks()) if stance is None else (stance.true, stance.world)
        yield _case(rover, number % 6, state, with_holes(dem, rng), rng)


def steep_cases() -> Iterator[Case]:
    """Stances on steep fractals with cells of 2 to 5 cm; every leg's turn."""
    rng = np.random.default_rng(SEED)
    for number in itertools.count():
        resolution, roughness = rng.choice([0.02, 0.03, 0.05]), rng.uniform(0.15, 0.35)
        dem = fractal(6.0, float(resolution), float(roughness), 0.8, SEED + number)
        try:
            state = footfall.stand(robot(), dem)
        except InvalidInput:
            continue
        yield _case(robot(), number % 6, state, dem, rng)


def _case(rover: Robot, leg: int, state: RobotState, ground: Dem, rng: np.random.Generator) -> Case:
    clearance = float(rng.choice([0.0, 0.02]))
    arguments = (rover, state.posture, leg, state.T_site_base)
    hip = (np.asarray(state.T_site_base) @ rover.description.legs[leg].T_base_hip)[:2, 3]
    tables = clearance_ground(rover, ground.heights, ground.geometry, clearance, hip, leg_reach(rover))
    return Case(
        rover,
        leg,
        np.asarray(state.posture),
        CollisionScene(*arguments, triangulate(ground), clearance, RAISED),
        LegClearance(*arguments, tables, clearance, RAISED, drum=True),
        rng,
    )


def with_holes(dem: Dem, rng: np.random.Generator, holes: int = 40) -> Dem:
    """The same ground, unknown in round patches of 0.05 to 0.4 m."""
    heights = np.array(dem.heights)
    west, south, east, north = dem.geometry.bounds
    x, y = np.moveaxis(dem.geometry.centers(), -1, 0)
    for _ in range(holes):
        at = rng.uniform((west, south), (east, north))
        heights[np.hypot(x - at[0], y - at[1]) < rng.uniform(0.05, 0.4)] = np.nan
    return from_heights(heights, dem.geometry.resolution, dem.geometry.x0, dem.geometry.y0)


def false_free(total: int) -> tuple[int, int, int]:
    """Joint vectors asked about, how many of them were certified, and how many of those the exact check refuses."""
    return _tried(total, ((case, case.joints) for case in cases()), GROUND_MODES)


def false_free_on_steep_ground(total: int) -> tuple[int, int, int]:
    """As :func:`false_free`, of the wheel near steep ground."""
    return _tried(total, ((case, case.near_ground) for case in steep_cases()), ("true", "raised"))


def _tried(total: int, drawn: Iterable[tuple[Case, Draw]], modes: Sequence[str]) -> tuple[int, int, int]:
    """As :func:`false_free`, of cases, each with what draws its joint vectors."""
    asked = certified = wrong = 0
    for case, draw in drawn:
        if asked >= total:
            break
        for mode in modes:
            qs = draw(_AT_ONCE, mode)
            sure = qs[case.compiled.certified(qs, mode)]
            asked += len(qs)
            certified += len(sure)
            wrong += sum(case.exact.collides(q, mode) for q in sure)
    return asked, certified, wrong


def false_whole(total: int) -> tuple[int, int, int]:
    """Joint vectors with ranges asked about, how many were called clear throughout, and how many of those were not.

    Of each, a corner of the range and a place in it are asked of the exact check.
    """
    asked = whole = wrong = 0
    for case in cases():
        if asked >= total:
            break
        for mode in GROUND_MODES:
            qs = case.joints(_AT_ONCE // 10, mode)
            turns = case.rng.uniform(0.0, case.rng.choice([0.003, 0.01, 0.05], (len(qs), 1)), qs.shape)
            asked += len(qs)
            for q, turn in zip(qs, turns, strict=True):
                if leg_stays_clear(q, turn, case.compiled.tables, MODES[mode]):
                    whole += 1
                    beside = turn * case.rng.choice([-1.0, 1.0], 6)
                    wrong += case.exact.collides(q + beside, mode) or case.exact.collides(
                        q + beside * case.rng.uniform(0.0, 1.0, 6), mode
                    )
    return asked, whole, wrong


def clear_span(q: NDArray[np.float64], d: NDArray[np.float64], most: float, tables: LegTables, mode: str) -> float:
    """For how much of the line q + s d, to both sides, at most ``most``, the leg is proven to be clear; or UNSURE."""
    poses, work, (bends, rates) = np.empty((PART_COUNT, 3, 4)), np.empty(WORK), line_bends(d, tables)
    place_leg(q, tables.T_site_hip, tables.lengths, poses)
    h = span_to_others(poses, d, bends, most, tables, MODES[mode], work)
    return span_of_own_parts(poses, d, bends, rates, h, tables, work) if h != UNSURE else h


def false_spans(total: int) -> tuple[int, int, int]:
    """Lines asked about, of how many a piece was called clear, and how many of those pieces were not.

    Of each, both ends of the piece and a place in it are asked of the exact check.
    """
    asked = whole = wrong = 0
    for case in cases():
        if asked >= total:
            break
        tables = case.compiled.tables
        for mode in GROUND_MODES:
            qs = case.joints(_AT_ONCE // 10, mode)
            asked += len(qs)
            for q in qs:
                d = case.rng.uniform(-1.0, 1.0, 6)
                most = float(case.rng.choice([0.01, 0.05, 0.2]))
                half = clear_span(q, d, most, tables, mode)
                if half != UNSURE:
                    whole += 1
                    places = half * np.array([-1.0, 1.0, case.rng.uniform(-1.0, 1.0)])
                    wrong += any(case.exact.collides(q + s * d, mode) for s in places)
    return asked, whole, wrong


def certified_share(count: int, stances: int) -> tuple[float, ...]:
    """Of the free joint vectors, uniform and near, how many are certified; one figure for each stance."""
    shares = []
    for case in itertools.islice(cases(), stances):
        qs = case.joints(count, "raised")[: 2 * (count // 3)]
        free = np.array([not case.exact.collides(q, "raised") for q in qs])
        shares.append(float(case.compiled.certified(qs[free], "raised").mean()))
    return tuple(shares)


def processor_seconds(call: Callable[[], object], n: int) -> tuple[float, ...]:
    """Processor time of ``n`` calls on one thread [s], after one not counted; other programs add little to it."""
    call()
    times = []
    for _ in range(n):
        begin = time.process_time()
        call()
        times.append(time.process_time() - begin)
    return tuple(times)


def figures(quick: bool) -> Iterator[Figure]:
    yield Figure("clearance.certified_share", certified_share(900, 4 if quick else 12), "share", 0.8, at_most=False)
    r, ground, state = robot(), rocks(), standing()
    tables = clearance_ground(r, ground.heights, ground.geometry)
    leg = LegClearance(r, state.posture, 2, state.T_site_base, tables, 0.0, RAISED)
    rng = np.random.default_rng(SEED)
    qs = rng.uniform(r.lower[12:18], r.upper[12:18], (100_000, 6))
    sure = qs[leg.certified(qs)]
    threads = numba.get_num_threads()
    numba.set_num_threads(1)
    n = 5 if quick else 20
    for name, rows in (("", qs), ("_certified", sure)):
        times = processor_seconds(lambda rows=rows: leg.certified(rows), n)
        yield Figure(f"clearance.per_configuration{name}", tuple(1e6 * t / len(rows) for t in times), "µs", 4.0)
    yield Figure(
        "clearance.new_stance",
        processor_seconds(lambda: LegClearance(r, state.posture, 2, state.T_site_base, tables, 0.0, RAISED), n),
        "s",
        0.03,
    )
    hip, reach = (state.T_site_base @ r.description.legs[2].T_base_hip)[:2, 3], leg_reach(r)
    for name, within in (("new_world_400x400", np.inf), ("new_world_of_one_leg", reach)):
        around = hip if within < np.inf else None
        times = processor_seconds(
            lambda around=around, within=within: clearance_ground(
                r, ground.heights, ground.geometry, around=around, within=within
            ),
            n,
        )
        yield Figure(f"clearance.{name}", times, "s", 0.5)
    numba.set_num_threads(threads)
    asked, certified, wrong = false_free(20_000 if quick else 1_000_000)
    yield Figure("clearance.asked", (float(asked),), "count")
    yield Figure("clearance.certified", (float(certified),), "count")
    yield Figure("clearance.false_free", (float(wrong),), "count", 0.0)
    asked, certified, wrong = false_free_on_steep_ground(5_000 if quick else 200_000)
    yield Figure("clearance.steep_asked", (float(asked),), "count")
    yield Figure("clearance.steep_certified", (float(certified),), "count")
    yield Figure("clearance.steep_false_free", (float(wrong),), "count", 0.0)
    asked, whole, wrong = false_whole(2_000 if quick else 50_000)
    yield Figure("clearance.ranges_asked", (float(asked),), "count")
    yield Figure("clearance.ranges_certified", (float(whole),), "count")
    yield Figure("clearance.ranges_false_free", (float(wrong),), "count", 0.0)
    asked, whole, wrong = false_spans(2_000 if quick else 50_000)
    yield Figure("clearance.spans_asked", (float(asked),), "count")
    yield Figure("clearance.spans_certified", (float(whole),), "count")
    yield Figure("clearance.spans_false_free", (float(wrong),), "count", 0.0)
