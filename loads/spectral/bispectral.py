"""Quadratic functions of Gaussian processes by decomposed bi-spectral matrices (Li and Kareem 1990).

Of processes x_m, y_m decomposed over the same sources p (see `tlpsim.loads.spectral.decomposition`) the quantities

    z_i(t) = Σ_m w_im x_m(t) y_m(t),   w real,                                                       (1)

have parts at differences and at sums of two frequencies, with ξ_p(f) complex of E|ξ|² = 2 and √df the measure of each,

    z_i = Re ½ Σ_pq ∫∫ [B_i ξ_p(f₁) ξ_q(f₂)* e^{i2π(f₁-f₂)t} + B⁺_i ξ_p(f₁) ξ_q(f₂) e^{i2π(f₁+f₂)t}]         (2)
    B_i(f₁,f₂)_pq = ½ Σ_m w_im (x_mp(f₁) y_mq(f₂)* + y_mp(f₁) x_mq(f₂)*)                             (3)
    B⁺_i(f₁,f₂)_pq = ½ Σ_m w_im (x_mp(f₁) y_mq(f₂) + y_mp(f₁) x_mq(f₂)),                              (4)

where x_mp is the decomposed function. B is Hermitian and B⁺ symmetric under (f₁, p) ↔ (f₂, q). Any number of products
is in one matrix, and a linear system acts on it as on a spectrum:

    B → H(f₁-f₂) B,   B⁺ → H(f₁+f₂) B⁺                                                               (5)
    E z_i = ∫ Σ_p B_i(f,f)_pp df                                                                     (6)
    S_ij(μ) = 2 ∫_0^∞ Σ_pq B_i(f+μ,f)_pq B_j(f+μ,f)_pq* df,         at differences μ ≥ 0              (7)
    S_ij(μ) = ∫_0^μ Σ_pq B⁺_i(f,μ-f)_pq B⁺_j(f,μ-f)_pq* df,         at sums μ                         (8)

both one-sided, of z - E z. The conventional way convolves the cross-spectra of every pair of products,

    S_z(μ) = Σ_mn w_m w_n (S_{x_m x_n} * S_{y_m y_n} + S_{x_m y_n} * S_{y_m x_n})(μ),   two-sided.     (9)

Frequencies are f_0 + n Δ with f_0 a whole multiple of Δ, and each integral is the sum times Δ, so that these are
identities of the discrete process. A frequency of zero counts in full; the trapezoidal rule gives it half, which a
factor of √½ on the decomposed function there brings about.

A matrix has one row for each source and frequency, N = r nf, the frequencies of a source together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.sparse import csr_array

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.remembered import remembered
from tlpsim.loads.spectral.compiled import from_real_products, summed_over_diagonals
from tlpsim.loads.spectral.decomposition import DecomposedSpectrum
from tlpsim.loads.spectral.products import Products

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BispectralMatrix:
    """Decomposed bi-spectral matrices of q quantities, eqs. (3) and (4).

    Attributes
    ----------
    frequency
        Hz, even, the first a whole multiple of the interval, shape (nf,).
    difference
        B, shape (q, N, N), unit/Hz.
    total
        B⁺, of sums of frequencies, shape (q, N, N), unit/Hz.

    Raises
    ------
    ScenarioError
        If the frequencies are not such, or the shapes do not fit.
    """

    frequency: FloatArray
    difference: ComplexArray
    total: ComplexArray

    def __post_init__(self) -> None:
        interval(self.frequency)
        shape = self.difference.shape
        if not (
            len(shape) == 3
            and shape == self.total.shape
            and shape[1] == shape[2]
            and shape[1] % len(self.frequency) == 0
        ):
            raise ScenarioError(
                f"bi-spectral matrices have the shapes {shape} and {self.total.shape}; both must be (q, N, N) with N "
                f"a multiple of the {len(self.frequency)} frequencies"
            )

    @property
    def sources(self) -> int:
        """Number of sources r."""
        return self.difference.shape[1] // len(self.frequency)

    @property
    def difference_frequency(self) -> FloatArray:
        """Differences 0 ... (nf - 1) Δ, Hz, shape (nf,)."""
        return np.asarray(interval(self.frequency) * np.arange(len(self.frequency)), dtype=np.float64)

    @property
    def total_frequency(self) -> FloatArray:
        """Sums 2 f_0 ... 2 f_0 + 2 (nf - 1) Δ, Hz, shape (2 nf - 1,)."""
        return 2.0 * self.frequency[0] + interval(self.frequency) * np.arange(2 * len(self.frequency) - 1)

    def through(self, at_difference: ComplexArray, at_total: ComplexArray) -> BispectralMatrix:
        """Outputs of a linear system, eq. (5).

        Parameters
        ----------
        at_difference
            Transfer functions at `difference_frequency`, shape (nf, outputs, q), real at zero.
        at_total
            Transfer functions at `total_frequency`, shape (2 nf - 1, outputs, q).

        Raises
        ------
        ScenarioError
            If the shapes do not fit.
        """
        count, inputs = len(self.frequency), len(self.difference)
        for name, transfer, length in (("difference", at_difference, count), ("total", at_total, 2 * count - 1)):
            if transfer.ndim != 3 or (len(transfer), transfer.shape[2]) != (length, inputs):
                raise ScenarioError(
                    f"transfer function at {name} frequencies has the shape {transfer.shape}; it must be ({length}, "
                    f"outputs, {inputs})"
                )
        hankel = np.lib.stride_tricks.sliding_window_view(at_total, count, axis=0)
        return BispectralMatrix(
            frequency=self.frequency,
            difference=through_differences(at_difference, self.difference, self.sources),
            total=_by_blocks(hankel, self.total, self.sources),
        )


def through_differences(transfer: ComplexArray, matrices: ComplexArray, sources: int) -> ComplexArray:
    """Matrices (outputs, N, N) H(f₁-f₂) B of eq. (5) for H (nf, outputs, q) at differences and B (q, N, N)."""
    along = np.concatenate([transfer[:0:-1].conj(), transfer])  # H(-μ) = H(μ)*
    toeplitz = np.lib.stride_tricks.sliding_window_view(along, len(transfer), axis=0)[..., ::-1]
    return _by_blocks(toeplitz, matrices, sources)


@remembered(64)
def interval(frequency: FloatArray) -> float:
    """Interval Δ of even frequencies (nf,) whose first is a whole multiple of it, Hz.

    Raises
    ------
    ScenarioError
        If they are not such.
    """
    if frequency.ndim == 1 and len(frequency) > 1:
        step = float(frequency[-1] - frequency[0]) / (len(frequency) - 1)
        first = round(float(frequency[0]) / step) if step > 0.0 else -1
        if first >= 0 and np.allclose(
            frequency, step * (first + np.arange(len(frequency))), rtol=0.0, atol=1e-6 * step
        ):
            return step
    raise ScenarioError(
        f"frequencies of a bi-spectral matrix are {np.array2string(frequency, threshold=6)} Hz; they must be two or "
        "more, even, and from a whole multiple of their interval, 0, 1, 2 ..., so that differences and sums fall on "
        "such a grid as well"
    )


def _by_blocks(factors: ComplexArray, matrices: ComplexArray, sources: int) -> ComplexArray:
    """Σ_j factors (nf, outputs, q, nf) [a, i, j, b] matrices [j, p a, q b]."""
    count, outputs, inputs, _ = factors.shape
    blocks = matrices.reshape(inputs, sources, count, sources, count)
    result = np.zeros((outputs, *blocks.shape[1:]), dtype=np.complex128)
    for i in range(outputs):
        for j in range(inputs):
            result[i] += factors[:, i, j, None, :] * blocks[j]
    return result.reshape(outputs, *matrices.shape[1:])


def columns(x: DecomposedSpectrum) -> ComplexArray:
    """Decomposed functions (M, N) in the order of a bi-spectral matrix: the frequencies of a source together."""
    return x.function.transpose(1, 2, 0).reshape(x.function.shape[1], -1)


def quadratic(frequency: FloatArray, products: Products) -> BispectralMatrix:
    """Bi-spectral matrices of sums of products, eqs. (3) and (4).

    Of z_i = g^T A_i g, A_i symmetric, of the processes g (G, N) that the products are of they are

        B_i = g^T A_i g*,   B⁺_i = g^T A_i g,                                                       (10)

    so that the cost goes with the number of processes, not of products.

    Parameters
    ----------
    frequency
        Hz, shape (nf,); see `BispectralMatrix`.
    products
        Of decomposed functions as `columns` gives them.

    Raises
    ------
    ScenarioError
        If the shapes do not fit or the frequencies are not even.
    """
    processes, one, other, weights = products
    if processes.ndim != 2 or weights.ndim != 2 or not len(one) == len(other) == weights.shape[1]:
        raise ScenarioError(
            f"processes, their places and weights of a quadratic function have the shapes {processes.shape}, "
            f"{one.shape}, {other.shape} and {weights.shape}; they must be (G, N), (M,), (M,) and (q, M)"
        )
    count, size = processes.shape
    quantities = len(weights)
    # A g of all quantities, those of one process together: rows (a, i) of a sparse matrix.
    row = np.arange(quantities)[:, None]
    places = np.concatenate([one * quantities + row, other * quantities + row], axis=1).ravel()
    sources = np.tile(np.concatenate([other, one]), quantities)
    entries = 0.5 * np.concatenate([weights, weights], axis=1).ravel()
    forms = csr_array((entries, (places, sources)), shape=(count * quantities, count))
    real, imaginary = np.ascontiguousarray(processes.real), np.ascontiguousarray(processes.imag)
    by_real, by_imaginary = ((forms @ part).reshape(count, quantities * size) for part in (real, imaginary))
    difference, total = from_real_products(
        *(
            (left.T @ right).reshape(size, quantities, size)
            for left, right in ((real, by_real), (real, by_imaginary), (imaginary, by_imaginary))
        )
    )
    return BispectralMatrix(frequency=frequency, difference=difference, total=total)


def add(a: BispectralMatrix, b: BispectralMatrix) -> BispectralMatrix:
    """Bi-spectral matrices of the sum of quantities of the same sources.

    Raises
    ------
    ScenarioError
        If frequencies, sources or numbers of quantities differ.
    """
    if not np.array_equal(a.frequency, b.frequency) or a.difference.shape != b.difference.shape:
        raise ScenarioError(
            f"bi-spectral matrices of the shapes {a.difference.shape} and {b.difference.shape} cannot be added; they "
            "need the same frequencies, sources and number of quantities"
        )
    return BispectralMatrix(frequency=a.frequency, difference=a.difference + b.difference, total=a.total + b.total)


def mean(b: BispectralMatrix) -> FloatArray:
    """Means of the quantities (q,), eq. (6)."""
    return np.asarray(np.einsum("iaa->i", b.difference).real * interval(b.frequency))


def difference_spectrum(b: BispectralMatrix) -> tuple[FloatArray, ComplexArray]:
    """Frequencies 0 ... (nf - 1) Δ, Hz, and cross-spectra at differences, (nf, q, q), eq. (7).

    The variance is Δ times their sum, with half of that at zero.
    """
    step = interval(b.frequency)
    return b.difference_frequency, 2.0 * step * summed_over_diagonals(b.difference, len(b.frequency), False)


def sum_spectrum(b: BispectralMatrix) -> tuple[FloatArray, ComplexArray]:
    """Frequencies 2 f_0 ... 2 f_0 + 2 (nf - 1) Δ, Hz, and cross-spectra at sums, (2 nf - 1, q, q), eq. (8).

    The variance is Δ times their sum.
    """
    return b.total_frequency, interval(b.frequency) * summed_over_diagonals(b.total, len(b.frequency), True)


def convolved_spectrum(
    frequency: FloatArray, xx: ComplexArray, yy: ComplexArray, xy: ComplexArray, weights: FloatArray
) -> tuple[ComplexArray, ComplexArray]:
    """Cross-spectra of the same quantities by the conventional convolution of cross-spectra, eq. (9).

    The pairs of products m ≤ n, the others being their conjugates, take four transforms each (fast convolution, with
    zero padding); the sum over them is taken before the transforms back.

    Parameters
    ----------
    frequency
        Hz, shape (nf,); see `BispectralMatrix`.
    xx, yy, xy
        One-sided cross-spectra S_ij = E[x_i x_j*], E[y_i y_j*] and E[x_i y_j*], shape (nf, M, M).
    weights
        Of the products in each quantity, shape (q, M).

    Returns
    -------
    At differences, shape (nf, q, q), and at sums, shape (2 nf - 1, q, q).

    Raises
    ------
    ScenarioError
        If the frequencies are not even.
    """
    step, count = interval(frequency), len(frequency)
    length = fft.next_fast_len(2 * count - 1)
    quantities = len(weights)
    difference = np.zeros((quantities, quantities, length), dtype=np.complex128)
    total = np.zeros_like(difference)
    for m in range(xx.shape[1]):
        # The last is E[y_m x_n*]; time runs along the last axis, where transforms are fast.
        series = np.stack([xx[:, m, m:], yy[:, m, m:], xy[:, m, m:], xy[:, m:, m].conj()])
        a, b, c, d = fft.fft(np.ascontiguousarray(series.swapaxes(1, 2)), length, axis=2)
        others = weights[:, m:].copy()
        others[:, 0] *= 0.5  # a pair of one product with itself is its own conjugate
        difference += weights[:, m, None, None] * (others @ (a * b.conj() + c * d.conj()).real)
        total += 0.5 * weights[:, m, None, None] * (others @ (a * b + c * d))
    spectra = [
        np.moveaxis(fft.ifft(difference)[..., :count], 2, 0) * step,
        np.moveaxis(fft.ifft(total)[..., : 2 * count - 1], 2, 0) * step,
    ]
    at_difference, at_total = (half + half.conj().swapaxes(1, 2) for half in spectra)
    return at_difference, at_total
