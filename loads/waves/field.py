"""Irregular seas as a sum of linear components.

    eta(t, x, y) = sum_n a_n cos(omega_n t - k_n (x cos beta_n + y sin beta_n) + phase_n)            (1)
    a_n = sqrt(2 int_bin S(f) df)                                                                    (2)

The band is cut into bins of equal width. In each the frequency is uniformly random, so that the record does not
repeat, and so is the phase; the amplitude carries the energy of the whole bin, so that every realization has the
variance that the spectrum has in the band. A short-crested sea has such components in each of its directions. This is
the generator to compare the digital filters with, and the one for regular waves.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.checks import require_positive
from tlpsim.loads.constants import STANDARD_GRAVITY
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.random_numbers import random_generator
from tlpsim.loads.waves.airy import travel, wavenumber
from tlpsim.loads.waves.sea import SeaState, wave_stream

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_BIN_QUADRATURE_POINTS = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class WaveComponents:
    """Components of eq. (1); arrays of shape (N,), N = 0 is calm water.

    Parameters
    ----------
    frequency
        In Hz.
    amplitude
        In m.
    phase
        In rad.
    wavenumber
        In rad/m.
    heading
        Direction of propagation, rad.
    water_depth
        In m; may be infinite.
    gravity
        In m/s².
    """

    frequency: FloatArray
    amplitude: FloatArray
    phase: FloatArray
    wavenumber: FloatArray
    heading: FloatArray
    water_depth: float
    gravity: float

    def __post_init__(self) -> None:
        for name in ("frequency", "amplitude", "phase", "wavenumber", "heading"):
            value = np.array(getattr(self, name), dtype=np.float64)
            if value.ndim != 1 or len(value) != len(self.frequency) or not np.all(np.isfinite(value)):
                raise ScenarioError(
                    f"wave components: {name} has shape {value.shape}; it must be finite, of shape "
                    f"({len(self.frequency)},)"
                )
            value.flags.writeable = False
            object.__setattr__(self, name, value)

    @property
    def angular_frequency(self) -> FloatArray:
        """Shape (N,), rad/s."""
        return 2.0 * np.pi * self.frequency

    def amplitudes(self, time: float) -> ComplexArray:
        """Complex amplitudes a exp(i (omega t + phase)) at `time` (s), shape (N,), m."""
        return np.asarray(self.amplitude * np.exp(1j * (self.angular_frequency * time + self.phase)))


def wave_components(state: SeaState, *, count: int = 300, seed: int = 0) -> WaveComponents:
    """Irregular sea of given statistics, eq. (2).

    Parameters
    ----------
    state
        Spectrum, band, directions and water.
    count
        Number of components of each direction.
    seed
        Whole number that names the realization.

    Raises
    ------
    ScenarioError
        If a parameter is out of range.
    """
    if count < 1:
        raise ScenarioError(f"number of wave components is {count}; it must be at least 1")
    width = (state.highest_frequency - state.lowest_frequency) / count
    edges = state.lowest_frequency + width * np.arange(count)
    nodes, weights = np.polynomial.legendre.leggauss(_BIN_QUADRATURE_POINTS)
    inside = edges[:, None] + 0.5 * width * (nodes + 1.0)
    energy = 0.5 * width * np.sum(state.density(inside) * weights, axis=1)
    parts = state.spread()
    draws = [random_generator(seed, wave_stream(j)).random((2, count)) for j in range(len(parts.share))]
    frequency = np.concatenate([edges + width * draw[0] for draw in draws])
    return WaveComponents(
        frequency=frequency,
        amplitude=np.sqrt(2.0 * np.outer(parts.share, energy)).ravel(),
        phase=np.concatenate([2.0 * np.pi * draw[1] for draw in draws]),
        wavenumber=wavenumber(2.0 * np.pi * frequency, state.water_depth, state.gravity),
        heading=np.repeat(parts.heading, count),
        water_depth=state.water_depth,
        gravity=state.gravity,
    )


def regular_wave(
    *,
    amplitude: float,
    period: float,
    heading: float,
    water_depth: float,
    phase: float = 0.0,
    gravity: float = STANDARD_GRAVITY,
) -> WaveComponents:
    """One component: amplitude in m, period in s, heading and phase in rad, depth in m.

    Raises
    ------
    ScenarioError
        If a parameter is out of range.
    """
    require_positive("wave period", period, "s")
    if not amplitude >= 0.0:
        raise ScenarioError(f"wave amplitude is {amplitude} m; it must be finite and >= 0")
    return WaveComponents(
        frequency=np.array([1.0 / period]),
        amplitude=np.array([amplitude]),
        phase=np.array([phase]),
        wavenumber=wavenumber(np.array([2.0 * np.pi / period]), water_depth, gravity),
        heading=np.array([heading]),
        water_depth=water_depth,
        gravity=gravity,
    )


def calm_water(*, water_depth: float, gravity: float = STANDARD_GRAVITY) -> WaveComponents:
    """No components: current alone."""
    none = np.zeros(0)
    return WaveComponents(
        frequency=none,
        amplitude=none,
        phase=none,
        wavenumber=none,
        heading=none,
        water_depth=water_depth,
        gravity=gravity,
    )


def elevation(components: WaveComponents, time: ArrayLike, x: float, y: float) -> FloatArray:
    """Elevation in m at (x, y) in m at times of any shape in s, eq. (1)."""
    times = np.asarray(time, dtype=np.float64)
    place = travel(components.wavenumber, components.heading, np.array([x]), np.array([y]))[0]
    amplitude = components.amplitude * np.exp(1j * components.phase) * place
    phasor = np.exp(1j * np.multiply.outer(times, components.angular_frequency))
    return np.asarray(np.real(phasor @ amplitude))
