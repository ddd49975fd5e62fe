"""A control surface around a body, and the still water between them, as quadrature points.

The surface is an upright cylinder of radius R_c about the origin with a bottom; both lie in the water. The water plane
around waterlines that are star-shaped about their centres c falls apart along the lines on which two waterlines with
outermost radii ρ have the same power |x - c|² - ρ². In each part rays run from a straight piece e(u), 0 ≤ u ≤ 1, of the
waterline to the border,

    x = c + s (e(u) - c),   1 ≤ s ≤ s_max(u),   dA = s |(e - c) × de/du| du ds                               (1)

with points that gather towards the hull. Nearer to the hull than `CLEARANCE` of a piece panels of constant potential
show; there the field is interpolated between its values at that distance and on the waterline.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.bem.discretization import Discretization
from tlpsim.loads.bem.field_points import field
from tlpsim.loads.bem.mesh import connected, loop_centroid
from tlpsim.loads.bem.solver import Solution
from tlpsim.loads.errors import ScenarioError

if TYPE_CHECKING:
    from tlpsim.loads.bem.surface import Hull, Waterline

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

CLEARANCE = 0.6
"""Distance from the hull, in lengths of a piece of its waterline, from which on the field is taken off the hull."""
_MARGIN = 0.2  # of the body's largest radius, from there to the control surface
_POINTS_PER_WAVE = 8.0  # of products of two fields, whose waves are half as long
_FEWEST_AROUND = 48
_HARMONICS = 4  # points around for every length of the gap between body and surface in the circumference
_FEWEST_DEEP = 10
_FEWEST_OUT = 7
_SAMPLES = 256  # of a piece of the waterline, to find the corners of its part of the water


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlSurface:
    """Quadrature points: on the surface, on its circle in still water, and on the water between it and the hull.

    `normal` (n, 3) are outer normals times areas, `circle_normal` (m, 3) outer normals times lengths, `water_area` (w,)
    areas. The field on the water is that at `water_seen`, with the share `water_share` (w,), and that of the piece
    `water_piece` (w,) of the waterline.
    """

    places: FloatArray
    normal: FloatArray
    circle: FloatArray
    circle_normal: FloatArray
    water: FloatArray
    water_seen: FloatArray
    water_share: FloatArray
    water_piece: NDArray[np.int64]
    water_area: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlFields:
    """Potential (points, headings) and velocity (points, headings, 3) on the parts of a control surface."""

    surface: ControlSurface
    velocity: ComplexArray
    circle_potential: ComplexArray
    water_potential: ComplexArray
    water_velocity: ComplexArray


def control_surface(
    hull: Hull, depth: float, shortest_wave: float, radius: float | None = None, below: float | None = None
) -> ControlSurface:
    """Control surface about the origin around a hull.

    Parameters
    ----------
    hull
        From `surface.hull_surface`.
    depth
        Water depth in m, infinity for deep water.
    shortest_wave
        Length in m of the shortest wave that is to be resolved.
    radius, below
        Radius and depth of the surface in m; a fifth of the body's radius off it, and above the bottom, if None.

    Raises
    ------
    ScenarioError
        If the surface meets the hull or the bottom.
    """
    reach = float(np.max(np.linalg.norm(hull.places[..., :2], axis=-1)))
    draft = -float(np.min(hull.places[..., 2]))
    gap = _MARGIN * max(reach, draft)
    outer = reach + gap if radius is None else radius
    if below is None:
        below = min(draft + gap, 0.5 * (draft + depth))
    if outer <= reach or not draft < below <= depth:
        raise ScenarioError(
            f"control surface of radius {outer:.4g} m down to {below:.4g} m meets '{hull.name}', which reaches "
            f"{reach:.4g} m and {draft:.4g} m, or the bottom at {depth} m; leave both None or choose it between them"
        )
    around = int(np.ceil(2.0 * np.pi * outer * max(_POINTS_PER_WAVE / shortest_wave, _HARMONICS / (outer - reach))))
    around = max(around, _FEWEST_AROUND)
    angle = 2.0 * np.pi * np.arange(around) / around
    out = np.stack([np.cos(angle), np.sin(angle), np.zeros(around)], axis=-1)
    step = 2.0 * np.pi / around

    waves = _POINTS_PER_WAVE / shortest_wave
    across = _FEWEST_OUT + int(np.ceil(waves * outer))
    share, weight = _gauss(_FEWEST_DEEP + int(np.ceil(0.5 * waves * below)))
    level, thickness = -below * share**2, 2.0 * below * share * weight  # gathered towards the waves
    wall = outer * out[None, :, :] + level[:, None, None] * np.array([0.0, 0.0, 1.0])
    wall_normal = np.broadcast_to(out, wall.shape) * (outer * step * thickness)[:, None, None]
    share, weight = _gauss(across)
    bottom = outer * share[:, None, None] * out[None, :, :] - np.array([0.0, 0.0, below])
    bottom_normal = np.zeros_like(bottom)
    bottom_normal[..., 2] = -(outer**2 * share * weight * step)[:, None]
    line = hull.waterline
    if len(line.panel):
        water, seen, near, piece, area = _water(line, outer, waves)
    else:
        water = outer * (share[:, None, None] * out[None, :, :])
        area = np.broadcast_to((outer**2 * share * weight * step)[:, None], water.shape[:2]).ravel()
        water = seen = water.reshape(-1, 3)
        near, piece = np.ones(len(water)), np.zeros(len(water), dtype=np.int64)
    return ControlSurface(
        places=np.concatenate([wall.reshape(-1, 3), bottom.reshape(-1, 3)]),
        normal=np.concatenate([wall_normal.reshape(-1, 3), bottom_normal.reshape(-1, 3)]),
        circle=outer * out,
        circle_normal=outer * step * out,
        water=water,
        water_seen=seen,
        water_share=near,
        water_piece=piece,
        water_area=area,
    )


def control_fields(
    discretization: Discretization,
    solution: Solution,
    motion: ComplexArray,
    surface: ControlSurface,
    waterline_potential: ComplexArray,
    waterline_velocity: ComplexArray,
) -> ControlFields:
    """The first-order field on a control surface.

    Parameters
    ----------
    discretization, solution, motion
        As for `field_points.field`.
    surface
        From `control_surface`.
    waterline_potential, waterline_velocity
        (pieces, headings) and (pieces, headings, 3) on the hull.
    """
    ends = np.cumsum([len(surface.places), len(surface.circle)])
    found = field(
        discretization, solution, motion, np.concatenate([surface.places, surface.circle, surface.water_seen])
    )
    water_potential, water_velocity = found.potential[ends[1] :], found.velocity[ends[1] :]
    if len(waterline_potential):
        share = surface.water_share[:, None]
        on = surface.water_piece
        water_potential = share * water_potential + (1.0 - share) * waterline_potential[on]
        water_velocity = share[..., None] * water_velocity + (1.0 - share[..., None]) * waterline_velocity[on]
    return ControlFields(
        surface=surface,
        velocity=found.velocity[: ends[0]],
        circle_potential=found.potential[ends[0] : ends[1]],
        water_potential=water_potential,
        water_velocity=water_velocity,
    )


def _gauss(count: int) -> tuple[FloatArray, FloatArray]:
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * (nodes + 1.0), 0.5 * weights


def _intervals(border: NDArray[np.int64], fewest: int) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
    """Pieces and bounds (n,) of parts of 0 ≤ u ≤ 1 on each of which all rays end on one border.

    `border` (pieces, samples) is the border's number at samples of u: where it changes, the area's edge has a corner.
    """
    pieces, samples = border.shape
    row, column = np.nonzero(np.diff(border, axis=1))
    rows = np.concatenate([np.repeat(np.arange(pieces), fewest), row])
    lows = np.concatenate([np.tile(np.arange(fewest) / fewest, pieces), (column + 1.0) / samples])
    order = np.lexsort((lows, rows))
    rows, lows = rows[order], lows[order]
    highs = np.append(np.where(rows[1:] == rows[:-1], lows[1:], 1.0), 1.0)
    wide = highs > lows
    return rows[wide], lows[wide], highs[wide]


def _limit(
    loop: NDArray[np.int64], centre: FloatArray, reach: FloatArray, ray: FloatArray, outer: float
) -> tuple[FloatArray, NDArray[np.int64]]:
    """s_max of rays (n, q, 2) from the centres of their loops (n,), and the border that they end on."""
    own = centre[loop]
    limit = _circle_limit(own[:, None, :], ray, outer)
    border = np.full(limit.shape, -1, dtype=np.int64)
    for other in range(len(centre)):
        apart = centre[other] - own
        # |x - c|² - ρ² is the same for both where 2 (x - c) · apart = |apart|² + ρ² - ρ_other².
        level = 0.5 * (np.sum(apart**2, axis=1) + reach[loop] ** 2 - reach[other] ** 2)
        towards = np.einsum("pqk,pk->pq", ray, apart)
        here = (towards > 0.0) & (loop != other)[:, None]
        end = np.where(here, level[:, None] / np.where(here, towards, 1.0), np.inf)
        border = np.where(end < limit, other, border)
        limit = np.minimum(limit, end)
    return limit, border


def _water(
    line: Waterline, outer: float, waves: float
) -> tuple[FloatArray, FloatArray, FloatArray, NDArray[np.int64], FloatArray]:
    """Points between waterlines and circle, points to take the field at, their share, pieces, and areas, eq. (1)."""
    start, end = (line.middle + sign * 0.5 * line.step for sign in (-1.0, 1.0))
    edges = np.stack([start, end], axis=1)
    loop = connected(edges[:, :, :2])
    count = int(loop.max()) + 1
    centre = np.stack([loop_centroid(edges[loop == k]) for k in range(count)])
    reach = np.array([float(np.max(np.linalg.norm(start[loop == k, :2] - centre[k], axis=1))) for k in range(count)])
    fewest = max(_FEWEST_AROUND, 2.0 * np.pi * outer / count * waves) / float(np.min(np.bincount(loop)))
    fine = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    ray = start[:, None, :2] + fine[None, :, None] * line.step[:, None, :2] - centre[loop][:, None, :]
    _, border = _limit(loop, centre, reach, ray, outer)
    piece, low, high = _intervals(border, int(np.ceil(fewest)))
    share, weight = _gauss(2)
    u = low[:, None] + share * (high - low)[:, None]
    loop, step = loop[piece], line.step[piece, None, :2]
    ray = start[piece, None, :2] + u[..., None] * step - centre[loop][:, None, :]
    sweep = np.abs(ray[..., 0] * step[..., 1] - ray[..., 1] * step[..., 0]) * weight * (high - low)[:, None]
    limit, _ = _limit(loop, centre, reach, ray, outer)
    length = np.linalg.norm(line.step[piece], axis=1)
    widest = float(np.max((limit - 1.0) * np.linalg.norm(ray, axis=-1)))
    share, weight = _gauss(_FEWEST_OUT + int(np.ceil(waves * widest)))
    beyond = (limit - 1.0)[..., None]
    scale = 1.0 + beyond * share**2
    area = sweep[..., None] * scale * beyond * 2.0 * share * weight
    size = np.linalg.norm(ray, axis=-1)[..., None]
    distance = (scale - 1.0) * size
    least = np.minimum(CLEARANCE * length[:, None, None], 0.5 * beyond * size)
    seen = scale + np.maximum(least - distance, 0.0) / size
    near = np.minimum(distance / least, 1.0)
    piece = np.broadcast_to(piece[:, None, None], near.shape)
    points = [
        np.concatenate([flat, np.zeros((len(flat), 1))], axis=1)
        for flat in (
            (centre[loop][:, None, None, :] + s[..., None] * ray[:, :, None, :]).reshape(-1, 2) for s in (scale, seen)
        )
    ]
    return points[0], points[1], near.ravel(), piece.ravel(), area.ravel()


def _circle_limit(centre: FloatArray, ray: FloatArray, radius: float) -> FloatArray:
    """s at which centre + s ray is on the circle."""
    a = np.sum(ray**2, axis=-1)
    b = np.sum(ray * centre, axis=-1)
    c = np.sum(centre**2, axis=-1) - radius**2
    return np.asarray((-b + np.sqrt(b * b - a * c)) / a)
