"""Statistics of signals of results over one record or several of one case, each with its confidence interval.

Records of a case differ in their seeds alone. A statistic is of all records together: sums over time, maxima and cycles
are of all of them, about one common mean. With z = (x - mean) / std the influence functions, from which
`tlpsim.scenarios.statistics.intervals` makes the intervals, are

    mean            x - mean                                                                             (1)
    variance        z^2 - 1, relative; of a band with the part of the signal in that band                (2)
    skewness        z^3 - s - 3 z - (3/2) s (z^2 - 1)                                                    (3)
    kurtosis        z^4 - k - 4 s z - 2 k (z^2 - 1)                                                      (4)

with s the mean of z^3 and k that of z^4. The interval of the kurtosis is by 1 / (k - 1): k is 1 at least.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tlpsim.orchestrator.units import unit_conversion
from tlpsim.scenarios.results import Results, ResultsError
from tlpsim.scenarios.statistics.bands import BAND_EDGES, band_signals, band_statistics, first_sample
from tlpsim.scenarios.statistics.case import chosen_signals, require_one_case
from tlpsim.scenarios.statistics.extremes import (
    FEWEST_MAXIMA,
    exceedance,
    expected_extreme,
    fit_gumbel,
    fit_weibull,
    maxima_between_crossings,
    up_crossings,
)
from tlpsim.scenarios.statistics.fatigue import cycle_histogram, damage_equivalent_range, rainflow_cycles
from tlpsim.scenarios.statistics.intervals import (
    Events,
    cosine_count,
    event_projections,
    level_interval,
    ratio_interval,
    reciprocal_interval,
    sample_projections,
    spread_interval,
    standard_error,
)
from tlpsim.scenarios.statistics.records import (
    UNKNOWN,
    CycleHistogram,
    Estimate,
    Exceedance,
    GumbelFit,
    SignalStatistics,
    WeibullFit,
    unknown_statistics,
)

__all__ = [
    "CycleHistogram",
    "Estimate",
    "Exceedance",
    "GumbelFit",
    "SignalStatistics",
    "WeibullFit",
    "run_statistics",
    "signal_statistics",
]

FloatArray = NDArray[np.float64]

EXPOSURE = 10800.0
"""s, for expected extremes"""
SLOPE = 4.0
"""of S-N curves: that of B1 and B2 in DNV-RP-C203, Table 2-1, where welds have 3 to 3.5, and all 5 at many cycles"""
CONFIDENCE = 0.95
FEWEST_CYCLES = 10
"""about the mean, in all records, for intervals"""

_ALIKE = 1e-12  # of the largest absolute value: fluctuations below are rounding
_SAME_LENGTH = 0.99  # of the longest record: those that are shorter are not among the extremes of records
_DAMAGING = ("N", "N.m", "Pa")  # units of signals that have ranges of fatigue without being asked for


def run_statistics(
    results: Sequence[Results],
    names: Sequence[str] | None = None,
    *,
    start: float | None = None,
    exposure: float = EXPOSURE,
    slope: float = SLOPE,
    confidence: float = CONFIDENCE,
) -> tuple[SignalStatistics, ...]:
    """Statistics of signals over the records of one case.

    Parameters
    ----------
    results
        One results file, or several of scenarios that differ in their seeds alone.
    names
        Signals such as "platform.position.surge", or patterns with * and ?; the six positions and all tensions if not
        given. Ranges of fatigue are of all signals that are named here, and else of forces, moments and stresses.
    start
        Time before which samples are left out, s; the scenario's ``outputs.statistics_from`` if not given.
    exposure
        For the expected extremes, s.
    slope
        Of the S-N curve.
    confidence
        Of the intervals.

    Raises
    ------
    ResultsError
        When the results are not of one case, a name matches no signal, a parameter is out of range, or samples are not
        equally spaced.
    """
    _require_in_range(start, exposure, slope, confidence)
    require_one_case(results)
    if start is None:
        start = results[0].scenario.outputs.statistics_from if results[0].has_scenario else 0.0
    general = [f"{each.path.name} is not of a complete run ({each.status})" for each in results if not each.complete]
    general += _events(results[0], start)
    made = []
    for component, name in chosen_signals(results[0], names):
        unit = results[0].unit(name)
        notes = list(general)
        records, begins, steps = [], [], []
        for each in results:
            time, signal = each.time(component), each.signal(name)
            first, note = first_sample(time, start, BAND_EDGES[0])
            notes += [note] if note else []
            records.append(signal[first:])
            if len(time) >= 2:
                begins.append(float(time[first]))
                steps.append(float(time[-1] - time[0]) / (len(time) - 1))
        if steps and max(steps) - min(steps) > 1e-6 * max(steps):
            raise ResultsError(f"{results[0].path}: the records have '{name}' at different steps: give those of one")
        found = signal_statistics(
            records,
            steps[0] if steps else 1.0,
            name=name,
            unit=unit,
            start=min(begins, default=0.0),
            exposure=exposure,
            slope=slope if names is not None or damages(unit) else None,
            confidence=confidence,
            notes=notes,
        )
        made.append(found)
    return tuple(made)


def signal_statistics(
    records: Sequence[FloatArray],
    step: float,
    *,
    name: str = "",
    unit: str = "",
    start: float = 0.0,
    exposure: float = EXPOSURE,
    slope: float | None = SLOPE,
    confidence: float = CONFIDENCE,
    notes: Sequence[str] = (),
) -> SignalStatistics:
    """Statistics of one signal over its records.

    Parameters
    ----------
    records
        Samples of each record, (n,), without its transient; records may differ in length.
    step
        Between samples, s.
    name, unit, start
        Are returned.
    exposure, confidence
        As of `run_statistics`.
    slope
        Of the S-N curve; without ranges of fatigue if None.
    notes
        To begin the note with.
    """
    kept = [np.ascontiguousarray(each, dtype=np.float64) for each in records if len(each) >= 2]
    remarks = list(notes)
    blank = unknown_statistics(name, unit, start, min(map(len, kept), default=0) * step, len(kept))
    if not kept:
        return replace(blank, note="; ".join((*remarks, "fewer than two samples")))
    if not all(np.isfinite(each).all() for each in kept):
        return replace(blank, note="; ".join((*remarks, "no statistics: values that are not finite")))
    mean = sum(float(np.sum(each)) for each in kept) / sum(map(len, kept))
    maximum, minimum = max(float(np.max(each)) for each in kept), min(float(np.min(each)) for each in kept)
    blank = replace(blank, maximum=maximum, minimum=minimum)
    if not maximum - minimum > _ALIKE * max(abs(maximum), abs(minimum)):
        return _constant(blank, mean, slope, (*remarks, "constant"))
    ensemble = Ensemble(
        records=tuple(each - mean for each in kept),
        step=step,
        mean=mean,
        durations=np.array([len(each) * step for each in kept]),
        cosines=cosine_count(blank.duration),
        confidence=confidence,
    )
    cycles = sum(len(up_crossings(each)) for each in ensemble.records)
    if cycles < FEWEST_CYCLES:
        remarks.append(f"no intervals: fewer than {FEWEST_CYCLES} cycles about the mean")
        ensemble = replace(ensemble, confidence=math.nan)
    found = _with_moments(blank, ensemble, remarks)
    found = _with_extremes(found, ensemble, exposure, remarks)
    if slope is not None:
        counted = [rainflow_cycles(each, step) for each in kept]
        found = replace(
            found,
            damage_equivalent_range=damage_equivalent_range(counted, slope, ensemble.cosines, ensemble.confidence),
            cycles=cycle_histogram(counted),
        )
    return replace(found, note="; ".join(dict.fromkeys(remarks)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ensemble:
    """Records of one signal: `records` (samples,) less their common `mean`, and what intervals are made with."""

    records: tuple[FloatArray, ...]
    step: float
    mean: float
    durations: FloatArray
    cosines: int
    confidence: float


def _with_moments(found: SignalStatistics, ensemble: Ensemble, remarks: list[str]) -> SignalStatistics:
    """Mean, spreads, skewness, kurtosis, period; what bands cannot be told is added to the remarks."""
    step, share = ensemble.step, ensemble.durations / np.sum(ensemble.durations)
    bands = []
    for each in ensemble.records:
        time: FloatArray = np.arange(len(each), dtype=np.float64) * step
        band = band_statistics(time, each)
        remarks += [band.note] if band.note else []
        bands.append((band.low_frequency, band.wave_frequency))
    variances = np.square(bands).T @ share  # of the two bands
    parts = [band_signals(each, step) for each in ensemble.records]
    powers = np.stack([np.mean(part**2, axis=-1) for part in parts], axis=-1) @ share
    squares = [each * each for each in ensemble.records]
    variance = float(share @ [np.mean(square) for square in squares])
    third = float(share @ [np.mean(square * each) for square, each in zip(squares, ensemble.records, strict=True)])
    fourth = float(share @ [np.mean(square * square) for square in squares])
    skewness, kurtosis = third / variance**1.5, fourth / variance**2
    projections = []
    for each, part in zip(ensemble.records, parts, strict=True):
        z = each / math.sqrt(variance)
        square = z * z
        influence = np.stack(
            [
                each,
                square - 1.0,
                z * square - skewness - 3.0 * z - 1.5 * skewness * (square - 1.0),
                square * square - kurtosis - 4.0 * skewness * z - 2.0 * kurtosis * (square - 1.0),
                *(part**2 / np.where(powers > 0.0, powers, np.nan)[:, np.newaxis] - 1.0),
            ]
        )
        projections.append(sample_projections(influence, ensemble.cosines))
    errors, freedom = standard_error(np.stack(projections, axis=1), ensemble.durations)
    of_mean, of_variance, of_skewness, of_kurtosis, of_low, of_wave = (float(each) for each in errors)
    confidence = ensemble.confidence
    peaked = reciprocal_interval(kurtosis - 1.0, of_kurtosis / max(kurtosis - 1.0, _ALIKE), freedom, confidence)
    return replace(
        found,
        mean=level_interval(ensemble.mean, of_mean, freedom, confidence),
        low_frequency=spread_interval(math.sqrt(variances[0]), of_low, freedom, confidence),
        wave_frequency=spread_interval(math.sqrt(variances[1]), of_wave, freedom, confidence),
        std=spread_interval(math.sqrt(variance), of_variance, freedom, confidence),
        skewness=level_interval(skewness, of_skewness, freedom, confidence),
        excess_kurtosis=Estimate(value=kurtosis - 3.0, low=peaked.low - 2.0, high=peaked.high - 2.0),
        zero_crossing_period=_period(ensemble),
    )


def _period(ensemble: Ensemble) -> Estimate:
    """Mean time between up-crossings of the mean, by their number."""
    crossed = [up_crossings(each) for each in ensemble.records]
    number = sum(map(len, crossed))
    if not number:
        return UNKNOWN
    events = [
        Events(place=place / len(each), duration=len(each) * ensemble.step)
        for place, each in zip(crossed, ensemble.records, strict=True)
    ]
    period = float(np.sum(ensemble.durations)) / number
    projections = event_projections(events, [np.full(len(place), period) for place in crossed], ensemble.cosines)
    error, freedom = standard_error(projections, ensemble.durations)
    return ratio_interval(period, float(error), freedom, ensemble.confidence)


def _with_extremes(
    found: SignalStatistics, ensemble: Ensemble, exposure: float, remarks: list[str]
) -> SignalStatistics:
    """Maxima and minima with their distributions, and the extremes of the exposure."""
    step, mean, time = ensemble.step, ensemble.mean, float(np.sum(ensemble.durations))
    cosines, confidence = ensemble.cosines, ensemble.confidence
    maxima = [maxima_between_crossings(each, step) for each in ensemble.records]
    minima = [maxima_between_crossings(-each, step) for each in ensemble.records]
    fits, expected = [], []
    for kind, sign, turns in (("maxima", 1.0, maxima), ("minima", -1.0, minima)):
        value = np.concatenate([each.value for each in turns])
        fit = fit_weibull(value, location=mean, sign=sign, time=time)
        if fit is None:
            reason = f"fewer than {FEWEST_MAXIMA} {kind}" if len(value) < FEWEST_MAXIMA else f"{kind} all alike"
            remarks.append(f"no expected extreme: {reason} between crossings of the mean")
        fits.append(fit)
        expected.append(UNKNOWN if fit is None else expected_extreme(turns, fit, exposure, confidence))
    longest = max(map(len, ensemble.records))
    whole = [each + mean for each in ensemble.records if len(each) >= _SAME_LENGTH * longest]
    gumbel = [
        fit_gumbel(np.array([most(each) for each in whole]), longest * step, exposure, confidence, sign)
        for most, sign in ((np.max, 1.0), (np.min, -1.0))
    ]
    return replace(
        found,
        expected_maximum=expected[0],
        expected_minimum=expected[1],
        weibull_maxima=fits[0],
        weibull_minima=fits[1],
        gumbel_maximum=gumbel[0],
        gumbel_minimum=gumbel[1],
        exceedance=exceedance(maxima, mean, cosines, confidence),
    )


def _constant(found: SignalStatistics, mean: float, slope: float | None, remarks: Sequence[str]) -> SignalStatistics:
    """Statistics of a signal that does not move, such as the tension of a lost tendon."""
    level, still = Estimate(value=mean, low=mean, high=mean), Estimate(value=0.0, low=0.0, high=0.0)
    return replace(
        found,
        mean=level,
        low_frequency=still,
        wave_frequency=still,
        std=still,
        expected_maximum=level,
        expected_minimum=level,
        damage_equivalent_range=None if slope is None else still,
        note="; ".join(remarks),
    )


def _events(results: Results, start: float) -> list[str]:
    """A note of what changes the case within the record."""
    times = [each.at for each in results.scenario.events if each.at > start] if results.has_scenario else []
    if not times:
        return []
    when = ", ".join(f"{time:g}" for time in times)
    return [f"events at {when} s change the case: statistics from {start:g} s on are of both what was before and after"]


def damages(unit: str) -> bool:
    """Whether a unit is one of force, moment or stress."""
    for wanted in _DAMAGING:
        try:
            unit_conversion(unit, wanted, {}, {})
        except ValueError:
            continue
        return bool(unit) and unit not in ("-", "1")
    return False


def _require_in_range(start: float | None, exposure: float, slope: float, confidence: float) -> None:
    limits = (
        ("start", 0.0 if start is None else start, 0.0, math.inf, "s"),
        ("exposure", exposure, 1.0, math.inf, "s"),
        ("slope", slope, 1.0, 20.0, ""),
        ("confidence", confidence, 0.5, 0.999, ""),
    )
    for name, value, least, most, unit in limits:
        if not (math.isfinite(value) and least <= value <= most):
            bounds = f"at least {least:g}" if most == math.inf else f"from {least:g} to {most:g}"
            raise ResultsError(f"statistics: {name} is {value:g}; it must be {bounds} {unit}".rstrip())
