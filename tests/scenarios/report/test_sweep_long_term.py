"""Blocks of long-term results: values in the units that are shown, what governs, and the curves."""

import numpy as np
import pytest
from sweep_by_hand import SURGE, TENSION, table

from tlpsim.scenarios.report.document import Cell, Chart, Facts, Fold, Grid, Table, Text
from tlpsim.scenarios.report.sweep_content import sweep_document
from tlpsim.scenarios.report.sweep_long_term import (
    YEAR,
    FatigueFigures,
    LongTermFigures,
    governing_extremes,
    long_term_blocks,
)

HOURS = 10800.0
LEVELS = np.linspace(1e6, 3e7, 200)


def tension(**changes: object) -> LongTermFigures:
    """An exponential law of 1.5 MN a factor e, from 1 MN on."""
    values = {
        "signal": f"{TENSION}[7]",
        "unit": "N",
        "duration": HOURS,
        "levels": LEVELS,
        "exceedance": np.exp(-(LEVELS - 1e6) / 1.5e6),
        "return_values": {years: 1e6 + 1.5e6 * np.log(years * YEAR / HOURS) for years in (1.0, 100.0)},
        "intervals": {100.0: (2e7, 2.4e7)},
        "contributions": ((20, 0.43), (3, 0.2)),
        "covered": 0.99,
        "notes": ("no replicates",),
    }
    return LongTermFigures(**values | changes)  # type: ignore[arg-type]


def text(variant: int, case: int) -> str:
    return f"case {case}, of variant {variant}"


def test_return_values_are_shown_in_mega_newtons_with_what_governs() -> None:
    table_of_values, chart, grid, note = long_term_blocks([tension()], [], text)
    assert isinstance(table_of_values, Table)
    (row,) = table_of_values.rows
    first, last, unit, governing, covered = row.cells
    assert table_of_values.headings[1:3] == ("1 year", "100 years")
    expected = [1e-6 * value for value in tension().return_values.values()]
    assert [float(cell.text) for cell in (first, last)] == pytest.approx(expected, abs=6e-3)  # type: ignore[union-attr]
    assert last.below == "20.000 to 24.000"  # type: ignore[union-attr]
    assert unit == "MN"
    assert governing == Cell(text="43 %: case 20", below="of variant 0")
    assert covered == Cell(text="99 %", tone="attention")
    assert isinstance(grid, Grid)
    (shares,) = grid.blocks
    assert isinstance(shares, Table)
    assert [each.cells[0] for each in shares.rows] == [
        Cell(text="43.0 %", share=0.43),
        Cell(text="20.0 %", share=0.2),
    ]
    assert isinstance(note, Text)
    assert note.text == "tension, tendon 7, maximum: no replicates"
    assert isinstance(chart, Chart)


def test_return_periods_cross_the_curve_at_the_return_values() -> None:
    _, chart, *_ = long_term_blocks([tension()], [], text)
    (choice,) = chart.content["choices"]  # type: ignore[union-attr]
    (view,) = choice["views"]
    (curve,) = view["series"]
    marks = {mark["label"]: mark["y"] for mark in view["marks"]}
    assert list(marks) == ["1 year", "100 years"]
    for years, label in ((1.0, "1 year"), (100.0, "100 years")):
        level = np.interp(-np.log(marks[label]), -np.log(curve["y"]), curve["x"])
        assert level == pytest.approx(1e-6 * tension().return_values[years], rel=1e-3)  # figures of 4 digits
    assert min(curve["y"]) < min(marks.values())


def test_minima_rise_along_the_axis() -> None:
    lowest = tension(side="minimum", levels=LEVELS[::-1], exceedance=np.exp(-(3e7 - LEVELS[::-1]) / 1.5e6))
    _, chart, *_ = long_term_blocks([lowest], [], text)
    (curve,) = chart.content["choices"][0]["views"][0]["series"]  # type: ignore[union-attr]
    assert np.all(np.diff(curve["x"]) > 0.0)
    assert np.all(np.diff(curve["y"]) > 0.0)


def test_both_domains_of_a_signal_are_in_one_figure() -> None:
    values, chart, *_ = long_term_blocks([tension(), tension(domain="time"), tension(side="minimum")], [], text, 2)
    assert [row.heading for row in values.rows] == [  # type: ignore[union-attr]
        "tension, tendon 7, maximum (variant 1, frequency)",
        "tension, tendon 7, maximum (variant 1, time)",
        "tension, tendon 7, minimum (variant 1, frequency)",
    ]
    assert [len(choice["views"][0]["series"]) for choice in chart.content["choices"]] == [2, 1]  # type: ignore[union-attr]


def test_many_signals_do_not_fill_the_page() -> None:
    several = [tension(signal=f"{TENSION}[{number}]") for number in range(1, 13)]
    *_, grid, fold, _ = [each for each in long_term_blocks([*several], [], text) if isinstance(each, Grid | Fold)] + [
        None
    ]
    assert isinstance(grid, Grid)
    assert len(grid.blocks) == 4
    assert isinstance(fold, Fold)


def test_fatigue() -> None:
    found = FatigueFigures(
        signal=f"{TENSION}[1]",
        unit="N",
        damage_equivalent_range=1.5e6,
        slope=4.0,
        damage=1.2,
        life=25.0,
        contributions=((2, 0.3),),
    )
    values, grid = long_term_blocks([], [found], text)
    assert isinstance(values, Table)
    assert values.rows[0].cells == (
        "1.500",
        "MN",
        "4.00",
        Cell(text="1.20", tone="attention"),
        "25 years",
        Cell(text="30 %: case 2", below="of variant 0"),
    )
    assert isinstance(grid, Grid)


def test_the_page_says_first_what_the_design_value_is() -> None:
    surge = tension(
        signal=SURGE, unit="m", levels=1e-6 * LEVELS, return_values={100.0: 18.6}, contributions=((22, 0.5),)
    )
    document = sweep_document(table(), [surge])
    facts = next(each for each in document.head if isinstance(each, Facts))
    cell = dict(facts.entries)["surge: 100-year maximum"]
    assert cell.text == "18.6 m"
    assert cell.below == (
        "frequency domain\n50 % by case 22, significant height 8 m, peak period 12 s, waves heading 0 deg"
    )
    assert "long-term" in [section.anchor for section in document.sections if section.blocks]


def test_the_design_is_decided_by_the_worst_of_each_kind() -> None:
    def of(value: float, **changes: object) -> LongTermFigures:
        return tension(return_values={1.0: 5e8, 100.0: value}, **changes)

    extremes = [
        of(18.0, signal=SURGE, unit="m"),
        of(-19.0, signal=SURGE, unit="m", side="minimum", domain="time"),
        of(2.0e7, signal=f"{TENSION}[1]"),
        of(2.1e7, signal=f"{TENSION}[2]"),
        of(3e6, signal=f"{TENSION}[1]", side="minimum"),
        of(2e6, signal=f"{TENSION}[2]", side="minimum", variant=1),
        of(np.nan, signal=f"{TENSION}[3]", side="minimum"),
        of(9.0, signal="platform.position.heave", unit="m"),
        of(0.1, signal="platform.position.sway", unit="m"),
    ]
    found = governing_extremes(extremes)
    assert [each.return_values[100.0] for each in found] == [-19.0, 2.1e7, 2e6]


def test_without_results_there_is_no_section() -> None:
    assert long_term_blocks([], [], text) == []
