"""Decompositions give back the cross-spectra, whatever the rank, the units and the method."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.spectral.decomposition import (
    DecomposedSpectrum,
    beside,
    covariance,
    cross_spectrum,
    decompose,
)

METHODS = ("cholesky", "eigen", "pivoted")


def random_columns(seed, frequencies, rows, sources):
    rng = np.random.default_rng(seed)
    shape = (frequencies, rows, sources)
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


def of_columns(function, first=0.0):
    return DecomposedSpectrum(frequency=first + 0.1 * np.arange(len(function)), function=function)


def coherent_field(frequency, places, decay):
    """White unit spectra with coherence exp(-decay f distance): of rank one at zero frequency."""
    distance = np.abs(places[:, None] - places)
    return np.exp(-decay * frequency[:, None, None] * distance).astype(complex)


@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    rows=st.integers(1, 6),
    sources=st.integers(1, 6),
    decades=st.integers(0, 9),
    silent=st.booleans(),
)
def test_cross_spectra_come_back(method, seed, rows, sources, decades, silent):
    function = random_columns(seed, 4, rows, sources)
    function *= np.logspace(0, -decades, rows)[:, None]  # rows of units far apart
    if silent:
        function[0] = 0.0
        function[:, -1] = 0.0
    spectrum = cross_spectrum(of_columns(function))
    found = decompose(0.1 * np.arange(4), spectrum, method)
    error = np.abs(cross_spectrum(found) - spectrum)
    power = np.einsum("fii->fi", spectrum).real
    # eigen treats the rows as being of one unit; the others are right relative to each row
    scale = np.sqrt(power[:, :, None] * power[:, None, :])
    allowed = np.max(power) if method == "eigen" else scale + 1e-12 * np.max(scale, axis=0)
    assert np.all(error <= 2e-11 * allowed)
    if method == "pivoted":
        active = rows - silent
        assert found.function.shape[2] == max(min(active, sources), 1)


def test_cholesky_is_lower_triangular_and_the_usual_one_where_regular():
    function = random_columns(3, 5, 4, 4)
    spectrum = cross_spectrum(of_columns(function))
    found = decompose(0.1 * np.arange(5), spectrum).function
    assert np.array_equal(found, np.tril(found))
    assert found == pytest.approx(np.linalg.cholesky(spectrum), rel=1e-9, abs=1e-9)


def test_cholesky_is_continuous_into_full_coherence():
    # Closed form for three places a distance d apart on a line, where the field is Markov: the first column holds
    # the coherences c with the first place, the second has the innovation √(1 - c²) of the step, here c = exp(-f d).
    frequency = np.array([0.0, 1e-8, 1e-6, 1e-4, 1e-2, 1.0])
    found = decompose(frequency, coherent_field(frequency, np.arange(3.0), 1.0)).function
    step = np.exp(-frequency)
    innovation = np.sqrt(1.0 - step**2)
    expected = np.zeros((len(frequency), 3, 3))
    expected[:, :, 0] = step[:, None] ** np.arange(3)
    expected[:, 1:, 1] = innovation[:, None] * step[:, None] ** np.arange(2)
    expected[:, 2, 2] = innovation
    # the tiny diagonal, some 1e-13, shows as its root where a column vanishes
    assert np.abs(found - expected).max() < 2e-6


def test_pivoted_takes_as_many_columns_as_the_rank_and_keeps_the_order_of_rows():
    frequency = np.linspace(0.0, 1.0, 11)
    function = np.stack([np.diag([1.0, 3.0, 2.0])[:, 1:]] * 11).astype(complex)  # the first row has no power
    found = decompose(frequency, cross_spectrum(DecomposedSpectrum(frequency=frequency, function=function)), "pivoted")
    assert found.function.shape == (11, 3, 2)
    assert np.abs(found.function[:, 0]).max() == 0.0
    assert np.abs(found.function[0]).sum(axis=1) == pytest.approx([0.0, 3.0, 2.0])

    field = coherent_field(frequency[:1], np.arange(3.0), 1.0)  # at zero frequency alone: one source
    assert decompose(frequency[:1], field, "pivoted").function.shape == (1, 3, 1)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), energy=st.floats(0.05, 0.999))
def test_eigen_keeps_the_energy_by_the_fewest_columns(seed, energy):
    frequency = np.array([0.0, 0.1, 0.4, 0.5])
    function = random_columns(seed, 4, 6, 6) * np.logspace(0, -2, 6)[:, None]
    given_spectrum = DecomposedSpectrum(frequency=frequency, function=function)
    found = decompose(frequency, cross_spectrum(given_spectrum), "eigen", energy)
    whole = np.trace(covariance(given_spectrum))
    kept = np.trace(covariance(found))
    without_last = DecomposedSpectrum(frequency=frequency, function=found.function[:, :, :-1])
    assert kept >= energy * whole * (1.0 - 1e-12)
    assert np.trace(covariance(without_last)) < energy * whole
    # no other decomposition of as many columns has more energy: Cholesky's first columns, for one
    same_count = decompose(frequency, cross_spectrum(given_spectrum)).function[:, :, : found.function.shape[2]]
    assert np.trace(covariance(DecomposedSpectrum(frequency=frequency, function=same_count))) <= kept * (1.0 + 1e-12)


def test_eigen_leaves_columns_of_rounding_out():
    spectrum = cross_spectrum(of_columns(random_columns(5, 6, 7, 2)))
    assert decompose(0.1 * np.arange(6), spectrum, "eigen").function.shape == (6, 7, 2)


def test_covariance_of_a_sinusoid_of_random_phase():
    # S(f) = f at uneven frequencies is a straight line, which trapezoids integrate exactly; a quarter period between
    # two processes leaves no covariance, a sixth leaves half.
    frequency = np.array([0.0, 0.1, 0.15, 0.7, 1.3, 2.0])
    phase = np.exp(1j * np.radians([0.0, 90.0, 60.0]))
    x = DecomposedSpectrum(frequency=frequency, function=np.sqrt(frequency)[:, None, None] * phase[:, None])
    expected = 2.0 * np.cos(np.radians([[0, 90, 60], [90, 0, 30], [60, 30, 0]]))
    assert covariance(x) == pytest.approx(expected, abs=1e-14)
    assert covariance(x.rows([1]), x.rows([0, 2])) == pytest.approx(expected[1:2, [0, 2]], abs=1e-14)


def test_covariance_against_a_record_in_time():
    # One period of a periodic Gaussian record by FFT, all amplitudes of E|ξ|² = 2 and its mean square over realizations
    frequency = 0.25 * np.arange(9)
    function = random_columns(11, 9, 2, 3)
    function[:, 1] += function[:, 0]
    function[[0, -1]] = 0.0
    x = DecomposedSpectrum(frequency=frequency, function=function)
    rng = np.random.default_rng(12)
    xi = rng.normal(size=(40000, 9, 3)) + 1j * rng.normal(size=(40000, 9, 3))
    amplitude = np.einsum("fns,kfs->kfn", function, xi) * np.sqrt(0.25)
    record = np.fft.irfft(amplitude * 16.0, 32, axis=1)  # Re Σ a e^{i2πft}
    sampled = np.einsum("ktn,ktm->nm", record, record) / (40000 * 32)
    expected = covariance(x)
    # each of 40000 records has the variance of a sum of some 20 exponentials: 1 / √(20 · 40000), taken 5 times
    assert np.abs(sampled - expected).max() < 6e-3 * np.trace(expected)
    assert np.abs(expected[0, 1]) > 0.1 * np.trace(expected)  # so that the cross term is tested too


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), outputs=st.integers(1, 4), sources=st.integers(1, 3))
def test_a_linear_system_acts_on_both_sides_of_the_spectrum(seed, outputs, sources):
    x = of_columns(random_columns(seed, 5, 3, sources))
    transfer = random_columns(seed + 1, 5, outputs, 3)
    y = x.through(transfer)
    s_xx = cross_spectrum(x)
    assert cross_spectrum(y) == pytest.approx(transfer @ s_xx @ transfer.conj().swapaxes(1, 2), abs=1e-11)
    assert cross_spectrum(y, x) == pytest.approx(transfer @ s_xx, abs=1e-11)


def test_the_derivative_of_a_process_is_uncorrelated_with_it():
    # S = 1 from 0 to F: the variance of the derivative is (2π)² F³ / 3
    frequency = np.linspace(0.0, 2.0, 4001)
    x = DecomposedSpectrum(frequency=frequency, function=np.ones((4001, 1, 1), dtype=complex))
    rate = x.through(2j * np.pi * frequency[:, None, None])
    assert covariance(rate)[0, 0] == pytest.approx((2.0 * np.pi) ** 2 * 8.0 / 3.0, rel=1e-6)
    assert covariance(x, rate)[0, 0] == 0.0


def test_independent_sources_add_their_spectra():
    a, b = (of_columns(random_columns(seed, 5, 3, sources)) for seed, sources in ((1, 2), (2, 4)))
    both = beside(a, b)
    assert both.function.shape == (5, 3, 6)
    assert cross_spectrum(both) == pytest.approx(cross_spectrum(a) + cross_spectrum(b), abs=1e-12)


def test_refusals_name_the_frequency_and_the_eigenvalue():
    frequency = np.array([0.0, 0.25, 0.5])
    spectrum = np.stack([np.eye(3, dtype=complex)] * 3)
    spectrum[1] = np.ones((3, 3))
    spectrum[1, 0, 2] = spectrum[1, 2, 0] = -0.5  # eigenvalues of determinant -2.25
    lowest = np.linalg.eigvalsh(spectrum[1])[0]
    for method in METHODS:
        with pytest.raises(ScenarioError, match=rf"at 0.25 Hz is not positive .* {lowest:.3g} ".replace("-", r"\-")):
            decompose(frequency, spectrum, method)
    skew = np.stack([np.eye(3, dtype=complex)] * 3)
    skew[2, 0, 1] = 0.1j
    skew[2, 1, 0] = 0.1j
    for method in METHODS:
        with pytest.raises(ScenarioError, match=r"at 0.5 Hz is not Hermitian: .* up to 0.2 "):
            decompose(frequency, skew, method)


@pytest.mark.parametrize("method", METHODS)
def test_rows_without_power_must_have_no_cross_spectra(method):
    spectrum = np.array([[[0.0, 0.3], [0.3, 0.0]]], dtype=complex)
    with pytest.raises(ScenarioError, match=r"lowest eigenvalue is -0.3 "):
        decompose(np.array([0.1]), spectrum, method)
    negative = np.array([np.diag([1.0, -0.5])], dtype=complex)
    with pytest.raises(ScenarioError, match=r"lowest eigenvalue is -0.5 "):
        decompose(np.array([0.1]), negative, method)


@pytest.mark.parametrize("method", METHODS)
def test_rounding_is_not_taken_for_indefinite(method):
    function = random_columns(7, 3, 5, 1)
    spectrum = cross_spectrum(of_columns(function))
    rng = np.random.default_rng(8)
    noise = 1e-12 * rng.normal(size=spectrum.shape)
    noisy = spectrum + noise + noise.swapaxes(1, 2)
    found = cross_spectrum(decompose(0.1 * np.arange(3), noisy, method))
    assert np.abs(found - spectrum).max() < 1e-9 * np.abs(spectrum).max()  # of the weakest row the noise is 1e-10


def test_other_refusals():
    frequency = np.array([0.0, 0.1])
    one = np.ones((2, 1, 1), dtype=complex)
    with pytest.raises(ScenarioError, match="did you mean 'cholesky'"):
        decompose(frequency, one, "choleski")
    with pytest.raises(ScenarioError, match=r"energy .* is 0.9; it must be"):
        decompose(frequency, one, "pivoted", 0.9)
    with pytest.raises(ScenarioError, match=r"energy .* is 0.0; it must be"):
        decompose(frequency, one, "eigen", 0.0)
    with pytest.raises(ScenarioError, match=r"at 0.1 Hz is not finite"):
        decompose(frequency, np.array([[[1.0]], [[np.nan]]]))
    with pytest.raises(ScenarioError, match=r"has the shape \(2, 1, 2\)"):
        decompose(frequency, np.ones((2, 1, 2), dtype=complex))
    with pytest.raises(ScenarioError, match="must be finite, not negative and increasing"):
        decompose(frequency[::-1], one)
    x = DecomposedSpectrum(frequency=frequency, function=one)
    with pytest.raises(ScenarioError, match="the same frequencies and sources"):
        covariance(x, DecomposedSpectrum(frequency=frequency, function=np.ones((2, 1, 2), dtype=complex)))
    with pytest.raises(ScenarioError, match="the same frequencies and processes"):
        beside(x, DecomposedSpectrum(frequency=2.0 * frequency, function=one))
    with pytest.raises(ScenarioError, match=r"must be \(2, outputs, 1\)"):
        x.through(np.ones((2, 1, 3), dtype=complex))
