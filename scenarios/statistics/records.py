"""Records that statistics of results come in: estimates with intervals, fitted distributions, cycles of fatigue."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

EULER = float(np.euler_gamma)


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """A statistic with the ends of its confidence interval, in the signal's unit; NaN where they are not known."""

    value: float
    low: float = math.nan
    high: float = math.nan


UNKNOWN = Estimate(value=math.nan)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Exceedance:
    """Empirical probability that a maximum between two up-crossings of the mean is above a level, shape (n,).

    Levels rise; they are the maxima themselves, thinned where they are many. `low` and `high` are the bounds of the
    probability's interval at each level.
    """

    level: FloatArray
    probability: FloatArray
    low: FloatArray
    high: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class WeibullFit:
    """Weibull distribution of the upper part of maxima (sign 1) or of the lower part of minima (sign -1).

    With y = sign (x - location), beyond `threshold` (a value of y),

        P(y) = share exp((threshold / scale)^shape - (y / scale)^shape)

    Attributes
    ----------
    sign
        1 for maxima, -1 for minima.
    location
        Mean of the signal, in its unit.
    scale, shape
        Of the Weibull distribution of y.
    threshold
        Value of y from which on the distribution holds.
    share
        Of all maxima, those beyond the threshold.
    count
        Number of maxima beyond the threshold, of all records.
    rate
        Of all maxima, 1/s.
    """

    sign: float
    location: float
    scale: float
    shape: float
    threshold: float
    share: float
    count: int
    rate: float

    def exceedance(self, level: ArrayLike) -> FloatArray:
        """Probability that a maximum is above a level (a minimum, below it); NaN short of the threshold."""
        y = self.sign * (np.asarray(level, dtype=np.float64) - self.location)
        beyond = np.maximum(y, self.threshold)
        tail = self.share * np.exp((self.threshold / self.scale) ** self.shape - (beyond / self.scale) ** self.shape)
        return np.where(y >= self.threshold, tail, np.nan)

    def level(self, probability: ArrayLike) -> FloatArray:
        """Level that a maximum exceeds with a probability, up to `share`; beyond that, of the threshold."""
        ratio = np.minimum(np.asarray(probability, dtype=np.float64) / self.share, 1.0)
        y = self.scale * ((self.threshold / self.scale) ** self.shape - np.log(ratio)) ** (1.0 / self.shape)
        return self.location + self.sign * y


@dataclass(frozen=True, slots=True, kw_only=True)
class GumbelFit:
    """Gumbel distribution of the most of a record, over records: P(X <= x) = exp(-exp(-(x - location) / scale)).

    Attributes
    ----------
    sign
        1 for maxima, -1 for minima, of which sign * x has the distribution.
    location, scale
        In the signal's unit; `location` is sign times the most probable extreme of a record.
    duration
        Of each record, s.
    records
        Number of them.
    expected
        Mean extreme of `exposure`, with its interval.
    """

    sign: float
    location: float
    scale: float
    duration: float
    records: int
    expected: Estimate

    def quantile(self, probability: ArrayLike, exposure: float | None = None) -> FloatArray:
        """Extreme that is not passed with a probability in an exposure (s; of a record without it)."""
        longer = 0.0 if exposure is None else self.scale * math.log(exposure / self.duration)
        p = np.asarray(probability, dtype=np.float64)
        return self.sign * (self.location + longer - self.scale * np.log(-np.log(p)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CycleHistogram:
    """Rainflow cycles of all records by range.

    Attributes
    ----------
    edges
        (n + 1,) of the ranges, in the signal's unit.
    counts
        (n,) cycles per record (halves count 0.5).
    means
        (n,) of the mean values of the cycles of each bin; NaN where it is empty.
    """

    edges: FloatArray
    counts: FloatArray
    means: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SignalStatistics:
    """Statistics of one signal over one record, or over several of one case, in the signal's unit.

    Attributes
    ----------
    name, unit
        As recorded.
    start, duration
        Beginning and length of what is evaluated of each record, s (the shortest one's).
    records
        Number of them.
    mean, low_frequency, wave_frequency, std
        As `tlpsim.scenarios.statistics.bands.BandStatistics`.
    skewness, excess_kurtosis
        Third and fourth standardised central moments; 0 and 0 for a Gaussian signal.
    zero_crossing_period
        Mean time between up-crossings of the mean, s.
    maximum, minimum
        Observed over all records.
    expected_maximum, expected_minimum
        Mean extreme of the exposure, by the Weibull distribution of the maxima.
    weibull_maxima, weibull_minima
        Of the largest value between two up-crossings of the mean, and the lowest between two down-crossings; None
        where there are too few.
    gumbel_maximum, gumbel_minimum
        Of the extremes of records, where there are three or more.
    damage_equivalent_range
        Range whose cycles at 1 Hz do the same damage at the slope; None where it was not asked for.
    cycles
        The cycles that it is of; None where it is None.
    exceedance
        Of the maxima.
    note
        What the reader must know, "" if nothing.
    """

    name: str
    unit: str
    start: float
    duration: float
    records: int
    mean: Estimate
    low_frequency: Estimate
    wave_frequency: Estimate
    std: Estimate
    skewness: Estimate
    excess_kurtosis: Estimate
    zero_crossing_period: Estimate
    maximum: float
    minimum: float
    expected_maximum: Estimate
    expected_minimum: Estimate
    weibull_maxima: WeibullFit | None
    weibull_minima: WeibullFit | None
    gumbel_maximum: GumbelFit | None
    gumbel_minimum: GumbelFit | None
    damage_equivalent_range: Estimate | None
    cycles: CycleHistogram | None
    exceedance: Exceedance
    note: str = ""


def unknown_statistics(name: str, unit: str, start: float, duration: float, records: int) -> SignalStatistics:
    """Statistics of a signal of which nothing is known but these."""
    nothing = np.zeros(0)
    return SignalStatistics(
        name=name,
        unit=unit,
        start=start,
        duration=duration,
        records=records,
        mean=UNKNOWN,
        low_frequency=UNKNOWN,
        wave_frequency=UNKNOWN,
        std=UNKNOWN,
        skewness=UNKNOWN,
        excess_kurtosis=UNKNOWN,
        zero_crossing_period=UNKNOWN,
        maximum=math.nan,
        minimum=math.nan,
        expected_maximum=UNKNOWN,
        expected_minimum=UNKNOWN,
        weibull_maxima=None,
        weibull_minima=None,
        gumbel_maximum=None,
        gumbel_minimum=None,
        damage_equivalent_range=None,
        cycles=None,
        exceedance=Exceedance(level=nothing, probability=nothing, low=nothing, high=nothing),
    )
