"""Fatigue of a stationary response from its spectrum: rainflow ranges after Dirlik, and the damage-equivalent range.

With the spectral moments m_k, the integral of f^k S(f) over f (Hz^k), peaks come at the rate nu_p = sqrt(m4 / m2), and
with them as many rainflow cycles, of ranges S = 2 sqrt(m0) z of the density (Dirlik, Application of computers in
fatigue analysis, University of Warwick, 1985)

    p(z) = D1 / Q exp(-z / Q) + D2 z / R^2 exp(-z^2 / (2 R^2)) + D3 z exp(-z^2 / 2)                  (1)

    gamma = m2 / sqrt(m0 m4),     x = m1 / m0 sqrt(m2 / m4),     a = 1 - gamma - D1 + D1^2
    D1 = 2 (x - gamma^2) / (1 + gamma^2),     R = (gamma - x - D1^2) / a,     D2 = a / (1 - R)
    D3 = 1 - D1 - D2,     Q = 1.25 (gamma - D3 - D2 R) / D1 = 1.25 D1                                  (2)

so that, with the gamma function G,

    E[S^m] = (2 sqrt(m0))^m (D1 Q^m G(1 + m) + 2^(m/2) G(1 + m/2) (D2 |R|^m + D3))                    (3)
    DEL_m = (nu_p E[S^m] / 1 Hz)^(1/m)                                                                (4)

The second form of Q follows from the others and, unlike the first, holds for a narrow band too, where D1 tends to 0 and
eq. (3) to that of Rayleigh's distribution, (2 sqrt(2 m0))^m G(1 + m/2).

Eq. (3) is a fit to Gaussian records, and a response that is not Gaussian is taken as if it were. Of a tether's tension
in storms skewness and excess kurtosis are within 0.2 and 0.1, and the range g(z) - g(-z) of Winterstein's transform g
(`tlpsim.loads.spectral.extremes`) instead of 2 z changes eq. (4) by less than 0.5 %, without bringing it nearer to
rainflow counts of the time domain. Of heave, of a skewness of -0.6 to -1.3, that range makes it worse: a cycle of
waves on slow motion has the slope of g where the slow motion stands, and not its chord about the mean.

m4 of a spectrum with a slow tail depends on where the grid ends, but eq. (4) hardly does: ripples are many and small.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.spectral.extremes import spectral_moments

FloatArray = NDArray[np.float64]

_STEEPEST = 20.0
_NARROW = 1e-6  # 1 - gamma, below which the terms of eq. (2) are differences of equal numbers


def rainflow_moment(frequency: FloatArray, density: FloatArray, slope: float) -> float:
    """Expected power E[S^m] of the range of a rainflow cycle of a Gaussian response, eq. (3), unit^m.

    Parameters
    ----------
    frequency, density
        Hz, increasing, and the one-sided spectrum, unit²/Hz; shape (n,).
    slope
        m, from 1 to 20.

    Raises
    ------
    ScenarioError
        If the slope or the spectrum is out of its range.
    """
    return _rate_and_moment(frequency, density, slope)[1]


def damage_equivalent_range(frequency: FloatArray, density: FloatArray, slope: float) -> float:
    """Range whose cycles at 1 Hz do the damage of a Gaussian response, eq. (4), in its unit; 0 of a zero spectrum.

    Parameters and errors as of `rainflow_moment`.
    """
    rate, moment = _rate_and_moment(frequency, density, slope)
    return float((rate * moment) ** (1.0 / slope))


def _rate_and_moment(frequency: FloatArray, density: FloatArray, slope: float) -> tuple[float, float]:
    """Rate of cycles, Hz, and eq. (3)."""
    if not 1.0 <= slope <= _STEEPEST:
        raise ScenarioError(f"slope of the S-N curve is {slope}; it must be from 1 to {_STEEPEST:g}")
    m0, m1, m2, m4 = (float(each) for each in spectral_moments(frequency, density, (0, 1, 2, 4)))
    if not (m0 > 0.0 and m2 > 0.0):
        return 0.0, 0.0
    gamma = min(m2 / math.sqrt(m0 * m4), 1.0)
    rayleigh = 2.0 ** (0.5 * slope) * math.gamma(1.0 + 0.5 * slope)
    if 1.0 - gamma < _NARROW:
        relative = rayleigh
    else:
        d1 = 2.0 * (m1 / m0 * math.sqrt(m2 / m4) - gamma**2) / (1.0 + gamma**2)
        a = 1.0 - gamma - d1 + d1**2
        r = (gamma - m1 / m0 * math.sqrt(m2 / m4) - d1**2) / a
        d2 = a / (1.0 - r)
        exponential = d1 * (1.25 * d1) ** slope * math.gamma(1.0 + slope)
        relative = exponential + rayleigh * (d2 * abs(r) ** slope + 1.0 - d1 - d2)
    return math.sqrt(m4 / m2), (2.0 * math.sqrt(m0)) ** slope * relative
