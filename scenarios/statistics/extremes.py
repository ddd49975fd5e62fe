"""Distributions of maxima and of extremes of records: Weibull tails, Gumbel over records, expected extremes.

A maximum is the largest value between two up-crossings of the mean. Of y, maxima less the mean, the largest follow

    P(y) = share exp((u / a)^c - (y / a)^c),    y > u                                                     (1)

a Weibull distribution cut off below the threshold u, fitted by maximum likelihood to those above it. For a shape c the
likelihood is greatest with the scale a, and of all shapes with c, where

    a^c = mean(y^c - u^c),      1 / c + mean(ln y) = mean(y^c ln y - u^c ln u) / mean(y^c - u^c)              (2)

Of a Gaussian signal with any spectrum c is 2 in the tail. Where waves ride on slow drift the small maxima, of waves
that cross the mean while the drift is near it, are of another kind, and are not in the fit. Thirty maxima alone may
have any c: a prior, ln c about ln 2 with a spread of 1, keeps them from absurd ones, and is lost in a hundred.

With the rate r of maxima above u, an exposure T is expected to have r T exp((u / a)^c - (y / a)^c) maxima above y, and
its largest one has the mean

    E = mean + integral over p in (0, 1) of y(p) dp,   y(p) = a ((u / a)^c - ln(-ln p / (r T)))^(1 / c)     (3)

The largest values of whole records follow P(X <= x) = exp(-exp(-(x - b) / s)) (Gumbel). With the mean l_1 of n records
and half the mean difference of two of them, l_2 (L-moments: Hosking, Journal of the Royal Statistical Society B 52,
1990), b and s have no bias at any n:

    s = l_2 / ln 2,      b = l_1 - 0.5772 s                                                              (4)

An exposure T of records of T_0 shifts b by s ln(T / T_0).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from tlpsim.scenarios.statistics.intervals import (
    Events,
    level_interval,
    quantile,
    ratio_interval,
    standard_error,
    waves,
)
from tlpsim.scenarios.statistics.records import EULER, Estimate, Exceedance, GumbelFit, WeibullFit

FloatArray = NDArray[np.float64]

TAIL_FACTOR = 1.5
"""of n^(2/3), the number of maxima that the distribution is fitted to: one fifth of 400, one tenth of 3400"""
FEWEST_IN_TAIL = 30
FEWEST_MAXIMA = 20
FEWEST_RECORDS = 3
PRIOR_SHAPE, PRIOR_SPREAD = 2.0, 1.0
"""Of the shape, that of a Gaussian signal, and of its logarithm."""
FEWEST_PARTS = 6
"""of all records, for the jackknife"""

_LEVELS = 300  # of an exceedance
_PARTS = 2000  # of the integral in eq. (3)
_MEAN_NUMBERS = -np.log((np.arange(_PARTS) + 0.5) / _PARTS)
_SHAPES = (0.05, 200.0)  # between which the likeliest one is looked for
_ALIKE = 1e-6  # of the largest maximum: spread of the tail below which there is no distribution


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Maxima:
    """Maxima of one record, less the mean: `value` (k,) and the `events` that they are."""

    value: FloatArray
    events: Events


def up_crossings(fluctuation: FloatArray) -> NDArray[np.int64]:
    """Indices of the first samples after up-crossings of zero."""
    return np.flatnonzero((fluctuation[:-1] < 0.0) & (fluctuation[1:] >= 0.0)) + 1


def maxima_between_crossings(fluctuation: FloatArray, step: float) -> Maxima:
    """Largest value of a fluctuation (samples,) at a step (s) between each up-crossing of zero and the next one."""
    first = up_crossings(fluctuation)
    duration = len(fluctuation) * step
    if len(first) < 2:
        return Maxima(value=np.zeros(0), events=Events(place=np.zeros(0), duration=duration))
    # The middle of a cycle stands for the time of its maximum: the slow cosines cannot tell them apart.
    place = 0.5 * (first[:-1] + first[1:]) / len(fluctuation)
    return Maxima(value=np.maximum.reduceat(fluctuation, first)[:-1], events=Events(place=place, duration=duration))


def fit_weibull(
    maxima: FloatArray, *, location: float = 0.0, sign: float = 1.0, time: float = 1.0
) -> WeibullFit | None:
    """Weibull distribution of the largest maxima, eq. (2); None where they are too few, or all alike.

    Parameters
    ----------
    maxima
        (k,) less the mean; of minima, the mean less the minimum.
    location, sign
        Of the record that is returned.
    time
        In which the maxima were seen, s.
    """
    count = len(maxima)
    if count < FEWEST_MAXIMA:
        return None
    tail = min(max(round(TAIL_FACTOR * count ** (2.0 / 3.0)), FEWEST_IN_TAIL), count - 1)
    ordered = np.sort(maxima)
    # Half way to the largest maximum left out: at the least one in the tail, that one would count as none.
    threshold = 0.5 * float(ordered[-tail - 1] + ordered[-tail])
    largest = float(ordered[-1])
    if not (threshold > 0.0 and np.mean(ordered[-tail:]) - threshold > _ALIKE * largest):
        return None
    shape, scale = _likeliest(ordered[-tail:] / largest, threshold / largest)
    return WeibullFit(
        sign=sign,
        location=location,
        scale=scale * largest,
        shape=shape,
        threshold=threshold,
        share=tail / count,
        count=tail,
        rate=count / time,
    )


def _likeliest(y: FloatArray, u: float) -> tuple[float, float]:
    """Shape and scale of eq. (2), the shape within its limits."""
    logarithm, mean_logarithm, log_u = np.log(y), float(np.mean(np.log(y))), math.log(u)

    def excess(shape: float) -> float:
        power, power_u = y**shape, u**shape
        above = float(np.mean(power)) - power_u
        return (
            1.0 / shape
            + mean_logarithm
            - (float(np.mean(power * logarithm)) - power_u * log_u) / above
            - math.log(shape / PRIOR_SHAPE) / (shape * len(y) * PRIOR_SPREAD**2)
        )

    low, high = _SHAPES
    if excess(low) <= 0.0:
        shape = low
    elif excess(high) >= 0.0:
        shape = high
    else:
        shape = float(brentq(excess, low, high, rtol=1e-9))
    return shape, float((np.mean(y**shape) - u**shape) ** (1.0 / shape))


def expected_extreme(records: Sequence[Maxima], fit: WeibullFit, exposure: float, confidence: float) -> Estimate:
    """Mean extreme of an exposure (s) by eq. (3), with its interval; in the signal's unit.

    The interval is by the jackknife: with each of six or more equal parts of the records left out in turn, the whole
    fit is made again. It is by the logarithm of the distance from the mean.

    Parameters
    ----------
    records
        Maxima of each record, from all of which the fit was made.
    """
    value = np.concatenate([each.value for each in records])
    most = _expected(fit, value, exposure)
    parts = -(-FEWEST_PARTS // len(records))
    part = np.concatenate(
        [
            np.minimum(each.events.place * parts, parts - 1).astype(np.int64) + k * parts
            for k, each in enumerate(records)
        ]
    )
    total = parts * len(records)
    time = len(value) / fit.rate * (total - 1) / total
    found = []
    for number in range(total):
        rest = value[part != number]
        again = fit_weibull(rest, time=time)
        found.append(math.nan if again is None else math.log(_expected(again, rest, exposure)))
    error = math.sqrt((total - 1) * float(np.var(found)))
    interval = ratio_interval(most, error, total - 1.0, confidence)
    ends = sorted(fit.location + fit.sign * end for end in (interval.low, interval.high))
    return Estimate(value=fit.location + fit.sign * most, low=ends[0], high=ends[1])


def _expected(fit: WeibullFit, value: FloatArray, exposure: float) -> float:
    """Mean of the most, less the mean of the signal, eq. (3): below the threshold by the maxima themselves."""
    chance = _MEAN_NUMBERS / (fit.rate * fit.share * exposure)  # over the share: of a maximum being higher
    above = chance < 1.0
    ratio = (fit.threshold / fit.scale) ** fit.shape
    total = np.sum(fit.scale * (ratio - np.log(chance[above])) ** (1.0 / fit.shape))
    if not above.all():
        total += np.sum(np.quantile(value, np.maximum(1.0 - fit.share * chance[~above], 0.0)))
    return float(total) / _PARTS


def exceedance(records: Sequence[Maxima], mean: float, cosines: int, confidence: float) -> Exceedance:
    """Share of the maxima at or above levels, with its interval.

    The levels are maxima: the largest ones, and of the smaller ones some.

    Parameters
    ----------
    records
        Maxima of each record, less `mean`.
    cosines
        For the intervals, see `tlpsim.scenarios.statistics.intervals`.
    """
    value = np.concatenate([each.value for each in records])
    count = len(value)
    if not count:
        return Exceedance(level=value, probability=value, low=value, high=value)
    durations = np.array([each.events.duration for each in records])
    owner = np.repeat(np.arange(len(records)), [len(each.value) for each in records])
    order = np.argsort(value)[::-1]
    ranks = np.unique(np.round(np.geomspace(1, count, min(_LEVELS, count))).astype(np.int64))
    shares = ranks / (count + 1.0)
    shapes = waves(np.concatenate([each.events.place for each in records]), cosines)[order]
    projections = []
    for number, duration in enumerate(durations):
        above = np.cumsum(np.where(owner[order, np.newaxis] == number, shapes, 0.0), axis=0)
        # Of each maximum the influence on the logarithm of a share is 1 / share, where it is above, less 1.
        relative = above[ranks - 1] / shares[:, np.newaxis] - above[-1]
        projections.append(relative * (np.sum(durations) / (count * duration)))
    errors, freedom = standard_error(np.stack(projections, axis=1), durations)
    factors = np.exp(np.minimum(quantile(freedom, confidence) * errors, 700.0))
    return Exceedance(
        level=mean + value[order][ranks - 1][::-1],
        probability=shares[::-1],
        low=(shares / factors)[::-1],
        high=np.minimum(shares * factors, 1.0)[::-1],
    )


def fit_gumbel(
    extremes: FloatArray, duration: float, exposure: float, confidence: float, sign: float = 1.0
) -> GumbelFit | None:
    """Gumbel distribution of the extremes of records, eq. (4); None of fewer than three.

    Parameters
    ----------
    extremes
        (n,) in the signal's unit: of each record the maximum, or with `sign` -1 the minimum.
    duration
        Of each record, s.
    exposure
        For the expected extreme, s.
    """
    count = len(extremes)
    if count < FEWEST_RECORDS:
        return None
    most = sign * extremes
    longer = math.log(exposure / duration)
    location, scale = _gumbel(most)
    found = location + scale * (EULER + longer)
    fits = (_gumbel(np.delete(most, k)) for k in range(count))
    without = np.array([b + s * (EULER + longer) for b, s in fits])
    error = math.sqrt((count - 1.0) * float(np.var(without)))  # jackknife
    interval = level_interval(sign * found, error, count - 1.0, confidence)
    return GumbelFit(sign=sign, location=location, scale=scale, duration=duration, records=count, expected=interval)


def _gumbel(most: FloatArray) -> tuple[float, float]:
    """Location and scale, eq. (4)."""
    count = len(most)
    first = float(np.mean(most))
    place = (2.0 * np.arange(count) - count + 1.0) / (count - 1.0)
    scale = float(np.mean(place * np.sort(most))) / math.log(2.0)
    return first - EULER * scale, scale
