"""What is computed of a case before anything is laid out: statistics of its records, and the frequency domain."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.errors import TlpsimError
from tlpsim.loads.filters.certificate import FilterFitWarning
from tlpsim.loads.spectral.records import SpectralResponse
from tlpsim.scenarios.report.cases import Case
from tlpsim.scenarios.results import Results
from tlpsim.scenarios.spectral_tables import QuantityStatistics, quantity_statistics
from tlpsim.scenarios.statistics.bands import BAND_EDGES, first_sample
from tlpsim.scenarios.statistics.signals import SignalStatistics, run_statistics
from tlpsim.scenarios.statistics.summary import conversion

FloatArray = NDArray[np.float64]

PLATFORM = "platform"
POSITIONS = tuple(f"{PLATFORM}.position.{degree}" for degree in DEGREES_OF_FREEDOM)
EXPOSURE = 3 * 3600.0
"""Length of a storm for which extremes are expected, s"""
SLOPE = 4.0
"""m of the S-N curve of damage-equivalent ranges"""

_TENSION = re.compile(rf"{PLATFORM}\.tendon_(bottom_)?tension\[(\d+)\]")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Analysis:
    """A case and what was computed of it.

    Attributes
    ----------
    case
        It.
    start
        Time before which samples are left out of statistics, s.
    statistics
        Of positions and tensions, over all records, by full name; empty where there are none.
    without_statistics
        Why there are none, "" otherwise.
    response
        By the frequency domain; None where it cannot take the scenario.
    without_response
        Why it cannot, "" otherwise.
    """

    case: Case
    start: float
    statistics: Mapping[str, SignalStatistics]
    without_statistics: str
    response: SpectralResponse | None
    without_response: str

    def expected(self, name: str) -> QuantityStatistics | None:
        """Statistics of a signal by the frequency domain, of `EXPOSURE`, in its SI unit; None where it has none."""
        quantity = self.response and self.response.quantities.get(name.removeprefix(f"{PLATFORM}."))
        return quantity_statistics(quantity, EXPOSURE) if quantity else None

    def factor(self, name: str) -> float:
        """Factor from the unit in which a signal was recorded to that of the frequency domain."""
        quantity = self.response and self.response.quantities.get(name.removeprefix(f"{PLATFORM}."))
        return conversion(self.case.results[0].unit(name), quantity.unit) if quantity else 1.0


def analysed(case: Case, start: float | None = None) -> Analysis:
    """Statistics and frequency domain of a case.

    Parameters
    ----------
    case
        Of one or more records.
    start
        Time before which samples are left out, s; the scenario's ``outputs.statistics_from`` if not given.
    """
    if start is None:
        start = 0.0 if case.scenario is None else case.scenario.outputs.statistics_from
    statistics, without_statistics = _statistics(case, start)
    response, without_response = _response(case)
    return Analysis(
        case=case,
        start=start,
        statistics=statistics,
        without_statistics=without_statistics,
        response=response,
        without_response=without_response,
    )


def recorded(results: Results) -> tuple[str, ...]:
    """Full names of all recorded signals."""
    return tuple(f"{component}.{name}" for component in results.components for name in results.signals(component))


def tensions(names: Sequence[str], *, bottom: bool = False) -> dict[str, str]:
    """Names of tensions at the top of tendons, or at their anchors, by the number of the tendon."""
    found = (_TENSION.fullmatch(name) for name in names)
    return {each[2]: each[0] for each in found if each and (each[1] is not None) == bottom}


def component_of(results: Results, name: str) -> str:
    """Component of a signal; its name may have dots, too."""
    return max((each for each in results.components if name.startswith(f"{each}.")), key=len)


def samples(results: Results, name: str, start: float) -> tuple[FloatArray, FloatArray]:
    """Times (s) and values of a signal from `start` on, or from its beginning where too little would be left."""
    time = results.time(component_of(results, name))
    first, _ = first_sample(time, start, BAND_EDGES[0])
    return time[first:], results.signal(name)[first:]


def _statistics(case: Case, start: float) -> tuple[dict[str, SignalStatistics], str]:
    if case.scenario is None:
        return {}, "the run is not one of a scenario"
    common = set(recorded(case.results[0])).intersection(*(recorded(each) for each in case.results[1:]))
    names = [name for name in recorded(case.results[0]) if name in common and _is_response(name)]
    if not names:
        return {}, "no motion or tension of a component 'platform' was recorded"
    first = _first_of_same(case, names)
    try:
        found = run_statistics(
            case.results, list(dict.fromkeys(first.values())), start=start, exposure=EXPOSURE, slope=SLOPE
        )
    except TlpsimError as error:
        return {}, str(error)
    by_name = {each.name: each for each in found}
    return {name: replace(by_name[same], name=name) for name, same in first.items()}, ""


def _first_of_same(case: Case, names: Sequence[str]) -> dict[str, str]:
    """For each signal the first one that has the same samples, as the tendons of one column have."""
    first: dict[tuple[object, ...], str] = {}
    result = {}
    for name in names:
        digests = [blake2b(np.ascontiguousarray(each.signal(name)).data).digest() for each in case.results]
        result[name] = first.setdefault((case.results[0].unit(name), *digests), name)
    return result


def _is_response(name: str) -> bool:
    return name in POSITIONS or _TENSION.fullmatch(name) is not None


def _response(case: Case) -> tuple[SpectralResponse | None, str]:
    from tlpsim.scenarios.spectral import spectral_response

    if case.scenario is None:
        return None, "the run is not one of a scenario"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FilterFitWarning)  # the certificates in the report say it
            return spectral_response(case.scenario), ""
    except TlpsimError as error:
        return None, str(error)
