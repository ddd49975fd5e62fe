"""One-sided spectra of the along-wind speed, m²/s² per Hz, and their variances.

    Kaimal   f S / u*² = 200 n / (1 + 50 n)^(5/3),   n = f z / U                  sigma² = 6 u*²      (1)
    Harris   f S / u*² = 4 x / (2 + x²)^(5/6),       x = 1800 f / U10             sigma² = 6.677 u*²  (2)
    API      f S / sigma² = (f / fp) / (1 + 1.5 f / fp)^(5/3),  fp = 0.025 U / z                      (3)
             sigma / U = 0.15 (z / 20)^-0.125 up to 20 m, 0.15 (z / 20)^-0.275 above

Sources: Kaimal et al. (Quarterly Journal of the Royal Meteorological Society 98, 1972) in the form of Simiu and
Scanlan; Harris (1971) in the form used by DNV-RP-C205; API RP 2A.
"""

import difflib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gamma

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.wind.profile import friction_velocity, logarithmic_speed

FloatArray = NDArray[np.float64]

_API_PEAK_COEFFICIENT = 0.025  # API RP 2A gives the range 0.01 to 0.1 and 0.025 for want of measurements
_API_SURFACE_LAYER = 20.0
_HARRIS_LENGTH = 1800.0


@dataclass(frozen=True, slots=True, kw_only=True)
class WindPoints:
    """What the spectra depend on, at n points.

    Parameters
    ----------
    height
        Above mean water level, shape (n,), m.
    speed
        Mean wind speed at the points, shape (n,), m/s.
    speed_10
        Mean wind speed at 10 m, m/s.
    friction_velocity
        u*, m/s.
    """

    height: FloatArray
    speed: FloatArray
    speed_10: float
    friction_velocity: float


def logarithmic_wind_points(height: FloatArray, speed_10: float, roughness_length: float) -> WindPoints:
    """Points at `height` (n,) in m in a logarithmic profile.

    Raises
    ------
    ScenarioError
        If a height, the speed or the roughness length is out of range.
    """
    heights = np.array(height, dtype=np.float64)
    speed = logarithmic_speed(heights, speed_10, roughness_length)
    heights.flags.writeable = False
    speed.flags.writeable = False
    return WindPoints(
        height=heights,
        speed=speed,
        speed_10=speed_10,
        friction_velocity=friction_velocity(speed_10, roughness_length),
    )


def kaimal(frequency: FloatArray, points: WindPoints) -> FloatArray:
    """Kaimal spectrum, eq. (1), shape (nf, n), m²/s² per Hz; `frequency` (nf,) in Hz, zero included."""
    time_scale = points.height / points.speed
    reduced = frequency[:, None] * time_scale
    result: FloatArray = 200.0 * points.friction_velocity**2 * time_scale / (1.0 + 50.0 * reduced) ** (5.0 / 3.0)
    return result


def kaimal_variance(points: WindPoints) -> FloatArray:
    """Integral of eq. (1) over all frequencies, shape (n,), m²/s²."""
    return np.full(points.height.shape, 6.0 * points.friction_velocity**2)


def harris(frequency: FloatArray, points: WindPoints) -> FloatArray:
    """Harris spectrum, eq. (2), the same at all heights, shape (nf, n), m²/s² per Hz; `frequency` (nf,) in Hz."""
    time_scale = _HARRIS_LENGTH / points.speed_10
    reduced = frequency * time_scale
    density = 4.0 * points.friction_velocity**2 * time_scale / (2.0 + reduced**2) ** (5.0 / 6.0)
    return np.tile(density[:, None], (1, len(points.height)))


def harris_variance(points: WindPoints) -> FloatArray:
    """Integral of eq. (2) over all frequencies, shape (n,), m²/s²."""
    integral = 4.0 * 2.0 ** (-1.0 / 3.0) * np.sqrt(np.pi) * gamma(1.0 / 3.0) / (2.0 * gamma(5.0 / 6.0))
    return np.full(points.height.shape, float(integral) * points.friction_velocity**2)


def api_variance(points: WindPoints) -> FloatArray:
    """Variance of the API spectrum, eq. (3), shape (n,), m²/s²."""
    exponent = np.where(points.height <= _API_SURFACE_LAYER, -0.125, -0.275)
    intensity = 0.15 * (points.height / _API_SURFACE_LAYER) ** exponent
    return np.asarray((intensity * points.speed) ** 2)


def api(frequency: FloatArray, points: WindPoints) -> FloatArray:
    """API RP 2A spectrum, eq. (3), shape (nf, n), m²/s² per Hz; `frequency` (nf,) in Hz, zero included."""
    peak = _API_PEAK_COEFFICIENT * points.speed / points.height
    shape = 1.0 / (peak * (1.0 + 1.5 * frequency[:, None] / peak) ** (5.0 / 3.0))
    result: FloatArray = api_variance(points) * shape
    return result


@dataclass(frozen=True, slots=True, kw_only=True)
class WindSpectrum:
    """A spectrum by name: its density (nf, n) at given frequencies and points, and its variance (n,)."""

    density: Callable[[FloatArray, WindPoints], FloatArray]
    variance: Callable[[WindPoints], FloatArray]


SPECTRA: dict[str, WindSpectrum] = {
    "kaimal": WindSpectrum(density=kaimal, variance=kaimal_variance),
    "harris": WindSpectrum(density=harris, variance=harris_variance),
    "api": WindSpectrum(density=api, variance=api_variance),
}
"""Wind spectra by the name that a scenario uses."""


def spectrum_by_name(name: str) -> WindSpectrum:
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
        f"wind spectrum {name!r} is not known; did you mean {nearest!r}? Known: {', '.join(sorted(SPECTRA))}"
    )
