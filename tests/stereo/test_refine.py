import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from footfall.terrain.pairs.refine import FARTHEST, RADII, off_plane, refined
from footfall.terrain.pairs.refine_kernel import fit_planes

HEIGHT, WIDTH = 60, 90
INSIDE = (slice(8, -8), slice(25, -8))
V, U = np.mgrid[0:HEIGHT, 0:WIDTH].astype(float)


def ground(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Grey of a grained surface at any point: 40 waves, 5 px long and longer, no pattern that repeats."""
    rng = np.random.default_rng(7)
    wave, phase = rng.uniform(-1.2, 1.2, (40, 2)), rng.uniform(0.0, 2 * np.pi, 40)
    return 120.0 + 6.0 * np.sin(wave @ np.stack([x.ravel(), y.ravel()]) + phase[:, None]).sum(axis=0).reshape(x.shape)


def seen(grey: np.ndarray, noise: float = 0.0, seed: int = 0) -> np.ndarray:
    noisy = grey + np.random.default_rng(seed).normal(0.0, noise, grey.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def locked(truth: np.ndarray) -> np.ndarray:
    """Disparities pulled to whole pixels by up to a fifth of one, as parabolas through three costs are."""
    return (truth - 0.2 * np.sin(2 * np.pi * truth)).astype(np.float32)


def slanted(d: float, along: float, down: float, gain: np.ndarray | float = 1.0, noise: float = 0.0):
    """Both images of a surface whose disparity is a plane, and that plane (height, width)."""
    # the point that the right image shows at column u is at x of the left one, where x − disparity(x, y) = u
    x = (U + d + down * V) / (1.0 - along)
    return seen(ground(U, V), noise, 1), seen(gain * ground(x, V), noise, 2), d + along * U + down * V


@settings(max_examples=15)
@given(d=st.floats(4.0, 9.0), along=st.floats(-0.1, 0.1), down=st.floats(-0.15, 0.15))
def test_slanted_surfaces_come_out_to_a_small_fraction_of_a_pixel(d, along, down):
    left, right, truth = slanted(d, along, down)
    partner_too = (U - truth > 8) & (U - truth < WIDTH - 8)
    error = (refined(left, right, locked(truth)).disparity - truth)[INSIDE][partner_too[INSIDE]]
    assert np.median(np.abs(error)) < 0.04  # a fifth of what came in
    assert np.quantile(np.abs(error), 0.99) < 0.15


def test_noise_of_a_sensor_costs_little():
    left, right, truth = slanted(7.3, 0.02, 0.1, noise=1.5)
    error = (refined(left, right, locked(truth)).disparity - truth)[INSIDE]
    assert np.sqrt(np.mean(error**2)) < 0.06
    assert abs(np.mean(error)) < 0.01


@pytest.mark.parametrize("gain", [0.85, 1.15, 1.1 - 0.002 * U], ids=["darker", "brighter", "vignetted"])
def test_brightness_of_the_right_image_does_not_matter(gain):
    left, right, truth = slanted(7.3, 0.02, 0.1, gain)
    error = (refined(left, right, locked(truth)).disparity - truth)[INSIDE]
    assert np.median(np.abs(error)) < 0.015


def test_a_low_rise_is_neither_flattened_nor_widened():
    """A square 1 px nearer than the ground around it, matched 0.3 px too low, as semi-global matching does."""
    low, rise = 6.4, 1.0
    square = (np.abs(V - 30) <= 6) & (np.abs(U - 50) <= 9)
    truth = np.where(square, low + rise, low)
    left, right = ground(U, V), np.full(U.shape, np.nan)
    on_rise = (np.abs(V - 30) <= 6) & (np.abs(U + low + rise - 50) <= 9)
    right = np.where(on_rise, ground(U + low + rise, V), ground(U + low, V))
    start = (truth - 0.3 * square).astype(np.float32)
    error = refined(seen(left, 1.0, 1), seen(right, 1.0, 2), start).disparity - truth
    well_inside = (np.abs(V - 30) <= 4) & (np.abs(U - 50) <= 7)
    assert abs(np.median(error[well_inside])) < 0.05
    beside = ~((np.abs(V - 30) <= 8) & (np.abs(U - 50) <= 12))
    assert np.quantile(np.abs(error[INSIDE][beside[INSIDE]]), 0.95) < 0.1


@pytest.mark.parametrize("fraction", [0.1, 0.3, 0.5, 0.7, 0.9])
def test_no_fraction_of_a_pixel_is_preferred(fraction):
    """Interpolation over four pixels drew fractions towards the half by 0.03 px, however little noise there was."""
    grey = [ground(at, V) for at in (U, U + 7.0 + fraction)]
    start = np.full(U.shape, 7.0 + fraction, np.float32)
    error = (refined(seen(grey[0], 1.0, 1), seen(grey[1], 1.0, 2), start).disparity - start)[INSIDE]
    assert abs(error.mean()) < 0.005


def test_unknown_stays_unknown_and_tells_its_neighbours_nothing(rng):
    left, right, truth = slanted(7.3, 0.02, 0.1)
    start = (truth + rng.uniform(-0.3, 0.3, truth.shape)).astype(np.float32)
    start[rng.random(truth.shape) < 0.2] = np.nan
    found = refined(left, right, start).disparity
    assert np.array_equal(np.isnan(found), np.isnan(start))
    assert np.nanquantile(np.abs(found - truth)[INSIDE], 0.95) < 0.1


def test_the_plane_and_its_deviation_are_those_of_the_surface():
    """Slopes against the surface; deviations against errors in images of noise, where contrast is strong and faint."""
    left, right, truth = slanted(7.3, 0.03, 0.1)
    found = refined(left, right, locked(truth))
    assert abs(np.median(found.along[INSIDE]) - 0.03) < 0.01
    assert abs(np.median(found.down[INSIDE]) - 0.1) < 0.01


@pytest.mark.parametrize("noise", [0.7, 1.4, 2.8])
def test_deviations_are_those_of_the_errors_whatever_the_noise_and_the_contrast(noise):
    """The noise is told by the images themselves."""
    typical = []
    for contrast in (1.0, 0.25):
        grey = [100.0 + contrast * (ground(at, V) - 120.0) for at in (U, U + 7.3)]
        found = refined(seen(grey[0], noise, 1), seen(grey[1], noise, 2), np.full(U.shape, 7.3, np.float32))
        off = np.abs(found.disparity - 7.3)[INSIDE] / found.deviation[INSIDE]
        typical.append(np.median(found.deviation[INSIDE]))
        # about two of three are smaller than one standard deviation, and next to all than four
        assert 0.6 < np.mean(off < 1.0) < 0.88
        assert np.mean(off < 4.0) > 0.99
    assert typical[1] > 1.5 * typical[0]


def test_even_images_say_nothing():
    blank = np.full((HEIGHT, WIDTH), 90, np.uint8)
    start = np.full((HEIGHT, WIDTH), 5.25, np.float32)
    found = refined(blank, blank, start)
    assert np.array_equal(found.disparity, start)
    assert np.allclose(found.deviation, FARTHEST)


def test_nothing_moves_further_than_allowed(rng):
    left, right = (rng.integers(0, 256, (HEIGHT, WIDTH)).astype(np.uint8) for _ in range(2))
    start = rng.uniform(3.0, 9.0, (HEIGHT, WIDTH)).astype(np.float32)
    assert np.abs(refined(left, right, start).disparity - start).max() <= FARTHEST + 1e-5


def test_number_of_threads_does_not_matter():
    left, right, truth = slanted(7.3, 0.02, 0.1, noise=1.5)
    start = locked(truth)
    before = numba.get_num_threads()
    try:
        results = []
        for threads in range(1, before + 1):
            numba.set_num_threads(threads)
            results.append(np.stack(refined(left, right, start)))
    finally:
        numba.set_num_threads(before)
    assert all(np.array_equal(results[0], other) for other in results[1:])


def test_faint_images_take_wide_windows_and_clear_ones_keep_a_rise():
    """What came in is off by half a pixel, each by itself. Where noise is as strong as the grain it comes out near the
    plane and near its neighbours (with the narrow reach alone: 0.16 and 0.36 px); where it is not, a rise keeps its
    edge."""
    off = np.random.default_rng(5).normal(0.0, 0.5, U.shape)
    grey = [100.0 + 0.12 * (ground(at, V) - 120.0) for at in (U, U + 7.3)]
    found = refined(seen(grey[0], 1.5, 1), seen(grey[1], 1.5, 2), (7.3 + off).astype(np.float32)).disparity[INSIDE]
    assert np.sqrt(np.mean((found - 7.3) ** 2)) < 0.145
    assert np.quantile(np.abs(np.diff(found, axis=1)), 0.95) < 0.3
    truth = np.where(U > 55, 8.0, 7.0).astype(np.float32)
    right = np.where(U + 8.0 > 55, ground(U + 8.0, V), ground(U + 7.0, V))
    clear = refined(seen(ground(U, V), 0.7, 1), seen(right, 0.7, 2), truth).disparity
    assert np.abs(clear - truth)[8:-8][:, np.r_[40:52, 58:70]].max() < 0.05


def test_one_step_agrees_with_least_squares_pixel_by_pixel(rng):
    radius, pull, shape = 2, 3.0, (6, 7)
    reach = rng.uniform(0.3, 1.5, shape)
    wide = tuple(n + 2 * radius for n in shape)
    nearby = rng.uniform(4.0, 6.0, wide)
    error, slope = rng.normal(0.0, 4.0, wide), rng.normal(0.0, 8.0, wide)
    weight = np.where(rng.random(wide) < 0.2, 0.0, rng.uniform(0.05, 0.3, wide))
    planes = np.stack([rng.uniform(4.5, 5.5, shape), rng.uniform(-0.1, 0.1, shape), rng.uniform(-0.1, 0.1, shape)])
    images = [a.astype(np.float32) for a in (nearby, error, slope, weight, planes)]
    per_reach = (1.0 / reach).astype(np.float32)
    found, variance = fit_planes(images[0], images[1], images[2], images[3], images[4], radius, per_reach, pull)
    dy, dx = (a.ravel().astype(float) for a in np.mgrid[-radius : radius + 1, -radius : radius + 1])
    for v in range(shape[0]):
        for u in range(shape[1]):
            window = (slice(v, v + 2 * radius + 1), slice(u, u + 2 * radius + 1))
            d, e, g, w = (a[window].ravel() for a in (nearby, error, slope, weight))
            plane = planes[:, v, u] @ np.stack([np.ones_like(dx), dx, dy])
            r, off = e + g * (d - plane), d - plane
            root = np.sqrt(w / (1.0 + r**2 * w)) / (1.0 + (off / reach[v, u]) ** 2)
            A = (root * g)[:, None] * np.stack([np.ones_like(dx), dx, dy], axis=1)
            # the ridge on the two slopes, as two more rows
            ridge = np.sqrt(0.02 * (A[:, 1:] ** 2).sum() + 1e-6)
            A = np.vstack([A, [np.sqrt(pull), 0.0, 0.0], [0.0, ridge, 0.0], [0.0, 0.0, ridge]])
            step = np.linalg.lstsq(A, np.r_[root * r, 0.0, 0.0, 0.0], rcond=None)[0]
            assert np.allclose(found[:, v, u], planes[:, v, u] + step, atol=2e-4)
            assert np.isclose(variance[v, u], np.linalg.inv(A.T @ A)[0, 0], rtol=2e-3)


@settings(max_examples=25)
@given(d=st.floats(4.0, 40.0), along=st.floats(-0.4, 0.4), down=st.floats(-0.4, 0.4), holes=st.integers(0, 2**32 - 1))
def test_nothing_is_off_a_plane_whatever_of_it_is_unknown(d, along, down, holes):
    surface = (d + along * U + down * V).astype(np.float32)
    surface[np.random.default_rng(holes).random(surface.shape) < 0.4] = np.nan
    off = off_plane(surface, *(np.full(U.shape, slope, np.float32) for slope in (along, down)))
    assert off.max() < 1e-3


def test_how_far_the_surface_is_off_its_planes_pixel_by_pixel():
    """Against the mean over the window, neighbour by neighbour; borders and unknown pixels included."""
    rng = np.random.default_rng(5)
    surface = rng.normal(20.0, 0.5, (23, 31)).astype(np.float32)
    surface[rng.random(surface.shape) < 0.3] = np.nan
    along, down = rng.normal(0.0, 0.1, (2, *surface.shape)).astype(np.float32)
    off, reach = off_plane(surface, along, down), RADII[-1]
    # windows that lie inside; at an image's border cv2 mirrors what it has
    for v in range(reach, surface.shape[0] - reach):
        for u in range(reach, surface.shape[1] - reach):
            window = np.s_[v - reach : v + reach + 1, u - reach : u + reach + 1]
            y, x = np.mgrid[window]
            plane = surface[v, u] + along[v, u] * (x - u) + down[v, u] * (y - v)
            wanted = 0.0 if np.isnan(surface[v, u]) else abs(np.nanmean(surface[window] - plane))
            assert off[v, u] == pytest.approx(wanted, abs=1e-3)
