"""Confidence intervals of statistics of correlated records, by projections on slow cosines.

Each statistic here is a smooth function of averages over time, so that its error is, to first order, the average over
the record of an influence function g(t): of the mean, x - mean; of the variance, (x - mean)^2 - variance; of a rate of
events, their impulses less the rate; and so on. The average and the projections

    c_0 = (1/T) integral g dt,      c_j = (sqrt(2)/T) integral g cos(pi j t / T) dt,  j = 1 ... B          (1)

are uncorrelated, and all have the variance S(0) / T where the two-sided spectrum S of g is level up to B / (2 T) Hz.
So the squares of c_1 ... c_B tell the variance of c_0, however g is correlated (equal-weighted cosines: Mueller,
Journal of Econometrics 141, 2007; Lazarus, Lewis, Stock and Watson, Journal of Business and Economic Statistics 36,
2018). Over n records of durations T_r the c_0 of each, less their mean, tell it too, and

    se^2 = sum_r (T_r / sum T) (c_r0^2 + c_r1^2 + ... + c_rB^2) / dof,    dof = n B + n - 1                 (2)

is that of the average over all. The interval is that of Student's t with dof degrees of freedom, for a function of the
statistic that is nearly Gaussian: the cube root of a variance (Wilson and Hilferty, 1931), the logarithm of a rate, the
reciprocal of a mean of fourth powers.

B is small on purpose. The slow drift of a tension leg platform comes in groups of many minutes, and what B / (2 T)
loses of them makes an interval too narrow; fewer cosines make it wider by t alone. `docs/statistics.md` has the
coverage.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from tlpsim.scenarios.statistics.records import Estimate

FloatArray = NDArray[np.float64]

SECONDS_PER_COSINE = 1800.0
"""of a record: half a wave of the highest cosine takes this long, s"""
FEWEST_COSINES, MOST_COSINES = 4, 12


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Events:
    """Events in a record: `place` (k,), where they are as a part of its `duration` (s)."""

    place: FloatArray
    duration: float


def cosine_count(duration: float) -> int:
    """Number of cosines, B of eq. (1), for records of a duration (s)."""
    return min(max(round(duration / SECONDS_PER_COSINE), FEWEST_COSINES), MOST_COSINES)


def sample_projections(influence: FloatArray, count: int) -> FloatArray:
    """Projections of eq. (1) of influence functions at equal steps, (..., samples), on B = `count` cosines.

    Returns
    -------
    FloatArray
        (..., B + 1), c_0 first.
    """
    return influence @ _cosines(influence.shape[-1], count)


def event_projections(events: Sequence[Events], weights: Sequence[FloatArray], count: int) -> FloatArray:
    """Projections of eq. (1) of impulses, on B = `count` cosines.

    Parameters
    ----------
    events
        Of each record.
    weights
        Of each event, (k,): the error of the statistic is their sum by the time, so that they have its unit times s.

    Returns
    -------
    FloatArray
        (records, B + 1), c_0 first.
    """
    pairs = zip(events, weights, strict=True)
    return np.stack([weight @ waves(each.place, count) / each.duration for each, weight in pairs])


def standard_error(projections: FloatArray, durations: FloatArray) -> tuple[FloatArray, float]:
    """Standard errors of averages over records, eq. (2), and their degrees of freedom.

    Parameters
    ----------
    projections
        Of each record, (..., n, B + 1).
    durations
        (n,), s.

    Returns
    -------
    tuple[FloatArray, float]
        (...,) and one number.
    """
    weight = durations / np.sum(durations)
    scatter = np.array(projections)
    scatter[..., 0] -= (scatter[..., 0] @ weight)[..., np.newaxis]
    records, count = scatter.shape[-2:]
    freedom = records * count - 1.0
    return np.sqrt(np.einsum("...ij,...ij,i->...", scatter, scatter, weight) / freedom), freedom


def level_interval(value: float, error: float, freedom: float, confidence: float) -> Estimate:
    """Interval of a quantity of any sign: value ± t error."""
    reach = quantile(freedom, confidence) * error
    return Estimate(value=value, low=value - reach, high=value + reach)


def ratio_interval(value: float, relative_error: float, freedom: float, confidence: float) -> Estimate:
    """Interval of a positive quantity, by its logarithm."""
    factor = math.exp(min(quantile(freedom, confidence) * relative_error, 700.0))
    return Estimate(value=value, low=value / factor, high=value * factor)


def spread_interval(value: float, relative_error: float, freedom: float, confidence: float) -> Estimate:
    """Interval of a standard deviation, from the relative standard error of its square.

    The upper bound is infinite where so few swings were seen that the data cannot tell one.
    """
    part = relative_error**2 / 9.0  # 2 / (9 nu), with nu the degrees of freedom of a chi-squared variance
    reach = quantile(freedom, confidence) * math.sqrt(part)
    low, high = 1.0 - part + reach, 1.0 - part - reach
    return Estimate(value=value, low=value / low**1.5, high=math.inf if high <= 0.0 else value / high**1.5)


def reciprocal_interval(value: float, relative_error: float, freedom: float, confidence: float) -> Estimate:
    """Interval of a positive quantity that rare large values make, such as a mean of fourth powers, by its reciprocal.

    The upper bound is infinite where so few of them were seen that the data cannot tell one.
    """
    reach = quantile(freedom, confidence) * relative_error
    return Estimate(value=value, low=value / (1.0 + reach), high=math.inf if reach >= 1.0 else value / (1.0 - reach))


def quantile(freedom: float, confidence: float) -> float:
    """Of Student's t: what an error does not pass on either side, with the confidence."""
    return float(stdtrit(freedom, 0.5 + 0.5 * confidence))


def waves(place: FloatArray, count: int) -> FloatArray:
    """One and the B cosines of eq. (1) at places, parts of the duration: (places, B + 1)."""
    made = math.sqrt(2.0) * np.cos(math.pi * place[:, np.newaxis] * np.arange(count + 1))
    made[:, 0] = 1.0
    return made


@lru_cache(maxsize=4)
def _cosines(samples: int, count: int) -> FloatArray:
    made = waves((np.arange(samples) + 0.5) / samples, count) / samples
    made.flags.writeable = False
    return made
