"""The wave part of the deep-water free-surface Green function, one table for all frequencies.

    G = 1/r + 1/r1 + K g(h, v),   h = K R,   v = K (z + zeta) = -V,   d = sqrt(h² + V²)                           (1)
    g = 2 F - 2 pi i exp(v) J0(h),   F(h, V) = PV integral_0^inf exp(-mu V) J0(mu h) / (mu - 1) dmu                (2)
    dg/dv = g + 2/d,   dg/dh = 2 F_h + 2 pi i exp(v) J1(h)                                                        (3)
    F = exp(-V) [-pi/2 (H0(h) + Y0(h)) - integral_0^V exp(s) / sqrt(h² + s²) ds]                                  (4)

(Wehausen & Laitone 1960, eq. 13.17; Newman 1985, J. Engng Math. 19; Noblesse 1982, J. Engng Math. 16; H is Struve's
function, amplitudes vary as exp(+i omega t).) F is tabulated where it is smooth, by polynomials in cells, with c = V/d:

    d < 26    F = -exp(-V) J0(h) [ln((V + d)/2) + gamma] + S(d, c),   S entire in d and c (Noblesse's near field)   (5)
    d >= 26   F = -pi exp(-V) Y0(h) - 1/d + M(1/d, c)/d²,   M smooth down to 1/d = 0                              (6)

and likewise F_h, whose smooth parts are h/d and h/d³ times a function of the same variables, so that the derivative
keeps its relative accuracy on the axis h = 0.
"""

from functools import lru_cache
from math import cos, exp, log, pi, sin, sqrt
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.polynomial import Chebyshev
from numpy.typing import NDArray
from scipy import special

from tlpsim.loads.bem.green_polynomials import BLOCKS, FAST, address, aligned, pair_blocks, power_basis, tensor_lanes

FloatArray = NDArray[np.float64]

NEAR_LIMIT = 26  # of d: the far field's error there, exp(-d) d³, comes from the logarithm on the axis h = 0
BESSEL_LIMIT = 8  # of h: beyond, modulus and phase
EULER_GAMMA = float(np.euler_gamma)
_TERMS = 8  # powers of each variable in a cell
_COLUMNS = _TERMS // BLOCKS
_HANKEL_TERMS = 6
_FAR_CELLS = (2, 3)  # in 1/d and c
_QUARTER_PI = pi / 4.0
_NEGLIGIBLE = 42.0  # exp(-42) = 6e-19
_STRUVE_DEGREE = 52
_POINTS = 48  # of Gauss-Legendre in eq. (4)
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(_POINTS)

_pair = tensor_lanes(_TERMS, _COLUMNS)
_bessel = tensor_lanes(1, _COLUMNS)
_hankel = tensor_lanes(1, _HANKEL_TERMS // 2)


class DeepAddresses(NamedTuple):
    """Addresses of the tables, all that compiled code sees."""

    bessel: int
    neumann: int
    hankel: int
    near: int
    far: int


class DeepTable(DeepAddresses):
    """Polynomials of the deep-water Green function in local coordinates -1..1, one cell a row; `arrays` owns them.

    bessel, neumann: pairs (`pair_blocks`) on half-unit cells of h: J0, J1/h; Y0 - 2/pi ln(h) J0 and Y1 likewise, with
    its pole -2/(pi h) taken out.
    hankel (1, 24): the amplitudes P0, Q0, P1, Q1 of the Bessel functions for h >= 8, in (8/h)², two blocks of powers.
    near: pairs, S of eq. (5) and its companion for F_h, in d and c, rows of d one after the other.
    far: pairs, M of eq. (6) and its companion for F_h, in 1/d and c.
    """

    arrays: tuple[FloatArray, ...]

    def __reduce__(self) -> tuple[object, tuple[object, ...]]:
        """Build anew in another process, where the addresses mean nothing."""
        return deep_table, ()


# ---------------------------------------------------------------------------------------------------------------------
# Building the table
# ---------------------------------------------------------------------------------------------------------------------


def _tail_integrals(h: FloatArray, depth: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Integral_0^V exp(s - V) / (h² + s²)^(p/2) ds for p = 1 and 3, with s = h sinh u; h > 0, V = `depth`."""
    reach = np.arcsinh(depth / h)
    start = np.arcsinh(np.maximum(depth - _NEGLIGIBLE, 0.0) / h)
    half = 0.5 * (reach - start)
    first, third = np.zeros(h.shape), np.zeros(h.shape)
    for node, weight in zip(_NODES, _WEIGHTS, strict=True):
        growth = np.exp(start + half * (node + 1.0))
        s = 0.5 * h * (growth - 1.0 / growth)
        integrand = weight * np.exp(s - depth)
        first += integrand
        third += integrand / (h**2 + s**2)
    return half * first, half * third


@lru_cache(maxsize=2)
def _struve(order: int) -> Chebyshev:
    """Struve's function over the near field, where it is entire, a hundred times quicker than its series."""
    return Chebyshev.interpolate(lambda h: special.struve(order, h), _STRUVE_DEGREE, [0.0, NEAR_LIMIT])


def _principal_value(h: FloatArray, depth: FloatArray) -> tuple[FloatArray, FloatArray]:
    """F of eq. (4) and F_h / h by quadrature, 0 < h <= 26."""
    decay = np.exp(-depth)
    first, third = _tail_integrals(h, depth)
    surface = -0.5 * pi * (_struve(0)(h) + special.y0(h))
    slope = -0.5 * pi * (2.0 / pi - _struve(1)(h) - special.y1(h)) / h
    return decay * surface - first, decay * slope + third


def _near_parts(d: FloatArray, cosine: FloatArray) -> FloatArray:
    """S of eq. (5) and its companion T = S_h d/h at d and c = V/d, shape (2, ...)."""
    depth = d * cosine
    h = np.sqrt(d**2 - depth**2)
    decay = np.exp(-depth)
    logarithm = np.log(0.5 * (depth + d)) + EULER_GAMMA
    value, slope = _principal_value(h, depth)
    j0, j1 = decay * special.j0(h), decay * special.j1(h)
    return np.stack([value + j0 * logarithm, d * (slope - j1 / h * logarithm) + j0 / (d + depth)])


def _far_parts(inverse: FloatArray, cosine: FloatArray) -> FloatArray:
    """M of eq. (6) and its companion (F_h - pi exp(-V) Y1) d³/h at 1/d and c = V/d, shape (2, ...)."""
    d = 1.0 / inverse
    depth = d * cosine
    h = np.sqrt(d**2 - depth**2)
    decay = np.exp(-depth)
    first, third = _tail_integrals(h, depth)
    value = -0.5 * pi * decay * (special.struve(0, h) - special.y0(h)) - first
    slope = decay * (0.5 * pi * (special.struve(1, h) - special.y1(h)) - 1.0) / h + third
    return np.stack([d * (d * value + 1.0), d**3 * slope])


def _tabulate(parts: FloatArray, to_powers: FloatArray) -> FloatArray:
    """Table of values (2, cells, i, j) at the Chebyshev nodes of cells."""
    return pair_blocks(np.einsum("ia,pcab,jb->cpij", to_powers, parts, to_powers, optimize=True))


def _near_table() -> FloatArray:
    """Table of eq. (5): F varies with V = d c as fast as with d, so row i has i + 2 cells in c."""
    nodes, to_powers = power_basis(_TERMS)
    unit = 0.5 * (nodes + 1.0)
    row = np.repeat(np.arange(NEAR_LIMIT), np.arange(NEAR_LIMIT) + 2)
    column = np.arange(len(row)) - (row * (row + 3)) // 2
    d = (row[:, np.newaxis] + unit)[:, :, np.newaxis]
    cosine = ((column[:, np.newaxis] + unit) / (row[:, np.newaxis] + 2))[:, np.newaxis, :]
    return _tabulate(_near_parts(*np.broadcast_arrays(d, cosine)), to_powers)


def _far_table() -> FloatArray:
    """Table of eq. (6), cells in 1/d slowest."""
    nodes, to_powers = power_basis(_TERMS)
    unit = 0.5 * (nodes + 1.0)
    rows, columns = _FAR_CELLS
    inverse = np.repeat(np.arange(rows)[:, np.newaxis] + unit, columns, axis=0) / (rows * NEAR_LIMIT)
    cosine = np.tile(np.arange(columns)[:, np.newaxis] + unit, (rows, 1)) / columns
    return _tabulate(_far_parts(*np.broadcast_arrays(inverse[:, :, np.newaxis], cosine[:, np.newaxis, :])), to_powers)


def _bessel_tables() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Tables `bessel`, `neumann` and `hankel` of `DeepTable`."""
    nodes, to_powers = power_basis(_TERMS)
    h = 0.5 * (np.arange(2 * NEAR_LIMIT)[:, np.newaxis] + 0.5 * (nodes + 1.0))
    bessel = np.stack([special.j0(h), special.j1(h) / h], axis=1) @ to_powers.T
    h = h[: 2 * BESSEL_LIMIT]
    y0 = special.y0(h) - 2.0 / pi * np.log(h) * special.j0(h)
    y1 = special.y1(h) - 2.0 / pi * (np.log(h) * special.j1(h) - 1.0 / h)
    neumann = np.stack([y0, y1], axis=1) @ to_powers.T

    nodes, to_powers = power_basis(_HANKEL_TERMS)
    h = BESSEL_LIMIT / np.sqrt(0.5 * (nodes + 1.0))
    scale = np.sqrt(0.5 * pi * h)
    amplitudes = []
    for order in (0, 1):
        cosine, sine = np.cos(h - (0.5 * order + 0.25) * pi), np.sin(h - (0.5 * order + 0.25) * pi)
        first, second = special.jv(order, h), special.yv(order, h)
        amplitudes += [scale * (first * cosine + second * sine), scale * h * (second * cosine - first * sine)]
    powers = (np.stack(amplitudes) @ to_powers.T).reshape(4, 2, _HANKEL_TERMS // 2)
    hankel = powers.transpose(2, 0, 1).reshape(1, -1)
    return pair_blocks(bessel[:, :, np.newaxis]), pair_blocks(neumann[:, :, np.newaxis]), aligned(hankel)


@lru_cache(maxsize=1)
def deep_table() -> DeepTable:
    """Return the table of the deep-water wave part; built once a process, it serves every frequency."""
    arrays = (*_bessel_tables(), _near_table(), _far_table())
    table = DeepTable(*(address(array) for array in arrays))
    table.arrays = arrays
    return table


# ---------------------------------------------------------------------------------------------------------------------
# Evaluation
# ---------------------------------------------------------------------------------------------------------------------


@njit(cache=True, fastmath=FAST, forceinline=True)
def _blocks(first: float, second: float, third: float, fourth: float, power: float) -> float:
    """A polynomial from its four blocks."""
    return (first + second * power) + (third + fourth * power) * (power * power)


@njit(cache=True, fastmath=FAST, forceinline=True)
def _lane_pair(table: int, cell: int, x: float, y: float) -> tuple[float, float]:
    """Both polynomials of a cell of `near` or `far`."""
    a, b, c, d, e, f, g, h = _pair(table, cell, x, y)
    power = y * y
    return _blocks(a, b, c, d, power), _blocks(e, f, g, h, power)


@njit(cache=True, fastmath=FAST, forceinline=True)
def _bessel_pair(table: int, h: float) -> tuple[float, float]:
    """Both polynomials of `bessel` or `neumann` at h."""
    across = 2.0 * h
    cell = max(int(across), 0)  # also of a number that is none
    x = 2.0 * (across - cell) - 1.0
    a, b, c, d, e, f, g, i = _bessel(table, cell, 0.0, x)
    power = x * x
    return _blocks(a, b, c, d, power), _blocks(e, f, g, i, power)


@njit(cache=True, fastmath=FAST, forceinline=True)
def _bessel_first(h: float, table: int) -> tuple[float, float]:
    """J0 and J1 for h < 26; J1 vanishes exactly at 0."""
    j0, ratio = _bessel_pair(table, h)
    return j0, h * ratio


@njit(cache=True, fastmath=FAST, forceinline=True)
def _bessel_far(h: float, table: int) -> tuple[float, float, float, float]:
    """J0, J1, Y0, Y1 for h >= 8."""
    inverse = 1.0 / h
    x = 2.0 * (BESSEL_LIMIT * inverse) ** 2 - 1.0
    scale = sqrt(2.0 / pi * inverse)
    cosine, sine = cos(h - _QUARTER_PI), sin(h - _QUARTER_PI)
    a, b, c, d, e, f, g, i = _hankel(table, 0, 0.0, x)
    power = x * x * x
    p0, q0 = a + b * power, (c + d * power) * inverse
    p1, q1 = e + f * power, (g + i * power) * inverse
    # cos(h - 3 pi/4) = sin(h - pi/4), sin(h - 3 pi/4) = -cos(h - pi/4)
    return (
        scale * (p0 * cosine - q0 * sine),
        scale * (p1 * sine + q1 * cosine),
        scale * (p0 * sine + q0 * cosine),
        scale * (q1 * sine - p1 * cosine),
    )


@njit(cache=True, fastmath=FAST, forceinline=True)
def bessel_all(h: float, table: DeepAddresses) -> tuple[float, float, float, float]:
    """Return J0, J1, Y0, Y1 of h > 0, to about 1e-10 of their envelope."""
    if h >= BESSEL_LIMIT:
        return _bessel_far(h, table.hankel)
    j0, j1 = _bessel_first(h, table.bessel)
    y0, y1 = _bessel_pair(table.neumann, h)
    logarithm = log(h)
    return j0, j1, y0 + 2.0 / pi * logarithm * j0, y1 + 2.0 / pi * (logarithm * j1 - 1.0 / h)


@njit(cache=True, fastmath=FAST, forceinline=True)
def deep_wave(h: float, v: float, table: DeepAddresses) -> tuple[complex, complex, complex]:
    """Wave part g of the deep-water Green function, eq. (2), and its derivatives, to 1e-7 of their size.

    Parameters
    ----------
    h
        K R >= 0, dimensionless.
    v
        K (z + zeta) <= 0, dimensionless.
    table
        From `deep_table`.

    Returns
    -------
    g, dg/dh, dg/dv
        Complex, for amplitudes exp(+i omega t); g tends to -2 ln((d + V)/2) - 2 gamma - 2 pi i at the origin.
    """
    depth = -v
    d = sqrt(h * h + depth * depth) + 1e-100
    inverse = 1.0 / d
    cosine = depth * inverse
    decay = exp(v)
    if d < NEAR_LIMIT:
        j0, j1 = _bessel_first(h, table.bessel)
        row = int(d)
        across = cosine * (row + 2)
        column = max(min(int(across), row + 1), 0)
        x = 2.0 * (d - row) - 1.0
        y = 2.0 * (across - column) - 1.0
        smooth, smooth_slope = _lane_pair(table.near, (row * (row + 3)) // 2 + column, x, y)
        logarithm = log(0.5 * (d + depth)) + EULER_GAMMA
        value = smooth - decay * j0 * logarithm
        slope = h * inverse * (smooth_slope - decay * j0 / (d + depth)) + decay * j1 * logarithm
        vertical = value + inverse
    else:
        rows, columns = _FAR_CELLS
        along = inverse * (rows * NEAR_LIMIT)
        row = max(min(int(along), rows - 1), 0)
        across = cosine * columns
        column = max(min(int(across), columns - 1), 0)
        x = 2.0 * (along - row) - 1.0
        y = 2.0 * (across - column) - 1.0
        smooth, smooth_slope = _lane_pair(table.far, row * columns + column, x, y)
        vertical = inverse * inverse * smooth
        slope = h * inverse * inverse * inverse * smooth_slope
        if h >= BESSEL_LIMIT:
            j0, j1, y0, y1 = _bessel_far(h, table.hankel)
            vertical -= pi * decay * y0
            slope += pi * decay * y1
        else:
            j0, j1 = _bessel_first(h, table.bessel)
        value = vertical - inverse
    wave = 2.0 * pi * decay
    return (
        complex(2.0 * value, -wave * j0),
        complex(2.0 * slope, wave * j1),
        complex(2.0 * vertical, -wave * j0),
    )
