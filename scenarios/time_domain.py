"""Records of the time domain for statistics: runs of a scenario from seed after seed that leave no file.

Each record holds the scenario's whole duration after the transient, `outputs.statistics_from`. Only statistics and
spectra of it are kept.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import process_time

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.errors import ScenarioError
from tlpsim.orchestrator.clock import NANOSECONDS_PER_SECOND, to_seconds, to_ticks
from tlpsim.orchestrator.execution import run
from tlpsim.orchestrator.observers import Observer
from tlpsim.orchestrator.system import System, bound_outputs
from tlpsim.scenarios.assemble import assembled
from tlpsim.scenarios.monolithic import run_monolithic, twin
from tlpsim.scenarios.parallel import in_parallel
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.sections import LARGEST_SEED
from tlpsim.scenarios.statistics.bands import BAND_EDGES, SHORTEST_RECORD_PERIODS, band_statistics
from tlpsim.scenarios.statistics.summary import conversion

FloatArray = NDArray[np.float64]

STATISTICS = ("mean", "low_frequency", "wave_frequency", "std", "maximum", "minimum")
"""Of each quantity of a record, fields of `tlpsim.scenarios.statistics.bands.BandStatistics`."""
SEGMENT = 1800.0
"""Length of the segments of the spectra at most, s: one line in 0.56 mHz"""
HIGHEST_FREQUENCY = 0.7
"""Hz, up to which spectra are kept: beyond the natural frequencies of heave, roll and pitch"""

_OVERLAP = 0.5  # of the Hann segments
_SHARE = 18.0 / 19.0  # of independent ones among segments that overlap by half


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RecordStatistics:
    """What is kept of one record.

    Attributes
    ----------
    seeds
        Of wind and waves.
    statistics
        (quantities, 6) in the order of `STATISTICS`, SI units.
    frequency, density
        Hz, (n,), and the spectra of the six positions by Welch's method with Hann segments, (n, 6) unit²/Hz.
    segments
        Number of independent ones in the spectra.
    seconds
        Time of a processor that the record took.
    """

    seeds: dict[str, int]
    statistics: FloatArray
    frequency: FloatArray
    density: FloatArray
    segments: float
    seconds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One record that is to be made: the scenario with its seed, what is kept, by FMUs or in one loop."""

    scenario: Scenario
    names: tuple[str, ...]
    units: tuple[str, ...]
    cosimulation: bool


class PlatformRecorder(Observer):
    """Keeps some outputs of the platform in memory, in given units.

    Attributes
    ----------
    step
        Of the platform, s.
    """

    def __init__(self, scenario: Scenario, names: Sequence[str], units: Sequence[str]) -> None:
        self.step = 0.0
        self._own = [scenario.components["platform"].own_name(name) for name in names]
        self._units = units
        self._index = -1
        self._columns: list[int] = []
        self._factors = np.ones(len(names))
        self._blocks: list[FloatArray] = []

    def started(self, system: System) -> None:
        """Find the outputs.

        Raises
        ------
        ScenarioError
            When the platform has not got one of them.
        """
        self._index = next(k for k, each in enumerate(system.components) if each.name == "platform")
        platform = system.components[self._index]
        outputs = bound_outputs(system)[self._index]
        missing = [name for name in self._own if name not in outputs]
        if missing:
            raise ScenarioError(
                f"components.platform: has no output '{missing[0]}', which the comparison takes; map it by "
                "components.platform.map, or take the built-in platform"
            )
        self.step = to_seconds(platform.step)
        self._columns = [outputs.index(name) for name in self._own]
        self._factors = np.array(
            [
                conversion(platform.instance.variables[name].unit or "", unit)
                for name, unit in zip(self._own, self._units, strict=True)
            ]
        )

    def sampled(self, index: int, times: NDArray[np.int64], values: FloatArray) -> None:
        """Copy what is kept."""
        if index == self._index:
            self._blocks.append(values[:, self._columns] * self._factors)

    def samples(self) -> FloatArray:
        """Samples from time zero on, (samples, quantities)."""
        return np.concatenate(self._blocks)


def seeded(scenario: Scenario, number: int) -> Scenario:
    """The scenario of a record: the given one is number 0, and the others have other seeds of wind and waves.

    Raises
    ------
    ScenarioError
        When a component has a seed among its parameters, which would be that of every record.
    """
    for name, entry in scenario.components.items():
        if "seed" in entry.parameters:
            raise ScenarioError(
                f"components.{name}.parameters.seed: {entry.parameters['seed']} would be the seed of every record; "
                "leave it out, or give wind.seed and waves.seed, from which records derive theirs"
            )
    given = {"wind": scenario.wind.seed, "waves": scenario.waves.seed}
    derived = {name: {"seed": _derived(seed, number)} for name, seed in given.items() if seed is not None}
    return scenario.with_(simulation={"seed": scenario.simulation.seed + number}, **derived)


def _derived(seed: int, number: int) -> int:
    """Seed of a record from that of record 0."""
    if number == 0:
        return seed
    return int(np.random.SeedSequence((seed, number)).generate_state(1)[0]) % LARGEST_SEED + 1


def require_records(scenario: Scenario, cosimulation: bool) -> None:
    """Refuse, before anything is computed, what cannot make records; poor fits of the filters warn here.

    Raises
    ------
    TlpsimError
        As `tlpsim.scenarios.monolithic.twin` or `tlpsim.scenarios.assemble.assembled`, and when the record is too short
        for the low-frequency band.
    """
    shortest = SHORTEST_RECORD_PERIODS / BAND_EDGES[0]
    if scenario.simulation.duration < shortest:
        raise ScenarioError(
            f"simulation.duration is {scenario.simulation.duration:g} s; a comparison needs {shortest:.0f} s or more, "
            f"two periods of {BAND_EDGES[0]} Hz"
        )
    if "platform" not in scenario.components:
        raise ScenarioError("components.platform: a comparison needs the platform, and the scenario has none")
    if cosimulation:
        with assembled(scenario):
            return
    twin(scenario)


def records(
    scenario: Scenario,
    count: int,
    names: Sequence[str],
    units: Sequence[str],
    *,
    cosimulation: bool = False,
    workers: int | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> list[RecordStatistics]:
    """Statistics of records from the seeds simulation.seed, simulation.seed + 1, ...

    Parameters
    ----------
    count
        Of records.
    names, units
        Outputs of the platform by their names in the contract, the six positions first, and their SI units.
    cosimulation
        By the scenario's FMUs rather than in one loop.
    workers, progress
        As of `tlpsim.scenarios.parallel.in_parallel`.

    Raises
    ------
    TlpsimError
        What a run raises, see `tlpsim.scenarios.run.run_scenario`.
    """
    cases = [
        Case(scenario=seeded(scenario, k), names=tuple(names), units=tuple(units), cosimulation=cosimulation)
        for k in range(count)
    ]
    return in_parallel(record, cases, workers, progress)


def record(case: Case) -> RecordStatistics:
    """Make one record.

    Raises
    ------
    TlpsimError
        As `records`.
    """
    began = process_time()
    scenario = case.scenario
    duration = scenario.simulation.duration
    longer = scenario.with_(simulation={"duration": duration + _transient(scenario)})
    recorder = PlatformRecorder(longer, case.names, case.units)
    if case.cosimulation:
        with assembled(longer) as assembly:
            run(assembly.system, to_ticks(longer.simulation.duration, "simulation.duration"), observers=[recorder])
    else:
        run_monolithic(longer, [recorder])
    kept = round(duration / recorder.step) + 1
    samples = recorder.samples()[-kept:]
    return _evaluated(samples, recorder.step, scenario.seeds(), began)


def _transient(scenario: Scenario) -> float:
    """`outputs.statistics_from`, or a little later, where all components step together, s."""
    together = math.lcm(*(to_ticks(each.step, f"components.{name}.step") for name, each in scenario.components.items()))
    start = to_ticks(scenario.outputs.statistics_from, "outputs.statistics_from")
    return -(-start // together) * together / NANOSECONDS_PER_SECOND


def _evaluated(samples: FloatArray, step: float, seeds: dict[str, int], began: float) -> RecordStatistics:
    time: FloatArray = np.arange(len(samples), dtype=np.float64) * step
    found = [band_statistics(time, np.ascontiguousarray(column)) for column in samples.T]
    frequency, density, segments = spectra(samples[:, : len(DEGREES_OF_FREEDOM)], step)
    return RecordStatistics(
        seeds=seeds,
        statistics=np.array([[getattr(each, name) for name in STATISTICS] for each in found]),
        frequency=frequency,
        density=density,
        segments=segments,
        seconds=process_time() - began,
    )


def spectra(samples: FloatArray, step: float) -> tuple[FloatArray, FloatArray, float]:
    """One-sided spectra of samples (samples, m) at a step (s), with their frequencies and independent segments.

    The lowest lines, which the window mixes with the mean, are left out.
    """
    length = min(round(SEGMENT / step), len(samples))
    frequency, density = welch(samples, fs=1.0 / step, nperseg=length, axis=0)
    count = 1 + (len(samples) - length) // (length - int(_OVERLAP * length))
    inside = slice(2, int(np.searchsorted(frequency, HIGHEST_FREQUENCY)))
    return frequency[inside], density[inside], 1.0 if count == 1 else count * _SHARE
