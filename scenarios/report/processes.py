"""How well the digital filters of wind and waves meet their spectra: certificates, and the curves behind them."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import TlpsimError
from tlpsim.loads.filters.arma import spectrum as filter_spectrum
from tlpsim.loads.filters.certificate import Certificate, FilterFitWarning
from tlpsim.loads.waves.elevation import ArmaSea
from tlpsim.loads.wind.field import WindField
from tlpsim.scenarios.assemble import wave_loads, wind_loads
from tlpsim.scenarios.report.analysis import Analysis, recorded
from tlpsim.scenarios.report.document import Block, Cell, Chart, Grid, Row, Table, Text
from tlpsim.scenarios.report.spectra import spectrum
from tlpsim.scenarios.report.words import rounded, short
from tlpsim.scenarios.schema import Scenario

FloatArray = NDArray[np.float64]

_POINTS = 300  # of a curve
_DECADES = 5.0  # of the ordinate
_LINEAR = 0.25  # Hz, end of an even scale
_FIGURES = {
    "auto_error_max": ("largest error of the spectra, dB", ".2f"),
    "auto_error_rms": ("root mean square error of the spectra, dB", ".3f"),
    "cross_error_max": ("largest error of the cross-spectra", ".3f"),
    "coherence_error_max": ("largest error of the root coherence", ".3f"),
    "variance_error": ("error of the variance", ".1e"),
    "largest_pole": ("largest pole", ".6f"),
    "round_off": ("noise of rounding", ".1e"),
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Process:
    """A process that a digital filter makes.

    Attributes
    ----------
    name
        "wind" or "waves".
    certificate
        Of the fit.
    signal, title, unit
        What of it is recorded and drawn, and the unit of its spectrum.
    asked, made
        Its spectrum at frequencies (Hz), as asked for and of the filter.
    """

    name: str
    certificate: Certificate
    signal: str
    title: str
    unit: str
    asked: Callable[[FloatArray], FloatArray]
    made: Callable[[FloatArray], FloatArray]


def processes(scenario: Scenario) -> list[Process]:
    """Wind and waves of a scenario's built-in components as they are made.

    Components that are other FMUs, and processes that are made without a filter, are left out.

    Raises
    ------
    TlpsimError
        When a file of the scenario is not there any more, or a filter cannot be fitted.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FilterFitWarning)  # the certificate says it
        wind, waves = wind_loads(scenario), wave_loads(scenario)
    found = []
    if wind is not None and isinstance(wind.field, WindField):
        found.append(_gusts(wind.field, wind.segments.area))
    if waves is not None and isinstance(waves.sea, ArmaSea):
        found.append(_elevation(waves.sea))
    return found


def _gusts(field: WindField, area: FloatArray) -> Process:
    """The wind speed that is recorded: the mean over the segments, weighted by their areas."""
    share = area / area.sum()

    def mean(spectra: NDArray[np.complex128] | FloatArray) -> FloatArray:
        return np.asarray(np.einsum("i,fij,j->f", share, spectra, share).real)

    return Process(
        name="wind",
        certificate=field.certificate,
        signal="wind.wind_speed",
        title="Wind speed, mean over the area",
        unit="(m/s)²/Hz",
        asked=lambda frequency: mean(field.spectrum(frequency)),
        made=lambda frequency: mean(filter_spectrum(field.model, frequency)),
    )


def _elevation(sea: ArmaSea) -> Process:
    return Process(
        name="waves",
        certificate=sea.certificate,
        signal="wave.elevation",
        title="Wave elevation",
        unit="m²/Hz",
        asked=sea.state.density,
        made=lambda frequency: np.asarray(filter_spectrum(sea.model, frequency)[:, 0, 0].real),
    )


def process_blocks(analyses: Sequence[Analysis]) -> tuple[list[Block], bool | None]:
    """Certificates and spectra of each case, and whether all filters are within their limits; None without any."""
    blocks: list[Block] = []
    trusted: list[bool] = []
    for each in analyses:
        if each.case.scenario is None:
            continue
        which = f": {each.case.label}" if len(analyses) > 1 else ""
        try:
            found = processes(each.case.scenario)
        except TlpsimError as error:
            blocks.append(Text(text=f"No certificates{which}: {error}.", small=True))
            continue
        if not found:
            blocks.append(Text(text=f"No digital filters{which}: wind and waves come from other FMUs, or are calm."))
            continue
        trusted += [process.certificate.trusted for process in found]
        blocks.append(_table({process.name: process.certificate for process in found}, which))
        advice = ((process.name, process.certificate.advice) for process in found)
        blocks += [Text(text=f"{name}: {text}") for name, text in advice if text]
        blocks.append(Grid(blocks=tuple(_chart(each, process) for process in found)))
    return blocks, all(trusted) if trusted else None


def _table(found: dict[str, Certificate], which: str) -> Table:
    rows = [
        Row(heading="orders", cells=(*(c.orders_used.replace("->", "→") for c in found.values()), "")),
        Row(
            heading="band of the comparison, Hz",
            cells=(*(f"{c.band[0]:.3g} to {c.band[1]:.3g}" for c in found.values()), ""),
        ),
    ]
    limits = next(iter(found.values())).limits
    for name in (field.name for field in fields(limits)):
        title, form = _FIGURES[name]
        cells = [
            Cell(text=f"{getattr(c, name):{form}}", tone="attention" if name in c.misses else "")
            for c in found.values()
        ]
        rows.append(Row(heading=title, cells=(*cells, f"{getattr(limits, name):g}")))
    lost = (f"{100.0 * c.variance_lost:.2g} %" for c in found.values())
    rows.append(Row(heading="variance above the Nyquist frequency, not in the samples", cells=(*lost, "")))
    verdict = [
        Cell(text="within limits" if c.trusted else "beyond limits", tone="good" if c.trusted else "attention")
        for c in found.values()
    ]
    rows.append(Row(heading="verdict", cells=(*verdict, ""), lead=True))
    return Table(
        caption=f"Fit of the digital filters{which}",
        headings=("", *found, "limit"),
        rows=tuple(rows),
        note="Certificates of the fit, eqs. (1) to (3) of tlpsim.loads.filters.certificate; docs/digital-filters.md.",
    )


def _chart(analysis: Analysis, process: Process) -> Chart:
    """Spectrum that was asked for, that of the filter, and the estimate from the records."""
    lowest, highest = process.certificate.band
    frequency = np.geomspace(lowest, highest, _POINTS)
    asked, made = process.asked(frequency), process.made(frequency)
    series: list[dict[str, Any]] = []
    present = [results for results in analysis.case.results if process.signal in recorded(results)]
    estimate = spectrum(present, process.signal, analysis.start)
    if estimate is not None:
        kept = estimate.frequency <= highest
        low, high = estimate.band()
        density = estimate.density[kept]
        line: dict[str, Any] = {"label": "this run" if len(present) == 1 else "these runs", "colour": 1}
        line |= {"x": rounded(estimate.frequency[kept]), "y": rounded(density)}
        series.append(line | {"low": rounded(low * density), "high": rounded(high * density)})
    x = rounded(frequency)
    series.append({"label": "asked for", "colour": 0, "x": x, "y": rounded(asked)})
    series.append({"label": "filter", "colour": 2, "dash": True, "x": x, "y": rounded(made)})
    floor = max(float(asked.max()) * 10.0**-_DECADES, 0.3 * float(asked.min()))
    views = [
        {
            "label": label,
            "x": {"label": "frequency, Hz", "log": log, "from": begin, "to": min(end, highest)},
            "y": {"label": process.unit, "log": log, "from": floor if log else 0.0},
            "series": series,
        }
        for label, log, begin, end in (("log–log", True, lowest, highest), ("lin–lin", False, 0.0, _LINEAR))
    ]
    ratio = float(np.trapezoid(made, frequency) / np.trapezoid(asked, frequency))
    caption = f"Variance of the filter in this band over that asked for: {short(ratio, 4)}."
    if process.name == "waves":
        caption += " The run's elevation is that at the moving platform, of waves up to waves.frequency_max."
    content = {"choices": [{"label": process.title, "views": views}], "height": 260}
    return Chart(kind="lines", title=process.title, content=content, caption=caption)
