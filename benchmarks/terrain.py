"""Images to terrain: time, memory, accuracy, what is left of the legs, and rocks beside wheels.

Every accuracy figure is measured against the ground that the images were rendered from, on the easy and on the hard
setting of the renderer (footfall.sim.optics).
"""

import multiprocessing
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks import terrain_memory
from benchmarks.ground_truth import cells_seen, pixels_across, true_heights
from benchmarks.scenes import robot, rocks, standing
from benchmarks.stances import RandomStance, random_stance
from benchmarks.timing import SEED, Figure, paired, seconds
from footfall.io.image_files import read_image, read_pair
from footfall.maps.layers import MapSettings
from footfall.maps.traversability import traversability
from footfall.robot.kinematics import wheel_centers
from footfall.sim.optics import PRESETS
from footfall.sim.render import render_snapshot
from footfall.telemetry.images import ImagePair, Snapshot
from footfall.terrain.build import build_terrain
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import pick
from footfall.terrain.ground.triangulate import triangulate
from footfall.terrain.matched import match_pairs
from footfall.terrain.pairs.epipolar import align_pair
from footfall.terrain.pairs.stereo import disparity
from footfall.terrain.rover_mask.posture_fit import fit_posture
from footfall.terrain.terrain_settings import TerrainSettings

PHOTOGRAPHS = Path(__file__).resolve().parents[2] / "shared" / "data"

ALOE = "/usr/share/doc/opencv-doc/examples/data"
"""Where Debian's package opencv-doc puts its pair; the environment variable FOOTFALL_ALOE names another folder."""

NEAR = 3.0
"""Accuracy counts within this of the chassis [m]."""

AT_WHEEL, STANDS_OUT = 0.5, 0.05
"""A remnant: a cell this near to a wheel, seen from above, and this far above the truth [m].

Those of the legs are counted on the ground before it had the rocks.
"""

NINE_PAIRS = {"hh": 3.0, "3way": 2.0}
"""Floors of the time from nine pairs to traversability, by matcher [s]."""

ROCK_TOLERANCE = 0.02
SEEN_SHARE = 0.5
"""A rock counts as seen when this share of its cells lies open to both cameras of some pair."""
RESOLVED = 2.0
"""It counts as resolved when the tolerance spans so many pixels of such a pair."""
BELLY = ("haz0", "haz1", "haz2")
"""Pairs that look across below the chassis, farther than any other at ground beside wheels."""


def figures(quick: bool) -> Iterator[Figure]:
    # quick: the default matcher, once, without the ratio
    yield from _speed(1 if quick else 5, (TerrainSettings().matcher,) if quick else tuple(NINE_PAIRS), not quick)
    for effects in PRESETS:
        yield from _accuracy(effects, 1 if quick else 20)
    yield from _motorcycle(3 if quick else 10)
    yield from _aloe()
    yield from terrain_memory.figures(quick)
    yield Figure("terrain.triangulate_400x400", seconds(lambda: triangulate(rocks()), 5 if quick else 25), "s")
    yield Figure(
        "terrain.pick",
        seconds(lambda: pick(rocks(), np.array([-4.0, -4.0, 4.0]), np.array([1.0, 1.0, -0.9])), 40 if quick else 100),
        "s",
    )


def _speed(n: int, matchers: tuple[str, ...], with_ratio: bool) -> Iterator[Figure]:
    snapshot = render_snapshot(robot(), standing(), rocks(), seed=SEED)
    for matcher in matchers:
        settings = TerrainSettings(matcher=matcher)
        times = seconds(lambda s=settings: _with_traversability(snapshot, s), n)
        yield Figure(f"terrain.nine_pairs_{matcher}", times, "s", NINE_PAIRS[matcher])
        yield Figure(f"terrain.nine_pairs_{matcher}_peak_memory", (_peak_memory(snapshot, settings),), "GB", 1.5)
    if not with_ratio:
        return
    settings = TerrainSettings()
    yield paired(
        "terrain.build_over_matching_alone",
        lambda: build_terrain(robot(), snapshot, settings),
        lambda: [disparity(pair, settings) for pair in snapshot.pairs],
        n,
    )


def _with_traversability(snapshot: Snapshot, settings: TerrainSettings) -> None:
    traversability(build_terrain(robot(), snapshot, settings), MapSettings())


def _peak_memory(snapshot: Snapshot, settings: TerrainSettings) -> float:
    """Largest resident size of a fresh process that only builds [GB]."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(_build_and_weigh, (snapshot, settings))


def _build_and_weigh(snapshot: Snapshot, settings: TerrainSettings) -> float:
    _with_traversability(snapshot, settings)
    # getrusage would carry over what the parent held when it forked; this counts from the new program's start
    status = Path("/proc/self/status").read_text()
    return int(status.partition("VmHWM:")[2].split()[0]) * 1024 / 1e9


def _accuracy(effects: str, count: int) -> Iterator[Figure]:
    """Random stances with encoder noise and sag; the builder is told what the encoders say."""
    errors, above, cover, remnants, beside_rocks, too_low = [], [], [], [], [], []
    kept, across, kept_finer, flat = [], [], [], []
    wheels_told, wheels_fitted = [], []
    for seed in range(SEED, SEED + count):
        stance = random_stance(seed)
        images = render_snapshot(robot(), stance.true, stance.world, seed=seed, effects=PRESETS[effects])
        told = Snapshot(stance.measured, images.pairs)
        dem = build_terrain(robot(), told)
        matched = match_pairs(told.pairs, TerrainSettings())[0]
        fit = fit_posture(robot(), stance.measured.posture, [(one.pair, one.disparity) for one in matched])
        true_wheels = wheel_centers(robot(), stance.true.posture)
        for posture, off in ((stance.measured.posture, wheels_told), (fit.posture, wheels_fitted)):
            off += np.linalg.norm(wheel_centers(robot(), posture) - true_wheels, axis=1).tolist()
        truth = true_heights(stance.world, dem.geometry)
        seen = cells_seen(robot(), stance.true, stance.world, told, dem.geometry)
        error = dem.heights - truth
        near = _within(dem, stance.true.T_site_base[:2, 3], NEAR)
        known = np.isfinite(error)
        errors.append(error[known & near])
        above.append(float((error[known & near] > 0.1).mean()))
        cover.append(float(known[seen & near].mean()))
        assert dem.variance is not None
        below = error < -3.0 * np.sqrt(dem.variance)
        finer = {pair.name: pair for pair in _belly_finer(stance, seed, effects)}
        dem_finer = build_terrain(
            robot(), Snapshot(stance.measured, tuple(finer.get(one.name, one) for one in told.pairs))
        )
        for on, xy in _rocks(stance, dem):
            too_low += below[on & known].tolist()
            share = float(seen[on].mean())
            if share >= SEEN_SHARE:
                top = float(truth[on & seen].max())
                kept.append(abs(_highest(dem, on) - top) <= ROCK_TOLERANCE)
                kept_finer.append(abs(_highest(dem_finer, on) - top) <= ROCK_TOLERANCE)
                across.append(pixels_across(robot(), stance.true, stance.world, told, *xy, ROCK_TOLERANCE))
            elif share == 0:
                flat.append(bool(-np.inf < _highest(dem, on) < float(truth[on].max()) - ROCK_TOLERANCE))
        beside_rocks.append(_standing_out(stance, dem, truth))
        # without the rocks, whose own rims stand out where they are a cell off: what stands out is left of the legs
        images = render_snapshot(robot(), stance.true, stance.ground, seed=seed, effects=PRESETS[effects])
        dem = build_terrain(robot(), Snapshot(stance.measured, images.pairs))
        remnants.append(_standing_out(stance, dem, true_heights(stance.ground, dem.geometry)))
    size = np.abs(np.concatenate(errors))
    name = f"terrain.{effects}"
    yield Figure(f"{name}_height_error_median", (float(np.median(size)),), "m", 0.005)
    yield Figure(f"{name}_height_error_95", (float(np.quantile(size, 0.95)),), "m", 0.020)
    yield Figure(f"{name}_above_0.1_m", (float(np.mean(above)),), "share", 0.0005)
    yield Figure(f"{name}_cover_of_visible", (float(np.mean(cover)),), "share", 0.94, at_most=False)
    yield Figure(f"{name}_remnants_{count}_stances", (float(np.sum(remnants)),), "cells", 3.0)
    yield Figure(f"{name}_standing_out_beside_rocks", (float(np.sum(beside_rocks)),), "cells")
    yield Figure(f"{name}_wheels_off_as_told", tuple(wheels_told), "m")
    yield Figure(f"{name}_wheels_off_as_fitted", tuple(wheels_fitted), "m")
    if kept:
        yield Figure(f"{name}_{len(kept)}_seen_rocks_kept", (float(np.mean(kept)),), "share", 1.0, at_most=False)
        name_finer = f"{name}_{len(kept)}_seen_rocks_kept_belly_1280x960"
        yield Figure(name_finer, (float(np.mean(kept_finer)),), "share", 1.0, at_most=False)
        large = np.array(kept)[np.array(across) >= RESOLVED]
        if len(large):
            kept_share = float(large.mean())
            yield Figure(f"{name}_{len(large)}_resolved_rocks_kept", (kept_share,), "share", 1.0, at_most=False)
    if too_low:
        yield Figure(f"{name}_rock_cells_low_by_3_deviations", (float(np.mean(too_low)),), "share")
    if flat:
        yield Figure(f"{name}_{len(flat)}_unseen_rocks_flat", (float(np.sum(flat)),), "rocks", 0.0)


def _within(dem: Dem, xy: np.ndarray, radius: float) -> np.ndarray:
    x, y = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    return np.hypot(x - xy[0], y - xy[1]) < radius


def _standing_out(stance: RandomStance, dem: Dem, truth: np.ndarray) -> int:
    """Cells beside a wheel that stand above the truth."""
    at_wheels = np.any([_within(dem, wheel[:2], AT_WHEEL) for wheel in stance.wheels], axis=0)
    return int((dem.heights[at_wheels] - truth[at_wheels] > STANDS_OUT).sum())


def _rocks(stance: RandomStance, dem: Dem) -> Iterator[tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]]:
    """Of each rock the cells of the map, bool, and the x and y of their middles, (n,) each."""
    x, y = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    for *xy, diameter, _ in stance.rocks:
        on = _within(dem, np.array(xy), 0.5 * diameter)
        yield on, (x[on], y[on])


def _highest(dem: Dem, on: np.ndarray) -> float:
    return float(np.nanmax(dem.heights[on], initial=-np.inf))


def _belly_finer(stance: RandomStance, seed: int, effects: str) -> tuple[ImagePair, ...]:
    """What the pairs that look across the belly would see with twice the pixels along each side."""
    finer = render_snapshot(
        robot(), stance.true, stance.world, seed=seed, effects=PRESETS[effects], pairs=BELLY, scale=2.0
    )
    return finer.pairs


def _motorcycle(n: int) -> Iterator[Figure]:
    """The photographed pair (Middlebury 2014, quarter size) against its structured-light truth."""
    if not (PHOTOGRAPHS / "motorcycle_left.png").exists():
        print("terrain.motorcycle: left out, the photographs are not in ../shared/data", file=sys.stderr)
        return
    pair = read_pair(
        PHOTOGRAPHS / "motorcycle_left.png",
        PHOTOGRAPHS / "motorcycle_right.png",
        focal_length=994.978,
        cx=311.193,
        cy=254.877,
        baseline=0.193001,
        doffs=31.086,
        T_site_base=np.eye(4),
        name="motorcycle",
    )
    with np.load(PHOTOGRAPHS / "motorcycle_disp.npz") as file:
        truth = file["arr_0"]
    known = np.isfinite(truth)
    for matcher in ("hh", "3way"):
        # disparities up to 64, as the set has them
        matched = TerrainSettings(min_range=2.1, max_range=6.5, matcher=matcher)
        found = disparity(pair, matched)
        both = known & np.isfinite(found)
        wrong = float((np.abs(found - truth)[both] > 2.0).mean())
        yield Figure(f"terrain.motorcycle_{matcher}_bad2", (wrong,), "share", 0.053)
        density = float(both.sum() / known.sum())
        yield Figure(f"terrain.motorcycle_{matcher}_density", (density,), "share", 0.86, at_most=False)
        # promised of the matcher that is used unless another is asked for
        floor = 0.12 if matcher == TerrainSettings().matcher else None
        yield Figure(f"terrain.motorcycle_{matcher}", seconds(lambda s=matched: disparity(pair, s), n), "s", floor)


def _aloe() -> Iterator[Figure]:
    """A photographed plant before a cloth (Middlebury 2006, full size) that nothing was made on."""
    folder = Path(os.environ.get("FOOTFALL_ALOE", ALOE))
    if not (folder / "aloeGT.png").exists():
        print(f"terrain.aloe: left out, aloeL.jpg, aloeR.jpg and aloeGT.png are not in {folder}", file=sys.stderr)
        return
    pair = read_pair(
        folder / "aloeL.jpg",
        folder / "aloeR.jpg",
        focal_length=3740.0,
        cx=641.0,
        cy=555.0,
        baseline=0.16,
        doffs=270.0,
        name="aloe",
    )
    truth = read_image(folder / "aloeGT.png").astype(float)
    found = disparity(align_pair(pair)[0], TerrainSettings(min_range=1.2, max_range=3.0))
    known, both = truth > 0, (truth > 0) & np.isfinite(found)
    yield Figure("terrain.aloe_bad2", (float((np.abs(found - truth)[both] > 2.0).mean()),), "share")
    yield Figure("terrain.aloe_density", (float(both.sum() / known.sum()),), "share")
