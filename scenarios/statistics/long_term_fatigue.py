"""Long-term fatigue: the damage-equivalent range of a life over the sea states of a scatter diagram.

Of sea states i with probabilities p_i, of sum 1, and damage-equivalent ranges DEL_i at 1 Hz of the slope m, damage adds
up in time, so that of the life

    DEL = (sum p_i DEL_i^m)^(1/m)                                                                        (1)

and, of N_eq cycles in the life T,

    DEL_eq = (T 1 Hz / N_eq)^(1/m) DEL                                                                   (2)

An S-N curve log10 N = log10 a - m log10 S, with S in MPa, by a factor k of MPa a unit of the signal, gives the damage
of Palmgren and Miner

    damage = T 1 Hz (k DEL)^m / a                                                                        (3)

of which a sea state has the share p_i DEL_i^m / DEL^m. A curve of two slopes has no such range, and needs the
cycles themselves. Rows of one sea state, records that differ in their seeds, are averaged in DEL^m; with the variance
s_i^2 of the r_i of them, the error of DEL^m has the variance

    sum_i p_i^2 s_i^2 / r_i                                                                              (4)

and degrees of freedom after Welch and Satterthwaite.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.scenarios.results import ResultsError
from tlpsim.scenarios.statistics.intervals import reciprocal_interval
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

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class SNCurve:
    """log10 N = log10_a - slope log10 S, with S, the range of stress, in MPa."""

    log10_a: float
    slope: float
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class LongTermFatigue:
    """Fatigue of a signal in a life.

    Attributes
    ----------
    signal, unit, slope, years, equivalent_cycles
        As given.
    covered, missing, without_answer, notes
        As of `tlpsim.scenarios.statistics.long_term.LongTermExtreme`.
    range_at_1_hz, range_of_cycles
        Eqs. (1) and (2), in the signal's unit, with intervals where sea states have several records.
    damage
        Eq. (3); None without a curve.
    life
        Years to a damage of 1, infinite without any; None without a curve.
    contributions
        Shares of the damage, largest first, those of 1e-4 and more.
    """

    signal: str
    unit: str
    slope: float
    years: float
    equivalent_cycles: float
    covered: float
    missing: float
    without_answer: tuple[str, ...]
    range_at_1_hz: Estimate
    range_of_cycles: Estimate
    damage: Estimate | None
    life: float | None
    contributions: tuple[Contribution, ...]
    notes: tuple[str, ...]

    @property
    def lines(self) -> tuple[str, ...]:
        """What it comes to, then the notes."""
        governs = [f", most by {part.name} with {part.share:.0%}" for part in self.contributions[:1]]
        found = [
            f"{self.signal} damage-equivalent range {self.range_at_1_hz.value:.4g} {self.unit} at 1 Hz, "
            f"{self.range_of_cycles.value:.4g} {self.unit} of {self.equivalent_cycles:.3g} cycles in {self.years:g} "
            f"years{''.join(governs)}"
        ]
        if self.damage is not None:
            found.append(
                f"{self.signal} damage {self.damage.value:.3g} in {self.years:g} years, life {self.life:.4g} years"
            )
        return (*found, *(f"note: {note}" for note in self.notes))


def long_term_fatigue(
    states: SeaStates,
    ranges: ArrayLike,
    slope: float,
    *,
    signal: str,
    unit: str,
    state: ArrayLike | None = None,
    years: float = 20.0,
    equivalent_cycles: float = 1e7,
    curve: SNCurve | None = None,
    stress_factor: float = 1e-6,
    renormalise: bool = True,
    confidence: float = 0.95,
) -> LongTermFatigue:
    """Damage-equivalent ranges and Miner's damage of a life, eqs. (1) to (4).

    Parameters
    ----------
    ranges
        Damage-equivalent ranges at 1 Hz of the slope, a row each, (r,), in the signal's unit; NaN where there is none.
    state
        Number of the sea state of each row, (r,); row i is of sea state i without it.
    years
        Of the life.
    curve
        Of the same slope.
    stress_factor
        MPa a unit of the signal: 1e-6 where it is in Pa; of a tension in N, 1e-6 by the area in m², times the stress
        concentration.
    renormalise
        Whether the sea states with an answer stand for those without; otherwise these do no damage.

    Raises
    ------
    ResultsError
        When the rows do not fit the sea states, none has an answer, a range is negative, or another number is out of
        its range.
    """
    values = np.atleast_1d(np.asarray(ranges, dtype=np.float64))
    known = np.isfinite(values)
    if np.any(values[known] < 0.0):
        raise ResultsError(f"{signal}: a range is {values[known].min():g} {unit}; it must be at least 0")
    for name, number in (
        ("slope", slope),
        ("years", years),
        ("equivalent_cycles", equivalent_cycles),
        ("stress_factor", stress_factor),
    ):
        if not (math.isfinite(number) and number > 0.0):
            raise ResultsError(f"{signal}: {name} is {number}; it must be above 0")
    if curve is not None and curve.slope != slope:
        raise ResultsError(
            f"{signal}: the ranges are of the slope {slope:g} and the S-N curve {curve.name} of {curve.slope:g}; "
            "make the ranges with the slope of the curve"
        )
    rows = assign_rows(states, known, state, signal, renormalise)
    largest = float(np.max(values[rows.chosen]))
    # Relative to the largest, so that the tenth power of a tension in N is a number.
    powers = (values[rows.chosen] / largest) ** slope if largest > 0.0 else np.zeros(len(rows.chosen))
    means = np.bincount(rows.state, weights=powers, minlength=len(states.names)) / np.maximum(rows.replicates, 1)
    parts = rows.weight * means
    total = float(np.sum(parts))
    shares = parts / total if total > 0.0 else parts
    relative, notes = _interval(rows, powers, means, total, shares, confidence)

    def scaled(factor: float, power: float) -> Estimate:
        """factor (total interval)^power: the total itself is left out of the logarithms, which may be that of 0."""
        return Estimate(
            value=factor * relative.value**power, low=factor * relative.low**power, high=factor * relative.high**power
        )

    seconds = years * YEAR
    at_1_hz = scaled(largest, 1.0 / slope)
    damage = None
    if curve is not None:
        unit_damage = seconds * (stress_factor * largest) ** slope * 10.0**-curve.log10_a
        damage = scaled(unit_damage, 1.0)
    return LongTermFatigue(
        signal=signal,
        unit=unit,
        slope=slope,
        years=years,
        equivalent_cycles=equivalent_cycles,
        covered=rows.covered,
        missing=max(1.0 - rows.covered, 0.0),
        without_answer=rows.without_answer,
        range_at_1_hz=at_1_hz,
        range_of_cycles=scaled(largest * (seconds / equivalent_cycles) ** (1.0 / slope), 1.0 / slope),
        damage=damage,
        life=None if damage is None else (years / damage.value if damage.value > 0.0 else math.inf),
        contributions=contributions(states, shares),
        notes=(*rows.notes, *notes),
    )


def _interval(
    rows: Rows, powers: FloatArray, means: FloatArray, total: float, shares: FloatArray, confidence: float
) -> tuple[Estimate, list[str]]:
    """sum p_i DEL_i^m with its interval, eq. (4), and a note where there is none."""
    several = rows.replicates > 1
    if not several.any():
        return Estimate(value=total), []
    if float(np.sum(shares[rows.replicates == 1])) > LARGEST_SHARE_ALONE:
        return Estimate(value=total), [
            f"no interval: more than {LARGEST_SHARE_ALONE:.0%} of the damage is by sea states with one record each"
        ]
    squares = np.bincount(rows.state, weights=(powers - means[rows.state]) ** 2, minlength=len(means))
    freedom = np.maximum(rows.replicates - 1, 1)
    variances = np.where(several, rows.weight**2 * squares / (freedom * np.maximum(rows.replicates, 1)), 0.0)
    variance = float(np.sum(variances))
    if variance <= 0.0:
        return Estimate(value=total, low=total, high=total), []
    degrees = variance**2 / float(np.sum(variances**2 / freedom))
    return reciprocal_interval(total, math.sqrt(variance) / total, degrees, confidence), []
