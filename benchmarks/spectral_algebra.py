"""Decomposed bi-spectral matrices against the convolution of cross-spectra of every pair of elements.

.venv/bin/python benchmarks/spectral_algebra.py [--quick]
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from report import Row, at_least, at_most, main
from scipy.signal import fftconvolve
from threadpoolctl import threadpool_limits

from tlpsim.loads.spectral.bispectral import (
    columns,
    convolved_spectrum,
    difference_spectrum,
    mean,
    quadratic,
    sum_spectrum,
)
from tlpsim.loads.spectral.decomposition import DecomposedSpectrum, cross_spectrum
from tlpsim.loads.spectral.products import pairs
from tlpsim.loads.waves.spectra import pierson_moskowitz

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Result = TypeVar("Result")

ELEMENTS, FREQUENCIES = 60, 512


def _timed(work: Callable[[], Result], repeats: int) -> tuple[float, Result]:
    """Least seconds of some repeats, and the result."""
    seconds = np.inf
    for _ in range(repeats):
        began = time.perf_counter()
        result = work()
        seconds = min(seconds, time.perf_counter() - began)
    return seconds, result


def _elements(
    count: int, frequencies: int, quantities: int
) -> tuple[DecomposedSpectrum, DecomposedSpectrum, FloatArray]:
    """Velocity and elevation of one sea at `count` places, and weights of their products."""
    step = 0.3 / frequencies
    frequency = step * np.arange(frequencies // 8, frequencies // 8 + frequencies)
    wavenumber = (2.0 * np.pi * frequency) ** 2 / 9.81
    places = np.linspace(-45.0, 45.0, count)
    elevation = np.sqrt(pierson_moskowitz(frequency, 8.0, 14.0))[:, None] * np.exp(-1j * np.outer(wavenumber, places))
    velocity = 2.0 * np.pi * frequency[:, None] * elevation * np.exp(-5.0 * wavenumber)[:, None]
    x, y = (DecomposedSpectrum(frequency=frequency, function=part[:, :, None]) for part in (velocity, elevation))
    weights = np.random.default_rng(1).normal(size=(quantities, count))
    return x, y, weights


def _by_matrices(
    x: DecomposedSpectrum, y: DecomposedSpectrum, weights: FloatArray
) -> tuple[FloatArray, ComplexArray, ComplexArray]:
    matrix = quadratic(x.frequency, pairs(columns(x), columns(y), weights))
    return mean(matrix), difference_spectrum(matrix)[1], sum_spectrum(matrix)[1]


def _by_all_pairs(
    x: DecomposedSpectrum, y: DecomposedSpectrum, weights: FloatArray
) -> tuple[FloatArray, ComplexArray, ComplexArray]:
    """All pairs m ≤ n at a time, four transforms each, one transform back: the convolution at its fastest."""
    xx, yy, xy = cross_spectrum(x), cross_spectrum(y), cross_spectrum(x, y)
    low, high = convolved_spectrum(x.frequency, xx, yy, xy, weights)
    step = x.frequency[1] - x.frequency[0]
    return weights @ np.einsum("fmm->m", xy).real * step, low, high


def _pair_by_pair(x: DecomposedSpectrum, y: DecomposedSpectrum, weights: FloatArray) -> tuple[ComplexArray, ...]:
    """One quantity, as the textbook has it: a convolution of two-sided spectra for each pair of elements."""
    step, count = x.frequency[1] - x.frequency[0], len(x.frequency)
    xx, yy, xy = (
        np.moveaxis(part, 0, 2).copy() for part in (cross_spectrum(x), cross_spectrum(y), cross_spectrum(x, y))
    )
    low, high = np.zeros(2 * count - 1, dtype=complex), np.zeros(2 * count - 1, dtype=complex)
    for m, own in enumerate(weights[0]):
        for n, other in enumerate(weights[0]):
            for a, b in ((xx[m, n], yy[m, n]), (xy[m, n], xy[n, m].conj())):
                high += 0.5 * own * other * fftconvolve(a, b)
                low += 0.5 * own * other * fftconvolve(a, b[::-1].conj())
                low += 0.5 * own * other * fftconvolve(b, a[::-1].conj())
    return step * low[count - 1 :], step * high


def _difference(found: ComplexArray, expected: ComplexArray) -> float:
    """Largest, relative to the largest value."""
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def algebra(quick: bool) -> list[Row]:
    rows = []
    repeats = 3 if quick else 9
    with threadpool_limits(limits=1):  # the pair-by-pair loop has one thread as well
        x, y, weights = _elements(ELEMENTS, FREQUENCIES, 1)
        ours, (own_mean, *own) = _timed(lambda: _by_matrices(x, y, weights), repeats)
        pairs, pairwise = _timed(lambda: _pair_by_pair(x, y, weights), 1 if quick else 3)
        fast, (all_mean, *together) = _timed(lambda: _by_all_pairs(x, y, weights), repeats)
        title = f"{ELEMENTS} elements, {FREQUENCIES} frequencies"
        largest = max(
            *(_difference(found[:, 0, 0], expected) for found, expected in zip(own, pairwise, strict=True)),
            *(_difference(found, expected) for found, expected in zip(own, together, strict=True)),
        )
        rows += [
            at_most(f"{title}: bi-spectral matrices against pairwise convolution, spectra", largest, 1e-12),
            at_most(f"{title}: the same, mean", float(np.abs(own_mean / all_mean - 1.0).max()), 1e-12),
            Row(item=f"{title}: time by bi-spectral matrices", measured=f"{1e3 * ours:.1f} ms"),
            at_least(f"{title}: pair-by-pair convolution takes, times as long", pairs / ours, 10.0, form=".0f"),
            Row(item=f"{title}: all pairs by shared transforms, times as long", measured=f"{fast / ours:.1f}"),
        ]
        many = _elements(200, 400, 6)
        ours, (_, *own) = _timed(lambda: _by_matrices(*many), repeats)
        fast, (_, *together) = _timed(lambda: _by_all_pairs(*many), 1)
        largest = max(_difference(found, expected) for found, expected in zip(own, together, strict=True))
        title = "200 elements, 400 frequencies, six components"
        rows += [
            at_most(f"{title}: against pairwise convolution, spectra", largest, 1e-12),
            Row(item=f"{title}: time by bi-spectral matrices", measured=f"{1e3 * ours:.0f} ms"),
            Row(item=f"{title}: all pairs by shared transforms, times as long", measured=f"{fast / ours:.1f}"),
        ]
    return rows


if __name__ == "__main__":
    main("Algebra of decomposed spectra", [algebra])
