"""How well the digital filters of wind and waves meet their spectra: certificates, and the curves behind them."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import fields
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
_FIGURES = {
    "auto_error_max": ("largest error of the spectra, dB", ".2f"),
    "auto_error_rms": ("root mean square error of the spectra, dB", ".3f"),
    "cross_error_max": ("largest error of the cross-spectra", ".3f"),
    "coherence_error_max": ("largest error of the root coherence", ".3f"),
    "variance_error": ("error of the variance", ".1e"),
    "largest_pole": ("largest pole", ".6f"),
    "round_off": ("noise of rounding", ".1e"),
}


def certificates(scenario: Scenario) -> tuple[dict[str, Certificate], list[tuple[str, Any]]]:
    """Certificates of the filters of a scenario's built-in components by "wind" and "waves", and their models.

    Components that are other FMUs, and processes that are made without a filter, have none.

    Raises
    ------
    TlpsimError
        When a file of the scenario is not there any more, or a filter cannot be fitted.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FilterFitWarning)  # the certificate says it
        wind, waves = wind_loads(scenario), wave_loads(scenario)
    found: dict[str, Certificate] = {}
    models: list[tuple[str, Any]] = []
    if wind is not None and isinstance(wind.field, WindField):
        found["wind"] = wind.field.certificate
        models.append(("wind", wind))
    if waves is not None and isinstance(waves.sea, ArmaSea):
        found["waves"] = waves.sea.certificate
        models.append(("waves", waves.sea))
    return found, models


def process_blocks(analyses: Sequence[Analysis]) -> tuple[list[Block], bool | None]:
    """Certificates and spectra of each case, and whether all filters are within their limits; None without any."""
    blocks: list[Block] = []
    trusted: list[bool] = []
    for each in analyses:
        if each.case.scenario is None:
            continue
        which = f": {each.case.label}" if len(analyses) > 1 else ""
        try:
            found, models = certificates(each.case.scenario)
        except TlpsimError as error:
            blocks.append(Text(text=f"No certificates{which}: {error}.", small=True))
            continue
        if not found:
            blocks.append(Text(text=f"No digital filters{which}: wind and waves come from other FMUs, or are calm."))
            continue
        trusted += [each.trusted for each in found.values()]
        blocks.append(_table(found, which))
        blocks += [Text(text=f"{name}: {c.advice}") for name, c in found.items() if c.advice]
        charts = tuple(_chart(each, name, model) for name, model in models)
        blocks.append(Grid(blocks=charts))
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


def _chart(analysis: Analysis, name: str, model: Any) -> Chart:
    """Spectrum that was asked for, that of the filter, and the estimate from the records."""
    if name == "wind":
        weights = model.segments.area / model.segments.area.sum()
        field, signal, title, unit = model.field, "wind.wind_speed", "Wind speed, mean over the area", "(m/s)²/Hz"

        def reduced(matrix: NDArray[np.complex128]) -> FloatArray:
            return np.asarray(np.einsum("i,fij,j->f", weights, matrix, weights).real)

        arma, target = field.model, field.spectrum
    else:
        signal, title, unit = "wave.elevation", "Wave elevation", "m²/Hz"

        def reduced(matrix: NDArray[np.complex128]) -> FloatArray:
            return np.asarray(matrix[:, 0, 0].real)

        arma, target = model.model, lambda f: model.state.density(f)[:, None, None]
    band = model.field.certificate.band if name == "wind" else model.certificate.band
    frequency = np.geomspace(*band, _POINTS)
    asked, made = reduced(np.asarray(target(frequency))), reduced(filter_spectrum(arma, frequency))
    series: list[dict[str, Any]] = []
    present = [results for results in analysis.case.results if signal in recorded(results)]
    estimate = spectrum(present, signal, analysis.start) if present else None
    if estimate is not None:
        low, high = estimate.band()
        kept = estimate.frequency <= band[1]
        line = {"label": "this run" if len(present) == 1 else "these runs", "colour": 1}
        line |= {"x": rounded(estimate.frequency[kept]), "y": rounded(estimate.density[kept])}
        line |= {"low": rounded(low * estimate.density[kept]), "high": rounded(high * estimate.density[kept])}
        series.append(line)
    series.append({"label": "asked for", "colour": 0, "x": rounded(frequency), "y": rounded(asked)})
    series.append({"label": "filter", "colour": 2, "dash": True, "x": rounded(frequency), "y": rounded(made)})
    top = float(asked.max())
    views = [
        {
            "label": "log–log",
            "x": {"label": "frequency, Hz", "log": True, "from": band[0], "to": band[1]},
            "y": {"label": unit, "log": True, "from": max(top * 10.0**-_DECADES, 0.3 * float(asked.min()))},
            "series": series,
        },
        {
            "label": "lin–lin",
            "x": {"label": "frequency, Hz", "log": False, "from": 0.0, "to": band[1] if name == "wind" else 0.25},
            "y": {"label": unit, "log": False, "from": 0.0},
            "series": series,
        },
    ]
    caption = f"Variance of the filter in this band over that asked for: {short(_ratio(frequency, made, asked), 4)}."
    if name == "waves":
        caption += " The run's elevation is that at the moving platform, of waves up to waves.frequency_max."
    return Chart(
        kind="lines",
        title=title,
        content={"choices": [{"label": title, "views": views}], "height": 260},
        caption=caption,
    )


def _ratio(frequency: FloatArray, made: FloatArray, asked: FloatArray) -> float:
    return float(np.trapezoid(made, frequency) / np.trapezoid(asked, frequency))
