"""Everything that is linear in the waves at one place and time, as one product with a real matrix.

    y_r(t; X, Y) = Re{sum_n H_rn exp(-i k_n (X cos beta_n + Y sin beta_n)) a_n(t)}                    (1)

a_n are the amplitudes of a sea (`tlpsim.loads.waves.sea`), (X, Y) the place. The rows r are the elevation, forces,
and the velocities of the water at many points of one hull. These points lie within a few wavelengths, so that the rows
of a long-crested sea are nearly linearly dependent: 223 of the ISSC platform have the rank 80, to rounding. A pivoted
QR decomposition chooses that many of them, H_B, and gives the others as sums of these (Cheng, Gimbutas, Martinsson and
Rokhlin 2005, SIAM J. Sci. Comput. 26):

    H = T H_B,   T = 1 for the rows of H_B                                                            (2)

to `ROUNDING` of each row. Where it saves next to nothing, as in a spread sea, all rows are computed.

The loops are compiled, and their order of summation is fixed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.linalg import qr, solve_triangular

from tlpsim.loads.waves.sea import Sea

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

ROUNDING = 1e-13
"""Largest part of a row, relative to it, that eq. (2) leaves out."""
_LEAST_SAVING = 0.8  # of the products, from which eq. (2) is worth it
_BLOCK = 8  # products that are added in one pass


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearRows:
    """Rows of eq. (1) with the room that `evaluate_rows` needs; made by `linear_rows`.

    Attributes
    ----------
    wavenumber
        k cos beta and k sin beta, shape (2, N), 1/m.
    matrix
        Of H_B: real parts and negative imaginary parts as rows in turn, shape (2N, B), zeros up to a multiple of 8.
    mixture
        T of the rows that are not in H_B, shape (B, R - B), zeros up to a multiple of 8.
    order
        Numbers of the rows in H_B, then of the others, shape (R,).
    shifted, chosen, others
        Room for the amplitudes at the place, for the rows in H_B and for the others.
    response
        Of the last call, shape (R,).
    """

    wavenumber: FloatArray
    matrix: FloatArray
    mixture: FloatArray
    order: NDArray[np.int64]
    shifted: FloatArray
    chosen: FloatArray
    others: FloatArray
    response: FloatArray

    @property
    def arrays(self) -> tuple[NDArray[np.generic], ...]:
        """Arguments of `evaluate_rows` after the place."""
        return (
            self.wavenumber,
            self.matrix,
            self.mixture,
            self.order,
            self.shifted,
            self.chosen,
            self.others,
            self.response,
        )


def linear_rows(transfer: ComplexArray, sea: Sea) -> LinearRows:
    """Prepare eq. (1) for the waves of a sea.

    Parameters
    ----------
    transfer
        H, shape (R, N), of any units.
    sea
        Only its wavenumbers and headings matter.
    """
    count = len(transfer)
    real = np.empty((count, 2 * transfer.shape[1]))
    real[:, 0::2], real[:, 1::2] = transfer.real, -transfer.imag
    order, mixture = _interpolative(real)
    basis = count - mixture.shape[1]
    matrix, mixture = _filled(real[order[:basis]].T), _filled(mixture)
    return LinearRows(
        wavenumber=np.vstack([sea.wavenumber * np.cos(sea.heading), sea.wavenumber * np.sin(sea.heading)]),
        matrix=matrix,
        mixture=mixture,
        order=order,
        shifted=np.zeros(len(matrix)),
        chosen=np.zeros(len(mixture)),
        others=np.zeros(mixture.shape[1]),
        response=np.zeros(count),
    )


def _interpolative(rows: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
    """Order of the rows (R,), those of the basis first, and the mixture (B, R - B) of the others, eq. (2)."""
    count, width = rows.shape
    size = np.linalg.norm(rows, axis=1)
    scale = np.where(size > 0.0, size, 1.0)
    if count == 0 or width == 0:
        return np.arange(count), np.zeros((count, 0))
    triangle, order = qr((rows / scale[:, None]).T, mode="r", pivoting=True)
    diagonal = np.abs(np.diagonal(triangle))
    basis = max(int(np.sum(diagonal > ROUNDING * diagonal[0])), 1)
    if basis * (width + count - basis) > _LEAST_SAVING * width * count:
        return np.arange(count), np.zeros((count, 0))
    mixture = solve_triangular(triangle[:basis, :basis], triangle[:basis, basis:])
    return order.astype(np.int64), mixture * scale[order[basis:]] / scale[order[:basis], None]


def _filled(matrix: FloatArray) -> FloatArray:
    """Rows of zeros up to a whole number of blocks."""
    return np.vstack([matrix, np.zeros((-len(matrix) % _BLOCK, matrix.shape[1]))])


@njit(inline="always")
def _cosine_sine(angle):  # type: ignore[no-untyped-def]
    """Cosine and sine to 2e-16 for angles up to 1e5, without branches, so that many are computed side by side.

    The polynomials of least largest error on half a quadrant are those of the library fdlibm; the quarter turns are
    taken off in two parts, of which the first is exact.
    """
    quarters = math.floor(angle * 0.6366197723675814 + 0.5)
    r = (angle - quarters * 1.5707963267341256) - quarters * 6.077100506506192e-11
    z = r * r
    sine = 2.75573137070700676789e-06 + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)
    sine = 8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04 + z * sine)
    sine = r + r * z * (-1.66666666666666324348e-01 + z * sine)
    cosine = -2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)
    cosine = -1.38888888888741095749e-03 + z * (2.48015872894767294178e-05 + z * cosine)
    cosine = 1.0 - 0.5 * z + z * z * (4.16666666666666019037e-02 + z * cosine)
    quadrant = quarters - 4.0 * math.floor(0.25 * quarters)
    odd = quadrant == 1.0 or quadrant == 3.0
    first = sine if odd else cosine
    second = cosine if odd else sine
    return -first if quadrant == 1.0 or quadrant == 2.0 else first, -second if quadrant >= 2.0 else second


@njit(cache=True)
def _product(vector, matrix, result):  # type: ignore[no-untyped-def]
    """`vector` (n,) times `matrix` (n, m) into `result` (m or more,); n is a multiple of eight."""
    count = matrix.shape[1]
    result[:] = 0.0
    for first in range(0, len(vector), 8):
        a, b, c, d, e, f, g, h = vector[first : first + 8]
        block = matrix[first : first + 8]
        for row in range(count):
            total = result[row] + (block[0, row] * a + block[1, row] * b)
            total = total + (block[2, row] * c + block[3, row] * d)
            total = total + (block[4, row] * e + block[5, row] * f)
            result[row] = total + (block[6, row] * g + block[7, row] * h)


@njit(cache=True)
def evaluate_rows(  # type: ignore[no-untyped-def]
    amplitudes, x, y, wavenumber, matrix, mixture, order, shifted, chosen, others, response
):
    """Eq. (1) into `response` (R,); `amplitudes` (N,), `x` and `y` in m, the rest as `LinearRows.arrays`."""
    for n in range(len(amplitudes)):
        cosine, sine = _cosine_sine(wavenumber[0, n] * x + wavenumber[1, n] * y)
        shifted[2 * n] = amplitudes[n].real * cosine + amplitudes[n].imag * sine
        shifted[2 * n + 1] = amplitudes[n].imag * cosine - amplitudes[n].real * sine
    _product(shifted, matrix, chosen)
    basis = matrix.shape[1]
    for row in range(basis):
        response[order[row]] = chosen[row]
    if len(others) > 0:
        _product(chosen, mixture, others)
        for row in range(len(others)):
            response[order[basis + row]] = others[row]
