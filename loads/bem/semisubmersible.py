"""Hull of a semisubmersible: two parallel rectangular pontoons and the round columns on them, as one quadrant.

The top of a pontoon is cut along x into strips, and into cells with a column each: a rectangle as wide as the pontoon
with a round hole, filled by rings of quadrilaterals from the nodes around the hole to as many around the rectangle.
All parts share their nodes. The hole is a polygon with the area of the circle (eq. (1) of `tlpsim.loads.bem.hulls`),
so that displacement and water plane of round columns are exact:

    V = 2 l w h + m π R² (d - h),    A_W = m π R²                                                           (1)

with l, w, h length, width and height of a pontoon, m columns of radius R in all, and draft d.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.bem.hulls import (
    STANDARD,
    Proportions,
    clustered,
    clustered_end,
    even_count,
    lift,
    patch,
    polygon_radius,
    wall,
)
from tlpsim.loads.bem.mesh import Mesh
from tlpsim.loads.checks import require_positive
from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]

_SHORTEST_STRIP = 0.5
"""Length of a strip, in lengths of a pontoon's panel, below which the cell beside it takes it in."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SemisubmersibleHull:
    """Two pontoons along x with round columns on them. Lengths in m.

    Attributes
    ----------
    pontoon_length, pontoon_width, pontoon_height
        Of each of the two boxes.
    pontoon_spacing
        Distance between the pontoons' centrelines.
    column_radius
        Of all columns; they stand on the pontoons' centrelines.
    column_positions
        x ≥ 0 of the columns' centres, ascending; those at x > 0 stand at -x too.
    draft
        From the pontoons' bottom to the still water.
    """

    pontoon_length: float
    pontoon_width: float
    pontoon_height: float
    pontoon_spacing: float
    column_radius: float
    column_positions: tuple[float, ...]
    draft: float


def semisubmersible(
    hull: SemisubmersibleHull, panel: float, proportions: Proportions = STANDARD, coarse: bool = False
) -> Mesh:
    """One quadrant of a semisubmersible with panels of about the size `panel` (m), parts joined conformally.

    With `coarse` every panel is twice as long and wide, to tell the error of the mesh by.

    Raises
    ------
    ScenarioError
        If a length is not positive, pontoons touch or reach the water plane, a column stands out of its pontoon, in
        another column or across x = 0, or panels are too large for the gap beside a column.
    """
    _require_buildable(hull, panel)
    girth, length = proportions.pontoon_girth * panel, proportions.pontoon_length * panel
    half = 0.5 * hull.pontoon_width
    y = 0.5 * hull.pontoon_spacing + half * (2.0 * clustered(even_count(hull.pontoon_width, girth, coarse)) - 1.0)
    top, end = hull.pontoon_height - hull.draft, 0.5 * hull.pontoon_length
    row = even_count(-top, proportions.column_row * panel, coarse)
    upper = top * np.linspace(0.0, 1.0, row + 1)
    lower = top - hull.pontoon_height * clustered(even_count(hull.pontoon_height, girth, coarse))
    rings = clustered_end(even_count(half - hull.column_radius, girth, coarse))[:, None, None]

    parts: list[FloatArray] = []
    stations = [np.zeros(1)]
    for position, (left, right) in zip(hull.column_positions, _cells(hull, length), strict=True):
        if left > stations[-1][-1]:
            stations.append(_divided(float(stations[-1][-1]), left, length, end, coarse))
            parts.append(_strip(stations[-1], y, top))
        count = even_count(right - left, girth, coarse)
        x = left + (right - left) * (clustered(count) if right == end else np.linspace(0.0, 1.0, count + 1))
        x[-1] = right
        hole, rim = _ring_and_rim(np.array([position, 0.5 * hull.pontoon_spacing]), hull.column_radius, x, y)
        parts += [patch(lift(_unfolded(hole + rings * (rim - hole), position, panel), top)), wall(hole, upper)]
        stations.append(x)
    if stations[-1][-1] < end:
        stations.append(_divided(float(stations[-1][-1]), end, length, end, coarse))
        parts.append(_strip(stations[-1], y, top))

    x = np.concatenate([stations[0], *[nodes[1:] for nodes in stations[1:]]])
    parts += [
        wall(np.stack([x, np.full_like(x, y[0])], axis=-1), lower),
        wall(np.stack([np.full_like(y, end), y], axis=-1), lower),
        wall(np.stack([x[::-1], np.full_like(x, y[-1])], axis=-1), lower),
        _strip(x, y, -hull.draft)[:, [0, 3, 2, 1]],
    ]
    return Mesh(name="semisubmersible", vertices=np.concatenate(parts), planes=("x", "y"))


def _require_buildable(hull: SemisubmersibleHull, panel: float) -> None:
    lengths = [hull.pontoon_length, hull.pontoon_width, hull.pontoon_height, hull.pontoon_spacing]
    require_positive("lengths of the semisubmersible", [*lengths, hull.column_radius, hull.draft, panel], "m")
    radius, positions = hull.column_radius, np.asarray(hull.column_positions, dtype=np.float64)
    if positions.ndim != 1 or len(positions) == 0 or not np.all(np.isfinite(positions)):
        raise ScenarioError(f"column positions of the semisubmersible are {positions}; one or more x >= 0 are needed")
    if not 2.0 * radius < hull.pontoon_width:
        raise ScenarioError(
            f"columns of the semisubmersible are {2.0 * radius:.4g} m wide, their pontoons {hull.pontoon_width:.4g} m; "
            "columns must be narrower: widen the pontoons or give a smaller column_radius"
        )
    if not hull.pontoon_height < hull.draft:
        raise ScenarioError(
            f"pontoons of the semisubmersible are {hull.pontoon_height:.4g} m high at a draft of {hull.draft:.4g} m; "
            "their top must be below the water: give a larger draft"
        )
    if not hull.pontoon_width < hull.pontoon_spacing:
        raise ScenarioError(
            f"pontoons of the semisubmersible are {hull.pontoon_width:.4g} m wide, {hull.pontoon_spacing:.4g} m apart; "
            "they touch: give a larger pontoon_spacing"
        )
    if np.any(np.diff(positions) <= 2.0 * radius):
        raise ScenarioError(
            f"columns of the semisubmersible at x = {positions} m with a radius of {radius:.4g} m meet or do not "
            "ascend; sort them and keep them more than a diameter apart"
        )
    if positions[0] < 0.0 or 0.0 < positions[0] <= radius:
        raise ScenarioError(
            f"first column of the semisubmersible at x = {positions[0]:.4g} m; give x = 0, "
            f"or x > {radius:.4g} m, its radius"
        )
    if not positions[-1] + radius < 0.5 * hull.pontoon_length:
        raise ScenarioError(
            f"last column of the semisubmersible reaches x = {positions[-1] + radius:.4g} m, its pontoon "
            f"{0.5 * hull.pontoon_length:.4g} m; lengthen the pontoons or move the column inwards"
        )


def _cells(hull: SemisubmersibleHull, length: float) -> FloatArray:
    """Ends (columns, 2) in x of the cells: square about their column where neighbours and the pontoon's end allow."""
    x = np.asarray(hull.column_positions, dtype=np.float64)
    limits = np.concatenate([[0.0], 0.5 * (x[:-1] + x[1:]), [0.5 * hull.pontoon_length]])
    wanted = x[:, None] + 0.5 * hull.pontoon_width * np.array([-1.0, 1.0])
    bounds = np.stack([limits[:-1], limits[1:]], axis=1)
    outwards = np.array([-1.0, 1.0])
    return np.where(outwards * (bounds - wanted) < _SHORTEST_STRIP * length, bounds, wanted)


def _divided(start: float, stop: float, length: float, end: float, coarse: bool) -> FloatArray:
    """Nodes in [start, stop]: even, or dense at the pontoon's end if they reach it."""
    count = even_count(stop - start, length, coarse)
    even = np.linspace(0.0, 1.0, count + 1)
    nodes = start + (stop - start) * (clustered_end(count) if stop == end else even)
    nodes[-1] = stop
    return nodes


def _strip(x: FloatArray, y: FloatArray, height: float) -> FloatArray:
    """Panels of a rectangle with nodes x and y; normals upwards."""
    return patch(lift(np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1), height))


def _unfolded(nodes: FloatArray, position: float, panel: float) -> FloatArray:
    """The nodes (rings + 1, m, 2) of a cell, if none of its panels is folded."""
    corners = np.stack([nodes[:-1, :-1], nodes[1:, :-1], nodes[1:, 1:], nodes[:-1, 1:]])
    sides = np.roll(corners, -1, axis=0) - corners
    following = np.roll(sides, -1, axis=0)
    if np.any(sides[..., 0] * following[..., 1] <= sides[..., 1] * following[..., 0]):
        raise ScenarioError(
            f"column of the semisubmersible at x = {position:.4g} m: panels of {panel:.4g} m fold between it and the "
            "edge of its pontoon; give smaller panels, or more room around the column"
        )
    return nodes


def _ring_and_rim(centre: FloatArray, radius: float, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nodes (m, 2) around a column and around its cell, both anticlockwise; of half of both for a column at x = 0.

    Each side of the cell faces the arc between the directions of its corners, which is divided evenly.
    """
    sides = [
        np.stack([np.full_like(y, x[-1]), y], axis=-1),
        np.stack([x[::-1], np.full_like(x, y[-1])], axis=-1),
    ]
    if centre[0] == 0.0:
        sides.insert(0, np.stack([x, np.full_like(x, y[0])], axis=-1))
    else:
        sides += [
            np.stack([np.full_like(y, x[0]), y[::-1]], axis=-1),
            np.stack([x, np.full_like(x, y[0])], axis=-1),
        ]
    corners = np.array([side[0] for side in sides] + [sides[-1][-1]]) - centre
    directions = np.unwrap(np.arctan2(corners[:, 1], corners[:, 0]))
    arcs = [
        np.linspace(first, last, len(side))
        for first, last, side in zip(directions[:-1], directions[1:], sides, strict=True)
    ]
    angle = np.concatenate([arcs[0], *[arc[1:] for arc in arcs[1:]]])
    rim = np.concatenate([sides[0], *[side[1:] for side in sides[1:]]])
    nodes = polygon_radius(radius, np.diff(angle), float(np.ptp(angle)))
    ring = centre + nodes * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    if centre[0] == 0.0:
        ring[[0, -1], 0] = 0.0
    return ring, rim
