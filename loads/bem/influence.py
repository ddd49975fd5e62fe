"""Influence matrices of the wave part of the Green function, for every symmetry class of a mesh at once.

A mesh with m images under its reflections s has m classes (characters chi); potentials of a class satisfy
phi(s x) = chi(s) phi(x), so that one full system falls apart into m systems of the stored panels:

    S_chi[i, j] = Σ_s chi(s) ∫_j G(s x_i, ξ) dS,    D_chi[i, j] = Σ_s chi(s) ∫_j ∂G/∂n_ξ (s x_i, ξ) dS           (1)

Both are means over the field panel i. A wave is nearly plane over a panel, so that a mean over both panels of a
function W of x - ξ, y - η and z + ζ is its value at the centres and a correction by the panels' second moments M,

    <W> = W + ½ (M_i / A_i + M_j / A_j) : ∇∇W                                                                     (2)

which leaves errors of the fourth power of panel length over wavelength; a value at the centres alone leaves the second
power, which shows where waves from the columns of a platform cancel. In deep water all derivatives of W = K g(h, v)
follow from g, g_h and g_v, since g_v = g + 2/d and W is harmonic. Where the image singularity is near in panel
diagonals, 2 x 2 Gauss points of the field panel see 2 x 2 or 4 x 4 points of the source panel instead. What a bottom
adds is smooth and taken at the centres. One call serves the pair (i, j) and its mirror (j, i).
All matrices are stored transposed, [class, source, field], so that a class is a Fortran-ordered system for LAPACK, and
for the stored fields of a `symmetry.Fold` only.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numba
import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from tlpsim.loads.bem.green import bottom_wave, deep_part, deep_table, deep_wave, finite_table, no_bottom
from tlpsim.loads.bem.mesh import Panels
from tlpsim.loads.bem.symmetry import EXCHANGED, Fold

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IntegerArray = NDArray[np.int64]

FAST = {"nsz", "arcp", "contract", "afn", "reassoc"}  # without the assumption that nothing is NaN or infinite
_TILE = 16
_AXIS = 1e-5  # added to (K R)², so that directions exist on the axis; g changes by less
NEAR = 4.0  # panel diagonals from the image within which Gauss points are taken: 2 x 2 of the source
NEXT = 1.0  # and 4 x 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Quadrature:
    """Gauss points of panels: places (n, points, 3) and weights (n, points) in m²."""

    places: FloatArray
    weights: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class NearPairs:
    """Pairs (pairs, 3) of stored field, source and bits of the near images, and the Gauss points of all sources."""

    pairs: IntegerArray
    source: Quadrature


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
def near_images(fields, centre, size, images, inner, outer):  # type: ignore[no-untyped-def]
    """Bits (field, source): images of the pair whose surface image is `inner` to `outer` larger diagonals away."""
    count = centre.shape[0]
    result = np.zeros((len(fields), count), dtype=np.int64)
    for p in prange(len(fields)):
        i = fields[p]
        for j in range(count):
            larger = max(size[i], size[j])
            for s in range(images.shape[0]):
                dx = images[s, 0] * centre[i, 0] - centre[j, 0]
                dy = images[s, 1] * centre[i, 1] - centre[j, 1]
                dz = centre[i, 2] + centre[j, 2]
                square = dx * dx + dy * dy + dz * dz
                if (inner * larger) ** 2 <= square < (outer * larger) ** 2:
                    result[p, j] |= 1 << s
    return result


def near_pairs(panels: Panels, images: FloatArray, fold: Fold) -> tuple[NearPairs, ...]:
    """Pairs with near images, by the quadrature that they need."""
    result = []
    for inner, outer, order in ((NEXT, NEAR, 2), (0.0, NEXT, 4)):
        bits = near_images(fold.fields, panels.centre, panels.size, images, inner, outer)
        field, source = np.nonzero(bits)
        pairs = np.stack([field, source, bits[field, source]], axis=1)
        result.append(NearPairs(pairs=pairs, source=quadrature(panels, order)))
    return tuple(result)


def tiles(count: int) -> IntegerArray:
    """Lower corners (tiles, 2) of the square blocks on and above the diagonal."""
    first, second = np.triu_indices(-(-count // _TILE))
    return np.stack([first * _TILE, second * _TILE], axis=1).astype(np.int64)


@njit(cache=True, fastmath=FAST, forceinline=True)
def _mean_wave(x, y, v, xx, yy, zz, xy, xz, yz, table):  # type: ignore[no-untyped-def]
    """Mean of g over both panels by eq. (2), and its gradient by x, y and v; lengths times K, moments ½ M K² / A."""
    h = np.sqrt(x * x + y * y + _AXIS)
    g, g_h, g_v = deep_wave(h, v, table)
    inverse = 1.0 / h
    cosine, sine = x * inverse, y * inverse
    # Derivatives of the source term 2/d, by which g_v exceeds g.
    reciprocal = 1.0 / (h * h + v * v)
    cube = 2.0 * reciprocal * np.sqrt(reciprocal)
    ratio = g_h * inverse
    g_vv = g_v - v * cube
    g_hv = g_h - h * cube
    g_hh = -g_vv - ratio
    g_vvv = g_vv + (3.0 * v * v * reciprocal - 1.0) * cube
    g_hvv = g_hv + 3.0 * h * v * reciprocal * cube
    g_hhv = g_hh + (3.0 * h * h * reciprocal - 1.0) * cube
    bend = (g_hh - ratio) * inverse
    g_hhh = -g_hvv - bend
    radial = xx * cosine * cosine + yy * sine * sine + 2.0 * xy * cosine * sine
    across = xx + yy - radial
    shear = 2.0 * (xz * cosine + yz * sine)
    turn = 2.0 * ((yy - xx) * cosine * sine + xy * (cosine * cosine - sine * sine))
    swing = 2.0 * (yz * cosine - xz * sine)
    value = g + radial * g_hh + across * ratio + shear * g_hv + zz * g_vv
    outward = g_h + radial * g_hhh + across * bend + shear * g_hhv + zz * g_hvv
    sideways = turn * bend + swing * g_hv * inverse
    upward = g_v + radial * g_hhv + across * g_hv * inverse + shear * g_hvv + zz * g_vvv
    return value, outward * cosine - sideways * sine, outward * sine + sideways * cosine, upward


@njit(cache=True, nogil=True, fastmath=FAST)
def fill_tiles(  # type: ignore[no-untyped-def]
    corners,
    fields,
    mirror,
    exchanged,
    centre,
    normal,
    area,
    size,
    moments,
    images,
    characters,
    wavenumber,
    finite,
    table,
    rankine,
    single,
    double,
):
    """Fill S and -D of eq. (1), (classes, source, stored field), on the tiles at `corners`: `rankine` and wave part.

    Pairs of a stored field i and the mirror of another, k, also serve k and the mirror of i. The deep wave part of near
    images is left out. A parallel loop takes no table with a table inside, so that several
    threads are to call this, each with tiles of its own.
    """
    count, order = fields.shape[0], images.shape[0]
    halves = 1 if count == centre.shape[0] else 2
    waves = deep_part(table)
    square = wavenumber * wavenumber
    forward = np.empty((3, order), dtype=np.complex128)
    for t in range(corners.shape[0]):
        for p in range(corners[t, 0], min(corners[t, 0] + _TILE, count)):
            for q in range(max(p, corners[t, 1]), min(corners[t, 1] + _TILE, count)):
                for half in range(halves):
                    i, j = fields[p], fields[q]
                    if half == 1:
                        j = mirror[j]
                    height = centre[i, 2] + centre[j, 2]
                    limit = NEAR * max(size[i], size[j])
                    for s in range(order):
                        sign_x, sign_y = images[s, 0], images[s, 1]
                        dx = sign_x * centre[i, 0] - centre[j, 0]
                        dy = sign_y * centre[i, 1] - centre[j, 1]
                        value, along_x, along_y, field_z, source_z = 0.0j, 0.0j, 0.0j, 0.0j, 0.0j
                        if dx * dx + dy * dy + height * height >= limit * limit:
                            # A mirrored panel has mirrored moments; the source's horizontal distances count backwards.
                            value, along_x, along_y, field_z = _mean_wave(
                                wavenumber * dx,
                                wavenumber * dy,
                                wavenumber * height,
                                square * (moments[i, 0] + moments[j, 0]),
                                square * (moments[i, 1] + moments[j, 1]),
                                square * (moments[i, 2] + moments[j, 2]),
                                square * (sign_x * sign_y * moments[i, 3] + moments[j, 3]),
                                square * (sign_x * moments[i, 4] - moments[j, 4]),
                                square * (sign_y * moments[i, 5] - moments[j, 5]),
                                waves,
                            )
                            value, along_x, along_y = wavenumber * value, square * along_x, square * along_y
                            field_z = square * field_z
                            source_z = field_z
                        if finite:
                            distance = np.sqrt(dx * dx + dy * dy)
                            g, g_r, g_i, g_j = bottom_wave(distance, centre[i, 2], centre[j, 2], table)
                            slope = g_r / distance if distance > 0.0 else 0.0j
                            value, along_x, along_y = value + g, along_x + slope * dx, along_y + slope * dy
                            field_z, source_z = field_z + g_i, source_z + g_j
                        forward[0, s] = value
                        forward[1, s] = source_z * normal[j, 2] - along_x * normal[j, 0] - along_y * normal[j, 1]
                        forward[2, s] = field_z * normal[i, 2] + (
                            sign_x * along_x * normal[i, 0] + sign_y * along_y * normal[i, 1]
                        )
                    other = i if half == 0 else mirror[i]
                    for c in range(order):
                        value, there, same, back = 0.0j, 0.0j, 0.0j, 0.0j
                        for s in range(order):
                            value += characters[c, s] * forward[0, s]
                            there += characters[c, s] * forward[1, s]
                            seen = s if half == 0 else exchanged[s]
                            same += characters[c, s] * forward[0, seen]
                            back += characters[c, s] * forward[2, seen]
                        single[c, j, p] = rankine[0, c, j, p] + value * area[j]
                        double[c, j, p] = -rankine[1, c, j, p] - there * area[j]
                        single[c, other, q] = rankine[0, c, other, q] + same * area[i]
                        double[c, other, q] = -rankine[1, c, other, q] - back * area[i]


@njit(cache=True, parallel=True, fastmath=FAST)
def add_near(  # type: ignore[no-untyped-def]
    pairs, fields, field, share, source, weights, normal, images, characters, wavenumber, table, single, double
):
    """Add the deep wave part of near pairs: points `field` with parts of 1 `share` see `source` with `weights`."""
    order = images.shape[0]
    for p in prange(pairs.shape[0]):
        place, j, bits = pairs[p, 0], pairs[p, 1], pairs[p, 2]
        i = fields[place]
        for s in range(order):
            if not bits & (1 << s):
                continue
            value = 0.0j
            slope = 0.0j
            for f in range(field.shape[1]):
                for q in range(source.shape[1]):
                    dx = images[s, 0] * field[i, f, 0] - source[j, q, 0]
                    dy = images[s, 1] * field[i, f, 1] - source[j, q, 1]
                    distance = np.sqrt(dx * dx + dy * dy)
                    height = field[i, f, 2] + source[j, q, 2]
                    g, g_h, g_v = deep_wave(wavenumber * distance, wavenumber * height, table)
                    ratio = g_h / distance if distance > 0.0 else 0.0j
                    weight = wavenumber * share[i, f] * weights[j, q]
                    value += weight * g
                    slope += (
                        wavenumber * weight * (g_v * normal[j, 2] - ratio * (dx * normal[j, 0] + dy * normal[j, 1]))
                    )
            for c in range(order):
                single[c, j, place] += characters[c, s] * value
                double[c, j, place] -= characters[c, s] * slope


def fill(
    panels: Panels,
    moments: FloatArray,
    field: Quadrature,
    images: FloatArray,
    characters: FloatArray,
    fold: Fold,
    near: tuple[NearPairs, ...],
    wavenumber: float,
    depth: float,
    rankine: FloatArray,
) -> tuple[ComplexArray, ComplexArray]:
    """S and -D of eq. (1), (classes, source, stored field), with K = `wavenumber`.

    Parameters
    ----------
    moments
        Second moments (n, 6) of the panels: xx, yy, zz, xy, xz, yz in m⁴.
    field
        Gauss points over which the field of near images is averaged.
    near
        Pairs with near images, of `near_pairs`.
    rankine
        (2, classes, source, stored field): single and double layer of the Rankine terms.
    """
    deep = deep_table()
    single, double = (np.empty(rankine.shape[1:], dtype=np.complex128) for _ in range(2))
    finite = bool(np.isfinite(depth))
    table = no_bottom()
    if finite:
        span = np.max(np.abs(panels.centre[:, :2]), axis=0)
        if len(images) == 1:
            span = np.ptp(panels.centre[:, :2], axis=0) / 2.0
        reach = 2.0 * float(np.hypot(*span)) * (1.0 + 1e-9)
        table = finite_table(wavenumber, depth, reach, -float(np.min(panels.centre[:, 2])) * (1.0 + 1e-9))
    geometry = (panels.centre, panels.normal, panels.area, panels.size, 0.5 * moments / panels.area[:, None])
    blocks = tiles(len(fold.fields))
    threads = numba.get_num_threads()

    def work(part: int) -> None:
        known = (images, characters, wavenumber, finite, table, rankine)
        fill_tiles(blocks[part::threads], fold.fields, fold.mirror, EXCHANGED, *geometry, *known, single, double)

    with ThreadPoolExecutor(max_workers=threads) as workers:
        list(workers.map(work, range(threads)))
    share = field.weights / panels.area[:, None]
    for group in near:
        points = (field.places, share, group.source.places, group.source.weights)
        add_near(group.pairs, fold.fields, *points, panels.normal, images, characters, wavenumber, deep, single, double)
    return single, double
