"""The largest value of a response in a duration T within a sea state, from the numbers that a table keeps of it.

Either from the frequency domain, by mean, standard deviation, skewness, excess kurtosis, zero-crossing period and
bandwidth: a Hermite transform g of a Gaussian variable whose maximum has the distribution function F(u), eqs. (2) to
(6) of `tlpsim.loads.spectral.extremes`,

    P(max <= x) = F(u),   u the largest with mean + std g(u) <= x                                        (1)

or from the time domain, by the Weibull distribution of the largest maxima between crossings of the mean, which come
at the rate r (eq. (1) of `tlpsim.scenarios.statistics.extremes`), independently of each other:

    P(max <= x) = exp(-r T P(y)),   y = x - mean                                                         (2)

Below the threshold u of the fit, where P(u) = share, the Weibull distribution of the same shape c that has no maximum
below the mean stands in:

    P(y) = share^((y / u)^c),  0 <= y <= u;     P(y) = 1,  y < 0                                         (3)

Of a hundred maxima and more the largest is never there. Durations in which there are less than some ten maxima are
not what eqs. (2) and (3) are for. Minima are the maxima of the response turned round.

Records here hold columns: a row is one sea state, or one record (seed) of it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import log_ndtr

from tlpsim.loads.spectral.extremes import clump_count, hermite_coefficients, vanmarcke_bandwidth
from tlpsim.loads.spectral.records import Quantity
from tlpsim.scenarios.results import ResultsError
from tlpsim.scenarios.statistics.records import WeibullFit

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# Of u. Linear interpolation of g errs by 5e-5 g'', which moves a probability by 1e-4 of itself at most.
_GRID = np.linspace(-8.0, 12.0, 1001)
_MIDDLE = 400  # u = 0
_PARTS = 2000  # of an integral over probability
_ROWS = 1000  # at once
_MEAN_NUMBERS = -np.log((np.arange(_PARTS) + 0.5) / _PARTS)

_Law = TypeVar("_Law", bound="SpectralExtremes | WeibullExtremes")


class ShortTermExtremes(Protocol):
    """What both kinds have in common: r rows, each the distribution of the extreme of a sea state.

    `sign` is 1 for maxima and -1 for minima. Rows that are not `known` (r,) hold numbers that make no distribution, NaN
    as a rule, and give NaN. Durations are in s, levels in the response's unit.
    """

    @property
    def sign(self) -> float:
        """1 for maxima, -1 for minima."""
        ...

    @property
    def known(self) -> BoolArray:
        """Rows whose numbers make a distribution, (r,)."""
        ...

    @property
    def remarks(self) -> tuple[str, ...]:
        """What the reader must know of the rows."""
        ...

    def probability_of_exceedance(self, level: ArrayLike, duration: float) -> FloatArray:
        """Probability that the maximum is above levels (k,), the minimum below them: (r, k)."""
        ...

    def quantile(self, probability: float, duration: float) -> FloatArray:
        """Levels that the extreme does not pass with a probability, (r,)."""
        ...

    def expected(self, duration: float) -> FloatArray:
        """Means of the extreme, (r,)."""
        ...

    def levels_passed(self, number: ArrayLike, duration: float) -> FloatArray:
        """Levels that are passed by expected numbers -ln P(max <= x), (k,): (r, k)."""
        ...

    def rows_of(self, chosen: slice | NDArray[np.int64] | BoolArray) -> ShortTermExtremes:
        """The same of some rows."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpectralExtremes:
    """Extremes by the frequency domain, eq. (1).

    Attributes
    ----------
    sign
        1 for maxima, -1 for minima.
    mean, deviation, skewness, excess_kurtosis
        Of the response, (r,) or a number for all rows, in its unit.
    zero_crossing_period
        Of its up-crossings of the mean, s; of no meaning where the deviation is 0.
    bandwidth
        `tlpsim.loads.spectral.extremes.vanmarcke_bandwidth`; infinite: crossings independent of each other.
    coefficients
        h1, h2, h3 of the Hermite models and the part of each that is attained, (4, r); found from the others.
    """

    sign: float
    mean: FloatArray
    deviation: FloatArray
    skewness: FloatArray
    excess_kurtosis: FloatArray
    zero_crossing_period: FloatArray
    bandwidth: FloatArray
    coefficients: FloatArray | None = None

    def __post_init__(self) -> None:
        _make_columns(self, ("coefficients",))
        if self.coefficients is None:
            found = np.full((4, len(self.mean)), np.nan)
            known = self.known
            h, attained = hermite_coefficients(self.skewness[known], self.excess_kurtosis[known])
            found[:, known] = [*h, attained]
            object.__setattr__(self, "coefficients", found)

    @property
    def known(self) -> BoolArray:
        """Rows with finite moments that a distribution can have, and a period unless they do not move, (r,)."""
        finite = np.isfinite(self.mean) & np.isfinite(self.deviation) & (self.deviation >= 0.0)
        shaped = np.isfinite(self.skewness) & np.isfinite(self.excess_kurtosis)
        with np.errstate(invalid="ignore"):
            shaped &= self.excess_kurtosis >= self.skewness**2 - 2.0 - 1e-9
            moving = (
                (self.zero_crossing_period > 0.0) & np.isfinite(self.zero_crossing_period) & (self.bandwidth >= 0.0)
            )
        return finite & ((shaped & moving) | (self.deviation == 0.0))

    @property
    def remarks(self) -> tuple[str, ...]:
        """Rows with a shape that no Hermite model has."""
        assert self.coefficients is not None
        part = self.coefficients[3][self._moving & self.known]
        short = part[part < 1.0]
        if not len(short):
            return ()
        return (
            f"{len(short)} of {len(self.mean)} distributions have a skewness and kurtosis that no Hermite model has; "
            f"{np.min(short):.0%} of the skewness is modelled at least",
        )

    @property
    def _moving(self) -> BoolArray:
        return np.asarray(self.deviation > 0.0)

    def probability_of_exceedance(self, level: ArrayLike, duration: float) -> FloatArray:
        """Probability that the maximum is above levels (k,), the minimum below them: (r, k)."""
        _require_duration(duration)
        at = self.sign * np.atleast_1d(np.asarray(level, dtype=np.float64))
        found = np.full((len(self.mean), len(at)), np.nan)
        still = self.known & ~self._moving
        found[still] = at[np.newaxis] < self.sign * self.mean[still, np.newaxis]
        for rows, table, crossings in self._tables(duration):
            values = (at - self.sign * self.mean[rows, np.newaxis]) / self.deviation[rows, np.newaxis]
            u = np.stack(
                [
                    np.interp(value, row, _GRID, left=-np.inf, right=np.inf)
                    for value, row in zip(values, table, strict=True)
                ]
            )
            count = clump_count(u, crossings, self.bandwidth[rows, np.newaxis])
            found[rows] = -np.expm1(log_ndtr(u) - count)
        return found

    def quantile(self, probability: float, duration: float) -> FloatArray:
        """Levels that the extreme does not pass with a probability, (r,)."""
        _require_probability(probability)
        return self.levels_passed(-math.log(probability), duration)[:, 0]

    def levels_passed(self, number: ArrayLike, duration: float) -> FloatArray:
        """Levels that are passed by expected numbers -ln P(max <= x), (k,): (r, k)."""
        _require_duration(duration)
        wanted = -np.log(np.atleast_1d(np.asarray(number, dtype=np.float64)))
        found = np.repeat(np.where(self.known, self.mean, np.nan)[:, np.newaxis], len(wanted), axis=1)
        for rows, table, crossings in self._tables(duration):
            count = clump_count(_GRID, crossings, self.bandwidth[rows, np.newaxis])
            order = -np.log(count - log_ndtr(_GRID))  # of which u is a smooth function
            value = [
                np.interp(np.interp(wanted, each, _GRID), _GRID, row) for each, row in zip(order, table, strict=True)
            ]
            found[rows] += self.sign * self.deviation[rows, np.newaxis] * np.array(value)
        return found

    def expected(self, duration: float) -> FloatArray:
        """Means of the extreme, (r,)."""
        _require_duration(duration)
        found = np.where(self.known, self.mean, np.nan)
        for rows, table, crossings in self._tables(duration):
            count = clump_count(_GRID, crossings, self.bandwidth[rows, np.newaxis])
            weight = np.diff(np.exp(log_ndtr(_GRID) - count), axis=1)
            value = np.sum(weight * 0.5 * (table[:, 1:] + table[:, :-1]), axis=1)
            found[rows] = self.mean[rows] + self.sign * self.deviation[rows] * value
        return found

    def rows_of(self, chosen: slice | NDArray[np.int64] | BoolArray) -> SpectralExtremes:
        """The same of some rows."""
        return _rows_of(self, chosen)

    def _tables(self, duration: float) -> Iterator[tuple[NDArray[np.int64], FloatArray, FloatArray]]:
        """Some moving rows at a time: which, g of eq. (4) of the extremes on the grid, and nu_u T (rows, 1)."""
        assert self.coefficients is not None
        moving = np.flatnonzero(self.known & self._moving)
        for first in range(0, len(moving), _ROWS):
            rows = moving[first : first + _ROWS]
            a, b, c = self.coefficients[:3, rows, np.newaxis]
            b = self.sign * b  # turned round, the response has the same cubic but for this
            table = ((c * _GRID + b) * _GRID + (a - 3.0 * c)) * _GRID - b
            # Held where g turns.
            np.maximum.accumulate(table[:, _MIDDLE:], axis=1, out=table[:, _MIDDLE:])
            below = table[:, _MIDDLE::-1]
            np.minimum.accumulate(below, axis=1, out=below)
            slope = np.sqrt(a**2 + 4.0 * b**2 + 18.0 * c**2)
            yield rows, table, duration / (self.zero_crossing_period[rows, np.newaxis] * slope)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WeibullExtremes:
    """Extremes by the time domain, eqs. (2) and (3): the numbers of `WeibullFit`, (r,) each; NaN where there is none.

    A scale of 0 is that of a signal that does not move, at `location`.
    """

    sign: float
    location: FloatArray
    scale: FloatArray
    shape: FloatArray
    threshold: FloatArray
    share: FloatArray
    rate: FloatArray

    def __post_init__(self) -> None:
        _make_columns(self, ())

    @property
    def known(self) -> BoolArray:
        """Rows that hold a fit, or a signal that does not move, (r,)."""
        positive = [each for each in (self.scale, self.shape, self.threshold, self.share, self.rate)]
        fitted = np.all([np.isfinite(each) & (each > 0.0) for each in positive], axis=0) & (self.share <= 1.0)
        return np.asarray(np.isfinite(self.location) & (fitted | (self.scale == 0.0)))

    @property
    def remarks(self) -> tuple[str, ...]:
        """Nothing."""
        return ()

    def probability_of_exceedance(self, level: ArrayLike, duration: float) -> FloatArray:
        """Probability that the maximum is above levels (k,), the minimum below them: (r, k)."""
        _require_duration(duration)
        at = np.atleast_1d(np.asarray(level, dtype=np.float64))
        location, scale, shape, threshold, share, rate = self._columns
        y = self.sign * (at - location)
        moving = scale > 0.0
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            beyond, within = np.maximum(y, threshold), np.clip(y, 0.0, threshold)
            tail = share * np.exp((threshold / scale) ** shape - (beyond / scale) ** shape)
            each = np.where(y >= threshold, tail, share ** ((within / threshold) ** shape))
            passed = -np.expm1(-rate * duration * each)
        return np.where(self.known[:, np.newaxis], np.where(moving, passed, 1.0 * (y < 0.0)), np.nan)

    def quantile(self, probability: float, duration: float) -> FloatArray:
        """Levels that the extreme does not pass with a probability, (r,)."""
        _require_probability(probability)
        return self.levels_passed(-math.log(probability), duration)[:, 0]

    def levels_passed(self, number: ArrayLike, duration: float) -> FloatArray:
        """Levels that are passed by expected numbers -ln P(max <= x), (k,): (r, k)."""
        _require_duration(duration)
        location, scale, shape, threshold, share, rate = self._columns
        with np.errstate(divide="ignore", invalid="ignore"):
            chance = np.atleast_1d(np.asarray(number, dtype=np.float64)) / (rate * duration)
            tail = np.maximum((threshold / scale) ** shape - np.log(chance / share), 0.0)
            below = threshold * (np.log(np.minimum(chance, 1.0)) / np.log(share)) ** (1.0 / shape)
            y = np.where(chance <= share, scale * tail ** (1.0 / shape), below)
        y = np.where(scale > 0.0, y, 0.0)
        return np.where(self.known[:, np.newaxis], location + self.sign * y, np.nan)

    def expected(self, duration: float) -> FloatArray:
        """Means of the extreme, (r,), by the integral of eq. (3) of `tlpsim.scenarios.statistics.extremes`."""
        _require_duration(duration)
        parts = range(0, len(self.location), _ROWS)
        return np.concatenate(
            [np.mean(self.rows_of(slice(k, k + _ROWS)).levels_passed(_MEAN_NUMBERS, duration), axis=1) for k in parts]
            or [np.zeros(0)]
        )

    def rows_of(self, chosen: slice | NDArray[np.int64] | BoolArray) -> WeibullExtremes:
        """The same of some rows."""
        return _rows_of(self, chosen)

    @property
    def _columns(self) -> tuple[FloatArray, ...]:
        names = ("location", "scale", "shape", "threshold", "share", "rate")
        return tuple(getattr(self, name)[:, np.newaxis] for name in names)


def spectral_extremes(quantities: Sequence[Quantity], sign: float) -> SpectralExtremes:
    """Extremes of one quantity in each of r sea states, by their spectra; `sign` 1 for maxima, -1 for minima."""
    rates = np.array([each.zero_crossing_rate for each in quantities])
    with np.errstate(divide="ignore"):
        period = 1.0 / rates
    return SpectralExtremes(
        sign=sign,
        mean=np.array([each.mean for each in quantities]),
        deviation=np.array([each.spread() for each in quantities]),
        skewness=np.array([each.skewness for each in quantities]),
        excess_kurtosis=np.array([each.excess_kurtosis for each in quantities]),
        zero_crossing_period=period,
        bandwidth=np.array([vanmarcke_bandwidth(each.frequency, each.density) for each in quantities]),
    )


def weibull_extremes(fits: Sequence[WeibullFit | None], sign: float) -> WeibullExtremes:
    """Extremes of one signal in each of r records, by the fits of its maxima (sign 1) or minima (-1); None unknown.

    Raises
    ------
    ResultsError
        When a fit is of the other side.
    """
    wrong = [each for each in fits if each is not None and each.sign != sign]
    if wrong:
        raise ResultsError(f"extremes: a fit has sign {wrong[0].sign:g} and not {sign:g}; give fits of one side")

    def column(name: str) -> FloatArray:
        return np.array([math.nan if each is None else getattr(each, name) for each in fits])

    return WeibullExtremes(
        sign=sign,
        location=column("location"),
        scale=column("scale"),
        shape=column("shape"),
        threshold=column("threshold"),
        share=column("share"),
        rate=column("rate"),
    )


def _make_columns(law: SpectralExtremes | WeibullExtremes, others: tuple[str, ...]) -> None:
    """Give every field but the sign and `others` the same shape (r,)."""
    if law.sign not in (1.0, -1.0):
        raise ResultsError(f"extremes: sign is {law.sign}; it must be 1 for maxima or -1 for minima")
    names = [each.name for each in fields(law) if each.name not in ("sign", *others)]
    columns = [np.atleast_1d(np.asarray(getattr(law, name), dtype=np.float64)) for name in names]
    rows = max(len(each) for each in columns)
    for name, column in zip(names, columns, strict=True):
        if column.ndim != 1 or len(column) not in (1, rows):
            raise ResultsError(f"extremes: {name} has the shape {column.shape}; all must have the same rows, ({rows},)")
        object.__setattr__(law, name, np.broadcast_to(column, (rows,)))


def _rows_of(law: _Law, chosen: slice | NDArray[np.int64] | BoolArray) -> _Law:
    columns = {
        each.name: getattr(law, each.name)[..., chosen]
        for each in fields(law)
        if each.name != "sign" and getattr(law, each.name) is not None
    }
    return replace(law, **columns)


def _require_duration(duration: float) -> None:
    if not (math.isfinite(duration) and duration > 0.0):
        raise ResultsError(f"extremes: duration is {duration} s; it must be above 0")


def _require_probability(probability: float) -> None:
    if not 0.0 < probability < 1.0:
        raise ResultsError(f"extremes: probability of the quantile is {probability}; it must be between 0 and 1")
