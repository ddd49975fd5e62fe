"""Drag damping that follows the wave groups.

    B_ij(t) = B_ij + b_ij(t),   b_ij = sum_s P_si k_s 3 C3 : (v v - Cov v) P_sj                           (1)
    E[b x'] = Cov(b, x'),   E[b_ij x'_j x'_k] = third cumulant of b_ij, x'_j, x'_k                        (2)
    beta = E[(b x') x'^T] (E[x' x'^T])^-1                                                                (3)

In high groups of waves the water is faster, drag is stronger, and so is the damping of slow motion, just when slow
drift pushes most. b is of the second order in the waves as the slow motion x' is that they make, so that both are
correlated: the mean of b x' is a load against the mean drift, and its projection on x', eq. (3), is damping of that
part of the slow motion that waves make. That of gusts knows nothing of the groups.

Quadratic quantities z_i = 1/2 df sum B_i,mn w_m w_n*, E|w|² = 2, with Hermitian B have the cumulants

    Cov(z_1, z_2) = df² Re tr(B_1 B_2),   cumulant(z_1, z_2, z_3) = 2 df³ Re tr(B_1 B_2 B_3)             (4)

The same makes the response less skewed, since large slow motion is damped more. The force -b x' changes the third
cumulant of a response x with the impulse response h by

    -6 int_0^inf h(t) R_xb(t) R_xx'(t) dt,   R_xy(t) = E[x(s + t) y(s)]                                  (5)

and by a connected fourth cumulant that is left out. x in eq. (5) is the whole slow motion, that of gusts too.

C3 is the third coefficient of Hermite's expansion (`tlpsim.loads.spectral.hermite`), v the relative velocity at a
strip. Only surge, sway and yaw move slowly of themselves.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from tlpsim.loads.constants import HORIZONTAL
from tlpsim.loads.spectral.bispectral import quadratic, through_differences
from tlpsim.loads.spectral.products import Products
from tlpsim.loads.spectral.viscous import Drag, squares
from tlpsim.loads.spectral.wave_grid import WaveGrid

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_LAGS = 4  # times the frequencies, so that products of covariance functions are well sampled
_ROUNDING = 1e-9  # of the largest variance of a velocity, below which a motion is none


def damping_products(drag: Drag, relative: ComplexArray) -> Products:
    """b of eq. (1) in surge, sway and yaw as products, weights (9, M); `relative` (s, 2, N) is v."""
    strips = drag.strips
    slow = strips.projection[:, :, list(HORIZONTAL)]
    weights = 3.0 * np.einsum("sai,sa,sabcd,sbj->sijcd", slow, strips.drag, drag.steady.cubic, slow, optimize=True)
    return squares(weights.reshape(len(slow), 9, 2, 2), relative)


def damping_matrices(drag: Drag, relative: ComplexArray, grid: WaveGrid) -> ComplexArray:
    """Decomposed bi-spectral matrices of b at difference frequencies, (9, N, N)."""
    return quadratic(grid.frequency, damping_products(drag, relative)).difference


def group_damping(
    drag: Drag,
    relative: ComplexArray,
    forces: ComplexArray,
    response: ComplexArray,
    variance: FloatArray,
    grid: WaveGrid,
) -> tuple[FloatArray, FloatArray]:
    """Damping of slow motion of waves (6, 6), eq. (3), and mean load (6,), on rates and as loads, earth-fixed.

    Parameters
    ----------
    relative
        Decomposed relative velocities of the strips, (s, 2, N).
    forces
        Decomposed bi-spectral matrices of the forces of the second order at difference frequencies, (6, N, N).
    response
        Velocity a unit force at the frequencies 0 ... (nf - 1) df, (nf, 6, 6), averaged over a step about each where
        slow modes are narrower than steps: eq. (4) sums each velocity over its frequencies by itself.
    variance
        Covariance of the slow velocity that waves make, (6, 6).
    """
    damping, load = np.zeros((6, 6)), np.zeros(6)
    fluctuation = damping_matrices(drag, relative, grid)
    if not np.any(fluctuation):
        return damping, load
    slow = list(HORIZONTAL)
    velocity = through_differences(response[:, slow], forces, grid.order)
    step = grid.step
    variance = variance[np.ix_(slow, slow)]
    # V_j V_k is V_k V_j turned over, with the same Re tr(b V_j V_k): b and V are Hermitian.
    rows, columns = np.triu_indices(3)
    pairs = velocity[rows] @ velocity[columns]
    flat = fluctuation.reshape(9, -1).conj()
    third = np.empty((3, 3, 3, 3))  # of b_ij with x'_k and x'_l
    third[:, :, rows, columns] = 2.0 * step**3 * (flat @ pairs.reshape(len(rows), -1).T).real.reshape(3, 3, -1)
    third[:, :, columns, rows] = third[:, :, rows, columns]
    along = np.einsum("ijjl->il", third)
    kept = np.diag(variance) > _ROUNDING * np.max(np.diag(variance), initial=0.0)
    inside = np.ix_(kept, kept)
    beta = np.zeros((3, 3))
    if np.any(kept):
        beta[inside] = np.linalg.solve(variance[inside], along[inside].T).T
    damping[np.ix_(slow, slow)] = beta
    mean = step**2 * (flat @ velocity.reshape(3, -1).T).real
    load[slow] = -np.einsum("ijj->i", mean.reshape(3, 3, 3))
    return damping, load


def third_cumulant_change(
    rows: FloatArray, frequency: FloatArray, response: ComplexArray, cross: ComplexArray, motion: ComplexArray
) -> FloatArray:
    """Change of the third cumulants of n slow responses, eq. (5), (n,).

    Parameters
    ----------
    rows
        Factors of the position in each response, (n, 6).
    frequency
        Even from zero, (m,) Hz, up to where slow motion ends.
    response
        Position a unit force, (m, 6, 6).
    cross
        Cross-spectra of the forces of the second order with b, (m, 6, 9).
    motion
        Cross-spectra of the slow motion, (m, 6, 6).
    """
    slow = list(HORIZONTAL)
    count = len(frequency)
    length = _LAGS * count
    spacing = 1.0 / (length * (frequency[1] - frequency[0]))
    rate = -2j * np.pi * frequency  # of the conjugate: x' stands second

    def covariance(spectrum: ComplexArray) -> FloatArray:
        # irfft takes every frequency but zero twice, as ±f: half of it is the real part of the one-sided integral.
        return np.asarray(fft.irfft(spectrum, length)[..., : length // 2] * (0.5 / spacing))

    own = np.tensordot(rows, response, axes=(1, 1)).swapaxes(1, 2)  # (n, 6, m)
    impulse = 2.0 * covariance(own[:, slow])
    with_damping = np.einsum("nim,mib->nbm", own, cross)
    with_damping = covariance(with_damping).reshape(len(rows), 3, 3, -1)
    with_velocity = np.tensordot(rows, motion[:, :, slow], axes=(1, 1)).swapaxes(1, 2)
    with_velocity = covariance(with_velocity * rate)
    product = np.einsum("njt,njkt,nkt->nt", impulse, with_damping, with_velocity)
    return np.asarray(-6.0 * spacing * (np.sum(product, axis=1) - 0.5 * product[:, 0]))
