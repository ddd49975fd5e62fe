"""The response in figures: Table I by both domains, and the shapes of the distributions."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from tlpsim.scenarios.report.analysis import EXPOSURE, POSITIONS, Analysis
from tlpsim.scenarios.report.document import Block, Cell, Row, Table, Text
from tlpsim.scenarios.report.words import UNKNOWN, interval, number, seconds, typeset
from tlpsim.scenarios.spectral_tables import LOW, WAVE, QuantityStatistics, hours
from tlpsim.scenarios.statistics.records import Estimate
from tlpsim.scenarios.statistics.signals import SignalStatistics
from tlpsim.scenarios.statistics.summary import TABLE_UNITS, conversion

_TABLE_STATISTICS = ("mean", "low_frequency", "wave_frequency", "std", "minimum", "maximum")
_SOURCE = (
    "Bands as in Table I of Li and Kareem (1990): a cosine taper and the periodogram, eq. (1) of "
    "tlpsim.scenarios.statistics.bands. In small figures: the 95 % confidence interval; of minimum and maximum, the "
    "extreme expected in {exposure}, with its interval, by the Weibull distribution of the largest value between two "
    "crossings of the mean. Frequency domain: the ensemble's values and expected extremes in {exposure} "
    "(docs/frequency-domain.md), with its deviation from the time domain."
)


def has_response(analyses: Sequence[Analysis]) -> bool:
    """Whether there is anything to tell of motions or tensions."""
    return any(each.statistics for each in analyses)


def summary_blocks(analyses: Sequence[Analysis]) -> list[Block]:
    """Table I with intervals and the frequency domain beside, zero crossings and shapes; what was left out and why."""
    blocks: list[Block] = []
    rows = [row for name in POSITIONS for row in _motion_rows(analyses, name)]
    if rows:
        headings = ("", "mean", f"std {LOW} Hz", f"std {WAVE} Hz", "std", "minimum", "maximum")
        note = _SOURCE.format(exposure=hours(EXPOSURE))
        blocks.append(Table(caption="Motions of the reference point", headings=headings, rows=tuple(rows), note=note))
        blocks.append(_shapes(analyses))
    for each in analyses:
        of = f"{each.case.label}: " if len(analyses) > 1 else ""
        if each.without_statistics:
            blocks.append(Text(text=f"{of}No statistics: {each.without_statistics}."))
        blocks += [Text(text=f"{of}{note}", small=True) for note in _notes(each)]
        if each.case.scenario is not None and each.without_response:
            blocks.append(Text(text=f"{of}The frequency domain stands aside: {each.without_response}.", small=True))
    return blocks


def _notes(analysis: Analysis) -> list[str]:
    """How the statistics were made, and what the reader must know of them."""
    found = list(analysis.statistics.values())
    if not found:
        return []
    first = found[0]
    count = f"{first.records} records of" if first.records > 1 else "one record of"
    made = f"Statistics of {count} {seconds(first.duration)}, from {first.start:g} s on."
    if first.records < 3:
        made += " Intervals of few records rest on how the record scatters within itself."
    return [made, *_together(found)]


def _together(found: Sequence[SignalStatistics]) -> list[str]:
    """Notes of all signals, those that differ in their numbers only as one, with the signal that it is of."""
    groups: dict[str, dict[str, list[str]]] = {}
    for each in found:
        for part in filter(None, each.note.split("; ")):
            groups.setdefault(re.sub(r"[\d.]+", "#", part), {}).setdefault(part, []).append(each.name)
    notes = []
    for texts in groups.values():
        text, names = next(iter(texts.items()))
        others = sum(len(each) for each in texts.values()) - 1
        of = "" if len(texts) == 1 else f" ({names[0]}; {others} more signals alike)"
        notes.append(f"Note: {text}{of}.")
    return notes


def _motion_rows(analyses: Sequence[Analysis], name: str) -> list[Row]:
    """Rows of one degree of freedom: each case by the time domain and, where there is one, the frequency domain."""
    degree = name.rpartition(".")[2]
    unit, scale = TABLE_UNITS[degree]
    rows: list[Row] = []
    for each in analyses:
        found = each.statistics.get(name)
        if found is None:
            continue
        factor = scale * conversion(found.unit, "rad" if unit.endswith("rad") else "m")
        which = f"{each.case.label}, " if len(analyses) > 1 else ""
        heading = Cell(text="" if rows else f"{degree}, {typeset(unit)}", below=f"{which}time domain")
        rows.append(Row(heading=heading, cells=_time_cells(found, factor), lead=not rows))
        expected = each.expected(name)
        if expected:
            heading = Cell(text="", below=f"{which}frequency domain")
            rows.append(Row(heading=heading, cells=_frequency_cells(found, expected, factor, scale)))
    return rows


def _time_cells(found: SignalStatistics, factor: float, digits: int = 3) -> tuple[Cell, ...]:
    estimates = [getattr(found, name) for name in _TABLE_STATISTICS[:4]]
    cells = [Cell(text=number(factor * each.value, digits), below=interval(each, factor, digits)) for each in estimates]
    for value, expected in ((found.minimum, found.expected_minimum), (found.maximum, found.expected_maximum)):
        cells.append(Cell(text=number(factor * value, digits), below=_expected(expected, factor, digits)))
    return tuple(cells)


def _expected(estimate: Estimate, factor: float, digits: int) -> str:
    """The expected extreme with its interval, "" where it is not known."""
    if not math.isfinite(estimate.value):
        return ""
    between = interval(estimate, factor, digits)
    return f"exp. {number(factor * estimate.value, digits)}" + (f"\n{between}" if between else "")


def _frequency_cells(
    found: SignalStatistics, expected: QuantityStatistics, factor: float, scale: float, digits: int = 3
) -> tuple[Cell, ...]:
    """Cells of the frequency domain; `factor` and `scale` are those of the time and of the frequency domain."""
    cells = []
    for name in _TABLE_STATISTICS:
        value = scale * getattr(expected, name)
        compared = getattr(found, name if name in _TABLE_STATISTICS[:4] else f"expected_{name}")
        centre = factor * found.mean.value if name in ("minimum", "maximum") else 0.0
        cells.append(Cell(text=number(value, digits), below=_deviation(value, compared, factor, centre)))
    return tuple(cells)


def _deviation(value: float, estimate: Estimate, factor: float, centre: float) -> str:
    """Deviation of the frequency domain from the time domain, %, both less `centre`; "" where that says nothing."""
    distance = factor * estimate.value - centre
    uncertain = abs(factor * (estimate.high - estimate.low))
    if not math.isfinite(distance) or not abs(distance) > (0.5 * uncertain if math.isfinite(uncertain) else 0.0):
        return ""
    return f"{100.0 * ((value - centre) / distance - 1.0):+.1f} %".replace("-", "−")


def _shapes(analyses: Sequence[Analysis]) -> Table:
    """Zero crossings and the shape of the distribution by both domains, or by the one that there is."""
    rows = []
    both = any(each.response is not None for each in analyses)
    for name in POSITIONS:
        for each in analyses:
            found, expected = each.statistics.get(name), each.expected(name)
            if found is None:
                continue
            which = f", {each.case.label}" if len(analyses) > 1 else ""
            estimates = (found.zero_crossing_period, found.skewness, found.excess_kurtosis)
            time = [Cell(text=number(e.value, 2), below=interval(e, digits=2)) for e in estimates]
            frequency = [UNKNOWN] * 3
            if expected and each.response is not None:
                quantity = each.response.quantities[name.partition(".")[2]]
                frequency = [number(v, 2) for v in (expected.period, quantity.skewness, quantity.excess_kurtosis)]
            cells = [cell for pair in zip(time, frequency, strict=True) for cell in pair[: 2 if both else 1]]
            rows.append(Row(heading=f"{name.rpartition('.')[2]}{which}", cells=tuple(cells)))
    columns = ("crossing period, s", "skewness", "excess kurtosis")
    domains = (": time", ": frequency") if both else ("",)
    headings = ("", *(f"{name}{domain}" for name in columns for domain in domains))
    return Table(
        caption="Zero crossings and distributions",
        headings=headings,
        rows=tuple(rows),
        note="Mean time between up-crossings of the mean; both shapes are 0 for a Gaussian motion.",
    )
