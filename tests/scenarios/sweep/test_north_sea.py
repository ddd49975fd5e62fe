"""The scatter diagram that comes with tlpsim, against its maker and against another joint distribution."""

import importlib.util
import math
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import tlpsim.scenarios.schema
from tlpsim.scenarios.sweep.axes import read_scatter
from tlpsim.scenarios.sweep.plan import Sweep

FOLDER = Path(tlpsim.scenarios.schema.__file__).parent / "sweeps"
STATES_OF_100_YEARS = 100.0 * 365.25 * 8.0
"""of 3 hours"""


@pytest.fixture(scope="module")
def maker() -> ModuleType:
    spec = importlib.util.spec_from_file_location("north_sea_scatter", FOLDER / "north_sea_scatter.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def diagram() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Heights (n,), periods (m,) and probabilities (n, m) of the file."""
    heights, periods, cells = read_scatter(FOLDER / "north_sea.csv")
    return np.array(heights), np.array(periods), np.array(cells)


def test_the_file_is_what_its_maker_makes(maker: ModuleType) -> None:
    assert (FOLDER / "north_sea.csv").read_text(encoding="utf-8") == maker.text()


def test_probabilities(maker: ModuleType, diagram: tuple[np.ndarray, ...]) -> None:
    heights, periods, cells = diagram
    # Four digits after the point of 227 cells: rounding of 5e-5 each, of either sign.
    assert np.sum(cells) == pytest.approx(1.0, abs=5e-5)
    np.testing.assert_allclose(cells, maker.scatter(), rtol=5e-5, atol=0.0)
    assert cells[cells > 0.0].min() >= 1e-8
    assert heights.tolist() == [k + 0.5 for k in range(18)]
    assert periods.tolist() == [k + 0.5 for k in range(3, 24)]


def haver_nyhus_height() -> float:
    """100-year significant height of Haver and Nyhus (1986), by their Weibull tail, m."""
    return 2.82 * math.log(STATES_OF_100_YEARS) ** (1.0 / 1.547)


def test_height_of_100_years(maker: ModuleType, diagram: tuple[np.ndarray, ...]) -> None:
    heights, _, cells = diagram
    fine = np.linspace(10.0, 20.0, 201)
    height = float(np.interp(math.log(STATES_OF_100_YEARS), -np.log(maker.height_exceedance(fine)), fine))
    assert height == pytest.approx(14.8, abs=0.05)
    assert haver_nyhus_height() == pytest.approx(14.5, abs=0.05)
    assert height == pytest.approx(haver_nyhus_height(), rel=0.04)
    # Of the diagram itself: the probability of the cells above an edge, of which the logarithm is nearly a parabola.
    above = np.cumsum(np.sum(cells, axis=1)[::-1])[::-1][1:]
    edges = heights[1:] - 0.5
    of_cells = float(np.interp(math.log(STATES_OF_100_YEARS), -np.log(above), edges))
    assert of_cells == pytest.approx(height, rel=0.01)


def test_the_exceedance_is_a_distribution(maker: ModuleType) -> None:
    found = maker.height_exceedance(np.linspace(0.0, 30.0, 301))
    # The trapezoidal rule misses the part of the wind's density next to 0, which rises as u^0.708.
    assert found[0] == pytest.approx(1.0, abs=5e-6)
    assert np.all(np.diff(found) < 0.0)
    periods = maker.period_probability(np.array([1e-3, 1.0, 10.0, 100.0]), 3.0)
    assert np.all(np.diff(periods) > 0.0)
    assert (periods[0], periods[-1]) == pytest.approx((0.0, 1.0), abs=1e-9)


def haver_nyhus_period(height: np.ndarray) -> np.ndarray:
    """Mean peak period given the significant height of Haver and Nyhus (1986), lognormal, s."""
    mean = 1.59 + 0.42 * np.log(height + 2.0)
    variance = 0.005 + 0.085 * np.exp(-0.13 * height**1.34)
    return np.asarray(np.exp(mean + 0.5 * variance))


def test_mean_period_of_heights(maker: ModuleType, diagram: tuple[np.ndarray, ...]) -> None:
    height = np.linspace(5.0, 15.0, 11)
    period = np.linspace(1.0, 40.0, 8001)
    middles = 0.5 * (period[1:] + period[:-1])
    mean = np.array([np.sum(middles * np.diff(maker.period_probability(period, each))) for each in height])
    np.testing.assert_allclose(mean, haver_nyhus_period(height), rtol=0.02)
    # Of the rows of the diagram, whose height is that of the row's lower part, of more sea states.
    heights, periods, cells = diagram
    rows = (heights > 5.0) & (heights < 15.0)
    of_rows = (cells @ periods / np.sum(cells, axis=1))[rows]
    np.testing.assert_allclose(of_rows, haver_nyhus_period(heights[rows]), rtol=0.025)


def test_the_sweep_of_it(maker: ModuleType, diagram: tuple[np.ndarray, ...]) -> None:
    sweep = Sweep.load(FOLDER / "north_sea.toml")
    plan = sweep.plan()
    assert len(plan.cases) == np.count_nonzero(diagram[2]) == 227
    assert not any(case.problem for case in plan.cases)
    assert plan.notes == ()
    assert plan.weighted
    assert len(plan.variants) == 1
    assert sum(case.probability for case in plan.cases) == pytest.approx(1.0, abs=1e-12)
    assert {job.domain for job in plan.jobs} == {"frequency", "time"}
    for case in plan.cases[::20]:
        height, speed = case.settings["waves", "significant_height"], case.settings["wind", "speed"]
        assert speed == pytest.approx(float(maker.mean_wind_speed(height)), abs=0.0051)
        scenario = sweep.scenario(case)
        assert (scenario.waves.significant_height, scenario.wind.speed) == (height, speed)
        assert scenario.simulation.duration == 10800.0
