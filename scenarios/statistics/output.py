"""What `tlpsim statistics` leaves: tables, JSON, CSV."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.markup import escape
from rich.table import Table

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.whole_file import whole_file
from tlpsim.scenarios.json_text import json_text
from tlpsim.scenarios.results import Results
from tlpsim.scenarios.statistics.bands import BAND_EDGES
from tlpsim.scenarios.statistics.fatigue import EQUIVALENT_FREQUENCY
from tlpsim.scenarios.statistics.records import Estimate, GumbelFit, SignalStatistics, WeibullFit
from tlpsim.scenarios.statistics.summary import TABLE_UNITS
from tlpsim.scenarios.terminal import output, say

SUFFIXES = (".csv", ".json")

_LABEL = 15  # characters of a signal's name and unit, that are not broken
_MEGA = ("N", "N.m", "N*m", "Nm", "Pa")  # units of which a table shows a million, where the numbers are large


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """What statistics are of, and what they were asked for.

    Attributes
    ----------
    title
        Of the case.
    paths
        Of its records.
    seeds
        Of each record.
    exposure, slope, confidence
        As of `tlpsim.scenarios.statistics.signals.run_statistics`.
    signals
        The statistics.
    """

    title: str
    paths: tuple[str, ...]
    seeds: tuple[dict[str, int], ...]
    exposure: float
    slope: float
    confidence: float
    signals: tuple[SignalStatistics, ...]


def study(
    results: Sequence[Results], signals: Sequence[SignalStatistics], exposure: float, slope: float, confidence: float
) -> Study:
    """The statistics of results with what they are of."""
    return Study(
        title=results[0].title,
        paths=tuple(str(each.path) for each in results),
        seeds=tuple(each.seeds for each in results),
        exposure=exposure,
        slope=slope,
        confidence=confidence,
        signals=tuple(signals),
    )


# Files


def require_output(path: Path) -> None:
    """Refuse a name of an output whose suffix says no format.

    Raises
    ------
    ScenarioError
        When it is neither .csv nor .json.
    """
    if path.suffix not in SUFFIXES:
        raise ScenarioError(f"--output {path}: its suffix must say the format, {' or '.join(SUFFIXES)}")


def write_statistics(found: Study, path: Path) -> None:
    """Write as CSV, a line for each number, or as JSON, by the suffix; the file is there when it is complete.

    Raises
    ------
    ScenarioError
        If the file cannot be written, or its suffix says no format.
    """
    require_output(path)
    with whole_file(path, "the statistics") as part, part.open("w", newline="", encoding="utf-8") as text:
        if path.suffix == ".json":
            text.write(json_text(statistics_content(found)) + "\n")
            return
        writer = csv.DictWriter(text, ("signal", "unit", "statistic", "value", "low", "high"))
        writer.writeheader()
        writer.writerows(statistics_rows(found))


def statistics_content(found: Study) -> dict[str, Any]:
    """Everything as nested mappings and lists, in the units of the results; what is not known is NaN."""
    return {"kind": "statistics", "equivalent_frequency": EQUIVALENT_FREQUENCY, **_plain(found)}


def _plain(value: Any) -> Any:
    """A record as a mapping, an array as a list."""
    if is_dataclass(value):
        return {each.name: _plain(getattr(value, each.name)) for each in fields(value)}
    if isinstance(value, tuple):
        return [_plain(each) for each in value]
    return value.tolist() if isinstance(value, np.ndarray) else value


def statistics_rows(found: Study) -> list[dict[str, Any]]:
    """A row for each number of each signal; bounds are empty where it is not an estimate."""
    rows = []
    for each in found.signals:
        for statistic, value, low, high in statistic_numbers(each):
            row = {"signal": each.name, "unit": each.unit, "statistic": statistic}
            rows.append(row | {"value": value, "low": low, "high": high})
    return rows


def statistic_numbers(signal: SignalStatistics) -> Iterator[tuple[str, Any, Any, Any]]:
    """Name, value and bounds of each number of a signal; bounds are "" where it is not an estimate."""
    for field in fields(signal):
        value = getattr(signal, field.name)
        if isinstance(value, Estimate):
            yield field.name, value.value, value.low, value.high
        elif isinstance(value, WeibullFit | GumbelFit):
            for part in fields(value):
                inner = getattr(value, part.name)
                bounds = (inner.value, inner.low, inner.high) if isinstance(inner, Estimate) else (inner, "", "")
                yield (f"{field.name}.{part.name}", *bounds)
        elif isinstance(value, float | int):
            yield field.name, value, "", ""


# Tables


def print_statistics(found: Study) -> None:
    """Means and spreads, shape of the distribution, extremes and fatigue, each with its interval, and notes."""
    signals = found.signals
    if not signals:
        return
    number, start = max(each.records for each in signals), min(each.start for each in signals)
    duration = min(each.duration for each in signals)
    records = "1 record" if number == 1 else f"{number} records"
    say(
        f"{found.title}: {records} of {duration:.0f} s from {start:g} s; "
        f"intervals of {100 * found.confidence:g} %, frequencies in Hz"
    )
    low, high = BAND_EDGES
    spread = {
        "mean": lambda each: _cell(each, each.mean),
        f"std\n<{low}": lambda each: _cell(each, each.low_frequency),
        f"std\n{low}–{high}": lambda each: _cell(each, each.wave_frequency),
        "std": lambda each: _cell(each, each.std),
    }
    shape = {
        "period\ns": lambda each: _interval(each.zero_crossing_period, 1.0),
        "skewness": lambda each: _interval(each.skewness, 1.0, 11),
        "excess\nkurtosis": lambda each: _interval(each.excess_kurtosis, 1.0, 11),
        "min": lambda each: _seen(each, each.minimum),
        "max": lambda each: _seen(each, each.maximum),
    }
    length = f"{found.exposure / 3600.0:g} h"
    extremes: dict[str, Callable[[SignalStatistics], str]] = {
        f"min\nexpected in {length}": lambda each: _cell(each, each.expected_minimum, ends=True),
        f"max\nexpected in {length}": lambda each: _cell(each, each.expected_maximum, ends=True),
    }
    if any(each.damage_equivalent_range is not None for each in signals):
        extremes[f"range, m = {found.slope:g}\n{EQUIVALENT_FREQUENCY:g} Hz"] = lambda each: (
            "" if each.damage_equivalent_range is None else _cell(each, each.damage_equivalent_range)
        )
    _print("", spread, signals)
    _print("", shape, signals)
    _print("", extremes, signals)
    if any(each.gumbel_maximum is not None for each in signals):
        _print(f"extremes of records (Gumbel), mean in {length}", _gumbel_columns(), signals)
    for note in _notes(signals):
        say(f"note: {note}")


def _gumbel_columns() -> dict[str, Callable[[SignalStatistics], str]]:
    def column(name: str, what: str) -> Callable[[SignalStatistics], str]:
        def cell(each: SignalStatistics) -> str:
            fit: GumbelFit | None = getattr(each, name)
            if fit is None:
                return "–"
            return _cell(each, fit.expected) if what == "mean" else _seen(each, fit.scale)

        return cell

    return {
        "min": column("gumbel_minimum", "mean"),
        "scale": column("gumbel_minimum", "scale"),
        "max": column("gumbel_maximum", "mean"),
        "scale ": column("gumbel_maximum", "scale"),
    }


def _print(
    title: str, columns: dict[str, Callable[[SignalStatistics], str]], signals: Sequence[SignalStatistics]
) -> None:
    table = Table(title=title or None)
    table.add_column("", overflow="fold", min_width=min(max(len(label(each)) for each in signals), _LABEL))
    for heading in columns:
        table.add_column(heading, justify="right", no_wrap=True)
    for each in signals:
        table.add_row(escape(label(each)), *(cell(each) for cell in columns.values()))
    output.print(table)


def label(signal: SignalStatistics) -> str:
    """Short name of a signal with the unit of its row: "surge, m", "tendon 3, MN"; the full name of any other."""
    name = signal.name.removeprefix("platform.")
    degree = name.removeprefix("position.")
    short = f"tendon {name[15:-1]}" if name.startswith("tendon_tension[") else degree if _is_motion(signal) else name
    unit = _row_unit(signal)[0]
    return f"{short}, {unit}" if unit else short


def _is_motion(signal: SignalStatistics) -> bool:
    degree = signal.name.removeprefix("platform.position.")
    return degree in TABLE_UNITS and signal.unit == ("rad" if TABLE_UNITS[degree][0].endswith("rad") else "m")


def _row_unit(signal: SignalStatistics) -> tuple[str, float]:
    """Unit of a row of a table, and how many there are in the recorded one."""
    if _is_motion(signal):
        return TABLE_UNITS[signal.name.removeprefix("platform.position.")]
    tension = "tendon_tension[" in signal.name
    largest = max(abs(signal.maximum), abs(signal.minimum))
    if signal.unit in _MEGA and (tension or largest >= 1e5):
        return f"M{signal.unit}", 1e-6
    return signal.unit, 1.0


def _cell(signal: SignalStatistics, estimate: Estimate, ends: bool = False) -> str:
    return (_between if ends else _interval)(estimate, _row_unit(signal)[1])


def _seen(signal: SignalStatistics, value: float) -> str:
    return _number(value * _row_unit(signal)[1], 3)


def _interval(estimate: Estimate, factor: float, width: int = 12) -> str:
    """Value ± half of its interval, with two digits of that where they fit, and one at least."""
    value, half = factor * estimate.value, 0.5 * factor * (estimate.high - estimate.low)
    if not (math.isfinite(half) and half > 0.0):
        return _number(value, 3)
    return _fitting(half, width, lambda digits: f"{_number(value, digits)}±{half:.{digits}f}")


def _between(estimate: Estimate, factor: float) -> str:
    """Value and both ends of its interval, which is not symmetrical."""
    value, low, high = factor * estimate.value, factor * estimate.low, factor * estimate.high
    half = 0.5 * (high - low)
    if not (math.isfinite(half) and half > 0.0):
        return _number(value, 3)
    return _fitting(
        half, 20, lambda digits: f"{_number(value, digits)} ({_number(low, digits)}, {_number(high, digits)})"
    )


def _fitting(half: float, width: int, text: Callable[[int], str]) -> str:
    """A text with as many decimals as show two digits of half an interval, or one where it is too wide else."""
    digits = min(max(1 - math.floor(math.log10(half)), 0), 6)
    while digits > 0 and len(text(digits)) > width and round(half, digits - 1) > 0.0:
        digits -= 1
    return text(digits)


def _number(value: float, digits: int) -> str:
    return "–" if math.isnan(value) else f"{value:.{digits}f}".replace(f"-{0:.{digits}f}", f"{0:.{digits}f}")


def _notes(signals: Sequence[SignalStatistics]) -> Iterator[str]:
    """Each note once, with the signals that it is of where it is not of all."""
    owners: dict[str, list[str]] = {}
    for each in signals:
        for note in each.note.split("; ") if each.note else []:
            owners.setdefault(note, []).append(label(each).rpartition(", ")[0] or label(each))
    for note, names in owners.items():
        yield note if len(names) == len(signals) else f"{', '.join(names)}: {note}"
