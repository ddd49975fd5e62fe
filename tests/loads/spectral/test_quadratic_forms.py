"""Spectra by covariance functions against bi-spectral matrices, which never leave the frequency domain."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.spectral.bispectral import columns, difference_spectrum, quadratic, sum_spectrum
from tlpsim.loads.spectral.decomposition import DecomposedSpectrum, beside, cross_spectrum
from tlpsim.loads.spectral.products import pairs
from tlpsim.loads.spectral.quadratic_forms import product_spectrum, square_spectrum

STEP = 0.05  # Hz


def decomposed(rng, count, size, sources):
    function = rng.normal(size=(count, size, sources)) + 1j * rng.normal(size=(count, size, sources))
    function[0] = function[0].real
    return DecomposedSpectrum(frequency=STEP * np.arange(count), function=function)


def by_matrices(g, h, forms):
    """Spectra 0 ... 2 (n - 1) Δ of Σ_ab A_i,ab g_a h_b of processes of the same sources."""
    half = np.ones((len(g.frequency), 1, 1))
    half[0] = np.sqrt(0.5)  # the trapezoidal rule
    g, h = (columns(DecomposedSpectrum(frequency=a.frequency, function=a.function * half)) for a in (g, h))
    matrix = quadratic(
        STEP * np.arange(len(half)),
        pairs(np.repeat(g, len(h), axis=0), np.tile(h, (len(g), 1)), forms.reshape(len(forms), -1)),
    )
    spectrum = sum_spectrum(matrix)[1]
    spectrum[0] *= 2.0  # zero and zero: +0 and -0 are one frequency
    spectrum[: len(half)] += difference_spectrum(matrix)[1]
    return spectrum


sizes = {
    "seed": st.integers(0, 2**32 - 1),
    "count": st.integers(2, 9),
    "size": st.integers(1, 4),
    "quantities": st.integers(1, 3),
}


def agree(found, expected):
    return np.abs(found - expected).max() <= 1e-12 * np.abs(expected).max()


@settings(max_examples=60, deadline=None)
@given(**sizes)
def test_one_process(seed, count, size, quantities):
    rng = np.random.default_rng(seed)
    g = decomposed(rng, count, size, 2)
    forms = rng.normal(size=(quantities, size, size))
    found = product_spectrum(g.frequency, cross_spectrum(g), forms, points=2 * count - 1)
    assert found.shape == (2 * count - 1, quantities, quantities)
    assert agree(found, by_matrices(g, g, forms))


@settings(max_examples=60, deadline=None)
@given(other=st.integers(1, 3), **sizes)
def test_two_independent_processes(seed, count, size, other, quantities):
    rng = np.random.default_rng(seed)
    g, h = decomposed(rng, count, size, 2), decomposed(rng, count, other, 3)
    forms = rng.normal(size=(quantities, size, other))
    found = product_spectrum(g.frequency, cross_spectrum(g), forms, cross_spectrum(h), points=2 * count - 1)
    silent = [  # for the sources of g first, then those of h, in both
        DecomposedSpectrum(frequency=g.frequency, function=np.zeros((count, rows, sources), dtype=complex))
        for rows, sources in ((size, 3), (other, 2))
    ]
    assert agree(found, by_matrices(beside(g, silent[0]), beside(silent[1], h), forms))


@settings(max_examples=60, deadline=None)
@given(**sizes)
def test_squares(seed, count, size, quantities):
    rng = np.random.default_rng(seed)
    g = cross_spectrum(decomposed(rng, count, size, 2))
    weights = rng.normal(size=(quantities, size))
    forms = weights[:, :, None] * np.eye(size)
    frequency = STEP * np.arange(count)
    assert agree(square_spectrum(frequency, g, weights), product_spectrum(frequency, g, forms))


@settings(max_examples=60, deadline=None)
@given(points=st.integers(1, 13))
def test_fewer_points_are_the_first_of_all(points):
    rng = np.random.default_rng(0)
    g = decomposed(rng, 7, 3, 2)
    forms = rng.normal(size=(2, 3, 3))
    whole = product_spectrum(g.frequency, cross_spectrum(g), forms, points=13)
    assert product_spectrum(g.frequency, cross_spectrum(g), forms).shape == (7, 2, 2)
    found = product_spectrum(g.frequency, cross_spectrum(g), forms, points=points)
    assert np.abs(found - whole[:points]).max() <= 1e-12 * np.abs(whole).max()


def test_white_noise_up_to_a_frequency():
    # S = 1 up to F is ½ on both sides; twice its convolution with itself is a triangle of height F, one-sided 2 F
    count = 2001
    frequency = np.linspace(0.0, 4.0, count)
    one = np.ones((count, 1, 1), dtype=complex)
    found = product_spectrum(frequency, one, np.ones((1, 1, 1)), points=2 * count - 1)[:, 0, 0]
    at = np.linspace(0.0, 8.0, 2 * count - 1)
    assert np.abs(found - 2.0 * (1.0 - at / 8.0) * 4.0).max() < 3e-3  # of 8; the step is 2e-3 Hz
    variance = np.trapezoid(found.real, at)
    assert variance == pytest.approx(2.0 * 4.0**2, rel=1e-3)


def test_moments_of_sampled_gaussian_vectors():
    # The integral of the spectra is the covariance of forms: 2 tr(A R B R), here sampled.
    rng = np.random.default_rng(3)
    g = decomposed(rng, 9, 3, 3)
    forms = rng.normal(size=(2, 3, 3))
    spectrum = product_spectrum(g.frequency, cross_spectrum(g), forms, points=17)
    weights = np.r_[0.5, np.ones(16)] * STEP  # the last frequencies count in full: nothing lies past them
    covariance = np.einsum("f,fij->ij", weights[:9], cross_spectrum(g)).real
    sample = rng.multivariate_normal(np.zeros(3), covariance, size=400_000)
    z = np.einsum("ka,iab,kb->ki", sample, forms, sample)
    found = np.einsum("f,fij->ij", weights, spectrum).real
    # a form of Gaussian variables has a kurtosis of 15 at most: 5 √(14 / 400000) of the variances
    size = np.sqrt(np.outer(np.diag(found), np.diag(found)))
    assert np.all(np.abs(np.cov(z.T) - found) < 0.03 * size)


def test_refusals():
    frequency = STEP * np.arange(5)
    one = np.ones((5, 1, 1), dtype=complex)
    form = np.ones((1, 1, 1))
    with pytest.raises(ScenarioError, match=r"from 0\.05 Hz; they must be"):
        product_spectrum(frequency + STEP, one, form)
    with pytest.raises(ScenarioError, match=r"they must be \[\(5, 2, 2\), \(5, 2, 2\)\]"):
        product_spectrum(frequency, one, np.ones((1, 2, 2)))
    with pytest.raises(ScenarioError, match=r"they must be \[\(5, 1, 1\), \(5, 2, 2\)\]"):
        product_spectrum(frequency, one, np.ones((1, 1, 2)), one)
    for points in (0, 10):
        with pytest.raises(ScenarioError, match=f"are {points}; they must be from 1 to 9"):
            product_spectrum(frequency, one, form, points=points)
