"""What a worker does: one job, from the scenario to a row of numbers and a results file.

`perform` raises nothing of the case's own: its error is a part of the outcome, and so are its warnings. It takes one
BLAS thread, as a worker has one core, and one job at a time, as FMUs may not share a process.
"""

from __future__ import annotations

import threading
import time
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from tlpsim.loads.errors import ScenarioError, TlpsimError
from tlpsim.loads.whole_file import whole_file
from tlpsim.scenarios.bugs import bug_text
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.sweep.identity import program_version
from tlpsim.scenarios.sweep.prepared import Prepared, at_hand
from tlpsim.scenarios.sweep.sections import Engine, Statistics

if TYPE_CHECKING:
    from tlpsim.loads.spectral.records import Quantity

PLATFORM = "platform."
TOKEN = ".sweep"
"""File by whose content a worker sees that it shares the sweep's folder."""

_ONE_AT_A_TIME = threading.Lock()
_LEFT_OUT = ("start", "records")  # of the statistics of a record: the same for all


class VersionError(ScenarioError):
    """A worker has another version of tlpsim."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Where results files go: the sweep's folder and what its `TOKEN` holds; a worker that does not find it there sends
    its files back."""

    folder: str
    token: str

    def is_here(self) -> bool:
        """Whether this process shares the folder."""
        try:
            return (Path(self.folder) / TOKEN).read_text(encoding="utf-8") == self.token
        except OSError:
            return False


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """A job as it is sent to a worker.

    Attributes
    ----------
    key, domain
        As of `tlpsim.scenarios.sweep.plan.Job`.
    scenario
        JSON of the scenario with its seeds.
    statistics
        Which are taken.
    engine
        Of the time domain.
    file
        Of the results, relative to the sweep's folder; "" for none.
    place
        Of that folder.
    version
        Of the program that sends it.
    """

    key: str
    domain: str
    scenario: str
    statistics: Statistics
    engine: Engine
    file: str
    place: Place
    version: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What became of a job.

    Attributes
    ----------
    key
        Of the job.
    error
        Why it failed, "" where it did not.
    notes
        Warnings, one a line.
    names, units
        Of the numbers: "SIGNAL.STATISTIC", and the unit of the signal.
    values
        The numbers, (n,).
    file
        Of the results, relative to the sweep's folder; "" for none.
    content
        Of that file, where the worker does not share the folder.
    seconds
        It took.
    """

    key: str
    error: str = ""
    notes: str = ""
    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    values: NDArray[np.float64]
    file: str = ""
    content: bytes | None = None
    seconds: float


def perform(order: Order, *prepared: Prepared) -> Outcome:
    """Do a job, with what was prepared for it.

    Raises
    ------
    VersionError
        When this worker has another version of tlpsim than the sender.
    """
    if order.version != program_version():
        raise VersionError(
            f"a worker has tlpsim {program_version()} and the sweep was started by {order.version}: "
            "install the same version on both"
        )
    began = time.perf_counter()
    with _ONE_AT_A_TIME, threadpool_limits(1), warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            row, content = _done(order, prepared)
        except Exception as error:
            return Outcome(
                key=order.key,
                error=error_text(error),
                notes=_notes(warned),
                values=np.zeros(0),
                seconds=time.perf_counter() - began,
            )
    return Outcome(
        key=order.key,
        notes=_notes(warned),
        names=tuple(name for name, _, _ in row),
        units=tuple(unit for _, unit, _ in row),
        values=np.array([value for _, _, value in row]),
        file=order.file,
        content=content,
        seconds=time.perf_counter() - began,
    )


_Row = list[tuple[str, str, float]]


def _done(order: Order, prepared: Sequence[Prepared]) -> tuple[_Row, bytes | None]:
    """Numbers of a job, and the content of its file where that is to be sent."""
    scenario = at_hand(Scenario.from_json(order.scenario), prepared)
    job = _frequency if order.domain == "frequency" else _time
    with _destination(order) as (path, shared):
        row = job(order, scenario, path)
        content = None if shared or not order.file else path.read_bytes()
    return row, content


@contextmanager
def _destination(order: Order) -> Iterator[tuple[Path, bool]]:
    """Path of a job's results file, and whether it is where it shall be."""
    if order.file and order.place.is_here():
        path = Path(order.place.folder) / order.file
        path.parent.mkdir(parents=True, exist_ok=True)
        yield path, True
        return
    with TemporaryDirectory(prefix="tlpsim-sweep-") as folder:
        yield Path(folder) / "results.h5", False


def _notes(warned: Sequence[warnings.WarningMessage]) -> str:
    told = (" ".join(str(each.message).split()) for each in warned if issubclass(each.category, UserWarning))
    return "\n".join(dict.fromkeys(told))


def error_text(error: BaseException) -> str:
    """What the summary says of the error of a job."""
    said = " ".join(str(error).split())
    if isinstance(error, TlpsimError):
        return said
    if isinstance(error, MemoryError | OSError):
        return f"{type(error).__name__}: {said}"
    return bug_text(error)


# Frequency domain


def _frequency(order: Order, scenario: Scenario, path: Path) -> _Row:
    from tlpsim.scenarios.spectral import spectral_response
    from tlpsim.scenarios.spectral_file import write_spectral
    from tlpsim.scenarios.statistics.case import matching_names

    response = spectral_response(scenario)
    if order.file:
        write_spectral(response, scenario, path, compact=True)
    named = {PLATFORM + name: quantity for name, quantity in response.quantities.items()}
    chosen = matching_names(list(named), order.statistics.signals)
    if not chosen:
        patterns = ", ".join(order.statistics.signals or ())
        raise ScenarioError(f"statistics.signals: the frequency domain has no quantity that matches {patterns}")
    return [number for name in chosen for number in _quantity_numbers(name, named[name], order.statistics)]


def _quantity_numbers(name: str, quantity: Quantity, statistics: Statistics) -> Iterator[tuple[str, str, float]]:
    """Numbers of a quantity under the names that a record's statistics have."""
    from tlpsim.loads.spectral.extremes import vanmarcke_bandwidth
    from tlpsim.scenarios.spectral_tables import quantity_statistics
    from tlpsim.scenarios.statistics.signals import damages

    found = quantity_statistics(quantity, statistics.exposure)
    numbers = {
        "mean": found.mean,
        "low_frequency": found.low_frequency,
        "wave_frequency": found.wave_frequency,
        "std": found.std,
        "skewness": quantity.skewness,
        "excess_kurtosis": quantity.excess_kurtosis,
        "zero_crossing_period": found.period,
        "bandwidth": vanmarcke_bandwidth(quantity.frequency, quantity.density),
        "expected_maximum": found.maximum,
        "expected_minimum": found.minimum,
    }
    if statistics.signals is not None or damages(quantity.unit):
        numbers["damage_equivalent_range"] = quantity.damage_equivalent_range(statistics.slope)
    for statistic, value in numbers.items():
        yield f"{name}.{statistic}", quantity.unit, float(value)


# Time domain


def _time(order: Order, scenario: Scenario, path: Path) -> _Row:
    from tlpsim.scenarios.run import run_scenario
    from tlpsim.scenarios.statistics.output import statistic_numbers
    from tlpsim.scenarios.statistics.signals import run_statistics

    results = run_scenario(scenario, path, monolithic=order.engine == "monolithic")
    statistics = order.statistics
    found = run_statistics([results], statistics.signals, exposure=statistics.exposure, slope=statistics.slope)
    row: _Row = []
    for signal in found:
        for statistic, value, low, high in statistic_numbers(signal):
            if statistic in _LEFT_OUT:
                continue
            bounds: tuple[tuple[str, Any], ...] = (("", value), (".low", low), (".high", high))
            row += [(f"{signal.name}.{statistic}{end}", signal.unit, float(each)) for end, each in bounds if each != ""]
    return row


def stored(folder: Path, outcome: Outcome) -> None:
    """Write a results file that a worker sent.

    Raises
    ------
    ScenarioError
        When it cannot be written.
    """
    if outcome.content is not None:
        with whole_file(folder / outcome.file, "results of a case") as part:
            part.write_bytes(outcome.content)
