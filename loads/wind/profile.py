"""Mean wind speed over height.

U(z) = (u*/kappa) ln(z / z0),   u* = kappa U10 / ln(10 / z0)      logarithmic law              (1)
U(z) = U10 (z / 10)^alpha                                         power law                    (2)
U(z) = U10 (z / 10)^(1/8)                                         API RP 2A (20th edition)     (3)
U(z) = U10 (1 + C ln(z / 10)),   C = 0.0573 sqrt(1 + 0.15 U10)    ISO 19901-1, NORSOK N-003    (4)

U10 is the mean over one hour in (3) and (4). Eq. (4) is also that of the 21st edition of API RP 2A. Below the height
at which eq. (4) or (1) would be zero there is no wind speed to be had, and asking for it is an error.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.checks import entry, require_positive
from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]

KARMAN_CONSTANT = 0.4
REFERENCE_HEIGHT = 10.0
API_EXPONENT = 0.125


def friction_velocity(speed_10: float, roughness_length: float) -> float:
    """Friction velocity u* in m/s, eq. (1).

    Parameters
    ----------
    speed_10
        Mean wind speed at 10 m in m/s.
    roughness_length
        z0 in m, below 10 m.

    Raises
    ------
    ScenarioError
        If an argument is not positive, or z0 is not below 10 m.
    """
    require_positive("mean wind speed at 10 m", speed_10, "m/s")
    require_positive("roughness length", roughness_length, "m")
    if roughness_length >= REFERENCE_HEIGHT:
        raise ScenarioError(
            f"roughness length is {roughness_length} m; it must be below {REFERENCE_HEIGHT} m "
            "(open sea: 0.0001 to 0.01 m)"
        )
    return float(KARMAN_CONSTANT * speed_10 / np.log(REFERENCE_HEIGHT / roughness_length))


def logarithmic_speed(height: ArrayLike, speed_10: float, roughness_length: float) -> FloatArray:
    """Mean wind speed in m/s at `height` (any shape, m above mean water level), eq. (1).

    Raises
    ------
    ScenarioError
        If an argument is not positive, or a height is not above the roughness length.
    """
    heights = require_positive("height of a wind point", height, "m")
    shear = friction_velocity(speed_10, roughness_length) / KARMAN_CONSTANT
    _require_above(heights, roughness_length, "the roughness length")
    return np.asarray(shear * np.log(heights / roughness_length))


def power_law_speed(height: ArrayLike, speed_10: float, exponent: float) -> FloatArray:
    """Mean wind speed in m/s at `height` (any shape, m above mean water level), eq. (2) and, by exponent, (3).

    Raises
    ------
    ScenarioError
        If a height, the speed or the exponent is not positive.
    """
    heights = require_positive("height of a wind point", height, "m")
    require_positive("mean wind speed at 10 m", speed_10, "m/s")
    require_positive("exponent of the wind profile", exponent, "")
    return np.asarray(speed_10 * (heights / REFERENCE_HEIGHT) ** exponent)


def iso_speed(height: ArrayLike, speed_10: float) -> FloatArray:
    """Mean wind speed over one hour in m/s at `height` (any shape, m above mean water level), eq. (4).

    Raises
    ------
    ScenarioError
        If a height or the speed is not positive, or the height is so low that the formula gives no wind.
    """
    heights = require_positive("height of a wind point", height, "m")
    require_positive("mean wind speed at 10 m", speed_10, "m/s")
    slope = 0.0573 * math.sqrt(1.0 + 0.15 * speed_10)
    _require_above(heights, REFERENCE_HEIGHT * math.exp(-1.0 / slope), "the zero of the ISO profile")
    return np.asarray(speed_10 * (1.0 + slope * np.log(heights / REFERENCE_HEIGHT)))


def _require_above(heights: FloatArray, lowest: float, what: str) -> None:
    if np.any(heights <= lowest):
        raise ScenarioError(
            f"height of a wind point is {float(np.min(heights))} m; it must be above {what} {lowest:.4g} m"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """What a mean profile depends on.

    Parameters
    ----------
    name
        Key in `PROFILES`.
    speed_10
        Mean wind speed at 10 m, m/s.
    roughness_length
        z0 in m. Besides the logarithmic profile it sets the friction velocity, to which most spectra are scaled.
    exponent
        alpha of the power law.
    """

    name: str = "logarithmic"
    speed_10: float
    roughness_length: float = 0.005
    exponent: float = 0.12


PROFILES: dict[str, Callable[[ArrayLike, Profile], FloatArray]] = {
    "logarithmic": lambda height, profile: logarithmic_speed(height, profile.speed_10, profile.roughness_length),
    "power": lambda height, profile: power_law_speed(height, profile.speed_10, profile.exponent),
    "api": lambda height, profile: power_law_speed(height, profile.speed_10, API_EXPONENT),
    "iso": lambda height, profile: iso_speed(height, profile.speed_10),
}
"""Mean wind speed (any shape, m/s) as a function of height (m) and `Profile`, by the name that a scenario uses."""


def mean_speed(height: ArrayLike, profile: Profile) -> FloatArray:
    """Mean wind speed in m/s at `height` (any shape, m above mean water level).

    Raises
    ------
    ScenarioError
        If the profile is not known, or an argument is out of its range.
    """
    return entry(PROFILES, profile.name, "wind profile")(height, profile)
