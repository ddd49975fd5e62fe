"""Aerodynamic admittance: how much of a gust a whole area feels at once.

    chi(f) = 1 / (1 + (2 f sqrt(A) / U)^(4/3))                                                       (1)
    S_ij(f) <- chi_i(f) chi_j(f) S_ij(f)                                                             (2)

Eq. (1), Davenport's (with the exponent that Vickery fitted to lattice and plate measurements), acts on the speed: a
fluctuation u at the centroid of an area A drives it as chi u does, since gusts smaller than the area do not cover
it. In the time domain chi has zero phase, and is realized within the digital filter: the vector process is fitted to
the spectra of the effective speeds, eq. (2), so that it gives them at no cost, and nothing is delayed.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.checks import entry

FloatArray = NDArray[np.float64]
Admittance = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]


def davenport(frequency: FloatArray, area: FloatArray, speed: FloatArray) -> FloatArray:
    """Admittance of eq. (1), shape (nf, n).

    Parameters
    ----------
    frequency
        Shape (nf,), Hz.
    area
        Of the segments, shape (n,), m².
    speed
        Mean wind speed at them, shape (n,), m/s.
    """
    reduced = 2.0 * frequency[:, None] * np.sqrt(area) / speed
    return np.asarray(1.0 / (1.0 + reduced ** (4.0 / 3.0)))


def _none(frequency: FloatArray, area: FloatArray, speed: FloatArray) -> FloatArray:
    """Gusts that cover the whole area: one at all frequencies."""
    return np.ones((len(frequency), len(area)))


ADMITTANCES: dict[str, Admittance] = {"none": _none, "davenport": davenport}
"""Functions of frequency (nf,), area (n,) and speed (n,) by the name that a scenario uses."""


def admittance_by_name(name: str) -> Admittance:
    """Entry of `ADMITTANCES`.

    Raises
    ------
    ScenarioError
        If there is no such admittance; the message names the nearest one.
    """
    return entry(ADMITTANCES, name, "aerodynamic admittance")
