"""The co-simulation against the same models in one loop, and what each of them takes.

    .venv/bin/python benchmarks/monolithic.py [--quick]

The default storm with the default steps; standard deviations in the two bands of the statistics.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from report import Row, at_least, at_most, main

from tlpsim.scenarios.results import Results
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.statistics.summary import summary

LARGEST_DEVIATION = 0.5  # %, of a standard deviation
LARGEST_TENSION_ERROR = 1.0  # %
SLOWEST = 5000.0  # times real time
BANDS = {"low_frequency": "below 0.022 Hz", "wave_frequency": "0.022 to 0.2 Hz"}
REPETITIONS = 5


def storm(duration: float, **settings: object) -> Scenario:
    return Scenario.from_dict({"simulation": {"duration": duration}, **settings})


def timed(scenario: Scenario, path: Path, monolithic: bool) -> tuple[Results, float]:
    began = time.perf_counter()
    results = run_scenario(scenario, path, monolithic=monolithic)
    return results, scenario.simulation.duration / (time.perf_counter() - began)


def coupling(quick: bool) -> list[Row]:
    """Standard deviations and largest tension of the co-simulation against those of the monolithic run."""
    duration = 1800.0 if quick else 10800.0
    rows = []
    with tempfile.TemporaryDirectory() as name:
        coupled = summary(timed(storm(duration), Path(name) / "c.h5", False)[0])
        alone = summary(timed(storm(duration), Path(name) / "m.h5", True)[0])
    for one, other in zip(coupled.motions, alone.motions, strict=True):
        for band, words in BANDS.items():
            error = 100.0 * abs(getattr(one, band) / getattr(other, band) - 1.0)
            item = f"co-simulation - monolithic, {duration:g} s, standard deviation, {one.name}, {words}"
            rows.append(at_most(item, error, LARGEST_DEVIATION, "%"))
    assert coupled.tensions is not None
    assert alone.tensions is not None
    error = 100.0 * abs(coupled.tensions.maximum / alone.tensions.maximum - 1.0)
    rows.append(at_most("co-simulation - monolithic, largest tension", error, LARGEST_TENSION_ERROR, "%"))
    return rows


def speed(quick: bool) -> list[Row]:
    """Time of a storm with loading and writing of results, best of some."""
    duration = 1800.0 if quick else 10800.0
    rows = []
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "r.h5"
        timed(storm(60.0), path, True)  # what is compiled and fitted once
        best = max(timed(storm(duration), path, True)[1] for _ in range(REPETITIONS))
        rows.append(at_least(f"monolithic storm of {duration:g} s, best of {REPETITIONS}", best, SLOWEST, "×", ".0f"))
        motion = {"outputs": {"signals": ["platform.position.*"]}}
        scenario = storm(duration, **motion)
        best = max(timed(scenario, path, True)[1] for _ in range(REPETITIONS))
        rows.append(Row(item="the same with the six motions recorded", measured=f"{best:.0f} ×"))
        timed(storm(60.0), path, False)
        rows.append(Row(item="the same storm as FMUs", measured=f"{timed(storm(duration), path, False)[1]:.0f} ×"))
    return rows


if __name__ == "__main__":
    main("Monolithic run", [coupling, speed])
