"""Intervals against exact ones: white noise, first-order autoregression, Poisson events, chi-squared."""

import math

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import chi2, norm

from tlpsim.scenarios.statistics.intervals import (
    Events,
    cosine_count,
    event_projections,
    level_interval,
    quantile,
    ratio_interval,
    reciprocal_interval,
    sample_projections,
    spread_interval,
    standard_error,
)

TRIALS = 2000


def within(hits: np.ndarray, share: float = 0.95) -> bool:
    """Whether a share of trials is within four standard errors of what it should be."""
    return bool(abs(np.mean(hits) - share) < 4.0 * math.sqrt(share * (1.0 - share) / len(hits)))


@pytest.mark.parametrize("records", [1, 3])
def test_the_interval_of_the_mean_of_white_noise_is_exact(records: int) -> None:
    """Projections of white Gaussian noise are independent, so that Student's t holds at any number of cosines."""
    noise = np.random.default_rng(records).standard_normal((TRIALS, records, 64))
    error, freedom = standard_error(sample_projections(noise, 5), np.full(records, 10.0))
    assert freedom == 6 * records - 1
    assert within(np.abs(noise.mean(axis=(1, 2))) <= quantile(freedom, 0.95) * error)
    assert np.mean(error**2) == pytest.approx(1.0 / (64 * records), rel=0.05)


def test_longer_records_count_for_more() -> None:
    """Two records of white noise, one of which is four times as long: the variance of the mean of all samples."""
    generator = np.random.default_rng(4)
    short, long = generator.standard_normal((TRIALS, 40)), generator.standard_normal((TRIALS, 160))
    mean = (short.sum(axis=1) + long.sum(axis=1)) / 200
    both = [sample_projections(each - mean[:, np.newaxis], 4) for each in (short, long)]
    error, _ = standard_error(np.stack(both, axis=1), np.array([40.0, 160.0]))
    assert np.mean(error**2) == pytest.approx(1.0 / 200.0, rel=0.05)


def test_correlation_is_told_from_the_record() -> None:
    """x_n = 0.9 x_(n-1) + e_n: the variance of the mean of N is 1 / (N (1 - 0.9)^2), 19 times that of as many of no
    correlation."""
    noise = np.random.default_rng(1).standard_normal((500, 21000))
    record = lfilter([1.0], [1.0, -0.9], noise, axis=1)[:, 1000:]
    projections = sample_projections(record, 6)[:, np.newaxis]
    error, freedom = standard_error(projections, np.ones(1))
    assert np.mean(error**2) == pytest.approx(100.0 / 20000.0, rel=0.08)
    assert within(np.abs(record.mean(axis=1)) <= quantile(freedom, 0.95) * error)


def test_the_rate_of_poisson_events() -> None:
    """The number of n events has the variance n."""
    generator = np.random.default_rng(2)
    errors = []
    for _ in range(TRIALS // 2):
        count = int(generator.poisson(200.0))
        events = [Events(place=generator.random(count), duration=50.0)]
        # Of the logarithm of the rate, 1 / rate for each event.
        error, _ = standard_error(event_projections(events, [np.full(count, 50.0 / count)], 6), np.array([50.0]))
        errors.append(float(error))
    assert np.mean(np.square(errors)) == pytest.approx(1.0 / 200.0, rel=0.08)


@pytest.mark.parametrize("degrees", [10.0, 30.0, 200.0])
def test_the_interval_of_a_spread_is_that_of_chi_squared(degrees: float) -> None:
    """Where the error is known (no end of degrees of freedom of its own); Wilson and Hilferty are good to 1 % there."""
    found = spread_interval(2.0, math.sqrt(2.0 / degrees), 1e9, 0.95)
    assert found.low == pytest.approx(2.0 * math.sqrt(degrees / chi2.ppf(0.975, degrees)), rel=0.01)
    assert found.high == pytest.approx(2.0 * math.sqrt(degrees / chi2.ppf(0.025, degrees)), rel=0.01)


def test_intervals_of_other_kinds() -> None:
    z = norm.ppf(0.95)
    level, ratio, reciprocal = (
        kind(5.0, 0.1, 1e9, 0.9) for kind in (level_interval, ratio_interval, reciprocal_interval)
    )
    assert (level.low, level.high) == pytest.approx((5.0 - 0.1 * z, 5.0 + 0.1 * z))
    assert (ratio.low, ratio.high) == pytest.approx((5.0 * math.exp(-0.1 * z), 5.0 * math.exp(0.1 * z)))
    assert (1.0 / reciprocal.high, 1.0 / reciprocal.low) == pytest.approx((0.2 * (1 - 0.1 * z), 0.2 * (1 + 0.1 * z)))


def test_bounds_that_the_data_cannot_tell_are_infinite() -> None:
    for kind in (spread_interval, reciprocal_interval):
        found = kind(5.0, 2.0, 4.0, 0.95)
        assert 0.0 < found.low < 5.0
        assert found.high == math.inf


def test_longer_records_have_more_cosines_within_limits() -> None:
    assert [cosine_count(hours * 3600.0) for hours in (0.1, 1.0, 3.0, 5.0, 24.0)] == [4, 4, 6, 10, 12]
