"""Spectra of quadratic forms of few Gaussian processes, by their covariance functions.

With R_g(τ) = E[g(t+τ) g(t)^T] = ∫ Re(S_gg e^{i2πfτ}) df by the trapezoidal rule on even frequencies from zero, and h
independent of g, the covariance functions R_ij(τ) = E[z_i(t+τ) z_j(t)] - E z_i E z_j are

    z_i = g^T A_i g, A symmetric:   2 tr(A_i R_g(τ) A_j R_g(τ)^T)                                    (1)
    z_i = g^T A_i h:                tr(A_i R_h(τ) A_j^T R_g(τ)^T)                                    (2)
    z_i = Σ_a w_ia g_a²:            2 Σ_ab w_ia R_g(τ)_ab² w_jb                                      (3)

and their transforms the one-sided cross-spectra S_ij = E[z_i z_j*], sums and differences of frequencies together. The
transforms are long enough that nothing wraps around. The cost does not grow with the number of sources, unlike that of
the bi-spectral matrices, and grows with the fourth power of the number of processes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.spectral.bispectral import interval
from tlpsim.loads.spectral.compiled import traces

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def product_spectrum(
    frequency: FloatArray,
    first: ComplexArray,
    weights: FloatArray,
    second: ComplexArray | None = None,
    points: int | None = None,
) -> ComplexArray:
    """Cross-spectra of the forms g^T A_i g, eq. (1), or g^T A_i h where `second` is given, eq. (2).

    Parameters
    ----------
    frequency
        Hz, even from zero, shape (n,).
    first
        One-sided cross-spectra of g, shape (n, d, d), unit²/Hz.
    weights
        A, shape (q, d, d), of which g^T A g takes the symmetric part; or (q, d, e) of g with h.
    second
        One-sided cross-spectra of h, shape (n, e, e).
    points
        Number of frequencies wanted: n unless given, up to 2 n - 1, past which there is nothing.

    Returns
    -------
    At 0, Δ ... (points - 1) Δ, shape (points, q, q).

    Raises
    ------
    ScenarioError
        If the frequencies are not even from zero, or shapes or the number of points do not fit.
    """
    spectra = [first, first if second is None else second]
    length = _length(frequency, spectra, weights.shape[1:], points)
    forms = weights if second is not None else 0.5 * (weights + weights.swapaxes(1, 2))
    g = _covariance(frequency, first, length)
    h = g if second is None else _covariance(frequency, second, length)
    products = traces(forms, g, h)
    return _one_sided(frequency, products, length, points) * (2.0 if second is None else 1.0)


def square_spectrum(
    frequency: FloatArray, spectrum: ComplexArray, weights: FloatArray, points: int | None = None
) -> ComplexArray:
    """Cross-spectra of sums of squares Σ_a w_ia g_a², eq. (3), of many processes.

    Parameters and errors are those of `product_spectrum`, with weights of the shape (q, d).
    """
    length = _length(frequency, [spectrum], weights.shape[1:], points)
    g = _covariance(frequency, spectrum, length)
    before = np.tensordot(weights, 2.0 * g * g, axes=1)
    products = np.tensordot(weights, before, axes=(1, 1)).swapaxes(0, 1)
    return _one_sided(frequency, products, length, points)


def _length(frequency: FloatArray, spectra: list[ComplexArray], sizes: tuple[int, ...], points: int | None) -> int:
    """Even length of transforms that keeps what wraps around out of the frequencies wanted."""
    interval(frequency)
    count = len(frequency)
    expected = [(count, size, size) for size in sizes]
    if frequency[0] != 0.0 or [spectrum.shape for spectrum in spectra] != expected:
        raise ScenarioError(
            f"spectra of quadratic forms have the shapes {[spectrum.shape for spectrum in spectra]} from "
            f"{frequency[0]:.6g} Hz; they must be {expected} from 0 Hz, for these weights"
        )
    points = count if points is None else points
    if not 1 <= points < 2 * count:
        raise ScenarioError(f"points of the spectrum of a product are {points}; they must be from 1 to {2 * count - 1}")
    # The spectrum reaches to ±(2 n - 2) Δ, and no copy of it may reach back to (points - 1) Δ.
    return 2 * int(fft.next_fast_len((2 * count - 2 + points + 1) // 2, real=True))


def _covariance(frequency: FloatArray, spectrum: ComplexArray, length: int) -> FloatArray:
    """R at lags 0 ... half the period 1 / Δ, shape (d, d, length / 2 + 1); at the others R(-τ) = R(τ)^T."""
    # irfft takes every frequency but zero twice, as ±f: two-sided, that is twice the spectrum, at zero as it is.
    size, half = spectrum.shape[1], length // 2 + 1
    rows, others = np.triu_indices(size)
    series = fft.irfft(np.ascontiguousarray(spectrum[:, rows, others].T), length) * (0.5 * length * interval(frequency))
    lags = np.empty((size, size, half))
    lags[rows, others] = series[:, :half]
    lags[others, rows, 1:] = series[:, :-half:-1]
    lags[others, rows, 0] = series[:, 0]
    return lags


def _one_sided(frequency: FloatArray, covariance: FloatArray, length: int, points: int | None) -> ComplexArray:
    """Spectra (points, q, q) of covariance functions at lags from zero to half the period."""
    size = len(covariance)
    rows, others = np.triu_indices(size)
    series = np.concatenate([covariance[rows, others], covariance[others, rows, -2:0:-1]], axis=1)
    upper = fft.rfft(series)[:, : len(frequency) if points is None else points]
    upper *= 2.0 / (length * interval(frequency))
    spectrum = np.empty((size, size, upper.shape[1]), dtype=np.complex128)
    spectrum[others, rows] = upper.conj()
    spectrum[rows, others] = upper
    return np.ascontiguousarray(spectrum.transpose(2, 0, 1))
