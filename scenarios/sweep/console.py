"""What the command line shows of a sweep: its plan, and what it came to."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import groupby

import numpy as np
from rich.table import Table

from tlpsim.scenarios.problems import dotted
from tlpsim.scenarios.report.sweep_words import signal_label, years_text
from tlpsim.scenarios.report.words import display_unit
from tlpsim.scenarios.spectral_tables import hours
from tlpsim.scenarios.statistics.records import Estimate
from tlpsim.scenarios.statistics.sea_states import Contribution
from tlpsim.scenarios.sweep.outlook import Outlook
from tlpsim.scenarios.sweep.plan import Plan, Sweep
from tlpsim.scenarios.sweep.table import FAILED, SweepTable
from tlpsim.scenarios.terminal import output, say

SPECTRAL_SIZE, RECORD_SIZE = 2.3, 14.0
"""MB of a results file: of a case of the frequency domain, and of an hour of a record with the default outputs"""
_MOST_ERRORS = 5
_MOST_VALUES = 8


def print_plan(sweep: Sweep, plan: Plan) -> None:
    """How many cases and jobs there are, and what varies."""
    jobs = Counter(job.domain for job in plan.jobs)
    worst = sweep.file.time.worst
    if worst is not None:
        jobs["time"] = min(worst, len(plan.cases)) * sweep.file.replicates.records
    told = ", ".join(f"{count} in the {domain} domain" for domain, count in jobs.items() if count)
    say(f"{sweep.title}: {len(plan.cases)} cases, {sum(jobs.values())} jobs: {told}")
    for key in plan.keys:
        values = dict.fromkeys(str(case.settings[key]) for case in plan.cases)
        shown = list(values) if len(values) <= _MOST_VALUES else [*list(values)[:3], "…", list(values)[-1]]
        say(f"  {dotted(key)}: {', '.join(shown)}" + (f" ({len(values)} values)" if len(values) > _MOST_VALUES else ""))
    if plan.weighted:
        covered = sum(case.probability for case in plan.cases) / len(plan.variants)
        say(f"  probability of the environments: {covered:.4g}; alternatives: {len(plan.variants)}")
    sizes = {"frequency": SPECTRAL_SIZE, "time": RECORD_SIZE * sweep.base.simulation.duration / 3600.0}
    size = sum(count * sizes[domain] for domain, count in jobs.items() if domain in sweep.file.files)
    say(f"  results files: about {size:,.0f} MB" if size else "  results files: none")
    for note in plan.notes:
        say(f"  note: {note}")


def print_sweep(table: SweepTable, found: Outlook) -> None:
    """What a sweep came to: jobs, worst cases, return values, fatigue, errors."""
    columns = table.columns
    cases = len(np.unique(columns["case"]))
    failed = table.failed
    rest = table.planned - table.rows
    told = f"{table.rows - failed} done, {failed} failed" + (f", {rest} to do" if rest else "")
    say(f"{table.title}: {cases} cases, {table.planned} jobs: {told}")
    for row in np.flatnonzero(columns["status"] == FAILED)[:_MOST_ERRORS]:
        say(f"  failed: case {columns['case'][row]}, {columns['domain'][row]} domain: {columns['error'][row]}")
    if failed > _MOST_ERRORS:
        say(f"  and {failed - _MOST_ERRORS} more: see the column 'error' of the summary")
    _print_worst(table)
    _print_returns(table, found)
    _print_fatigue(table, found)
    for note in table.notes:
        say(f"note: {note}")
    _print_notes(table, found)


def _print_notes(table: SweepTable, found: Outlook) -> None:
    """Each note of the long-term results once, with what it is of where that is not all of an alternative."""
    owners: dict[tuple[str, str], list[str]] = {}
    results: Counter[str] = Counter()
    for group, each in found.extremes:
        whose = _whose(table, group.variant, group.domain)
        results[whose] += 1
        for note in each.notes:
            owners.setdefault((whose, note), []).append(f"{signal_label(each.signal)} {each.side}")
    for (whose, note), names in owners.items():
        of = "" if len(names) == results[whose] else f" {', '.join(names)}:"
        say(f"note: {whose}:{of} {note}")


def _print_worst(table: SweepTable) -> None:
    """The case with the largest and with the lowest expected extreme of each position and of the tensions."""
    shown = Table(title=f"worst cases: expected extremes in {hours(table.exposure)}")
    for heading in ("", "", "domain", "case", "settings"):
        shown.add_column(heading, justify="left" if heading == "settings" else "right")
    tendons = [signal for signal in table.units if "tendon_tension[" in signal]
    rows = [([signal], side) for signal in table.units if signal not in tendons for side in ("maximum", "minimum")]
    rows += [(tendons, side) for side in ("maximum", "minimum")] if tendons else []
    for signals, side in rows:
        values = np.array([table.statistic(signal, f"expected_{side}") for signal in signals])
        if not np.any(np.isfinite(values)):
            continue
        place = np.nanargmax(values) if side == "maximum" else np.nanargmin(values)
        signal, row = np.unravel_index(place, values.shape)
        name = signals[int(signal)]
        unit, factor = display_unit(name, table.units[name], values)
        shown.add_row(
            f"{signal_label(name)}, {unit}",
            f"{side} {factor * values[signal, row]:.4g}",
            str(table.columns["domain"][row]),
            str(table.columns["case"][row]),
            ", ".join(f"{key} {table.setting(key, int(row))}" for key in table.keys),
        )
    if shown.row_count:
        output.print(shown)


def _print_returns(table: SweepTable, found: Outlook) -> None:
    """Return values, a table for each alternative and domain."""
    for which, extremes in groupby(found.extremes, key=lambda each: (each[0].variant, each[0].domain)):
        results = [each for _, each in extremes]
        years = [each.years for each in results[0].returns]
        say(f"long-term, {_whose(table, *which)}: what extremes of {hours(table.exposure)} pass once in so many years")
        shown = Table()
        for heading in ("", *map(years_text, years), f"governs {years_text(years[-1])}"):
            shown.add_column(heading, justify="left" if heading.startswith("governs") else "right")
        for each in results:
            unit, factor = display_unit(each.signal, each.unit, each.level)
            shown.add_row(
                f"{signal_label(each.signal)} {each.side}, {unit}",
                *(_estimate(value.level, factor) for value in each.returns),
                _governing(each.returns[-1].contributions),
            )
        output.print(shown)


def _whose(table: SweepTable, variant: int, domain: str) -> str:
    """Alternative and domain in words."""
    settings = ", ".join(f"{key} {value}" for key, value in table.variants[variant].items())
    return f"{settings}: {domain} domain" if settings else f"{domain} domain"


def _governing(shares: Sequence[Contribution]) -> str:
    return "; ".join(f"{first.name}: {100.0 * first.share:.0f} %" for first in shares[:1])


def _estimate(value: Estimate, factor: float) -> str:
    text = f"{factor * value.value:.4g}"
    return text if np.isnan(value.low) else f"{text} ({factor * value.low:.4g}, {factor * value.high:.4g})"


def _print_fatigue(table: SweepTable, found: Outlook) -> None:
    for group, each in found.fatigue:
        unit, factor = display_unit(each.signal, each.unit, np.array([each.range_at_1_hz.value]))
        damage = "" if each.damage is None else f", damage in {each.years:g} years {each.damage.value:.3g}"
        say(
            f"fatigue, {_whose(table, group.variant, group.domain)}: {signal_label(each.signal)}: range at 1 Hz "
            f"{_estimate(each.range_at_1_hz, factor)} {unit} for m = {each.slope:g}{damage}; most of it by "
            f"{_governing(each.contributions)}"
        )
