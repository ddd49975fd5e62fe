"""What the frequency domain gives: statistics of every quantity, spectra, and what each load does.

Spectra are one-sided, on even frequencies from zero; the variance in a band is their integral over it by the
trapezoidal rule.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.spectral.extremes import Extremes, crossing_rate, expected_extremes, zero_crossing_rate
from tlpsim.loads.spectral.fatigue import damage_equivalent_range

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def band_integral(frequency: FloatArray, density: FloatArray, lowest: float = 0.0, highest: float = np.inf) -> float:
    """Integral of a density (n,) over a band (Hz), by the trapezoidal rule with interpolated ends."""
    if lowest <= frequency[0] and highest >= frequency[-1]:
        return float(np.trapezoid(density, frequency))
    ends = np.clip([lowest, highest], frequency[0], frequency[-1])
    inside = frequency[(frequency > ends[0]) & (frequency < ends[1])]
    at = np.unique(np.concatenate([ends, inside]))
    return float(np.trapezoid(np.interp(at, frequency, density), at)) if len(at) > 1 else 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Quantity:
    """Statistics of one quantity of the response.

    Attributes
    ----------
    name
        As the FMUs call it: `position.surge`, `tendon_tension[1]`, `point_acceleration[1].x`.
    unit
        Of the mean.
    mean
        With the part that fluctuations leave.
    frequency, density
        Hz from zero, and the one-sided spectrum, unit²/Hz; shape (n,).
    skewness, excess_kurtosis
        Of the quadratic response; 0 of a Gaussian one.
    """

    name: str
    unit: str
    mean: float
    frequency: FloatArray
    density: FloatArray
    skewness: float = 0.0
    excess_kurtosis: float = 0.0

    def spread(self, lowest: float = 0.0, highest: float = np.inf) -> float:
        """Standard deviation in a band of frequencies (Hz)."""
        return float(np.sqrt(band_integral(self.frequency, self.density, lowest, highest)))

    @property
    def zero_crossing_rate(self) -> float:
        """Rate of up-crossings of the mean, Hz, by the spectrum."""
        return zero_crossing_rate(self.frequency, self.density)

    def crossing_rate(self, level: float) -> float:
        """Rate of up-crossings of a level, Hz, of a Gaussian response of this mean and spectrum."""
        return crossing_rate(self.frequency, self.density, level - self.mean)

    def extremes(self, duration: float, *, probability: float = 0.9) -> Extremes:
        """Extremes in a duration (s), with the skewness and kurtosis; see `expected_extremes`."""
        return expected_extremes(
            self.mean,
            self.frequency,
            self.density,
            self.skewness,
            self.excess_kurtosis,
            duration,
            probability=probability,
        )

    def expected_maximum(self, duration: float) -> float:
        """Expected value of the largest value in a duration (s)."""
        return self.extremes(duration).maximum

    def expected_minimum(self, duration: float) -> float:
        """Expected value of the smallest value in a duration (s)."""
        return self.extremes(duration).minimum

    def damage_equivalent_range(self, slope: float) -> float:
        """Range whose cycles at 1 Hz do the same damage at a slope of the S-N curve, as of a Gaussian response."""
        return damage_equivalent_range(self.frequency, self.density, slope)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mode:
    """A natural mode of the damped platform about its mean position, from the complex eigenvalues.

    Attributes
    ----------
    name
        Degree of freedom that moves most.
    period
        Undamped natural period, s, that of the modulus of the eigenvalue.
    damping_ratio
        Fraction of critical damping.
    """

    name: str
    period: float
    damping_ratio: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpectralResponse:
    """The response of a platform by the frequency domain.

    Attributes
    ----------
    frequency
        Hz from zero, evenly spaced, shape (n,).
    quantities
        By name; the six positions come first.
    cross_spectrum
        Of the six positions, shape (n, 6, 6), S_ij = E[x_i x_j*], one-sided.
    contributions
        Spectra of the six positions under one excitation alone, shape (n, 6), with stiffness and damping those of all
        together: "wind", "waves" (first order), "slow drift", "viscous", "splash", "displaced position", "tethers"
        (second order), "all second order" and "products" (of slow and wave-frequency motion). Second-order ones from
        the same waves are coherent, so that their variances do not add up.
    mean_loads
        Mean loads on the platform by part, shape (6,), N and N·m, earth-fixed.
    mean_position
        Shape (6,), m and rad.
    modes
        One a degree of freedom that moves, slowest first.
    iterations
        Relative change of means and covariances in each outer round.
    seconds
        Wall time by step of the analysis.
    """

    frequency: FloatArray
    quantities: Mapping[str, Quantity]
    cross_spectrum: ComplexArray
    contributions: Mapping[str, FloatArray]
    mean_loads: Mapping[str, FloatArray]
    mean_position: FloatArray
    modes: tuple[Mode, ...]
    iterations: tuple[float, ...]
    seconds: Mapping[str, float]
