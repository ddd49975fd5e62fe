"""Hermite expansion of quadratic drag F(V) = |V| V of a Gaussian velocity, and of its product with the elevation.

V = U + v with v ~ N(0, S) in one, two or three dimensions. With all coefficients symmetric in all of their indices,

    F_i = c0_i + C1_ij v_j + C2_ijk (v_j v_k - S_jk) + C3_ijkl He3_jkl(v) + ...                         (1)
    c0 = E F,   C1 = E dF/dV,   C2 = E d2F/dV2 / 2,   C3 = E d3F/dV3 / 6

Terms of different degree are uncorrelated, and the first three leave the least mean square error of any quadratic
polynomial (Li and Kareem 1990). Drag has a potential, F = grad |V|^3 / 3, hence

    c0 = P',   C1 = P'',   C2 = P''' / 2,   C3 = P'''' / 6,   P(U) = E |V|^3 / 3, a prime for d/dU        (2)

The power is a sum of Gaussians, whose expectation is a product over the principal axes of S, of variances s_i:

    |V|^3 / 3 = (4 sqrt(pi))^-1 int_0^inf (exp(-t |V|^2) - 1 + t |V|^2) t^(-5/2) dt                     (3)
    G(t) = E exp(-t |V|^2) = prod_i (1 + 2 t s_i)^(-1/2) exp(-a_i U_i^2),   a_i = t / (1 + 2 t s_i)     (4)

So every coefficient is one integral over t of powers of a_i and U_i times G, in any dimension. The kink of F at V = 0
is gone: the integrand is smooth whatever the anisotropy, and a variance of zero is no exception. The substitution

    t = exp(x + exp(x - b) - exp(-1 - x)),   (|U|^2 + greatest s = 1)                                   (5)

has the scales of t, from 1 to exp(b), evenly in x, and falls off double exponentially outside of them, where the
trapezoidal rule converges exponentially: a step of 0.25 leaves an error of some 1e-13.

In the splash zone drag acts on a length that varies with the elevation e. With r = Cov(v, e), by Stein's lemma,

    e F_i = C1_ij r_j  +  c0_i e + 2 C2_ijk r_k v_j
            +  C1_ij (e v_j - r_j) + 3 C3_ijkl r_l (v_j v_k - S_jk)  +  terms of third degree           (6)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations_with_replacement, product

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]

_STEP = 0.25  # in x of eq. (5)
_TAIL = np.log(2.0 * np.log(1e18))  # past the scales of t, where t^(-1/2) has fallen to 1e-18
_GONE = 80.0  # exponent of eq. (4) past which G no longer counts
_LEAST_VARIANCE = 1e-22  # relative to |U|^2 + greatest variance, of an axis whose U^2 is less
_ROUNDING = 1e-10  # of a covariance, relative to its greatest entry: asymmetry, negative variances


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Expansion:
    """Coefficients of eq. (1) of s elements in d dimensions, for a force |V| V without a factor.

    Attributes
    ----------
    mean
        c0, shape (s, d), m²/s².
    linear
        C1, shape (s, d, d), m/s.
    quadratic
        C2, shape (s, d, d, d), of v_j v_k - S_jk, dimensionless.
    cubic
        C3, shape (s, d, d, d, d), of the Hermite polynomial of third degree, s/m.
    """

    mean: FloatArray
    linear: FloatArray
    quadratic: FloatArray
    cubic: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SplashExpansion:
    """Coefficients of eq. (6) of s elements in d dimensions, for a force e |V| V without a factor.

    Attributes
    ----------
    mean
        Shape (s, d), m³/s².
    elevation
        Of e, shape (s, d), m²/s².
    velocity
        Of v_j, shape (s, d, d), m²/s.
    product
        Of e v_j - E[e v_j], shape (s, d, d), m/s.
    quadratic
        Of v_j v_k - S_jk, shape (s, d, d, d), m.
    """

    mean: FloatArray
    elevation: FloatArray
    velocity: FloatArray
    product: FloatArray
    quadratic: FloatArray


def expand(mean: ArrayLike, covariance: ArrayLike) -> Expansion:
    """Hermite expansion of |V| V of a Gaussian velocity, eq. (1), to some 1e-13.

    The covariance may be singular, zero included. A direction in which the velocity neither varies nor has a mean is
    given a spread of 1e-11 of the whole: its cubic coefficients are then finite, while they multiply zero.

    Parameters
    ----------
    mean
        U, shape (s, d) with d = 1, 2 or 3, m/s.
    covariance
        S, shape (s, d, d), m²/s².

    Raises
    ------
    ScenarioError
        If shapes do not fit, a value is not finite, or a covariance is not symmetric or has a negative eigenvalue
        (beyond rounding, 1e-10 of the greatest).
    """
    mean, covariance = _velocity(mean, covariance)
    variance, axes = np.linalg.eigh(covariance)
    floor = -_ROUNDING * np.abs(variance).max(axis=1, initial=0.0)
    if np.any(bad := variance[:, 0] < floor):
        at = int(np.argmax(bad))
        raise ScenarioError(
            f"covariance of the velocity at element {at} has the eigenvalue {variance[at, 0]:.6g} m²/s², the greatest "
            f"being {variance[at, -1]:.6g}; it must be >= 0, so compute the entries from one set of spectra"
        )
    scale = np.sum(mean**2, axis=1) + variance[:, -1]  # m²/s²
    unit = np.where(scale > 0.0, scale, 1.0)
    along = np.einsum("sia,si->sa", axes, mean) / np.sqrt(unit)[:, None]
    share = np.maximum(variance / unit[:, None], np.where(along**2 < _LEAST_VARIANCE, _LEAST_VARIANCE, 0.0))
    coefficients = _principal_coefficients(along, share)
    whole = [
        _rotated(np.where(scale > 0.0, unit ** (1.5 - rank / 2.0), 0.0)[:, None] * values, axes, rank)
        for rank, values in enumerate(coefficients, start=1)
    ]
    return Expansion(mean=whole[0], linear=whole[1], quadratic=whole[2], cubic=whole[3])


def expand_scalar(mean: ArrayLike, spread: ArrayLike) -> Expansion:
    """Hermite expansion of |V| V in one dimension in closed form; every field has the shape of the arguments.

    With P = erf(U / (s sqrt(2))) and the normal density p of V at zero,

        c0 = (U² + s²) P + 2 U s² p,   c1 = 2 U P + 4 s² p,   c2 = P,   c3 = 2 p / 3

    Parameters
    ----------
    mean, spread
        U and the standard deviation s of one shape, m/s.

    Raises
    ------
    ScenarioError
        If a value is not finite or the spread is negative.
    """
    speed, spread = np.broadcast_arrays(np.asarray(mean, dtype=np.float64), np.asarray(spread, dtype=np.float64))
    if not (np.all(np.isfinite(speed)) and np.all(np.isfinite(spread)) and np.all(spread >= 0.0)):
        raise ScenarioError(
            f"mean {np.array2string(speed)} m/s and standard deviation {np.array2string(spread)} m/s of a velocity; "
            "both must be finite and the latter >= 0"
        )
    steady = spread == 0.0
    ratio = speed / np.where(steady, 1.0, spread)
    probability = np.where(steady, np.sign(speed), special.erf(ratio / np.sqrt(2.0)))
    spread_density = np.where(steady, 0.0, np.exp(-0.5 * ratio**2) / np.sqrt(2.0 * np.pi))  # s p
    return Expansion(
        mean=(speed**2 + spread**2) * probability + 2.0 * speed * spread * spread_density,
        linear=2.0 * speed * probability + 4.0 * spread * spread_density,
        quadratic=probability,
        cubic=2.0 / 3.0 * spread_density / np.where(steady, 1.0, spread),
    )


def splash(expansion: Expansion, cross: ArrayLike) -> SplashExpansion:
    """Expansion of the product of elevation and drag, eq. (6).

    Parameters
    ----------
    expansion
        Of |V| V at the mean water level.
    cross
        Covariance of each velocity component with the elevation, shape (s, d), m²/s.

    Raises
    ------
    ScenarioError
        If the shape of `cross` is not that of the expansion, or a value is not finite.
    """
    cross = np.asarray(cross, dtype=np.float64)
    if cross.shape != expansion.mean.shape or not np.all(np.isfinite(cross)):
        raise ScenarioError(
            f"covariance of velocity and elevation has shape {cross.shape}; "
            f"it must be {expansion.mean.shape} as the mean of the expansion, and finite"
        )
    return SplashExpansion(
        mean=np.einsum("sij,sj->si", expansion.linear, cross),
        elevation=expansion.mean,
        velocity=2.0 * np.einsum("sijk,sk->sij", expansion.quadratic, cross),
        product=expansion.linear,
        quadratic=3.0 * np.einsum("sijkl,sl->sijk", expansion.cubic, cross),
    )


def _velocity(mean: ArrayLike, covariance: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Mean (s, d) and symmetric covariance (s, d, d), checked."""
    speed, matrix = np.asarray(mean, dtype=np.float64), np.asarray(covariance, dtype=np.float64)
    if speed.ndim != 2 or not 1 <= speed.shape[1] <= 3 or matrix.shape != (*speed.shape, speed.shape[1]):
        raise ScenarioError(
            f"mean velocity has shape {speed.shape} and its covariance {matrix.shape}; "
            "they must be (s, d) and (s, d, d) with d = 1, 2 or 3"
        )
    finite = np.isfinite(speed).all(axis=1) & np.isfinite(matrix).all(axis=(1, 2))
    if not finite.all():
        at = int(np.argmin(finite))
        raise ScenarioError(
            f"velocity at element {at} has mean {speed[at].tolist()} m/s and covariance {matrix[at].tolist()} m²/s²; "
            "all must be finite"
        )
    skew = np.abs(matrix - np.swapaxes(matrix, 1, 2)).max(axis=(1, 2))
    if np.any(bad := skew > _ROUNDING * np.abs(matrix).max(axis=(1, 2))):
        at = int(np.argmax(bad))
        raise ScenarioError(
            f"covariance of the velocity at element {at} is {matrix[at].tolist()} m²/s², unsymmetric by "
            f"{skew[at]:.3g}; it must be symmetric, so take the real part of the integrated cross-spectra"
        )
    return speed, 0.5 * (matrix + np.swapaxes(matrix, 1, 2))


def _principal_coefficients(mean: FloatArray, variance: FloatArray) -> list[FloatArray]:
    """Coefficients of degree 0 to 3 in principal axes, by eqs. (2) to (5), of mean and variance (s, d) on a unit scale.

    Each has shape (s, entries), one for each different entry of a symmetric tensor, in the order of
    `combinations_with_replacement`.
    """
    if not len(mean):
        return [np.zeros((0, len(_entries(mean.shape[1], rank)))) for rank in range(1, 5)]
    t, weight = _rule(mean, variance)
    speed = mean.T[:, :, None]  # (d, s, 1), all below (d, s, n)
    ratio = 2.0 * t * variance.T[:, :, None]
    root = np.log1p(ratio)
    a = t / (1.0 + ratio)
    au = a * speed
    au2 = au * speed
    exponent = -(au2 + 0.5 * root).sum(axis=0)
    powers = (weight * t**-1.5) * np.exp(exponent)
    # Derivatives of exp(-a U^2) to U, relative to it: Hermite polynomials of sqrt(a) U.
    derivative = (None, -2.0 * au, a * (4.0 * au2 - 2.0), a * au * (12.0 - 8.0 * au2), a**2 * _fourth(au2))
    # With the subtracted terms of eq. (3), c0 / U and C1 have 2 t (1 - G / (1 + 2 t s)) in place of -2 a G.
    bounded = 2.0 * np.einsum("sn,dsn->ds", weight / np.sqrt(t), -np.expm1(exponent - root))
    result = [bounded.T * mean]
    for rank, factorial in ((2, 1.0), (3, 2.0), (4, 6.0)):
        values = np.empty((len(mean), len(_entries(mean.shape[1], rank))))
        for entry, indices in enumerate(_entries(mean.shape[1], rank)):
            if rank == 2 and indices[0] == indices[1]:
                i = indices[0]
                values[:, entry] = bounded[i] + 4.0 * np.einsum("sn,sn,sn->s", powers, au[i], au[i])
                continue
            factors = [derivative[indices.count(i)][i] for i in sorted(set(indices))]  # type: ignore[index]
            values[:, entry] = np.einsum(",".join(["sn"] * (1 + len(factors))) + "->s", powers, *factors) / factorial
        result.append(values)
    return result


def _fourth(au2: FloatArray) -> FloatArray:
    return 12.0 + au2 * (16.0 * au2 - 48.0)


def _rule(mean: FloatArray, variance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nodes t of shape (s, n), and weights of dt / t with the factor of eq. (3), by eq. (5)."""
    squares = mean**2
    gone = np.divide(_GONE, squares, out=np.full_like(squares, np.inf), where=squares > 2.0 * _GONE * variance)
    last = np.log(np.minimum(gone.min(axis=1), 0.5 / np.maximum(variance.min(axis=1), 1e-300)))[:, None] + 1.0
    lowest, highest = -1.0 - _TAIL, last + _TAIL
    count = int(np.ceil((highest - lowest).max() / _STEP)) + 1
    x = lowest + (highest - lowest) * np.linspace(0.0, 1.0, count)
    upper, lower = np.exp(x - last), np.exp(-1.0 - x)
    step = (highest - lowest) / (count - 1)
    return np.exp(x + upper - lower), step * (1.0 + upper + lower) / (4.0 * np.sqrt(np.pi))


@lru_cache
def _entries(dimension: int, rank: int) -> tuple[tuple[int, ...], ...]:
    """Indices of the different entries of a symmetric tensor."""
    return tuple(combinations_with_replacement(range(dimension), rank))


@lru_cache
def _places(dimension: int, rank: int) -> NDArray[np.intp]:
    """Number of the entry that stands at each place of a symmetric tensor, shape (d, ..., d)."""
    number = {indices: entry for entry, indices in enumerate(_entries(dimension, rank))}
    every = product(range(dimension), repeat=rank)
    return np.array([number[tuple(sorted(indices))] for indices in every]).reshape([dimension] * rank)


def _rotated(values: FloatArray, axes: FloatArray, rank: int) -> FloatArray:
    """Symmetric tensors of a rank from their entries (s, m) along principal axes, the columns of `axes` (s, d, d)."""
    tensor = values[:, _places(axes.shape[1], rank)]
    for _ in range(rank):  # turns the first index and makes it the last
        tensor = np.einsum("sia,sa...->s...i", axes, tensor)
    return tensor
