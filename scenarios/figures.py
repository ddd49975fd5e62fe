"""Figures of `tlpsim figures`: what the digital filters of wind and waves make, beside what was asked of them.

`processes` draws the paper's Fig. 3, single- and multiple-point spectra of the gusts, and the same of the wave
elevation: the target, the spectrum of the fitted filter (theory), and the estimate from a simulated record. Without a
scenario the wind is that of six points on a platform at 40 m/s (Kaimal, AR(25) and ARMA(3, 3) as in the paper), and the
sea a JONSWAP one of 12 m and 14 s (AR(59) and ARMA(8, 7)).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from numpy.typing import NDArray
from scipy.signal import csd
from scipy.stats import chi2

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.arma import ArmaModel, Certificate, spectrum
from tlpsim.loads.filters.process import generate
from tlpsim.loads.waves.elevation import ArmaSea
from tlpsim.loads.waves.sea import SeaState, wave_stream
from tlpsim.loads.wind.field import WIND_STREAM, Gusts, WindField, wind_field
from tlpsim.loads.wind.profile import Profile
from tlpsim.scenarios.figure_files import save

if TYPE_CHECKING:
    from tlpsim.scenarios.schema import Scenario

FloatArray = NDArray[np.float64]

RECORD = 24 * 3 * 3600.0
"""Length of the simulated records, s: 24 storms of three hours"""
SEED = 1
WIND_FIGURE, WAVE_FIGURE = "wind_spectra.png", "wave_spectrum.png"

_SEGMENTS = {"wind": 1024, "waves": 2048}  # samples; the resolution of the estimates
_CONFIDENCE = 0.95
_TARGET: dict[str, Any] = {"color": "black", "linewidth": 3.0, "label": "target", "zorder": 2}
_SAMPLED: dict[str, Any] = {"color": "#4ba3e3", "linewidth": 0.9, "label": "simulated", "zorder": 3}
_FILTER: dict[str, Any] = {
    "color": "#d62728",
    "linewidth": 1.4,
    "dashes": (5, 3),
    "label": "fitted filter",
    "zorder": 4,
}
_BAND: dict[str, Any] = {"color": "#4ba3e3", "alpha": 0.2, "linewidth": 0.0, "zorder": 1}
_BAND_LABEL = "95 % of the estimates, if the filter is right"
_POINTS = np.array([[0, -30, 22], [0, 0, 22], [0, 30, 22], [0, -20, 40], [0, 20, 40], [0, 0, 70]], dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True)
class Spectra:
    """What a figure shows: cross-spectra of m components at the frequencies of the estimate, one-sided.

    Parameters
    ----------
    frequency
        Shape (nf,), Hz, without zero and the Nyquist frequency.
    target, fitted, sampled
        Shape (nf, m, m), unit²/Hz.
    segments
        Number of independent segments in the estimate: an auto-spectrum has a relative deviation of 1 / sqrt of it.
    duration
        Of the simulated record, s.
    certificate
        Of the fit.
    """

    frequency: FloatArray
    target: NDArray[np.complex128]
    fitted: NDArray[np.complex128]
    sampled: NDArray[np.complex128]
    segments: float
    duration: float
    certificate: Certificate

    def band(self) -> tuple[float, float]:
        """Factors between which 95 % of the estimates of an auto-spectrum lie, if the filter is right."""
        freedom = 2.0 * self.segments
        tails = (0.5 * (1.0 - _CONFIDENCE), 0.5 * (1.0 + _CONFIDENCE))
        low, high = (float(chi2.ppf(tail, freedom)) / freedom for tail in tails)
        return low, high


def _estimated(samples: FloatArray, step: float, length: int) -> tuple[FloatArray, NDArray[np.complex128], float]:
    """Welch's estimate with half-overlapped Hann segments: frequency, cross-spectra, independent segments."""
    size = samples.shape[1]
    result = np.empty((length // 2 + 1, size, size), dtype=np.complex128)
    for i in range(size):
        for j in range(i, size):
            frequency, density = csd(samples[:, j], samples[:, i], fs=1.0 / step, nperseg=length)
            result[:, i, j], result[:, j, i] = density, np.conj(density)
    # Neighbouring Hann segments with half overlap are correlated: 36/19 degrees of freedom a segment, not 2.
    count = (2 * len(samples) // length - 1) * 18.0 / 19.0
    return np.asarray(frequency), result, count


def _spectra(
    model: ArmaModel, certificate: Certificate, target: object, stream: int, seed: int, duration: float, length: int
) -> Spectra:
    samples = generate(model, seed, stream, max(int(duration / model.step), 2 * length))
    frequency, sampled, segments = _estimated(samples, model.step, length)
    # The first value beside zero and the last before Nyquist are smeared by the window.
    inside = slice(2, -2)
    frequency = frequency[inside]
    return Spectra(
        frequency=frequency,
        target=np.asarray(target(frequency), dtype=np.complex128),  # type: ignore[operator]
        fitted=spectrum(model, frequency),
        sampled=sampled[inside],
        segments=segments,
        duration=len(samples) * model.step,
        certificate=certificate,
    )


def wind_spectra(field: WindField, seed: int = SEED, duration: float = RECORD) -> Spectra:
    """Spectra of the gusts at all points of a field, from a record of `duration` (s)."""
    return _spectra(field.model, field.certificate, field.spectrum, WIND_STREAM, seed, duration, _SEGMENTS["wind"])


def wave_spectra(sea: ArmaSea, seed: int = SEED, duration: float = RECORD) -> Spectra:
    """Spectrum of the elevation of a sea, all directions together, from a record of `duration` (s)."""

    def target(frequency: FloatArray) -> FloatArray:
        return sea.state.density(frequency)[:, None, None]

    return _spectra(sea.model, sea.certificate, target, wave_stream(0), seed, duration, _SEGMENTS["waves"])


def reference_wind() -> WindField:
    """Six points on a platform in a wind of 40 m/s, Kaimal's spectrum, by the paper's orders."""
    field = wind_field(
        position=_POINTS,
        area=np.full(len(_POINTS), 500.0),
        heading=0.0,
        profile=Profile(speed_10=40.0, roughness_length=0.005),
        gusts=Gusts(seed=SEED),
    )
    assert isinstance(field, WindField)
    return field


def reference_sea() -> ArmaSea:
    """A JONSWAP sea of 12 m and 14 s, by the paper's orders."""
    return ArmaSea(
        SeaState(spectrum="jonswap", significant_height=12.0, peak_period=14.0, water_depth=450.0), reach=0.0
    )


def scenario_processes(scenario: Scenario) -> tuple[WindField | None, ArmaSea | None]:
    """Wind and sea of the built-in components of a scenario; None for what it has not, or has without a filter."""
    from tlpsim.scenarios.assemble import wave_loads, wind_loads

    wind, waves = wind_loads(scenario), wave_loads(scenario)
    field = wind.field if wind is not None and isinstance(wind.field, WindField) else None
    sea = waves.sea if waves is not None and isinstance(waves.sea, ArmaSea) else None
    return field, sea


def draw_processes(folder: Path, scenario: Scenario | None = None, duration: float = RECORD) -> list[Path]:
    """Draw the spectra of wind and waves into a folder.

    Parameters
    ----------
    folder
        Made where it is missing.
    scenario
        Whose wind and waves; those of this module's head without it.
    duration
        Of the simulated records, s.

    Returns
    -------
    Files written.

    Raises
    ------
    ScenarioError
        When the folder cannot be written, or the scenario has neither gusts nor waves made by a digital filter.
    """
    field: WindField | None
    sea: ArmaSea | None
    if scenario is None:
        field, sea = reference_wind(), reference_sea()
        seeds = {"wind": SEED, "wave": SEED}
        wind = "Kaimal, 40 m/s"
    else:
        field, sea = scenario_processes(scenario)
        seeds = scenario.seeds()
        wind = f"{_words(scenario.wind.spectrum)}, {scenario.wind.speed:.3g} m/s"
    figures: dict[str, Figure] = {}
    if field is not None:
        points = f"{wind}, two of {len(field.speed)} points"
        figures[WIND_FIGURE] = wind_figure(wind_spectra(field, seeds["wind"], duration), points)
    if sea is not None:
        state = sea.state
        waves = f"{_words(state.spectrum)}, Hs {state.significant_height:.3g} m, Tp {state.peak_period:.3g} s"
        if state.table is not None:
            waves = "spectrum of the table"
        figures[WAVE_FIGURE] = wave_figure(wave_spectra(sea, seeds["wave"], duration), waves)
    if not figures:
        raise ScenarioError(
            "the scenario has neither gusts nor waves made by a digital filter: set wind.speed or "
            "waves.significant_height above zero and keep the built-in components"
        )
    return save(folder, figures)


def shown_points(target: NDArray[np.complex128]) -> tuple[int, int]:
    """Two points whose root coherence, averaged over the frequencies, is the largest but less than one."""
    auto = np.sqrt(np.einsum("fii->fi", target).real)
    mean = np.mean(np.abs(target) / (auto[:, :, None] * auto[:, None, :]), axis=0)
    mean[(mean > 0.999) | np.tri(len(mean), dtype=bool)] = -1.0
    first, second = np.unravel_index(int(np.argmax(mean)), mean.shape)
    return (int(first), int(second)) if mean[first, second] > 0.0 else (0, len(mean) - 1)


def wind_figure(spectra: Spectra, what: str) -> Figure:
    """The paper's Fig. 3: auto-spectra, cross-spectrum and root coherence of two points; `what` names the wind."""
    first, second = shown_points(spectra.target)
    pair = np.ix_(range(len(spectra.frequency)), [first, second], [first, second])
    target, fitted, sampled = (matrix[pair] for matrix in (spectra.target, spectra.fitted, spectra.sampled))
    frequency = spectra.frequency
    figure = Figure(figsize=(11.0, 8.2), layout="constrained", dpi=130)
    axes = figure.subplots(2, 2)
    figure.suptitle(f"Wind gusts, {what}: {_orders(spectra)}", fontsize=13)
    for column, point in enumerate((first, second)):
        lines = [matrix[:, column, column].real for matrix in (target, fitted, sampled)]
        _draw_auto(axes[0, column], frequency, lines, spectra.band())
        axes[0, column].set(
            title=f"Auto-spectrum, point {point + 1}", ylabel="$S_{uu}(f)$, (m/s)²/Hz", xlabel="frequency, Hz"
        )
    cross = axes[1, 0]
    for matrix, style in ((target, _TARGET), (sampled, _SAMPLED), (fitted, _FILTER)):
        cross.loglog(frequency, np.abs(matrix[:, 0, 1]), **style)
    scale = np.sqrt(target[:, 0, 0].real * target[:, 1, 1].real)
    noise = scale / np.sqrt(spectra.segments)
    lowest = max(float(noise.min()), 1e-2 * float(np.abs(target[:, 0, 1]).min()), 1e-5 * float(scale.max()))
    cross.set(
        title=f"Cross-spectrum, points {first + 1} and {second + 1}",
        ylabel="$|S_{12}(f)|$, (m/s)²/Hz",
        xlabel="frequency, Hz",
        ylim=(lowest, None),
    )
    coherence = axes[1, 1]
    for matrix, style in ((target, _TARGET), (sampled, _SAMPLED), (fitted, _FILTER)):
        own = np.sqrt(matrix[:, 0, 0].real * matrix[:, 1, 1].real)
        coherence.semilogx(frequency, np.abs(matrix[:, 0, 1]) / own, **style)
    coherence.axhline(1.0 / np.sqrt(spectra.segments), color="grey", linewidth=0.8, linestyle=":")
    coherence.text(
        frequency[0], 1.0 / np.sqrt(spectra.segments), " noise of the estimate", va="bottom", color="grey", fontsize=9
    )
    coherence.set(
        title=f"Root coherence, points {first + 1} and {second + 1}",
        ylabel=r"$|S_{12}| / \sqrt{S_{11} S_{22}}$",
        xlabel="frequency, Hz",
        ylim=(0.0, 1.02),
    )
    _finish(figure, axes.ravel().tolist(), spectra)
    return figure


def _words(name: str) -> str:
    """Name of a spectrum as one writes it: "Pierson-Moskowitz"."""
    words = {"api": "API", "npd": "NPD", "jonswap": "JONSWAP"}
    return words.get(name, name.replace("_", "-").title())


def _orders(spectra: Spectra) -> str:
    return spectra.certificate.orders_used.replace("->", "→")


def wave_figure(spectra: Spectra, what: str) -> Figure:
    """Spectrum of the elevation on a linear and on a logarithmic scale; `what` names the sea."""
    frequency = spectra.frequency
    target, fitted, sampled = (matrix[:, 0, 0].real for matrix in (spectra.target, spectra.fitted, spectra.sampled))
    figure = Figure(figsize=(11.0, 4.8), layout="constrained", dpi=130)
    linear, logarithmic = figure.subplots(1, 2)
    figure.suptitle(f"Wave elevation, {what}: {_orders(spectra)}", fontsize=13)
    low, high = spectra.band()
    linear.fill_between(frequency, low * fitted, high * fitted, label=_BAND_LABEL, **_BAND)
    for density, style in ((target, _TARGET), (sampled, _SAMPLED), (fitted, _FILTER)):
        linear.plot(frequency, density, **style)
    peak = float(frequency[np.argmax(target)])
    linear.set(title="Elevation spectrum", ylabel=r"$S_{\eta\eta}(f)$, m²/Hz", xlabel="frequency, Hz")
    linear.set_xlim(0.0, min(4.0 * peak, float(frequency[-1])))
    linear.set_ylim(0.0, None)
    _draw_auto(logarithmic, frequency, [target, fitted, sampled], spectra.band())
    logarithmic.set(
        title="The same, logarithmic",
        ylabel=r"$S_{\eta\eta}(f)$, m²/Hz",
        xlabel="frequency, Hz",
        ylim=(1e-5 * float(target.max()), 3.0 * float(target.max())),
    )
    logarithmic.set_xlim(max(0.2 * peak, float(frequency[0])), float(frequency[-1]))
    floor = spectra.certificate.white_floor * float(target.max())
    if floor > 0.0:
        logarithmic.axhline(floor, color="grey", linewidth=0.8, linestyle=":")
        # Under the spectrum, where nothing is drawn.
        logarithmic.text(1.3 * peak, floor, "white floor of the fit", va="top", color="grey", fontsize=9)
    _finish(figure, [linear, logarithmic], spectra)
    return figure


def _draw_auto(axes: Axes, frequency: FloatArray, lines: list[FloatArray], band: tuple[float, float]) -> None:
    target, fitted, sampled = lines
    axes.fill_between(frequency, band[0] * fitted, band[1] * fitted, label=_BAND_LABEL, **_BAND)
    for density, style in ((target, _TARGET), (sampled, _SAMPLED), (fitted, _FILTER)):
        axes.loglog(frequency, density, **style)


def _finish(figure: Figure, axes: list[Axes], spectra: Spectra) -> None:
    for one in axes:
        if one.get_xscale() == "log":
            one.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            one.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            one.xaxis.set_minor_formatter(NullFormatter())
        one.grid(True, which="major", color="0.88", linewidth=0.7)
        one.set_axisbelow(True)
        one.spines[["top", "right"]].set_visible(False)
    axes[0].legend(frameon=False, fontsize=9, loc="best")
    found = spectra.certificate
    where = f" where it is above {100.0 * found.level:g} % of its peak" if found.level else ""
    figure.supxlabel(
        f"Filter against target from {found.band[0]:.3g} to {found.band[1]:.3g} Hz{where}: at most "
        f"{found.auto_error_max:.2f} dB, root mean square {found.auto_error_rms:.2f} dB. "
        f"Simulated: {spectra.duration / 3600.0:.3g} h.",
        fontsize=9,
        color="0.3",
    )
