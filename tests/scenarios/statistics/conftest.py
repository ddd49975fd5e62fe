"""Gaussian processes with given spectra, and results files of one case."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tlpsim.orchestrator.execution import run
from tlpsim.orchestrator.instance import PythonInstance, Values
from tlpsim.orchestrator.system import Component, System
from tlpsim.scenarios.results import Results, open_results
from tlpsim.scenarios.results_writer import ResultsWriter
from tlpsim.scenarios.schema import Scenario

FloatArray = np.ndarray


@pytest.fixture(scope="session")
def gaussian() -> Callable[..., FloatArray]:
    """Records (count, samples) at a step (s) of a one-sided spectrum that a function of frequency (Hz) gives."""

    def make(
        spectrum: Callable[[FloatArray], FloatArray], count: int, samples: int, step: float, seed: int
    ) -> FloatArray:
        period = 2 * samples  # a record is then half of what repeats itself
        frequency = np.fft.rfftfreq(period, step)
        variance = spectrum(frequency) / (period * step)
        variance[0] = 0.0
        lines = np.random.default_rng(seed).standard_normal((2, count, len(frequency)))
        return np.fft.irfft(np.sqrt(variance) / 2.0 * period * (lines[0] + 1j * lines[1]), period)[:, :samples]

    return make


@pytest.fixture(scope="session")
def record(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Results]:
    """Results of a scenario with signals of a platform, which functions of time give."""
    folder = tmp_path_factory.mktemp("records")

    def make(
        scenario: Scenario, signals: dict[str, FloatArray], step: float = 0.5, units: dict[str, str] | None = None
    ) -> Results:
        def advance(values: Values, time: float, size: float) -> None:
            place = round((time + size) / step)
            values.update({name: float(samples[place]) for name, samples in signals.items()})

        outputs = {name: float(each[0]) for name, each in signals.items()}
        instance = PythonInstance("platform", advance, outputs=outputs, units=units or {})
        component = Component(instance=instance, step=round(step * 1e9))
        samples = len(next(iter(signals.values()))) - 1
        path = Path(folder) / f"{len(list(folder.iterdir()))}.h5"
        run(System(components=(component,)), samples * component.step, observers=[ResultsWriter(path, scenario)])
        return open_results(path)

    return make
