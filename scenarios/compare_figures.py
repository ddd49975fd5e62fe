"""Figures of `tlpsim figures compare`: the paper's Fig. 6 for all degrees of freedom, and what each load does.

`response_spectra.png` and `surge_spectrum.png` show the spectra of the position by both domains; the band about the
average of the records holds the true spectrum of each frequency with a probability of 90 %, by chi-square.
`contributions.png` shows the standard deviation in both bands under one excitation alone.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray
from scipy.stats import chi2

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.spectral.records import SpectralResponse, band_integral
from tlpsim.scenarios.compare import Comparison
from tlpsim.scenarios.figure_files import save
from tlpsim.scenarios.spectral_tables import hours
from tlpsim.scenarios.statistics.bands import BAND_EDGES
from tlpsim.scenarios.statistics.summary import TABLE_UNITS

FloatArray = NDArray[np.float64]

SPECTRA, SURGE, CONTRIBUTIONS = "response_spectra.png", "surge_spectrum.png", "contributions.png"

_CONFIDENCE = 0.9
_DECADES = 5.0  # of the ordinate, below the highest peak
_RECORDS: dict[str, Any] = {"color": "#4ba3e3", "linewidth": 1.1, "zorder": 3}
_BAND: dict[str, Any] = {"color": "#4ba3e3", "alpha": 0.28, "linewidth": 0.0, "zorder": 2}
_FREQUENCY: dict[str, Any] = {"color": "#d62728", "linewidth": 1.5, "dashes": (5, 2), "zorder": 4}
_BANDS = {"#1f5a96": (0.0, BAND_EDGES[0]), "#d9822b": BAND_EDGES}
_NAMES = {"waves": "waves, 1st order", "slow drift": "slow drift, potential", "tethers": "tethers, 2nd order"}
_ALL = "all"
_SUPERSCRIPT = "⁰¹²³⁴⁵⁶⁷⁸⁹"
_SQUARED = {"m": "m²", "cm": "cm²", "10⁻⁴ rad": "(10⁻⁴ rad)²", "10⁻² rad": "(10⁻² rad)²"}


def draw_comparison(folder: Path, comparison: Comparison) -> list[Path]:
    """Draw a comparison into a folder, which is made where it is missing, and return the files.

    Raises
    ------
    ScenarioError
        When the folder cannot be written.
    """
    figures = {
        SPECTRA: spectra_figure(comparison),
        SURGE: surge_figure(comparison),
        CONTRIBUTIONS: contributions_figure(comparison.response, comparison.scenario.title),
    }
    return save(folder, figures)


def typeset(unit: str) -> str:
    """A unit of `TABLE_UNITS` as it is printed: 10⁻⁴ rad."""
    return re.sub(r"1e-(\d)", lambda found: f"10⁻{_SUPERSCRIPT[int(found[1])]}", unit)


def confidence_band(segments: float) -> tuple[float, float]:
    """Factors of an average spectrum between which the true one lies with a probability of 90 %."""
    freedom = 2.0 * segments
    low, high = (freedom / float(chi2.ppf(0.5 * (1.0 + sign * _CONFIDENCE), freedom)) for sign in (1.0, -1.0))
    return low, high


def spectra_figure(comparison: Comparison) -> Figure:
    """Spectra of the six positions by both domains up to the end of the wave band."""
    figure = Figure(figsize=(14.0, 7.6), layout="constrained", dpi=120)
    grid = figure.subplots(2, 3, sharex=True)
    for axes, degree in zip(grid.ravel(), DEGREES_OF_FREEDOM, strict=True):
        _draw_spectrum(axes, comparison, degree)
        axes.set_title(degree)
    for axes in grid[-1]:
        axes.set_xlabel("frequency, Hz")
    _legend(figure, grid[0, 0], 3)
    figure.suptitle(_title("Spectra of the position", comparison), fontsize=13)
    return figure


def surge_figure(comparison: Comparison) -> Figure:
    """The paper's Fig. 6, spectrum of surge, with the low frequencies beside it on even scales."""
    figure = Figure(figsize=(11.0, 5.0), layout="constrained", dpi=130)
    whole, slow = figure.subplots(1, 2, width_ratios=(3, 2))
    _draw_spectrum(whole, comparison, "surge")
    whole.set(title="both bands", xlabel="frequency, Hz")
    _draw_spectrum(slow, comparison, "surge")
    top = slow.get_ylim()[1] / 3.0
    slow.set_yscale("linear")
    slow.set(title="low frequencies, even scale", xlabel="frequency, Hz")
    slow.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    slow.set(xlim=(0.0, 1.6 * BAND_EDGES[0]), ylim=(0.0, top))
    _legend(figure, whole, 3)
    figure.suptitle(_title("Spectrum of surge", comparison), fontsize=13)
    return figure


def _draw_spectrum(axes: Axes, comparison: Comparison, degree: str) -> None:
    unit, factor = TABLE_UNITS[degree]
    quantity = comparison.response.quantities[f"position.{degree}"]
    column = factor**2 * comparison.density[:, DEGREES_OF_FREEDOM.index(degree)]
    expected = factor**2 * quantity.density
    low, high = confidence_band(comparison.segments)
    shown = comparison.frequency <= BAND_EDGES[1]
    frequency, column = comparison.frequency[shown], column[shown]
    axes.fill_between(frequency, low * column, high * column, label="90 % band of the records' average", **_BAND)
    axes.plot(frequency, column, label="time domain", **_RECORDS)
    axes.plot(quantity.frequency, expected, label="frequency domain", **_FREQUENCY)
    top = max(float(expected[quantity.frequency <= BAND_EDGES[1]].max()), float(high * column.max(initial=0.0)))
    axes.axvline(BAND_EDGES[0], color="0.5", linewidth=0.8, linestyle=":", zorder=1)
    axes.set(
        xlim=(0.0, BAND_EDGES[1]),
        xticks=np.arange(0.0, BAND_EDGES[1] + 0.01, 0.05),
        ylabel=f"$S(f)$, {_SQUARED[typeset(unit)]}/Hz",
    )
    if top > 0.0:
        axes.set_yscale("log")
        axes.set_ylim(3.0 * top * 10.0**-_DECADES, 3.0 * top)
    _finish(axes)


def contributions_figure(response: SpectralResponse, title: str) -> Figure:
    """Standard deviation of each degree of freedom in both bands under one excitation alone, and under all."""
    parts = [*(name for name in response.contributions), _ALL]
    figure = Figure(figsize=(14.0, 8.4), layout="constrained", dpi=120)
    grid = figure.subplots(2, 3, sharey=True)
    places = np.arange(len(parts))
    for index, (axes, degree) in enumerate(zip(grid.ravel(), DEGREES_OF_FREEDOM, strict=True)):
        unit, factor = TABLE_UNITS[degree]
        densities = [values[:, index] for values in response.contributions.values()]
        densities.append(response.quantities[f"position.{degree}"].density)
        for row, (colour, edges) in enumerate(_BANDS.items()):
            variances = [max(band_integral(response.frequency, each, *edges), 0.0) for each in densities]
            spreads = factor * np.sqrt(variances)
            bars = axes.barh(places + 0.38 * (row - 0.5), spreads, height=0.38, color=colour, zorder=2)
            axes.bar_label(bars, labels=[_short(value) for value in spreads], padding=3, fontsize=8, color="0.25")
        axes.set(title=degree, xlabel=f"standard deviation, {typeset(unit)}")
        axes.set_yticks(places, [_NAMES.get(name, name) for name in parts])
        axes.axhline(len(parts) - 1.5, color="0.6", linewidth=0.8)
        axes.margins(x=0.14)
        _finish(axes)
    grid[0, 0].invert_yaxis()
    names = (f"below {BAND_EDGES[0]:g} Hz", f"{BAND_EDGES[0]:g} to {BAND_EDGES[1]:g} Hz")
    handles = [Patch(color=colour, label=name) for colour, name in zip(_BANDS, names, strict=True)]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False)
    figure.suptitle(f"What each excitation alone does: {title}", fontsize=13)
    return figure


def _short(value: float) -> str:
    return f"{value:.2f}" if value >= 0.005 else "0"


def _title(what: str, comparison: Comparison) -> str:
    count, length = len(comparison.samples), hours(comparison.scenario.simulation.duration)
    return f"{what}: {comparison.scenario.title}; {count} records of {length}"


def _legend(figure: Figure, axes: Axes, columns: int) -> None:
    handles, labels = axes.get_legend_handles_labels()
    order = [1, 0, 2]  # the line before its band
    handles, labels = [handles[k] for k in order], [labels[k] for k in order]
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, frameon=False)


def _finish(axes: Axes) -> None:
    axes.grid(True, color="0.88", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
