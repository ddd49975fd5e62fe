"""One-sided spectra of the along-wind speed, m²/s² per Hz, and their variances.

With n = f z / U at the height z, where U is the mean speed there, u* the friction velocity and U10 the mean at 10 m:

    Kaimal      f S / u*² = 200 n / (1 + 50 n)^(5/3)                              sigma² = 6 u*²          (1)
    Kareem      f S / u*² = 335 n / (1 + 71 n)^(5/3)                              sigma² = 7.077 u*²      (2)
    Davenport   f S / u*² = 4 x² / (1 + x²)^(4/3),      x = 1200 f / U10          sigma² = 6 u*²          (3)
    Harris      f S / u*² = 4 x / (2 + x²)^(5/6),       x = 1800 f / U10          sigma² = 6.677 u*²      (4)
    Ochi-Shin   f S / u*² = 583 n                              n <= 0.003         sigma² = 10.12 u*²      (5)
                            420 n^0.70 / (1 + n^0.35)^11.5     n <= 0.1
                            838 n / (1 + n^0.35)^11.5          above
    Simiu-Leigh f S / u*² = a1 n + b1 n² + d1 n³               n <= nm            sigma² = 6 u*²          (6)
                            c2 + a2 n + b2 n²                  n < ns = 0.2
                            0.26 n^(-2/3)                      above
    API         f S / sigma² = (f / fp) / (1 + 1.5 f / fp)^(5/3),  fp = 0.025 U / z                       (7)
                sigma / U = 0.15 (z / 20)^-0.125 up to 20 m, 0.15 (z / 20)^-0.275 above
    NPD         S = 320 (U10 / 10)² (z / 10)^0.45 / (1 + F^m)^(5 / (3 m)),  m = 0.468                     (8)
                F = 172 f (z / 10)^(2/3) (U10 / 10)^-0.75

Sources: (1) Kaimal et al., Quarterly Journal of the Royal Meteorological Society 98, 1972, in the form of Simiu and
Scanlan; (2) Kareem, Journal of Wind Engineering and Industrial Aerodynamics 1985, for the ocean; (3) Davenport,
Quarterly Journal of the Royal Meteorological Society 87, 1961; (4) Harris, 1971, in the form used by DNV-RP-C205;
(5) Ochi and Shin, OTC 5736, 1988, from measurements over the sea; (6) Simiu and Leigh, Journal of Structural
Engineering 110, 1984, for tension leg platforms; (7) API RP 2A, 20th edition; (8) ISO 19901-1, also NORSOK N-003
(Norwegian Petroleum Directorate) and DNV-RP-C205, from the measurements on Frøya, where U10 is the mean over one
hour and the formula is meant for 1/600 to 0.5 Hz.

The coefficients of (6) follow from the slope at zero frequency, a1 = 4 beta L / z with the integral length L and
beta = sigma² / u*², from a level curve on both sides of nm, from continuity at nm and ns, and from the integral
beta. Simiu and Leigh leave L and nm to the site. Here L = 180 m, and nm = 0.146 z / L, where von Karman's spectrum
of that length has its peak, but no more than 0.1; the curve is then positive at all heights.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import beta as beta_function
from scipy.special import betainc, gamma

from tlpsim.loads.checks import entry
from tlpsim.loads.wind.profile import Profile, friction_velocity, mean_speed

FloatArray = NDArray[np.float64]

_DAVENPORT_LENGTH = 1200.0
_HARRIS_LENGTH = 1800.0
_OCHI_SHIN_BREAKS = (0.003, 0.1)
_SIMIU_LEIGH_VARIANCE = 6.0  # beta, over u*²
_SIMIU_LEIGH_LENGTH = 180.0
_SIMIU_LEIGH_PEAK = 0.146
_SIMIU_LEIGH_LARGEST_PEAK = 0.1
_SIMIU_LEIGH_INERTIAL = 0.2  # ns, where the inertial subrange begins
_API_PEAK_COEFFICIENT = 0.025  # API RP 2A gives the range 0.01 to 0.1 and 0.025 for want of measurements
_API_SURFACE_LAYER = 20.0
_NPD_EXPONENT = 0.468


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


def wind_points(height: FloatArray, profile: Profile) -> WindPoints:
    """Points at `height` (n,) in m in a mean profile; u* is that of its speed at 10 m and its roughness length.

    Raises
    ------
    ScenarioError
        If a height or a parameter of the profile is out of range.
    """
    heights = np.array(height, dtype=np.float64)
    speed = mean_speed(heights, profile)
    heights.flags.writeable = False
    speed.flags.writeable = False
    return WindPoints(
        height=heights,
        speed=speed,
        speed_10=profile.speed_10,
        friction_velocity=friction_velocity(profile.speed_10, profile.roughness_length),
    )


# Each density: frequency (nf,) in Hz, zero included -> (nf, n) in m²/s² per Hz; each variance: (n,) in m²/s², the
# integral of the density over all frequencies. Written so that nothing is divided by the frequency.


def kaimal(frequency: FloatArray, points: WindPoints) -> FloatArray:
    """Kaimal spectrum, eq. (1), shape (nf, n)."""
    return _rational(frequency, points, 200.0, 50.0)


def kareem(frequency: FloatArray, points: WindPoints) -> FloatArray:
    """Kareem's spectrum for the ocean, eq. (2), shape (nf, n)."""
    return _rational(frequency, points, 335.0, 71.0)


def _rational(frequency: FloatArray, points: WindPoints, numerator: float, denominator: float) -> FloatArray:
    time_scale = points.height / points.speed
    reduced = frequency[:, None] * time_scale
    scale = numerator * points.friction_velocity**2 * time_scale
    return np.asarray(scale / (1.0 + denominator * reduced) ** (5.0 / 3.0))


def davenport(frequency: FloatArray, points: WindPoints) -> FloatArray:
    """Davenport's spectrum, eq. (3), the same at all heights and zero at zero frequency, shape (nf, n)."""
    time_scale = _DAVENPORT_LENGTH / points.speed_10
    reduced = frequency * time_scale
    density = 4.0 * points.friction_velocity**2 * time_scale * reduced / (1.0 + reduced**2) ** (4.0 / 3.0)
    return _at_all_points(density, points)


def harris(frequency: FloatArray, points: WindPoints) -> FloatArray:
    """Harris spectrum, eq. (4), the same at all heights, shape (nf, n)."""
    time_scale = _HARRIS_LENGTH / points.speed_10
    reduced = frequency * time_scale
    density = 4.0 * points.friction_velocity**2 * time_scale / (2.0 + reduced**2) ** (5.0 / 6.0)
    return _at_all_points(density, points)


def _at_all_points(density: FloatArray, points: WindPoints) -> FloatArray:
    return np.tile(density[:, None], (1, len(points.height)))


def ochi_shin(frequency: FloatArray, points: WindPoints) -> FloatArray:
    """Ochi and Shin's spectrum, eq. (5), shape (nf, n)."""
    time_scale = points.height / points.speed
    reduced = frequency[:, None] * time_scale
    low, high = _OCHI_SHIN_BREAKS
    # f S / u*² over n; below the first break that is constant, so the power of n never meets zero.
    inside = np.maximum(reduced, low)
    decay = (1.0 + inside**0.35) ** -11.5
    over_reduced = np.where(
        reduced <= low, 583.0, np.where(reduced <= high, 420.0 * inside**-0.30 * decay, 838.0 * decay)
    )
    return np.asarray(points.friction_velocity**2 * time_scale * over_reduced)


def _ochi_shin_integral() -> float:
    """Integral of eq. (5) over ln n: with w = n^0.35 its parts are incomplete beta functions of w / (1 + w)."""
    low, high = _OCHI_SHIN_BREAKS
    at_low, at_high = (n**0.35 / (1.0 + n**0.35) for n in (low, high))
    middle = 420.0 / 0.35 * beta_function(2.0, 9.5) * (betainc(2.0, 9.5, at_high) - betainc(2.0, 9.5, at_low))
    power = 1.0 / 0.35
    above = 838.0 / 0.35 * beta_function(power, 11.5 - power) * (1.0 - betainc(power, 11.5 - power, at_high))
    return float(583.0 * low + middle + above)


@dataclass(frozen=True, slots=True, kw_only=True)
class SimiuLeighCoefficients:
    """Coefficients of eq. (6) at n points, and where its parts meet; each of shape (n,)."""

    a1: FloatArray
    b1: FloatArray
    d1: FloatArray
    c2: FloatArray
    a2: FloatArray
    b2: FloatArray
    peak: FloatArray
    inertial: float


def simiu_leigh_coefficients(height: FloatArray) -> SimiuLeighCoefficients:
    """Coefficients of eq. (6) at `height` (n,), m."""
    beta, inertial = _SIMIU_LEIGH_VARIANCE, _SIMIU_LEIGH_INERTIAL
    peak = np.minimum(_SIMIU_LEIGH_PEAK * height / _SIMIU_LEIGH_LENGTH, _SIMIU_LEIGH_LARGEST_PEAK)
    a1 = 4.0 * beta * _SIMIU_LEIGH_LENGTH / height
    start = 0.26 * inertial ** (-2.0 / 3.0)
    logarithm = np.log(inertial / peak)
    missing = a1 * peak / 3.0 + (7.0 / 3.0 + logarithm) * start - beta
    weight = (
        5.0 / 6.0 * (peak - inertial) ** 2
        + 0.5 * (peak**2 - inertial**2)
        + 2.0 * peak * (inertial - peak)
        + inertial * (inertial - 2.0 * peak) * logarithm
    )
    b2 = missing / weight
    a2 = -2.0 * b2 * peak
    d1 = 2.0 / peak**3 * (0.5 * a1 * peak - start + b2 * (peak - inertial) ** 2)
    return SimiuLeighCoefficients(
        a1=a1,
        b1=-0.5 * a1 / peak - 1.5 * peak * d1,
        d1=d1,
        c2=start - a2 * inertial - b2 * inertial**2,
        a2=a2,
        b2=b2,
        peak=peak,
        inertial=inertial,
    )


def simiu_leigh(frequency: FloatArray, points: WindPoints) -> FloatArray:
    """Simiu and Leigh's spectrum, eq. (6), shape (nf, n)."""
    c = simiu_leigh_coefficients(points.height)
    time_scale = points.height / points.speed
    reduced = frequency[:, None] * time_scale
    at_least = np.maximum(reduced, c.peak)
    over_reduced = np.where(
        reduced <= c.peak,
        c.a1 + c.b1 * reduced + c.d1 * reduced**2,
        np.where(reduced < c.inertial, c.c2 / at_least + c.a2 + c.b2 * at_least, 0.26 * at_least ** (-5.0 / 3.0)),
    )
    return np.asarray(points.friction_velocity**2 * time_scale * over_reduced)


def api(frequency: FloatArray, points: WindPoints) -> FloatArray:
    """API RP 2A spectrum, eq. (7), shape (nf, n)."""
    peak = _API_PEAK_COEFFICIENT * points.speed / points.height
    shape = 1.0 / (peak * (1.0 + 1.5 * frequency[:, None] / peak) ** (5.0 / 3.0))
    return np.asarray(api_variance(points) * shape)


def api_variance(points: WindPoints) -> FloatArray:
    """Variance of the API spectrum, eq. (7), shape (n,)."""
    exponent = np.where(points.height <= _API_SURFACE_LAYER, -0.125, -0.275)
    intensity = 0.15 * (points.height / _API_SURFACE_LAYER) ** exponent
    return np.asarray((intensity * points.speed) ** 2)


def _npd_scales(points: WindPoints) -> tuple[FloatArray, FloatArray]:
    """Density at zero frequency and time scale F / f of eq. (8), (n,) each."""
    height, speed = points.height / 10.0, points.speed_10 / 10.0
    return 320.0 * speed**2 * height**0.45, 172.0 * height ** (2.0 / 3.0) * speed**-0.75


def npd(frequency: FloatArray, points: WindPoints) -> FloatArray:
    """NPD spectrum of ISO 19901-1, eq. (8), shape (nf, n)."""
    density, time_scale = _npd_scales(points)
    reduced = (frequency[:, None] * time_scale) ** _NPD_EXPONENT
    return np.asarray(density / (1.0 + reduced) ** (5.0 / (3.0 * _NPD_EXPONENT)))


def npd_variance(points: WindPoints) -> FloatArray:
    """Variance of eq. (8) over all frequencies, also beyond the band it is meant for, shape (n,)."""
    density, time_scale = _npd_scales(points)
    integral = beta_function(1.0 / _NPD_EXPONENT, 2.0 / (3.0 * _NPD_EXPONENT)) / _NPD_EXPONENT
    return np.asarray(density / time_scale * integral)


@dataclass(frozen=True, slots=True, kw_only=True)
class WindSpectrum:
    """A spectrum by name: its density (nf, n) at given frequencies and points, and its variance (n,)."""

    density: Callable[[FloatArray, WindPoints], FloatArray]
    variance: Callable[[WindPoints], FloatArray]


def _friction_scaled(density: Callable[[FloatArray, WindPoints], FloatArray], integral: float) -> WindSpectrum:
    """A spectrum whose variance is the same multiple of u*² everywhere."""
    return WindSpectrum(
        density=density, variance=lambda points: np.full(points.height.shape, integral * points.friction_velocity**2)
    )


_HARRIS_INTEGRAL = 4.0 * 2.0 ** (-1.0 / 3.0) * math.sqrt(math.pi) * gamma(1.0 / 3.0) / (2.0 * gamma(5.0 / 6.0))

SPECTRA: dict[str, WindSpectrum] = {
    "kaimal": _friction_scaled(kaimal, 1.5 * 200.0 / 50.0),
    "kareem": _friction_scaled(kareem, 1.5 * 335.0 / 71.0),
    "davenport": _friction_scaled(davenport, 6.0),
    "harris": _friction_scaled(harris, float(_HARRIS_INTEGRAL)),
    "ochi_shin": _friction_scaled(ochi_shin, _ochi_shin_integral()),
    "simiu_leigh": _friction_scaled(simiu_leigh, _SIMIU_LEIGH_VARIANCE),
    "api": WindSpectrum(density=api, variance=api_variance),
    "npd": WindSpectrum(density=npd, variance=npd_variance),
}
"""Wind spectra by the name that a scenario uses."""


def spectrum_by_name(name: str) -> WindSpectrum:
    """Entry of `SPECTRA`.

    Raises
    ------
    ScenarioError
        If there is no such spectrum; the message names the nearest one.
    """
    return entry(SPECTRA, name, "wind spectrum")
