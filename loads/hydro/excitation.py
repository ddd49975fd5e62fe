"""Wave and current forces on a moving platform as a function of time.

    [eta; F; u] = Re{sum_n H_n exp(-i k_n (X cos beta_n + Y sin beta_n)) a_n(t)}                     (1)
    F_drag = sum_s [e; r x e] 0.5 rho C_D w l |u_r| u_r,   u_r = u + U_current - v                   (2)
    F_drift = F_0 + sum_r W_r |z_r|²,   z_r = sum_n G_rn exp(-i k_n (X cos beta_n + Y sin beta_n)) a_n(t)  (3)
    F_damping = -B (v - U)                                                                           (4)

a_n are the amplitudes of any linear sea (`tlpsim.loads.waves.sea`): of harmonic components, or those by which an
elevation from a digital filter is convolved with the kernels of all rows of H. (X, Y) is the horizontal position of
the platform, or the origin: taking the waves at the displaced position is exact for translation, since a shift of a
linear wave is a change of its phase, and a platform that moves slowly through the waves meets them at the frequency of
encounter. Turning of the strips is neglected. F is any first-order force given by its transfer function, Morison's
inertia force unless another one is given. All rows of eq. (1), and of eq. (3) as z_r and its quadrature, are one real
matrix (`tlpsim.loads.hydro.linear_rows`), so that a call is one product with it and one pass over the strips.

Drag acts up to mean water level, at the middle of fixed strips; or up to the instantaneous surface, with stretched
kinematics and the platform's heave, roll and pitch in the water line (`tlpsim.loads.hydro.splash`). The current changes
the waves only where that is asked for (`tlpsim.loads.waves.doppler`).

B of eq. (4) is wave drift damping, the mean for the sea (`tlpsim.loads.hydro.drift.wave_drift_damping`): the drift of
eq. (3) is that of a hull without speed. It acts on the whole velocity v. Of the motion at wave frequencies it takes
what is small beside inertia, so no filter tells the slow part. U is the current at the surface where the waves ride on
it, and zero elsewhere.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tlpsim.loads.constants import SEA_WATER_DENSITY
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.hydro.linear_rows import evaluate_rows, linear_rows
from tlpsim.loads.hydro.morison import (
    DEFAULT_STRIP_LENGTH,
    Members,
    Strips,
    divide,
    drag_force,
    inertia_transfer,
    strip_velocity_transfer,
)
from tlpsim.loads.hydro.splash import DEFAULT_LARGEST_ELEVATION, SplashZone, splash_drag, splash_zone
from tlpsim.loads.waves.current import Current, current_velocity, uniform_current
from tlpsim.loads.waves.doppler import sea_in_current
from tlpsim.loads.waves.sea import Sea

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

PARTS = {"diffraction": slice(1, 7), "viscous": slice(7, 13), "drift": slice(13, 19), "drift_damping": slice(19, 25)}
"""Where the kernel puts each part of the force; the elevation comes first."""
ROWS = 25
"""Length of what the kernel gives."""
_FORCE_ROWS = 7  # elevation and six first-order forces come before the other rows


class QuadraticFilters(Protocol):
    """What eq. (3) needs, such as `tlpsim.loads.hydro.quadratic_filters.DriftFilters`; about the reference point."""

    @property
    def transfer(self) -> ComplexArray:
        """G of the components of the sea, platform at the origin, shape (R, N)."""

    @property
    def weight(self) -> FloatArray:
        """W, shape (6, R)."""

    @property
    def constant(self) -> FloatArray:
        """F_0, shape (6,), N and N·m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WaveForces:
    """Forces of one instant.

    Parameters
    ----------
    diffraction
        First-order force and moment about the reference point, shape (6,), N and N·m.
    viscous
        Drag force and moment, shape (6,), N and N·m.
    elevation
        Of the undisturbed water at the point that the phases refer to, m.
    drift
        Second-order force and moment, eq. (3), shape (6,), N and N·m; zero where no filters are given.
    drift_damping
        Force and moment of eq. (4), shape (6,), N and N·m; zero where no matrix is given.
    """

    diffraction: FloatArray
    viscous: FloatArray
    elevation: float
    drift: FloatArray
    drift_damping: FloatArray

    @property
    def total(self) -> FloatArray:
        """Sum of the parts, shape (6,), N and N·m."""
        return self.diffraction + self.viscous + self.drift + self.drift_damping


def _current_velocity(speed: float, heading: float) -> FloatArray:
    if not (np.isfinite(speed) and speed >= 0.0):
        raise ScenarioError(
            f"current speed is {speed} m/s; it must be finite and >= 0, the heading gives the direction"
        )
    if not np.isfinite(heading):
        raise ScenarioError(f"current heading is {heading} rad; it must be finite")
    return np.array([speed * np.cos(heading), speed * np.sin(heading), 0.0])


def _current_on_strips(strips: Strips, speed: float, heading: float, current: Current | None) -> FloatArray:
    """Current along the transverse axes of the strips, shape (2s,), m/s."""
    uniform = _current_velocity(speed, heading)
    if current is None:
        return np.asarray(strips.direction @ uniform)
    if speed != 0.0:
        raise ScenarioError(f"current speed is {speed} m/s beside a current profile; give one of them")
    velocity = np.repeat(current_velocity(current, strips.position[:, 2]), 2, axis=0)
    return np.asarray(np.sum(strips.direction * velocity, axis=1))


def mean_current_force(
    members: Members,
    *,
    current_speed: float = 0.0,
    current_heading: float = 0.0,
    current: Current | None = None,
    water_density: float = SEA_WATER_DENSITY,
    strip_length: float = DEFAULT_STRIP_LENGTH,
) -> FloatArray:
    """Drag of the current on a platform at rest in calm water, eq. (2), shape (6,), N and N·m.

    Parameters
    ----------
    members
        The hull.
    current_speed, current_heading
        Of a uniform current, in m/s, and the direction toward which it flows, rad.
    current
        A profile that takes their place.
    water_density, strip_length
        In kg/m³ and m.

    Raises
    ------
    ScenarioError
        If a parameter is out of range, or both kinds of current are given.
    """
    strips = divide(members, strip_length, water_density)
    return drag_force(strips, _current_on_strips(strips, current_speed, current_heading, current))


@njit(cache=True)
def _wave_forces(  # type: ignore[no-untyped-def]
    amplitudes, x, y, velocity, rows, strips, weight, damping, result
):
    """Eq. (1) to (4): elevation, and the forces of `PARTS`, into `result` (25,).

    `strips` holds the projection (6), the current and the drag factor of each transverse axis; `weight` W of eq. (3)
    and F_0 as its last row, shape (R + 1, 6) or none; the rows of z follow those of the strips; `damping` the negative
    B of eq. (4) by columns, and B U, shape (7, 6); `rows` is `LinearRows.arrays`.
    """
    evaluate_rows(amplitudes, x, y, *rows)
    response = rows[-1]
    result[:] = 0.0
    for row in range(7):
        result[row] = response[row]
    for s in range(strips.shape[0] // 2):
        first, second = 2 * s, 2 * s + 1
        relative_1 = response[7 + first] + strips[first, 6]
        relative_2 = response[7 + second] + strips[second, 6]
        for dof in range(6):
            relative_1 -= strips[first, dof] * velocity[dof]
            relative_2 -= strips[second, dof] * velocity[dof]
        speed = math.sqrt(relative_1 * relative_1 + relative_2 * relative_2)
        force_1 = strips[first, 7] * speed * relative_1
        force_2 = strips[second, 7] * speed * relative_2
        for dof in range(6):
            result[7 + dof] += strips[first, dof] * force_1 + strips[second, dof] * force_2
    offset, terms = 7 + strips.shape[0], weight.shape[0] - 1
    if terms >= 0:
        result[13:19] = weight[terms]
    for r in range(terms):
        in_phase, quadrature = response[offset + 2 * r], response[offset + 2 * r + 1]
        square = in_phase * in_phase + quadrature * quadrature
        for dof in range(6):
            result[13 + dof] += weight[r, dof] * square
    result[19:25] = damping[6]
    for column in range(6):
        for dof in range(6):
            result[19 + dof] += damping[column, dof] * velocity[column]


def _quadratic_rows(drift: QuadraticFilters | None, count: int) -> tuple[ComplexArray, FloatArray]:
    """Rows of z_r and of its quadrature in turn, shape (2R, N), and weights with F_0 last, shape (R + 1, 6) or none."""
    if drift is None:
        return np.zeros((0, count), dtype=np.complex128), np.zeros((0, 6))
    transfer, weight, constant = (np.asarray(each) for each in (drift.transfer, drift.weight, drift.constant))
    shapes = transfer.shape, weight.shape, constant.shape
    if transfer.ndim != 2 or shapes != ((len(transfer), count), (6, len(transfer)), (6,)):
        raise ScenarioError(
            f"drift filters have a transfer, weight and constant of shapes {shapes}; the sea has {count} components, "
            f"so they must be (R, {count}), (6, R) and (6,)"
        )
    if not all(np.all(np.isfinite(each)) for each in (transfer, weight, constant)):
        raise ScenarioError("drift filters hold a value that is not finite; check the database they are made from")
    rows = np.empty((2 * len(transfer), count), dtype=np.complex128)
    rows[0::2], rows[1::2] = transfer, -1j * transfer
    return rows, np.vstack([weight.T, constant])


def _damping_rows(damping: FloatArray | None, current: FloatArray) -> FloatArray:
    """Of eq. (4): columns of -B, and B U for a current U (3,), shape (7, 6)."""
    matrix = np.zeros((6, 6)) if damping is None else np.asarray(damping, dtype=np.float64)
    if matrix.shape != (6, 6) or not np.all(np.isfinite(matrix)):
        raise ScenarioError(
            f"wave drift damping has shape {matrix.shape} or holds a value that is not finite; give a matrix (6, 6), "
            "such as that of wave_drift_damping"
        )
    return np.vstack([-matrix.T, matrix[:, :3] @ current])


class WaveLoads:
    """Wave and current forces as a function of time, position and velocity.

    Parameters
    ----------
    sea
        The sea; `calm_water` for current alone.
    members
        The hull.
    water_density
        In kg/m³.
    strip_length
        Greatest length of a strip for drag, m.
    current_speed, current_heading
        Of a uniform current, in m/s, and the direction toward which it flows, rad.
    displaced_position
        Take the waves at the platform's horizontal position rather than at the origin.
    excitation
        First-order force and moment about the reference point at the origin for each component of a sea, shape
        (6, N), N/m and N·m/m; the members' inertia force where it is not given.
    current
        A profile of the current that takes the place of the uniform one.
    splash
        Drag up to the instantaneous surface rather than to mean water level.
    stretching
        With `splash`: name in `tlpsim.loads.waves.stretching.STRETCHING`.
    largest_elevation
        With `splash`: the largest that counts, m, such as `tlpsim.loads.hydro.splash.largest_elevation` of the sea.
    doppler
        The waves ride on the current: their wavenumbers, and the frequency with which they act, are those in it.
    drift
        Quadratic filters of the drift force for the components of `sea`; with `doppler`, made for the sea that
        `tlpsim.loads.waves.doppler.sea_in_current` gives. With `displaced_position`, of the drift without what that
        makes (`tlpsim.loads.hydro.displaced_drift`), or the drift of a hull that moves in the waves counts it twice.
    drift_damping
        B of eq. (4), shape (6, 6), N·s/m, N·s and N·m·s.

    Raises
    ------
    ScenarioError
        If a parameter is out of range, a member reaches below the sea bed, or the current stops a wave.
    """

    def __init__(
        self,
        *,
        sea: Sea,
        members: Members,
        water_density: float = SEA_WATER_DENSITY,
        strip_length: float = DEFAULT_STRIP_LENGTH,
        current_speed: float = 0.0,
        current_heading: float = 0.0,
        displaced_position: bool = True,
        excitation: Callable[[Sea], ComplexArray] | None = None,
        current: Current | None = None,
        splash: bool = False,
        stretching: str = "wheeler",
        largest_elevation: float = DEFAULT_LARGEST_ELEVATION,
        doppler: bool = False,
        drift: QuadraticFilters | None = None,
        drift_damping: FloatArray | None = None,
    ) -> None:
        self.sea = sea
        self.strips: Strips = divide(members, strip_length, water_density)
        on_strips = _current_on_strips(self.strips, current_speed, current_heading, current)
        profile = uniform_current(current_speed, current_heading) if current is None else current
        waves: Sea = sea_in_current(sea, profile) if doppler else sea
        self.excitation_transfer: ComplexArray = (
            inertia_transfer(members, waves, water_density) if excitation is None else excitation(waves)
        )
        # A factor on the position rather than a branch in the kernel.
        self._position_factor = 1.0 if displaced_position else 0.0
        quadratic, self._weight = _quadratic_rows(drift, len(waves.wavenumber))
        flow = current_velocity(profile, np.zeros(1))[0] if doppler else np.zeros(3)
        self._damping = _damping_rows(drift_damping, flow)
        first = [np.ones((1, len(waves.wavenumber))), self.excitation_transfer]
        self._splash: SplashZone | None = None
        if splash:
            self._splash = splash_zone(
                members,
                waves,
                stretching=stretching,
                elevation=largest_elevation,
                current=profile,
                strip_length=strip_length,
                water_density=water_density,
                first_row=_FORCE_ROWS + len(quadratic),
            )
            self._strips = np.zeros((0, 8))
            rows = np.vstack([*first, quadratic, self._splash.transfer])
        else:
            self._strips = np.column_stack([self.strips.projection, on_strips, self.strips.drag])
            rows = np.vstack([*first, strip_velocity_transfer(self.strips, waves), quadratic])
        self._rows = linear_rows(rows, waves)

    def evaluate(self, time: float, position: FloatArray, velocity: FloatArray) -> WaveForces:
        """Forces at `time`.

        Parameters
        ----------
        time
            In s.
        position, velocity
            Surge, sway, heave, roll, pitch, yaw and their rates, shape (6,), contiguous, m, rad and per second.
        """
        result = np.empty(ROWS)
        _wave_forces(
            self.sea.amplitudes(time),
            self._position_factor * position[0],
            self._position_factor * position[1],
            velocity,
            self._rows.arrays,
            self._strips,
            self._weight,
            self._damping,
            result,
        )
        zone = self._splash
        if zone is not None:
            viscous = result[PARTS["viscous"]]
            response = self._rows.response
            splash_drag(response, position, velocity, zone.rows, zone.table, zone.current, zone.rule, viscous)
        return WaveForces(elevation=float(result[0]), **{name: result[part] for name, part in PARTS.items()})
