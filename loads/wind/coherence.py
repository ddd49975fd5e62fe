"""Coherence of the along-wind speed between points, and cross-spectra.

    S_ij(f) = g_ij(f) sqrt(S_ii(f) S_jj(f))                                                          (1)
    Davenport   g_ij = exp(-f sqrt((Cx dx)² + (Cy dy)² + (Cz dz)²) / ((U_i + U_j) / 2))              (2)
    NPD         g_ij = exp(-sqrt(A_x² + A_y² + A_z²) / U10),                                         (3)
                A = a f^r d^q (sqrt(z_i z_j) / 10)^-p,   a: 2.9, 45, 13;  r: 0.92, 0.92, 0.85;
                q: 1, 1, 1.25;  p: 0.4, 0.4, 0.5   for x, y, z

g is the root coherence (the modulus of S_ij over the root of the product, not its square), in phase. dx is the
separation along the wind, dy the horizontal one across it, dz the vertical one. With Cx = 0, the default of eq. (2),
the points are taken as one plane across the wind. g is one at zero frequency and between coincident points, where
the cross-spectra are singular; the fit of the digital filter takes that. Two points that are fully coherent at all
frequencies though their spectra differ (no decay, or one place and two areas under an admittance) are another matter:
each is a filtering of the other that looks as far ahead as back, which no short recursive filter does. Where there
are such, root coherences between different spectra are taken as

    g_ij <- 0.99 g_ij                                                                                (4)

which turns an error of 8 dB of ARMA(3, 3) into one of 0.7 dB.

Sources: (2) A. G. Davenport, Quarterly Journal of the Royal Meteorological Society 87, 1961; (3) ISO 19901-1, API RP
2MET, NORSOK N-003. The standards speak of a squared correlation, yet eq. (3) is in use as root coherence (TurbSim,
DNV-RP-C205), and so it is here.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.checks import entry
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.wind.spectra import WindPoints

FloatArray = NDArray[np.float64]

_LARGEST_COHERENCE = 0.99
_NPD_FACTOR = np.array([2.9, 45.0, 13.0])
_NPD_FREQUENCY_POWER = np.array([0.92, 0.92, 0.85])
_NPD_DISTANCE_POWER = np.array([1.0, 1.0, 1.25])
_NPD_HEIGHT_POWER = np.array([0.4, 0.4, 0.5])


@dataclass(frozen=True, slots=True, kw_only=True)
class Decay:
    """Decay coefficients of Davenport's coherence, eq. (2).

    Parameters
    ----------
    lateral, vertical, longitudinal
        Cy, Cz and Cx: across the wind, in height, along the wind.

    Raises
    ------
    ScenarioError
        If one is negative or not finite.
    """

    lateral: float = 16.0
    vertical: float = 10.0
    longitudinal: float = 0.0

    def __post_init__(self) -> None:
        for name in ("lateral", "vertical", "longitudinal"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0.0):
                raise ScenarioError(f"{name} coherence coefficient of the wind is {value}; it must be finite and >= 0")


DEFAULT_DECAY = Decay()


def _separations(position: FloatArray, heading: float) -> FloatArray:
    """Distances between points along the wind, across it and in height, shape (3, n, n), m."""
    cosine, sine = np.cos(heading), np.sin(heading)
    turned = np.stack(
        [
            position[:, 0] * cosine + position[:, 1] * sine,
            position[:, 1] * cosine - position[:, 0] * sine,
            position[:, 2],
        ]
    )
    return np.abs(turned[:, :, None] - turned[:, None, :])


def davenport(
    frequency: FloatArray, position: FloatArray, heading: float, points: WindPoints, decay: Decay
) -> FloatArray:
    """Davenport's root coherence, eq. (2).

    Parameters
    ----------
    frequency
        Shape (nf,), Hz.
    position
        Points, shape (n, 3), m.
    heading
        Direction toward which the wind blows, rad.
    points
        Mean wind speed at the points.
    decay
        Cx, Cy, Cz.

    Returns
    -------
    Real symmetric matrices with unit diagonal, shape (nf, n, n).
    """
    factors = np.array([decay.longitudinal, decay.lateral, decay.vertical])
    weighted = factors[:, None, None] * _separations(position, heading)
    speed = 0.5 * (points.speed[:, None] + points.speed[None, :])
    decay_time = np.sqrt(np.sum(weighted**2, axis=0)) / speed
    return np.exp(-frequency[:, None, None] * decay_time)


def npd(frequency: FloatArray, position: FloatArray, heading: float, points: WindPoints, decay: Decay) -> FloatArray:
    """NPD root coherence, eq. (3); parameters and result as of `davenport`, `decay` is not used."""
    distance = _separations(position, heading)
    height = np.sqrt(points.height[:, None] * points.height[None, :]) / 10.0
    place = (
        _NPD_FACTOR[:, None, None]
        * distance ** _NPD_DISTANCE_POWER[:, None, None]
        * height[None] ** -_NPD_HEIGHT_POWER[:, None, None]
    )
    powers = frequency[:, None] ** (2.0 * _NPD_FREQUENCY_POWER)
    count = len(position)
    squared = (powers @ (place**2).reshape(3, -1)).reshape(-1, count, count)
    return np.asarray(np.exp(-np.sqrt(squared) / points.speed_10))


Coherence = Callable[[FloatArray, FloatArray, float, WindPoints, Decay], FloatArray]

COHERENCES: dict[str, Coherence] = {"davenport": davenport, "npd": npd}
"""Root coherences by the name that a scenario uses."""


def coherence_by_name(name: str) -> Coherence:
    """Entry of `COHERENCES`.

    Raises
    ------
    ScenarioError
        If there is no such model; the message names the nearest one.
    """
    return entry(COHERENCES, name, "wind coherence")


def loosened(
    density: Callable[[FloatArray], FloatArray], coherence: Callable[[FloatArray], FloatArray], nyquist: float
) -> FloatArray:
    """Factors of eq. (4) on the root coherence, shape (n, n); ones unless they are needed.

    They are 0.99 between points of different spectra and one between points of the same, a positive semi-definite
    matrix, so that the product with a coherence is one again.

    Parameters
    ----------
    density, coherence
        Functions of frequency as of `cross_spectrum`.
    nyquist
        Highest frequency of the digital filter, Hz.
    """
    spectra = density(nyquist * np.geomspace(1e-3, 1.0, 16))
    same = np.all(np.isclose(spectra[:, :, None], spectra[:, None, :], rtol=1e-9, atol=0.0), axis=0)
    coherent = coherence(np.array([nyquist]))[0] > _LARGEST_COHERENCE
    needed = bool(np.any(coherent & ~same))
    return np.where(same, 1.0, _LARGEST_COHERENCE if needed else 1.0)


def cross_spectrum(
    density: Callable[[FloatArray], FloatArray], coherence: Callable[[FloatArray], FloatArray]
) -> Callable[[FloatArray], FloatArray]:
    """Function of frequency (nf,) that gives eq. (1), shape (nf, n, n).

    Parameters
    ----------
    density
        Function of frequency that gives the spectra S_ii, shape (nf, n).
    coherence
        Function of frequency that gives the root coherence, shape (nf, n, n).
    """

    def matrix(frequency: FloatArray) -> FloatArray:
        root = np.sqrt(density(frequency))
        return coherence(frequency) * root[:, :, None] * root[:, None, :]

    return matrix
