"""Cumulants of a quadratic function of Gaussian variables: the skewness and kurtosis of a second-order response.

With y of n independent standard normal variables and a symmetric A,

    z = c^T y + y^T A y                                                                              (1)
    k1 = tr A,                          k2 = c^T c + 2 tr A^2
    k3 = 6 c^T A c + 8 tr A^3,          k4 = 48 c^T A^2 c + 48 tr A^4                                (2)

after Kac and Siegert (Journal of Applied Physics 18, 1947), who sum over the eigenvalues of A; the traces need one
product of matrices instead, tr A^4 being the sum of the squares of the elements of A^2. Of any such z,
k3^2 <= 3/4 k2 k4 (Cauchy-Schwarz): its excess kurtosis is at least 4/3 of its skewness squared, and never negative.

Waves on frequencies f_n with the spacing df are w_n = u_n + i v_n, with independent standard normal u_n and v_n. A
linear response with the decomposed function X (N,) has the one-sided spectrum |X|^2 and is

    x(t) = Re sum_n X_n sqrt(df) w_n exp(i 2 pi f_n t)                                               (3)

A quadratic response with the decomposed bi-spectral matrices B (Hermitian) of difference frequencies and P
(symmetric) of total ones is, at t = 0,

    z = df/2 Re sum_mn (B_mn w_m conj(w_n) + P_mn w_m w_n),         E z = df sum_n B_nn              (4)

so that the product x y of two linear responses has B_mn = (X_m conj(Y_n) + Y_m conj(X_n)) / 2 and
P_mn = (X_m Y_n + Y_m X_n) / 2, exactly. In the real variables (u, v) eqs. (3) and (4) are eq. (1) with

    c = sqrt(df) (Re X, -Im X),    A = df/2 [[Re(B + P), Im(B - P)], [-Im(B + P), Re(B - P)]]        (5)

The response is stationary: its distribution at t = 0 is that at all times.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# Of the largest element: what rounding may leave of the difference of a symmetric matrix and its transpose.
_SYMMETRY_TOLERANCE = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class QuadraticForm:
    """A quadratic function of independent standard normal variables, eq. (1).

    Attributes
    ----------
    linear
        c, shape (n,), in the unit of the response.
    matrix
        A, symmetric, shape (n, n), same unit.

    Raises
    ------
    ScenarioError
        If the shapes do not fit, or the matrix is not symmetric or not finite.
    """

    linear: FloatArray
    matrix: FloatArray

    def __post_init__(self) -> None:
        if self.linear.ndim != 1 or self.matrix.shape != (len(self.linear), len(self.linear)):
            raise ScenarioError(
                f"the quadratic form has a linear part of shape {self.linear.shape} and a matrix of shape "
                f"{self.matrix.shape}; they must be (n,) and (n, n)"
            )
        skew = float(np.abs(self.matrix - self.matrix.T).max(initial=0.0))
        limit = _SYMMETRY_TOLERANCE * float(np.abs(self.matrix).max(initial=0.0))
        if not skew <= limit:  # nor for NaN
            raise ScenarioError(
                f"the matrix of the quadratic form differs from its transpose by up to {skew:.3g}; it must be finite "
                f"and symmetric to {limit:.3g}: functions of difference frequencies Hermitian, of total ones symmetric"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Cumulants:
    """Mean, variance, skewness k3 / k2^(3/2) and excess kurtosis k4 / k2^2; the last two are 0 without variance."""

    mean: float
    variance: float
    skewness: float
    excess_kurtosis: float


def cumulants(form: QuadraticForm) -> Cumulants:
    """First four cumulants of a quadratic function of normal variables, eq. (2).

    Takes one product of (n, n) matrices. Source: Kac and Siegert (1947).
    """
    linear, matrix = form.linear, form.matrix
    square = matrix @ matrix.T  # a matrix times its own transpose takes half the operations
    along = matrix @ linear
    variance = float(linear @ linear) + 2.0 * float(np.vdot(matrix, matrix))
    third = 6.0 * float(linear @ along) + 8.0 * float(np.vdot(square, matrix))
    fourth = 48.0 * float(along @ along) + 48.0 * float(np.vdot(square, square))
    return Cumulants(
        mean=float(np.trace(matrix)),
        variance=variance,
        skewness=third / variance**1.5 if variance > 0.0 else 0.0,
        excess_kurtosis=fourth / variance**2 if variance > 0.0 else 0.0,
    )


def from_waves(linear: ComplexArray, difference: ComplexArray, total: ComplexArray, step: float) -> QuadraticForm:
    """Form of a linear and quadratic response in the same waves, eq. (5).

    Parameters
    ----------
    linear
        Decomposed function X of eq. (3), shape (N,), unit/√Hz.
    difference, total
        Decomposed bi-spectral matrices B (Hermitian) and P (symmetric) of eq. (4), shape (N, N), unit/Hz.
    step
        Spacing of the frequencies, Hz.

    Returns
    -------
    QuadraticForm
        Of 2N variables, the real parts of all w_n before the imaginary ones.

    Raises
    ------
    ScenarioError
        If the shapes do not fit, the step is not > 0, B is not Hermitian or P is not symmetric.
    """
    count = len(linear)
    if difference.shape != (count, count) or total.shape != (count, count):
        raise ScenarioError(
            f"bi-spectral matrices have the shapes {difference.shape} and {total.shape}; with {count} frequencies of "
            f"the linear response both must be ({count}, {count})"
        )
    if not step > 0.0:
        raise ScenarioError(f"the spacing of frequencies is {step} Hz; it must be > 0")
    matrix = np.empty((2 * count, 2 * count))
    np.add(difference.real, total.real, out=matrix[:count, :count])
    np.subtract(difference.imag, total.imag, out=matrix[:count, count:])
    # Written out, not as the transpose of the other block, so that the check for symmetry covers B and P.
    np.add(difference.imag, total.imag, out=matrix[count:, :count])
    np.negative(matrix[count:, :count], out=matrix[count:, :count])
    np.subtract(difference.real, total.real, out=matrix[count:, count:])
    matrix *= 0.5 * step
    return QuadraticForm(linear=math.sqrt(step) * np.concatenate([linear.real, -linear.imag]), matrix=matrix)


def beside(first: QuadraticForm, second: QuadraticForm, cross: FloatArray) -> QuadraticForm:
    """Sum of two forms in independent variables and of products between them.

    z = z_a + z_b + y_a^T C y_b, such as of wave frequency motion (a), slow motion (b), and products of both.

    Parameters
    ----------
    first, second
        Forms of n_a and n_b variables.
    cross
        C, shape (n_a, n_b), in the unit of the response; half of it goes to either side of the diagonal.

    Raises
    ------
    ScenarioError
        If the shape of `cross` does not fit.
    """
    shape = (len(first.linear), len(second.linear))
    if cross.shape != shape:
        raise ScenarioError(f"the matrix of products between two quadratic forms is {cross.shape}; it must be {shape}")
    return QuadraticForm(
        linear=np.concatenate([first.linear, second.linear]),
        matrix=np.block([[first.matrix, 0.5 * cross], [0.5 * cross.T, second.matrix]]),
    )
