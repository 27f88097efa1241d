"""Whether a standing rover is held: processor time, what is decided without the program by slope, false answers.

The chassis lies along the slope, each foot's ground is tilted about it by some 6°. ``python -m benchmarks.held``.
"""

import time
from collections.abc import Callable, Iterator

import numba
import numpy as np
from numpy.typing import NDArray

from benchmarks.scenes import robot
from benchmarks.timing import SEED, Figure
from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.held import held_tables, placed_postures
from footfall.balance.held_kernel import all_held_within, held_at_once, least_held_ratio
from footfall.balance.torques import torque_check
from footfall.core.arrays import Array
from footfall.core.frames import rotation, rotation_rpy, transform

Asked = tuple[Array, Array, Array, Array, NDArray[np.bool_]]
"""What placed_postures gives."""

MOST = 0.9
TIMED = 200
"""Stances that time is taken of: few enough for the cache, in which a planner has what it just computed."""
SLOPES = (0, 20, 30, 40)
FEET = (6, 5)
SURE, PROGRAM = 4.0, 150.0
"""What is wanted [µs]."""


def figures(quick: bool) -> Iterator[Figure]:
    rng = np.random.default_rng(SEED)
    n, repeats = (300, 3) if quick else (3000, 30)
    false_held = false_not = asked = 0
    for slope in SLOPES:
        for feet in FEET:
            settings = BalanceSettings()
            qs, Ts, standing, normals = _stances(n, np.radians(slope), feet, rng)
            tables = held_tables(robot(), settings)
            args = placed_postures(robot(), qs, Ts, standing, normals)
            name = f"held.{slope}_degrees_{feet}_feet"
            sure = _at_once(*args, tables, MOST)[1]
            yield Figure(f"{name}_decided", (float(sure.mean()),), "share")
            decided, some = _rows(args, np.flatnonzero(sure)[:TIMED]), _rows(args, np.arange(min(n, TIMED)))
            yield _each(f"{name}_at_once", lambda a=decided, t=tables: _at_once(*a, t, MOST), decided, repeats, SURE)
            yield _each(f"{name}_program", lambda a=some, t=tables: _programs(*a, t), some, repeats, PROGRAM)
            yield _each(f"{name}_within", lambda a=some, t=tables: all_held_within(*a, t, MOST), some, repeats)
            answers = all_held_within(*args, tables, MOST)
            yield Figure(f"{name}_share", (float(answers.mean()),), "share")
            for i in range(n):
                legs = np.flatnonzero(standing[i]).tolist()
                ratio = torque_check(robot(), qs[i], Ts[i], legs, normals[i, legs], settings).ratio
                false_held += bool(answers[i]) and not ratio <= MOST + 1e-9
                false_not += not answers[i] and ratio <= 0.98 * MOST
                asked += 1
    yield Figure("held.asked", (float(asked),), "stances")
    yield Figure("held.false_held", (float(false_held),), "stances", 0.0)
    yield Figure("held.false_not_held", (float(false_not),), "stances", 0.0)


def _stances(
    n: int, slope: float, feet: int, rng: np.random.Generator
) -> tuple[Array, Array, NDArray[np.bool_], Array]:
    """Postures, poses of the chassis, standing legs and normals of the ground."""
    R = rotation("y", -slope)
    qs = robot().posture("stand") + 0.15 * rng.normal(size=(n, 36))
    roll, pitch, yaw = 0.05 * rng.normal(size=n), 0.05 * rng.normal(size=n), rng.uniform(-np.pi, np.pi, n)
    Ts = np.array(
        [transform(R @ rotation_rpy(*angles), rng.normal(size=3)) for angles in zip(roll, pitch, yaw, strict=True)]
    )
    normals = np.concatenate([0.1 * rng.normal(size=(n, 6, 2)), np.ones((n, 6, 1))], axis=2) @ R.T
    standing = np.ones((n, 6), bool)
    for row in standing:
        row[rng.permutation(6)[feet:]] = False
    return qs, Ts, standing, normals


def _rows(asked: Asked, rows: NDArray[np.int64]) -> Asked:
    poses, Ts_site_base, contacts, normals, standing = asked
    return poses[rows], Ts_site_base[rows], contacts[rows], normals[rows], standing[rows]


def _each(name: str, call: Callable[[], object], asked: Asked, repeats: int, floor: float | None = None) -> Figure:
    """Processor time for each stance that is asked about, after one call that is not counted."""
    call()
    times = []
    for _ in range(repeats):
        begin = time.process_time()
        call()
        times.append(1e6 * (time.process_time() - begin) / len(asked[0]))
    return Figure(name, tuple(times), "µs", floor)


@numba.njit
def _at_once(poses, Ts_site_base, contacts, normals, standing, tables, most):
    held, sure = np.empty(len(poses), np.bool_), np.empty(len(poses), np.bool_)
    for i in range(len(poses)):
        held[i], sure[i] = held_at_once(poses[i], Ts_site_base[i], contacts[i], normals[i], standing[i], tables, most)
    return held, sure


@numba.njit
def _programs(poses, Ts_site_base, contacts, normals, standing, tables):
    out = np.empty(len(poses))
    for i in range(len(poses)):
        out[i] = least_held_ratio(poses[i], Ts_site_base[i], contacts[i], normals[i], standing[i], tables)
    return out


if __name__ == "__main__":
    for figure in figures(False):
        row = figure.as_dict()
        promised = "" if row["floor"] is None else f"  at most {row['floor']:g}"
        print(f"{figure.name:<36}{row['median']:>10.4g} {row['unit']:<8}p95 {row['p95']:>8.4g}{promised}")
