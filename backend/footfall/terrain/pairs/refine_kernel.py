"""Compiled: a plane of disparity fitted around every pixel, in one step of reweighted least squares."""

import numpy as np
from numba import prange

from footfall.compiled import njit
from footfall.core.arrays import Floats32


@njit(parallel=True, error_model="numpy")
def fit_planes(
    found: Floats32,
    error: Floats32,
    slope: Floats32,
    weight: Floats32,
    planes: Floats32,
    radius: int,
    inverse_reach: Floats32,
    pull: float,
) -> tuple[Floats32, Floats32]:
    """Planes one step better, and the variance (height, width) [px²] of their disparity.

    A plane (3, height, width) is the disparity at the pixel, its change per column and per row. The variance is the
    corner of the inverse of the matrix of the normal equations.

    found: disparities so far, which the right image was sampled at; error: its grey minus the left one there; slope: of
    both images along the row; weight: 1 / variance of the error, 0 = unknown. These four with a border of ``radius`` on
    all sides, (height + 2 radius, width + 2 radius). planes: (3, height, width). inverse_reach: (height, width) [1/px].
    pull: weight of the disparity that there was among the measurements [1/px²].

    At neighbour q of a pixel the plane says disparity P(q); the right image, linearised, then differs from the left one
    by r(q) = error(q) + slope(q) (found(q) − P(q)). Minimised in the three numbers of the plane is, over the window,
    Σ weight ρ r² + pull (change of P at the pixel itself)². ρ is Cauchy's weight of r, times the square of one in
    (found(q) − P(q)) · inverse_reach: another surface is not followed.
    """
    height, width = planes.shape[1:]
    better, variance = np.empty((3, height, width), np.float32), np.empty((height, width), np.float32)
    one, ridge = np.float32(1.0), np.float32(0.02)
    toward = np.float32(pull)
    for i in prange(height):
        # whole rows at a time, so that the loops over columns become vector instructions
        v = np.int64(i)
        at, along, down, narrow = planes[0, v], planes[1, v], planes[2, v], inverse_reach[v]
        s, sx, sy = np.zeros(width, np.float32), np.zeros(width, np.float32), np.zeros(width, np.float32)
        sxx, sxy, syy = np.zeros(width, np.float32), np.zeros(width, np.float32), np.zeros(width, np.float32)
        t, tx, ty = np.zeros(width, np.float32), np.zeros(width, np.float32), np.zeros(width, np.float32)
        for row in range(-radius, radius + 1):
            y = np.float32(row)
            # sums over the row alone, and what of them does not change along it
            base = at + down * y
            r0, r1, r2 = np.zeros(width, np.float32), np.zeros(width, np.float32), np.zeros(width, np.float32)
            q0, q1 = np.zeros(width, np.float32), np.zeros(width, np.float32)
            for col in range(-radius, radius + 1):
                x = np.float32(col)
                first = radius + col
                d = found[v + radius + row, first : first + width]
                e = error[v + radius + row, first : first + width]
                g = slope[v + radius + row, first : first + width]
                w = weight[v + radius + row, first : first + width]
                for u in range(width):
                    off = d[u] - (base[u] + along[u] * x)
                    r = e[u] + g[u] * off
                    off *= narrow[u]
                    far = one + off * off
                    a = w[u] * g[u] / (far * far * (one + r * r * w[u]))
                    b = a * r
                    a *= g[u]
                    ax = a * x
                    r0[u] += a
                    r1[u] += ax
                    r2[u] += ax * x
                    q0[u] += b
                    q1[u] += b * x
            for u in range(width):
                s[u] += r0[u]
                sx[u] += r1[u]
                sxx[u] += r2[u]
                sy[u] += y * r0[u]
                sxy[u] += y * r1[u]
                syy[u] += y * y * r0[u]
                t[u] += q0[u]
                tx[u] += q1[u]
                ty[u] += y * q0[u]
        for u in range(width):
            # a little is added to the slopes' part of the matrix: where texture tells nothing of them, they stay
            extra = ridge * (sxx[u] + syy[u]) + np.float32(1e-6)
            xx, yy, xy = sxx[u] + extra, syy[u] + extra, sxy[u]
            c00, c01, c02 = xx * yy - xy * xy, xy * sy[u] - sx[u] * yy, sx[u] * xy - xx * sy[u]
            s[u] += toward
            determinant = s[u] * c00 + sx[u] * c01 + sy[u] * c02
            better[0, v, u], better[1, v, u], better[2, v, u] = at[u], along[u], down[u]
            variance[v, u] = one / toward
            if determinant > np.float32(1e-9):
                c11, c12, c22 = s[u] * yy - sy[u] * sy[u], sx[u] * sy[u] - s[u] * xy, s[u] * xx - sx[u] * sx[u]
                better[0, v, u] += (c00 * t[u] + c01 * tx[u] + c02 * ty[u]) / determinant
                better[1, v, u] += (c01 * t[u] + c11 * tx[u] + c12 * ty[u]) / determinant
                better[2, v, u] += (c02 * t[u] + c12 * tx[u] + c22 * ty[u]) / determinant
                variance[v, u] = c00 / determinant
    return better, variance
