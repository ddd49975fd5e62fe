"""Wave and current forces on a moving platform as a function of time.

    [eta; F; u] = Re{sum_n H_n exp(-i k_n (X cos beta_n + Y sin beta_n)) a_n(t)}                     (1)
    F_drag = sum_s [e; r x e] 0.5 rho C_D w l |u_r| u_r,   u_r = u + U_current - v                   (2)

a_n are the amplitudes of any linear sea (`tlpsim.loads.waves.sea`): of harmonic components, or those by which an
elevation from a digital filter is convolved with the kernels of all rows of H. (X, Y) is the horizontal position of
the platform, or the origin: taking the waves at the displaced position is exact for translation, since a shift of a
linear wave is a change of its phase. Turning and heave of the strips are neglected. F is any first-order force given
by its transfer function, Morison's inertia force unless another one is given. All rows of eq. (1) are one real matrix,
so that a call is one matrix-vector product and one pass over the strips, in a compiled loop whose order of summation
is fixed: a run repeats bit for bit whatever the linear algebra library. Drag acts up to mean water level. The current
is uniform over the depth and does not change the waves.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tlpsim.loads.constants import SEA_WATER_DENSITY
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.hydro.morison import (
    DEFAULT_STRIP_LENGTH,
    Members,
    Strips,
    divide,
    drag_force,
    inertia_transfer,
    strip_velocity_transfer,
)
from tlpsim.loads.waves.sea import Sea

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_FORCE_ROWS = 7  # elevation and six first-order forces come before the water velocities


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
    """

    diffraction: FloatArray
    viscous: FloatArray
    elevation: float


def _current_velocity(speed: float, heading: float) -> FloatArray:
    if not (np.isfinite(speed) and speed >= 0.0):
        raise ScenarioError(
            f"current speed is {speed} m/s; it must be finite and >= 0, the heading gives the direction"
        )
    if not np.isfinite(heading):
        raise ScenarioError(f"current heading is {heading} rad; it must be finite")
    return np.array([speed * np.cos(heading), speed * np.sin(heading), 0.0])


def mean_current_force(
    members: Members,
    *,
    current_speed: float,
    current_heading: float,
    water_density: float = SEA_WATER_DENSITY,
    strip_length: float = DEFAULT_STRIP_LENGTH,
) -> FloatArray:
    """Drag of the current on a platform at rest in calm water, eq. (2), shape (6,), N and N·m.

    Raises
    ------
    ScenarioError
        If a parameter is out of range.
    """
    strips = divide(members, strip_length, water_density)
    return drag_force(strips, strips.direction @ _current_velocity(current_speed, current_heading))


@njit(cache=True)
def _wave_forces(
    amplitudes: ComplexArray,
    x: float,
    y: float,
    velocity: FloatArray,
    wavenumbers: FloatArray,
    matrix: FloatArray,
    strips: FloatArray,
    response: FloatArray,
) -> FloatArray:
    """Eq. (1) and (2): elevation, first-order force (6) and drag force (6), shape (13,).

    `wavenumbers` holds k cos beta and k sin beta as rows; `matrix` the real and the negative imaginary part of H as
    columns of 2N rows; `strips` the projection (6), the current and the drag factor of each transverse axis;
    `response` is room for the rows of eq. (1).
    """
    rows = matrix.shape[1]
    response[:] = 0.0
    for n in range(len(amplitudes)):
        angle = wavenumbers[0, n] * x + wavenumbers[1, n] * y
        cosine, sine = math.cos(angle), math.sin(angle)
        real = amplitudes[n].real * cosine + amplitudes[n].imag * sine
        imaginary = amplitudes[n].imag * cosine - amplitudes[n].real * sine
        for row in range(rows):
            response[row] += matrix[2 * n, row] * real + matrix[2 * n + 1, row] * imaginary
    result = np.zeros(13)
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
    return result


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
        In m/s, and the direction toward which it flows, rad.
    displaced_position
        Take the waves at the platform's horizontal position rather than at the origin.
    excitation
        First-order force and moment about the reference point at the origin for each component of a sea, shape
        (6, N), N/m and N·m/m; the members' inertia force where it is not given.

    Raises
    ------
    ScenarioError
        If a parameter is out of range, or a member reaches below the sea bed.
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
    ) -> None:
        self.sea = sea
        self.strips: Strips = divide(members, strip_length, water_density)
        self.excitation_transfer: ComplexArray = (
            inertia_transfer(members, sea, water_density) if excitation is None else excitation(sea)
        )
        # A factor on the position rather than a branch in the kernel.
        self._position_factor = 1.0 if displaced_position else 0.0
        self._wavenumbers = np.vstack([sea.wavenumber * np.cos(sea.heading), sea.wavenumber * np.sin(sea.heading)])
        water = strip_velocity_transfer(self.strips, sea)
        rows = np.vstack([np.ones((1, len(sea.wavenumber))), self.excitation_transfer, water])
        self._matrix = np.empty((2 * len(sea.wavenumber), len(rows)))
        self._matrix[0::2] = rows.real.T
        self._matrix[1::2] = -rows.imag.T
        self._response = np.zeros(len(rows))
        current = self.strips.direction @ _current_velocity(current_speed, current_heading)
        self._strips = np.column_stack([self.strips.projection, current, self.strips.drag])

    def evaluate(self, time: float, position: FloatArray, velocity: FloatArray) -> WaveForces:
        """Forces at `time`.

        Parameters
        ----------
        time
            In s.
        position, velocity
            Surge, sway, heave, roll, pitch, yaw and their rates, shape (6,), contiguous, m, rad and per second.
        """
        result = _wave_forces(
            self.sea.amplitudes(time),
            self._position_factor * position[0],
            self._position_factor * position[1],
            velocity,
            self._wavenumbers,
            self._matrix,
            self._strips,
            self._response,
        )
        return WaveForces(diffraction=result[1:_FORCE_ROWS], viscous=result[_FORCE_ROWS:], elevation=float(result[0]))
