import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tlpsim.loads.wind.field import WindField
from tlpsim.scenarios.assemble import wind_loads
from tlpsim.scenarios.report.analysis import Analysis
from tlpsim.scenarios.report.cases import Case
from tlpsim.scenarios.report.document import Cell, Chart, Grid, Table, Text
from tlpsim.scenarios.report.processes import process_blocks
from tlpsim.scenarios.results import Results
from tlpsim.scenarios.schema import Scenario


def of(results: Results, scenario: Scenario) -> Analysis:
    case = Case(label="case", results=(results,), records=("seed 1",), scenario=scenario)
    return Analysis(case=case, start=0.0, statistics={}, without_statistics="", response=None, without_response="")


@pytest.fixture(scope="module")
def nothing(written: Callable[..., Results]) -> Results:
    return written({"platform.position.surge": np.arange(9.0)})


def test_certificates_are_those_of_the_run(nothing: Results, storm: Scenario) -> None:
    blocks, trusted = process_blocks([of(nothing, storm)])
    assert trusted is True
    table = next(block for block in blocks if isinstance(block, Table))
    assert table.headings == ("", "wind", "waves", "limit")
    wind = wind_loads(storm)
    assert wind is not None
    assert isinstance(wind.field, WindField)
    certificate = wind.field.certificate
    cells = {row.heading: row.cells for row in table.rows}
    largest = cells["largest error of the spectra, dB"]
    assert isinstance(largest[0], Cell)
    assert float(largest[0].text) == pytest.approx(certificate.auto_error_max, abs=5e-3)
    assert [cell.text for cell in cells["verdict"][:2] if isinstance(cell, Cell)] == ["within limits"] * 2
    grid = next(block for block in blocks if isinstance(block, Grid))
    charts = [block for block in grid.blocks if isinstance(block, Chart)]
    for chart in charts:
        curves = {each["label"]: each for each in chart.content["choices"][0]["views"][0]["series"]}
        assert set(curves) == {"asked for", "filter"}  # nothing of these processes was recorded
        told = re.search(r"over that asked for: (\d+\.\d+)", chart.caption)
        assert told is not None
        frequency = np.array(curves["filter"]["x"])
        made, asked = (np.trapezoid(curves[name]["y"], frequency) for name in ("filter", "asked for"))
        assert float(told[1]) == pytest.approx(made / asked, rel=1e-3)
        # The root mean square error of the wind's filter is 0.14 dB, 3 %, and the waves' is less.
        assert made / asked == pytest.approx(1.0, abs=0.05)


def test_a_missed_spectrum_asks_for_a_look(nothing: Results, storm: Scenario) -> None:
    poor = storm.with_(wind={"orders": {"long": 3, "autoregressive": 1, "moving_average": 0}})
    blocks, trusted = process_blocks([of(nothing, poor)])
    assert trusted is False
    table = next(block for block in blocks if isinstance(block, Table))
    verdict = [cell for cell in table.rows[-1].cells if isinstance(cell, Cell)]
    assert (verdict[0].text, verdict[0].tone) == ("beyond limits", "attention")


def test_calm_and_still_have_no_filters(nothing: Results, storm: Scenario) -> None:
    calm = storm.with_(wind={"speed": 0.0}, waves={"significant_height": 0.0})
    blocks, trusted = process_blocks([of(nothing, calm)])
    assert trusted is None
    assert [type(block) for block in blocks] == [Text]


def test_a_file_that_is_gone_is_told(nothing: Results, storm: Scenario, tmp_path: Path) -> None:
    gone = storm.with_(platform={"hydrodynamics": str(tmp_path / "gone.h5")})
    blocks, trusted = process_blocks([of(nothing, gone)])
    assert trusted is None
    assert isinstance(blocks[0], Text)
    assert "gone.h5" in blocks[0].text
