"""Long-term extremes: return values of a response over the sea states of a scatter diagram.

Of sea states i of the duration D with probabilities p_i, of sum 1, and distributions F_i of the extreme of a response
in each (`tlpsim.scenarios.statistics.short_term`), the extreme of any D has the distribution

    F(x) = sum p_i F_i(x),      Q(x) = 1 - F(x)                                                          (1)

The N-year return value is the level that is passed in one of the n = N years / D periods on average,

    n Q(x_N) = 1                                                                                        (2)

and with periods independent of each other the extreme of N years has the distribution F^n. x_N is its most probable
value, or near it, and is passed in N years with the probability 0.63. The share of a sea state in what passes x_N is

    p_i Q_i(x_N) / Q(x_N)                                                                                (3)

Eq. (1) takes one extreme from each period, as it is. Averaged as if every period went through all sea states,

    F(x) = exp(sum p_i ln F_i(x))                                                                        (4)

counts every up-crossing, those of one storm too as if they came in different years. By the inequality of means it gives
lower F and higher levels, the more so the more often a governing sea state passes x_N within D. (Naess, Applied Ocean
Research 6, 1984; Naess and Moan, Stochastic Dynamics of Marine Structures, 2013, ch. 12; DNV-RP-C205.)

Several rows of a sea state are records that differ in their seeds, each with a fit that errs. Their levels are averaged

    x_i(v) = mean_j x_ij(v),      v = -ln F                                                              (5)

and not their F_ij, of which the one whose fit has the heaviest tail would make the mean: that puts the 100-year value
of waves 5 % too high, of slow drift 10 %, with however many records. By eq. (5) the error goes with their number. What
they differ by gives an interval, by the jackknife in strata: with x_ij the return value without record j of the r_i of
sea state i, its error has the variance

    sum_i v_i,   v_i = (r_i - 1) / r_i sum_j (x_ij - mean_j x_ij)^2                                      (6)

and (sum v_i)^2 / sum(v_i^2 / (r_i - 1)) degrees of freedom (Welch and Satterthwaite). It says how far the seeds may be
off, and nothing of the sea states' probabilities. With one record a sea state there is no interval, and since the
record with the heaviest tail among them has the most to say, the 100-year value is 4 to 8 % high.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.scenarios.results import ResultsError
from tlpsim.scenarios.statistics.intervals import level_interval
from tlpsim.scenarios.statistics.long_term_mixture import Mixture, between, bracket, exceedances, mixture, solve
from tlpsim.scenarios.statistics.records import Estimate
from tlpsim.scenarios.statistics.sea_states import (
    LARGEST_SHARE_ALONE,
    YEAR,
    Contribution,
    Rows,
    SeaStates,
    assign_rows,
    contributions,
)
from tlpsim.scenarios.statistics.short_term import ShortTermExtremes, WeibullExtremes

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_CURVE = 201
_BODY, _BEYOND = 0.5, 0.1  # ends of the curve: exceedance, and of the rarest one that is asked for


@dataclass(frozen=True, slots=True, kw_only=True)
class ReturnValue:
    """A level that is passed once in N years, in the response's unit.

    Attributes
    ----------
    years
        N.
    level
        Of eq. (2), with the interval of eq. (6); NaN for its ends where sea states have one record each.
    ergodic
        Of eqs. (2) and (4).
    fractiles
        Pairs of a probability and the level that the extreme of N years does not pass with it.
    contributions
        Of eq. (3), largest first, those of 1e-4 and more.
    """

    years: float
    level: Estimate
    ergodic: float
    fractiles: tuple[tuple[float, float], ...]
    contributions: tuple[Contribution, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LongTermExtreme:
    """Long-term extremes of a response.

    Attributes
    ----------
    signal, unit
        Of the response.
    sign
        1 for maxima, -1 for minima.
    duration
        Of a sea state, s.
    covered, missing
        Probability of the sea states that have an answer, and 1 less it.
    without_answer
        Names of those that have none: no row, or rows of NaN.
    level, exceedance
        (k,) levels outwards, falling for minima, and the probability Q that a period passes each.
    returns
        One of each number of years.
    notes
        What the reader must know.
    """

    signal: str
    unit: str
    sign: float
    duration: float
    covered: float
    missing: float
    without_answer: tuple[str, ...]
    level: FloatArray
    exceedance: FloatArray
    returns: tuple[ReturnValue, ...]
    notes: tuple[str, ...]

    @property
    def side(self) -> str:
        """ "maximum" or "minimum"."""
        return "maximum" if self.sign > 0.0 else "minimum"

    @property
    def lines(self) -> tuple[str, ...]:
        """A line for each return value, then the notes."""
        found = []
        for each in self.returns:
            ends = f" ({each.level.low:.4g}, {each.level.high:.4g})" if math.isfinite(each.level.low) else ""
            governs = "".join(f", governed by {part.name} with {part.share:.0%}" for part in each.contributions[:1])
            what = f"{self.signal} {each.years:g}-year {self.side}"
            found.append(f"{what} {each.level.value:.4g}{ends} {self.unit}{governs}")
        return (*found, *(f"note: {note}" for note in self.notes))


def long_term_extreme(
    states: SeaStates,
    law: ShortTermExtremes,
    *,
    signal: str,
    unit: str,
    state: ArrayLike | None = None,
    years: Sequence[float] = (1.0, 10.0, 100.0),
    fractiles: Sequence[float] = (0.5, 0.9),
    renormalise: bool = True,
    confidence: float = 0.95,
) -> LongTermExtreme:
    """Return values of a response and what governs them, eqs. (1) to (6).

    Parameters
    ----------
    law
        Short-term distributions, a row each.
    state
        Number of the sea state of each row, (r,); row i is of sea state i without it.
    years
        N of each return value.
    fractiles
        Probabilities of the extreme of N years.
    renormalise
        Whether the sea states with an answer stand for those without, in proportion; otherwise these pass no level.
    confidence
        Of the intervals.

    Raises
    ------
    ResultsError
        When the rows do not fit the sea states, none has an answer, or a number of years or a fractile is out of its
        range.
    """
    for span in years:
        if not (math.isfinite(span) and span * YEAR > states.duration):
            raise ResultsError(f"{signal}: a return period is {span} years; it must be above {states.duration:g} s")
    for fractile in fractiles:
        if not 0.0 < fractile < 1.0:
            raise ResultsError(f"{signal}: a fractile is {fractile}; it must be between 0 and 1")
    if not len(years):
        raise ResultsError(f"{signal}: no return period is given; give one or more numbers of years")
    rows = assign_rows(states, law.known, state, signal, renormalise)
    over = mixture(states, law, rows)
    periods = np.array([span * YEAR / states.duration for span in years])
    once = 1.0 / periods
    of_fractiles = [-np.expm1(np.log(fractile) / periods) for fractile in fractiles]
    wanted = np.concatenate([once, *of_fractiles, [_BODY, min(_BEYOND * once.min(), 0.5 * _BODY)]])
    if max(wanted[:-2]) >= rows.weight.sum():
        raise ResultsError(
            f"{signal}: sea states of the probability {rows.weight.sum():.3g} have an answer, too little for a return "
            f"period of {min(years):g} years; renormalise it, or run the others"
        )
    wanted[-2] = min(wanted[-2], 0.5 * rows.weight.sum())
    targets = np.concatenate([wanted, once])
    ergodic = np.arange(len(targets)) >= len(wanted)
    levels = solve(over, targets, ergodic)
    count = len(once)
    at_return = levels[:count]
    curve = np.linspace(levels[len(wanted) - 2], levels[len(wanted) - 1], _CURVE)
    exceedance = over.exceedance(curve)[0]
    shares = over.shares(at_return)
    estimates = _intervals(over, curve, exceedance, at_return, once, shares, confidence)
    sign = law.sign
    returns = tuple(
        ReturnValue(
            years=float(span),
            level=estimates[k],
            ergodic=sign * float(levels[len(wanted) + k]),
            fractiles=tuple(
                (float(part), sign * float(levels[(j + 1) * count + k])) for j, part in enumerate(fractiles)
            ),
            contributions=contributions(states, shares[:, k]),
        )
        for k, span in enumerate(years)
    )
    return LongTermExtreme(
        signal=signal,
        unit=unit,
        sign=sign,
        duration=states.duration,
        covered=rows.covered,
        missing=max(1.0 - rows.covered, 0.0),
        without_answer=rows.without_answer,
        level=sign * curve,
        exceedance=exceedance,
        returns=returns,
        notes=(*rows.notes, *_could_govern(rows, years, once), *law.remarks, *_interval_notes(over, returns)),
    )


def _intervals(
    over: Mixture,
    curve: FloatArray,
    exceedance: FloatArray,
    levels: FloatArray,
    targets: FloatArray,
    shares: FloatArray,
    confidence: float,
) -> list[Estimate]:
    """Return values with the intervals of eq. (6), in the response's own sense."""
    sign, replicates = over.law.sign, over.rows.replicates
    alone = np.sum(shares[replicates == 1], axis=0)
    if over.tables is None or np.all(alone > LARGEST_SHARE_ALONE):
        return [Estimate(value=sign * float(level)) for level in levels]
    first, second = np.zeros(len(levels)), np.zeros(len(levels))
    for numbers, starts, tables in over.without_one():
        number = replicates[numbers]
        weight = np.repeat(over.rows.weight[numbers], number)[:, np.newaxis]
        of_states = np.searchsorted(over.answered, numbers)
        own = np.repeat(exceedances(over.tables[of_states], curve), number, axis=0)
        without = exceedance + weight * (exceedances(tables, curve) - own)
        for k, target in enumerate(targets):
            found = _crossings(curve, without, float(target))
            centre = np.repeat(np.add.reduceat(found, starts) / number, number)
            variance = (number - 1) / number * np.add.reduceat((found - centre) ** 2, starts)
            first[k] += np.sum(variance)
            second[k] += np.sum(variance**2 / (number - 1))
    estimates = []
    for k, level in enumerate(levels):
        value = sign * float(level)
        if alone[k] > LARGEST_SHARE_ALONE:
            estimates.append(Estimate(value=value))
        elif first[k] <= 0.0:
            estimates.append(Estimate(value=value, low=value, high=value))
        else:
            estimates.append(level_interval(value, math.sqrt(first[k]), first[k] ** 2 / second[k], confidence))
    return estimates


def _crossings(curve: FloatArray, exceedance: FloatArray, target: float) -> FloatArray:
    """Levels at which rows of exceedances (r, k), which fall along the curve, have a value."""
    first, above, below = bracket(exceedance, np.full(len(exceedance), target))
    return between(curve[first], curve[first + 1], above, below, np.full(len(exceedance), target))


def _could_govern(rows: Rows, years: Sequence[float], once: FloatArray) -> list[str]:
    """A note where sea states without an answer are likely enough to pass any level once in N years."""
    hidden = [span for span, target in zip(years, once, strict=True) if 1.0 - rows.covered > max(target, 1e-6)]
    if not hidden:
        return []
    return [
        f"sea states without an answer come more than once in {min(hidden):g} years: if they are the severe ones, "
        "the return values are too low"
    ]


def _interval_notes(over: Mixture, returns: Sequence[ReturnValue]) -> list[str]:
    """Why there are no intervals."""
    without = [each.years for each in returns if not math.isfinite(each.level.low)]
    if over.tables is None:
        single = isinstance(over.law, WeibullExtremes)
        return ["one record each: no intervals, and levels of long periods some per cent high"] if single else []
    if not without:
        return []
    return [
        f"no interval of the {', '.join(f'{each:g}' for each in without)}-year value: more than "
        f"{LARGEST_SHARE_ALONE:.0%} of it is by sea states with one record each"
    ]
