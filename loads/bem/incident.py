"""Plane waves on panels: the incident wave that excites a body and the test waves of its far field.

    φ_I = (i g / ω) f(z) exp(-i k (x cos β + y sin β)),   f(z) = cosh k(z + h) / cosh kh                        (1)
    I(θ) = ∫ (φ ∂ψ/∂n - φ_n ψ) dS,   ψ = f(z) exp(i k (x cos θ + y sin θ))                                      (2)

The depth function is written in exp(kz) and exp(-2k(z + h)), which cannot overflow.
"""

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@njit(cache=True)
def depth_function(wavenumber: float, z: float, depth: float) -> tuple[float, float]:
    """f(z) of eq. (1) and its derivative over k; depth may be infinite."""
    decay = np.exp(wavenumber * z)
    back = np.exp(-2.0 * wavenumber * (z + depth))
    scale = decay / (1.0 + np.exp(-2.0 * wavenumber * depth))
    return scale * (1.0 + back), scale * (1.0 - back)


@njit(cache=True, parallel=True)
def panel_waves(places, weights, normal, images, wavenumber, depth, headings):  # type: ignore[no-untyped-def]
    """Means over panels of ψ(β + π) = f exp(-i k (x cos β + y sin β)) and of its normal derivative.

    `places` (panels, q, 3) with `weights` (panels, q) of sum 1; both results are (images, panels, headings).
    """
    order, count, columns = images.shape[0], places.shape[0], headings.shape[0]
    value = np.zeros((order, count, columns), dtype=np.complex128)
    slope = np.zeros((order, count, columns), dtype=np.complex128)
    for p in prange(count):
        for q in range(places.shape[1]):
            even, odd = depth_function(wavenumber, places[p, q, 2], depth)
            for s in range(order):
                x, y = images[s, 0] * places[p, q, 0], images[s, 1] * places[p, q, 1]
                for h in range(columns):
                    cosine, sine = np.cos(headings[h]), np.sin(headings[h])
                    wave = weights[p, q] * np.exp(-1j * wavenumber * (x * cosine + y * sine))
                    value[s, p, h] += even * wave
                    across = images[s, 0] * normal[p, 0] * cosine + images[s, 1] * normal[p, 1] * sine
                    slope[s, p, h] += wavenumber * wave * (odd * normal[p, 2] - 1j * even * across)
    return value, slope


@njit(cache=True, parallel=True)
def far_integrals(  # type: ignore[no-untyped-def]
    places, weights, normal, images, wavenumber, depth, directions, potential, normal_velocity
):
    """I(θ) of eq. (2) and dI/dθ, (directions, columns), of potentials (images, panels, columns).

    `weights` (panels, q) are areas in m²; `normal_velocity` is φ_n.
    """
    count, columns = places.shape[0], potential.shape[2]
    result = np.zeros((directions.shape[0], columns), dtype=np.complex128)
    turned = np.zeros((directions.shape[0], columns), dtype=np.complex128)
    for d in prange(directions.shape[0]):
        cosine, sine = np.cos(directions[d]), np.sin(directions[d])
        for p in range(count):
            for q in range(places.shape[1]):
                even, odd = depth_function(wavenumber, places[p, q, 2], depth)
                for s in range(images.shape[0]):
                    x, y = images[s, 0] * places[p, q, 0], images[s, 1] * places[p, q, 1]
                    n_x, n_y = images[s, 0] * normal[p, 0], images[s, 1] * normal[p, 1]
                    wave = weights[p, q] * np.exp(1j * wavenumber * (x * cosine + y * sine))
                    value = even * wave
                    slope = wavenumber * wave * (odd * normal[p, 2] + 1j * even * (n_x * cosine + n_y * sine))
                    swing = 1j * wavenumber * (y * cosine - x * sine)
                    slope_turn = swing * slope + 1j * wavenumber * (n_y * cosine - n_x * sine) * value
                    for c in range(columns):
                        result[d, c] += potential[s, p, c] * slope - normal_velocity[s, p, c] * value
                        turned[d, c] += potential[s, p, c] * slope_turn - normal_velocity[s, p, c] * swing * value
    return result, turned
