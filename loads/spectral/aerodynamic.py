"""Wind on the segments of a platform, expanded as Fig. 2 of Li and Kareem (1990), or by Hermite's polynomials.

    F = sum_m D_m T_m (U_m + w_m) |U_m + w_m|,   w_m = u_m - v_m                                         (1)
      = sum_m D_m T_m [c0_m + c1_m w_m + c2_m (w_m² - Var w_m)]                                          (2)

The coefficients are those of Hermite's expansion for the mean U_m and the variance of the relative speed, and tend to
U² + Var, 2 U and 1, those of Fig. 2, where the wind hardly ever turns. The decompositions "expanded" and "linear" of
the wind's force (`tlpsim.loads.wind.force`) take these as they are, with the variance and the squares of the gusts
alone, and the latter without the quadratic term.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.spectral.hermite import expand_scalar
from tlpsim.loads.spectral.model import SpectralWind
from tlpsim.loads.wind.force import turned_segments

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

YAW_STEP = 1e-3
"""rad, over which the mean force is differentiated with yaw."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearWind:
    """Eq. (2) at a yaw, loads about the reference point, earth-fixed.

    Attributes
    ----------
    mean
        (6,) N, N·m.
    yaw_slope
        Change of the mean with yaw, (6,) N/rad, N·m/rad.
    on_gusts
        Loads a unit gust, (6, n).
    along
        Speed of the segments along the wind a unit rate of the platform, (n, 6).
    damping
        (6, 6) on the rates.
    on_squares, along_in_squares
        Loads a unit w² - Var w, (6, n), and `along` there; zero where the squares are those of the gusts alone.
    """

    mean: FloatArray
    yaw_slope: FloatArray
    on_gusts: FloatArray
    along: FloatArray
    damping: FloatArray
    on_squares: FloatArray
    along_in_squares: FloatArray


def _coefficients(
    wind: SpectralWind, gusts: FloatArray, relative: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """c0, c1, c2 of eq. (2), (n,) each, for the variances (n,) of the gusts and of the relative speed."""
    if wind.decomposition == "full":
        found = expand_scalar(wind.speed, np.sqrt(np.maximum(relative, 0.0)))
        return found.mean, found.linear, found.quadratic
    second_order = 1.0 if wind.decomposition == "expanded" else 0.0
    return wind.speed**2 + gusts, 2.0 * wind.speed, np.full(len(gusts), second_order)


def linear_wind(wind: SpectralWind, yaw: float, gusts: FloatArray, relative: FloatArray) -> LinearWind:
    """Expand the force at a mean yaw (rad).

    Parameters
    ----------
    gusts, relative
        Variances of the wind speed and of the relative speed at the segments, (n,) m²/s².
    """
    steady, linear, quadratic = _coefficients(wind, gusts, relative)
    factor = 0.5 * wind.air_density * wind.segments.area * wind.segments.shape_coefficient

    def mean(at: float) -> FloatArray:
        transformation, shown, _ = turned_segments(wind.segments, wind.heading, at)
        return np.asarray(transformation.T @ (factor * shown * steady))

    transformation, shown, along = turned_segments(wind.segments, wind.heading, yaw)
    drag = (factor * shown)[:, None] * transformation
    return LinearWind(
        mean=mean(yaw),
        yaw_slope=(mean(yaw + YAW_STEP) - mean(yaw - YAW_STEP)) / (2.0 * YAW_STEP),
        on_gusts=(linear[:, None] * drag).T,
        along=along,
        damping=(linear[:, None] * drag).T @ along,
        on_squares=(quadratic[:, None] * drag).T,
        along_in_squares=along if wind.decomposition == "full" else np.zeros_like(along),
    )
