"""Linear (Airy) waves in water of constant or infinite depth.

    omega² = g k tanh(k d)                                                                           (1)
    eta = Re{a E},   E = exp(i (omega t - k (x cos beta + y sin beta) + phase))                      (2)
    u = Re{omega a E cosh k(z+d) / sinh kd} (cos beta, sin beta),  w = Re{i omega a E sinh k(z+d) / sinh kd}   (3)
    p = Re{rho g a E cosh k(z+d) / cosh kd}                                                          (4)

z is up from mean water level, -d <= z <= 0. Complex amplitudes vary as exp(+i omega t), so that an acceleration is
i omega times a velocity. The depth functions are written in exp(kz) and exp(-2kd), which cannot overflow.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.checks import require_positive
from tlpsim.loads.constants import STANDARD_GRAVITY
from tlpsim.loads.errors import ScenarioError, SolverError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_ITERATIONS = 20
_TOLERANCE = 1e-14


def wavenumber(angular_frequency: ArrayLike, depth: float, gravity: float = STANDARD_GRAVITY) -> FloatArray:
    """Wavenumber k in rad/m, the root of the dispersion relation, eq. (1), by Newton's method.

    Parameters
    ----------
    angular_frequency
        In rad/s, > 0, any shape.
    depth
        In m; infinity for deep water.
    gravity
        In m/s².

    Raises
    ------
    ScenarioError
        If an argument is not positive.
    SolverError
        If the iteration does not converge.
    """
    omega = require_positive("angular frequency of a wave", angular_frequency, "rad/s")
    require_positive("gravity", gravity, "m/s²")
    if not depth > 0.0:
        raise ScenarioError(f"water depth is {depth} m; it must be > 0 (inf for deep water)")
    deep = omega**2 / gravity
    if np.isinf(depth):
        return np.asarray(deep)
    # Newton on x tanh x = c, x = k d: from x = max(c, sqrt c), at most 18 % off anywhere.
    target = deep * depth
    x = np.maximum(target, np.sqrt(target))
    for _ in range(_ITERATIONS):
        tanh = np.tanh(x)
        step = (x * tanh - target) / (tanh + x * (1.0 - tanh**2))
        x = x - step
        if np.all(np.abs(step) <= _TOLERANCE * x):
            return np.asarray(x / depth)
    raise SolverError(f"dispersion relation did not converge in {_ITERATIONS} steps at depth {depth} m")


def _decays(wavenumbers: FloatArray, depth: float, height: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """exp(kz) and exp(-2k(z+d)), shape (n, N), and exp(-2kd), shape (N,)."""
    if np.any(height > 0.0) or np.any(height < -depth):
        outside = float(height[(height > 0.0) | (height < -depth)][0])
        raise ScenarioError(f"linear wave kinematics asked at z = {outside} m; it must be from {-depth} to 0 m")
    surface = np.exp(np.outer(height, wavenumbers))
    if np.isinf(depth):
        return surface, np.zeros_like(surface), np.zeros_like(wavenumbers)
    return surface, np.exp(-2.0 * np.outer(height + depth, wavenumbers)), np.exp(-2.0 * wavenumbers * depth)


def travel(wavenumbers: FloatArray, heading: ArrayLike, x: FloatArray, y: FloatArray) -> ComplexArray:
    """exp(-ik(x cos beta + y sin beta)) at n places for N waves, shape (n, N)."""
    direction = np.broadcast_to(heading, wavenumbers.shape)
    distance = np.outer(x, np.cos(direction)) + np.outer(y, np.sin(direction))
    return np.asarray(np.exp(-1j * wavenumbers * distance))


def velocity_transfer(
    angular_frequency: FloatArray,
    wavenumbers: FloatArray,
    heading: ArrayLike,
    depth: float,
    points: FloatArray,
) -> ComplexArray:
    """Water velocity a unit amplitude, eq. (3).

    Parameters
    ----------
    angular_frequency, wavenumbers
        Shape (N,), rad/s and rad/m.
    heading
        Direction of propagation, scalar or shape (N,), rad.
    depth
        In m; may be infinite.
    points
        Shape (n, 3), m, -depth <= z <= 0.

    Returns
    -------
    Complex amplitudes, shape (n, 3, N), (m/s)/m.

    Raises
    ------
    ScenarioError
        If a point is out of the water.
    """
    surface, bottom, twice = _decays(wavenumbers, depth, points[:, 2])
    wave = angular_frequency * travel(wavenumbers, heading, points[:, 0], points[:, 1]) * surface / (1.0 - twice)
    horizontal = wave * (1.0 + bottom)
    vertical = 1j * wave * (1.0 - bottom)
    return np.stack([horizontal * np.cos(heading), horizontal * np.sin(heading), vertical], axis=1)


def surface_velocity_gradient_transfer(
    angular_frequency: FloatArray,
    wavenumbers: FloatArray,
    heading: ArrayLike,
    depth: float,
    places: FloatArray,
) -> ComplexArray:
    """Change of eq. (3) with height at mean water level, k omega a E (cos beta, sin beta, i coth kd).

    Parameters
    ----------
    angular_frequency, wavenumbers, heading, depth
        As of `velocity_transfer`.
    places
        x and y, shape (n, 2), m.

    Returns
    -------
    Complex amplitudes, shape (n, 3, N), (1/s)/m.
    """
    twice = np.zeros_like(wavenumbers) if np.isinf(depth) else np.exp(-2.0 * wavenumbers * depth)
    wave = wavenumbers * angular_frequency * travel(wavenumbers, heading, places[:, 0], places[:, 1])
    vertical = 1j * wave * (1.0 + twice) / (1.0 - twice)
    return np.stack([wave * np.cos(heading), wave * np.sin(heading), vertical], axis=1)


def pressure_head_transfer(
    wavenumbers: FloatArray, heading: ArrayLike, depth: float, points: FloatArray
) -> ComplexArray:
    """Dynamic pressure over rho g a unit amplitude, eq. (4), shape (n, N), m/m; arguments as `velocity_transfer`.

    Raises
    ------
    ScenarioError
        If a point is out of the water.
    """
    surface, bottom, twice = _decays(wavenumbers, depth, points[:, 2])
    result: ComplexArray = (
        travel(wavenumbers, heading, points[:, 0], points[:, 1]) * surface * (1.0 + bottom) / (1.0 + twice)
    )
    return result
