import math
from collections.abc import Callable

import numpy as np
import pytest

from tlpsim.scenarios.report.analysis import Analysis, analysed
from tlpsim.scenarios.report.cases import cases
from tlpsim.scenarios.report.document import Chart, Table
from tlpsim.scenarios.report.extremes import alike, exceedance_chart, key_figures, tendon_blocks
from tlpsim.scenarios.report.words import number
from tlpsim.scenarios.results import Results

TOP = [f"platform.tendon_tension[{k}]" for k in (1, 2, 3)]
BOTTOM = [f"platform.tendon_bottom_tension[{k}]" for k in (1, 2, 3)]


@pytest.fixture(scope="module")
def held(written: Callable[..., Results], storm: object) -> Analysis:
    """Waves of some 12 s in three tendons, of which the first two are alike and the third goes slack."""
    time = np.arange(2400) * 0.5
    rng = np.random.default_rng(4)
    frequencies, phases = rng.uniform(0.06, 0.1, 40), rng.uniform(0.0, 1.0, 40)
    shapes = np.cos(2 * np.pi * (frequencies[:, None] * time + phases[:, None])).sum(axis=0)
    tensions = [1e7 + 2e5 * shapes, 1e7 + 2e5 * shapes, 4e6 + 3e5 * shapes]
    signals = dict(zip(TOP, tensions, strict=True)) | {
        name: np.maximum(each - 2e6, 0.0) for name, each in zip(BOTTOM, tensions, strict=True)
    }
    offset = {"platform.position.surge": 3.0 + 0.1 * shapes, "platform.position.sway": 4.0 + 0.1 * shapes}
    units = dict.fromkeys(signals, "N") | dict.fromkeys(offset, "m")
    (case,) = cases([written(signals | offset, units, storm)])
    return analysed(case)


def test_tendons_of_the_same_tension_are_one_row(held: Analysis) -> None:
    assert alike(held) == [["1", "2"], ["3"]]
    table = next(block for block in tendon_blocks([held]) if isinstance(block, Table))
    assert [row.heading for row in table.rows] == ["1, 2", "3"]


def test_the_table_has_the_extremes_of_the_samples(held: Analysis) -> None:
    table = next(block for block in tendon_blocks([held]) if isinstance(block, Table))
    results = held.case.results[0]
    for row, tendon in zip(table.rows, (0, 2), strict=True):
        cells = dict(zip(table.headings[1:], row.cells, strict=False))
        top, bottom = (results.signal(names[tendon])[200:] for names in (TOP, BOTTOM))
        assert cells["maximum"] == number(1e-6 * top.max())
        assert cells["minimum"] == number(1e-6 * bottom.min())
        assert cells["mean"].text == number(1e-6 * top.mean())
    assert [row.cells[7].tone for row in table.rows] == ["", "attention"]


def test_the_fitted_curve_is_the_distribution(held: Analysis) -> None:
    chart = exceedance_chart([held], {TOP[0]: "tendon 1"}, "tensions")
    assert isinstance(chart, Chart)
    observed, fitted = chart.content["choices"][0]["views"][0]["series"]
    statistics = held.statistics[TOP[0]]
    fit = statistics.weibull_maxima
    assert fit is not None
    level = np.array(fitted["x"]) * 1e6
    beyond = level > fit.location + 1.001 * fit.threshold
    np.testing.assert_allclose(np.array(fitted["y"])[beyond], fit.exceedance(level)[beyond], rtol=2e-3)
    np.testing.assert_allclose(observed["y"], statistics.exceedance.probability, rtol=1e-3)
    # On Weibull paper: y = (x / scale)^shape less a constant, which fades far above the threshold.
    paper = chart.content["choices"][0]["views"][1]["series"][1]
    x, y = np.log(paper["x"]), np.log(paper["y"])
    free = math.log(fit.share) + (fit.threshold / fit.scale) ** fit.shape
    line = np.log((np.exp(x) * 1e6 / fit.scale) ** fit.shape - free)
    np.testing.assert_allclose(y, line, atol=5e-3)


def test_key_figures_are_the_largest_of_all_records(written: Callable[..., Results], storm: object) -> None:
    time = np.arange(1000) * 0.5

    def at(place: int, surge: float, sway: float, tension: float) -> dict[str, np.ndarray]:
        found = {"platform.position.surge": 0.0 * time, "platform.position.sway": 0.0 * time}
        found |= {"platform.position.heave": -0.002 * time, TOP[0]: 1e7 + 0.0 * time}
        found["platform.position.surge"][place] = surge
        found["platform.position.sway"][place] = sway
        found[TOP[0]][place] = tension
        return found

    units = {"platform.position.surge": "m", "platform.position.sway": "m", "platform.position.heave": "m", TOP[0]: "N"}
    other = storm.with_(simulation={"seed": 2})  # type: ignore[attr-defined]
    # What comes before the statistics begin, at 100 s, does not count.
    first = written(at(300, 3.0, 4.0, 1.4e7), units, storm)
    early = at(100, 30.0, 40.0, 9e7)
    early["platform.position.sway"][700] = -6.0
    second = written(early, units, other)
    (case,) = cases([first, second])
    bare = Analysis(case=case, start=100.0, statistics={}, without_statistics="", response=None, without_response="")
    found = dict(key_figures(bare))
    assert (found["largest offset"].text, found["largest offset"].below) == ("6.00 m", "seed 2, at 350.0 s")
    tension = found["largest tension"]
    assert (tension.text, tension.below) == ("14.00 MN", "tendon 1, seed 1, at 150.0 s")
    assert found["lowest heave"].text == "−0.999 m"
