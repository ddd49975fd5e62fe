"""Skewness and kurtosis of the quadratic response.

The response at an instant is a quadratic function of normal variables (`tlpsim.loads.spectral.cumulants`). Its third
and fourth cumulants are the sum of those of two parts that are taken as independent:

    y_w = c x1 + c Z^-1 z(x1, x1)                 waves, and what is of the second order in them          (1)
    y_s = c (g + x1) + 1/2 C : g g + C : g x1,   C = T'' - c Z(0)^-1 r''                                 (2)

Eq. (2) holds the tethers' products of slow motion g, that of gusts and of the second order, with itself and with that
of waves; the platform answers them as if they were static, which they are in heave, roll, pitch and tension. Each of
the parts alone has linear terms, which have no third and fourth cumulants of their own. Damping that follows the wave
groups changes the third cumulant (`tlpsim.loads.spectral.group_damping`).

The squares of the wind's fluctuation have a skewness of their own, some hundredths, which is left out.

The grid of the waves resolves their groups (`tlpsim.loads.spectral.problem`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.spectral import viscous
from tlpsim.loads.spectral.bispectral import BispectralMatrix, difference_spectrum
from tlpsim.loads.spectral.cumulants import QuadraticForm, beside, cumulants, from_waves
from tlpsim.loads.spectral.dynamics import transfer
from tlpsim.loads.spectral.group_damping import damping_matrices, third_cumulant_change
from tlpsim.loads.spectral.iteration import Expanded, FirstOrder, first_transfer, second_order, wave_motion
from tlpsim.loads.spectral.problem import SLOW_BAND, Problem
from tlpsim.loads.spectral.second_order import EvenSpectrum, whole

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_ROUNDING = 1e-12


def higher_cumulants(
    problem: Problem,
    expanded: Expanded,
    frequency: FloatArray,
    motion: tuple[ComplexArray, ComplexArray],
    rows: FloatArray,
    curvatures: FloatArray,
) -> FloatArray:
    """Third and fourth cumulants of quantities y, (n, 2), eqs. (1) and (2).

    Parameters
    ----------
    frequency, motion
        Even from zero, (m,) Hz, and cross-spectra of slow motion and of the first-order motion of waves, (m, 6, 6).
    rows
        c, (n, 6).
    curvatures
        T'' of each, (n, 6, 6); zero where y is linear in the position.
    """
    static = np.real(transfer(expanded.system, problem.memory, np.zeros(1))[0])
    bent = curvatures - np.einsum("ni,ij,jkl->nkl", rows, static, expanded.curvature)
    slow, fast = (_root(frequency[1] * each.real.sum(axis=0)) for each in motion)
    result = np.stack([_of_slow_motion(row, curve, slow, fast) for row, curve in zip(rows, bent, strict=True)])
    sea = problem.groups
    if sea is None:
        return result
    position, force = wave_motion(sea, expanded, first_transfer(sea.grid.frequency, problem, expanded))
    first = FirstOrder(waves=position, force=force, gusts=None)
    kinds, number = np.unique(curvatures.reshape(len(rows), 36), axis=0, return_inverse=True)
    matrices = whole(second_order(sea, expanded, first, kinds.reshape(-1, 6, 6)), sea.grid)
    forms = np.concatenate([rows, np.eye(len(kinds))[number.ravel()]], axis=1)
    result += _of_waves(_responses(problem, expanded, matrices), rows @ position, forms, sea.grid.step)
    result[:, 0] += _of_group_damping(problem, expanded, matrices, position, frequency, motion[0], rows)
    return result


def _of_group_damping(
    problem: Problem,
    expanded: Expanded,
    matrices: BispectralMatrix,
    position: ComplexArray,
    frequency: FloatArray,
    motion: ComplexArray,
    rows: FloatArray,
) -> FloatArray:
    """Change of the third cumulants by damping that follows the wave groups, (n,)."""
    sea = problem.groups
    assert sea is not None
    assert expanded.drag is not None
    relative, _ = viscous.relative_rows(sea.elements[0], sea.rows[0], position, sea.grid.omega)
    damping = damping_matrices(expanded.drag, relative, sea.grid)
    both = np.concatenate([matrices.difference[:6], damping])
    joint = BispectralMatrix(frequency=sea.grid.frequency, difference=both, total=both)
    below = frequency <= SLOW_BAND
    chosen = frequency[below]
    cross = EvenSpectrum(first=0.0, step=sea.grid.step, values=difference_spectrum(joint)[1]).at(chosen)[:, :6, 6:]
    response = transfer(expanded.drifting, problem.memory, 2.0 * np.pi * chosen)
    return third_cumulant_change(rows, chosen, response, cross, motion[below])


def _root(covariance: FloatArray) -> FloatArray:
    """R with R R^T the covariance, (6, r)."""
    values, vectors = np.linalg.eigh(covariance)
    kept = values > _ROUNDING * max(float(values[-1]), np.finfo(np.float64).tiny)
    return np.asarray(vectors[:, kept] * np.sqrt(values[kept]))


def _of_slow_motion(row: FloatArray, curve: FloatArray, slow: FloatArray, fast: FloatArray) -> FloatArray:
    own = QuadraticForm(linear=slow.T @ row, matrix=0.5 * slow.T @ curve @ slow)
    waves = QuadraticForm(linear=fast.T @ row, matrix=np.zeros((fast.shape[1], fast.shape[1])))
    return _third_and_fourth(beside(own, waves, slow.T @ curve @ fast))


def _of_waves(kernels: BispectralMatrix, linear: ComplexArray, forms: FloatArray, step: float) -> FloatArray:
    """Those of eq. (1), (n, 2), for c x1 (n, N) and forms [c, 1] (n, k) of the second-order responses."""
    difference, total = (_combined(forms, part) for part in (kernels.difference, kernels.total))
    each = zip(linear, difference, total, strict=True)
    return np.stack([_third_and_fourth(from_waves(x, low, high, step)) for x, low, high in each])


def _third_and_fourth(form: QuadraticForm) -> FloatArray:
    found = cumulants(form)
    return np.array([found.skewness * found.variance**1.5, found.excess_kurtosis * found.variance**2])


def _responses(problem: Problem, expanded: Expanded, matrices: BispectralMatrix) -> BispectralMatrix:
    """Matrices of positions and of quadratic quantities from those of forces and of the same quantities."""
    forces = BispectralMatrix(
        frequency=matrices.frequency, difference=matrices.difference[:6], total=matrices.total[:6]
    )
    found = forces.through(
        transfer(expanded.drifting, problem.memory, 2.0 * np.pi * forces.difference_frequency),
        transfer(expanded.system, problem.memory, 2.0 * np.pi * forces.total_frequency),
    )
    return BispectralMatrix(
        frequency=matrices.frequency,
        difference=np.concatenate([found.difference, matrices.difference[6:]]),
        total=np.concatenate([found.total, matrices.total[6:]]),
    )


def _combined(forms: FloatArray, matrices: ComplexArray) -> ComplexArray:
    """Sums (n, N, N) of matrices (k, N, N) with real factors (n, k)."""
    flat = np.ascontiguousarray(matrices).reshape(len(matrices), -1).view(np.float64)
    return np.asarray((forms @ flat).view(np.complex128).reshape(len(forms), *matrices.shape[1:]))
