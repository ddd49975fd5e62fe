"""What the page of a sweep says first: the numbers that govern, each with its case, and what needs a look."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.scenarios.report.document import Block, Cell, Row, Table
from tlpsim.scenarios.report.sweep_data import DOMAINS, Sweep, severity
from tlpsim.scenarios.report.sweep_words import (
    ALIKE,
    ANY_TENDON,
    EXPECTED_EXTREME,
    HORIZONTAL,
    NEGLIGIBLE,
    signal_label,
    tendon,
    variant_labels,
)
from tlpsim.scenarios.report.words import UNKNOWN, seconds, short, typeset

LARGEST_DEVIATION = 0.1
"""Of standard deviations of the two domains, beyond which the report asks for a look"""
FEWEST_REPLICATES = 3
"""Of a case, from which on it is compared by itself"""
COVERED = 0.999
"""Of the probability, from which on a scatter diagram counts as complete"""

COMPLETE = "complete"
"""Status of a sweep whose jobs have all ended well"""

Finding = tuple[bool | None, str, str]
"""Whether it is good (None where it cannot be told), what was looked at, what was found."""


def status_text(found: Sweep) -> str:
    """`COMPLETE`, or how many jobs are missing or failed."""
    failed = int(np.sum(~found.done))
    missing = found.table.planned - found.rows
    parts = [f"{missing} of {counted(found.table.planned, 'job')} not finished"] if missing > 0 else []
    parts += [f"{failed} of {counted(found.rows, 'job')} failed"] if failed else []
    return ", ".join(parts) or COMPLETE


def counted(count: int, what: str) -> str:
    """So many of something: 1 job, 10 080 jobs."""
    return f"{count:,}".replace(",", "\u202f") + f" {what}" + ("" if count == 1 else "s")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Governing:
    """A number that governs: what it is called, and of which statistic."""

    name: str
    signal: str
    statistic: str


def _governing(found: Sweep) -> list[_Governing]:
    """Largest motions along x and y, highest and lowest tension, largest range; those that the table knows."""
    length = seconds(found.table.exposure)
    sizes = {signal: _size(found, signal, EXPECTED_EXTREME) for signal in HORIZONTAL}
    rows = [
        (f"Largest {signal_label(signal)} in {length}", signal, EXPECTED_EXTREME)
        for signal, size in sizes.items()
        if size > NEGLIGIBLE * max(sizes.values())
    ]
    rows += [
        (f"Highest tension in {length}", ANY_TENDON, "expected_maximum"),
        (f"Lowest tension in {length}", ANY_TENDON, "expected_minimum"),
        (f"Largest damage-equivalent range, m = {found.table.slope:g}", ANY_TENDON, "damage_equivalent_range"),
    ]
    return [
        _Governing(name=name, signal=signal, statistic=statistic)
        for name, signal, statistic in rows
        if (signal, statistic) in found.values
    ]


def _size(found: Sweep, signal: str, statistic: str) -> float:
    """Largest magnitude of a statistic; 0 where it is not known."""
    values = np.abs(found.values.get((signal, statistic), np.empty(0)))
    return float(np.max(values, initial=0.0, where=np.isfinite(values)))


def _worst(found: Sweep, each: _Governing, variant: int | None = None) -> tuple[float, int] | None:
    """The worst mean over replicates, of all variants or of one, and a row of its case; None where none is known."""
    rows, values = found.averaged(each.signal, each.statistic)
    if variant is not None:
        chosen = found.table.columns["variant"][rows] == variant
        rows, values = rows[chosen], values[chosen]
    if not len(rows):
        return None
    worst = int(np.argmax(severity(values, each.statistic)))
    return float(values[worst]), int(rows[worst])


def governing_cards(found: Sweep) -> list[tuple[str, Cell]]:
    """What governs, each with its case."""
    cards = []
    for each in _governing(found):
        worst = _worst(found, each)
        if worst is None:
            continue
        value, row = worst
        below = found.case_text(row)
        if each.signal == ANY_TENDON:
            below = f"tendon {_governing_tendon(found, each.statistic, row)}; {below}"
        cards.append((each.name, Cell(text=f"{short(value)} {typeset(found.units[each.signal])}", below=below)))
    return cards


def alternative_blocks(found: Sweep) -> list[Block]:
    """What governs each design alternative, side by side; nothing where there is one."""
    table, governing = found.table, _governing(found)
    if len(table.variants) < 2 or not governing:
        return []
    rows = []
    for variant, label in enumerate(variant_labels(table.variants)):
        cells: list[str | Cell] = []
        for each in governing:
            worst = _worst(found, each, variant)
            slack = worst is not None and each.statistic == "expected_minimum" and worst[0] <= 0.0
            case = "" if worst is None else f"case {int(table.columns['case'][worst[1]])}"
            text = UNKNOWN if worst is None else short(worst[0])
            cells.append(Cell(text=text, below=case, tone="attention" if slack else ""))
        number, _, settings = label.partition(": ")
        rows.append(Row(heading=number, cells=(settings, *cells)))
    headings = [f"{each.name}, {typeset(found.units[each.signal])}" for each in governing]
    return [
        Table(
            caption="Design alternatives",
            headings=("variant", "settings", *headings),
            rows=tuple(rows),
            note="The worst case of each, the mean over its replicates.",
            text_columns=(0,),
        )
    ]


def _governing_tendon(found: Sweep, statistic: str, row: int) -> str:
    """Number of the tendon with the value of the governing one in a row."""
    value = found.values[ANY_TENDON, statistic][row]
    names = [signal for signal in found.signals if tendon(signal) and (signal, statistic) in found.values]
    return tendon(next(each for each in names if found.values[each, statistic][row] == value))


def findings(found: Sweep) -> list[Finding]:
    """Findings: whether it is good (None where it cannot be told), what was looked at, what was found."""
    status = status_text(found)
    good = status == COMPLETE and found.rows > 0
    told = f"all {counted(found.rows, 'job')} are done" if good else "the table has none" if not found.rows else status
    return [(good, "Jobs", told), *_probability(found), *_slack(found), *_deviation(found)]


def _probability(found: Sweep) -> list[Finding]:
    """Whether the cases that are done in some domain have all of the probability, for each variant.

    One domain may be left to the other by intent, as where only the worst cases are run in the time domain.
    """
    columns = found.table.columns
    probability = np.asarray(columns.get("probability", np.full(found.rows, np.nan)), dtype=np.float64)
    if not np.isfinite(probability).any():
        return [(None, "Probability", "no probabilities of sea states are given")] if found.rows else []
    missing, parts = False, []
    for variant in np.unique(columns["variant"]):
        which = f"variant {int(variant) + 1}, " if len(found.table.variants) > 1 else ""
        best = 0.0
        for number in np.unique(found.domain):
            chosen = (columns["variant"] == variant) & (found.domain == number)
            done = _of_cases(found, probability, chosen & found.done)
            failed = _of_cases(found, probability, chosen) - done
            best = max(best, done)
            if chosen.any() and _percent(done) != _percent(1.0):
                text = f" ({_percent(failed)} in failed cases)" if failed > 0.0 else ""
                parts.append(f"{which}{DOMAINS[int(number)]} domain: {_percent(done)}{text}")
        missing |= best < COVERED
    told = "; ".join(parts if missing else ["all of it in one domain", *parts] if parts else ["all of it"])
    return [(not missing, "Probability covered", told)]


def _of_cases(found: Sweep, probability: NDArray[np.float64], chosen: NDArray[np.bool_]) -> float:
    """Probability of the cases of chosen rows, each once however many replicates it has."""
    rows = np.flatnonzero(chosen)
    _, first = np.unique(found.cases[rows], return_index=True)
    return float(np.nansum(probability[rows[first]]))


def _percent(share: float) -> str:
    # Rounded down: 100 % is said of nothing that is less, and 0 % of nothing that is more.
    if 0.0 < share < 1e-4:
        return "less than 0.01 %"
    return f"{math.floor(round(1e4 * share, 6)) / 100.0:g} %"


def _slack(found: Sweep) -> list[Finding]:
    """Whether a tendon loses its tension, in a record or by what is expected."""
    known = [name for name in ("minimum", "expected_minimum") if (ANY_TENDON, name) in found.values]
    if not known:
        return []
    parts = []
    for name, how in (("minimum", "in records"), ("expected_minimum", "expected")):
        if name in known:
            with np.errstate(invalid="ignore"):
                slack = found.values[ANY_TENDON, name] <= 0.0
            cases = len(np.unique(found.cases[slack]))
            parts += [f"{how} in {counted(cases, 'case')}"] if cases else []
    if parts:
        return [(False, "Tendons", f"without tension at times: {', '.join(parts)}")]
    return [(True, "Tendons", "none goes slack")]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Ratios:
    """Standard deviations of a signal, time over frequency domain, of the k cases that have both and are not small.

    `cases` are their numbers in the sweep (k,), `ratio` is of the mean over replicates (k,), and `apart` says whether
    at least three replicates are all on one side of the frequency domain's (k,).
    """

    signal: str
    cases: NDArray[np.int64]
    ratio: NDArray[np.float64]
    apart: NDArray[np.bool_]


def _ratios(found: Sweep, signal: str) -> _Ratios:
    values = found.values[signal, "std"]
    known = found.done & np.isfinite(values)
    size = int(found.cases.max()) + 1
    spectral, recorded = (np.flatnonzero(known & (found.domain == number)) for number in range(2))
    expected, low, high = np.full(size, np.nan), np.full(size, np.inf), np.full(size, -np.inf)
    expected[found.cases[spectral]] = values[spectral]
    place = found.cases[recorded]
    np.minimum.at(low, place, values[recorded])
    np.maximum.at(high, place, values[recorded])
    count = np.bincount(place, minlength=size)
    mean = np.bincount(place, values[recorded], size) / np.maximum(count, 1)
    least = NEGLIGIBLE * max(_size(found, each, "std") for each in (signal, ALIKE.get(signal, signal)))
    cases = np.flatnonzero((count > 0) & (expected > least) & (mean > least))
    apart = (count >= FEWEST_REPLICATES) & ((expected < low) | (expected > high))
    return _Ratios(signal=signal, cases=cases, ratio=mean[cases] / expected[cases], apart=apart[cases])


def _deviation(found: Sweep) -> list[Finding]:
    """Whether the standard deviations of the motions agree in both domains.

    Single records scatter; what counts is the average over cases, and cases whose replicates all deviate.
    """
    signals = [s for s in found.signals if not tendon(s) and s != ANY_TENDON and (s, "std") in found.values]
    compared = [each for signal in signals if len((each := _ratios(found, signal)).cases)] if found.rows else []
    if not compared:
        return []
    averages = {each.signal: float(np.exp(np.mean(np.log(each.ratio)))) for each in compared}
    worst = max(averages, key=lambda signal: abs(averages[signal] - 1.0))
    far = max(compared, key=lambda each: float(np.max(np.abs(each.ratio - 1.0))))
    place = int(np.argmax(np.abs(far.ratio - 1.0)))
    row = int(np.flatnonzero(found.cases == far.cases[place])[0])
    beyond = {
        case for each in compared for case in each.cases[each.apart & (np.abs(each.ratio - 1.0) > LARGEST_DEVIATION)]
    }
    text = (
        f"standard deviations of motions, time over frequency domain: {averages[worst]:.3f} on the average for "
        f"{signal_label(worst)}, which is farthest from 1; {far.ratio[place]:.2f} in the farthest case "
        f"({signal_label(far.signal)}, case {int(found.table.columns['case'][row])})"
    )
    if beyond:
        total = len(set(np.concatenate([each.cases for each in compared]).tolist()))
        limit = f"{100.0 * LARGEST_DEVIATION:g} %"
        text += f"; in {len(beyond)} of {counted(total, 'case')} by more than {limit} and in each replicate"
    good = not beyond and abs(averages[worst] - 1.0) <= LARGEST_DEVIATION
    return [(good, "Time and frequency domain", text)]
