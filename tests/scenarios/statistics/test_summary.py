"""The summary of a run: tables as the paper's Table I, and extreme tensions."""

import math
from pathlib import Path

import numpy as np
import pytest

from tlpsim.orchestrator.execution import run
from tlpsim.orchestrator.instance import PythonInstance, Values
from tlpsim.orchestrator.system import Component, System
from tlpsim.scenarios.results import Results, open_results
from tlpsim.scenarios.results_writer import ResultsWriter
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.statistics.summary import extreme_tensions, summary


def sine(time: np.ndarray, period: float, deviation: float) -> np.ndarray:
    return deviation * math.sqrt(2.0) * np.sin(2.0 * math.pi * time / period)


AMPLITUDES = {"surge": 1.0, "heave": 0.02, "roll": 1e-4, "yaw": 0.01}


@pytest.fixture
def results(tmp_path: Path) -> Results:
    """An hour of sines in four degrees of freedom and two tendons, the second of which goes slack once."""

    def step(values: Values, time: float, size: float) -> None:
        end = time + size
        for name, amplitude in AMPLITUDES.items():
            values[f"position.{name}"] = 5.0 * amplitude + float(sine(np.array(end), 10.0, amplitude))
        values["tendon_tension[1]"] = 9e6 if abs(end - 900.0) < 0.1 else 2e6
        values["tendon_tension[2]"] = 0.0 if abs(end - 1200.0) < 0.1 else 2e6
        values["tendon_tension[2]"] = 99e6 if end < 100.0 else values["tendon_tension[2]"]

    outputs = dict.fromkeys([f"position.{name}" for name in AMPLITUDES], 0.0)
    outputs |= {"tendon_tension[1]": 2e6, "tendon_tension[2]": 2e6}
    component = Component(instance=PythonInstance("platform", step, outputs=outputs), step=500_000_000)
    scenario = Scenario()
    path = tmp_path / "results.h5"
    run(System(components=(component,)), 3_600_000_000_000, observers=[ResultsWriter(path, scenario)])
    return open_results(path)


def test_the_summary_is_in_the_units_of_table_i(results: Results) -> None:
    found = summary(results)
    rows = found.motions
    assert found.description == "600 to 3600 s"
    assert found.notes == ()
    assert [(row.name, row.unit) for row in rows] == [
        ("surge", "m"),
        ("heave", "cm"),
        ("roll", "1e-4 rad"),
        ("yaw", "1e-2 rad"),
    ]
    # 3000 s are 300 whole periods: the only error is that of one sample more at the end.
    assert [row.mean for row in rows] == pytest.approx([5.0, 10.0, 5.0, 5.0], rel=1e-3)
    assert [row.wave_frequency for row in rows] == pytest.approx([1.0, 2.0, 1.0, 1.0], rel=1e-3)
    assert [row.std for row in rows] == pytest.approx([1.0, 2.0, 1.0, 1.0], rel=1e-3)


def test_extreme_tensions_name_tendon_and_time(results: Results) -> None:
    extremes = summary(results).tensions
    assert extremes is not None
    assert (extremes.maximum, extremes.maximum_tendon, extremes.maximum_time) == (
        9e6,
        "tendon_tension[1]",
        900.0,
    )
    assert (extremes.minimum, extremes.minimum_tendon, extremes.minimum_time) == (
        0.0,
        "tendon_tension[2]",
        1200.0,
    )
    assert summary(results).lines == (
        "tension: maximum 9.000 MN (tendon_tension[1] at 900 s), minimum 0.000 MN (tendon_tension[2] at 1200 s)",
    )
    whole = extreme_tensions(results, start=0.0)
    assert whole is not None
    assert whole.maximum == 99e6


def test_the_summary_tells_once_that_the_transient_was_kept(results: Results) -> None:
    found = summary(results, start=3590.0)
    assert found.description == "0 to 3600 s"
    assert len(found.notes) == 1
    assert found.lines[-1].startswith("note: the whole record of 3600 s is used")


def test_a_run_without_a_platform_has_an_empty_summary(results: Results) -> None:
    found = summary(results, component="barge")
    assert (found.motions, found.tensions, found.lines) == ((), None, ())
