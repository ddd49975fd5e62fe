"""Fatigue cycles by rainflow counting, and the damage-equivalent range.

Cycles are counted after ASTM E1049-85, section 5.4.4, by the package `rainflow`, on the turning points alone: what lies
between them changes nothing. No small cycle is dropped. Of an S-N curve N = K S^-m the range whose cycles at f_eq = 1
Hz do the damage of n_i cycles of the ranges S_i in the time T is

    DEL_m = (sum_i n_i S_i^m / (f_eq T))^(1/m)                                                          (1)

A cycle that is still open at the end of a record counts one half.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import rainflow
from numpy.typing import NDArray

from tlpsim.scenarios.statistics.intervals import Events, event_projections, reciprocal_interval, standard_error
from tlpsim.scenarios.statistics.records import CycleHistogram, Estimate

FloatArray = NDArray[np.float64]

EQUIVALENT_FREQUENCY = 1.0
"""of the damage-equivalent range, Hz"""
BINS = 40


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cycles:
    """Rainflow cycles of one record: `ranges`, `means` and `counts` (1 or 0.5) of each (k,), and the `events`."""

    ranges: FloatArray
    means: FloatArray
    counts: FloatArray
    events: Events


def turning_points(signal: FloatArray) -> NDArray[np.int64]:
    """Indices of the first and the last sample of a signal (n,), and of those between at which it turns."""
    if len(signal) < 2:
        return np.arange(len(signal))
    moved = np.concatenate([[True], np.diff(signal) != 0.0])  # the first sample of each level stretch
    place = np.flatnonzero(moved)
    rising = np.diff(signal[place]) > 0.0
    turns = place[1:-1][rising[1:] != rising[:-1]]
    return np.concatenate([place[:1], turns, place[-1:]]) if len(place) > 1 else place


def rainflow_cycles(signal: FloatArray, step: float) -> Cycles:
    """Cycles of a signal (n,) at a step (s)."""
    place = turning_points(signal)
    # The package takes no cycle from two points, but one from three: the first point stands twice.
    place = np.concatenate([place[:1], place])
    found = np.array(list(rainflow.extract_cycles(signal[place].tolist())), dtype=np.float64).reshape(-1, 5)
    ends = place[found[:, 3:].astype(np.int64)]
    return Cycles(
        ranges=found[:, 0],
        means=found[:, 1],
        counts=found[:, 2],
        events=Events(place=(np.mean(ends, axis=1) + 0.5) / len(signal), duration=len(signal) * step),
    )


def damage_equivalent_range(records: Sequence[Cycles], slope: float, cosines: int, confidence: float) -> Estimate:
    """Damage-equivalent range at 1 Hz, eq. (1), over records, with its interval; in the signal's unit.

    Parameters
    ----------
    slope
        m of the S-N curve, dimensionless.
    cosines
        For the interval, see `tlpsim.scenarios.statistics.intervals`.
    """
    largest = max((float(np.max(each.ranges, initial=0.0)) for each in records), default=0.0)
    if largest == 0.0:
        return Estimate(value=0.0, low=0.0, high=0.0)
    damages = [each.counts * (each.ranges / largest) ** slope for each in records]
    events = [each.events for each in records]
    durations = np.array([each.duration for each in events])
    rate = sum(float(np.sum(damage)) for damage in damages) / float(np.sum(durations))
    projections = event_projections(events, [damage / rate for damage in damages], cosines)
    error, freedom = standard_error(projections, durations)
    damage = reciprocal_interval(rate / EQUIVALENT_FREQUENCY, float(error), freedom, confidence)
    power = 1.0 / slope
    return Estimate(
        value=largest * damage.value**power, low=largest * damage.low**power, high=largest * damage.high**power
    )


def cycle_histogram(records: Sequence[Cycles], bins: int = BINS) -> CycleHistogram:
    """Cycles by range in equal bins from 0 to the largest one, as many as a record has in the mean."""
    ranges, means, counts = (
        np.concatenate([getattr(each, name) for each in records]) for name in ("ranges", "means", "counts")
    )
    edges = np.linspace(0.0, float(np.max(ranges, initial=0.0)) or 1.0, bins + 1)
    number = np.histogram(ranges, edges, weights=counts)[0]
    with np.errstate(invalid="ignore"):
        mean = np.histogram(ranges, edges, weights=counts * means)[0] / number
    return CycleHistogram(edges=edges, counts=number / len(records), means=mean)
