"""Rates and extremes against closed forms, known distributions, published fits and simulation."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal, stats

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.spectral.cumulants import QuadraticForm, cumulants
from tlpsim.loads.spectral.extremes import (
    Extremes,
    crossing_rate,
    expected_extremes,
    hermite_coefficients,
    hermite_model,
    hermite_transform,
    peak_rate,
    spectral_moments,
    spectral_width,
    vanmarcke_bandwidth,
    zero_crossing_rate,
)
from tlpsim.loads.spectral.records import Quantity
from tlpsim.loads.waves.spectra import pierson_moskowitz

FREQUENCY = np.linspace(0.0, 0.5, 5001)
DURATION = 10800.0


def oscillator(damping: float, natural: float = 0.05) -> np.ndarray:
    """Spectrum of unit variance of an oscillator in white noise, cut off at five natural frequencies."""
    ratio = FREQUENCY / natural
    density = np.exp(-((ratio / 5.0) ** 8)) / ((1.0 - ratio**2) ** 2 + (2.0 * damping * ratio) ** 2)
    return np.asarray(density / np.trapezoid(density, FREQUENCY))


def simulate(density: np.ndarray, shape: tuple[int, ...], step: float, seed: int) -> np.ndarray:
    """Gaussian records of DURATION, shape + (samples,)."""
    count = round(DURATION / step)
    frequency = np.fft.rfftfreq(count, step)
    normal = np.random.default_rng(seed).standard_normal((*shape, len(frequency), 2))
    amplitude = np.sqrt(np.interp(frequency, FREQUENCY, density, right=0.0) / DURATION)
    return np.fft.irfft((normal @ [1.0, 1j]) * amplitude * count / 2.0, n=count)


def gaussian(density: np.ndarray, duration: float = DURATION, clumping: bool = True) -> Extremes:
    return expected_extremes(0.0, FREQUENCY, density, 0.0, 0.0, duration, clumping=clumping)


def test_moments_and_rates_of_a_flat_spectrum_in_closed_form() -> None:
    """From 0 to F: m_k = F^(k+1) / (k+1). The trapezoidal rule errs by k / 12 (df / F)^2 (k + 1) at most."""
    density = np.full(5001, 3.0)
    moments = spectral_moments(FREQUENCY, density, (0, 1, 2, 4))
    np.testing.assert_allclose(moments, [3.0 * 0.5 ** (k + 1) / (k + 1) for k in (0, 1, 2, 4)], rtol=1e-7)
    assert zero_crossing_rate(FREQUENCY, density) == pytest.approx(0.5 / math.sqrt(3.0), rel=1e-7)
    assert peak_rate(FREQUENCY, density) == pytest.approx(0.5 * math.sqrt(0.6), rel=1e-7)
    assert vanmarcke_bandwidth(FREQUENCY, density) == pytest.approx(0.5, rel=1e-6)
    assert spectral_width(FREQUENCY, density) == pytest.approx(2.0 / 3.0, rel=1e-6)


def test_a_narrow_band_crosses_and_peaks_at_its_frequency() -> None:
    density = np.exp(-0.5 * ((FREQUENCY - 0.1) / 1e-3) ** 2)
    assert zero_crossing_rate(FREQUENCY, density) == pytest.approx(0.1, rel=1e-4)
    assert peak_rate(FREQUENCY, density) == pytest.approx(0.1, rel=3e-4)
    # Variation 0.01 of f and, to first order, twice as much of f².
    assert vanmarcke_bandwidth(FREQUENCY, density) == pytest.approx(0.01, rel=1e-3)
    assert spectral_width(FREQUENCY, density) == pytest.approx(0.02, rel=1e-3)


def test_zero_crossings_of_a_pierson_moskowitz_sea() -> None:
    """Tz / Tp = (1.25 pi)^(-1/4), within what lies beyond 40 / Tp, 5e-4."""
    frequency = np.linspace(0.0, 4.0, 40_001)
    rate = zero_crossing_rate(frequency, pierson_moskowitz(frequency, 8.0, 10.0))
    assert 1.0 / rate / 10.0 == pytest.approx((1.25 * math.pi) ** -0.25, rel=5e-4)


def test_width_of_light_damping() -> None:
    """Vanmarcke's 2 √(damping / pi) of an oscillator in white noise, to first order."""
    assert vanmarcke_bandwidth(FREQUENCY, oscillator(0.005)) == pytest.approx(2.0 * math.sqrt(0.005 / math.pi), rel=0.1)


def test_rice_rate_is_that_of_counted_crossings() -> None:
    """Of 40 records of three hours; at 2 standard deviations some 2900 crossings, 4 % being over two errors."""
    density = 4.0 * oscillator(0.2)
    record = simulate(density, (40,), 1.0, 5)
    for level, tolerance in ((0.0, 0.01), (2.0, 0.02), (4.0, 0.06)):
        counted = np.count_nonzero((record[:, :-1] < level) & (record[:, 1:] >= level)) / (40 * DURATION)
        assert counted == pytest.approx(crossing_rate(FREQUENCY, density, level), rel=tolerance)
    rate = zero_crossing_rate(FREQUENCY, density)
    assert crossing_rate(FREQUENCY, density, -4.0) == pytest.approx(rate * math.exp(-2.0))


def test_a_spectrum_of_zero_has_no_crossings_and_the_mean_for_extremes() -> None:
    nothing = np.zeros(5001)
    for rate in (zero_crossing_rate, peak_rate, vanmarcke_bandwidth, spectral_width):
        assert rate(FREQUENCY, nothing) == 0.0
    assert crossing_rate(FREQUENCY, nothing, 1.0) == 0.0
    result = expected_extremes(7.0, FREQUENCY, nothing, 0.0, 0.0, DURATION)
    assert (result.maximum, result.minimum, result.fractile_maximum, result.most_probable_minimum) == (7.0,) * 4


@pytest.mark.parametrize("cycles", [100.0, 1000.0, 1e5])
def test_gaussian_poisson_extremes_are_davenport_s(cycles: float) -> None:
    """Davenport cuts his series off at the next power of 1 / (2 ln N), with a factor below 1.0."""
    density = oscillator(0.05)
    result = gaussian(density, cycles / zero_crossing_rate(FREQUENCY, density), clumping=False)
    level = math.sqrt(2.0 * math.log(cycles))
    assert result.maximum == pytest.approx(level + np.euler_gamma / level, abs=1.0 / level**3)
    assert result.minimum == pytest.approx(-result.maximum, rel=1e-9)
    assert result.most_probable_maximum == pytest.approx(level, rel=1e-5)
    # Gumbel: exp(-N exp(-u²/2)) = p, but for the Phi of a start above it.
    fractile = math.sqrt(2.0 * math.log(cycles / -math.log(0.9)))
    assert result.fractile_maximum == pytest.approx(fractile, rel=1e-3)
    assert result.attained == 1.0


@pytest.mark.parametrize(("damping", "tolerance"), [(0.01, 0.035), (0.05, 0.02), (0.2, 0.02)])
def test_gaussian_extremes_of_simulated_records(damping: float, tolerance: float) -> None:
    """Of 200 records, with a standard error of 0.8 %. Vanmarcke's clumps are good to 3 % at light damping."""
    density = oscillator(damping)
    record = simulate(density, (200,), 1.0, 7)
    result = gaussian(density)
    largest = np.concatenate([record.max(axis=1), -record.min(axis=1)])
    assert result.maximum == pytest.approx(largest.mean(), rel=tolerance)
    assert result.fractile_maximum == pytest.approx(np.quantile(largest, 0.9), rel=tolerance + 0.01)


def test_without_clumps_light_damping_gets_too_large_extremes() -> None:
    density = oscillator(0.01)
    simulated = simulate(density, (200,), 1.0, 7).max(axis=1).mean()
    assert gaussian(density, clumping=False).maximum > 1.07 * simulated
    wide = np.ones(5001)
    assert gaussian(wide).maximum == pytest.approx(gaussian(wide, clumping=False).maximum, rel=2e-3)


def test_hermite_model_tends_to_the_gaussian_response() -> None:
    level = np.linspace(-5.0, 5.0, 11)
    assert hermite_model(0.0, 0.0).turning == ()
    np.testing.assert_array_equal(hermite_transform(hermite_model(0.0, 0.0), level), level)
    # Winterstein's first order: skewness / 6 and excess kurtosis / 24, from which terms of second order differ.
    model = hermite_model(1e-3, 2e-3)
    assert model.quadratic == pytest.approx(1e-3 / 6.0, rel=1e-3)
    assert model.cubic == pytest.approx(2e-3 / 24.0, rel=2e-3)


SHAPES = [(0.0, 0.5), (0.0, 2.0), (0.5, 0.5), (0.5, 1.0), (1.0, 2.0), (1.0, 3.0), (1.5, 5.0), (0.3, 3.0)]


@pytest.mark.parametrize(("skewness", "kurtosis"), SHAPES)
def test_hermite_model_agrees_with_winterstein_s_fit_of_1994(skewness: float, kurtosis: float) -> None:
    """Winterstein, Ude and Kleiven (1994) fit the coefficients over the linear one by

    h3 = s / 6 (1 - 0.015 s + 0.3 s²) / (1 + 0.2 k)
    h4 = 0.1 ((1 + 1.25 k)^(1/3) - 1) (1 - 1.43 s² / k)^(1 - 0.1 (k + 3)^0.8)

    within the few per cent of a fit on the long side, and more on the short one.
    """
    third = skewness / 6.0 * (1.0 - 0.015 * skewness + 0.3 * skewness**2) / (1.0 + 0.2 * kurtosis)
    fourth = 0.1 * ((1.0 + 1.25 * kurtosis) ** (1.0 / 3.0) - 1.0)
    fourth *= (1.0 - 1.43 * skewness**2 / kurtosis) ** (1.0 - 0.1 * (kurtosis + 3.0) ** 0.8)
    scale = 1.0 / math.sqrt(1.0 + 2.0 * third**2 + 6.0 * fourth**2)
    model = hermite_model(skewness, kurtosis)
    level = np.array([2.0, 3.0, 3.5, 4.0])
    for side, tolerance in ((1.0, 0.03), (-1.0, 0.09)):
        u = side * level
        fitted = scale * (u + third * (u**2 - 1.0) + fourth * (u**3 - 3.0 * u))
        np.testing.assert_allclose(hermite_transform(model, u), fitted, rtol=tolerance)


@given(st.floats(-2.0, 2.0), st.floats(0.0, 12.0))
@settings(max_examples=60, deadline=None)
def test_the_cubic_has_the_moments_it_is_made_of(skewness: float, above: float) -> None:
    """By Gauss-Hermite quadrature, exact for the twelfth power; the closed forms of eq. (3) take no part."""
    kurtosis = 4.0 / 3.0 * skewness**2 + above
    model = hermite_model(skewness, kurtosis)
    node, weight = np.polynomial.hermite_e.hermegauss(8)
    g = model.linear * node + model.quadratic * (node**2 - 1.0) + model.cubic * (node**3 - 3.0 * node)
    moments = [float(weight @ g**order) / math.sqrt(2.0 * math.pi) for order in (1, 2, 3, 4)]
    assert model.attained > 0.999
    np.testing.assert_allclose(moments[:3], [0.0, 1.0, skewness * model.attained], atol=1e-9)
    assert moments[3] - 3.0 == pytest.approx(kurtosis * model.attained**2, abs=1e-9)
    level = hermite_transform(model, np.linspace(-8.0, 8.0, 801))
    assert np.all(np.diff(level) >= 0.0)
    mirrored = hermite_transform(hermite_model(-skewness, kurtosis), np.linspace(8.0, -8.0, 801))
    np.testing.assert_allclose(level, -mirrored, atol=1e-9)


@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.sampled_from([0.0, 0.1, 0.3, 1.0, 3.0]))
@settings(max_examples=60, deadline=None)
def test_every_quadratic_response_is_within_the_model(seed: int, count: int, linear: float) -> None:
    generator = np.random.default_rng(seed)
    weights = generator.standard_normal(count) * generator.random(count) ** 3
    form = QuadraticForm(linear=linear * generator.standard_normal(count), matrix=np.diag(weights))
    shape = cumulants(form)
    assert hermite_model(shape.skewness, shape.excess_kurtosis).attained > 0.999


@pytest.mark.parametrize("order", [0.5, 1.0, 2.0, 5.0, 20.0])
def test_gamma_distribution(order: float) -> None:
    """Levels of the same probability up to 4.5 standard deviations of the normal one, far in the long tail, and the
    short tail, where the cubic turns and is held near the bound of the distribution."""
    model = hermite_model(2.0 / math.sqrt(order), 6.0 / order)
    u = np.array([2.5, 3.5, 4.5])
    long = (stats.gamma.isf(stats.norm.sf(u), order) - order) / math.sqrt(order)
    np.testing.assert_allclose(hermite_transform(model, u), long, rtol=0.025)
    short = (stats.gamma.ppf(stats.norm.cdf(-u), order) - order) / math.sqrt(order)
    np.testing.assert_allclose(hermite_transform(model, -u), short, rtol=0.11)
    assert len(model.turning) > 0


@pytest.mark.parametrize("quadratic", [0.05, 0.1, 0.2, 0.5])
def test_a_response_that_is_a_quadratic_of_one_process_is_found_exactly(quadratic: float) -> None:
    """x = y + q (y² - 1): the maximum is that of the largest y, the minimum the lower bound."""
    shape = cumulants(QuadraticForm(linear=np.ones(1), matrix=np.full((1, 1), quadratic)))
    model = hermite_model(shape.skewness, shape.excess_kurtosis)
    deviation = math.sqrt(shape.variance)
    for u in (1.0, 3.0, 5.0):
        assert hermite_transform(model, u) == pytest.approx((u + quadratic * (u**2 - 1.0)) / deviation)
    turn = -0.5 / quadratic
    assert hermite_transform(model, turn - 1.0) == pytest.approx((0.5 * turn - quadratic) / deviation)


@pytest.mark.parametrize(("order", "kurtosis"), [(8.5, -0.3), (4.5, -0.5)])
def test_hardening_against_a_beta_distribution(order: float, kurtosis: float) -> None:
    """Bounded on both sides; the cubic turns at the level that is held, 9 % inside at u = 4."""
    u = np.array([1.0, 2.0, 3.0])
    law = stats.beta(order, order)
    level = (law.isf(stats.norm.sf(u)) - 0.5) / law.std()
    model = hermite_model(0.0, kurtosis)
    np.testing.assert_allclose(hermite_transform(model, u), level, rtol=0.013)
    assert hermite_transform(model, 4.0) == pytest.approx((law.isf(stats.norm.sf(4.0)) - 0.5) / law.std(), rel=0.09)
    assert hermite_transform(model, 4.0) == -hermite_transform(model, -4.0)


def test_what_no_cubic_has_is_approached_and_what_no_distribution_has_is_refused() -> None:
    model = hermite_model(0.0, -2.0)
    # The least excess kurtosis of a cubic of a normal variable is about -1.15 (Fleishman, Psychometrika 43, 1978).
    assert -2.0 * model.attained**2 == pytest.approx(-1.15, abs=0.01)
    result = expected_extremes(0.0, FREQUENCY, oscillator(0.1), 0.0, -2.0, DURATION)
    assert result.attained == model.attained
    assert 1.3 < result.maximum < 2.0  # of the uniform distribution it is 1.7, of the sine 1.4
    for skewness, kurtosis in ((2.0, 1.9), (0.0, -2.1), (math.nan, 0.0), (0.0, math.inf)):
        with pytest.raises(ScenarioError, match="skewness is"):
            hermite_model(skewness, kurtosis)


def test_many_models_at_once_are_the_same_as_one_by_one() -> None:
    """Shapes out of reach, and one of NaN, leave the others theirs; the known one is Winterstein's first order."""
    skewness = np.array([1e-3, 0.5, math.nan, 0.0, -1.5, 2.0])
    kurtosis = np.array([2e-3, 1.0, 1.0, -2.0, 5.0, 2.5])
    h, attained = hermite_coefficients(skewness, kurtosis)
    assert h[1:, 0] == pytest.approx([1e-3 / 6.0, 2e-3 / 24.0], rel=2e-3)
    assert attained[[0, 1, 4]].tolist() == [1.0, 1.0, 1.0]
    for n in (0, 1, 3, 4, 5):
        model = hermite_model(float(skewness[n]), float(kurtosis[n]))
        np.testing.assert_allclose([model.linear, model.quadratic, model.cubic], h[:, n], atol=1e-12)
        assert model.attained == attained[n]


def squares(weights: list[float], linear: float) -> Callable[[np.ndarray], np.ndarray]:
    """Weighted squares of independent processes (axis 1) and a part linear in the first one."""
    return lambda x: np.einsum("rnt,n->rt", x**2 - 1.0, weights) + linear * x[:, 0]


@pytest.mark.parametrize(
    ("weights", "linear", "natural", "tolerance"),
    [
        ([1.0] * 6, 0.0, 0.03, 0.06),  # chi-square of six degrees of freedom
        ([0.2], 1.0, 0.02, 0.04),  # a linear response with a quadratic one of the same process
        ([1.0, 1.0, 0.5, 0.5, 0.2, 0.2, -0.1, -0.1], 0.0, 0.02, 0.09),  # as of slow drift
    ],
)
def test_extremes_of_simulated_quadratic_responses(
    weights: list[float], linear: float, natural: float, tolerance: float
) -> None:
    """Of 200 records, with a standard error of 1.2 %. Crossings of sums of squares are not quite those of a function
    of one Gaussian process, which leaves 3 to 8 %; first-order coefficients miss the maximum by 20 % and more."""
    x = simulate(oscillator(0.1, natural), (200, len(weights)), 2.0, 11)
    z = squares(weights, linear)(x)
    shape = cumulants(QuadraticForm(linear=np.array([linear, *[0.0] * (len(weights) - 1)]), matrix=np.diag(weights)))
    count = z.shape[1]
    # The records are periodic, so that their periodogram does not leak.
    density = np.mean(np.abs(np.fft.rfft(z)[:, 1:-1] / count) ** 2, axis=0) * 2.0 * DURATION
    frequency = np.fft.rfftfreq(count, 2.0)[1:-1]
    mean = float(z.mean())
    result = expected_extremes(mean, frequency, density, shape.skewness, shape.excess_kurtosis, DURATION)
    deviation = math.sqrt(shape.variance)
    assert result.maximum - mean == pytest.approx(z.max(axis=1).mean() - mean, rel=tolerance)
    assert result.fractile_maximum - mean == pytest.approx(np.quantile(z.max(axis=1), 0.9) - mean, rel=tolerance + 0.02)
    assert result.minimum - mean == pytest.approx(z.min(axis=1).mean() - mean, abs=0.2 * deviation)


@pytest.mark.parametrize(("quadratic", "cubic"), [(0.2, 0.0), (0.0, 0.06), (-0.15, 0.05)])
def test_the_rate_of_a_function_of_a_gaussian_process(quadratic: float, cubic: float) -> None:
    """x = y + q (y² - 1) + c (y³ - 3y) passes its levels as often as y does, at a rate other than its spectrum's.

    With the correlation R + 2 q² R² + 6 c² R³, its spectrum is that of y and its convolutions with itself.
    """
    density = oscillator(0.2)
    once = 0.5 * np.concatenate([density[:0:-1], density])  # on both sides of zero
    twice = signal.fftconvolve(once, once) * FREQUENCY[1]
    whole = 6.0 * cubic**2 * signal.fftconvolve(twice, once) * FREQUENCY[1]
    for part in (2.0 * quadratic**2 * twice, once):
        margin = (len(whole) - len(part)) // 2
        whole[margin : margin + len(part)] += part
    one_sided = 2.0 * np.maximum(whole[len(whole) // 2 :], 0.0)
    frequency = np.arange(len(one_sided)) * FREQUENCY[1]
    node, weight = np.polynomial.hermite_e.hermegauss(8)
    value = node + quadratic * (node**2 - 1.0) + cubic * (node**3 - 3.0 * node)
    variance, third, fourth = (float(weight @ value**order) / math.sqrt(2.0 * math.pi) for order in (2, 3, 4))
    assert np.trapezoid(one_sided, frequency) == pytest.approx(variance, rel=1e-6)
    rate = zero_crossing_rate(FREQUENCY, density)
    assert zero_crossing_rate(frequency, one_sided) > 1.02 * rate
    shape = third / variance**1.5, fourth / variance**2 - 3.0
    result = expected_extremes(0.0, frequency, one_sided, *shape, DURATION, clumping=False)
    u = math.sqrt(2.0 * math.log(DURATION * rate))
    level = u + quadratic * (u**2 - 1.0) + cubic * (u**3 - 3.0 * u)
    assert result.most_probable_maximum == pytest.approx(level, rel=1e-5)


shapes = st.tuples(st.floats(-1.5, 1.5), st.floats(0.0, 4.0)).map(
    lambda pair: (pair[0], 4 / 3 * pair[0] ** 2 + pair[1])
)


@given(shapes, st.floats(0.0, 1e6), st.floats(1.0, 10.0), st.booleans())
@settings(max_examples=50, deadline=None)
def test_longer_durations_have_larger_extremes(
    shape: tuple[float, float], duration: float, ratio: float, clumping: bool
) -> None:
    density = oscillator(0.02)
    short, long = (
        expected_extremes(0.0, FREQUENCY, density, *shape, time, clumping=clumping)
        for time in (duration, duration * ratio)
    )
    for name in ("maximum", "most_probable_maximum", "fractile_maximum"):
        assert getattr(long, name) >= getattr(short, name) - 1e-9
    for name in ("minimum", "most_probable_minimum", "fractile_minimum"):
        assert getattr(long, name) <= getattr(short, name) + 1e-9
    # Held where the cubic turns, its mean moves a little.
    assert short.minimum - 0.1 <= 0.0 <= short.maximum + 0.1


@given(shapes, st.floats(-1e3, 1e3), st.floats(1e-3, 1e3), st.floats(0.0, 1e5))
@settings(max_examples=50, deadline=None)
def test_scale_shift_and_reflection(shape: tuple[float, float], mean: float, scale: float, duration: float) -> None:
    density = oscillator(0.05)
    skewness, kurtosis = shape
    unit = expected_extremes(0.0, FREQUENCY, density, skewness, kurtosis, duration)
    other = expected_extremes(mean, FREQUENCY, scale**2 * density, skewness, kurtosis, duration)
    mirrored = expected_extremes(0.0, FREQUENCY, density, -skewness, kurtosis, duration)
    for name in ("maximum", "most_probable_maximum", "fractile_maximum"):
        opposite = name.replace("maximum", "minimum")
        for each in (name, opposite):
            expected = mean + scale * getattr(unit, each)
            assert getattr(other, each) == pytest.approx(expected, abs=1e-9 * (scale + abs(mean)))
        assert getattr(mirrored, name) == pytest.approx(-getattr(unit, opposite), abs=1e-9)


@pytest.mark.parametrize("clumping", [True, False])
def test_the_shortest_durations_have_the_mean(clumping: bool) -> None:
    density = oscillator(0.1)
    for skewness, kurtosis in ((0.0, 0.0), (1.0, 2.0)):
        result = expected_extremes(5.0, FREQUENCY, density, skewness, kurtosis, 0.0, clumping=clumping)
        # In standard deviations; the second shape's cubic turns at u = -3.5 or so.
        assert result.maximum == pytest.approx(5.0, abs=1e-3)
        assert result.minimum == pytest.approx(5.0, abs=1e-3)
        # That of a single value.
        level = hermite_transform(hermite_model(skewness, kurtosis), stats.norm.ppf(0.9))
        assert result.fractile_maximum == pytest.approx(5.0 + level, abs=1e-4)
    assert gaussian(density, 1.0, clumping).most_probable_maximum == 0.0


def test_a_quantity_knows_its_extremes() -> None:
    quantity = Quantity(
        name="position.surge",
        unit="m",
        mean=6.0,
        frequency=FREQUENCY,
        density=4.0 * oscillator(0.1),
        skewness=0.8,
        excess_kurtosis=1.2,
    )
    result = expected_extremes(6.0, FREQUENCY, quantity.density, 0.8, 1.2, DURATION)
    assert quantity.zero_crossing_rate == zero_crossing_rate(FREQUENCY, quantity.density)
    assert quantity.expected_maximum(DURATION) == result.maximum
    assert quantity.expected_minimum(DURATION) == result.minimum
    assert quantity.extremes(DURATION) == result
    assert quantity.extremes(DURATION, probability=0.5).fractile_maximum < result.fractile_maximum
    assert result.maximum - 6.0 > 6.0 - result.minimum


def test_what_does_not_fit_is_refused() -> None:
    density = oscillator(0.1)
    with pytest.raises(ScenarioError, match=r"both must be \(n,\)"):
        spectral_moments(FREQUENCY, density[1:], (0,))
    with pytest.raises(ScenarioError, match="increase"):
        spectral_moments(FREQUENCY[::-1], density, (0,))
    with pytest.raises(ScenarioError, match="increase"):
        spectral_moments(FREQUENCY - 0.1, density, (0,))
    with pytest.raises(ScenarioError, match="densities"):
        spectral_moments(FREQUENCY, -density, (0,))
    for duration in (-1.0, math.inf, math.nan):
        with pytest.raises(ScenarioError, match="duration"):
            gaussian(density, duration)
    with pytest.raises(ScenarioError, match="probability"):
        expected_extremes(0.0, FREQUENCY, density, 0.0, 0.0, DURATION, probability=1.0)


def test_crossings_of_a_quantity_count_from_its_mean() -> None:
    """Rice: one standard deviation above the mean is crossed exp(-1/2) times as often as the mean."""
    flat = np.where(FREQUENCY <= 0.5, 2.0, 0.0)
    found = Quantity(name="x", unit="m", mean=3.0, frequency=FREQUENCY, density=flat)
    assert found.crossing_rate(3.0) == found.zero_crossing_rate
    ratio = found.crossing_rate(3.0 + found.spread()) / found.zero_crossing_rate
    assert ratio == pytest.approx(math.exp(-0.5), rel=1e-3)
