"""What a sweep with probabilities comes to over the years: return values and fatigue, from its summary alone.

Each alternative of the design, and each domain that has its sea states, stands by itself. The time domain of the worst
cases only has no outlook: it lacks the other sea states.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.scenarios.statistics.case import matching_names
from tlpsim.scenarios.statistics.long_term import LongTermExtreme, long_term_extreme
from tlpsim.scenarios.statistics.long_term_fatigue import LongTermFatigue, SNCurve, long_term_fatigue
from tlpsim.scenarios.statistics.sea_states import SeaStates
from tlpsim.scenarios.statistics.short_term import ShortTermExtremes, SpectralExtremes, WeibullExtremes
from tlpsim.scenarios.sweep.table import DONE, SweepTable

LEAST_COVERED = 0.5
"""Of the probability of an alternative, for an outlook."""
_PASCAL = 1e-6  # MPa


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Group:
    """Sea states of one alternative in one domain.

    Attributes
    ----------
    variant, domain
        Which.
    cases
        Number of the case of each sea state, (n,).
    states
        Names and probabilities.
    rows
        Of the table, (r,).
    state
        Of each of them, (r,).
    """

    variant: int
    domain: str
    cases: NDArray[np.int64]
    states: SeaStates
    rows: NDArray[np.int64]
    state: NDArray[np.int64]

    @property
    def occurs(self) -> NDArray[np.bool_]:
        """Rows of sea states with a probability above 0, (r,)."""
        return np.asarray(self.states.probability[self.state] > 0.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outlook:
    """Long-term results: extremes of the positions and of the governing tendons, and fatigue of the worst tendon."""

    extremes: tuple[tuple[Group, LongTermExtreme], ...]
    fatigue: tuple[tuple[Group, LongTermFatigue], ...]


def outlook(table: SweepTable) -> Outlook:
    """Long-term results of a sweep; none where its cases have no probabilities.

    Raises
    ------
    ResultsError
        When probabilities add up to more than 1, or a parameter is out of range.
    """
    extremes: list[tuple[Group, LongTermExtreme]] = []
    fatigue: list[tuple[Group, LongTermFatigue]] = []
    for group in groups(table):
        extremes += [(group, each) for each in _extremes(table, group)]
        fatigue += [(group, each) for each in _fatigue(table, group)]
    return Outlook(extremes=tuple(extremes), fatigue=tuple(fatigue))


def groups(table: SweepTable) -> Iterator[Group]:
    """Alternatives and domains that have enough of their sea states, of which none was left to the other domain."""
    if not table.weighted:
        return
    columns = table.columns
    fixed = {key for variant in table.variants for key in variant}
    varied = [key for key in table.keys if key not in fixed]
    for variant in range(len(table.variants)):
        mine = columns["variant"] == variant
        cases, first = np.unique(columns["case"][mine], return_index=True)
        rows = np.flatnonzero(mine)
        probability = columns["probability"][rows[first]]
        names = tuple(_name(table, varied, int(row)) for row in rows[first])
        for domain in ("frequency", "time"):
            done = np.flatnonzero(mine & (columns["domain"] == domain) & (columns["status"] == DONE))
            known = np.isin(cases, columns["case"][done])
            elsewhere = np.isin(cases, columns["case"][mine & (columns["status"] == DONE)])
            asked = np.isin(cases, columns["case"][mine & (columns["domain"] == domain)])
            if np.any(elsewhere & ~asked):
                continue
            if len(done) and np.sum(probability[known]) >= LEAST_COVERED * np.sum(probability):
                yield Group(
                    variant=variant,
                    domain=domain,
                    cases=cases,
                    states=SeaStates(names=names, probability=probability, duration=table.exposure),
                    rows=done,
                    state=np.searchsorted(cases, columns["case"][done]),
                )


def _name(table: SweepTable, varied: Sequence[str], row: int) -> str:
    """Settings of the environment of a row: of the keys that vary in it."""
    told = ", ".join(f"{key.rpartition('.')[2]} {table.setting(key, row)}" for key in varied)
    return str(table.columns["name"][row]) or told or f"case {table.columns['case'][row]}"


def _signals(table: SweepTable, statistic: str) -> list[str]:
    return [signal for signal in table.units if f"{signal}.{statistic}" in table.columns]


def _extremes(table: SweepTable, group: Group) -> Iterator[LongTermExtreme]:
    """Of each signal, maximum and minimum; of tendons the highest and the lowest only."""
    signals = _signals(table, "mean")
    tendons = matching_names(signals, ["*tendon*[*]"])
    for signal in signals:
        if signal not in tendons:
            for sign in (1.0, -1.0):
                yield from _extreme(table, group, signal, sign)
    for kind in dict.fromkeys(name.partition("[")[0] for name in tendons):
        for sign in (1.0, -1.0):
            alike = [name for name in tendons if name.startswith(f"{kind}[")]
            found = [each for name in alike for each in _extreme(table, group, name, sign)]
            if found:
                yield max(found, key=lambda each: sign * each.returns[-1].level.value)


def _extreme(table: SweepTable, group: Group, signal: str, sign: float) -> Iterator[LongTermExtreme]:
    law = _law(table, group, signal, sign)
    if np.any(law.known & group.occurs):
        yield long_term_extreme(
            group.states,
            law,
            signal=signal,
            unit=table.units[signal],
            state=group.state,
            years=table.long_term.years,
        )


def _law(table: SweepTable, group: Group, signal: str, sign: float) -> ShortTermExtremes:
    def of(statistic: str) -> NDArray[np.float64]:
        return table.statistic(signal, statistic)[group.rows]

    if group.domain == "frequency":
        same = ("mean", "skewness", "excess_kurtosis", "zero_crossing_period", "bandwidth")
        return SpectralExtremes(sign=sign, deviation=of("std"), **{name: of(name) for name in same})
    fit = "weibull_maxima" if sign > 0.0 else "weibull_minima"
    parts = ("location", "scale", "shape", "threshold", "share", "rate")
    return WeibullExtremes(sign=sign, **{name: of(f"{fit}.{name}") for name in parts})


def _fatigue(table: SweepTable, group: Group) -> Iterator[LongTermFatigue]:
    """Of the tendon with the largest range, and of every other signal that has ranges."""
    settings = table.long_term
    curve, factor = None, _PASCAL
    if settings.log10_a is not None and settings.area is not None:
        curve = SNCurve(log10_a=float(settings.log10_a), slope=table.slope)
        factor = _PASCAL * settings.stress_concentration / settings.area
    found = []
    for signal in _signals(table, "damage_equivalent_range"):
        ranges = table.statistic(signal, "damage_equivalent_range")[group.rows]
        if not np.any(np.isfinite(ranges) & group.occurs):
            continue
        forces = table.units[signal] == "N"
        found.append(
            long_term_fatigue(
                group.states,
                ranges,
                table.slope,
                signal=signal,
                unit=table.units[signal],
                state=group.state,
                years=float(settings.life),
                curve=curve if forces else None,
                stress_factor=factor,
            )
        )
    kinds = dict.fromkeys(each.signal.partition("[")[0] for each in found)
    for kind in kinds:
        alike = [each for each in found if each.signal.partition("[")[0] == kind]
        yield max(alike, key=lambda each: each.range_at_1_hz.value)
