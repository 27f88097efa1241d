"""Albedo of the simulated ground: band-limited noise fixed to the site, so that every camera sees the same grain.

Spectral synthesis (Peitgen & Saupe, *The Science of Fractal Images*, 1988): white noise shaped in the frequency
domain to a falling amplitude, which is periodic by construction. Coarser copies keep only the waves that a pixel can
resolve (mip-maps: Williams, *Pyramidal parametrics*, 1983); without them distant ground would twinkle between the
two images of a pair, which no real camera shows.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

TEXEL = 0.005
"""Sample distance of the finest copy [m]; its shortest wave is twice that."""

SIZE = 2048
"""Samples along each side of the finest copy; the pattern repeats after SIZE · TEXEL = 10.24 m."""

LEVELS = 8
LONGEST_WAVE = 2.0
SLOPE = 0.9
"""Amplitude falls with spatial frequency to this power."""

# Two projections of space onto the pattern; a face that one of them smears, the other resolves.
_SHEARS = ((0.73, 0.41, 0.0, 0.0), (-0.41, 0.73, 3.17, 5.71))


@lru_cache(maxsize=2)
def _copies(seed: int) -> tuple[NDArray[np.float32], ...]:
    """The pattern at TEXEL · 2^k for each level k; zero mean, unit deviation at the finest."""
    white = np.random.default_rng(seed).standard_normal((SIZE, SIZE), dtype=np.float32)
    fy = np.fft.fftfreq(SIZE, TEXEL)[:, None]
    fx = np.fft.rfftfreq(SIZE, TEXEL)[None, :]
    frequency = np.hypot(fx, fy)
    shaped = np.fft.rfft2(white) / np.maximum(frequency, 1.0 / LONGEST_WAVE) ** SLOPE
    shaped[frequency < 0.5 / LONGEST_WAVE] = 0.0
    finest = np.fft.irfft2(shaped, s=(SIZE, SIZE))
    scale = 1.0 / finest.std()
    copies = []
    for level in range(LEVELS):
        n = SIZE >> level
        rows = np.r_[0 : n // 2, SIZE - n // 2 : SIZE]
        kept = shaped[rows, : n // 2 + 1].copy()
        # a hard cut would ring: fade the top octave out
        kept *= np.clip(2.0 - 2.0 * frequency[rows, : n // 2 + 1] * (TEXEL * 2 ** (level + 1)), 0.0, 1.0)
        copies.append((np.fft.irfft2(kept, s=(n, n)) * (scale * (n / SIZE) ** 2)).astype(np.float32))
    return tuple(copies)


def _bilinear(copy: NDArray[np.float32], u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
    last = copy.shape[0] - 1  # a power of two less one, so that & wraps around
    u0, v0 = np.floor(u), np.floor(v)
    a, b = u - u0, v - v0
    i0, j0 = v0.astype(np.int64) & last, u0.astype(np.int64) & last
    i1, j1 = (i0 + 1) & last, (j0 + 1) & last
    south = copy[i0, j0] * (1 - a) + copy[i0, j1] * a
    north = copy[i1, j0] * (1 - a) + copy[i1, j1] * a
    return south * (1 - b) + north * b


def grain(points: NDArray[np.float64], footprint: NDArray[np.float64], seed: int = 0) -> NDArray[np.float64]:
    """Noise of zero mean and about unit deviation at points of space.

    points: (n, 3) [m]; footprint: width of ground that one pixel sees there, (n,) [m]. Waves shorter than about
    twice the footprint are averaged out. Returns (n,).
    """
    copies = _copies(seed)
    level = np.clip(np.log2(np.maximum(footprint, 1e-6) / TEXEL), 0.0, LEVELS - 1.001)
    whole = level.astype(np.int64)
    out = np.zeros(len(points))
    for k in range(LEVELS - 1):
        here = np.flatnonzero(whole == k)
        if len(here) == 0:
            continue
        x, y, z = points[here].T
        fine = np.zeros(len(here))
        coarse = np.zeros(len(here))
        for along_x, along_y, shift_x, shift_y in _SHEARS:
            u = (x + along_x * z + shift_x) / (TEXEL * 2**k)
            v = (y + along_y * z + shift_y) / (TEXEL * 2**k)
            fine += _bilinear(copies[k], u, v)
            coarse += _bilinear(copies[k + 1], 0.5 * u, 0.5 * v)
        blend = level[here] - k
        out[here] = (fine * (1 - blend) + coarse * blend) / np.sqrt(2.0)
    return out
