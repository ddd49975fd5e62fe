"""Both domains of one scenario side by side: `tlpsim compare`.

Over N records of the time domain with means m_k and variances v_k of a band, the estimates and their standard errors
are

    mean = avg m_k,           error = s(m_k) / sqrt(N)                                                 (1)
    std = sqrt(avg v_k),      error = s(v_k) / (2 std sqrt(N))                                        (2)

with s the standard deviation between records; eq. (2) is the delta method. Extremes are averaged like means. What one
record knows of the slowest motion scatters by the coefficient of variation CoV = s(sqrt(v_k)) / std, so that a 95 %
confidence interval of the precision p takes

    N = (1.96 CoV / p)²                                                                              (3)

records. The time that they would take over that of the frequency domain, which has no scatter, is the ratio of the
two domains at the same precision.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.constants import DEGREES_OF_FREEDOM, HORIZONTAL
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.spectral.records import SpectralResponse
from tlpsim.loads.whole_file import whole_file
from tlpsim.scenarios.json_text import json_text
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.spectral_file import head, opened, read_response, write_response
from tlpsim.scenarios.spectral_tables import ENDS, quantity_statistics
from tlpsim.scenarios.time_domain import STATISTICS, records, require_records

FloatArray = NDArray[np.float64]

FORMAT = "tlpsim comparison"
SCHEMA_VERSION = 1
PRECISION = 0.02
"""Of the 95 % confidence interval for which records are counted, p of eq. (3)."""

_COMPARED = ("position.", *(f"{name}[" for name in ENDS.values()), "point_acceleration[")
_SPREADS = ("low_frequency", "wave_frequency", "std")
_EXTREMES = ("maximum", "minimum")
_NORMAL = 1.96  # standard deviations of a 95 % interval


@dataclass(frozen=True, slots=True, kw_only=True)
class ComparisonRow:
    """One statistic of one quantity by both domains, in the quantity's SI unit.

    Attributes
    ----------
    name, unit, statistic
        As `position.surge`, `m`, and one of `tlpsim.scenarios.time_domain.STATISTICS`.
    time, error
        Estimate from the records and its standard error, eqs. (1) and (2); the error of one record is NaN.
    frequency
        By the frequency domain; extremes are those expected in the scenario's duration.
    ratio
        Frequency domain over time domain, of extremes their distances from the mean; NaN where the time domain is less
        than two standard errors, since it would be a ratio of accidents.
    """

    name: str
    unit: str
    statistic: str
    time: float
    error: float
    frequency: float
    ratio: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Times:
    """What the two domains cost, s of wall time where nothing else is said.

    Attributes
    ----------
    frequency_domain
        Of one analysis, when what it keeps for later is there.
    record
        Of a processor for one record, median.
    all_records, workers
        Of all records, and by how many processes.
    scatter, scattered
        CoV of eq. (3): the largest of surge, sway and yaw, and whose it is; NaN of one record.
    """

    frequency_domain: float
    record: float
    all_records: float
    workers: int
    scatter: float
    scattered: str

    @property
    def records_needed(self) -> float:
        """N of eq. (3) for `PRECISION`, not rounded."""
        return (_NORMAL * self.scatter / PRECISION) ** 2

    @property
    def ratio(self) -> float:
        """Processor time of these records over the time of the frequency domain."""
        return self.records_needed * self.record / self.frequency_domain


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Comparison:
    """Both domains of a scenario.

    Attributes
    ----------
    scenario
        With the seed of the first record.
    cosimulation
        Whether the records come from the scenario's FMUs, and not from one loop.
    names, units
        Of the quantities.
    samples
        Statistics of each record, (records, quantities, 6) in the order of `STATISTICS`.
    seeds
        Of wind and waves of each record, (records, 2).
    frequency, density, segments
        Spectra of the six positions averaged over the records, (n,) Hz and (n, 6), and how many independent segments
        they are of.
    response
        By the frequency domain.
    times
        What it cost.
    """

    scenario: Scenario
    cosimulation: bool
    names: tuple[str, ...]
    units: tuple[str, ...]
    samples: FloatArray
    seeds: NDArray[np.int64]
    frequency: FloatArray
    density: FloatArray
    segments: float
    response: SpectralResponse
    times: Times

    @property
    def rows(self) -> tuple[ComparisonRow, ...]:
        """All statistics of all quantities, those of a quantity together."""
        found = []
        for name, unit, samples in zip(self.names, self.units, np.moveaxis(self.samples, 1, 0), strict=True):
            expected = quantity_statistics(self.response.quantities[name], self.scenario.simulation.duration)
            mean = float(np.mean(samples[:, STATISTICS.index("mean")]))
            for statistic, values in zip(STATISTICS, samples.T, strict=True):
                time, error = combined(values, statistic in _SPREADS)
                frequency = float(getattr(expected, statistic))
                origins = (mean, expected.mean) if statistic in _EXTREMES else (0.0, 0.0)
                distances = time - origins[0], frequency - origins[1]
                known = abs(distances[0]) > (0.0 if math.isnan(error) else 2.0 * error)
                found.append(
                    ComparisonRow(
                        name=name,
                        unit=unit,
                        statistic=statistic,
                        time=time,
                        error=error,
                        frequency=frequency,
                        ratio=distances[1] / distances[0] if known else math.nan,
                    )
                )
        return tuple(found)

    def by_name(self) -> dict[tuple[str, str], ComparisonRow]:
        """The rows by name and statistic."""
        return {(row.name, row.statistic): row for row in self.rows}


def combined(values: FloatArray, is_spread: bool) -> tuple[float, float]:
    """Estimate from records, (records,), and its standard error: eq. (2) of standard deviations, eq. (1) of others."""
    used = values**2 if is_spread else values
    mean = float(np.mean(used))
    error = float(np.std(used, ddof=1)) / math.sqrt(len(used)) if len(used) > 1 else math.nan
    if not is_spread:
        return mean, error
    std = math.sqrt(mean)
    return std, 0.5 * error / std if std > 0.0 else error


def compare(
    scenario: Scenario,
    count: int = 24,
    *,
    cosimulation: bool = False,
    workers: int | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Comparison:
    """Analyse a scenario in the frequency domain and simulate records of it.

    Parameters
    ----------
    count
        Of records.
    cosimulation
        By the scenario's FMUs rather than in one loop.
    workers, progress
        As of `tlpsim.scenarios.time_domain.records`.

    Raises
    ------
    TlpsimError
        When one of the domains cannot take the scenario, or fails.
    """
    from tlpsim.scenarios.parallel import cores
    from tlpsim.scenarios.spectral import spectral_response

    if count < 1:
        raise ScenarioError(f"records is {count}; it must be 1 or more")
    require_records(scenario, cosimulation)
    spectral_response(scenario)  # what is kept for later calls is made here
    began = perf_counter()
    response = spectral_response(scenario)
    analysed = perf_counter()
    names = tuple(name for name in response.quantities if name.startswith(_COMPARED))
    units = tuple(response.quantities[name].unit for name in names)
    made = records(scenario, count, names, units, cosimulation=cosimulation, workers=workers, progress=progress)
    simulated = perf_counter()
    samples = np.array([each.statistics for each in made])
    scatter, scattered = _scatter(names, samples)
    return Comparison(
        scenario=scenario,
        cosimulation=cosimulation,
        names=names,
        units=units,
        samples=samples,
        seeds=np.array([[each.seeds["wind"], each.seeds["wave"]] for each in made]),
        frequency=made[0].frequency,
        density=np.mean([each.density for each in made], axis=0),
        segments=sum(each.segments for each in made),
        response=response,
        times=Times(
            frequency_domain=analysed - began,
            record=float(np.median([each.seconds for each in made])),
            all_records=simulated - analysed,
            workers=min(workers or cores(), len(made)),
            scatter=scatter,
            scattered=scattered,
        ),
    )


def _scatter(names: Sequence[str], samples: FloatArray) -> tuple[float, str]:
    """Largest CoV of the slow motion, eq. (3), and the degree of freedom that it is of."""
    if len(samples) < 2:
        return math.nan, ""
    low = STATISTICS.index("low_frequency")
    found = {}
    for degree in (DEGREES_OF_FREEDOM[k] for k in HORIZONTAL):
        spreads = samples[:, names.index(f"position.{degree}"), low]
        std = combined(spreads, is_spread=True)[0]
        found[degree] = float(np.std(spreads, ddof=1)) / std if std > 0.0 else 0.0
    worst = max(found, key=found.__getitem__)
    return found[worst], worst


# Files


def write_comparison(comparison: Comparison, path: str | Path) -> None:
    """Write a comparison as HDF5; the file is there when it is complete.

    The response is in a group ``response`` of the layout of `tlpsim.scenarios.spectral_file`.

    Raises
    ------
    ScenarioError
        If the file cannot be written.
    """
    with whole_file(path, "the comparison") as part, h5py.File(part, "w") as file:
        file.attrs.update(head(FORMAT, SCHEMA_VERSION, comparison.scenario))
        file.attrs["cosimulation"] = comparison.cosimulation
        group = file.create_group("time_domain")
        for name, unit in (("frequency", "Hz"), ("density", "unit²/Hz"), ("samples", "SI"), ("seeds", "1")):
            group.create_dataset(name, data=getattr(comparison, name)).attrs["units"] = unit
        for name, texts in (("names", comparison.names), ("units", comparison.units), ("statistics", STATISTICS)):
            group.create_dataset(name, data=list(texts), dtype=h5py.string_dtype())
        group.attrs["segments"] = comparison.segments
        file.create_group("times").attrs.update(_fields(comparison.times))
        write_response(file.create_group("response"), comparison.response)


def read_comparison(path: str | Path) -> Comparison:
    """Comparison of a file that `write_comparison` wrote.

    Raises
    ------
    ScenarioError
        If there is no such file, it is another kind of file, or its layout is newer than this version knows.
    """
    with opened(path, FORMAT, SCHEMA_VERSION, "tlpsim compare") as file:
        group, times = file["time_domain"], dict(file["times"].attrs)
        return Comparison(
            scenario=Scenario.from_json(str(file.attrs["scenario"])),
            cosimulation=bool(file.attrs["cosimulation"]),
            names=tuple(group["names"].asstr()[()]),
            units=tuple(group["units"].asstr()[()]),
            samples=np.asarray(group["samples"]),
            seeds=np.asarray(group["seeds"]),
            frequency=np.asarray(group["frequency"]),
            density=np.asarray(group["density"]),
            segments=float(group.attrs["segments"]),
            response=read_response(file["response"]),
            times=Times(
                scattered=str(times.pop("scattered")),
                workers=int(times.pop("workers")),
                **{name: float(value) for name, value in times.items()},
            ),
        )


def comparison_json(comparison: Comparison) -> str:
    """Rows, modes and times of a comparison as JSON; what is not known is null."""
    times = comparison.times
    content = {
        "kind": "comparison",
        "title": comparison.scenario.title,
        "duration": comparison.scenario.simulation.duration,
        "records": len(comparison.samples),
        "cosimulation": comparison.cosimulation,
        "seeds": [{"wind": int(wind), "wave": int(wave)} for wind, wave in comparison.seeds],
        "rows": [_fields(row) for row in comparison.rows],
        "modes": [_fields(mode) for mode in comparison.response.modes],
        "times": {**_fields(times), "records_needed": times.records_needed, "ratio": times.ratio},
    }
    return json_text(content)


def _fields(record: Any) -> dict[str, Any]:
    return {name: getattr(record, name) for name in type(record).__slots__}
