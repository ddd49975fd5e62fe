"""What the frequency domain is asked about: the parts of a coupled model, by their statistics instead of a realization.

Each record stands beside the one that makes time series of the same thing: `SpectralWaves` beside
`tlpsim.loads.hydro.excitation.WaveLoads`, `SpectralWind` beside `tlpsim.loads.wind.force.WindLoads`, `SpectralModel`
beside `tlpsim.loads.simulation.CoupledModel`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.constants import SEA_WATER_DENSITY
from tlpsim.loads.hydro.drift import Kernel
from tlpsim.loads.hydro.morison import DEFAULT_STRIP_LENGTH, Members
from tlpsim.loads.platform.motion import PlatformModel
from tlpsim.loads.waves.current import Current
from tlpsim.loads.waves.sea import Sea, SeaState
from tlpsim.loads.wind.segments import Segments

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, slots=True, kw_only=True)
class SpectralWaves:
    """Waves and current on a hull.

    Attributes
    ----------
    state
        The sea; a height of zero is calm water.
    members
        The hull's members, for drag.
    water_density, strip_length
        In kg/m³ and m.
    current
        None for none.
    excitation
        First-order force a unit amplitude of the components of a sea, (6, N), as
        `tlpsim.loads.hydro.diffraction.excitation` gives it; Morison's inertia force where None.
    drift
        Difference-frequency force of pairs of waves, from `tlpsim.loads.hydro.drift`; None for none.
    drift_damping
        Of the slow motion, (6, 6) N·s/m, N·s, N·m·s; None for none.
    splash, stretching
        Drag up to the surface, and how velocities reach it, a key of `tlpsim.loads.waves.stretching.STRETCHING`.
    displaced_position
        The waves act at the place to which the platform has moved.
    doppler
        The waves ride on the current.
    sharp_band
        Whether the waves begin and end at the band's frequencies, as the sum of harmonics does, rather than fade out.
    """

    state: SeaState
    members: Members
    water_density: float = SEA_WATER_DENSITY
    strip_length: float = DEFAULT_STRIP_LENGTH
    current: Current | None = None
    excitation: Callable[[Sea], ComplexArray] | None = None
    drift: Kernel | None = None
    drift_damping: FloatArray | None = None
    splash: bool = True
    stretching: str = "vertical"
    displaced_position: bool = True
    doppler: bool = False
    sharp_band: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class SpectralWind:
    """Wind on the segments of a platform.

    Attributes
    ----------
    segments
        The areas, n of them.
    speed
        Mean speed at them, (n,) m/s.
    spectrum
        Cross-spectra of the speeds that act on them at frequencies (nf,) in Hz, (nf, n, n) m²/s² per Hz.
    heading
        Direction toward which the wind blows, rad.
    air_density
        In kg/m³.
    decomposition
        A key of `tlpsim.loads.wind.force.DECOMPOSITIONS`.
    highest_frequency
        Above which there are no gusts, Hz.
    """

    segments: Segments
    speed: FloatArray
    spectrum: Callable[[FloatArray], ComplexArray]
    heading: float
    air_density: float
    decomposition: str
    highest_frequency: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SpectralModel:
    """A platform and what acts on it; None for no wind, or no waves and current.

    Attributes
    ----------
    platform
        The platform, with the tendons that are left.
    wind, waves
        What acts on it.
    external
        Constant load, (6,) N, N·m, earth-fixed, about the reference point.
    points
        Fixed in the platform, whose motion is asked for, from the reference point, (n, 3) m.
    tendons
        Numbers of the tendons that are left, from 1, (t,); all of them by default.
    step
        Of the platform's integration in time, s: the fluid's memory is the same filter in both domains.
    """

    platform: PlatformModel
    wind: SpectralWind | None = None
    waves: SpectralWaves | None = None
    external: FloatArray = dataclasses.field(default_factory=lambda: np.zeros(6))
    points: FloatArray = dataclasses.field(default_factory=lambda: np.zeros((0, 3)))
    tendons: NDArray[np.int64] | None = None
    step: float = 0.1
