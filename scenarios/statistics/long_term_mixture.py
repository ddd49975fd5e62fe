"""Exceedances of levels over the sea states of a scatter diagram, and levels of given exceedances.

Eqs. (1), (3), (4) and (5) of `tlpsim.scenarios.statistics.long_term`. Some sea states are evaluated at a time, at all
levels, so that memory does not grow with their number times that of levels.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.scenarios.statistics.sea_states import Rows, SeaStates
from tlpsim.scenarios.statistics.short_term import ShortTermExtremes

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

NUMBERS = np.geomspace(700.0, 1e-15, 241)
"""v of eq. (5); linear interpolation of its logarithm errs by 2e-4 at most"""

_ROWS = 1000  # at once
_COARSE, _FINE, _ROUNDS = 129, 17, 2  # levels of the first search, of each further one, and how many of those


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mixture:
    """Eqs. (1), (4) and (5). Levels here are turned round for minima: what passes them is above them.

    `tables` are the levels of eq. (5) by the numbers `NUMBERS`, (a, g) of each sea state with an answer; None where
    each has one row, which is then taken as it is. `answered` are the numbers of those sea states, (a,).
    """

    states: SeaStates
    law: ShortTermExtremes
    rows: Rows
    answered: IntArray
    tables: FloatArray | None

    def parts(self, levels: FloatArray) -> Iterator[tuple[IntArray, FloatArray]]:
        """Some sea states at a time: their numbers (s,), the exceedances of each (s, k)."""
        for first in range(0, len(self.answered), _ROWS):
            part = slice(first, first + _ROWS)
            if self.tables is None:
                some = self.law.rows_of(self.rows.chosen[part])
                passed = some.probability_of_exceedance(self.law.sign * levels, self.states.duration)
            else:
                passed = exceedances(self.tables[part], levels)
            yield self.answered[part], passed

    def exceedance(self, levels: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Q by eqs. (1) and (4), (k,) each."""
        total, logarithm = np.zeros(len(levels)), np.zeros(len(levels))
        for numbers, passed in self.parts(levels):
            weight = self.rows.weight[numbers]
            total += weight @ passed
            with np.errstate(divide="ignore"):
                logarithm += weight @ np.log1p(-np.minimum(passed, 1.0))
        return total, -np.expm1(logarithm)

    def shares(self, levels: FloatArray) -> FloatArray:
        """Eq. (3), (n, k)."""
        found = np.zeros((len(self.states.names), len(levels)))
        for numbers, passed in self.parts(levels):
            found[numbers] = self.rows.weight[numbers, np.newaxis] * passed
        total = np.sum(found, axis=0)
        return np.asarray(found / np.where(total > 0.0, total, 1.0))

    def without_one(self) -> Iterator[tuple[IntArray, IntArray, FloatArray]]:
        """Sea states of several rows, some at a time: their numbers (s,), the first of the rows of each (s,), and
        the tables of eq. (5) without each of the rows (rows, g)."""
        state, replicates = self.rows.state, self.rows.replicates
        chosen = np.flatnonzero(replicates[state] > 1)
        first = 0
        while first < len(chosen):
            last = min(first + _ROWS, len(chosen))
            last = int(np.searchsorted(state[chosen], state[chosen[last - 1]], side="right"))  # whole sea states
            part = chosen[first:last]
            levels = self.law.sign * self.law.rows_of(self.rows.chosen[part]).levels_passed(
                NUMBERS, self.states.duration
            )
            numbers, starts = np.unique(state[part], return_index=True)
            count = replicates[state[part], np.newaxis]
            total = np.repeat(np.add.reduceat(levels, starts, axis=0), replicates[numbers], axis=0)
            yield numbers, starts, (total - levels) / (count - 1)
            first = last

    def ends(self, least: float, most: float) -> tuple[float, float]:
        """Levels between which those of all exceedances from `least` to `most` are: of a mixture, and of eqs. (4) and
        (5), they are between the lowest and the highest of its parts."""
        some = self.law.rows_of(self.rows.chosen)
        low, high = (self.law.sign * some.quantile(1.0 - each, self.states.duration) for each in (most, least))
        return float(np.min(low)), float(np.max(high))


def mixture(states: SeaStates, law: ShortTermExtremes, rows: Rows) -> Mixture:
    """Sea states with an answer, and the tables of eq. (5) where some have several rows."""
    answered = np.unique(rows.state)
    if len(answered) == len(rows.state):
        return Mixture(states=states, law=law, rows=rows, answered=answered, tables=None)
    tables = np.zeros((len(answered), len(NUMBERS)))
    for first in range(0, len(rows.chosen), _ROWS):
        part = slice(first, first + _ROWS)
        levels = law.sign * law.rows_of(rows.chosen[part]).levels_passed(NUMBERS, states.duration)
        np.add.at(tables, np.searchsorted(answered, rows.state[part]), levels)
    tables /= rows.replicates[answered, np.newaxis]
    return Mixture(states=states, law=law, rows=rows, answered=answered, tables=tables)


def exceedances(tables: FloatArray, levels: FloatArray) -> FloatArray:
    """1 - exp(-v) of the numbers v whose levels a table (s, g) has, at levels (k,): (s, k)."""
    logarithm = np.log(NUMBERS)
    found = np.stack([np.interp(levels, table, logarithm, right=-np.inf) for table in tables])
    return np.asarray(-np.expm1(-np.exp(found)))


def solve(mixture: Mixture, targets: FloatArray, ergodic: NDArray[np.bool_]) -> FloatArray:
    """Levels of given exceedances (t,), by eq. (1), or (4) where ergodic.

    The exceedance falls with the level, in steps where the response has a bound: the interval that holds it is divided
    again and again, and the last is interpolated.
    """
    covered = float(mixture.rows.weight.sum())
    low, high = mixture.ends(float(targets.min()), min(float(targets.max()) / covered, 1.0 - 1e-9))
    margin = 1e-9 * max(abs(low), abs(high), high - low) + 1e-300
    levels = np.broadcast_to(np.linspace(low - margin, high + margin, _COARSE), (len(targets), _COARSE))
    both = np.stack(mixture.exceedance(levels[0]))
    passed = both[ergodic.astype(np.int64)]
    rows = np.arange(len(targets))[:, np.newaxis]
    for left in range(_ROUNDS, -1, -1):
        first, above, below = bracket(passed, targets)
        ends = levels[rows, first[:, np.newaxis] + [0, 1]]
        if not left:
            break
        levels = ends[:, :1] + (ends[:, 1:] - ends[:, :1]) * np.linspace(0.0, 1.0, _FINE)
        both = np.stack(mixture.exceedance(levels.ravel())).reshape(2, *levels.shape)
        passed = np.where(ergodic[:, np.newaxis], both[1], both[0])
    return between(ends[:, 0], ends[:, 1], above, below, targets)


def bracket(exceedance: FloatArray, targets: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Where rows of exceedances (r, k), which fall, pass targets (r,): the place before, and the values about it."""
    rows = np.arange(len(exceedance))
    first = np.clip(np.sum(exceedance > targets[:, np.newaxis], axis=1) - 1, 0, exceedance.shape[1] - 2)
    return first, exceedance[rows, first], exceedance[rows, first + 1]


def between(low: FloatArray, high: FloatArray, above: FloatArray, below: FloatArray, targets: FloatArray) -> FloatArray:
    """Levels (r,) of exceedances, of which `low` has those `above` and `high` those `below`; linear in logarithms."""
    upper, lower = (np.log(np.maximum(each, 1e-300)) for each in (above, below))
    step = upper - lower
    part = np.clip((upper - np.log(targets)) / np.where(step > 0.0, step, 1.0), 0.0, 1.0)
    return np.asarray(low + (high - low) * part)
