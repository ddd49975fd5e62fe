"""One-sided wave elevation spectra, m²/Hz, scaled so that their integral is Hs² / 16.

    S_PM(f) = (5/16) Hs² fp^4 f^-5 exp(-(5/4) (fp / f)^4)                                            (1)
    S_J(f) = C S_PM(f) gamma^r,   r = exp(-(f/fp - 1)² / (2 s²)),   s = 0.07 (f <= fp), 0.09 (f > fp)  (2)

with C such that the integral of eq. (2) is again Hs² / 16. Sources: Pierson and Moskowitz (Journal of Geophysical
Research 69, 1964), Hasselmann et al. (JONSWAP, 1973).
"""

import difflib
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.waves.airy import require_positive

FloatArray = NDArray[np.float64]
SpectrumFunction = Callable[[FloatArray, float, float, float], FloatArray]

_QUADRATURE_POINTS = 64


def _check(significant_height: float, peak_period: float, peak_enhancement: float) -> None:
    if not (np.isfinite(significant_height) and significant_height >= 0.0):
        raise ScenarioError(f"significant wave height is {significant_height} m; it must be finite and >= 0")
    require_positive("peak period of the waves", peak_period, "s")
    if not (np.isfinite(peak_enhancement) and 1.0 <= peak_enhancement <= 20.0):
        raise ScenarioError(f"peak enhancement factor of the waves is {peak_enhancement}; it must be from 1 to 20")


def _relative_pierson_moskowitz(ratio: FloatArray) -> FloatArray:
    """Eq. (1) over Hs² / 16 as a density of f / fp."""
    positive = np.where(ratio > 0.0, ratio, 1.0)
    density = 5.0 * positive**-5.0 * np.exp(-1.25 * positive**-4.0)
    return np.where(ratio > 0.0, density, 0.0)


def _enhancement(ratio: FloatArray, peak_enhancement: float) -> FloatArray:
    width = np.where(ratio <= 1.0, 0.07, 0.09)
    result: FloatArray = peak_enhancement ** np.exp(-0.5 * ((ratio - 1.0) / width) ** 2)
    return result


def _enhanced_area(peak_enhancement: float) -> float:
    """Integral of the enhanced eq. (1) over Hs² / 16.

    One plus the integral of what the enhancement adds, which is below 1e-6 of it outside 0.5 < f / fp < 2.
    """
    nodes, weights = np.polynomial.legendre.leggauss(_QUADRATURE_POINTS)
    area = 1.0
    for low, high in ((0.5, 1.0), (1.0, 2.0)):
        ratio = low + 0.5 * (high - low) * (nodes + 1.0)
        added = _relative_pierson_moskowitz(ratio) * (_enhancement(ratio, peak_enhancement) - 1.0)
        area += 0.5 * (high - low) * float(np.sum(weights * added))
    return area


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
    ratio = np.asarray(frequency, dtype=np.float64) * peak_period
    scale = significant_height**2 / 16.0 * peak_period / _enhanced_area(peak_enhancement)
    return np.asarray(scale * _relative_pierson_moskowitz(ratio) * _enhancement(ratio, peak_enhancement))


def pierson_moskowitz(frequency: FloatArray, significant_height: float, peak_period: float) -> FloatArray:
    """Pierson-Moskowitz spectrum, eq. (1), shape of `frequency` (Hz, >= 0), m²/Hz; see `jonswap`.

    Raises
    ------
    ScenarioError
        If a parameter is out of range.
    """
    _check(significant_height, peak_period, 1.0)
    ratio = np.asarray(frequency, dtype=np.float64) * peak_period
    return np.asarray(significant_height**2 / 16.0 * peak_period * _relative_pierson_moskowitz(ratio))


def _pierson_moskowitz_entry(
    frequency: FloatArray, significant_height: float, peak_period: float, peak_enhancement: float
) -> FloatArray:
    return pierson_moskowitz(frequency, significant_height, peak_period)


SPECTRA: dict[str, SpectrumFunction] = {
    "pierson_moskowitz": _pierson_moskowitz_entry,
    "jonswap": jonswap,
}
"""Functions of (frequency, Hs, Tp, gamma) by the name that a scenario uses."""


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
