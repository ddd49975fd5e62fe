"""Potential, velocity, pressure and free-surface elevation at points in the water, from the potentials on the hull.

With φ the total potential on the hull and φ_n its normal velocity, n out of the body, amplitudes exp(+i omega t),

    φ(x) = φ_I(x) + 1/(4 π) ∫ (φ ∂G/∂n_ξ - φ_n G) dS                                                        (1)
    p = -i ω ρ φ,   η = -i ω / g φ(z = 0)                                                                   (2)

and the velocity is the gradient of (1). For a panel with edges of length l from a to b (seen from x, r_a = |a|), outer
edge normals ν in the panel's plane, and Ω its solid angle (`tlpsim.loads.bem.rankine`),

    ∇ ∫ 1/r dS = -Σ ν ln((r_a + r_b + l) / (r_a + r_b - l)) - n Ω                                           (3)
    ∇ ∫ ∂/∂n_ξ (1/r) dS = -Σ (a × b) (r_a + r_b) / (r_a r_b (r_a r_b + a·b))                                 (4)

(Hess and Smith 1964; (4) is the law of Biot and Savart for the edges). The second derivatives of the deep wave part
g(h, v) follow from the first, d² = h² + v²:

    g_vv = g_v - 2 v/d³,   g_hv = g_h - 2 h/d³,   g_hh = -g_h/h - g_vv                                      (5)

What the bottom adds is smooth, and its second derivatives are central differences of its first.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise

import numba
import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.bem.discretization import Discretization
from tlpsim.loads.bem.green import bottom_wave, deep_table, deep_wave, finite_table
from tlpsim.loads.bem.incident import depth_function
from tlpsim.loads.bem.rankine import panel_integrals
from tlpsim.loads.bem.response import total_potential
from tlpsim.loads.bem.solver import Solution
from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

NEAR_IMAGE = 4.0
"""Panel diagonals from a panel's surface image within which its wave part is taken at 2 x 2 points."""
FAR = 4.0
"""Panel diagonals from which 2 x 2 points replace the closed forms: below `rankine.FAR`, where those use multipoles."""
_STEP = 0.01  # of the depth or of 1/K, of the differences of the bottom's part
_MARGIN = 1.0 + 1e-6
_TOUCH = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldValues:
    """First-order field at points, for waves of unit amplitude.

    Attributes
    ----------
    points
        (points, 3) in m.
    potential, pressure, elevation
        (points, headings) complex, in m²/s, Pa (without the hydrostatic pressure) and m, per m. The elevation is
        eq. (2) with the potential at the point: the surface's only for points at z = 0.
    velocity
        (points, headings, 3) complex, in 1/s.
    """

    points: FloatArray
    potential: ComplexArray
    velocity: ComplexArray
    pressure: ComplexArray
    elevation: ComplexArray


@njit(cache=True)
def panel_gradients(x, y, z, corners, normal, angle):  # type: ignore[no-untyped-def]
    """Gradients (3,), (3,) of both integrals of `rankine.panel_integrals` at (x, y, z), eqs. (3), (4).

    `angle` is the second of the integrals, the solid angle Ω.
    """
    single = -angle * normal
    double = np.zeros(3)
    for k in range(4):
        m = (k + 1) % 4
        ax, ay, az = corners[k, 0] - x, corners[k, 1] - y, corners[k, 2] - z
        bx, by, bz = corners[m, 0] - x, corners[m, 1] - y, corners[m, 2] - z
        ex, ey, ez = bx - ax, by - ay, bz - az
        length = np.sqrt(ex * ex + ey * ey + ez * ez)
        ra = np.sqrt(ax * ax + ay * ay + az * az)
        rb = np.sqrt(bx * bx + by * by + bz * bz)
        if length < _TOUCH * (ra + rb):
            continue
        # The outer normal of an anticlockwise edge is e × n / l.
        factor = np.log((ra + rb + length) / max(ra + rb - length, _TOUCH * length)) / length
        single[0] -= factor * (ey * normal[2] - ez * normal[1])
        single[1] -= factor * (ez * normal[0] - ex * normal[2])
        single[2] -= factor * (ex * normal[1] - ey * normal[0])
        product = ra * rb
        along = product + ax * bx + ay * by + az * bz
        strength = (ra + rb) / (product * max(along, _TOUCH * product))
        double[0] -= strength * (ay * bz - az * by)
        double[1] -= strength * (az * bx - ax * bz)
        double[2] -= strength * (ax * by - ay * bx)
    return single, double


@njit(cache=True, nogil=True)
def _rankine_field(  # type: ignore[no-untyped-def]
    points, images, corners, normal, centre, size, places, weights, sign_z, shift, potential, speed, value, gradient
):
    """Add the terms of 1/r seen from (x, y, sign_z z + shift), with gradients by x, y and z.

    Beyond `FAR` panel diagonals by the panels' Gauss points, which are then good to 1e-6.
    """
    columns = potential.shape[2]
    moments = np.zeros(6)
    single, double = np.zeros(3), np.zeros(3)
    for p in range(points.shape[0]):
        z = sign_z * points[p, 2] + shift
        for s in range(images.shape[0]):
            x, y = images[s, 0] * points[p, 0], images[s, 1] * points[p, 1]
            for j in range(centre.shape[0]):
                dx, dy, dz = x - centre[j, 0], y - centre[j, 1], z - centre[j, 2]
                if dx * dx + dy * dy + dz * dz < (FAR * size[j]) ** 2:
                    source, dipole = panel_integrals(x, y, z, corners[j], normal[j], centre[j], 0.0, size[j], moments)
                    single, double = panel_gradients(x, y, z, corners[j], normal[j], dipole)
                else:
                    source, dipole = 0.0, 0.0
                    single[:], double[:] = 0.0, 0.0
                    for q in range(places.shape[1]):
                        dx, dy, dz = x - places[j, q, 0], y - places[j, q, 1], z - places[j, q, 2]
                        inverse2 = 1.0 / (dx * dx + dy * dy + dz * dz)
                        inverse = weights[j, q] * np.sqrt(inverse2)
                        cube = inverse * inverse2
                        height = dx * normal[j, 0] + dy * normal[j, 1] + dz * normal[j, 2]
                        source += inverse
                        dipole += cube * height
                        fifth = 3.0 * cube * height * inverse2
                        single[0] -= cube * dx
                        single[1] -= cube * dy
                        single[2] -= cube * dz
                        double[0] += cube * normal[j, 0] - fifth * dx
                        double[1] += cube * normal[j, 1] - fifth * dy
                        double[2] += cube * normal[j, 2] - fifth * dz
                for c in range(columns):
                    phi, rate = potential[s, j, c], speed[s, j, c]
                    value[p, c] += phi * dipole - rate * source
                    gradient[p, c, 0] += images[s, 0] * (phi * double[0] - rate * single[0])
                    gradient[p, c, 1] += images[s, 1] * (phi * double[1] - rate * single[1])
                    gradient[p, c, 2] += sign_z * (phi * double[2] - rate * single[2])


@njit(cache=True, nogil=True)
def _deep_field(  # type: ignore[no-untyped-def]
    points, images, normal, centre, area, size, places, weights, number, table, potential, speed, value, gradient
):
    """Add the deep wave part, by one point a panel or, near its surface image, by its Gauss points."""
    columns, order = potential.shape[2], places.shape[1]
    for p in range(points.shape[0]):
        z = points[p, 2]
        for s in range(images.shape[0]):
            x, y = images[s, 0] * points[p, 0], images[s, 1] * points[p, 1]
            for j in range(centre.shape[0]):
                dx, dy, dz = x - centre[j, 0], y - centre[j, 1], z + centre[j, 2]
                near = dx * dx + dy * dy + dz * dz < (NEAR_IMAGE * size[j]) ** 2
                n_x, n_y, n_z = normal[j, 0], normal[j, 1], normal[j, 2]
                source, dipole = 0.0j, 0.0j
                s_x, s_y, s_z, d_x, d_y, d_z = 0.0j, 0.0j, 0.0j, 0.0j, 0.0j, 0.0j
                for q in range(order if near else 1):
                    weight = area[j]
                    if near:
                        dx, dy, dz = x - places[j, q, 0], y - places[j, q, 1], z + places[j, q, 2]
                        weight = weights[j, q]
                    across = np.sqrt(dx * dx + dy * dy)
                    h, v = number * across, number * dz
                    g, g_h, g_v = deep_wave(h, v, table)
                    cube = 2.0 / (h * h + v * v) ** 1.5
                    g_vv, g_hv = g_v - v * cube, g_h - h * cube
                    e_x, e_y, ratio = 1.0, 0.0, -0.5 * g_vv
                    if across > 0.0:
                        e_x, e_y, ratio = dx / across, dy / across, g_h / h
                    g_hh = -ratio - g_vv
                    towards = e_x * n_x + e_y * n_y
                    first, second, third = weight * number, weight * number**2, weight * number**3
                    source += first * g
                    s_x += second * g_h * e_x
                    s_y += second * g_h * e_y
                    s_z += second * g_v
                    dipole += second * (g_v * n_z - g_h * towards)
                    radial = g_hv * n_z - (g_hh - ratio) * towards
                    d_x += third * (radial * e_x - ratio * n_x)
                    d_y += third * (radial * e_y - ratio * n_y)
                    d_z += third * (g_vv * n_z - g_hv * towards)
                for c in range(columns):
                    phi, rate = potential[s, j, c], speed[s, j, c]
                    value[p, c] += phi * dipole - rate * source
                    gradient[p, c, 0] += images[s, 0] * (phi * d_x - rate * s_x)
                    gradient[p, c, 1] += images[s, 1] * (phi * d_y - rate * s_y)
                    gradient[p, c, 2] += phi * d_z - rate * s_z


@njit(cache=True, nogil=True)
def _bottom_field(  # type: ignore[no-untyped-def]
    points, images, normal, centre, area, step, table, potential, speed, value, gradient
):
    """Add what the bottom adds to the wave part, B(R, z, ζ), without its Rankine term; B_RR by Laplace's equation."""
    columns = potential.shape[2]
    for p in range(points.shape[0]):
        z = points[p, 2]
        # The tables' polynomials go on a step above still water, but nothing does below the bottom.
        low = max(z - step, -table.depth)
        width = z + step - low
        for s in range(images.shape[0]):
            x, y = images[s, 0] * points[p, 0], images[s, 1] * points[p, 1]
            for j in range(centre.shape[0]):
                dx, dy, zeta = x - centre[j, 0], y - centre[j, 1], centre[j, 2]
                n_x, n_y, n_z = normal[j, 0], normal[j, 1], normal[j, 2]
                across = np.sqrt(dx * dx + dy * dy)
                source, b_r, b_z, b_s = bottom_wave(across, z, zeta, table)
                _, over_r, over_z, over_s = bottom_wave(across, z + step, zeta, table)
                _, under_r, under_z, under_s = bottom_wave(across, low, zeta, table)
                b_rz, b_zz, b_zs = (over_r - under_r) / width, (over_z - under_z) / width, (over_s - under_s) / width
                e_x, e_y, ratio, b_rs = 1.0, 0.0, -0.5 * b_zz, 0.0j
                if across > step:
                    outward = bottom_wave(across + step, z, zeta, table)[3]
                    inward = bottom_wave(across - step, z, zeta, table)[3]
                    b_rs = (outward - inward) / (2.0 * step)
                elif across > 0.0:
                    # B is even in R.
                    b_rs = across / step * (bottom_wave(step, z, zeta, table)[3] - b_s) * 2.0 / step
                if across > 0.0:
                    e_x, e_y, ratio = dx / across, dy / across, b_r / across
                towards = e_x * n_x + e_y * n_y
                dipole = b_s * n_z - b_r * towards
                radial = b_rs * n_z - (-2.0 * ratio - b_zz) * towards
                d_x, d_y = radial * e_x - ratio * n_x, radial * e_y - ratio * n_y
                d_z = b_zs * n_z - b_rz * towards
                for c in range(columns):
                    phi, rate = area[j] * potential[s, j, c], area[j] * speed[s, j, c]
                    value[p, c] += phi * dipole - rate * source
                    gradient[p, c, 0] += images[s, 0] * (phi * d_x - rate * b_r * e_x)
                    gradient[p, c, 1] += images[s, 1] * (phi * d_y - rate * b_r * e_y)
                    gradient[p, c, 2] += phi * d_z - rate * b_z


def incident_field(
    points: FloatArray, wavenumber: float, omega: float, depth: float, headings: FloatArray, gravity: float
) -> tuple[ComplexArray, ComplexArray]:
    """φ_I (points, headings) and its gradient (points, headings, 3) for waves of unit amplitude."""
    along = np.stack([np.cos(headings), np.sin(headings)])
    wave = 1j * gravity / omega * np.exp(-1j * wavenumber * (points[:, :2] @ along))
    shape = np.array([depth_function(wavenumber, z, depth) for z in points[:, 2]]).reshape(-1, 2)
    value = wave * shape[:, :1]
    horizontal = -1j * wavenumber * value[..., None] * along.T
    return value, np.concatenate([horizontal, (wavenumber * wave * shape[:, 1:])[..., None]], axis=-1)


def field(discretization: Discretization, solution: Solution, motion: ArrayLike, points: ArrayLike) -> FieldValues:
    """Incident, diffracted and radiated wave at points in the water, eqs. (1), (2).

    Parameters
    ----------
    discretization, solution
        The body and its potentials at one frequency.
    motion
        Response amplitudes (headings, modes) per m of wave amplitude, in m and rad; zero for a fixed body.
    points
        (points, 3) in m, between bottom and still water and outside the body. Nearer to the hull than half the size
        of its panels the field shows the panels.

    Raises
    ------
    ScenarioError
        If a point lies above still water or below the bottom, or the motion does not fit the solution.
    """
    where = np.ascontiguousarray(np.atleast_2d(np.asarray(points, dtype=np.float64)))
    if where.ndim != 2 or where.shape[1] != 3:
        raise ScenarioError(f"points have shape {where.shape}; (points, 3) is needed")
    outside = (where[:, 2] > 0.0) | (where[:, 2] < -solution.depth)
    if np.any(outside):
        raise ScenarioError(
            f"field point at z = {where[outside, 2][0]:.4g} m; it must lie between -{solution.depth} m and still water"
        )
    potential, speed = total_potential(discretization, solution, motion)
    value, gradient = incident_field(
        where, solution.wavenumber, solution.omega, solution.depth, solution.headings, solution.gravity
    )
    scattered, flow = _scattered(discretization, solution, where, potential, speed)
    value += scattered / (4.0 * np.pi)
    gradient += flow / (4.0 * np.pi)
    return FieldValues(
        points=where,
        potential=value,
        velocity=gradient,
        pressure=-1j * solution.omega * solution.density * value,
        elevation=-1j * solution.omega / solution.gravity * value,
    )


def _scattered(
    discretization: Discretization, solution: Solution, where: FloatArray, potential: ComplexArray, speed: ComplexArray
) -> tuple[ComplexArray, ComplexArray]:
    """The integral of eq. (1) and its gradient, on all threads."""
    hull, both, images = discretization.hull_count, discretization.panels, discretization.images
    normal, centre, area, size, corners = (
        np.ascontiguousarray(a[:hull]) for a in (both.normal, both.centre, both.area, both.size, both.corners)
    )
    rule = discretization.outer
    places, weights = np.ascontiguousarray(rule.places[:hull]), np.ascontiguousarray(rule.weights[:hull])
    number = solution.omega**2 / solution.gravity
    shape = (len(where), potential.shape[2])
    value, gradient = np.zeros(shape, dtype=np.complex128), np.zeros((*shape, 3), dtype=np.complex128)
    amplitudes = (np.ascontiguousarray(potential), np.ascontiguousarray(speed))
    shared = (images, corners, normal, centre, size)
    gauss = (places, weights)
    middles = (np.ascontiguousarray(centre[:, None, :]), np.ascontiguousarray(area[:, None]))
    table = deep_table()
    step = _STEP * min(solution.depth, 1.0 / number)
    bottom = None
    if np.isfinite(solution.depth):
        extent = np.max(np.abs(centre[:, :2]), axis=0) + np.max(np.abs(where[:, :2]), axis=0) + step
        deepest = max(-float(np.min(centre[:, 2])), -float(np.min(where[:, 2])) + step)
        reach = float(np.hypot(*extent)) * _MARGIN
        bottom = finite_table(number, solution.depth, reach, min(deepest * _MARGIN, solution.depth))

    def work(part: slice) -> None:
        here, to = where[part], (value[part], gradient[part])
        _rankine_field(here, *shared, *gauss, 1.0, 0.0, *amplitudes, *to)
        _rankine_field(here, *shared, *gauss, -1.0, 0.0, *amplitudes, *to)
        _deep_field(here, images, normal, centre, area, size, places, weights, number, table, *amplitudes, *to)
        if bottom is not None:
            _rankine_field(here, *shared, *middles, -1.0, -2.0 * solution.depth, *amplitudes, *to)
            _bottom_field(here, images, normal, centre, area, step, bottom, *amplitudes, *to)

    threads = numba.get_num_threads()
    edges = np.linspace(0, len(where), threads + 1).astype(int)
    with ThreadPoolExecutor(max_workers=threads) as workers:
        list(workers.map(work, [slice(a, b) for a, b in pairwise(edges)]))
    return value, gradient
