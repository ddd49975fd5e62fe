"""Skewness and kurtosis of the quadratic response.

The response at an instant is a quadratic function of normal variables (`tlpsim.loads.spectral.cumulants`). Its third
and fourth cumulants are the sum of those of two parts that are taken as independent:

    y_w = c x1 + c Z^-1 z(x1, x1)                 waves, and what is of the second order in them          (1)
    y_s = c (g + x1) + 1/2 C : g g + C : g x1,   C = T'' - c Z(0)^-1 r''                                 (2)

Eq. (2) holds the tethers' products of slow motion g, that of gusts and of the second order, with itself and with that
of waves; the platform answers them as if they were static, which they are in heave, roll, pitch and tension. Each of
the parts alone has linear terms, which have no third and fourth cumulants of their own.

The grid of the waves is finer than that of the iteration, so that it resolves the slow modes, and leaves out what has
next to no energy. With many directions it is coarser again.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.spectral.bispectral import BispectralMatrix
from tlpsim.loads.spectral.cumulants import QuadraticForm, beside, cumulants, from_waves
from tlpsim.loads.spectral.dynamics import transfer
from tlpsim.loads.spectral.iteration import Expanded, FirstOrder, second_order, wave_motion
from tlpsim.loads.spectral.problem import Problem, SeaOnGrid, acting_sea, sea_on_grid
from tlpsim.loads.spectral.second_order import whole

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

MOST_COMPONENTS = 200
"""of the waves' grid, over all directions: cumulants are within 5e-3 of those with twice as many."""
ENERGY_OUTSIDE = 1e-3
"""Part of the waves' energy that may be left out on either side."""
_ROUNDING = 1e-12


def _sea(problem: Problem) -> SeaOnGrid | None:
    """The waves on a grid of at most `MOST_COMPONENTS`."""
    sea = acting_sea(problem)
    if sea is None:
        return None
    grid = sea.grid
    energy = np.cumsum(np.sum(grid.root.reshape(grid.order, -1) ** 2, axis=0))
    low, high = np.searchsorted(energy / energy[-1], [ENERGY_OUTSIDE, 1.0 - ENERGY_OUTSIDE])
    low, high = max(int(low) - 1, 0), min(int(high) + 1, len(grid.frequency) - 1)
    band = float(grid.frequency[low]), float(grid.frequency[high])
    step = (band[1] - band[0]) * grid.order / MOST_COMPONENTS
    return sea_on_grid(sea.waves, min(step, grid.step), band=band)


def higher_cumulants(
    problem: Problem,
    expanded: Expanded,
    motion: tuple[FloatArray, FloatArray],
    rows: FloatArray,
    curvatures: FloatArray,
) -> FloatArray:
    """Third and fourth cumulants of quantities y, (n, 2), eqs. (1) and (2).

    Parameters
    ----------
    motion
        Covariances of slow motion and of the first-order motion of waves, (6, 6) each.
    rows
        c, (n, 6).
    curvatures
        T'' of each, (n, 6, 6); zero where y is linear in the position.
    """
    static = np.real(transfer(expanded.system, problem.memory, np.zeros(1))[0])
    bent = curvatures - np.einsum("ni,ij,jkl->nkl", rows, static, expanded.curvature)
    slow, fast = (_root(each) for each in motion)
    result = np.stack([_of_slow_motion(row, curve, slow, fast) for row, curve in zip(rows, bent, strict=True)])
    sea = _sea(problem)
    if sea is None:
        return result
    position, force = wave_motion(sea, problem, expanded)
    first = FirstOrder(waves=position, force=force, gusts=None)
    kinds, number = np.unique(curvatures.reshape(len(rows), 36), axis=0, return_inverse=True)
    matrices = whole(second_order(sea, expanded, first, kinds.reshape(-1, 6, 6)), sea.grid)
    kernels = _responses(problem, expanded, matrices, sea)
    for n, row in enumerate(rows):
        whole_row = np.concatenate([row, np.eye(len(kinds))[number.ravel()[n]]])
        difference, total = (np.tensordot(whole_row, kernel, axes=1) for kernel in kernels)
        result[n] += _third_and_fourth(from_waves(row @ position, difference, total, sea.grid.step))
    return result


def _root(covariance: FloatArray) -> FloatArray:
    """R with R R^T the covariance, (6, r)."""
    values, vectors = np.linalg.eigh(covariance)
    kept = values > _ROUNDING * max(float(values[-1]), np.finfo(np.float64).tiny)
    return np.asarray(vectors[:, kept] * np.sqrt(values[kept]))


def _of_slow_motion(row: FloatArray, curve: FloatArray, slow: FloatArray, fast: FloatArray) -> FloatArray:
    own = QuadraticForm(linear=slow.T @ row, matrix=0.5 * slow.T @ curve @ slow)
    waves = QuadraticForm(linear=fast.T @ row, matrix=np.zeros((fast.shape[1], fast.shape[1])))
    return _third_and_fourth(beside(own, waves, slow.T @ curve @ fast))


def _third_and_fourth(form: QuadraticForm) -> FloatArray:
    found = cumulants(form)
    return np.array([found.skewness * found.variance**1.5, found.excess_kurtosis * found.variance**2])


def _responses(
    problem: Problem, expanded: Expanded, matrices: BispectralMatrix, sea: SeaOnGrid
) -> tuple[ComplexArray, ComplexArray]:
    """Bi-spectral matrices (6 + q, N, N) of positions and of quadratic quantities, for differences and sums."""
    frequency, order = sea.grid.frequency, sea.grid.order
    count = len(frequency)
    ups = np.round((frequency[:, None] - frequency) / sea.grid.step).astype(np.int64)
    slow = transfer(expanded.system, problem.memory, 2.0 * np.pi * sea.grid.step * np.arange(count))
    both = np.concatenate([np.conj(slow[:0:-1]), slow])  # negative differences first
    sums = 2.0 * frequency[0] + sea.grid.step * np.arange(2 * count - 1)
    fast = transfer(expanded.system, problem.memory, 2.0 * np.pi * sums)
    places = ups + count - 1, np.add.outer(np.arange(count), np.arange(count))
    found = []
    for table, place, forces in zip((both, fast), places, (matrices.difference, matrices.total), strict=True):
        blocks = forces.reshape(len(forces), order, count, order, count)
        result = blocks.copy()
        operator = table[place]  # (nf, nf, 6, 6)
        result[:6] = np.einsum("abij,jpaqb->ipaqb", operator, blocks[:6], optimize=True)
        found.append(result.reshape(forces.shape))
    return found[0], found[1]
