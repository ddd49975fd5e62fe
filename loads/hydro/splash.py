"""Drag on members up to the instantaneous surface of the waves.

    F = sum_p phi_p [e; r_p x e] 0.5 rho C_D w l_p |u_r| u_r,   u_r = u(z') + s z'' + U - v           (1)
    r = eta(x, y) - (heave + roll y - pitch x)                                                       (2)
    u(z') = sum_j c_j(t) T_j(xi),   xi = (z' - z_m) / h,   -1 <= xi <= 1                             (3)
    c_j(t) = Re{sum_n (sum_i w_ji H_n(x, y, z_i)) a_n(t)},   w_ji = (2 - delta_j0) / M cos(j theta_i)        (4)

A member is cut into pieces p, and one that ends at mean water level goes on above it. The part phi_p of a piece that
lies below the elevation r relative to the platform is wet; the drag of a piece acts at the middle r_p of that part,
with the water velocity at the level z' and the excess z'' above it of a stretching (`tlpsim.loads.waves.stretching`,
with r for eta), s the gradient at mean water level. Wheeler's stretching moves the velocities of all depths.

The velocities over the heights that a piece can meet are a Chebyshev series, eq. (3), interpolated at the zeros
cos theta_i = cos (i + 1/2) pi / M of T_M. Its coefficients are linear in the waves, eq. (4), and so are a few rows of
the real matrix that gives all that is linear in the sea (`tlpsim.loads.hydro.excitation`); a vertical member has one
series for all its pieces. M is the least for which no wave of the sea has an error above `LEVEL_TOLERANCE` of its
velocity at z = 0, at any height of the range. Elevations beyond the range take the velocities of its end.

On the four columns and four pontoons of the ISSC platform, in seas of 7 and 12 m, the series leaves errors of at most
0.04 % of the standard deviation, and strips of 5 m 0.7 % of that of the forces and 1.5 % of the yaw moment.

The mean force depends on the stretching. Without current, vertical and linear stretching give the mean of
0.5 rho C_D w eta |u| u at z = 0, of the third order in the wave's amplitude. Wheeler's moves the profile with the
surface, so that the wet length has the same velocities in crest and trough, and leaves of that mean only what passes
the lower end at z = -L of the member, exp(-2kL) of it: next to nothing on a deep column.
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tlpsim.loads.checks import require_positive
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.hydro.morison import Members, projection, strip_counts
from tlpsim.loads.waves.airy import surface_velocity_gradient_transfer, travel, velocity_transfer
from tlpsim.loads.waves.current import Current, current_velocity
from tlpsim.loads.waves.sea import Sea, SeaState
from tlpsim.loads.waves.stretching import Stretching, stretching_by_name

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.int64]

LEVEL_TOLERANCE = 2e-3
"""Largest error of eq. (3) for one wave, relative to its velocity at mean water level."""
DEFAULT_LARGEST_ELEVATION = 15.0
"""m"""

_MOST_LEVELS = 60
_TEST_HEIGHTS = 121
_TEST_WAVES = 60
_CURRENT_STEP = 0.25  # m, of the table of the current
_SAME_PLACE = 1e-6  # m, horizontal distance of the ends of a vertical member
_AT_SURFACE = 1e-9  # m
_STANDARD_DEVIATIONS = 4.5
_SMALLEST_RANGE = 1.0  # m


def largest_elevation(state: SeaState) -> float:
    """Elevation in m that a sea state hardly exceeds: 4.5 standard deviations, one crest in 25 000."""
    edges = np.linspace(0.0, state.highest_frequency, 4001)
    variance = np.sum(state.density(0.5 * (edges[1:] + edges[:-1]))) * (edges[1] - edges[0])
    return max(_STANDARD_DEVIATIONS * math.sqrt(float(variance)), _SMALLEST_RANGE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Pieces:
    """Pieces of members from the keel up to above the waves, p of them.

    Parameters
    ----------
    centre
        Shape (p, 3), m.
    span
        From the lower to the upper end, shape (p, 3), m.
    direction
        Transverse unit vectors, shape (2p, 3).
    drag
        0.5 rho C_D w l, shape (2p,), kg/m.
    station
        Number of the place at which a piece takes its velocities, shape (p,): one a vertical member, else one a piece.
    """

    centre: FloatArray
    span: FloatArray
    direction: FloatArray
    drag: FloatArray
    station: IntArray


def pieces(members: Members, strip_length: float, water_density: float, elevation: float) -> Pieces:
    """Cut members into equal pieces no longer than `strip_length`, up to `elevation` above mean water level (m).

    Raises
    ------
    ScenarioError
        If a parameter is not positive.
    """
    require_positive("water density", water_density, "kg/m³")
    require_positive("largest elevation of the splash zone", elevation, "m")
    centres, spans, directions, drags, stations = [], [], [], [], []
    next_station = 0
    for m, count in enumerate(strip_counts(members, strip_length)):
        low, high = members.start[m], members.end[m]
        pair = np.vstack([members.across[m], np.cross((high - low) / np.linalg.norm(high - low), members.across[m])])
        if low[2] > high[2]:
            low, high = high, low
        fractions = (np.arange(count) + 0.5) / count
        centre = low + fractions[:, None] * (high - low)
        span = np.tile((high - low) / count, (count, 1))
        if high[2] > -_AT_SURFACE and high[2] - low[2] > _AT_SURFACE:
            axis = (high - low) / (high[2] - low[2])
            more = int(np.ceil(elevation * np.linalg.norm(axis) / strip_length - 1e-9))
            centre = np.vstack([centre, high + ((np.arange(more) + 0.5) * elevation / more)[:, None] * axis])
            span = np.vstack([span, np.tile(elevation / more * axis, (more, 1))])
        length = np.linalg.norm(span, axis=1)
        upright = np.hypot(*(high - low)[:2]) < _SAME_PLACE
        places = np.zeros(len(centre), dtype=np.int64) if upright else np.arange(len(centre))
        stations.append(next_station + places)
        next_station += int(places[-1]) + 1
        centres.append(centre)
        spans.append(span)
        directions.append(np.tile(pair, (len(centre), 1)))
        drags.append(np.outer(length, 0.5 * water_density * members.drag_coefficient[m] * members.width[m]).ravel())
    return Pieces(
        centre=np.vstack(centres),
        span=np.vstack(spans),
        direction=np.vstack(directions),
        drag=np.concatenate(drags),
        station=np.concatenate(stations),
    )


def _series(bottom: float, top: float, wavenumbers: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Heights (M,) from which the series of eq. (3) over a range is made, and its weights w_ji, shape (M, M)."""
    middle, half = 0.5 * (top + bottom), 0.5 * (top - bottom)
    if len(wavenumbers) == 0 or half <= 0.0:
        return np.array([middle]), np.ones((1, 1))
    numbers = np.linspace(wavenumbers.min(), wavenumbers.max(), _TEST_WAVES)
    places = np.linspace(-1.0, 1.0, _TEST_HEIGHTS)
    exact = np.exp(np.outer(middle + half * places, numbers))
    for count in range(1, _MOST_LEVELS + 1):
        angles = (np.arange(count) + 0.5) * np.pi / count
        heights = middle + half * np.cos(angles)
        orders = np.arange(count)
        weights = np.cos(np.outer(orders, angles)) * (np.where(orders > 0, 2.0, 1.0) / count)[:, None]
        series = np.cos(np.outer(np.arccos(places), orders)) @ (weights @ np.exp(np.outer(heights, numbers)))
        if np.max(np.abs(series - exact)) <= LEVEL_TOLERANCE:
            break
    return heights, weights


@dataclass(frozen=True, slots=True, kw_only=True)
class SplashZone:
    """Drag up to the surface, ready for `splash_drag`; made by `splash_zone`.

    Parameters
    ----------
    transfer
        Rows that it needs of the sea, shape (R, N).
    rows
        Of each piece: row of the elevation (-1: always wet), first row of the series, its length M, row of the
        gradient (-1: none); shape (p, 4).
    table
        Of each piece: lower end, rise to the upper end, z_m, 1/h, x, y, both drag factors (phi = 1), both projections
        [e, r x e] (12), and the change of both r x e from the lower to the upper end (6); shape (p, 26).
    current
        Horizontal velocity of the current at equal steps of height, shape (t, 2), m/s.
    rule
        rises, follows, tangent, whether the current follows, 1/d, the lowest height of `current` and the inverse of
        its step; shape (7,).
    """

    transfer: ComplexArray
    rows: IntArray
    table: FloatArray
    current: FloatArray
    rule: FloatArray


def _level(height: float, elevation: float, rule: Stretching, depth: float) -> float:
    moved = rule.follows * elevation
    return min(max((height - moved) / (1.0 + moved / depth), -depth), 0.0)


def _range(
    cut: Pieces, chosen: IntArray, elevation: float, rule: Stretching, depth: float
) -> tuple[float, float, bool]:
    """Lowest and highest level that the pieces of a station can meet, and whether one of them can be dry."""
    centre, rise = cut.centre[chosen, 2], cut.span[chosen, 2]
    crosses = centre + 0.5 * rise > -elevation
    lowest = np.where(crosses, centre - 0.5 * rise, centre).min()
    bottom, top = _level(lowest, elevation, rule, depth), _level(centre.max(), -elevation, rule, depth)
    return bottom, top, bool(np.any(crosses))


def splash_zone(
    members: Members,
    sea: Sea,
    *,
    stretching: str,
    elevation: float,
    current: Current,
    strip_length: float,
    water_density: float,
    first_row: int,
) -> SplashZone:
    """Prepare the drag of eq. (1).

    Parameters
    ----------
    members
        The hull; those that end at mean water level go on above it.
    sea
        Only its components matter.
    stretching
        Name in `tlpsim.loads.waves.stretching.STRETCHING`.
    elevation
        Largest elevation that counts, m.
    first_row
        Number of the first of the rows in `transfer` among all that the sea is asked for.

    Raises
    ------
    ScenarioError
        If a parameter is out of range, or a member reaches below the sea bed.
    """
    rule, depth = stretching_by_name(stretching), sea.water_depth
    if not elevation < depth:
        raise ScenarioError(f"largest elevation of the splash zone is {elevation} m; it must be < the depth, {depth} m")
    cut = pieces(members, strip_length, water_density, elevation)
    lowest = float((cut.centre - 0.5 * cut.span)[:, 2].min())
    if lowest < -depth:
        raise ScenarioError(f"members: an end lies at z = {lowest} m, below the sea bed at {-depth} m")
    arguments = (sea.angular_frequency, sea.wavenumber, sea.heading, depth)
    blocks: list[ComplexArray] = []
    rows = np.full((len(cut.centre), 4), -1, dtype=np.int64)
    table = np.empty((len(cut.centre), 26))
    known: dict[tuple[float, float], tuple[FloatArray, FloatArray]] = {}
    row = first_row
    for station in range(int(cut.station[-1]) + 1):
        chosen = np.flatnonzero(cut.station == station)
        place = cut.centre[chosen[0]]
        bottom, top, crosses = _range(cut, chosen, elevation, rule, depth)
        if crosses or rule.follows or current.stretched:
            blocks.append(travel(sea.wavenumber, sea.heading, place[:1], place[1:2]))
            rows[chosen, 0] = row
            row += 1
        pair = cut.direction[2 * chosen[0] : 2 * chosen[0] + 2]
        key = (round(bottom, 6), round(top, 6))
        if key not in known:
            known[key] = _series(bottom, top, sea.wavenumber)
        heights, weights = known[key]
        points = np.column_stack([np.tile(place[:2], (len(heights), 1)), heights])
        water = np.einsum("ad,idn->ian", pair, velocity_transfer(*arguments, points))
        blocks.append(np.einsum("ji,ian->jan", weights, water).reshape(2 * len(heights), -1))
        rows[chosen, 1], rows[chosen, 2] = row, len(heights)
        row += 2 * len(heights)
        if rule.tangent and np.any(cut.centre[chosen, 2] > 0.0):
            gradient = surface_velocity_gradient_transfer(*arguments, place[None, :2])[0]
            blocks.append(np.einsum("ad,dn->an", pair, gradient))
            rows[chosen, 3] = row
            row += 2
        table[chosen, 2] = 0.5 * (top + bottom)
        table[chosen, 3] = 2.0 / (top - bottom) if top > bottom else 0.0
    _fill(table, cut)
    heights = np.arange(np.floor(max(lowest - elevation, -depth) / _CURRENT_STEP), 1.0) * _CURRENT_STEP
    return SplashZone(
        transfer=np.vstack(blocks),
        rows=rows,
        table=table,
        current=np.ascontiguousarray(current_velocity(current, np.maximum(heights, -depth))[:, :2]),
        rule=np.array(
            [
                rule.rises,
                rule.follows,
                rule.tangent,
                float(current.stretched),
                1.0 / depth,
                heights[0],
                1.0 / _CURRENT_STEP,
            ]
        ),
    )


def _fill(table: FloatArray, cut: Pieces) -> None:
    lower = cut.centre - 0.5 * cut.span
    table[:, 0], table[:, 1] = lower[:, 2], cut.span[:, 2]
    table[:, 4:6] = cut.centre[:, :2]
    table[:, 6:8] = cut.drag.reshape(-1, 2)
    table[:, 8:20] = projection(np.repeat(lower, 2, axis=0), cut.direction).reshape(-1, 12)
    table[:, 20:26] = np.cross(np.repeat(cut.span, 2, axis=0), cut.direction).reshape(-1, 6)


@njit(cache=True)
def splash_drag(  # type: ignore[no-untyped-def]
    response, position, velocity, rows, table, current, rule, force
):
    """Eq. (1) from the rows of the sea in `response`, into `force` (6,), N and N·m.

    `position` and `velocity` (6,) are those of the platform; the others are fields of a `SplashZone`.
    """
    rises, follows, tangent, current_follows, inverse_depth, lowest, inverse_step = rule
    force[:] = 0.0
    for p in range(rows.shape[0]):
        elevation, wet, middle = 0.0, 1.0, 0.5
        if rows[p, 0] >= 0:
            offset = position[2] + position[3] * table[p, 5] - position[4] * table[p, 4]
            elevation = response[rows[p, 0]] - offset
            above = rises * elevation - table[p, 0]
            if above <= 0.0:
                continue
            if above < table[p, 1]:
                wet = above / table[p, 1]
                middle = 0.5 * wet
        height = table[p, 0] + middle * table[p, 1]
        moved = follows * elevation
        level = min((height - moved) / (1.0 + moved * inverse_depth), 0.0)
        place = min(max((level - table[p, 2]) * table[p, 3], -1.0), 1.0)

        first, count = rows[p, 1], rows[p, 2]
        next_1, next_2, after_1, after_2 = 0.0, 0.0, 0.0, 0.0
        for j in range(count - 1, 0, -1):
            here_1 = response[first + 2 * j] + 2.0 * place * next_1 - after_1
            here_2 = response[first + 2 * j + 1] + 2.0 * place * next_2 - after_2
            next_1, next_2, after_1, after_2 = here_1, here_2, next_1, next_2
        relative_1 = response[first] + place * next_1 - after_1
        relative_2 = response[first + 1] + place * next_2 - after_2
        if rows[p, 3] >= 0:
            excess = tangent * max(height, 0.0)
            relative_1 += excess * response[rows[p, 3]]
            relative_2 += excess * response[rows[p, 3] + 1]

        moved = current_follows * elevation
        cell = (min((height - moved) / (1.0 + moved * inverse_depth), 0.0) - lowest) * inverse_step
        cell = min(max(cell, 0.0), current.shape[0] - 1.0)
        k = min(int(cell), current.shape[0] - 2)
        along = current[k, 0] + (cell - k) * (current[k + 1, 0] - current[k, 0])
        across = current[k, 1] + (cell - k) * (current[k + 1, 1] - current[k, 1])
        relative_1 += table[p, 8] * along + table[p, 9] * across
        relative_2 += table[p, 14] * along + table[p, 15] * across
        for i in range(3):
            relative_1 -= table[p, 8 + i] * velocity[i]
            relative_2 -= table[p, 14 + i] * velocity[i]
            relative_1 -= (table[p, 11 + i] + middle * table[p, 20 + i]) * velocity[3 + i]
            relative_2 -= (table[p, 17 + i] + middle * table[p, 23 + i]) * velocity[3 + i]

        speed = wet * math.sqrt(relative_1 * relative_1 + relative_2 * relative_2)
        force_1 = table[p, 6] * speed * relative_1
        force_2 = table[p, 7] * speed * relative_2
        for i in range(3):
            force[i] += table[p, 8 + i] * force_1 + table[p, 14 + i] * force_2
            force[3 + i] += (table[p, 11 + i] + middle * table[p, 20 + i]) * force_1
            force[3 + i] += (table[p, 17 + i] + middle * table[p, 23 + i]) * force_2
