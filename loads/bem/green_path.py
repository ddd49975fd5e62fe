"""Integrals over the wavenumber mu for the finite-depth Green function, at all nodes of its tables together.

    f = integral J0(mu R) q(mu, s) dmu,   f_R = -integral mu J1(mu R) q dmu,   f_s = integral J0(mu R) q_s dmu     (1)

along a path from 0 to where q is negligible that passes above the real poles K and k of q: the real axis, lifted over
0..2k by a half-wave of a sine. Its height is a compromise of the distance to the poles with the growth of J0, which is
exp(R Im mu). Gauss-Legendre panels follow the oscillation of J0 and the scale of the poles.
"""

from cmath import exp as cexp
from cmath import sqrt as csqrt
from math import pi

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tlpsim.loads.bem.green_polynomials import FAST

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

NEGLIGIBLE = 38.0  # exp(-38) = 3e-17
_POINTS = 14  # of Gauss-Legendre on a panel of the path
_PANEL_PHASE = 7.0  # largest change of the exponents over a panel, rad
_ASYMPTOTIC = 14.0  # real part of z from which Hankel's series gives Bessel's functions to 1e-11
_HANKEL_TERMS = 8
_SERIES_TERMS = 60


def path(deep_number: float, wavenumber: float, depth: float, draft: float, reach: float) -> tuple[ComplexArray, ...]:
    """Nodes mu (1/m) and weights of the path: the real axis, or above it where the poles count.

    Parameters
    ----------
    deep_number, wavenumber
        The poles K and k, rad/m.
    depth, draft
        In m; the integrand decays as exp(-mu (2 depth - draft)).
    reach
        Largest R, m.
    """
    shortest = 2.0 * depth - draft
    end = NEGLIGIBLE / shortest
    height = 0.0
    if wavenumber < end:
        end = max(end, 2.0 * wavenumber)
        height = min(0.5 * wavenumber, 2.0 / reach)  # J0 grows by no more than exp(2)
    width = _PANEL_PHASE / (reach + 2.0 * depth + draft)
    if height > 0.0:
        width = min(width, 1.5 * height)
    edges = [0.0]
    while edges[-1] < end:
        edges.append(edges[-1] + min(width, 0.7 * max(edges[-1], deep_number)))
        if edges[-2] < 2.0 * wavenumber < edges[-1] and height > 0.0:
            edges[-1] = 2.0 * wavenumber  # the path has a corner here
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    bounds = np.array(edges)
    half = 0.5 * np.diff(bounds)[:, np.newaxis]
    x = (bounds[:-1, np.newaxis] + half * (1.0 + nodes)).ravel()
    weight = (half * weights).ravel()
    lifted = x < 2.0 * wavenumber
    angle = 0.5 * pi * x / wavenumber
    mu = x + 1j * np.where(lifted, height * np.sin(angle), 0.0)
    slope = 1.0 + 1j * np.where(lifted, 0.5 * pi * height / wavenumber * np.cos(angle), 0.0)
    return mu, weight * slope


def _hankel_coefficients() -> FloatArray:
    """Coefficients (order, P and Q, terms) of Hankel's series in 1/z²; A&S 9.2.9, 9.2.10."""
    result = np.empty((2, 2, _HANKEL_TERMS))
    for order in (0, 1):
        k = np.arange(1, 2 * _HANKEL_TERMS)
        factors = np.cumprod(np.append(1.0, (4.0 * order**2 - (2.0 * k - 1.0) ** 2) / (8.0 * k)))
        result[order] = factors.reshape(_HANKEL_TERMS, 2).T * (-1.0) ** np.arange(_HANKEL_TERMS)
    return result


_HANKEL = _hankel_coefficients()


@njit(cache=True, fastmath=FAST)
def _complex_bessel(z: complex) -> tuple[complex, complex]:
    """J0(z) and 2 J1(z)/z for a real part >= 0 and a small imaginary part, to 1e-11."""
    if z.real < _ASYMPTOTIC:
        square = -0.25 * z * z
        term = zeroth = first = complex(1.0, 0.0)
        for k in range(1, _SERIES_TERMS):
            term = term * square * (1.0 / (k * k))
            zeroth += term
            first += term * (1.0 / (k + 1.0))
            if abs(term.real) + abs(term.imag) < 1e-17:
                break
        return zeroth, first
    inverse = 1.0 / z
    square = inverse * inverse
    p0 = q0 = p1 = q1 = complex(0.0, 0.0)
    for k in range(_HANKEL_TERMS - 1, -1, -1):
        p0 = p0 * square + _HANKEL[0, 0, k]
        q0 = q0 * square + _HANKEL[0, 1, k]
        p1 = p1 * square + _HANKEL[1, 0, k]
        q1 = q1 * square + _HANKEL[1, 1, k]
    wave = cexp(1j * (z - 0.25 * pi))
    back = 1.0 / wave
    cosine, sine = 0.5 * (wave + back), -0.5j * (wave - back)
    scale = csqrt(2.0 / pi * inverse)
    # cos(z - 3 pi/4) = sin(z - pi/4), sin(z - 3 pi/4) = -cos(z - pi/4)
    zeroth = scale * (p0 * cosine - q0 * inverse * sine)
    return zeroth, 2.0 * inverse * scale * (p1 * sine + q1 * inverse * cosine)


@njit(cache=True, fastmath=FAST)
def sum_path(radius: FloatArray, mu: ComplexArray, value: ComplexArray, slope: ComplexArray) -> ComplexArray:
    """Integrals f, f_R/R and f_s over the path, shape (3, R, s), from the factors in s and their slopes (mu, s).

    Loops rather than products of matrices: the library's threads cost more than these few numbers.
    """
    result = np.zeros((3, len(radius), value.shape[1]), np.complex128)
    for i in range(len(radius)):
        for j in range(len(mu)):
            zeroth, first = _complex_bessel(mu[j] * radius[i])
            first = -0.5 * mu[j] * mu[j] * first
            for k in range(value.shape[1]):
                result[0, i, k] += zeroth * value[j, k]
            for k in range(value.shape[1]):
                result[1, i, k] += first * value[j, k]
            for k in range(value.shape[1]):
                result[2, i, k] += zeroth * slope[j, k]
    return result
