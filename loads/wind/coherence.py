"""Coherence of the along-wind speed between points, and cross-spectra.

    coh_ij(f) = exp(-f sqrt((Cy dy)² + (Cz dz)²) / ((U_i + U_j) / 2))                               (1)
    S_ij(f) = coh_ij(f) sqrt(S_ii(f) S_jj(f))                                                       (2)

Davenport's exponential root coherence, in phase; dy is the horizontal separation across the wind, dz the vertical
one. Separation along the wind changes nothing: the points are taken as one plane across the wind.
Source: A. G. Davenport, Quarterly Journal of the Royal Meteorological Society 87, 1961.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]


def davenport(
    frequency: FloatArray,
    position: FloatArray,
    speed: FloatArray,
    heading: float,
    lateral: float = 16.0,
    vertical: float = 10.0,
) -> FloatArray:
    """Root coherence of eq. (1).

    Parameters
    ----------
    frequency
        Shape (nf,), Hz.
    position
        Points, shape (n, 3), m.
    speed
        Mean wind speed at the points, shape (n,), m/s.
    heading
        Direction toward which the wind blows, rad.
    lateral, vertical
        Decay coefficients Cy and Cz.

    Returns
    -------
    Real symmetric matrices with unit diagonal, shape (nf, n, n).

    Raises
    ------
    ScenarioError
        If a decay coefficient is negative or not finite.
    """
    for name, value in (("lateral", lateral), ("vertical", vertical)):
        if not (np.isfinite(value) and value >= 0.0):
            raise ScenarioError(f"{name} coherence coefficient of the wind is {value}; it must be finite and >= 0")
    across = position[:, 1] * np.cos(heading) - position[:, 0] * np.sin(heading)
    height = position[:, 2]
    separation = np.hypot(lateral * (across[:, None] - across[None, :]), vertical * (height[:, None] - height[None, :]))
    decay_time = separation / (0.5 * (speed[:, None] + speed[None, :]))
    return np.exp(-frequency[:, None, None] * decay_time)


def cross_spectrum(
    density: Callable[[FloatArray], FloatArray], coherence: Callable[[FloatArray], FloatArray]
) -> Callable[[FloatArray], FloatArray]:
    """Function of frequency (nf,) that gives eq. (2), shape (nf, n, n).

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
