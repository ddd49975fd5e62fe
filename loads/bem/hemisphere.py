"""The floating hemisphere in deep water by multipoles (Havelock 1955; Hulme 1982): the exact case to check a solver by.

Radius 1, θ from the downward vertical, K = omega²/g. Wave-free multipoles of order m = 0 (heave) or 1 (surge)
and n - m even,

    P_n^m(cos θ) / r^(n+1) + K/(n - m) P_(n-1)^m(cos θ) / r^n                                               (1)

and the source (heave) or horizontal dipole (surge) at the origin,

    2/r + K g(K R, K z),   g = 2 F - 2 π i e^v J0(h),                                                      (2)
    F = e^(-V) [-π/2 (H0(h) + Y0(h)) - ∫_0^V e^s / √(h² + s²) ds],   V = -v                                (3)

make up the radiation potential; their strengths satisfy ∂φ/∂r = n on r = 1 in the least-squares sense.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import special

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(48)
_MULTIPOLES = 24
_STEP = 2e-3


def _wave(h: FloatArray, depth: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """g of eq. (2) and dg/dh by quadrature in u, s = h sinh u."""
    half = 0.5 * np.arcsinh(depth / h)
    u = half[:, None] * (_NODES + 1.0)
    growth = np.exp(h[:, None] * np.sinh(u) - depth[:, None])
    first = (growth @ _WEIGHTS) * half
    second = ((growth / np.cosh(u) ** 2) @ _WEIGHTS) * half / h
    decay = np.exp(-depth)
    value = -0.5 * np.pi * decay * (special.struve(0, h) + special.y0(h)) - first
    slope = -0.5 * np.pi * decay * (2.0 / np.pi - special.struve(1, h) - special.y1(h)) + second
    return (
        2.0 * value - 2j * np.pi * decay * special.j0(h),
        2.0 * slope + 2j * np.pi * decay * special.j1(h),
    )


def _singular(order: int, number: float, radius: FloatArray, theta: FloatArray) -> ComplexArray:
    """Eq. (2), or its derivative by the horizontal distance for the dipole, over cos(azimuth)."""
    across, down = radius * np.sin(theta), radius * np.cos(theta)
    g, g_h = _wave(number * across, number * down)
    if order == 0:
        return 2.0 / radius + number * g
    return -2.0 * across / radius**3 + number**2 * g_h


def _associated(order: int, degree: int, cosine: FloatArray) -> FloatArray:
    return np.asarray(special.lpmv(order, degree, cosine), dtype=np.float64)


def hemisphere_coefficients(order: int, number: float) -> tuple[float, float]:
    """Added mass over ρ 2π/3 a³ and damping over ρ ω 2π/3 a³, of heave (`order` 0) or surge (1), at K a = `number`."""
    nodes, weights = np.polynomial.legendre.leggauss(80)
    theta = 0.25 * np.pi * (nodes + 1.0)
    weights = 0.25 * np.pi * weights * np.sin(theta)
    cosine, one = np.cos(theta), np.ones_like(theta)
    values: list[NDArray] = [_singular(order, number, one, theta)]
    slopes: list[NDArray] = []
    around = [_singular(order, number, one + k * _STEP, theta) for k in (-2, -1, 1, 2)]
    slopes.append((around[0] - 8.0 * around[1] + 8.0 * around[2] - around[3]) / (12.0 * _STEP))
    for j in range(1, _MULTIPOLES + 1):
        n = 2 * j + order
        outer, inner = _associated(order, n, cosine), _associated(order, n - 1, cosine) * number / (n - order)
        size = float(np.max(np.abs(outer)))
        values.append((outer + inner) / size)
        slopes.append(-((n + 1) * outer + n * inner) / size)
    pattern = np.cos(theta) if order == 0 else np.sin(theta)
    root = np.sqrt(weights)
    strengths = np.linalg.lstsq(np.stack(slopes, 1) * root[:, None], pattern * root, rcond=None)[0]
    potential = np.stack(values, 1) @ strengths
    integral = np.sum(potential * pattern * weights) * (2.0 * np.pi if order == 0 else np.pi)
    result = integral / (2.0 / 3.0 * np.pi)
    return float(-result.real), float(result.imag)
