"""Velocity and acceleration of the water anywhere, up to the surface, in any linear sea.

    u(t) = Re{sum_n H_u(z', x, y) a_n(t)}                                       convolution model    (1)
    du/dt = Re{sum_n i omega_n H_u a_n(t)}                                      convolution model    (2)
    du/dt = (1/dt) sum_k c_k (u(t + k dt) - u(t - k dt))                        differentiation     (3)

with z' the stretched level at time t (`tlpsim.loads.waves.stretching`), kept while a difference is taken. Of the
models of Li and Kareem (1990), "differentiation" is eq. (3) over the samples of the process, with the sixth-order
difference that their long step needs (0.04 % at 0.2 Hz and 0.5 s; the plain difference would lose 6.5 %); "hybrid"
interpolates the samples of the velocity to a step five times finer and takes the difference there
(`tlpsim.loads.filters.hybrid`).
"""

import difflib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.checks import require_positive
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.differentiation import differentiate
from tlpsim.loads.filters.hybrid import interpolate_and_differentiate
from tlpsim.loads.filters.interpolation import SYMMETRIC
from tlpsim.loads.waves.airy import surface_velocity_gradient_transfer, travel, velocity_transfer
from tlpsim.loads.waves.sea import Sea
from tlpsim.loads.waves.stretching import stretched

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


Velocity = Callable[[float], FloatArray]
_ORDER = 6
_INTERPOLATION = SYMMETRIC["quintic"]
_REFINEMENT = 5


def _differentiated(velocity: Velocity, time: float, step: float) -> FloatArray:
    return differentiate(_sampled(velocity, time, step, _ORDER // 2), step, _ORDER)[0]


def _interpolated_and_differentiated(velocity: Velocity, time: float, step: float) -> FloatArray:
    half = max(_INTERPOLATION.before, _INTERPOLATION.after)
    samples = _sampled(velocity, time, step, half)
    _, rate = interpolate_and_differentiate(_INTERPOLATION, samples, step, _REFINEMENT, _ORDER)
    # Row 0 belongs to (before - 1) steps and half the difference after the first sample, `time` to `half` steps.
    return np.asarray(rate[(half - _INTERPOLATION.before + 1) * _REFINEMENT - _ORDER // 2])


def _sampled(velocity: Velocity, time: float, step: float, half: int) -> FloatArray:
    return np.array([velocity(time + k * step) for k in range(-half, half + 1)])


ACCELERATION: dict[str, Callable[[Velocity, float, float], FloatArray] | None] = {
    "convolution": None,
    "differentiation": _differentiated,
    "hybrid": _interpolated_and_differentiated,
}
"""Acceleration from the velocity as a function of time, the time and the sampling step; None is eq. (2)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Kinematics:
    """Water at n points.

    Parameters
    ----------
    elevation
        Of the surface above or below the point, shape (n,), m.
    velocity, acceleration
        Shape (n, 3), m/s and m/s²; zero where dry.
    wet
        Whether there is water at the point, shape (n,).
    """

    elevation: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    wet: NDArray[np.bool_]


def kinematics(
    sea: Sea,
    time: float,
    points: FloatArray,
    *,
    stretching: str = "none",
    acceleration: str = "convolution",
    sampling_step: float = 0.5,
) -> Kinematics:
    """Elevation, velocity and acceleration of the water at `points` (n, 3), m, at `time`, s.

    Parameters
    ----------
    sea
        Any linear sea.
    stretching
        Name in `tlpsim.loads.waves.stretching.STRETCHING`.
    acceleration
        Name in `ACCELERATION`.
    sampling_step
        dt of eq. (3), s; of an `ArmaSea` its own is the natural one.

    Raises
    ------
    ScenarioError
        If a name is not known, or a point lies below the sea bed.
    """
    if acceleration not in ACCELERATION:
        nearest = difflib.get_close_matches(acceleration.lower(), ACCELERATION, n=1, cutoff=0.0)[0]
        known = ", ".join(ACCELERATION)
        raise ScenarioError(f"acceleration {acceleration!r} is not known; did you mean {nearest!r}? Known: {known}")
    require_positive("sampling step of the wave kinematics", sampling_step, "s")
    points = np.asarray(points, dtype=np.float64)
    amplitudes = sea.amplitudes(time)
    place = travel(sea.wavenumber, sea.heading, points[:, 0], points[:, 1])
    elevation = np.real(place @ amplitudes)
    levels = stretched(stretching, points[:, 2], elevation, sea.water_depth)
    transfer = _velocity_transfer(sea, np.column_stack([points[:, :2], levels.level]), levels.excess)
    model = ACCELERATION[acceleration]
    if model is None:
        rate = np.real(transfer @ (1j * sea.angular_frequency * amplitudes))
    else:
        rate = model(lambda t: np.real(transfer @ sea.amplitudes(t)), time, sampling_step)
    wet = levels.wet[:, None]
    return Kinematics(
        elevation=elevation,
        velocity=np.where(wet, np.real(transfer @ amplitudes), 0.0),
        acceleration=np.where(wet, rate, 0.0),
        wet=levels.wet,
    )


def _velocity_transfer(sea: Sea, points: FloatArray, excess: FloatArray) -> ComplexArray:
    arguments = (sea.angular_frequency, sea.wavenumber, sea.heading, sea.water_depth, points)
    transfer = velocity_transfer(*arguments)
    above = excess > 0.0
    if np.any(above):
        surface = points[above]
        gradient = surface_velocity_gradient_transfer(*arguments[:4], surface[:, :2])
        transfer[above] += excess[above, None, None] * gradient
    return transfer
