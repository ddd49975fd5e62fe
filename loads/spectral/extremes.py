"""Rates of crossing and extremes of a stationary response, from its spectrum, skewness and kurtosis.

With the spectral moments m_k, the integral of f^k S(f) over f (Hz^k), zero up-crossings and peaks come at the rates
sqrt(m2 / m0) and sqrt(m4 / m2), and up-crossings of a Gaussian response of a level a above its mean at (Rice, Bell
System Technical Journal 23-24, 1944-45)

    nu(a) = sqrt(m2 / m0) exp(-a^2 / (2 m0))                                                         (1)

A response that is not Gaussian is a function of a Gaussian one u of unit variance (Hermite moment model: Winterstein,
Journal of Engineering Mechanics 114, 1988; Winterstein, Ude and Kleiven, BOSS 1994),

    x = mean + sigma g(u),      g(u) = h1 u + h2 (u^2 - 1) + h3 (u^3 - 3u)                           (2)

with h1, h2, h3 such that g has the variance 1, the skewness and the excess kurtosis

    h1^2 + 2 h2^2 + 6 h3^2 = 1
    6 h1^2 h2 + 8 h2^3 + 36 h1 h2 h3 + 108 h2 h3^2 = skewness
    24 h1^3 h3 + 48 h1^2 h2^2 + 48 h2^4 + 216 h1^2 h3^2 + 576 h1 h2^2 h3 + 1296 h1 h3^3
        + 2160 h2^2 h3^2 + 3240 h3^4 = excess kurtosis                                               (3)

Winterstein (1988) solves eq. (3) to first order, which counts the kurtosis that comes with the skewness twice: for a
gamma distribution of skewness 1.4 his level at u = 4.5 is 36 % high, and that at -3.5 almost three times too far. His
fit of 1994 mends that, and solving eq. (3) itself gives almost the same levels, 1 % high and 9 % near.

g rises everywhere where h2^2 <= 3 h3 (h1 - 3 h3). Elsewhere it turns, on one side as a rule: quadratic responses to
one wave group have a bound on that side too. There x is held at the turning value, until g passes it again:

    x = max of g over [0, u] for u >= 0, min of g over [u, 0] for u < 0                              (4)

Since the rate of zero crossings of x is sqrt(E g'^2) times that of u,

    nu_u = sqrt(m2 / m0) / sqrt(h1^2 + 4 h2^2 + 18 h3^2)                                             (5)

and the largest u in a duration T has the distribution function

    F(u) = Phi(u) exp(-nu_u T q exp(-max(u, 0)^2 / 2)),   q = 1 - exp(-sqrt(2 pi) delta^1.2 max(u, 1))   (6)

with Phi that of the start, so that short durations tend to the distribution of x itself. q is Vanmarcke's share of
crossings that begin a clump of the band width delta = sqrt(1 - m1^2 / (m0 m2)) (Journal of Applied Mechanics 42, 1975;
below u = 1, where it has no meaning, held): large waves of a lightly damped motion come in groups, and with q = 1
(Poisson) their extremes are too large. Long durations of q = 1 tend to the expected maximum of Davenport (1964) and of
Cartwright and Longuet-Higgins (1956), sqrt(2 ln nu T) + 0.5772 / sqrt(2 ln nu T).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr

from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]

# Of u, for eq. (6). Beyond 12, exp(-u^2 / 2) is 5e-32.
_GRID = np.linspace(-8.0, 12.0, 4001)
_GRID_MIDDLE = 0.5 * (_GRID[1:] + _GRID[:-1])
_GRID_NORMAL = ndtr(_GRID)
# Of the way from a Gaussian response to the given skewness and kurtosis, for the solution of eq. (3).
_FIRST_STEP, _SMALLEST_STEP = 0.25, 1e-4
_NEWTON_STEPS, _TOLERANCE = 8, 1e-11


def spectral_moments(frequency: FloatArray, density: FloatArray, orders: Sequence[int]) -> FloatArray:
    """Spectral moments by the trapezoidal rule, unit² Hz^k.

    Parameters
    ----------
    frequency, density
        Hz, increasing, and the one-sided spectrum, unit²/Hz, >= 0; shape (n,).
    orders
        Every k. Those of 2 and above depend on where a spectrum with a slow tail is cut off: the fourth of a
        wave spectrum, as f^-5, has no limit.

    Raises
    ------
    ScenarioError
        If the shapes differ, frequencies do not increase from 0 or above, or a density is negative or not finite.
    """
    if frequency.ndim != 1 or frequency.shape != density.shape:
        raise ScenarioError(f"frequencies are {frequency.shape} and densities {density.shape}; both must be (n,)")
    if np.any(frequency[:1] < 0.0) or not np.all(np.diff(frequency) > 0.0):
        raise ScenarioError("frequencies of a spectrum must be >= 0 and increase")
    if not (np.all(np.isfinite(density)) and np.all(density >= 0.0)):
        raise ScenarioError(f"densities of a spectrum are from {density.min()} on; they must be finite and >= 0")
    return np.array([np.trapezoid(frequency**order * density, frequency) for order in orders])


def _ratio(numerator: float, denominator: float) -> float:
    return numerator / denominator if denominator > 0.0 else 0.0


def zero_crossing_rate(frequency: FloatArray, density: FloatArray) -> float:
    """Rate of up-crossings of the mean by a Gaussian response, Hz; 0 of a zero spectrum. Errors as of the moments."""
    m0, m2 = spectral_moments(frequency, density, (0, 2))
    return math.sqrt(_ratio(m2, m0))


def peak_rate(frequency: FloatArray, density: FloatArray) -> float:
    """Rate of maxima of a Gaussian response, Hz; 0 of a spectrum of zero. Errors as of the moments."""
    m2, m4 = spectral_moments(frequency, density, (2, 4))
    return math.sqrt(_ratio(m4, m2))


def vanmarcke_bandwidth(frequency: FloatArray, density: FloatArray) -> float:
    """Spread of the spectrum about its mean frequency, delta = √(1 − m1² / (m0 m2)): 0 of one line, 1 at most.

    Of a spectrum of zero it is 0. Errors as of the moments. Source: Vanmarcke (1975).
    """
    m0, m1, m2 = spectral_moments(frequency, density, (0, 1, 2))
    return math.sqrt(max(1.0 - m1 * m1 / (m0 * m2), 0.0)) if m0 * m2 > 0.0 else 0.0


def spectral_width(frequency: FloatArray, density: FloatArray) -> float:
    """Width √(1 − m2² / (m0 m4)): 0 if every maximum follows a zero crossing, 1 if infinitely many ripple it.

    Of a spectrum of zero it is 0. Errors as of the moments. Source: Cartwright and Longuet-Higgins (1956).
    """
    m0, m2, m4 = spectral_moments(frequency, density, (0, 2, 4))
    return math.sqrt(max(1.0 - m2 * m2 / (m0 * m4), 0.0)) if m0 * m4 > 0.0 else 0.0


def crossing_rate(frequency: FloatArray, density: FloatArray, level: float) -> float:
    """Rate of up-crossings of a level above the mean by a Gaussian response, eq. (1), Hz. Errors as of the moments."""
    m0, m2 = spectral_moments(frequency, density, (0, 2))
    return math.sqrt(_ratio(m2, m0)) * math.exp(-0.5 * level**2 / m0) if m0 > 0.0 else 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class HermiteModel:
    """A response of mean 0 and variance 1 as a cubic of a standard normal variable, eq. (2).

    Attributes
    ----------
    linear, quadratic, cubic
        h1, h2, h3.
    turning
        Where the cubic turns for |u| < 12, in increasing order; none where it rises throughout.
    attained
        Part of the given skewness that the model has; of the excess kurtosis it has the square of this part. 1 but
        for shapes that no such cubic has.
    """

    linear: float
    quadratic: float
    cubic: float
    turning: tuple[float, ...]
    attained: float


def _shape(h: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Left-hand sides of eq. (3), (3, n), and their derivatives, (3, 3, n), of n cubics h (3, n)."""
    a, b, c = h
    aa, bb, cc, ab, ac, bc = a * a, b * b, c * c, a * b, a * c, b * c
    values = [
        aa + 2.0 * bb + 6.0 * cc,
        (6.0 * aa + 8.0 * bb + 36.0 * ac + 108.0 * cc) * b,
        (24.0 * ac + 48.0 * bb + 216.0 * cc) * aa
        + (48.0 * bb + 576.0 * ac + 2160.0 * cc) * bb
        + (1296.0 * ac + 3240.0 * cc) * cc,
    ]
    derivatives = [
        [2.0 * a, 4.0 * b, 12.0 * c],
        [12.0 * ab + 36.0 * bc, 6.0 * aa + 24.0 * bb + 36.0 * ac + 108.0 * cc, 36.0 * ab + 216.0 * bc],
        [
            (72.0 * ac + 96.0 * bb + 432.0 * cc) * a + (576.0 * bb + 1296.0 * cc) * c,
            (96.0 * aa + 192.0 * bb + 1152.0 * ac + 4320.0 * cc) * b,
            (24.0 * aa + 432.0 * ac + 576.0 * bb + 3888.0 * cc) * a + (4320.0 * bb + 12960.0 * cc) * c,
        ],
    ]
    return np.array(values), np.array(derivatives)


def _newton(h: FloatArray, target: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Solutions of eq. (3) from near ones, (3, n), and which of them were found, (n,)."""
    found = np.zeros(h.shape[1], dtype=np.bool_)
    for _ in range(_NEWTON_STEPS):
        value, derivative = _shape(h)
        gap = value - target
        found = np.max(np.abs(gap), axis=0) < _TOLERANCE
        if found.all():
            break
        matrices, gaps = derivative.transpose(2, 0, 1), gap.T[:, :, np.newaxis]
        try:
            change = np.linalg.solve(matrices, gaps)
        except np.linalg.LinAlgError:  # one singular matrix would leave the others without an answer
            change = np.linalg.pinv(matrices) @ gaps
        h = np.where(found, h, h - change[:, :, 0].T)
    return h, found


def _turning(a: float, b: float, c: float) -> tuple[float, ...]:
    """Roots of g' = 3 c u² + 2 b u + a - 3 c within the grid, c = 0 included."""
    discriminant = b**2 - 3.0 * c * (a - 3.0 * c)
    if discriminant <= 0.0:
        return ()
    half = -(b + math.copysign(math.sqrt(discriminant), b))  # without cancellation
    within = max(-_GRID[0], _GRID[-1])
    ratios = ((half, 3.0 * c), (a - 3.0 * c, half))
    return tuple(sorted(top / bottom for top, bottom in ratios if abs(top) < within * abs(bottom)))


def hermite_coefficients(skewness: FloatArray, excess_kurtosis: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Coefficients h1, h2, h3 of n Hermite moment models, (3, n), and the part of each that is attained, (n,).

    As `hermite_model`, of skewnesses and excess kurtoses (n,), which are taken as they are.
    """
    count = len(skewness)
    h = np.repeat([[1.0], [0.0], [0.0]], count, axis=1)
    part, step = np.zeros(count), np.full(count, _FIRST_STEP)
    active = np.arange(count)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        while len(active):
            trial = np.minimum(part[active] + step[active], 1.0)
            target = np.stack([np.ones(len(active)), trial * skewness[active], trial**2 * excess_kurtosis[active]])
            tried, found = _newton(h[:, active], target)
            h[:, active[found]], part[active[found]] = tried[:, found], trial[found]
            step[active[~found]] *= 0.5
            active = active[(part[active] < 1.0) & (step[active] > _SMALLEST_STEP)]
    return h, part


@lru_cache(maxsize=256)  # tethers that are alike have the same, and linear quantities zero
def hermite_model(skewness: float, excess_kurtosis: float) -> HermiteModel:
    """Hermite moment model of a skewness and an excess kurtosis, eq. (3).

    Followed from the Gaussian response on along skewness s t and excess kurtosis k t², 0 <= t <= 1, those of the sum
    of 1 / t² independent responses. Cubics end near an excess kurtosis of 1.59 s² − 1.15; beyond, the model is the last
    one on that way, and `attained` says how far it is. Quadratic functions of normal variables are inside, but for
    0.05 % next to chi-square of one degree of freedom.

    Raises
    ------
    ScenarioError
        If the values are not finite, or no distribution has them, of any kind: k < s² − 2.
    """
    if not (math.isfinite(skewness) and math.isfinite(excess_kurtosis) and excess_kurtosis >= skewness**2 - 2.0 - 1e-9):
        raise ScenarioError(
            f"skewness is {skewness} and excess kurtosis {excess_kurtosis}; they must be finite, and the latter at "
            f"least skewness² - 2, as of every distribution"
        )
    h, part = hermite_coefficients(np.array([skewness]), np.array([excess_kurtosis]))
    a, b, c = (float(value) for value in h[:, 0])
    return HermiteModel(linear=a, quadratic=b, cubic=c, turning=_turning(a, b, c), attained=float(part[0]))


def hermite_transform(model: HermiteModel, variable: ArrayLike) -> FloatArray:
    """Response in standard deviations from its mean, by the standard normal variable of any shape, eq. (4)."""
    u = np.asarray(variable, dtype=np.float64)

    def cubic(at: FloatArray) -> FloatArray:
        slope = model.linear - 3.0 * model.cubic + at * (model.quadratic + model.cubic * at)
        return at * slope - model.quadratic

    own = cubic(u)
    highest, lowest = np.maximum(own, -model.quadratic), np.minimum(own, -model.quadratic)
    for turn in model.turning:
        value = cubic(np.asarray(turn))
        highest = np.where(u > turn, np.maximum(highest, value), highest) if turn > 0.0 else highest
        lowest = np.where(u < turn, np.minimum(lowest, value), lowest) if turn < 0.0 else lowest
    return np.where(u >= 0.0, highest, lowest)


@dataclass(frozen=True, slots=True, kw_only=True)
class Extremes:
    """Extremes of a response in a duration, in its unit.

    Attributes
    ----------
    maximum, minimum
        Expected values of the largest and the smallest value.
    most_probable_maximum, most_probable_minimum
        Levels that are passed once on average (by clumps, if these are told apart), near the mode of the extreme. The
        median of the response where not even its middle is passed once.
    fractile_maximum, fractile_minimum
        Levels that the largest and the smallest value stay within with the given probability.
    attained
        Part of the given skewness that the model has, see `HermiteModel`; 1 as a rule.
    """

    maximum: float
    minimum: float
    most_probable_maximum: float
    most_probable_minimum: float
    fractile_maximum: float
    fractile_minimum: float
    attained: float


def clump_count(variable: FloatArray, crossings: ArrayLike, bandwidth: ArrayLike) -> FloatArray:
    """Expected number of clumps of up-crossings of levels of u, nu_u T q exp(-max(u, 0)² / 2) of eq. (6).

    Parameters
    ----------
    variable
        u, of any shape; the others must broadcast with it.
    crossings
        nu_u T, expected up-crossings of u = 0.
    bandwidth
        delta; infinite without clumping.
    """
    exponent = math.sqrt(2.0 * math.pi) * np.asarray(bandwidth, dtype=np.float64) ** 1.2
    count = np.asarray(crossings, dtype=np.float64) * np.exp(-0.5 * np.maximum(variable, 0.0) ** 2)
    return np.asarray(-count * np.expm1(-exponent * np.maximum(variable, 1.0)))


def expected_extremes(
    mean: float,
    frequency: FloatArray,
    density: FloatArray,
    skewness: float,
    excess_kurtosis: float,
    duration: float,
    *,
    probability: float = 0.9,
    clumping: bool = True,
) -> Extremes:
    """Extremes of a stationary response in a duration, eqs. (2) to (6).

    Parameters
    ----------
    mean
        Of the response, in its unit.
    frequency, density
        Hz, increasing, and the one-sided spectrum, unit²/Hz; shape (n,).
    skewness, excess_kurtosis
        Both 0 of a Gaussian response. The minimum is the maximum of the response turned round, of skewness −s.
    duration
        s, >= 0. In a very short one, or without variance, maximum and minimum are the mean.
    probability
        Of the fractiles, between 0 and 1.
    clumping
        Whether crossings come in clumps (Vanmarcke) or independently (Poisson), as in Davenport's formula.

    Raises
    ------
    ScenarioError
        If the duration, probability, spectrum, skewness or kurtosis is out of its range.
    """
    if not (math.isfinite(duration) and duration >= 0.0):
        raise ScenarioError(f"duration of the extremes is {duration} s; it must be finite and >= 0")
    if not 0.0 < probability < 1.0:
        raise ScenarioError(f"probability of the fractile of extremes is {probability}; it must be between 0 and 1")
    model = hermite_model(skewness, excess_kurtosis)
    slope = math.sqrt(model.linear**2 + 4.0 * model.quadratic**2 + 18.0 * model.cubic**2)
    deviation = math.sqrt(spectral_moments(frequency, density, (0,))[0])
    crossings = duration * zero_crossing_rate(frequency, density) / slope
    count = clump_count(_GRID, crossings, vanmarcke_bandwidth(frequency, density) if clumping else math.inf)
    distribution = _GRID_NORMAL * np.exp(-count)
    weight = np.diff(distribution)
    above = _GRID > 0.0
    once = float(np.interp(-1.0, -count[above], _GRID[above])) if count[above][0] > 1.0 else 0.0
    fractile = float(np.interp(probability, distribution, _GRID))

    def levels(side: float) -> tuple[float, float, float]:
        """Expected, most probable and fractile extreme of the side +1 or -1."""
        expected = float(weight @ hermite_transform(model, side * _GRID_MIDDLE))
        probable, bound = hermite_transform(model, side * np.array([once, fractile]))
        return mean + deviation * expected, mean + deviation * float(probable), mean + deviation * float(bound)

    maximum, most_probable_maximum, fractile_maximum = levels(1.0)
    minimum, most_probable_minimum, fractile_minimum = levels(-1.0)
    return Extremes(
        maximum=maximum,
        minimum=minimum,
        most_probable_maximum=most_probable_maximum,
        most_probable_minimum=most_probable_minimum,
        fractile_maximum=fractile_maximum,
        fractile_minimum=fractile_minimum,
        attained=model.attained,
    )
