"""Tails and extremes against closed forms: Weibull, Rayleigh, Gumbel, and scipy's ways to fit them."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.stats import gumbel_r, weibull_min

from tlpsim.scenarios.statistics import extremes
from tlpsim.scenarios.statistics.extremes import (
    PRIOR_SHAPE,
    PRIOR_SPREAD,
    Maxima,
    exceedance,
    expected_extreme,
    fit_gumbel,
    fit_weibull,
    maxima_between_crossings,
    up_crossings,
)
from tlpsim.scenarios.statistics.intervals import Events
from tlpsim.scenarios.statistics.records import WeibullFit

EULER = 0.5772156649015329


def rayleigh(generator: np.random.Generator, count: int, duration: float = 1000.0) -> Maxima:
    """Independent maxima of a narrow-banded Gaussian process of spread 1."""
    events = Events(place=np.sort(generator.random(count)), duration=duration)
    return Maxima(value=generator.rayleigh(1.0, count), events=events)


def test_maxima_by_hand() -> None:
    fluctuation = np.array([3.0, -1.0, 2.0, 5.0, -2.0, -1.0, 0.0, 1.0, -4.0, 2.0, 9.0])
    assert list(up_crossings(fluctuation)) == [2, 6, 9]
    found = maxima_between_crossings(fluctuation, 0.5)
    assert list(found.value) == [5.0, 1.0]
    np.testing.assert_allclose(found.events.place, [4.0 / 11.0, 7.5 / 11.0])
    assert found.events.duration == 5.5
    assert not len(maxima_between_crossings(fluctuation[:6], 0.5).value)


@pytest.mark.parametrize("shape", [0.8, 1.4, 2.0, 4.0])
def test_weibull_parameters_are_recovered(shape: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """With all of 20 000 maxima in the fit, whose shape then has a standard error of 0.6 %."""
    monkeypatch.setattr(extremes, "TAIL_FACTOR", 1e6)
    value = weibull_min.rvs(shape, scale=3.0, size=20000, random_state=1)
    fit = fit_weibull(value)
    assert fit is not None
    assert fit.count == 19999
    assert (fit.shape, fit.scale) == pytest.approx((shape, 3.0), rel=0.025)


@pytest.mark.parametrize("shape", [1.0, 2.0, 4.0])
def test_the_tail_gives_levels_without_bias(shape: float) -> None:
    """Of 400 maxima 81 are fitted; the level of 1 in 1000, in the mean of 200 trials: the spread of one is 10 %."""
    trials = weibull_min.rvs(shape, scale=3.0, size=(200, 400), random_state=2)
    fits = [fit_weibull(each, location=7.0, time=800.0) for each in trials]
    assert {(fit.count, fit.rate) for fit in fits if fit} == {(round(1.5 * 400 ** (2 / 3)), 0.5)}
    levels = [float(fit.level(1e-3)) - 7.0 for fit in fits if fit]
    assert np.mean(levels) == pytest.approx(weibull_min.isf(1e-3, shape, scale=3.0), rel=0.04)


@pytest.mark.parametrize(("count", "shape"), [(40, 2.0), (300, 1.3), (2000, 3.0)])
def test_the_fit_is_the_likeliest(count: int, shape: float) -> None:
    """Against a search over both parameters at once, from the density of a cut-off Weibull distribution."""
    value = weibull_min.rvs(shape, scale=0.7, size=count, random_state=count)
    fit = fit_weibull(value)
    assert fit is not None
    tail = value[value > fit.threshold]

    def unlikeliness(parameters: np.ndarray) -> float:
        c, a = np.exp(parameters)
        density = weibull_min.logpdf(tail, c, scale=a) - weibull_min.logsf(fit.threshold, c, scale=a)
        return float(-np.sum(density) + 0.5 * (math.log(c / PRIOR_SHAPE) / PRIOR_SPREAD) ** 2)

    start = np.log([1.2 * fit.shape, 0.9 * fit.scale])
    best = minimize(unlikeliness, start, method="Nelder-Mead", options={"xatol": 1e-8, "fatol": 1e-10})
    np.testing.assert_allclose(np.exp(best.x), [fit.shape, fit.scale], rtol=1e-4)
    assert fit.count == len(tail)


def test_maxima_that_are_too_few_or_all_alike_have_no_fit() -> None:
    generator = np.random.default_rng(0)
    assert fit_weibull(generator.random(19)) is None
    assert fit_weibull(np.full(100, 2.0)) is None
    assert fit_weibull(1.0 + 1e-8 * generator.random(100)) is None


@given(
    shape=st.floats(0.5, 6.0),
    scale=st.floats(0.01, 100.0),
    threshold=st.floats(0.0, 2.0),
    share=st.floats(0.05, 1.0),
    sign=st.sampled_from([-1.0, 1.0]),
)
@settings(max_examples=50, deadline=None)
def test_level_and_exceedance_are_inverse(
    shape: float, scale: float, threshold: float, share: float, sign: float
) -> None:
    fit = WeibullFit(
        sign=sign, location=5.0, scale=scale, shape=shape, threshold=threshold * scale, share=share, count=1, rate=1.0
    )
    probability = share * np.array([0.9, 0.1, 1e-4])
    np.testing.assert_allclose(fit.exceedance(fit.level(probability)), probability, rtol=1e-6)
    assert np.isnan(fit.exceedance(5.0 - sign))
    assert np.all(np.diff(sign * fit.level(probability)) > 0.0)


def test_the_expected_extreme_of_rayleigh_maxima() -> None:
    """N = 1000 maxima of a Gaussian process of spread 1: sqrt(2 ln N) + 0.5772 / sqrt(2 ln N), Longuet-Higgins (1952).

    Of 40 000 maxima the standard error of the estimate is some 1 %.
    """
    found = [rayleigh(np.random.default_rng(1), 40000)]
    fit = fit_weibull(found[0].value, location=10.0, sign=-1.0, time=1000.0)
    assert fit is not None
    root = math.sqrt(2.0 * math.log(1000.0))
    estimate = expected_extreme(found, fit, 25.0, 0.95)
    assert 10.0 - estimate.value == pytest.approx(root + EULER / root, rel=0.03)
    assert estimate.low < estimate.value < estimate.high
    assert estimate.high - estimate.low < 1.0


def test_the_expected_extreme_of_a_few_maxima_is_theirs() -> None:
    """Of an exposure with three maxima the mean of the largest is in the bulk, where no tail is fitted."""
    found = [rayleigh(np.random.default_rng(2), 20000)]
    fit = fit_weibull(found[0].value, time=1000.0)
    assert fit is not None
    # A Poisson number of maxima, of mean 3, each above y with P = exp(-y^2 / 2); none at all counts as 0.
    y = np.linspace(0.0, 6.0, 6001)
    expected = np.trapezoid(1.0 - np.exp(-3.0 * np.exp(-0.5 * y**2)), y)
    assert expected_extreme(found, fit, 0.15, 0.95).value == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("records", [1, 8])
def test_the_interval_of_the_expected_extreme_holds_it(records: int) -> None:
    """Nominal 95 %, and measured 90 to 93 % of 400 independent maxima; 200 trials tell 2 %."""
    generator = np.random.default_rng(3)
    root = math.sqrt(2.0 * math.log(400.0))
    hits = []
    for _ in range(200):
        found = [rayleigh(generator, 400 // records) for _ in range(records)]
        fit = fit_weibull(np.concatenate([each.value for each in found]), time=1000.0 * records)
        assert fit is not None
        estimate = expected_extreme(found, fit, 1000.0 * records, 0.95)
        hits.append(estimate.low <= root + EULER / root <= estimate.high)
    assert 0.85 <= np.mean(hits) <= 0.98


def test_a_gaussian_process_has_a_rayleigh_tail(gaussian: Callable[..., np.ndarray]) -> None:
    """Waves for 60 hours: their rate after Rice (1945), and the expected maximum of 3 hours."""

    def waves(frequency: np.ndarray) -> np.ndarray:
        return np.where((frequency > 0.05) & (frequency < 0.15), 10.0, 0.0)  # variance 1

    signal = gaussian(waves, 1, 60 * 7200, 0.5, 7)[0]
    found = maxima_between_crossings(signal - signal.mean(), 0.5)
    rate = math.sqrt((0.15**3 - 0.05**3) / 0.3)  # Rice: sqrt(m2 / m0)
    fit = fit_weibull(found.value, time=60 * 3600.0)
    assert fit is not None
    assert fit.rate == pytest.approx(rate, rel=0.01)
    assert 1.3 < fit.shape < 2.7  # of 1200 maxima within a narrow range of levels
    root = math.sqrt(2.0 * math.log(rate * 10800.0))
    assert expected_extreme([found], fit, 10800.0, 0.95).value == pytest.approx(root + EULER / root, rel=0.03)


def test_slow_drift_does_not_spoil_the_tail(gaussian: Callable[..., np.ndarray]) -> None:
    """Drift of 100 s with waves: a Weibull distribution of all maxima misses the mean of record maxima by far."""

    def both(frequency: np.ndarray) -> np.ndarray:
        drift = np.where((frequency > 0.007) & (frequency < 0.013), 0.7 / 0.006, 0.0)
        return drift + np.where((frequency > 0.06) & (frequency < 0.1), 0.3 / 0.04, 0.0)

    records = gaussian(both, 60, 21600, 0.5, 8)
    truth = float(np.mean(records.max(axis=1)))
    found = [maxima_between_crossings(each - each.mean(), 0.5) for each in records]
    value = np.concatenate([each.value for each in found])
    time = 60 * 10800.0
    fit = fit_weibull(value, time=time)
    assert fit is not None
    assert expected_extreme(found, fit, 10800.0, 0.95).value == pytest.approx(truth, rel=0.04)
    shape, _, scale = weibull_min.fit(value[value > 0.0], floc=0.0)
    of_all = weibull_min.isf(60.0 / len(value), shape, scale=scale)  # exceeded once in 3 hours
    assert of_all > 1.1 * truth


def test_exceedance_counts_maxima() -> None:
    events = Events(place=np.linspace(0.05, 0.95, 4), duration=10.0)
    found = exceedance([Maxima(value=np.array([1.0, 4.0, 2.0, 3.0]), events=events)], 10.0, 4, 0.95)
    np.testing.assert_allclose(found.level, [11.0, 12.0, 13.0, 14.0])
    np.testing.assert_allclose(found.probability, [0.8, 0.6, 0.4, 0.2])
    assert np.all(found.low <= found.probability)
    assert np.all(found.probability <= found.high)
    nothing = exceedance([Maxima(value=np.zeros(0), events=Events(place=np.zeros(0), duration=1.0))], 0.0, 4, 0.95)
    assert len(nothing.level) == 0


def test_many_maxima_are_thinned_below_and_not_in_the_tail() -> None:
    found = exceedance([rayleigh(np.random.default_rng(0), 20000)], 0.0, 4, 0.95)
    assert len(found.level) <= 300
    assert found.probability[-3] == pytest.approx(3.0 / 20001.0)
    np.testing.assert_allclose(found.probability, np.exp(-0.5 * found.level**2), rtol=1.0, atol=0.02)


@pytest.mark.parametrize("records", [1, 3])
def test_the_interval_of_an_exceedance_holds_it(records: int) -> None:
    """The share of independent maxima above a level, of which 1 in 10 is."""
    generator = np.random.default_rng(5)
    hits = []
    for _ in range(300):
        found = exceedance([rayleigh(generator, 200) for _ in range(records)], 0.0, 6, 0.95)
        place = int(np.argmin(np.abs(found.probability - 0.1)))
        truth = math.exp(-0.5 * found.level[place] ** 2)
        hits.append(found.low[place] <= truth <= found.high[place])
    assert 0.90 <= np.mean(hits) <= 0.99


def test_gumbel_parameters_are_recovered_as_by_likelihood() -> None:
    extremes = gumbel_r.rvs(loc=12.0, scale=1.5, size=4000, random_state=1)
    fit = fit_gumbel(extremes, 3600.0, 10800.0, 0.95)
    assert fit is not None
    assert (fit.location, fit.scale) == pytest.approx(gumbel_r.fit(extremes), rel=0.02)
    assert float(fit.quantile(0.9)) == pytest.approx(gumbel_r.ppf(0.9, 12.0, 1.5), rel=0.01)
    # The most of three such records: P^3.
    assert float(fit.quantile(0.9, 10800.0)) == pytest.approx(gumbel_r.ppf(0.9 ** (1 / 3), 12.0, 1.5), rel=0.01)
    assert fit.expected.value == pytest.approx(12.0 + 1.5 * (EULER + math.log(3.0)), rel=0.01)


def test_gumbel_has_no_bias_from_three_records() -> None:
    """4000 trials of three: the mean scale to 1 %."""
    trials = gumbel_r.rvs(size=(4000, 3), random_state=2)
    fits = [fit_gumbel(each, 1.0, 1.0, 0.95) for each in trials]
    assert np.mean([fit.scale for fit in fits if fit]) == pytest.approx(1.0, abs=0.04)
    assert np.mean([fit.location for fit in fits if fit]) == pytest.approx(0.0, abs=0.04)
    # A mean of three, with Student's t; Gumbel's distribution is skew.
    inside = [fit.expected.low <= EULER <= fit.expected.high for fit in fits if fit]
    assert 0.91 <= np.mean(inside) <= 0.97


def test_gumbel_of_minima_is_that_of_maxima_turned() -> None:
    extremes = np.array([3.0, 4.5, 2.0, 3.3])
    most, least = fit_gumbel(extremes, 1.0, 2.0, 0.95), fit_gumbel(-extremes, 1.0, 2.0, 0.95, -1.0)
    assert most is not None
    assert least is not None
    assert least.expected.value == pytest.approx(-most.expected.value)
    assert (least.expected.low, least.expected.high) == pytest.approx((-most.expected.high, -most.expected.low))
    assert float(least.quantile(0.9)) == pytest.approx(-float(most.quantile(0.9)))
    assert fit_gumbel(extremes[:2], 1.0, 1.0, 0.95) is None
