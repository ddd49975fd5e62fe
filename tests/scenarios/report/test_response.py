"""Table I of the report against the summary of a run and the frequency domain."""

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from tlpsim.loads.spectral.records import SpectralResponse
from tlpsim.scenarios.report.analysis import Analysis, analysed
from tlpsim.scenarios.report.cases import cases
from tlpsim.scenarios.report.document import Cell, Row, Table, Text
from tlpsim.scenarios.report.response import summary_blocks
from tlpsim.scenarios.report.words import number
from tlpsim.scenarios.results import Results
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.spectral_tables import quantity_statistics
from tlpsim.scenarios.statistics.summary import TABLE_UNITS, summary


@pytest.fixture(scope="module")
def analysis(record: Results, fake_response: Callable[..., SpectralResponse]) -> Analysis:
    """One record of the storm, with a response of the frequency domain that needs no solver."""
    (case,) = cases([record])
    return dataclasses.replace(analysed(case), response=fake_response())


def motions(analyses: list[Analysis]) -> tuple[Row, ...]:
    return next(block for block in summary_blocks(analyses) if isinstance(block, Table)).rows


def texts(row: Row) -> list[str]:
    return [cell.text if isinstance(cell, Cell) else cell for cell in row.cells]


def test_the_time_domain_is_the_summary_of_the_run(analysis: Analysis) -> None:
    rows = motions([analysis])[::2]
    found = summary(analysis.case.results[0], start=100.0)
    for row, expected in zip(rows, found.motions, strict=True):
        names = ("mean", "low_frequency", "wave_frequency", "std", "minimum", "maximum")
        assert texts(row) == [number(getattr(expected, name)) for name in names]
        assert row.lead


def test_the_frequency_domain_stands_below_with_its_deviation(analysis: Analysis) -> None:
    assert analysis.response is not None
    for degree, row, above in zip(TABLE_UNITS, motions([analysis])[1::2], motions([analysis])[::2], strict=True):
        quantity = analysis.response.quantities[f"position.{degree}"]
        found, scale = quantity_statistics(quantity, 10800.0), TABLE_UNITS[degree][1]
        assert texts(row)[:4] == [
            number(scale * value) for value in (found.mean, found.low_frequency, found.wave_frequency, found.std)
        ]
        std = row.cells[3]
        assert isinstance(std, Cell)
        if std.below:
            ratio = float(texts(row)[3]) / float(texts(above)[3])
            told = float(std.below.replace("−", "-").removesuffix(" %"))
            assert told == pytest.approx(100.0 * (ratio - 1.0), abs=0.3)  # figures of three decimals


def test_cases_stand_below_each_other(analysis: Analysis) -> None:
    other = dataclasses.replace(analysis, case=dataclasses.replace(analysis.case, label="Other"), response=None)
    rows = motions([analysis, other])
    assert len(rows) == 6 * 3
    headings = [row.heading for row in rows[:3]]
    assert [each.below for each in headings if isinstance(each, Cell)] == [
        f"{analysis.case.label}, time domain",
        f"{analysis.case.label}, frequency domain",
        "Other, time domain",
    ]


def test_shapes_without_a_frequency_domain_have_no_columns_for_it(analysis: Analysis) -> None:
    for response, columns in ((analysis.response, 6), (None, 3)):
        blocks = summary_blocks([dataclasses.replace(analysis, response=response)])
        shapes = [block for block in blocks if isinstance(block, Table)][1]
        assert {len(row.cells) for row in shapes.rows} == {columns} == {len(shapes.headings) - 1}


def test_why_there_are_no_statistics(written: Callable[..., Results], storm: Scenario) -> None:
    (case,) = cases([written({"wave.elevation": np.zeros(50)}, scenario=storm.with_(waves={"drift": "none"}))])
    swapped = dataclasses.replace(case, scenario=None)
    assert analysed(swapped).without_statistics == "the run is not one of a scenario"
    found = Analysis(
        case=case, start=0.0, statistics={}, without_statistics="nothing", response=None, without_response="a vendor's"
    )
    told = [block.text for block in summary_blocks([found]) if isinstance(block, Text)]
    assert told == ["No statistics: nothing.", "The frequency domain stands aside: a vendor's."]


def test_notes_that_differ_in_numbers_are_one(analysis: Analysis) -> None:
    names = list(analysis.statistics)[:3]
    noted = {
        name: dataclasses.replace(analysis.statistics[name], note=f"the whole record is used; {k} maxima are too few")
        for k, name in enumerate(names, 2)
    }
    told = [
        block.text
        for block in summary_blocks([dataclasses.replace(analysis, statistics=noted)])[2:]
        if isinstance(block, Text)
    ]
    assert told[1:] == [
        "Note: the whole record is used.",
        f"Note: 2 maxima are too few ({names[0]}; 2 more signals alike).",
    ]
