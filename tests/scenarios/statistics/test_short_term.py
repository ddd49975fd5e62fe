"""Distributions of the extreme of a sea state against the expected extremes of both domains, and closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from tlpsim.loads.spectral.records import Quantity
from tlpsim.scenarios.results import ResultsError
from tlpsim.scenarios.statistics.extremes import Maxima, expected_extreme, fit_weibull
from tlpsim.scenarios.statistics.intervals import Events
from tlpsim.scenarios.statistics.records import WeibullFit
from tlpsim.scenarios.statistics.short_term import (
    ShortTermExtremes,
    SpectralExtremes,
    WeibullExtremes,
    spectral_extremes,
    weibull_extremes,
)

DURATION = 10800.0
FREQUENCY = np.linspace(0.0, 0.5, 2001)
DENSITY = np.exp(-0.5 * ((FREQUENCY - 0.08) / 0.02) ** 2) + 5.0 * np.exp(-0.5 * ((FREQUENCY - 0.01) / 0.003) ** 2)
SHAPES = ((0.0, 0.0), (0.5, 0.6), (-1.2, 2.5), (0.0, -0.3), (1.0, 1.9))
FIT = WeibullFit(sign=1.0, location=3.0, scale=1.2, shape=1.8, threshold=1.5, share=0.2, count=180, rate=0.09)


def quantities() -> list[Quantity]:
    return [
        Quantity(
            name="x",
            unit="m",
            mean=3.0,
            frequency=FREQUENCY,
            density=DENSITY,
            skewness=skewness,
            excess_kurtosis=kurtosis,
        )
        for skewness, kurtosis in SHAPES
    ]


def gaussian(sign: float = 1.0, **changed: object) -> SpectralExtremes:
    columns: dict[str, object] = {
        "mean": 2.0,
        "deviation": 0.5,
        "skewness": 0.0,
        "excess_kurtosis": 0.0,
        "zero_crossing_period": 10.0,
        "bandwidth": math.inf,
        **changed,
    }
    return SpectralExtremes(sign=sign, **columns)  # type: ignore[arg-type]


def reflected(law: ShortTermExtremes) -> ShortTermExtremes:
    if isinstance(law, SpectralExtremes):
        return replace(law, sign=-law.sign, mean=-law.mean, skewness=-law.skewness, coefficients=None)
    assert isinstance(law, WeibullExtremes)
    return replace(law, sign=-law.sign, location=-law.location)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_same_as_the_frequency_domain_s_own_extremes(sign: float) -> None:
    """Which have a grid of their own, five times finer: 1e-4 of a standard deviation."""
    law = spectral_extremes(quantities(), sign)
    own = [each.extremes(DURATION, probability=0.9) for each in quantities()]
    expected = [each.maximum if sign > 0.0 else each.minimum for each in own]
    fractile = [each.fractile_maximum if sign > 0.0 else each.fractile_minimum for each in own]
    deviation = quantities()[0].spread()
    np.testing.assert_allclose(law.expected(DURATION), expected, atol=1e-4 * deviation)
    np.testing.assert_allclose(law.quantile(0.9, DURATION), fractile, atol=1e-4 * deviation)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rice_s_crossings_of_a_gaussian_response(sign: float) -> None:
    """P = 1 - exp(-T / Tz exp(-z² / 2)) far above the mean, down to probabilities of 1e-12."""
    z = np.array([3.0, 4.0, 5.0, 7.0, 9.0])
    found = gaussian(sign).probability_of_exceedance(2.0 + sign * 0.5 * z, DURATION)
    rice = -np.expm1(-DURATION / 10.0 * np.exp(-0.5 * z**2) + stats.norm.logcdf(z))
    np.testing.assert_allclose(found[0], rice, rtol=1e-6)


def test_a_lognormal_tail_by_its_hermite_transform() -> None:
    """exp(s u), s = 0.1, is nearly a cubic of u: its level of the same u within 0.3 % of the distance."""
    s = 0.1
    law = stats.lognorm(s)
    skewness, kurtosis = (float(each) for each in law.stats("sk"))
    rows = gaussian(mean=law.mean(), deviation=law.std(), skewness=skewness, excess_kurtosis=kurtosis)
    u = np.array([3.0, 4.0, 5.0])
    slope = s * math.sqrt(1.0 + law.mean() ** 2 / law.var())  # sqrt(E g'^2), with sigma g' = s x
    for at in u:
        probability = float(-np.expm1(stats.norm.logcdf(at) - DURATION / 10.0 / slope * math.exp(-0.5 * at**2)))
        level = rows.quantile(1.0 - probability, DURATION)[0]
        assert level - law.mean() == pytest.approx(math.exp(s * at) - law.mean(), rel=0.004)


def test_maxima_that_come_independently() -> None:
    """A simulation of the maxima in 3 h themselves: a Poisson number of them, each of the tail."""
    generator = np.random.Generator(np.random.Philox(3))
    count = generator.poisson(FIT.rate * FIT.share * DURATION, 20_000)
    uniform = generator.random(20_000) ** (1.0 / count)  # of the largest one
    largest = np.sort(np.asarray(FIT.level((1.0 - uniform) * FIT.share)))
    law = weibull_extremes([FIT], 1.0)
    for probability in (0.1, 0.5, 0.9, 0.99):
        level = law.quantile(probability, DURATION)
        passed = law.probability_of_exceedance(level, DURATION)[0, 0]
        assert passed == pytest.approx(1.0 - probability, rel=1e-9)
        error = math.sqrt(probability * (1.0 - probability) / 20_000)
        assert np.mean(largest > level) == pytest.approx(1.0 - probability, abs=4.0 * error)
    assert law.expected(DURATION)[0] == pytest.approx(largest.mean(), abs=4.0 * largest.std() / math.sqrt(20_000))


def test_the_same_mean_as_that_of_the_statistics_of_a_record() -> None:
    generator = np.random.Generator(np.random.Philox(4))
    value = generator.rayleigh(2.0, 900)
    fit = fit_weibull(value, location=5.0, sign=-1.0, time=DURATION)
    assert fit is not None
    record = Maxima(value=value, events=Events(place=np.linspace(0.0, 1.0, 900), duration=DURATION))
    found = weibull_extremes([fit, None], -1.0).expected(DURATION)
    assert found[0] == pytest.approx(expected_extreme([record], fit, DURATION, 0.95).value, rel=1e-6)
    assert math.isnan(found[1])


def test_below_the_threshold_the_distribution_goes_on_to_the_mean() -> None:
    law = weibull_extremes([FIT], 1.0)
    level = np.linspace(2.0, 8.0, 601)
    # Of one maximum, from the exceedance in a time that has one on average.
    one = -np.log1p(-law.probability_of_exceedance(level, 1.0 / FIT.rate)[0])
    assert np.all(np.diff(one) <= 1e-12)
    assert one[0] == pytest.approx(1.0)
    np.testing.assert_allclose(one[level >= 4.5], FIT.exceedance(level[level >= 4.5]), rtol=1e-6)
    assert np.interp(3.0, level, one) == pytest.approx(1.0)
    assert np.max(np.abs(np.diff(one))) < 0.02  # without a jump
    for probability in (1e-9, 0.3, 0.9):  # of levels short of the threshold too
        quantile = law.quantile(probability, 1.0 / FIT.rate * 25.0)
        back = law.probability_of_exceedance(quantile, 1.0 / FIT.rate * 25.0)[0, 0]
        assert back == pytest.approx(1.0 - probability, rel=1e-9)


@pytest.mark.parametrize(
    "law", [spectral_extremes(quantities(), 1.0), weibull_extremes([FIT, replace(FIT, shape=0.9)], 1.0)]
)
def test_reflection_duration_and_rows(law: ShortTermExtremes) -> None:
    level = np.linspace(0.0, 12.0, 50)
    passed = law.probability_of_exceedance(level, DURATION)
    np.testing.assert_allclose(reflected(law).probability_of_exceedance(-level, DURATION), passed, atol=1e-12)
    np.testing.assert_allclose(reflected(law).expected(DURATION), -law.expected(DURATION))
    np.testing.assert_allclose(reflected(law).quantile(0.7, DURATION), -law.quantile(0.7, DURATION))
    assert np.all(np.diff(passed, axis=1) <= 1e-12)
    assert np.all(law.probability_of_exceedance(level, 2.0 * DURATION) >= passed - 1e-12)
    assert np.all(law.expected(2.0 * DURATION) > law.expected(DURATION))
    second = law.rows_of(np.array([1]))
    np.testing.assert_array_equal(second.probability_of_exceedance(level, DURATION)[0], passed[1])
    assert len(second.known) == 1


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_signal_that_does_not_move(sign: float) -> None:
    """A lost tendon: its extreme is its mean, and it has no period."""
    lost = gaussian(sign, mean=[0.0, 5.0], deviation=0.0, zero_crossing_period=math.inf, bandwidth=0.0)
    nothing = np.full(2, math.nan)
    fitted = WeibullExtremes(
        sign=sign,
        location=np.array([0.0, 5.0]),
        scale=np.zeros(2),
        shape=nothing,
        threshold=nothing,
        share=nothing,
        rate=nothing,
    )
    for law in (lost, fitted):
        assert law.known.all()
        np.testing.assert_array_equal(law.expected(DURATION), [0.0, 5.0])
        np.testing.assert_array_equal(law.quantile(0.3, DURATION), [0.0, 5.0])
        level = np.array([-1.0, 1.0, 6.0])
        above = level[np.newaxis] < np.array([[0.0], [5.0]])
        np.testing.assert_array_equal(law.probability_of_exceedance(level, DURATION), above if sign > 0.0 else ~above)


def test_rows_without_numbers_are_unknown() -> None:
    law = gaussian(
        skewness=[0.0, math.nan, 2.0, 0.0, 0.0],
        excess_kurtosis=[0.0, 0.0, 1.0, 0.0, 0.0],
        deviation=[0.5, 0.5, 0.5, math.nan, -1.0],
    )
    assert law.known.tolist() == [True, False, False, False, False]
    passed = law.probability_of_exceedance([1.0, 3.0], DURATION)
    assert np.isfinite(passed[0]).all()
    assert np.isnan(passed[1:]).all()
    assert np.isnan(law.expected(DURATION)[1:]).all()
    assert np.isnan(law.quantile(0.5, DURATION)[1:]).all()
    assert law.remarks == ()
    assert "no Hermite model has" in gaussian(excess_kurtosis=-1.9).remarks[0]


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(ResultsError, match="sign is 0"):
        gaussian(0.0)
    with pytest.raises(ResultsError, match="same rows"):
        gaussian(mean=[1.0, 2.0, 3.0], deviation=[1.0, 2.0])
    with pytest.raises(ResultsError, match="fits of one side"):
        weibull_extremes([FIT], -1.0)
    for law in (gaussian(), weibull_extremes([FIT], 1.0)):
        for duration in (0.0, -1.0, math.nan):
            with pytest.raises(ResultsError, match="duration"):
                law.probability_of_exceedance(1.0, duration)
        with pytest.raises(ResultsError, match="probability of the quantile"):
            law.quantile(1.0, DURATION)
