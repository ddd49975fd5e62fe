"""Parametric hulls: hemisphere, cylinder, box, and TLP hulls of columns and pontoons, as meshes of one quadrant.

Nodes are clustered by a cosine to the edges, where the flow is singular; parts share their nodes, so that the meshes
are watertight. A polygon of nodes at radius r holds less than the circle of radius R; r is enlarged so that

    r² Σ sin Δθ = 2π R²                                                                                     (1)

and a hemisphere is then stretched down to its volume, so that water plane and volume are both exact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from tlpsim.loads.bem.mesh import Mesh, joined_loops, loop_centroid, turned_round, volumes, waterline_loops
from tlpsim.loads.checks import require_positive

FloatArray = NDArray[np.float64]
_FIXED_POINT_STEPS = 30

LID_REACH = 0.7
"""Part of the way from the centroid of a water plane to its rim that a lid covers."""
LID_RINGS = 2
"""Rings of panels of a lid."""


def clustered(count: int) -> FloatArray:
    """Nodes (count + 1,) in [0, 1], dense at both ends."""
    return 0.5 * (1.0 - np.cos(np.pi * np.linspace(0.0, 1.0, count + 1)))


def clustered_end(count: int) -> FloatArray:
    """Nodes (count + 1,) in [0, 1], dense at 1."""
    return np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, count + 1))


def patch(nodes: FloatArray) -> FloatArray:
    """Panels (m n, 4, 3) of a lattice of nodes (m + 1, n + 1, 3); the normal is ∂/∂m × ∂/∂n.

    Where two corners of a cell coincide, the cell becomes a triangle.
    """
    quads = np.stack([nodes[:-1, :-1], nodes[1:, :-1], nodes[1:, 1:], nodes[:-1, 1:]], axis=2).reshape(-1, 4, 3)
    result = quads.copy()
    scale = float(np.max(np.abs(nodes)))
    for corner in range(4):
        following = (corner + 1) % 4
        same = np.linalg.norm(quads[:, corner] - quads[:, following], axis=1) < 1e-9 * scale
        order = [(following + k) % 4 for k in range(3)]
        result[same] = quads[same][:, [*order, order[-1]]]
    return result


def hemisphere(radius: float, polar: int, around: int) -> Mesh:
    """Hemisphere below the water: `polar` rings from waterline to keel, `around` panels a quadrant, eq. (1)."""
    require_positive("radius of the hemisphere", radius, "m")
    even = np.linspace(0.0, 1.0, polar + 1)
    # Rings half as high at the waterline as in the mean: waves are steepest there.
    theta = 0.25 * np.pi * (even + 1.0 - np.cos(0.5 * np.pi * even))[:, None]
    phi = 0.5 * np.pi * np.linspace(0.0, 1.0, around + 1)[None, :]
    nodes = np.stack([np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), -np.sin(theta) + 0.0 * phi], axis=-1)
    mesh = Mesh(name="hemisphere", vertices=patch(nodes), planes=("x", "y"))
    wide = polygon_radius(1.0, np.diff(phi[0]), 0.5 * np.pi)
    high = 2.0 / 3.0 * np.pi / (volumes(mesh)[2] * wide**2)
    scaled = radius * mesh.vertices * np.array([wide, wide, high])
    return Mesh(name="hemisphere", vertices=scaled, planes=("x", "y"))


def cylinder(radius: float, draft: float, around: int, down: int, across: int) -> Mesh:
    """Upright cylinder: `around` panels a quadrant, `down` its side, `across` the radius of its bottom, eq. (1)."""
    require_positive("radius and draft of the cylinder", [radius, draft], "m")
    phi = 0.5 * np.pi * np.linspace(0.0, 1.0, around + 1)
    ring = polygon_radius(radius, np.diff(phi), 0.5 * np.pi) * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
    side = wall(ring, -draft * clustered(down))
    bottom = _disc(np.zeros(2), ring, -draft, across)
    return Mesh(name="cylinder", vertices=np.concatenate([side, bottom]), planes=("x", "y"))


def box(length: float, beam: float, draft: float, panel: float, coarse: bool = False) -> Mesh:
    """Box of length (x), beam (y) and draft, with panels of about the size `panel` (m), dense at its edges.

    With `coarse` every panel is twice as long and wide, to tell the error of the mesh by.
    """
    require_positive("length, beam, draft and panel of the box", [length, beam, draft, panel], "m")
    x = 0.5 * length * clustered_end(even_count(length / 2.0, panel, coarse))
    y = 0.5 * beam * clustered_end(even_count(beam / 2.0, panel, coarse))
    z = -draft * clustered(even_count(draft, panel, coarse))
    front = wall(np.stack([np.full_like(y, length / 2.0), y], axis=-1), z)
    side = wall(np.stack([x[::-1], np.full_like(x, beam / 2.0)], axis=-1), z)
    bottom = patch(_plane(y[:, None], x[None, :], -draft)[..., [1, 0, 2]])
    return Mesh(name="box", vertices=np.concatenate([front, side, bottom]), planes=("x", "y"))


@dataclass(frozen=True, slots=True, kw_only=True)
class TlpHull:
    """A square hull: four round columns and four rectangular pontoons flush with the keel. Lengths in m."""

    spacing: float
    column_radius: float
    draft: float
    pontoon_width: float
    pontoon_height: float


ISSC_VOLUME = 53066.4
"""Displaced volume of the published panelled ISSC hull (WAMIT test 07, .frc file), m³."""


def issc_hull() -> TlpHull:
    """ISSC TLP as published in panels: its column polygons, with vertices at 8.4396 m, hold less than their circle.

    The round columns given back have the radius that gives the published volume, eq. (2):

        V = 4 π R² d + 4 h ∫ (s - 2 √(R² - y²)) dy over the pontoon's width                                    (2)
    """
    spacing, draft, width, height = 86.25, 35.0, 7.5, 10.5

    def excess(radius: float) -> float:
        half = width / 2.0
        chord = half * np.sqrt(radius**2 - half**2) + radius**2 * np.arcsin(half / radius)
        return float(4.0 * np.pi * radius**2 * draft + 4.0 * height * (spacing * width - 2.0 * chord) - ISSC_VOLUME)

    radius = float(brentq(excess, width / 2.0, spacing / 4.0))
    return TlpHull(spacing=spacing, column_radius=radius, draft=draft, pontoon_width=width, pontoon_height=height)


@dataclass(frozen=True, slots=True, kw_only=True)
class Proportions:
    """Sizes of the panels of a TLP hull relative to the nominal one; an anisotropic mesh needs fewer of them.

    `column_row` is the height of a row of a column, `pontoon_girth` the width of the panels around a pontoon, finer
    since the flow turns sharply around its edges, and `pontoon_length` their length along it.
    """

    column_row: float = 1.0
    pontoon_girth: float = 0.5
    pontoon_length: float = 2.5


STANDARD = Proportions()


def tlp(hull: TlpHull, panel: float, proportions: Proportions = STANDARD, coarse: bool = False) -> Mesh:
    """One quadrant of a TLP hull with panels of about the size `panel` (m), parts joined conformally, eq. (1).

    With `coarse` every panel is twice as long and wide, to tell the error of the mesh by.
    """
    require_positive(
        "lengths of the hull",
        [hull.spacing, hull.column_radius, hull.draft, hull.pontoon_width, hull.pontoon_height, panel],
        "m",
    )
    centre = hull.spacing / 2.0
    half = hull.pontoon_width / 2.0
    across = even_count(half, proportions.pontoon_girth * panel, coarse)
    radius = hull.column_radius
    for _ in range(_FIXED_POINT_STEPS):  # the nodes at the pontoon's corners keep its width as the polygon grows
        arcs = _half_column(hull.column_radius, float(np.arcsin(half / radius)), across, panel, coarse)
        radius = polygon_radius(hull.column_radius, np.concatenate([np.diff(arc) for arc in arcs]), np.pi)
    rings = [centre + radius * np.stack([np.cos(arc), np.sin(arc)], axis=-1) for arc in arcs]
    ring = np.concatenate([rings[0], rings[1][1:], rings[2][1:]])
    top = hull.pontoon_height - hull.draft
    upper = top * np.linspace(0.0, 1.0, even_count(-top, proportions.column_row * panel, coarse) + 1)
    lower = top - hull.pontoon_height * clustered(
        even_count(hull.pontoon_height, proportions.pontoon_girth * panel, coarse)
    )
    # The pontoon along x ends in the column's opening; its nodes run at constant y to the plane x = 0.
    mouth = rings[1]
    along = np.linspace(
        0.0, 1.0, even_count(float(np.min(mouth[:, 0])), proportions.pontoon_length * panel, coarse) + 1
    )
    lines = np.stack([along[:, None] * mouth[None, :, 0], np.broadcast_to(mouth[:, 1], (len(along), len(mouth)))], -1)
    parts = [
        wall(ring, upper),
        wall(rings[0], lower),
        wall(rings[2], lower),
        _disc(np.full(2, centre), ring, -hull.draft, even_count(radius, 1.2 * panel, coarse)),
        wall(lines[::-1, 0], lower),
        wall(lines[:, -1], lower),
        patch(lift(lines, -hull.draft)),
        patch(lift(lines[::-1], top)),
    ]
    octant = np.concatenate(parts)
    mirrored = turned_round(octant)[..., [1, 0, 2]]
    return Mesh(name="tlp", vertices=np.concatenate([octant, mirrored]), planes=("x", "y"))


def _half_column(radius: float, opening: float, across: int, panel: float, coarse: bool) -> list[FloatArray]:
    """Arcs of the half column on one side of the diagonal x = y, from the outside (45°) to the inside (225°).

    Round parts are divided evenly: a polygon of uneven sides is a poor circle.
    """
    outside = even_count(radius * (0.75 * np.pi - opening), panel, coarse)
    inside = even_count(radius * (np.pi / 4 - opening), panel, coarse)
    mouth = 2 * across
    return [
        np.linspace(np.pi / 4, np.pi - opening, outside + 1),
        np.pi - opening * np.cos(np.pi * np.linspace(0.0, 1.0, mouth + 1)),
        np.linspace(np.pi + opening, 1.25 * np.pi, inside + 1),
    ]


def polygon_radius(radius: float, steps: FloatArray, angle: float) -> float:
    """Radius of the nodes of a polygon with central angles `steps`, which sum to `angle`, eq. (1)."""
    return float(radius * np.sqrt(angle / np.sum(np.sin(steps))))


def lid(mesh: Mesh, rings: int = LID_RINGS) -> Mesh:
    """Panels on the water plane inside a hull, against irregular frequencies; normals upwards.

    Each closed loop of the waterline, completed by the planes of symmetry, is filled from its centroid by `rings`
    rings out to `LID_REACH` of the way, so that loops must be star-shaped about their centroid. The rim is left out
    since there the lid would disturb the panels of the waterline, and an absorbing lid need not cover all.
    """
    parts = []
    for loop in joined_loops(waterline_loops(mesh)):
        points = loop[:, :, :2].reshape(-1, 2)
        centre = np.zeros(2)
        for axis, plane in enumerate(("x", "y")):
            # A loop that ends on a plane of symmetry goes on behind it: its centre lies on that plane.
            crosses = plane in mesh.planes and np.min(np.abs(points[:, axis])) < 1e-6 * np.max(np.abs(points))
            centre[axis] = 0.0 if crosses else loop_centroid(loop)[axis]
        nodes = LID_REACH * (1.0 - np.linspace(0.0, 1.0, rings + 1))
        for start, end in loop[:, :, :2]:
            rays = np.stack([centre + nodes[:, None] * (start - centre), centre + nodes[:, None] * (end - centre)], 1)
            parts.append(_upward(patch(lift(rays, 0.0))))
    return Mesh(name=f"lid of {mesh.name}", vertices=np.concatenate(parts), planes=mesh.planes)


def _upward(quads: FloatArray) -> FloatArray:
    a, b, c, d = np.moveaxis(quads, 1, 0)
    down = (np.cross(c - a, d - b))[:, 2] < 0.0
    return np.where(down[:, None, None], turned_round(quads), quads)


def even_count(length: float, panel: float, coarse: bool = False) -> int:
    """Panels along a length: an even number, or half of it on the coarse mesh of the same family."""
    half = max(1, round(length / (2.0 * panel)))
    return half if coarse else 2 * half


def lift(points: FloatArray, height: float) -> FloatArray:
    """Points (..., 2) at a height, (..., 3)."""
    return np.concatenate([points, np.full((*points.shape[:-1], 1), height)], axis=-1)


def _plane(first: FloatArray, second: FloatArray, height: float) -> FloatArray:
    a, b = np.broadcast_arrays(first, second)
    return np.stack([a, b, np.full_like(a, height)], axis=-1)


def wall(line: FloatArray, heights: FloatArray) -> FloatArray:
    """Vertical wall over a line (m, 2) that keeps the body on its left, heights falling."""
    nodes = np.stack([np.concatenate([line, np.full((len(line), 1), z)], axis=1) for z in heights])
    return patch(nodes)


def _disc(centre: FloatArray, ring: FloatArray, height: float, rings: int) -> FloatArray:
    """Bottom (normal down) between a centre and an anticlockwise ring (m, 2)."""
    inwards = 1.0 - (1.0 - np.cos(0.5 * np.pi * np.linspace(0.0, 1.0, rings + 1)))
    nodes = centre + inwards[:, None, None] * (ring - centre)
    return patch(lift(nodes, height))
