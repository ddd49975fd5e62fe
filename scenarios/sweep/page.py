"""The report page of a sweep, in its folder."""

from __future__ import annotations

import math
from pathlib import Path

from tlpsim.loads.whole_file import whole_file
from tlpsim.scenarios.report.page import page
from tlpsim.scenarios.report.sweep_content import sweep_document
from tlpsim.scenarios.report.sweep_long_term import FatigueFigures, LongTermFigures
from tlpsim.scenarios.statistics.long_term import LongTermExtreme
from tlpsim.scenarios.statistics.long_term_fatigue import LongTermFatigue
from tlpsim.scenarios.statistics.sea_states import Contribution
from tlpsim.scenarios.sweep.outlook import Group, Outlook
from tlpsim.scenarios.sweep.table import SweepTable

NAME = "report.html"


def write_sweep_report(table: SweepTable, found: Outlook, path: Path) -> int:
    """Write the report of a sweep, and return its size in bytes.

    Raises
    ------
    ScenarioError
        When the page cannot be written.
    """
    document = sweep_document(
        table,
        [_extreme(group, each) for group, each in found.extremes],
        [_fatigue(group, each) for group, each in found.fatigue],
    )
    content = page(document).encode()
    with whole_file(path, "the report") as part:
        part.write_bytes(content)
    return len(content)


def _extreme(group: Group, each: LongTermExtreme) -> LongTermFigures:
    last = each.returns[-1]
    return LongTermFigures(
        signal=each.signal,
        unit=each.unit,
        side=each.side,
        variant=group.variant,
        domain=group.domain,
        duration=each.duration,
        levels=each.level,
        exceedance=each.exceedance,
        return_values={value.years: value.level.value for value in each.returns},
        intervals={
            value.years: (value.level.low, value.level.high) for value in each.returns if math.isfinite(value.level.low)
        },
        contributions=_cases(group, last.contributions),
        governing_years=last.years,
        covered=each.covered,
        notes=each.notes,
    )


def _fatigue(group: Group, each: LongTermFatigue) -> FatigueFigures:
    return FatigueFigures(
        signal=each.signal,
        unit=each.unit,
        variant=group.variant,
        domain=group.domain,
        damage_equivalent_range=each.range_at_1_hz.value,
        slope=each.slope,
        damage=math.nan if each.damage is None else each.damage.value,
        life=each.years,
        contributions=_cases(group, each.contributions),
        notes=each.notes,
    )


def _cases(group: Group, found: tuple[Contribution, ...]) -> tuple[tuple[int, float], ...]:
    return tuple((int(group.cases[each.state]), each.share) for each in found)
