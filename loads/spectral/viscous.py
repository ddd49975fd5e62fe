"""Drag of waves and current on the members, expanded to terms of the second order of what is Gaussian.

    F = sum_s P_s^T k_s |V| V,   V = U + v,   v = u - P x'                                               (1)
      = F_0 + X eta - B x' - K x + quadratic terms                                                       (2)
    quadratic terms = sum_s P_s^T k_s C2 : (v v - Cov v)                                                 (3)
    splash          = sum_p P_p^T k_p r |V| V,   r = r_0 + eta - R x,   V at mean water level            (4)

s counts strips, both transverse axes of each (`tlpsim.loads.hydro.morison`), and P_s turns forces along them into the
six of the platform. C0, C1, C2 are the coefficients of Hermite's expansion (`tlpsim.loads.spectral.hermite`), which
hold the statistics of the relative velocity: the linear part of eq. (1) is the wave's force, and the damping
B = sum P^T k C1 P. Eq. (4) is the drag on the members p that pierce the surface, between mean water level and the
elevation r relative to the platform, which the mean setdown raises by r_0. Of it

    r' |V| V = C1 c + C0 r' + 2 (C2 c) v + [C1 (r' v - c) + 3 (C3 c) : (v v - Cov v)],   c = Cov(v, r')    (5)

whose linear terms act like those of eq. (2). Where the velocities follow the surface (Wheeler), a strip at the height
z in water of the depth d meets those of the level z - r (1 + z/d), which adds -r' (1 + z/d) dV/dz to v.

Eq. (4) has the velocity of mean water level in crest and trough, and acts there. On the columns of the ISSC platform in
a sea of 7 m the mean of the splash zone is then some 13 % too large, and the pitch moment lacks up to 1 %; with
Wheeler's stretching the waves' drag is 6 to 10 % too large, of the order k² Var eta.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.hydro.morison import divide, projection
from tlpsim.loads.spectral.hermite import Expansion, SplashExpansion, expand, splash
from tlpsim.loads.spectral.model import SpectralWaves
from tlpsim.loads.spectral.products import Products, joined, no_products, pairs
from tlpsim.loads.spectral.wave_grid import WaveGrid
from tlpsim.loads.waves.airy import travel, velocity_transfer
from tlpsim.loads.waves.current import Current, current_velocity, uniform_current
from tlpsim.loads.waves.stretching import stretching_by_name

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_AT_SURFACE = 1e-9  # m
_DIFFERENCE = 0.05  # m, over which velocities are differentiated with height


@dataclass(frozen=True, slots=True, kw_only=True)
class DragElements:
    """Strips, or pieces at mean water level of members that pierce the surface; s of them.

    Attributes
    ----------
    position
        (s, 3) m.
    projection
        [e, r x e] of both axes, (s, 2, 6).
    drag
        0.5 rho C_D w times the length of a strip, (s, 2) kg/m; of a piece times the length a rise, (s, 2) kg/m².
    current
        Along both axes, (s, 2) m/s.
    lever
        R of eq. (4), (s, 6).
    level
        1 + z/d, (s,), where the profile of velocities follows the surface, else zero.
    current_slope
        Change of the current with height where it follows the surface, times `level`, (s, 2) 1/s.
    """

    position: FloatArray
    projection: FloatArray
    drag: FloatArray
    current: FloatArray
    lever: FloatArray
    level: FloatArray
    current_slope: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class DragRows:
    """What is linear in the waves at the elements: decomposed functions on a grid of N components.

    Attributes
    ----------
    water
        Velocity along both axes, (s, 2, N).
    elevation
        At the elements, (s, N).
    slope
        -(1 + z/d) du/dz where velocities follow the surface, (s, 2, N); None where they do not.
    """

    water: ComplexArray
    elevation: ComplexArray
    slope: ComplexArray | None


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearDrag:
    """Linear part of the drag, eq. (2), loads about the reference point, earth-fixed.

    Attributes
    ----------
    mean, splash_mean
        (6,) N, N·m, of strips and of the splash zone.
    damping, stiffness
        (6, 6), on the rates and the displacements of the platform.
    on_water, on_elevation
        Factors of the velocities, (s, 2, 6), and of the elevation, (s, 6), at the strips.
    on_surface_water, on_surface_elevation
        The same of the pieces at the surface.
    """

    mean: FloatArray
    splash_mean: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    on_water: FloatArray
    on_elevation: FloatArray
    on_surface_water: FloatArray
    on_surface_elevation: FloatArray


def _elements(
    waves: SpectralWaves, position: FloatArray, rows: FloatArray, drag: FloatArray, follows: float
) -> DragElements:
    current = uniform_current(0.0) if waves.current is None else waves.current
    count = len(position)
    pair = rows.reshape(count, 2, 6)
    flow = _along(current, position[:, 2], pair)
    depth = waves.state.water_depth
    lever = np.zeros((count, 6))
    lever[:, 2], lever[:, 3], lever[:, 4] = 1.0, position[:, 1], -position[:, 0]
    level = 1.0 + position[:, 2] / depth
    below = np.maximum(position[:, 2] - _DIFFERENCE, -depth)
    slope = (flow - _along(current, below, pair)) / np.maximum(position[:, 2] - below, _AT_SURFACE)[:, None]
    return DragElements(
        position=position,
        projection=pair,
        drag=drag.reshape(count, 2),
        current=flow,
        lever=lever,
        level=follows * level,
        current_slope=float(current.stretched and waves.splash) * level[:, None] * slope,
    )


def _along(current: Current, height: FloatArray, pair: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("sad,sd->sa", pair[:, :, :3], current_velocity(current, height)))


def _acting(waves: SpectralWaves) -> bool:
    """Whether the waves change the wet part of the members."""
    return waves.splash and waves.state.significant_height > 0.0


def strips(waves: SpectralWaves) -> DragElements:
    """The strips of a hull up to mean water level, without those that have no drag."""
    cut = divide(waves.members, waves.strip_length, waves.water_density)
    kept = np.flatnonzero(np.any(cut.drag.reshape(-1, 2) > 0.0, axis=1))
    rule = stretching_by_name(waves.stretching)
    pairs = cut.projection.reshape(-1, 2, 6)[kept]
    follows = rule.follows if _acting(waves) else 0.0
    return _elements(waves, cut.position[kept], pairs, cut.drag.reshape(-1, 2)[kept], follows)


def surface_pieces(waves: SpectralWaves) -> DragElements:
    """Pieces of a unit rise of the members that end at mean water level; none where drag ends there."""
    members, rule = waves.members, stretching_by_name(waves.stretching)
    places, pairs, drags = [np.zeros((0, 3))], [np.zeros((0, 3))], [np.zeros(0)]
    for m in range(len(members.area)):
        low, high = members.start[m], members.end[m]
        pair = np.vstack([members.across[m], np.cross((high - low) / np.linalg.norm(high - low), members.across[m])])
        if low[2] > high[2]:
            low, high = high, low
        drag = 0.5 * waves.water_density * members.drag_coefficient[m] * members.width[m]
        if not (_acting(waves) and rule.rises and high[2] > -_AT_SURFACE and high[2] - low[2] > _AT_SURFACE):
            continue
        if np.any(drag > 0.0):
            places.append(high[None])
            pairs.append(pair)
            drags.append(drag * float(np.linalg.norm(high - low) / (high[2] - low[2])))
    position, direction = np.vstack(places), np.vstack(pairs)
    rows = projection(np.repeat(position, 2, axis=0), direction)
    return _elements(waves, position, rows, np.concatenate(drags), 0.0)


def drag_rows(elements: DragElements, grid: WaveGrid) -> DragRows:
    """Velocities and elevations at the elements as decomposed functions on a grid."""
    sea, count = grid.sea, len(elements.position)
    place = elements.position
    arguments = (sea.angular_frequency, sea.wavenumber, sea.heading, sea.water_depth)
    pair = elements.projection[:, :, :3]
    water = (pair @ velocity_transfer(*arguments, place)) * grid.root
    slope = None
    if np.any(elements.level > 0.0) and count:
        lower = place.copy()
        lower[:, 2] = np.maximum(place[:, 2] - _DIFFERENCE, -sea.water_depth)
        rise = np.maximum(place[:, 2] - lower[:, 2], _AT_SURFACE)
        below = (pair @ velocity_transfer(*arguments, lower)) * grid.root
        slope = -(elements.level / rise)[:, None, None] * (water - below)
    return DragRows(
        water=water,
        elevation=travel(sea.wavenumber, sea.heading, place[:, 0], place[:, 1]) * grid.root,
        slope=slope,
    )


def relative_rows(
    elements: DragElements, rows: DragRows, position: ComplexArray, omega: FloatArray
) -> tuple[ComplexArray, ComplexArray]:
    """v (s, 2, N) and r' (s, N) of eqs. (1) and (4), for the platform's decomposed position (6, N)."""
    relative = rows.water - np.tensordot(elements.projection, 1j * omega * position, axes=1)
    return relative, rows.elevation - elements.lever @ position


def covariances(
    elements: DragElements, relative: ComplexArray, elevation: ComplexArray, step: float, slow: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Cov v (s, 2, 2) and Cov(v, r') (s, 2) from decomposed rows and the covariance (6, 6) of other velocities."""
    within = step * (relative @ relative.conj().swapaxes(1, 2)).real
    beside = np.einsum("sai,ij,sbj->sab", elements.projection, slow, elements.projection)
    return within + beside, step * np.einsum("san,sn->sa", relative, elevation.conj()).real


@dataclass(frozen=True, slots=True, kw_only=True)
class Drag:
    """Expanded drag of strips and of the pieces at the surface: expansions, that of eq. (5), r_0 of eq. (4), (p,) m."""

    strips: DragElements
    surface: DragElements
    steady: Expansion
    piercing: Expansion
    zone: SplashExpansion
    rise: FloatArray


def expanded(
    elements: tuple[DragElements, DragElements],
    covariance: tuple[FloatArray, FloatArray],
    cross: FloatArray,
    rise: FloatArray,
) -> Drag:
    """Hermite's expansion of the drag.

    Parameters
    ----------
    elements
        Strips and pieces at the surface.
    covariance
        Of the relative velocities at either, (s, 2, 2) and (p, 2, 2), m²/s².
    cross
        c of eq. (5), (p, 2) m²/s.
    rise
        r_0 of eq. (4), (p,) m.
    """
    under, surface = elements
    both = expand(np.concatenate([under.current, surface.current]), np.concatenate(covariance))
    steady, piercing = (
        Expansion(**{each.name: getattr(both, each.name)[part] for each in fields(Expansion)})
        for part in (slice(len(under.current)), slice(len(under.current), None))
    )
    return Drag(
        strips=under,
        surface=surface,
        steady=steady,
        piercing=piercing,
        zone=splash(piercing, cross),
        rise=rise,
    )


def _loads(elements: DragElements, factor: FloatArray) -> FloatArray:
    """Loads P^T k f of factors (s, 2, ...) on each element, (s, 6, ...)."""
    weighted = elements.projection * elements.drag[:, :, None]
    return np.asarray(np.einsum("sai,sa...->si...", weighted, factor))


def linear_drag(drag: Drag) -> LinearDrag:
    """Mean, damping, stiffness and the factors of the waves, eqs. (2) and (5)."""
    under, surface, rise = drag.strips, drag.surface, drag.rise[:, None]
    steady, piercing, zone = drag.steady, drag.piercing, drag.zone
    on_water = _loads(under, steady.linear)
    follows = np.einsum("sab,sb->sa", steady.linear, under.current_slope)
    on_elevation = -_loads(under, follows)
    on_surface_water = _loads(surface, zone.velocity + rise[:, None] * piercing.linear)
    on_surface_elevation = _loads(surface, zone.elevation)
    splash_mean = _loads(surface, zone.mean + rise * piercing.mean)
    damping = np.einsum("sia,saj->ij", on_water, under.projection)
    damping += np.einsum("sia,saj->ij", on_surface_water, surface.projection)
    stiffness = on_elevation.T @ under.lever + on_surface_elevation.T @ surface.lever
    return LinearDrag(
        mean=_loads(under, steady.mean).sum(axis=0),
        splash_mean=splash_mean.sum(axis=0),
        damping=damping,
        stiffness=stiffness,
        on_water=on_water,
        on_elevation=on_elevation,
        on_surface_water=on_surface_water,
        on_surface_elevation=on_surface_elevation,
    )


def wave_loads(linear: LinearDrag, under: DragRows, surface: DragRows) -> ComplexArray:
    """Loads X eta of eq. (2) as decomposed functions, (6, N)."""
    parts = (
        (linear.on_water, under.water),
        (linear.on_surface_water, surface.water),
        (linear.on_elevation, under.elevation),
        (linear.on_surface_elevation, surface.elevation),
    )
    force = np.zeros((6, under.elevation.shape[1]), dtype=np.complex128)
    for factor, row in parts:
        flat = factor.swapaxes(0, 1).reshape(6, -1)
        force += flat @ row.reshape(flat.shape[1], -1) if flat.size else 0.0
    return force


def viscous_products(drag: Drag, relative: ComplexArray) -> Products:
    """Quadratic terms of the strips, eq. (3)."""
    return squares(_loads(drag.strips, drag.steady.quadratic), relative)


def following_products(drag: Drag, elevation: ComplexArray, rows: DragRows) -> Products:
    """Quadratic terms of a profile of velocities that follows the surface, -r' (1 + z/d) du/dz, mean included."""
    found = no_products(elevation.shape[1])
    if rows.slope is not None:
        weights = _loads(drag.strips, drag.steady.linear)
        for axis in range(2):
            found = joined(found, pairs(elevation, rows.slope[:, axis], weights[:, :, axis].T))
    return found


def splash_products(drag: Drag, relative: ComplexArray, elevation: ComplexArray) -> Products:
    """Quadratic terms of the pieces at the surface, eq. (5)."""
    surface = drag.surface
    square = drag.zone.quadratic + drag.rise[:, None, None, None] * drag.piercing.quadratic
    products = _loads(surface, drag.zone.product)
    return joined(
        squares(_loads(surface, square), relative),
        *(pairs(elevation, relative[:, axis], products[:, :, axis].T) for axis in range(2)),
    )


def squares(weights: FloatArray, relative: ComplexArray) -> Products:
    """Products of both velocities of each element for weights (s, 6, 2, 2)."""
    if not np.any(weights):
        return no_products(relative.shape[2], weights.shape[1])
    first = 2 * np.arange(len(relative))
    return Products(
        relative.reshape(-1, relative.shape[2]),
        np.concatenate([first, first, first + 1]),
        np.concatenate([first, first + 1, first + 1]),
        np.concatenate([weights[:, :, 0, 0], weights[:, :, 0, 1] + weights[:, :, 1, 0], weights[:, :, 1, 1]]).T,
    )
