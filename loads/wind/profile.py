"""Mean wind speed over height.

U(z) = (u*/kappa) ln(z / z0),   u* = kappa U10 / ln(10 / z0)      logarithmic law              (1)
U(z) = U10 (z / 10)^alpha                                         power law                    (2)
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]

KARMAN_CONSTANT = 0.4
REFERENCE_HEIGHT = 10.0


def require_positive(name: str, value: ArrayLike, unit: str) -> FloatArray:
    """Return `value` as an array; ScenarioError unless all of it is finite and > 0."""
    result = np.asarray(value, dtype=np.float64)
    if not (np.all(np.isfinite(result)) and np.all(result > 0.0)):
        raise ScenarioError(f"{name} is {np.array2string(result)} {unit}; it must be finite and > 0")
    return result


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
    if np.any(heights <= roughness_length):
        raise ScenarioError(
            f"height of a wind point is {float(np.min(heights))} m; it must be above the roughness length "
            f"{roughness_length} m"
        )
    return np.asarray(shear * np.log(heights / roughness_length))


def power_law_speed(height: ArrayLike, speed_10: float, exponent: float) -> FloatArray:
    """Mean wind speed in m/s at `height` (any shape, m above mean water level), eq. (2).

    Raises
    ------
    ScenarioError
        If a height, the speed or the exponent is not positive.
    """
    heights = require_positive("height of a wind point", height, "m")
    require_positive("mean wind speed at 10 m", speed_10, "m/s")
    require_positive("exponent of the wind profile", exponent, "")
    return np.asarray(speed_10 * (heights / REFERENCE_HEIGHT) ** exponent)
