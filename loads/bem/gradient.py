"""Tangential gradient of a potential that is constant on panels, with the singular flow at sharp edges.

The gradient at a panel is that of the quadratic polynomial in the panel's plane that fits the panels around it on the
same smooth face best,

    φ_m - φ_i = g · u_m + ½ u_m · H u_m,                                                                    (1)

u being the offset of centres. Around a convex edge whose faces' normals differ by γ, the potential varies with the
distance r from the edge as r^α, α = π/(π + γ), 2/3 at a right angle. Near one the offset across is replaced by

    u = (σ_m - σ_i) / (α r_i^(α-1)),   σ = mean of r^α over the panel,                                       (2)

in which the potential is smooth. The velocity across the edge and its square then have the means over a panel

    <r^(α-1)> / r_i^(α-1),   <r^(2α-2)> / r_i^(2α-2)                                                         (3)

times their values at the centre: 1.2 and 1.9 for a panel at a right-angled edge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree

FloatArray = NDArray[np.float64]
IntegerArray = NDArray[np.int64]

_SMOOTH = np.cos(np.radians(40.0))  # of the angle between the normals of neighbours on one face
_FACING = np.cos(np.radians(75.0))  # and of any two panels in a fit
_SAME_SIDE = 0.5  # cosine of the angle within which the ways to edges, seen from a panel, are one
_SAME_VERTEX = 0.02  # of the smallest panel's diagonal
_WEAK = 1e-3  # singular values below this, relative, are left out of a fit
_FLAT = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class TangentialGradient:
    """Three sparse matrices (n, n) from φ to the gradient's components, and what edges do to its means, eq. (3).

    `across` (n, 3) points from the nearest edge to the panel's centre, zero where no edge is near; `mean` and `square`
    (n,) are the factors of eq. (3).
    """

    matrices: tuple[sparse.csr_matrix, ...]
    across: FloatArray
    mean: FloatArray
    square: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class _Edges:
    """Convex edges: ends (m, 3), exponents (m,), and the edges of each panel as a sparse (panels, m) matrix."""

    start: FloatArray
    end: FloatArray
    exponent: FloatArray
    owned: sparse.csr_matrix


def tangential_gradient(
    corners: FloatArray, centre: FloatArray, normal: FloatArray, size: FloatArray
) -> TangentialGradient:
    """Operator of eqs. (1), (2) by weighted least squares over two rings of neighbours.

    Parameters
    ----------
    corners, centre, normal, size
        (n, 4, 3), (n, 3), (n, 3) and diagonals (n,) of all panels of a hull.
    """
    count = len(centre)
    vertex = _vertices(corners, size)
    ring = _neighbours(vertex, normal)
    rings = (ring @ ring).tocsr()
    edges = _edges(corners, centre, normal, vertex)
    seen = (rings @ edges.owned).tocsr()
    across, mean, square = np.zeros((count, 3)), np.ones(count), np.ones(count)
    rows, columns, values = [], [], []
    for i in range(count):
        near = rings.indices[rings.indptr[i] : rings.indptr[i + 1]]
        near = near[(near != i) & (normal[near] @ normal[i] > _FACING)]
        if not len(near):
            continue
        step = centre[near] - centre[i]
        first = _tangent(normal[i])
        stretched = None
        if seen.indptr[i] < seen.indptr[i + 1]:
            chosen = seen.indices[seen.indptr[i] : seen.indptr[i + 1]]
            panels = np.append(near, i)
            first, stretched, mean[i], square[i] = _from_edge(edges, chosen, corners[panels], centre[i], normal[i])
            across[i] = first
        second = np.cross(normal[i], first)
        u, v = step @ first if stretched is None else stretched, step @ second
        scale = float(np.sqrt(np.mean(u * u + v * v)))
        u, v = u / scale, v / scale
        # Far panels weigh less: the inner ring alone nearly decides where it is complete.
        weight = 1.0 / (u * u + v * v)
        basis = np.stack([u, v, 0.5 * u * u, u * v, 0.5 * v * v], axis=1)
        inverse = np.linalg.pinv(basis * weight[:, None], rcond=_WEAK)[:2] * weight
        slopes = (inverse[0, :, None] * first + inverse[1, :, None] * second) / scale
        rows.append(np.full(len(near) + 1, i))
        columns.append(np.append(near, i))
        values.append(np.vstack([slopes, -slopes.sum(axis=0)]))
    shape = (count, count)
    row, column = (np.concatenate(parts) if parts else np.zeros(0, dtype=int) for parts in (rows, columns))
    value = np.concatenate(values) if values else np.zeros((0, 3))
    matrices = tuple(sparse.coo_matrix((value[:, axis], (row, column)), shape=shape).tocsr() for axis in range(3))
    return TangentialGradient(matrices=matrices, across=across, mean=mean, square=square)


def _vertices(corners: FloatArray, size: FloatArray) -> IntegerArray:
    """Numbers (panels, 4) of the vertices, one for all corners that coincide."""
    points = corners.reshape(-1, 3)
    pairs = cKDTree(points).query_pairs(_SAME_VERTEX * float(np.min(size)), output_type="ndarray")
    graph = sparse.coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points),) * 2)
    labels = sparse.csgraph.connected_components(graph, directed=False)[1]
    return np.asarray(labels, dtype=np.int64).reshape(-1, 4)


def _neighbours(vertex: IntegerArray, normal: FloatArray) -> sparse.csr_matrix:
    """Panels (n, n) that share a vertex and a smooth face, each with itself."""
    count = len(vertex)
    holds = sparse.coo_matrix(
        (np.ones(vertex.size), (np.repeat(np.arange(count), 4), vertex.ravel())), shape=(count, int(vertex.max()) + 1)
    ).tocsr()
    shared = (holds @ holds.T).tocoo()
    smooth = np.einsum("pk,pk->p", normal[shared.row], normal[shared.col]) > _SMOOTH
    row, column = shared.row[smooth], shared.col[smooth]
    return sparse.coo_matrix((np.ones(len(row)), (row, column)), shape=(count, count)).tocsr()


def _edges(corners: FloatArray, centre: FloatArray, normal: FloatArray, vertex: IntegerArray) -> _Edges:
    """Edges between two panels that turn away from each other by more than neighbours on a smooth face do."""
    owner, side = np.divmod(np.arange(vertex.size), 4)
    pair = np.sort(np.stack([vertex.ravel(), np.roll(vertex, -1, axis=1).ravel()], axis=1), axis=1)
    long = pair[:, 0] != pair[:, 1]
    owner, side, pair = owner[long], side[long], pair[long]
    order = np.lexsort((pair[:, 1], pair[:, 0]))
    same = np.all(pair[order[1:]] == pair[order[:-1]], axis=1)
    one, two = order[:-1][same], order[1:][same]
    a, b = owner[one], owner[two]
    cosine = np.einsum("pk,pk->p", normal[a], normal[b])
    convex = np.einsum("pk,pk->p", centre[b] - centre[a], normal[a]) < 0.0
    sharp = convex & (cosine <= _SMOOTH)
    one, a, b, cosine = one[sharp], a[sharp], b[sharp], cosine[sharp]
    number = np.arange(len(one))
    return _Edges(
        start=corners[a, side[one]],
        end=corners[a, (side[one] + 1) % 4],
        exponent=np.pi / (np.pi + np.arccos(np.clip(cosine, -1.0, 1.0))),
        owned=sparse.coo_matrix(
            (np.ones(2 * len(one)), (np.concatenate([a, b]), np.tile(number, 2))), shape=(len(corners), len(one))
        ).tocsr(),
    )


def _from_edge(
    edges: _Edges, chosen: IntegerArray, corners: FloatArray, centre: FloatArray, normal: FloatArray
) -> tuple[FloatArray, FloatArray, float, float]:
    """Direction away from the nearest edge, offsets, eq. (2), of all but the last panel, and factors of eq. (3)."""
    start, end = edges.start[chosen], edges.end[chosen]
    distance = np.linalg.norm(centre - _foot(centre[None, :], start, end)[0], axis=1)
    nearest = int(np.argmin(distance))
    away = centre - _foot(centre[None, :], start, end, np.inf)[0]
    length = np.linalg.norm(away, axis=1)
    side = away @ away[nearest] > _SAME_SIDE * length * length[nearest]
    start, end = start[side], end[side]
    power = float(edges.exponent[chosen[nearest]])
    points = corners.reshape(-1, 3)
    reach = np.min(np.linalg.norm(points[:, None, :] - _foot(points, start, end), axis=2), axis=1).reshape(-1, 4)
    low, high = reach.min(axis=1), reach.max(axis=1)
    high = np.maximum(high, low + _FLAT * distance[nearest])
    mapped = (high ** (power + 1.0) - low ** (power + 1.0)) / ((power + 1.0) * (high - low))
    here = distance[nearest]
    offsets = (mapped[:-1] - mapped[-1]) / (power * here ** (power - 1.0))
    low, high = float(low[-1]), float(high[-1])
    mean = (high**power - low**power) / (power * (high - low)) / here ** (power - 1.0)
    twice = 2.0 * power - 1.0
    square = (high**twice - low**twice) / (twice * (high - low)) / here ** (twice - 1.0)
    first = away[nearest] - (away[nearest] @ normal) * normal
    return first / np.linalg.norm(first), offsets, mean, square


def _foot(points: FloatArray, start: FloatArray, end: FloatArray, beyond: float = 0.0) -> FloatArray:
    """Points (points, segments, 3) nearest to points, on segments that go on `beyond` their ends by so many lengths."""
    along = end - start
    share = np.einsum("psk,sk->ps", points[:, None, :] - start, along) / np.sum(along**2, axis=1)
    return np.asarray(start + np.clip(share, -beyond, 1.0 + beyond)[..., None] * along)


def _tangent(normal: FloatArray) -> FloatArray:
    """A unit vector across `normal`: horizontal, or along x on a horizontal panel."""
    across = np.array([-normal[1], normal[0], 0.0])
    length = float(np.linalg.norm(across))
    if length < _FLAT:
        return np.array([1.0, 0.0, 0.0])
    return across / length
