"""Irregular seas as a sum of linear components.

    eta(t, x, y) = sum_n a_n cos(omega_n t - k_n (x cos beta_n + y sin beta_n) + phase_n)            (1)
    a_n = sqrt(2 int_bin S(f) df)                                                                    (2)

The band is cut into bins of equal width. In each the frequency is uniformly random, so that the record does not
repeat, and so is the phase; the amplitude carries the energy of the whole bin, so that every realization has the
variance that the spectrum has in the band.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.arma import random_generator
from tlpsim.loads.waves.airy import STANDARD_GRAVITY, require_positive, travel, wavenumber
from tlpsim.loads.waves.spectra import spectrum_by_name

FloatArray = NDArray[np.float64]

WAVE_STREAM = 2
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


def wave_components(
    *,
    spectrum: str = "jonswap",
    significant_height: float,
    peak_period: float,
    peak_enhancement: float = 3.3,
    heading: float,
    water_depth: float,
    lowest_frequency: float = 0.02,
    highest_frequency: float = 0.25,
    count: int = 300,
    seed: int = 0,
    gravity: float = STANDARD_GRAVITY,
) -> WaveComponents:
    """Long-crested irregular sea with a given spectrum, eq. (2).

    Parameters
    ----------
    spectrum
        Name in `tlpsim.loads.waves.spectra.SPECTRA`.
    significant_height, peak_period, peak_enhancement
        Parameters of the spectrum, m, s and -.
    heading
        Direction of propagation, rad.
    water_depth
        In m; may be infinite.
    lowest_frequency, highest_frequency
        Band in Hz; it must hold the peak.
    count
        Number N of components.
    seed
        Whole number that names the realization.
    gravity
        In m/s².

    Raises
    ------
    ScenarioError
        If a parameter is out of range, the spectrum is not known, or its peak lies outside the band.
    """
    density = spectrum_by_name(spectrum)
    require_positive("peak period of the waves", peak_period, "s")
    require_positive("lowest wave frequency", lowest_frequency, "Hz")
    require_positive("highest wave frequency", highest_frequency, "Hz")
    if not lowest_frequency < 1.0 / peak_period < highest_frequency:
        raise ScenarioError(
            f"wave frequency range {lowest_frequency} to {highest_frequency} Hz does not cover the spectral peak at "
            f"{1.0 / peak_period:.4g} Hz (peak period {peak_period} s); widen it"
        )
    if count < 1:
        raise ScenarioError(f"number of wave components is {count}; it must be at least 1")
    if not np.isfinite(heading):
        raise ScenarioError(f"wave heading is {heading} rad; it must be finite")
    width = (highest_frequency - lowest_frequency) / count
    edges = lowest_frequency + width * np.arange(count)
    nodes, weights = np.polynomial.legendre.leggauss(_BIN_QUADRATURE_POINTS)
    inside = edges[:, None] + 0.5 * width * (nodes + 1.0)
    values = density(inside, significant_height, peak_period, peak_enhancement)
    energy = 0.5 * width * np.sum(values * weights, axis=1)
    generator = random_generator(seed, WAVE_STREAM)
    frequency = edges + width * generator.random(count)
    phase = 2.0 * np.pi * generator.random(count)
    return WaveComponents(
        frequency=frequency,
        amplitude=np.sqrt(2.0 * energy),
        phase=phase,
        wavenumber=wavenumber(2.0 * np.pi * frequency, water_depth, gravity),
        heading=np.full(count, heading),
        water_depth=water_depth,
        gravity=gravity,
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
