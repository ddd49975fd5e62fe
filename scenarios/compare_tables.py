"""What the command line shows of a comparison of the two domains."""

from __future__ import annotations

import math

from rich.table import Table

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.scenarios.compare import PRECISION, Comparison, ComparisonRow
from tlpsim.scenarios.paper import CAVEAT, SOURCE, TABLE_I
from tlpsim.scenarios.spectral_tables import ENDS, LOW, WAVE, hours, number, worst_tendons
from tlpsim.scenarios.statistics.summary import TABLE_UNITS
from tlpsim.scenarios.terminal import output

_PARTS = {"mean": "mean", "low_frequency": f"std {LOW} Hz", "wave_frequency": f"std {WAVE} Hz"}
_EXTREMES = {"mean": "mean", "std": "std", "maximum": "max", "minimum": "min"}


def print_comparison(comparison: Comparison, paper: bool = False) -> None:
    """Table I of the paper with both domains, extremes, tensions and accelerations, and what the domains cost.

    Parameters
    ----------
    paper
        Whether the paper's own columns stand beside ours.
    """
    rows = comparison.by_name()
    _print_table(comparison, rows, paper)
    if paper:
        _say(f"paper: {SOURCE}; {CAVEAT}")
    _print_others(comparison, rows)
    _print_times(comparison)


def _print_table(comparison: Comparison, rows: dict[tuple[str, str], ComparisonRow], paper: bool) -> None:
    count, length = len(comparison.samples), hours(comparison.scenario.simulation.duration)
    table = Table(title=f"{comparison.scenario.title}: {count} records of {length}, and the frequency domain")
    table.add_column("", no_wrap=True)
    papers = ("paper\ntime", "paper\nfreq.", "freq.\n/time") if paper else ()
    for heading in ("time\ndomain", "± std.\nerror", "freq.\ndomain", "freq.\n/time", *papers):
        table.add_column(heading, justify="right")
    for statistic, what in _PARTS.items():
        table.add_section()
        table.add_row(f"[bold]{what}[/bold]")
        for degree in DEGREES_OF_FREEDOM:
            unit, factor = TABLE_UNITS[degree]
            cells = _cells(rows[f"position.{degree}", statistic], factor)
            if paper:
                time, frequency = TABLE_I[degree][statistic]
                cells += [f"{time:.2f}", f"{frequency:.2f}", number(frequency / time)]
            table.add_row(f"{degree}, {unit}", *cells)
    output.print(table)


def _cells(row: ComparisonRow, factor: float) -> list[str]:
    """Time domain, its error, frequency domain, and their ratio."""
    return [*(number(factor * value) for value in (row.time, row.error, row.frequency)), number(row.ratio)]


def _print_others(comparison: Comparison, rows: dict[tuple[str, str], ComparisonRow]) -> None:
    duration = comparison.scenario.simulation.duration
    table = Table(title=f"total spreads, extremes in {hours(duration)}")
    for heading in ("", ""):
        table.add_column(heading, no_wrap=True)
    for heading in ("time\ndomain", "± std.\nerror", "freq.\ndomain", "freq.\n/time"):
        table.add_column(heading, justify="right")
    for name, what, factor, statistics in _others(comparison):
        table.add_section()
        for place, statistic in enumerate(statistics):
            cells = _cells(rows[name, statistic], factor)
            table.add_row("" if place else what, _EXTREMES[statistic], *cells)
    output.print(table)
    output.print("ratios of extremes are those of their distances from the mean")


def _others(comparison: Comparison) -> list[tuple[str, str, float, tuple[str, ...]]]:
    """Quantities of the second table: name, how it is called, factor of its unit, and what is shown of it."""
    duration = comparison.scenario.simulation.duration
    found: list[tuple[str, str, float, tuple[str, ...]]] = [
        (f"position.{degree}", f"{degree}, {unit}", factor, ("std", "maximum", "minimum"))
        for degree, (unit, factor) in TABLE_UNITS.items()
    ]
    for end, name in ENDS.items():
        for tendon in worst_tendons(comparison.response, end, duration):
            what = f"tension, tendon {tendon}, {end}, MN"
            found.append((f"{name}[{tendon}]", what, 1e-6, ("mean", "std", "maximum", "minimum")))
    for name in comparison.names:
        if name.startswith("point_acceleration["):
            where = name.removeprefix("point_acceleration")
            found.append((name, f"acceleration, point {where}, cm/s²", 1e2, ("std", "maximum", "minimum")))
    return found


def _print_times(comparison: Comparison) -> None:
    times = comparison.times
    how = "FMUs" if comparison.cosimulation else "one loop"
    _say(f"frequency domain: {times.frequency_domain:.2f} s")
    _say(
        f"time domain ({how}): {times.record:.2f} s of one core a record; all {len(comparison.samples)} in "
        f"{times.all_records:.1f} s on {times.workers} core{'s' if times.workers > 1 else ''}"
    )
    if math.isnan(times.scatter):
        _say("scatter between records: not known of one record")
        return
    _say(
        f"slow {times.scattered} scatters by {100.0 * times.scatter:.1f} % between records: "
        f"{math.ceil(times.records_needed)} records for ± {100.0 * PRECISION:g} % at 95 %, "
        f"{times.records_needed * times.record:.0f} s of one core"
    )
    _say(f"at the same precision the frequency domain is {times.ratio:.0f} times as fast")


def _say(text: str) -> None:
    output.print(text, soft_wrap=True)
