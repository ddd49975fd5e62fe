"""Integrals of 1/r and of its normal derivative over flat panels, in closed form.

For a panel in a plane at signed height h = n · (x - c) under the field point x, with edges from a to b of length l at
signed distance d (positive inside) from the point's projection,

    ∫ 1/r dS = Σ d ln((r_a + r_b + l) / (r_a + r_b - l)) - h Ω                                              (1)
    ∫ ∂/∂n_ξ (1/r) dS = Ω                                                                                   (2)

where Ω is the solid angle of the panel with the sign of h, from its two triangles by
tan(Ω/2) = u · (v × w) / (u v w + ...) (van Oosterom and Strackee 1983); (1) is that of Hess and Smith (1964) and
Newman (1986). Far away both follow from the panel's area and second moments.
"""

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

FAR = 8.0
"""Distance of a point, in panel diagonals, from which the multipole replaces (1) and (2): 1e-6 relative."""
APART = 4.0
"""Distance of two panels, in the larger one's diagonals, from which the multipole takes both panels' moments."""


@njit(cache=True)
def _solid_angle(ux, uy, uz, vx, vy, vz, wx, wy, wz, nu, nv, nw):  # type: ignore[no-untyped-def]
    """Solid angle of a triangle with corners u, v, w from the field point, positive if seen anticlockwise."""
    triple = ux * (vy * wz - vz * wy) + uy * (vz * wx - vx * wz) + uz * (vx * wy - vy * wx)
    below = (
        nu * nv * nw
        + (ux * vx + uy * vy + uz * vz) * nw
        + (ux * wx + uy * wy + uz * wz) * nv
        + (vx * wx + vy * wy + vz * wz) * nu
    )
    return -2.0 * np.arctan2(triple, below)


@njit(cache=True)
def _multipole(dx, dy, dz, area, normal, xx, yy, zz, xy, xz, yz):  # type: ignore[no-untyped-def]
    """Both integrals over a far panel, by its area and second moments."""
    height = dx * normal[0] + dy * normal[1] + dz * normal[2]
    inverse2 = 1.0 / (dx * dx + dy * dy + dz * dz)
    inverse = np.sqrt(inverse2)
    trace = xx + yy + zz
    qx = xx * dx + xy * dy + xz * dz
    qy = xy * dx + yy * dy + yz * dz
    qz = xz * dx + yz * dy + zz * dz
    quadratic = (qx * dx + qy * dy + qz * dz) * inverse2
    inverse3 = inverse * inverse2
    source = area * inverse + 0.5 * inverse3 * (3.0 * quadratic - trace)
    cross = qx * normal[0] + qy * normal[1] + qz * normal[2]
    dipole = inverse3 * (area * height + inverse2 * (1.5 * height * (5.0 * quadratic - trace) - 3.0 * cross))
    return source, dipole


@njit(cache=True)
def panel_integrals(x, y, z, corners, normal, centre, area, size, moments):  # type: ignore[no-untyped-def]
    """∫ 1/r dS and ∫ ∂/∂n_ξ 1/r dS over one panel, eqs. (1), (2), seen from (x, y, z).

    `corners` (4, 3) are anticlockwise about `normal`; `moments` (6,) are the second moments xx, yy, zz, xy, xz, yz.
    In the panel itself the second integral is its principal value, zero.
    """
    dx, dy, dz = x - centre[0], y - centre[1], z - centre[2]
    if dx * dx + dy * dy + dz * dz > (FAR * size) ** 2:
        return _multipole(
            dx, dy, dz, area, normal, moments[0], moments[1], moments[2], moments[3], moments[4], moments[5]
        )
    return _closed_form(x, y, z, corners, normal, centre, size)


@njit(cache=True)
def _closed_form(x, y, z, corners, normal, centre, size):  # type: ignore[no-untyped-def]
    """Eqs. (1) and (2)."""
    height = (x - centre[0]) * normal[0] + (y - centre[1]) * normal[1] + (z - centre[2]) * normal[2]
    source = 0.0
    for k in range(4):
        m = (k + 1) % 4
        ax, ay, az = corners[k, 0] - x, corners[k, 1] - y, corners[k, 2] - z
        bx, by, bz = corners[m, 0] - x, corners[m, 1] - y, corners[m, 2] - z
        ex, ey, ez = bx - ax, by - ay, bz - az
        length = np.sqrt(ex * ex + ey * ey + ez * ez)
        if length < 1e-12 * size:
            continue
        ra = np.sqrt(ax * ax + ay * ay + az * az)
        rb = np.sqrt(bx * bx + by * by + bz * bz)
        # Distance of the projection from the edge: (a × e) · n / l, positive to the left of the edge.
        distance = (
            (ay * ez - az * ey) * normal[0] + (az * ex - ax * ez) * normal[1] + (ax * ey - ay * ex) * normal[2]
        ) / length
        gap = ra + rb - length
        if gap > 1e-14 * length and abs(distance) > 1e-14 * size:
            source += distance * np.log((ra + rb + length) / gap)
    if abs(height) <= 1e-10 * size:
        return source, 0.0
    ux, uy, uz = corners[0, 0] - x, corners[0, 1] - y, corners[0, 2] - z
    vx, vy, vz = corners[1, 0] - x, corners[1, 1] - y, corners[1, 2] - z
    wx, wy, wz = corners[2, 0] - x, corners[2, 1] - y, corners[2, 2] - z
    tx, ty, tz = corners[3, 0] - x, corners[3, 1] - y, corners[3, 2] - z
    nu = np.sqrt(ux * ux + uy * uy + uz * uz)
    nv = np.sqrt(vx * vx + vy * vy + vz * vz)
    nw = np.sqrt(wx * wx + wy * wy + wz * wz)
    nt = np.sqrt(tx * tx + ty * ty + tz * tz)
    angle = _solid_angle(ux, uy, uz, vx, vy, vz, wx, wy, wz, nu, nv, nw)
    angle += _solid_angle(ux, uy, uz, wx, wy, wz, tx, ty, tz, nu, nw, nt)
    return source - height * angle, angle


@njit(cache=True, parallel=True)
def influence(  # type: ignore[no-untyped-def]
    fields, places, shares, spread, sign_x, sign_y, sign_z, shift, corners, normal, centre, area, size, moments
):
    """Matrices (fields, panels) of both integrals' means over the panels `fields`, moved to (±x, ±y, ±z + shift).

    A panel's integral seen from a mirrored panel is the mirrored panel's integral seen from the panel. The mean is
    Galerkin's method, which converges faster than collocation at edges. It is taken by the field panel's Gauss points
    `places` (panels, q, 3) with `shares` (panels, q) that sum to 1; for panels that are `APART`, by its second moments
    over its area, `spread` (panels, 6). Collocation is one point a panel and no spread.
    """
    count = centre.shape[0]
    single = np.empty((len(fields), count))
    double = np.empty((len(fields), count))
    for p in prange(len(fields)):
        i = fields[p]
        x, y, z = sign_x * centre[i, 0], sign_y * centre[i, 1], sign_z * centre[i, 2] + shift
        for j in range(count):
            dx, dy, dz = x - centre[j, 0], y - centre[j, 1], z - centre[j, 2]
            if dx * dx + dy * dy + dz * dz > (APART * max(size[i], size[j])) ** 2:
                source = area[j]
                single[p, j], double[p, j] = _multipole(
                    dx,
                    dy,
                    dz,
                    area[j],
                    normal[j],
                    moments[j, 0] + source * spread[i, 0],
                    moments[j, 1] + source * spread[i, 1],
                    moments[j, 2] + source * spread[i, 2],
                    moments[j, 3] + source * sign_x * sign_y * spread[i, 3],
                    moments[j, 4] + source * sign_x * sign_z * spread[i, 4],
                    moments[j, 5] + source * sign_y * sign_z * spread[i, 5],
                )
                continue
            first, second = 0.0, 0.0
            for q in range(places.shape[1]):
                one, two = _closed_form(
                    sign_x * places[i, q, 0],
                    sign_y * places[i, q, 1],
                    sign_z * places[i, q, 2] + shift,
                    corners[j],
                    normal[j],
                    centre[j],
                    size[j],
                )
                first += shares[i, q] * one
                second += shares[i, q] * two
            single[p, j], double[p, j] = first, second
    return single, double


def second_moments(corners: FloatArray, centre: FloatArray) -> FloatArray:
    """Second moments (n, 6) of flat panels about their centres: xx, yy, zz, xy, xz, yz in m⁴."""
    a, b, c, d = np.moveaxis(corners - centre[:, None, :], 1, 0)
    result = np.zeros((len(corners), 3, 3))
    for p, q, r in ((a, b, c), (a, c, d)):
        weight = np.linalg.norm(np.cross(q - p, r - p), axis=1) / 2.0
        middles = np.stack([(p + q) / 2.0, (q + r) / 2.0, (r + p) / 2.0])
        result += np.einsum("p,mpi,mpj->pij", weight / 3.0, middles, middles)
    return np.stack([result[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))], axis=1)
