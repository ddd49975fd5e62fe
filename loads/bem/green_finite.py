"""The wave part of the free-surface Green function in water of constant depth: small tables, one set a frequency.

    G = 1/r + 1/r1 + 1/r2 + K g(K R, K (z + zeta)) + A(R, z - zeta) + B(R, z + zeta)                               (1)
    A = integral Q 2 cosh(mu s) J0(mu R) dmu,                                         s = z - zeta                (2)
    B = integral Q [rho exp(-mu t) + exp(-2 mu D) exp(mu t)] J0(mu R) dmu,            t = -(z + zeta)             (3)
    rho = (mu + K) / (mu - K),   Q = (mu + K) exp(-2 mu D) / [mu - K - (mu + K) exp(-2 mu D)]                     (4)

with D the depth, g the deep-water wave part of `green_deep` and integrals over mu = 0..inf that pass above the real
poles K and k, k tanh(k D) = K (amplitudes vary as exp(+i omega t)). This is the integral of Wehausen & Laitone (1960,
eq. 13.18) with the deep-water integrand taken out: what is left decays as exp(-mu (2 D - |s|)), so that A and B are
smooth, without any singularity nearer than D, and are tabulated by polynomials in few cells. All nodes of a table come
from one quadrature (`green_path`), since the integrands are separable in R and s or t.

Beyond the tables, far out, John's eigenfunction series serves (Wehausen & Laitone eq. 13.19):

    G = -2 pi i (k² - K²)/N(k²) cosh k(z+D) cosh k(zeta+D) (J0 - i Y0)(k R)
        + 4 sum_m (k_m² + K²)/N(-k_m²) cos k_m(z+D) cos k_m(zeta+D) K0(k_m R),   N(x) = (x - K²) D + K           (5)
"""

from functools import lru_cache
from math import ceil, cos, exp, nan, pi, sin, sqrt
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import special

from tlpsim.loads.bem.green_deep import DeepAddresses, bessel_all, deep_table, deep_wave
from tlpsim.loads.bem.green_path import NEGLIGIBLE, path, sum_path
from tlpsim.loads.bem.green_polynomials import (
    BLOCKS,
    FAST,
    LANES,
    address,
    aligned,
    pair_blocks,
    power_basis,
    tensor_lanes,
)
from tlpsim.loads.checks import require_positive
from tlpsim.loads.constants import STANDARD_GRAVITY
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.waves.airy import wavenumber

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_TERMS = 7  # powers of each variable in a cell
_CHANNELS = 6  # of the lanes: real and imaginary parts of the value and of its two derivatives
_SMOOTH_CELL = 0.35  # largest cell over the distance to the nearest singularity
_WAVE_CELL = 1.6  # largest cell times wavenumber
_LONGEST_REACH = 6.0  # of a table, in depths: beyond, a few eigenfunctions do
_SHORTEST_REACH = 1.0
_SERIES_START = 0.5  # in depths: the eigenfunction series is used from here
_MODES = 15  # exp(-15 pi/2) = 6e-11 there
_DECAY_LIMIT = 1.0 / (0.5 * pi * _SERIES_START)  # largest 1/(k_m R) asked of K0, K1
_DECAY_TERMS = 16

_look_up = tensor_lanes(_TERMS, _TERMS)
_mode = tensor_lanes(1, 1)
_decay = tensor_lanes(1, _DECAY_TERMS // BLOCKS)


class _FiniteFields(NamedTuple):
    """What compiled code sees of a `FiniteTable`: numbers and addresses, flat, as parallel loops demand of a tuple."""

    bessel: int
    neumann: int
    hankel: int
    near: int
    far: int
    deep_number: float
    depth: float
    reach: float
    draft: float
    wavenumber: float
    amplitude: float
    rows: int
    difference_columns: int
    total_columns: int
    modes: int
    decay: int
    difference: int
    total: int


class FiniteTable(_FiniteFields):
    """The finite-depth wave part at one frequency and depth, lengths in m; `arrays` owns the tables.

    bessel ... far: of the `DeepTable`;
    deep_number K, depth D, reach and draft of the tables (largest R, largest -z), wavenumber k;
    amplitude: k²/((k² - K²) D + K), of the propagating term of eq. (5) with its depth functions scaled to 1 at z = 0;
    rows: number of cells in R; difference_columns, total_columns: in s and in t;
    modes (modes, 8): k_m and the factor of K0 in eq. (5);
    decay: the pair sqrt(x) exp(x) K0(x), K1(x) in 1/x;
    difference, total (cells, 7 · 7 · 8): real and imaginary parts of A, A_R/R, A_s and of B, B_R/R, B_t.
    """

    arrays: tuple[FloatArray, ...]

    def __reduce__(self) -> tuple[object, tuple[object, ...]]:
        """Build anew in another process, where the addresses mean nothing."""
        return finite_table, (self.deep_number, self.depth, self.reach, self.draft)


# ---------------------------------------------------------------------------------------------------------------------
# Building the tables
# ---------------------------------------------------------------------------------------------------------------------


def _cells(length: float, smooth: float, wavenumber: float) -> int:
    """Number of equal cells over a length."""
    width = _SMOOTH_CELL * smooth
    if wavenumber * smooth < 20.0:
        width = min(width, _WAVE_CELL / wavenumber)
    return max(1, ceil(length / width))


def _cell_nodes(length: float, count: int, nodes: FloatArray) -> FloatArray:
    """Chebyshev nodes of all cells over 0..length, one after the other."""
    return np.asarray((np.arange(count)[:, np.newaxis] + 0.5 * (1.0 + nodes)).ravel() * (length / count))


def _tabulate(integrals: ComplexArray, to_powers: FloatArray) -> FloatArray:
    """Table of a function and its slopes, given at the nodes of all cells, shape (3, R, s)."""
    across, along = integrals.shape[1] // _TERMS, integrals.shape[2] // _TERMS
    parts = np.stack([part for value in integrals for part in (value.real, value.imag)])
    cells = parts.reshape(_CHANNELS, across, _TERMS, along, _TERMS).transpose(1, 3, 2, 4, 0)
    nodes = np.zeros((across * along, _TERMS**2, LANES))
    nodes[..., :_CHANNELS] = cells.reshape(across * along, _TERMS**2, _CHANNELS)
    powers = np.asarray(np.kron(to_powers, to_powers) @ nodes, dtype=np.float64)
    return aligned(powers.reshape(across * along, -1))


def _modes(deep_number: float, depth: float) -> FloatArray:
    """The roots k_m of k tan(k D) = -K, (m - 1/2) pi < k_m D < m pi, by Newton's method, and factors of K0, eq. (5)."""
    target = deep_number * depth
    order = pi * np.arange(1, _MODES + 1)
    x = order - np.arctan(target / order)
    for _ in range(12):
        x = x - (x - order + np.arctan(target / x)) / (1.0 - target / (x**2 + target**2))
    k = x / depth
    modes = np.zeros((_MODES, LANES))
    modes[:, 0] = k
    modes[:, 1] = 4.0 * (k**2 + deep_number**2) / ((k**2 + deep_number**2) * depth - deep_number)
    return aligned(modes)


@lru_cache(maxsize=1)
def _decay_polynomials() -> FloatArray:
    """The pair sqrt(x) exp(x) K0(x), K1(x) as polynomials in 1/x."""
    nodes, to_powers = power_basis(_DECAY_TERMS)
    x = 2.0 / (_DECAY_LIMIT * (1.0 + nodes))
    powers = np.sqrt(x) * np.stack([special.k0e(x), special.k1e(x)]) @ to_powers.T
    return pair_blocks(powers[np.newaxis, :, np.newaxis])


def finite_table(deep_number: float, depth: float, max_distance: float, max_draft: float) -> FiniteTable:
    """Build the tables of the finite-depth wave part at one frequency.

    Parameters
    ----------
    deep_number
        K = omega²/gravity, rad/m, > 0.
    depth
        Of the water, m, finite.
    max_distance
        Largest horizontal distance R that is usual, m; beyond it (or six depths) the slower series is used.
    max_draft
        Largest -z of a source or field point, m; points deeper than that are served only from half a depth away on.

    Raises
    ------
    ScenarioError
        If an argument is not positive and finite, or the draft is more than the depth.
    """
    require_positive("wavenumber omega²/gravity", deep_number, "rad/m")
    require_positive("water depth of a table of the Green function", depth, "m")
    require_positive("largest distance in a table of the Green function", max_distance, "m")
    require_positive("largest draft in a table of the Green function", max_draft, "m")
    if max_draft > depth:
        raise ScenarioError(f"draft is {max_draft} m; it must be at most the water depth, {depth} m")
    k = float(wavenumber(sqrt(deep_number * STANDARD_GRAVITY), depth))
    reach = depth * min(max(max_distance / depth, _SHORTEST_REACH), _LONGEST_REACH)
    mu, weights = path(deep_number, k, depth, max_draft, reach)

    smooth = 2.0 * depth - max_draft
    nodes, to_powers = power_basis(_TERMS)
    radius = _cell_nodes(reach, _cells(reach, smooth, k), nodes)
    difference = _cell_nodes(max_draft, _cells(max_draft, smooth, k), nodes)
    total = _cell_nodes(2.0 * max_draft, _cells(2.0 * max_draft, 2.0 * depth, k), nodes)

    # Q and rho with the exponentials gathered, so that none overflows
    twice = np.exp(-2.0 * depth * mu)
    core = (weights * (mu + deep_number) / (mu - deep_number - (mu + deep_number) * twice))[:, np.newaxis]
    ratio = ((mu + deep_number) / (mu - deep_number))[:, np.newaxis]
    column = mu[:, np.newaxis]
    near, far = np.exp(-column * (2.0 * depth - difference)), np.exp(-column * (2.0 * depth + difference))
    down, up = ratio * np.exp(-column * (2.0 * depth + total)), np.exp(-column * (4.0 * depth - total))
    value = core * np.hstack([near + far, down + up])
    slope = core * column * np.hstack([near - far, up - down])
    integrals = sum_path(radius, mu, value, slope)

    tables = [_tabulate(part, to_powers) for part in np.split(integrals, [len(difference)], axis=2)]
    arrays = (_modes(deep_number, depth), _decay_polynomials(), *tables)
    table = FiniteTable(
        *deep_table(),
        float(deep_number),
        float(depth),
        float(reach),
        float(max_draft),
        k,
        float(k**2 / ((k**2 - deep_number**2) * depth + deep_number)),
        len(radius) // _TERMS,
        len(difference) // _TERMS,
        len(total) // _TERMS,
        *(address(array) for array in arrays),
    )
    table.arrays = arrays
    return table


def no_bottom() -> FiniteTable:
    """Return a table of the deep part alone, for kernels that take one in deep water too; not for `finite_wave`."""
    return FiniteTable(*deep_table(), *(0.0,) * 6, *(0,) * 7)


# ---------------------------------------------------------------------------------------------------------------------
# Evaluation
# ---------------------------------------------------------------------------------------------------------------------


@njit(cache=True, fastmath=FAST, forceinline=True)
def deep_part(table: FiniteTable) -> DeepAddresses:
    """Return the deep-water tables, for `deep_wave`."""
    return DeepAddresses(table.bessel, table.neumann, table.hankel, table.near, table.far)


@njit(cache=True, fastmath=FAST)
def _decays(argument: float, table: int) -> tuple[float, float]:
    """K0 and K1 where the eigenfunction series needs them."""
    x = 2.0 / (_DECAY_LIMIT * argument) - 1.0
    a, b, c, d, e, f, g, h = _decay(table, 0, 0.0, x)
    power = x * x * x * x
    scale = exp(-argument) / sqrt(argument)
    first = (a + b * power) + (c + d * power) * (power * power)
    second = (e + f * power) + (g + h * power) * (power * power)
    return scale * first, scale * second


@njit(cache=True, fastmath=FAST)
def _depth_function(k: float, z: float, depth: float) -> tuple[float, float]:
    """cosh k(z + D) / cosh kD and its derivative."""
    surface, bottom = exp(k * z), exp(-2.0 * k * (z + depth))
    scale = surface / (1.0 + exp(-2.0 * k * depth))
    return scale * (1.0 + bottom), k * scale * (1.0 - bottom)


@njit(cache=True, fastmath=FAST)
def _series(radius: float, z: float, zeta: float, table: FiniteTable) -> tuple[complex, complex, complex]:
    """All of G by eq. (5), R at least half the depth."""
    depth = table.depth
    k = table.wavenumber
    j0, j1, y0, y1 = bessel_all(k * radius, deep_part(table))
    field, field_slope = _depth_function(k, z, depth)
    source, _ = _depth_function(k, zeta, depth)
    factor = -2.0 * pi * table.amplitude * source
    wave = complex(y0, j0)
    value = factor * field * wave
    slope = -factor * field * k * complex(y1, j1)
    vertical = factor * field_slope * wave
    for mode in range(_MODES):
        k, mode_amplitude, _, _, _, _, _, _ = _mode(table.modes, mode, 0.0, 0.0)
        argument = k * radius
        if argument > NEGLIGIBLE:
            break
        zeroth, first = _decays(argument, table.decay)
        scale = mode_amplitude * cos(k * (zeta + depth))
        cosine = scale * cos(k * (z + depth))
        value += zeroth * cosine
        slope -= k * first * cosine
        vertical -= k * zeroth * scale * sin(k * (z + depth))
    return value, slope, vertical


@njit(cache=True, fastmath=FAST, forceinline=True)
def _from_tables(radius: float, z: float, zeta: float, table: FiniteTable) -> tuple[complex, complex, complex, complex]:
    """A + B of eq. (1) and its derivatives by R, z and zeta."""
    total, difference = -(z + zeta), abs(z - zeta)
    across = radius / table.reach * table.rows
    row = max(min(int(across), table.rows - 1), 0)
    x = 2.0 * (across - row) - 1.0
    along = difference / table.draft * table.difference_columns
    column = max(min(int(along), table.difference_columns - 1), 0)
    a = _look_up(table.difference, row * table.difference_columns + column, x, 2.0 * (along - column) - 1.0)
    along = total / (2.0 * table.draft) * table.total_columns
    column = max(min(int(along), table.total_columns - 1), 0)
    b = _look_up(table.total, row * table.total_columns + column, x, 2.0 * (along - column) - 1.0)
    side = 1.0 if z >= zeta else -1.0
    return (
        complex(a[0] + b[0], a[1] + b[1]),
        radius * complex(a[2] + b[2], a[3] + b[3]),
        complex(side * a[4] - b[4], side * a[5] - b[5]),
        complex(-side * a[4] - b[4], -side * a[5] - b[5]),
    )


@njit(cache=True, fastmath=FAST)
def _from_series(radius: float, z: float, zeta: float, table: FiniteTable) -> tuple[complex, complex, complex]:
    """The wave part by eq. (5); not a number where that does not serve."""
    if radius < _SERIES_START * table.depth:
        return complex(nan, nan), complex(nan, nan), complex(nan, nan)
    value, slope, vertical = _series(radius, z, zeta, table)
    for height in (z - zeta, z + zeta, z + zeta + 2.0 * table.depth):
        inverse = 1.0 / sqrt(radius * radius + height * height)
        cube = inverse * inverse * inverse
        value -= inverse
        slope += radius * cube
        vertical += height * cube
    return value, slope, vertical


@njit(cache=True, fastmath=FAST)
def _bottom_from_series(
    radius: float, z: float, zeta: float, table: FiniteTable
) -> tuple[complex, complex, complex, complex]:
    """`bottom_wave` by the eigenfunction series."""
    number = table.deep_number
    square = number * number
    deep, deep_slope, deep_vertical = deep_wave(number * radius, number * (z + zeta), deep_part(table))
    value, slope, vertical = _from_series(radius, z, zeta, table)
    _, _, source_vertical = _from_series(radius, zeta, z, table)
    return (
        value - number * deep,
        slope - square * deep_slope,
        vertical - square * deep_vertical,
        source_vertical - square * deep_vertical,
    )


@njit(cache=True, fastmath=FAST, forceinline=True)
def finite_wave(radius: float, z: float, zeta: float, table: FiniteTable) -> tuple[complex, complex, complex]:
    """Wave part of the finite-depth Green function, G - 1/r - 1/r1 - 1/r2, and its derivatives.

    Parameters
    ----------
    radius
        Horizontal distance R >= 0, m.
    z, zeta
        Heights of the field point and of the source, m, -depth <= z, zeta <= 0. The function is symmetric in them: for
        the derivative with respect to the source's height exchange them.
    table
        From `finite_table`, whose draft is at least -z and -zeta.

    Returns
    -------
    g, dg/dR, dg/dz
        Complex, 1/m and 1/m², for amplitudes exp(+i omega t). Not a number for a point below the table's draft that
        is nearer than half the depth. The caller adds the Rankine terms

            1/r, r² = R² + (z - zeta)²;  1/r1, r1² = R² + (z + zeta)²;  1/r2, r2² = R² + (z + zeta + 2 depth)².
    """
    if radius < table.reach and max(-z, -zeta) <= table.draft:
        number = table.deep_number
        square = number * number
        deep, deep_slope, deep_vertical = deep_wave(number * radius, number * (z + zeta), deep_part(table))
        value, slope, vertical, _ = _from_tables(radius, z, zeta, table)
        result = number * deep + value, square * deep_slope + slope, square * deep_vertical + vertical
    else:
        result = _from_series(radius, z, zeta, table)
    return result


@njit(cache=True, fastmath=FAST, forceinline=True)
def bottom_wave(radius: float, z: float, zeta: float, table: FiniteTable) -> tuple[complex, complex, complex, complex]:
    """What the bottom adds to the deep-water wave part, `finite_wave` less K g(K R, K (z + zeta)): a smooth function.

    It has no singularity nearer than the depth, so that one point a panel serves it, and costs half of `finite_wave`.

    Parameters
    ----------
    radius, z, zeta, table
        As in `finite_wave`.

    Returns
    -------
    Value and derivatives by R, z and zeta
        Complex, 1/m and 1/m².
    """
    if radius < table.reach and max(-z, -zeta) <= table.draft:
        result = _from_tables(radius, z, zeta, table)
    else:
        result = _bottom_from_series(radius, z, zeta, table)
    return result
