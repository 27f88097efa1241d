"""Balance: support polygons, equilibrium with friction and torque, and their agreement with general solvers."""

import itertools
import tracemalloc
from collections.abc import Iterator
from functools import partial

import numpy as np
import shapely
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from benchmarks.scenes import robot
from benchmarks.timing import SEED, Figure, paired, seconds
from footfall.balance.balance_settings import SIDES_ALLOWED, BalanceSettings
from footfall.balance.cones import generators
from footfall.balance.region import equilibrium_region, region_margin
from footfall.balance.region_candidates import region_margins_for_candidates
from footfall.balance.support import conservative_polygon, margins_for_candidates
from footfall.balance.torque_candidates import torque_ratios_for_postures
from footfall.balance.torques import contact_points, holding_torques, torque_check
from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.robot.kinematics import center_of_mass

MAP_CELLS = 50_000
"""About as many as one leg reaches on a grid of 2 cm."""
BOUNDARY = 1e-3
"""Centres of mass nearer than this to a region's boundary are not asked about: a solver has a tolerance of its own."""
LEVEL = np.eye(4)


def figures(quick: bool) -> Iterator[Figure]:
    n = 5 if quick else 20
    yield from _support(n)
    yield from _regions(n)
    yield from _maps(2 if quick else 5)
    yield from _torques(n)
    if not quick:
        yield from _growth()
    yield _lp_disagreements(100 if quick else 5000)
    yield _shapely_difference(200 if quick else 10_000)


def stances(count: int, feet: int | None = None) -> Iterator[tuple[Array, Array]]:
    """Seeded contacts and normals, (k, 3) each, about a hexagon of 2.3 m on rough ground; k from 3 to 6."""
    rng = np.random.default_rng(SEED)
    angle = np.pi / 3 * np.arange(6)
    for _ in range(count):
        k = int(rng.integers(3, 7)) if feet is None else feet
        contacts = np.column_stack([2.3 * np.cos(angle), 2.3 * np.sin(angle), np.full(6, -1.6)])
        contacts += rng.normal(size=(6, 3)) * [0.3, 0.3, 0.2]
        normals = np.column_stack([0.25 * rng.normal(size=(6, 2)), np.ones(6)])
        chosen = np.sort(rng.permutation(6)[:k])
        yield contacts[chosen], normals[chosen]


def _support(n: int) -> Iterator[Figure]:
    rng = np.random.default_rng(SEED)
    (contacts, _), *_ = stances(1, feet=6)
    fixed, many, com = contacts[:5, :2], rng.uniform(-3, 3, (100_000, 2)), np.zeros(2)
    yield Figure(
        "balance.conservative_100k", seconds(lambda: margins_for_candidates(fixed, many, com, True), n), "s", 0.1
    )
    few = many[:200]

    def hulls() -> None:
        for candidate in few:
            feet = np.vstack([fixed, candidate])
            for lost in range(6):
                (ConvexHull(np.delete(feet, lost, axis=0)).equations @ np.array([0.0, 0.0, 1.0])).max()

    yield paired("balance.conservative_over_qhull_200", lambda: margins_for_candidates(fixed, few, com, True), hulls, n)


def _regions(n: int) -> Iterator[Figure]:
    some = list(stances(50, feet=6))
    for sides in SIDES_ALLOWED:
        times = [
            seconds(lambda c=contacts, u=normals, s=sides: equilibrium_region(c, u, 0.6, s), n)
            for contacts, normals in some
        ]
        floor = 1e-4 if sides == 8 else None
        yield Figure(f"balance.friction_region_{sides}", tuple(float(np.median(t)) for t in times), "s", floor)
    contacts, normals = some[0]
    region = equilibrium_region(contacts, normals)

    def projected() -> None:
        for direction in region.normals:
            _farthest(contacts, normals, direction)

    yield paired(
        "balance.friction_region_8_over_highs",
        lambda: equilibrium_region(contacts, normals),
        projected,
        max(3, n // 4),
    )


def _candidates(count: int, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Candidates and their normals, (count, 3) each, about the sixth foot of the stance, and centres of mass."""
    (contacts, _), *_ = stances(1, feet=6)
    candidates = contacts[5] + rng.uniform(-1, 1, (count, 3)) * [1.2, 1.2, 0.3]
    own = np.column_stack([0.25 * rng.normal(size=(count, 2)), np.ones(count)])
    return candidates, own, rng.uniform(-0.4, 0.4, (count, 2))


def _growth() -> Iterator[Figure]:
    """Time and memory from 10⁴ to 10⁶ candidates."""
    (contacts, normals), *_ = stances(1, feet=6)

    def conservative(candidates: Array, own: Array, coms: Array) -> None:
        margins_for_candidates(contacts[:5, :2], candidates[:, :2], coms, True)

    def friction(candidates: Array, own: Array, coms: Array) -> None:
        region_margins_for_candidates(contacts[:5], normals[:5], candidates, own, coms)

    for count in (10_000, 100_000, 1_000_000):
        asked = _candidates(count, np.random.default_rng(SEED))
        for call in (conservative, friction):
            name = f"balance.growth_{call.__name__}_{count:.0e}"
            yield Figure(name, seconds(partial(call, *asked), 3), "s")
            tracemalloc.start()
            call(*asked)
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
            yield Figure(f"{name}_memory", (peak / count,), "B/cell")


def _maps(n: int) -> Iterator[Figure]:
    rng = np.random.default_rng(SEED)
    (contacts, normals), *_ = stances(1, feet=6)
    candidates, own, coms = _candidates(MAP_CELLS, rng)
    for name, conservative in (("plain", False), ("conservative", True)):
        times = seconds(
            lambda c=conservative: region_margins_for_candidates(contacts[:5], normals[:5], candidates, own, coms, c), n
        )
        yield Figure(f"balance.friction_map_50k_{name}", times, "s", 3.0)
    posture = robot().posture("stand")
    qs = posture[12:18] + 0.2 * rng.normal(size=(MAP_CELLS, 6))
    legs, up = [0, 1, 3, 4, 5], np.tile([0.0, 0.0, 1.0], (5, 1))
    settings = BalanceSettings()
    yield Figure(
        "balance.torque_map_50k",
        seconds(lambda: torque_ratios_for_postures(robot(), posture, LEVEL, legs, up, 2, qs, own, settings), n),
        "s",
    )


def _torques(n: int) -> Iterator[Figure]:
    rng = np.random.default_rng(SEED)
    settings, ours, checks, differences = BalanceSettings(), [], [], []
    for _ in range(5 * n):
        posture = robot().posture("stand") + 0.15 * rng.normal(size=36)
        normals = np.column_stack([0.1 * rng.normal(size=(5, 2)), np.ones(5)])
        legs = sorted(rng.permutation(6)[:5].tolist())
        args = (robot(), posture, LEVEL, legs, normals)
        ours += seconds(lambda a=args: torque_check(*a, settings), 1)
        check = torque_check(*args, settings)
        program = _torque_program(posture, legs, normals)
        solved = linprog(**program, method="highs")
        if check.feasible != (solved.status == 0):
            differences.append(np.inf)
        elif check.feasible:
            differences.append(abs(check.ratio - solved.fun))
        checks.append(seconds(lambda p=program: linprog(**p, method="highs"), 1, warm=False)[0])
    yield Figure("balance.torque_check", tuple(ours), "s", 5e-4)
    ratios = tuple(own / peer for own, peer in zip(ours, checks, strict=True))
    yield Figure("balance.torque_check_over_highs", ratios, "ratio")
    yield Figure("balance.torque_check_difference", (float(max(differences)),), "ratio", 1e-6)


def _lp_disagreements(count: int) -> Figure:
    """How often region and HiGHS answer differently whether a centre of mass is held; grid of 3 × 3 for each stance."""
    rng = np.random.default_rng(SEED + 1)
    wrong = 0
    grid = np.stack(np.meshgrid([-1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]), axis=-1).reshape(-1, 2)
    for contacts, normals in stances(count):
        friction = rng.uniform(0.2, 1.0)
        region = equilibrium_region(contacts, normals, friction)
        for com in contacts[:, :2].mean(axis=0) + rng.uniform(0.3, 1.8, 2) * grid:
            found = region_margin(region, com)
            if abs(found.margin) > BOUNDARY:
                wrong += found.held != _is_held(contacts, normals, com, friction)
    return Figure("balance.lp_disagreements", (float(wrong),), "count", 0.0)


def _shapely_difference(count: int) -> Figure:
    """Largest Hausdorff distance of the conservative polygon to the intersection of the hulls of all feet but one."""
    largest = 0.0
    # four feet leave a point, where GEOS may return an area
    for contacts, _ in itertools.chain(stances(count // 2, feet=5), stances(count // 2, feet=6)):
        feet = contacts[:, :2]
        hulls = [shapely.MultiPoint(np.delete(feet, lost, axis=0)).convex_hull for lost in range(len(feet))]
        region = shapely.intersection_all(hulls)
        if region.area > 1e-6:
            ours = shapely.Polygon(conservative_polygon(feet))
            largest = max(largest, shapely.hausdorff_distance(ours.boundary, region.boundary))
    return Figure("balance.shapely_difference", (largest,), "m", 1e-9)


def _equilibrium(contacts: Array, normals: Array, friction: float) -> Array:
    """(6, k · sides) force and moment about the origin of unit weights of the pyramids' edges."""
    edges = generators(normals, friction)
    moments = np.cross(contacts[:, None], edges)
    return np.concatenate([edges, moments], axis=2).reshape(-1, 6).T


def _is_held(contacts: Array, normals: Array, com_xy: Array, friction: float) -> bool:
    rows = _equilibrium(contacts, normals, friction)
    wanted = [0.0, 0.0, 1.0, com_xy[1], -com_xy[0], 0.0]
    return linprog(np.zeros(rows.shape[1]), A_eq=rows, b_eq=wanted, method="highs").status == 0


def _farthest(contacts: Array, normals: Array, direction: Array) -> float:
    rows = _equilibrium(contacts, normals, 0.6)
    cost = direction[0] * rows[4] - direction[1] * rows[3]
    solved = linprog(cost, A_eq=rows[[0, 1, 2, 5]], b_eq=[0.0, 0.0, 1.0, 0.0], method="highs")
    return -float(solved.fun)


def _torque_program(posture: Array, legs: list[int], normals: Array) -> dict[str, object]:
    """The program of :mod:`footfall.balance.torques` over the edges of the pyramids, as linprog takes it."""
    contacts = contact_points(robot(), posture, LEVEL, legs, normals)
    weight = robot().mass * 9.81
    edges = generators(normals, 0.6)
    none = np.zeros((len(legs), 3))
    still = holding_torques(robot(), posture, LEVEL, legs, contacts, none) / robot().torque_limits
    columns = []
    for foot in range(len(legs)):
        for edge in edges[foot]:
            force = none.copy()
            force[foot] = weight * edge
            columns.append(
                holding_torques(robot(), posture, LEVEL, legs, contacts, force) / robot().torque_limits - still
            )
    effect, ones = np.column_stack(columns), np.ones((len(still), 1))
    rows = _equilibrium(contacts - apply(LEVEL, center_of_mass(robot(), posture)), normals, 0.6)
    return {
        "c": np.append(np.zeros(effect.shape[1]), 1.0),
        "A_ub": np.block([[effect, -ones], [-effect, -ones]]),
        "b_ub": np.concatenate([-still, still]),
        "A_eq": np.hstack([rows, np.zeros((6, 1))]),
        "b_eq": [0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
    }
