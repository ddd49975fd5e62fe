"""What the command line shows of the frequency domain."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from rich.table import Table

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.spectral.records import Quantity, SpectralResponse
from tlpsim.scenarios.statistics.bands import BAND_EDGES
from tlpsim.scenarios.statistics.summary import TABLE_UNITS
from tlpsim.scenarios.terminal import output

ENDS = {"top": "tendon_tension", "bottom": "tendon_bottom_tension"}
"""Quantities of the tensions at the two ends of a tendon, by what the end is called."""
LOW, WAVE = f"<{BAND_EDGES[0]:g}", f"{BAND_EDGES[0]:g}–{BAND_EDGES[1]:g}"
"""The two bands, Hz, as headings."""


@dataclass(frozen=True, slots=True, kw_only=True)
class QuantityStatistics:
    """Statistics of a quantity by the frequency domain, in its unit.

    Attributes
    ----------
    mean, low_frequency, wave_frequency, std
        As of `tlpsim.scenarios.statistics.bands.BandStatistics`, but for an ensemble of records.
    maximum, minimum
        Expected in the duration.
    period
        Mean time between up-crossings of the mean, s; NaN without fluctuation.
    """

    mean: float
    low_frequency: float
    wave_frequency: float
    std: float
    maximum: float
    minimum: float
    period: float


def quantity_statistics(quantity: Quantity, duration: float) -> QuantityStatistics:
    """Statistics of a quantity for records of a duration (s).

    Raises
    ------
    ScenarioError
        As `tlpsim.loads.spectral.extremes.expected_extremes`.
    """
    extremes, rate = quantity.extremes(duration), quantity.zero_crossing_rate
    return QuantityStatistics(
        mean=quantity.mean,
        low_frequency=quantity.spread(0.0, BAND_EDGES[0]),
        wave_frequency=quantity.spread(*BAND_EDGES),
        std=quantity.spread(),
        maximum=extremes.maximum,
        minimum=extremes.minimum,
        period=1.0 / rate if rate > 0.0 else float("nan"),
    )


def worst_tendons(response: SpectralResponse, end: str, duration: float) -> dict[str, QuantityStatistics]:
    """Tendons of the highest expected maximum and of the lowest expected minimum at an end, by number.

    One tendon may be both; none where the response has no tensions.
    """
    pattern = re.compile(rf"{ENDS[end]}\[(\d+)\]")
    found = {
        match[1]: quantity_statistics(quantity, duration)
        for name, quantity in response.quantities.items()
        if (match := pattern.fullmatch(name))
    }
    if not found:
        return {}
    highest = max(found, key=lambda tendon: found[tendon].maximum)
    lowest = min(found, key=lambda tendon: found[tendon].minimum)
    return {tendon: found[tendon] for tendon in dict.fromkeys((highest, lowest))}


def print_response(response: SpectralResponse, title: str, duration: float) -> None:
    """Response as in the paper's Table I with extremes in a duration (s), tensions, modes, mean loads, time taken."""
    _print_positions(response, title, duration)
    _print_tensions(response, duration)
    _print_modes(response)
    _print_loads(response)
    rounds = len(response.iterations)
    if rounds:
        output.print(f"outer rounds: {rounds}, last relative change {response.iterations[-1]:.1e}")
    total = sum(response.seconds.values())
    steps = ", ".join(f"{name} {seconds:.2f}" for name, seconds in response.seconds.items())
    output.print(f"time, s: {steps}; together {total:.2f}", soft_wrap=True)


def _print_positions(response: SpectralResponse, title: str, duration: float) -> None:
    table = _table(f"{title}: frequency domain; frequencies in Hz", _headings(duration))
    shapes = _table("zero crossings and distribution", ("period, s", "skewness", "kurtosis"))
    for degree in DEGREES_OF_FREEDOM:
        quantity = response.quantities[f"position.{degree}"]
        found = quantity_statistics(quantity, duration)
        unit, factor = TABLE_UNITS[degree]
        values = found.mean, found.low_frequency, found.wave_frequency, found.std, found.minimum, found.maximum
        table.add_row(f"{degree}, {unit}", *(number(factor * value) for value in values))
        shapes.add_row(
            degree, number(found.period, 2), number(quantity.skewness), number(3.0 + quantity.excess_kurtosis)
        )
    output.print(table)
    output.print(shapes)


def _print_tensions(response: SpectralResponse, duration: float) -> None:
    table = _table("tensions, MN, of the tendons with the highest maximum and the lowest minimum", _headings(duration))
    for end in ENDS:
        for tendon, found in worst_tendons(response, end, duration).items():
            values = found.mean, found.low_frequency, found.wave_frequency, found.std, found.minimum, found.maximum
            table.add_row(f"{end}, tendon {tendon}", *(number(1e-6 * value) for value in values))
    if table.row_count:
        output.print(table)


def _print_modes(response: SpectralResponse) -> None:
    table = _table("natural modes", ("period, s", "damping, %"))
    for mode in response.modes:
        table.add_row(mode.name, number(mode.period), number(100.0 * mode.damping_ratio, 2))
    output.print(table)


def _print_loads(response: SpectralResponse) -> None:
    headings = [f"{degree}\nMN{' m' if k > 2 else ''}" for k, degree in enumerate(DEGREES_OF_FREEDOM)]
    table = _table("mean loads", headings)
    for name, load in response.mean_loads.items():
        table.add_row(name, *(number(1e-6 * float(value)) for value in load))
    if table.row_count:
        output.print(table)


def _headings(duration: float) -> tuple[str, ...]:
    length = hours(duration)
    return "mean", f"std\n{LOW}", f"std\n{WAVE}", "std", f"min\nin {length}", f"max\nin {length}"


def _table(title: str, headings: Sequence[str]) -> Table:
    table = Table(title=title or None)
    table.add_column("", no_wrap=True)
    for heading in headings:
        table.add_column(heading, justify="right")
    return table


def hours(duration: float) -> str:
    """Duration (s) as a heading: 3 h, or 600 s."""
    return f"{duration / 3600.0:g} h" if duration % 3600.0 == 0.0 else f"{duration:g} s"


def number(value: float, digits: int = 3) -> str:
    """Number of a table; a dash for what is not known, and no minus before zeros."""
    return "–" if np.isnan(value) else f"{value:.{digits}f}".replace(f"-{0:.{digits}f}", f"{0:.{digits}f}")
