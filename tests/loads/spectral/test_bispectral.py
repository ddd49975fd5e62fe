"""Bi-spectral matrices against the moments of Gaussian products, realizations, and the convolution of cross-spectra."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.spectral.bispectral import (
    BispectralMatrix,
    add,
    columns,
    convolved_spectrum,
    difference_spectrum,
    interval,
    mean,
    quadratic,
    sum_spectrum,
)
from tlpsim.loads.spectral.decomposition import DecomposedSpectrum, covariance, cross_spectrum
from tlpsim.loads.spectral.products import pairs

STEP = 0.02  # Hz


def random_columns(rng, *shape):
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


class Case:
    """Random factors of M products, and the bi-spectral matrices of q sums of them."""

    def __init__(self, seed, first=3, count=7, products=3, sources=2, quantities=2):
        rng = np.random.default_rng(seed)
        self.first = first
        self.frequency = STEP * (first + np.arange(count))
        self.x, self.y = (
            DecomposedSpectrum(frequency=self.frequency, function=random_columns(rng, count, products, sources))
            for _ in range(2)
        )
        self.weights = rng.normal(size=(quantities, products))
        self.matrix = quadratic(self.frequency, pairs(columns(self.x), columns(self.y), self.weights))


cases = st.builds(
    Case,
    seed=st.integers(0, 2**32 - 1),
    first=st.integers(0, 9),
    count=st.integers(2, 9),
    products=st.integers(1, 4),
    sources=st.integers(1, 3),
    quantities=st.integers(1, 3),
)


def on_one_grid(case):
    """Both spectra at 0, Δ, 2 Δ ..."""
    count = len(case.frequency)
    both = np.zeros((2 * (case.first + count) - 1, *case.weights.shape[:1] * 2), dtype=complex)
    both[:count] += difference_spectrum(case.matrix)[1]
    both[2 * case.first :] += sum_spectrum(case.matrix)[1]
    if case.first == 0:
        both[0] += sum_spectrum(case.matrix)[1][0].conj()  # zero and zero: +0 and -0 are one frequency
    return both


def lagged(spectrum, first, length):
    """∫ Re(S e^{i2πfτ}) df as a sum, at lags of one period 1 / Δ over `length`."""
    at = np.arange(length) / (length * STEP)
    frequency = STEP * (first + np.arange(len(spectrum)))
    return STEP * np.einsum("fij,ft->tij", spectrum, np.exp(2j * np.pi * np.outer(frequency, at))).real


@settings(max_examples=60, deadline=None)
@given(case=cases)
def test_both_spectra_are_those_of_a_product_of_gaussian_processes(case):
    # Isserlis: Cov(x_m y_m (t+τ), x_n y_n (t)) = R_xx R_yy + R_xy R_yx; its transform is the two-sided spectrum.
    # A frequency of zero counts in full on both sides of the identity, as a complex amplitude.
    length = 8 * (case.first + len(case.frequency))
    xx, yy = (lagged(cross_spectrum(a), case.first, length) for a in (case.x, case.y))
    xy = lagged(cross_spectrum(case.x, case.y), case.first, length)
    yx = lagged(cross_spectrum(case.y, case.x), case.first, length)
    expected = case.weights @ (xx * yy + xy * yx) @ case.weights.T
    two_sided = np.fft.fft(expected, axis=0) / (length * STEP)
    found = on_one_grid(case)
    assert np.abs(found - 2.0 * two_sided[: len(found)]).max() <= 1e-12 * np.abs(found).max()
    assert np.abs(two_sided[len(found) : -len(found)]).max() <= 1e-12 * np.abs(found).max()


@settings(max_examples=60, deadline=None)
@given(case=cases)
def test_a_realization_is_that_of_its_factors(case):
    # Σ w x y at some instant by amplitudes of x and y, and by the matrices: holds their phases, not moduli alone.
    rng = np.random.default_rng(1)
    xi = random_columns(rng, case.x.function.shape[2], len(case.frequency))
    time = 1.7
    turning = xi * np.exp(2j * np.pi * case.frequency * time) * np.sqrt(STEP)
    x, y = (np.einsum("fms,sf->m", a.function, turning).real for a in (case.x, case.y))
    expected = case.weights @ (x * y)
    turning = turning.ravel()
    found = 0.5 * ((case.matrix.difference @ turning.conj()) @ turning + (case.matrix.total @ turning) @ turning)
    size = np.abs(case.weights) @ (np.abs(x) * np.abs(y)) + np.abs(expected) + np.abs(found)
    assert np.all(np.abs(found.real - expected) <= 1e-10 * size + 1e-9)
    slow = (case.matrix.difference @ turning.conj()) @ turning
    assert np.all(np.abs(slow.imag) <= 1e-10 * (1.0 + np.abs(slow)))


@settings(max_examples=60, deadline=None)
@given(case=cases)
def test_means_are_covariances_and_matrices_symmetric(case):
    # a rectangle rule is the trapezoidal one once zeros are put beside the band
    silent = [
        DecomposedSpectrum(
            frequency=STEP * (case.first + 1 + np.arange(-1, len(case.frequency) + 1)),
            function=np.pad(a.function, ((1, 1), (0, 0), (0, 0))),
        )
        for a in (case.x, case.y)
    ]
    expected = case.weights @ np.diag(covariance(*silent))
    assert mean(case.matrix) == pytest.approx(expected, rel=1e-11, abs=1e-12)
    assert case.matrix.difference == pytest.approx(case.matrix.difference.conj().swapaxes(1, 2), abs=1e-13)
    assert case.matrix.total == pytest.approx(case.matrix.total.swapaxes(1, 2), abs=1e-13)


@settings(max_examples=60, deadline=None)
@given(case=cases)
def test_spectra_are_sums_over_diagonals(case):
    count, sources = len(case.frequency), case.matrix.sources
    shape = (len(case.weights), sources, count, sources, count)
    low, high = case.matrix.difference.reshape(shape), case.matrix.total.reshape(shape)
    slow, fast = np.zeros((count, *shape[:1] * 2), complex), np.zeros((2 * count - 1, *shape[:1] * 2), complex)
    for a in range(count):
        for b in range(count):
            if a >= b:
                slow[a - b] += 2.0 * STEP * np.einsum("ipq,jpq->ij", low[:, :, a, :, b], low[:, :, a, :, b].conj())
            fast[a + b] += STEP * np.einsum("ipq,jpq->ij", high[:, :, a, :, b], high[:, :, a, :, b].conj())
    differences, found_slow = difference_spectrum(case.matrix)
    sums, found_fast = sum_spectrum(case.matrix)
    assert found_slow == pytest.approx(slow, rel=1e-11, abs=1e-11)
    assert found_fast == pytest.approx(fast, rel=1e-11, abs=1e-11)
    assert differences == pytest.approx(STEP * np.arange(count))
    assert sums == pytest.approx(STEP * (2 * case.first + np.arange(2 * count - 1)))


@settings(max_examples=60, deadline=None)
@given(case=cases)
def test_the_conventional_convolution_gives_the_same(case):
    slow, fast = convolved_spectrum(
        case.frequency,
        cross_spectrum(case.x),
        cross_spectrum(case.y),
        cross_spectrum(case.x, case.y),
        case.weights,
    )
    for found, expected in ((difference_spectrum(case.matrix)[1], slow), (sum_spectrum(case.matrix)[1], fast)):
        assert np.abs(found - expected).max() <= 1e-12 * np.abs(expected).max()


def test_the_square_of_band_limited_white_noise():
    # S = 1 in a band of n Δ: z = x² has S = 2 (n - k) Δ at k Δ, and a triangle of the same variance at sums.
    count = 40
    frequency = STEP * (100 + np.arange(count))
    one = np.ones((1, count), dtype=complex)
    square = quadratic(frequency, pairs(one, one, np.ones((1, 1))))
    variance = count * STEP
    differences, slow = difference_spectrum(square)
    sums, fast = sum_spectrum(square)
    assert mean(square) == pytest.approx([variance])
    assert slow[:, 0, 0].real == pytest.approx(2.0 * (variance - differences))
    assert fast[:, 0, 0].real == pytest.approx(variance - np.abs(sums - sums[count - 1]))
    # half of the variance of x², 2 σ⁴, is at either
    assert STEP * (slow.sum() - 0.5 * slow[0, 0, 0]).real == pytest.approx(variance**2)
    assert STEP * fast.sum().real == pytest.approx(variance**2)


def test_the_same_factor_twice_needs_no_second_array():
    case = Case(4)
    x = columns(case.x)
    once, twice = (quadratic(case.frequency, pairs(x, other, case.weights)) for other in (x, x.copy()))
    assert once.difference == pytest.approx(twice.difference, abs=1e-13)
    assert once.total == pytest.approx(twice.total, abs=1e-13)


def test_no_products_leave_nothing():
    nothing = np.zeros((0, 14), dtype=complex)
    empty = quadratic(STEP * np.arange(7), pairs(nothing, nothing, np.zeros((3, 0))))
    assert np.array_equal(mean(empty), np.zeros(3))


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_unitary_turn_of_the_sources_changes_nothing(seed):
    case = Case(seed)
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(random_columns(rng, len(case.frequency), 2, 2))[0]
    turned = [columns(DecomposedSpectrum(frequency=a.frequency, function=a.function @ turn)) for a in (case.x, case.y)]
    other = quadratic(case.frequency, pairs(*turned, case.weights))
    assert np.abs(case.matrix.difference - other.difference).max() > 1e-3
    assert mean(other) == pytest.approx(mean(case.matrix), rel=1e-11, abs=1e-12)
    for spectrum in (difference_spectrum, sum_spectrum):
        expected = spectrum(case.matrix)[1]
        assert np.abs(spectrum(other)[1] - expected).max() <= 1e-12 * np.abs(expected).max()


@settings(max_examples=60, deadline=None)
@given(case=cases, outputs=st.integers(1, 3))
def test_a_linear_system_acts_on_matrices_as_on_spectra(case, outputs):
    rng = np.random.default_rng(2)
    b, quantities = case.matrix, len(case.weights)
    at_difference = random_columns(rng, len(b.difference_frequency), outputs, quantities)
    at_difference[0] = at_difference[0].real
    at_total = random_columns(rng, len(b.total_frequency), outputs, quantities)
    response = b.through(at_difference, at_total)
    assert mean(response) == pytest.approx(at_difference[0].real @ mean(b), rel=1e-11, abs=1e-11)
    assert response.difference == pytest.approx(response.difference.conj().swapaxes(1, 2), abs=1e-12)
    assert response.total == pytest.approx(response.total.swapaxes(1, 2), abs=1e-12)
    for spectrum, transfer in ((difference_spectrum, at_difference), (sum_spectrum, at_total)):
        expected = transfer @ spectrum(b)[1] @ transfer.conj().swapaxes(1, 2)
        assert np.abs(spectrum(response)[1] - expected).max() <= 1e-12 * np.abs(expected).max()


def test_a_delay_of_both_factors_is_a_delay_of_the_product():
    # x(t - s) y(t - s) = z(t - s): a phase of the factors at f₁, f₂ is that of the system at f₁ ∓ f₂
    case = Case(9)
    delay = 3.1
    late = np.exp(-2j * np.pi * case.frequency * delay)[:, None, None] * np.eye(3)
    factors = (columns(a.through(late)) for a in (case.x, case.y))
    expected = quadratic(case.frequency, pairs(*factors, case.weights))
    phases = [
        np.exp(-2j * np.pi * frequency * delay)[:, None, None] * np.eye(2)
        for frequency in (case.matrix.difference_frequency, case.matrix.total_frequency)
    ]
    found = case.matrix.through(*phases)
    assert found.difference == pytest.approx(expected.difference, abs=1e-12)
    assert found.total == pytest.approx(expected.total, abs=1e-12)


def test_matrices_of_coherent_quantities_add():
    case = Case(6)
    x, y = columns(case.x), columns(case.y)
    parts = [quadratic(case.frequency, pairs(x[m : m + 1], y[m : m + 1], case.weights[:, m : m + 1])) for m in range(3)]
    found = add(add(parts[0], parts[1]), parts[2])
    assert found.difference == pytest.approx(case.matrix.difference, abs=1e-13)
    assert found.total == pytest.approx(case.matrix.total, abs=1e-13)


@pytest.mark.parametrize(
    "frequency",
    [
        np.array([0.1]),
        np.array([0.1, 0.1]),
        np.array([0.0, 0.1, 0.3]),
        np.array([0.05, 0.15, 0.25]),
        np.array([0.3, 0.2, 0.1]),
        np.array([-0.1, 0.0, 0.1]),
    ],
)
def test_frequencies_whose_differences_and_sums_fall_off_the_grid_are_refused(frequency):
    with pytest.raises(ScenarioError, match="whole multiple of their interval"):
        interval(frequency)


def test_refusals():
    case = Case(3)
    x, y = columns(case.x), columns(case.y)
    with pytest.raises(ScenarioError, match=r"must be \(G, N\), \(M,\), \(M,\) and \(q, M\)"):
        quadratic(case.frequency, pairs(x, y[:2], case.weights))
    with pytest.raises(ScenarioError, match="a multiple of the 7 frequencies"):
        quadratic(case.frequency, pairs(x[:, 1:], y[:, 1:], case.weights))
    with pytest.raises(ScenarioError, match="a multiple of the 7 frequencies"):
        BispectralMatrix(frequency=case.frequency, difference=case.matrix.difference, total=case.matrix.total[:1])
    with pytest.raises(ScenarioError, match="cannot be added"):
        add(case.matrix, Case(3, quantities=1).matrix)
    with pytest.raises(ScenarioError, match=r"at total frequencies .* \(13, outputs, 2\)"):
        case.matrix.through(np.ones((7, 1, 2), dtype=complex), np.ones((14, 1, 2), dtype=complex))
