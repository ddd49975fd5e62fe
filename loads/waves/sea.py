"""What a sea is, whatever generates it: its statistics, and its linear components.

    q(t) = Re{sum_n H(f_n, beta_n) a_n(t)}                                                           (1)

is any quantity q that is linear in the waves, H its transfer function from the elevation at the origin, and a_n(t)
the complex amplitudes of the sea, which go as exp(+i omega_n t). For a sum of harmonic components eq. (1) is the sum
itself (`tlpsim.loads.waves.field`); for an elevation made by a digital filter it is the discrete convolution of the
elevation with the kernel of H, in a factored form (`tlpsim.loads.waves.elevation`). Everything that takes a `Sea`
works with both. Elsewhere than at the origin, H holds the factor exp(-ik(x cos beta + y sin beta)).
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.checks import require_positive
from tlpsim.loads.constants import STANDARD_GRAVITY
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.waves.spectra import SpectrumTable, spectrum_by_name
from tlpsim.loads.waves.spreading import Directions, spread_directions

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

WAVE_STREAM = 2
_STREAM_STRIDE = 2**16  # leaves the small numbers to the other processes of a run


def wave_stream(direction: int) -> int:
    """Number of the random stream of a direction's elevation."""
    return WAVE_STREAM + _STREAM_STRIDE * direction


class Sea(Protocol):
    """Components of eq. (1), all arrays of shape (N,)."""

    @property
    def angular_frequency(self) -> FloatArray:
        """In rad/s."""

    @property
    def wavenumber(self) -> FloatArray:
        """In rad/m."""

    @property
    def heading(self) -> FloatArray:
        """Directions of propagation, rad."""

    @property
    def water_depth(self) -> float:
        """In m; may be infinite."""

    @property
    def gravity(self) -> float:
        """In m/s²."""

    def amplitudes(self, time: float) -> ComplexArray:
        """Complex amplitudes a_n at `time` (s), m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SeaState:
    """Statistics of a sea.

    Parameters
    ----------
    spectrum
        Name in `tlpsim.loads.waves.spectra.SPECTRA`.
    significant_height, peak_period, peak_enhancement
        Parameters of the spectrum, m, s and -.
    table
        Takes the place of the spectrum and its parameters.
    heading
        Mean direction of propagation, rad.
    directions, spreading_exponent
        Number of long-crested seas, and s of the cos-2s spreading, see `tlpsim.loads.waves.spreading`.
    water_depth
        In m; may be infinite.
    lowest_frequency, highest_frequency
        Band in Hz; it must hold the peak.
    gravity
        In m/s².

    Raises
    ------
    ScenarioError
        If a parameter is out of range, the spectrum is not known, or its peak lies outside the band.
    """

    spectrum: str = "jonswap"
    significant_height: float = 0.0
    peak_period: float = 10.0
    peak_enhancement: float = 3.3
    table: SpectrumTable | None = None
    heading: float = 0.0
    directions: int = 1
    spreading_exponent: float = 10.0
    water_depth: float
    lowest_frequency: float = 0.02
    highest_frequency: float = 0.35
    gravity: float = STANDARD_GRAVITY

    def __post_init__(self) -> None:
        require_positive("peak period of the waves", self.peak_period, "s")
        require_positive("lowest wave frequency", self.lowest_frequency, "Hz")
        require_positive("highest wave frequency", self.highest_frequency, "Hz")
        self.density(np.array([1.0 / self.peak_period]))
        self.spread()
        peak = self.peak_frequency
        if not self.lowest_frequency < peak < self.highest_frequency:
            raise ScenarioError(
                f"wave frequency range {self.lowest_frequency} to {self.highest_frequency} Hz does not cover the "
                f"spectral peak at {peak:.4g} Hz (peak period {1.0 / peak:.4g} s); widen it"
            )

    @property
    def peak_frequency(self) -> float:
        """Frequency of the spectrum's (primary) peak, Hz."""
        return self.table.peak_frequency if self.table is not None else 1.0 / self.peak_period

    def density(self, frequency: FloatArray) -> FloatArray:
        """One-sided spectrum of the elevation at `frequency` (Hz), m²/Hz."""
        if self.table is not None:
            return self.table(frequency)
        shape = spectrum_by_name(self.spectrum)
        return shape(frequency, self.significant_height, self.peak_period, self.peak_enhancement)

    def spread(self) -> Directions:
        """The long-crested seas that the sea is made of."""
        return spread_directions(self.heading, self.spreading_exponent, self.directions)
