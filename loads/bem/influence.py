"""Influence matrices of the wave part of the Green function, for every symmetry class of a mesh at once.

A mesh with m images under its reflections s has m classes (characters chi); potentials of a class satisfy
phi(s x) = chi(s) phi(x), so that one full system falls apart into m systems of the stored panels:

    S_chi[i, j] = Σ_s chi(s) ∫_j G(s x_i, ξ) dS,    D_chi[i, j] = Σ_s chi(s) ∫_j ∂G/∂n_ξ (s x_i, ξ) dS           (1)

The wave part is taken at the panels' centres, one call for the pair (i, j) and its mirror (j, i); where its image
singularity is near in panel diagonals, or the panel long against the wave, by 2 x 2 or 4 x 4 Gauss points.
All matrices are stored transposed, [class, source, field], so that a class is a Fortran-ordered system for LAPACK.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numba
import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from tlpsim.loads.bem.green import deep_table, deep_wave, finite_table, finite_wave
from tlpsim.loads.bem.mesh import Panels

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IntegerArray = NDArray[np.int64]

FAST = {"nsz", "arcp", "contract", "afn", "reassoc"}  # without the assumption that nothing is NaN or infinite
_TILE = 16
NEAR = 4.0  # panel diagonals from the image within which 2 x 2 points are taken
NEXT = 1.0  # and 4 x 4 points


@dataclass(frozen=True, slots=True, kw_only=True)
class Quadrature:
    """Gauss points of panels: places (n, points, 3) and weights (n, points) in m²."""

    places: FloatArray
    weights: FloatArray


def quadrature(panels: Panels, order: int) -> Quadrature:
    """order x order Gauss points on the bilinear map of every panel."""
    x, w = np.polynomial.legendre.leggauss(order)
    u, v = (0.5 + 0.5 * axis.ravel() for axis in np.meshgrid(x, x))
    a, b, c, d = (panels.corners[:, k, None, :] for k in range(4))
    u, v = u[None, :, None], v[None, :, None]
    places = (1 - u) * (1 - v) * a + u * (1 - v) * b + u * v * c + (1 - u) * v * d
    normal = np.cross((1 - v) * (b - a) + v * (c - d), (1 - u) * (d - a) + u * (c - b))
    weights = 0.25 * np.outer(w, w).ravel() * np.abs(np.einsum("pqk,pk->pq", normal, panels.normal))
    return Quadrature(places=places, weights=weights)


@njit(cache=True, parallel=True)
def near_images(centre, size, images, inner, outer):  # type: ignore[no-untyped-def]
    """Bits (field, source): images of the pair whose surface image is `inner` to `outer` source diagonals away."""
    count = centre.shape[0]
    result = np.zeros((count, count), dtype=np.int64)
    for i in prange(count):
        for j in range(count):
            for s in range(images.shape[0]):
                dx = images[s, 0] * centre[i, 0] - centre[j, 0]
                dy = images[s, 1] * centre[i, 1] - centre[j, 1]
                dz = centre[i, 2] + centre[j, 2]
                square = dx * dx + dy * dy + dz * dz
                if (inner * size[j]) ** 2 <= square < (outer * size[j]) ** 2:
                    result[i, j] |= 1 << s
    return result


def rules(panels: Panels, images: FloatArray) -> tuple[tuple[IntegerArray, Quadrature], ...]:
    """Near pairs (pairs, 3) of field, source and bits of the near images, with the Gauss points that they need."""
    result = []
    for inner, outer, order in ((NEXT, NEAR, 2), (0.0, NEXT, 4)):
        bits = near_images(panels.centre, panels.size, images, inner, outer)
        field, source = np.nonzero(bits)
        result.append((np.stack([field, source, bits[field, source]], axis=1), quadrature(panels, order)))
    return tuple(result)


def tiles(count: int) -> IntegerArray:
    """Lower corners (tiles, 2) of the square blocks on and above the diagonal."""
    first, second = np.triu_indices(-(-count // _TILE))
    return np.stack([first * _TILE, second * _TILE], axis=1).astype(np.int64)


@njit(cache=True, parallel=True, fastmath=FAST)
def deep_matrices(  # type: ignore[no-untyped-def]
    centre, normal, area, images, characters, corners, wavenumber, table, rankine, single, double
):
    """Fill S and -D of eq. (1), (classes, source, field): `rankine` (2, ...) and the deep wave part at the centres."""
    count, order = centre.shape[0], images.shape[0]
    for t in prange(corners.shape[0]):
        forward = np.empty((3, order), dtype=np.complex128)
        for i in range(corners[t, 0], min(corners[t, 0] + _TILE, count)):
            for j in range(max(i, corners[t, 1]), min(corners[t, 1] + _TILE, count)):
                v = wavenumber * (centre[i, 2] + centre[j, 2])
                for s in range(order):
                    dx = images[s, 0] * centre[i, 0] - centre[j, 0]
                    dy = images[s, 1] * centre[i, 1] - centre[j, 1]
                    distance = np.sqrt(dx * dx + dy * dy)
                    g, g_h, g_v = deep_wave(wavenumber * distance, v, table)
                    slope = g_h / distance if distance > 0.0 else 0.0j
                    forward[0, s] = wavenumber * g
                    # The source moves against the distance; seen the other way, the mirrored distance is reversed.
                    forward[1, s] = wavenumber**2 * (
                        g_v * normal[j, 2] - slope * (dx * normal[j, 0] + dy * normal[j, 1])
                    )
                    forward[2, s] = wavenumber**2 * (
                        g_v * normal[i, 2]
                        + slope * (images[s, 0] * dx * normal[i, 0] + images[s, 1] * dy * normal[i, 1])
                    )
                for c in range(order):
                    value = 0.0j
                    there = 0.0j
                    back = 0.0j
                    for s in range(order):
                        value += characters[c, s] * forward[0, s]
                        there += characters[c, s] * forward[1, s]
                        back += characters[c, s] * forward[2, s]
                    single[c, j, i] = rankine[0, c, j, i] + value * area[j]
                    double[c, j, i] = -rankine[1, c, j, i] - there * area[j]
                    single[c, i, j] = rankine[0, c, i, j] + value * area[i]
                    double[c, i, j] = -rankine[1, c, i, j] - back * area[i]


@njit(cache=True, parallel=True, fastmath=FAST)
def deep_near(  # type: ignore[no-untyped-def]
    pairs, centre, normal, area, images, characters, places, weights, wavenumber, table, single, double
):
    """Correct the entries of near pairs (field, source, bits of images): Gauss points instead of the centre."""
    order = images.shape[0]
    for p in prange(pairs.shape[0]):
        i, j, bits = pairs[p, 0], pairs[p, 1], pairs[p, 2]
        for s in range(order):
            if not bits & (1 << s):
                continue
            value = 0.0j
            slope = 0.0j
            for q in range(-1, places.shape[1]):
                x, y, z = centre[j, 0], centre[j, 1], centre[j, 2]
                weight = -area[j]
                if q >= 0:
                    x, y, z = places[j, q, 0], places[j, q, 1], places[j, q, 2]
                    weight = weights[j, q]
                dx = images[s, 0] * centre[i, 0] - x
                dy = images[s, 1] * centre[i, 1] - y
                distance = np.sqrt(dx * dx + dy * dy)
                g, g_h, g_v = deep_wave(wavenumber * distance, wavenumber * (centre[i, 2] + z), table)
                ratio = g_h / distance if distance > 0.0 else 0.0j
                value += wavenumber * weight * g
                slope += wavenumber**2 * weight * (g_v * normal[j, 2] - ratio * (dx * normal[j, 0] + dy * normal[j, 1]))
            for c in range(order):
                single[c, j, i] += characters[c, s] * value
                double[c, j, i] -= characters[c, s] * slope


@njit(cache=True, nogil=True, fastmath=FAST)
def finite_matrices(  # type: ignore[no-untyped-def]
    centre, normal, area, images, characters, corners, table, rankine, single, double
):
    """As `deep_matrices` with the finite-depth wave part; its derivative by a height only for panels that tilt.

    For threads of its own on parts of `corners`: a loop in parallel takes no table with a table inside.
    """
    count, order = centre.shape[0], images.shape[0]
    for t in range(corners.shape[0]):
        forward = np.empty((3, order), dtype=np.complex128)
        for i in range(corners[t, 0], min(corners[t, 0] + _TILE, count)):
            for j in range(max(i, corners[t, 1]), min(corners[t, 1] + _TILE, count)):
                for s in range(order):
                    dx = images[s, 0] * centre[i, 0] - centre[j, 0]
                    dy = images[s, 1] * centre[i, 1] - centre[j, 1]
                    distance = np.sqrt(dx * dx + dy * dy)
                    g, g_r, g_i = finite_wave(distance, centre[i, 2], centre[j, 2], table)
                    g_j = g_i
                    if normal[j, 2] != 0.0 and centre[i, 2] != centre[j, 2]:
                        _, _, g_j = finite_wave(distance, centre[j, 2], centre[i, 2], table)
                    slope = g_r / distance if distance > 0.0 else 0.0j
                    forward[0, s] = g
                    forward[1, s] = g_j * normal[j, 2] - slope * (dx * normal[j, 0] + dy * normal[j, 1])
                    forward[2, s] = g_i * normal[i, 2] + slope * (
                        images[s, 0] * dx * normal[i, 0] + images[s, 1] * dy * normal[i, 1]
                    )
                for c in range(order):
                    value = 0.0j
                    there = 0.0j
                    back = 0.0j
                    for s in range(order):
                        value += characters[c, s] * forward[0, s]
                        there += characters[c, s] * forward[1, s]
                        back += characters[c, s] * forward[2, s]
                    single[c, j, i] = rankine[0, c, j, i] + value * area[j]
                    double[c, j, i] = -rankine[1, c, j, i] - there * area[j]
                    single[c, i, j] = rankine[0, c, i, j] + value * area[i]
                    double[c, i, j] = -rankine[1, c, i, j] - back * area[i]


def fill(
    panels: Panels,
    images: FloatArray,
    characters: FloatArray,
    near: tuple[tuple[IntegerArray, Quadrature], ...],
    wavenumber: float,
    depth: float,
    rankine: FloatArray,
) -> tuple[ComplexArray, ComplexArray]:
    """S and -D of eq. (1), (classes, source, field), with K = `wavenumber`.

    Parameters
    ----------
    near
        Near pairs and the quadrature to use for them, of `rules`.
    rankine
        (2, classes, source, field): single and double layer of the Rankine terms.
    """
    table = deep_table()
    single, double = (np.empty(rankine.shape[1:], dtype=np.complex128) for _ in range(2))
    geometry = (panels.centre, panels.normal)
    blocks = tiles(len(panels.area))
    shared = (*geometry, panels.area, images, characters, blocks)
    if np.isfinite(depth):
        span = np.max(np.abs(panels.centre[:, :2]), axis=0)
        if len(images) == 1:
            span = np.ptp(panels.centre[:, :2], axis=0) / 2.0
        reach = 2.0 * float(np.hypot(*span)) * (1.0 + 1e-9)
        bottom = finite_table(wavenumber, depth, reach, -float(np.min(panels.centre[:, 2])) * (1.0 + 1e-9))
        threads = numba.get_num_threads()

        def work(part: int) -> None:
            finite_matrices(*shared[:-1], blocks[part::threads], bottom, rankine, single, double)

        with ThreadPoolExecutor(max_workers=threads) as workers:
            list(workers.map(work, range(threads)))
    else:
        deep_matrices(*shared, wavenumber, table, rankine, single, double)
    # Only the deep part varies fast near its image; what the bottom adds is smooth.
    for pairs, rule in near:
        places = (rule.places, rule.weights)
        deep_near(pairs, *geometry, panels.area, images, characters, *places, wavenumber, table, single, double)
    return single, double
