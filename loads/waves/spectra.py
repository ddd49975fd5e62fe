"""One-sided wave elevation spectra, m²/Hz, scaled so that their integral is Hs² / 16.

    S_PM(f) = (5/16) Hs² fp^4 f^-5 exp(-(5/4) (fp / f)^4)                                            (1)
    S_J(f) = C S_PM(f) gamma^r,   r = exp(-(f/fp - 1)² / (2 s²)),   s = 0.07 (f <= fp), 0.09 (f > fp)  (2)
    S_T(f) = sum over wind sea and swell of C_j (Hs_j² / (16 fp_j)) (f/fp_j)^-4 exp(-(f/fp_j)^-4) gamma_j^r  (3)

with C such that the integral of eq. (2) and of each term of eq. (3) is Hs² / 16 again. Sources: Pierson and
Moskowitz (Journal of Geophysical Research 69, 1964), Hasselmann et al. (JONSWAP, 1973). Eq. (3) is the simplified
form of Torsethaugen's double-peak spectrum (Torsethaugen and Haver, ISOPE 2004; DNV-RP-C205, appendix A), fitted to
the Norwegian shelf: heights, periods and peak enhancement of both systems follow from Hs and Tp alone, see
`torsethaugen_systems`. C is found by integration instead of from the source's fitted formula (1.5 % apart).
"""

import difflib
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.checks import require_positive
from tlpsim.loads.constants import STANDARD_GRAVITY
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.convolution import quadrature

FloatArray = NDArray[np.float64]
SpectrumFunction = Callable[[FloatArray, float, float, float], FloatArray]

_QUADRATURE_POINTS = 64
# Makes the integral of x^-4 exp(-x^-4) one.
_FOURTH_POWER_FACTOR = 4.0 / math.gamma(0.75)


def _check(significant_height: float, peak_period: float, peak_enhancement: float) -> None:
    if not (np.isfinite(significant_height) and significant_height >= 0.0):
        raise ScenarioError(f"significant wave height is {significant_height} m; it must be finite and >= 0")
    require_positive("peak period of the waves", peak_period, "s")
    if not (np.isfinite(peak_enhancement) and 1.0 <= peak_enhancement <= 20.0):
        raise ScenarioError(f"peak enhancement factor of the waves is {peak_enhancement}; it must be from 1 to 20")


def _fifth_power(ratio: FloatArray) -> FloatArray:
    """Eq. (1) over Hs² / 16 as a density of f / fp."""
    positive = np.where(ratio > 0.0, ratio, 1.0)
    density = 5.0 * positive**-5.0 * np.exp(-1.25 * positive**-4.0)
    return np.where(ratio > 0.0, density, 0.0)


def _fourth_power(ratio: FloatArray) -> FloatArray:
    """A term of eq. (3) without enhancement over Hs² / 16 as a density of f / fp."""
    positive = np.where(ratio > 0.0, ratio, 1.0)
    density = _FOURTH_POWER_FACTOR * positive**-4.0 * np.exp(-(positive**-4.0))
    return np.where(ratio > 0.0, density, 0.0)


def _enhancement(ratio: FloatArray, peak_enhancement: float) -> FloatArray:
    width = np.where(ratio <= 1.0, 0.07, 0.09)
    result: FloatArray = peak_enhancement ** np.exp(-0.5 * ((ratio - 1.0) / width) ** 2)
    return result


def _enhanced_area(shape: Callable[[FloatArray], FloatArray], peak_enhancement: float) -> float:
    """Integral of an enhanced spectrum over that of the plain one.

    One plus the integral of what the enhancement adds, which is below 1e-6 of it outside 0.5 < f / fp < 2.
    """
    nodes, weights = np.polynomial.legendre.leggauss(_QUADRATURE_POINTS)
    area = 1.0
    for low, high in ((0.5, 1.0), (1.0, 2.0)):
        ratio = low + 0.5 * (high - low) * (nodes + 1.0)
        added = shape(ratio) * (_enhancement(ratio, peak_enhancement) - 1.0)
        area += 0.5 * (high - low) * float(np.sum(weights * added))
    return area


def _enhanced(
    shape: Callable[[FloatArray], FloatArray],
    frequency: FloatArray,
    significant_height: float,
    peak_period: float,
    peak_enhancement: float,
) -> FloatArray:
    ratio = np.asarray(frequency, dtype=np.float64) * peak_period
    scale = significant_height**2 / 16.0 * peak_period / _enhanced_area(shape, peak_enhancement)
    return np.asarray(scale * shape(ratio) * _enhancement(ratio, peak_enhancement))


def jonswap(
    frequency: FloatArray, significant_height: float, peak_period: float, peak_enhancement: float = 3.3
) -> FloatArray:
    """JONSWAP spectrum, eq. (2), shape of `frequency` (Hz, >= 0), m²/Hz.

    Parameters
    ----------
    significant_height
        Hs, four times the standard deviation of the elevation, m.
    peak_period
        1 / fp, s.
    peak_enhancement
        gamma.

    Raises
    ------
    ScenarioError
        If a parameter is out of range.
    """
    _check(significant_height, peak_period, peak_enhancement)
    return _enhanced(_fifth_power, frequency, significant_height, peak_period, peak_enhancement)


def pierson_moskowitz(
    frequency: FloatArray, significant_height: float, peak_period: float, peak_enhancement: float = 1.0
) -> FloatArray:
    """Pierson-Moskowitz spectrum, eq. (1), shape of `frequency` (Hz, >= 0), m²/Hz; see `jonswap`.

    `peak_enhancement` is there so that all spectra are called alike, and has no effect.

    Raises
    ------
    ScenarioError
        If a parameter is out of range.
    """
    _check(significant_height, peak_period, 1.0)
    ratio = np.asarray(frequency, dtype=np.float64) * peak_period
    return np.asarray(significant_height**2 / 16.0 * peak_period * _fifth_power(ratio))


@dataclass(frozen=True, slots=True, kw_only=True)
class WaveSystem:
    """One of the systems of eq. (3): Hs_j in m, 1 / fp_j in s, gamma_j."""

    significant_height: float
    peak_period: float
    peak_enhancement: float


def torsethaugen_systems(significant_height: float, peak_period: float) -> tuple[WaveSystem, WaveSystem]:
    """The primary system, which has the period Tp, and the secondary one of eq. (3).

    With Tf = 6.6 Hs^(1/3), the period of a fully developed sea (fetch 370 km): for Tp <= Tf the wind sea is the
    primary system and the swell has the period Tf + 2 s; beyond, the swell is the primary system, and the wind sea
    has the period of a fully developed sea of its own height.

    Raises
    ------
    ScenarioError
        If the height is negative or the period not positive.
    """
    _check(significant_height, peak_period, 1.0)
    if significant_height == 0.0:
        still = WaveSystem(significant_height=0.0, peak_period=peak_period, peak_enhancement=1.0)
        return still, still
    developed = 6.6 * np.cbrt(significant_height)
    if peak_period <= developed:
        shortest = 2.0 * np.sqrt(significant_height)
        distance = (developed - peak_period) / (developed - shortest)
        share = 0.7 + 0.3 * np.exp(-((distance / 0.5) ** 2))
        second_height = significant_height * np.sqrt(1.0 - share**2)
        second_period = developed + 2.0
        enhancement = _steepness_enhancement(share * significant_height, peak_period)
    else:
        distance = (peak_period - developed) / (25.0 - developed)
        share = 0.6 + 0.4 * np.exp(-((distance / 0.3) ** 2))
        second_height = significant_height * np.sqrt(1.0 - share**2)
        second_period = 6.6 * np.cbrt(second_height)
        enhancement = _steepness_enhancement(significant_height, developed) * (1.0 + 6.0 * distance)
    primary = WaveSystem(
        significant_height=float(share * significant_height),
        peak_period=peak_period,
        peak_enhancement=float(np.clip(enhancement, 1.0, 20.0)),
    )
    secondary = WaveSystem(
        significant_height=float(second_height), peak_period=float(max(second_period, 1e-3)), peak_enhancement=1.0
    )
    return primary, secondary


def _steepness_enhancement(height: float, period: float) -> float:
    """Gamma = 35 (2 pi Hs / (g Tp²))^0.857."""
    return float(35.0 * (2.0 * np.pi * height / (STANDARD_GRAVITY * period**2)) ** 0.857)


def torsethaugen(
    frequency: FloatArray, significant_height: float, peak_period: float, peak_enhancement: float = 1.0
) -> FloatArray:
    """Double-peak spectrum of wind sea and swell, eq. (3), shape of `frequency` (Hz, >= 0), m²/Hz.

    `peak_enhancement` is there so that all spectra are called alike, and has no effect.

    Raises
    ------
    ScenarioError
        If a parameter is out of range.
    """
    total = np.zeros_like(np.asarray(frequency, dtype=np.float64))
    for system in torsethaugen_systems(significant_height, peak_period):
        total += _enhanced(
            _fourth_power, frequency, system.significant_height, system.peak_period, system.peak_enhancement
        )
    return total


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpectrumTable:
    """A spectrum given by points, linear in between and zero outside.

    Parameters
    ----------
    frequency
        Rising, shape (n,), n >= 2, Hz.
    density
        Shape (n,), m²/Hz; its integral is the variance of the elevation.

    Raises
    ------
    ScenarioError
        If the shapes differ, a number is not finite or negative, or the frequencies do not rise.
    """

    frequency: FloatArray
    density: FloatArray

    def __post_init__(self) -> None:
        for name in ("frequency", "density"):
            value = np.array(getattr(self, name), dtype=np.float64)
            if value.ndim != 1 or len(value) < 2 or not np.all(np.isfinite(value)) or np.any(value < 0.0):
                raise ScenarioError(
                    f"table of the wave spectrum: {name} must be two or more finite numbers >= 0 in one list"
                )
            value.flags.writeable = False
            object.__setattr__(self, name, value)
        if len(self.frequency) != len(self.density):
            raise ScenarioError(
                f"table of the wave spectrum: {len(self.frequency)} frequencies, but {len(self.density)} densities"
            )
        if np.any(np.diff(self.frequency) <= 0.0):
            raise ScenarioError("table of the wave spectrum: the frequencies must rise from each to the next")
        if not np.any(self.density > 0.0):
            raise ScenarioError("table of the wave spectrum: all densities are zero; significant_height = 0 is calm")

    def __call__(self, frequency: FloatArray) -> FloatArray:
        """Density at `frequency` (Hz), m²/Hz."""
        return np.asarray(np.interp(frequency, self.frequency, self.density, left=0.0, right=0.0))

    @property
    def peak_frequency(self) -> float:
        """Frequency of the largest density, Hz."""
        return float(self.frequency[np.argmax(self.density)])

    @property
    def significant_height(self) -> float:
        """Four times the standard deviation, m."""
        return float(4.0 * np.sqrt(self.density @ quadrature(self.frequency)))


SPECTRA: dict[str, SpectrumFunction] = {
    "pierson_moskowitz": pierson_moskowitz,
    "jonswap": jonswap,
    "torsethaugen": torsethaugen,
}
"""Functions of (frequency, Hs, Tp, gamma) by the name that a scenario uses; beside them it may give a table."""


def spectrum_by_name(name: str) -> SpectrumFunction:
    """Entry of `SPECTRA`.

    Raises
    ------
    ScenarioError
        If there is no such spectrum; the message names the nearest one.
    """
    if name in SPECTRA:
        return SPECTRA[name]
    nearest = difflib.get_close_matches(name.lower(), SPECTRA, n=1, cutoff=0.0)[0]
    raise ScenarioError(
        f"wave spectrum {name!r} is not known; did you mean {nearest!r}? Known: {', '.join(sorted(SPECTRA))}"
    )
