"""The waves of a sea on a grid of frequencies, one block of it a direction, and what is linear in them.

    D_q(f) = H_q(f) sqrt(S_eta(f))                                                                       (1)

A long-crested sea is one source: every quantity that is linear in it has a decomposed function of order one. Directions
are independent sources, so a sea of r directions has order r, and the components of the grid are those of all
directions, nf a direction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.spectral.model import SpectralWaves
from tlpsim.loads.waves.airy import wavenumber
from tlpsim.loads.waves.doppler import sea_in_current
from tlpsim.loads.waves.elevation import transition
from tlpsim.loads.waves.sea import Sea, SeaState

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

HIGHEST = 1.1
"""Of the highest frequency of the waves, where they have faded out."""
NEGLIGIBLE = 1e-9
"""Part of the largest density below which the lowest waves are left out."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GridSea:
    """Components of a sea at the frequencies of a grid; a `tlpsim.loads.waves.sea.Sea` without a realization."""

    angular_frequency: FloatArray
    wavenumber: FloatArray
    heading: FloatArray
    water_depth: float
    gravity: float

    def amplitudes(self, time: float) -> ComplexArray:
        """There are none: only statistics of this sea are asked for."""
        raise NotImplementedError(f"a sea of spectra has no amplitudes at {time} s")


@dataclass(frozen=True, slots=True, kw_only=True)
class WaveGrid:
    """A sea on a grid, N = r nf components.

    Attributes
    ----------
    frequency
        Even, whole multiples of the step, (nf,) Hz.
    step
        Hz.
    sea
        The components; in a current that changes the waves their `angular_frequency` is that in the water.
    omega
        With which the components act on the platform, (N,) rad/s.
    root
        sqrt(S_eta) of each component, (N,) m/√Hz.
    """

    frequency: FloatArray
    step: float
    sea: Sea
    omega: FloatArray
    root: FloatArray

    @property
    def order(self) -> int:
        """Number of directions r."""
        return len(self.root) // max(len(self.frequency), 1)


def acting_density(waves: SpectralWaves, frequency: FloatArray) -> FloatArray:
    """Spectrum of the elevation that acts, (n,) m²/Hz, at `frequency` (n,) Hz."""
    state = waves.state
    density = state.density(frequency)
    if waves.sharp_band:
        inside = (frequency >= state.lowest_frequency) & (frequency <= state.highest_frequency)
        return np.asarray(np.where(inside, density, 0.0))
    return np.asarray(density * transition(frequency, state.highest_frequency) ** 2)


def equivalent_width(state: SeaState) -> float:
    """Width of the spectrum's peak, (∫ S df)² / ∫ S² df, Hz."""
    fine = np.linspace(0.0, state.highest_frequency, 4001)
    density = state.density(fine)
    square = float(np.sum(density**2))
    return float(np.sum(density) ** 2 / square * (fine[1] - fine[0])) if square > 0.0 else state.highest_frequency


def wave_grid(waves: SpectralWaves, step: float, band: tuple[float, float] = (0.0, np.inf)) -> WaveGrid:
    """The sea at whole multiples of `step` (Hz) within a band (Hz), from where its energy begins to where it ends."""
    state = waves.state
    grid: FloatArray = step * np.arange(1.0, np.floor(HIGHEST * state.highest_frequency / step) + 1.0)
    grid = grid[(grid >= band[0]) & (grid <= band[1])]
    density = acting_density(waves, grid)
    with_energy = np.flatnonzero(density > NEGLIGIBLE * np.max(density, initial=0.0))
    kept = slice(with_energy[0], with_energy[-1] + 1) if len(with_energy) else slice(0, 0)
    frequency, density = grid[kept], density[kept]
    directions = state.spread()
    omega = np.tile(2.0 * np.pi * frequency, len(directions.share))
    still = GridSea(
        angular_frequency=omega,
        wavenumber=wavenumber(omega, state.water_depth, state.gravity) if len(omega) else omega,
        heading=np.repeat(directions.heading, len(frequency)),
        water_depth=state.water_depth,
        gravity=state.gravity,
    )
    moving = waves.doppler and waves.current is not None
    return WaveGrid(
        frequency=frequency,
        step=step,
        sea=sea_in_current(still, waves.current) if moving and waves.current is not None else still,
        omega=omega,
        root=np.sqrt(np.outer(directions.share, density)).ravel(),
    )


def part_of(grid: WaveGrid, frequencies: slice) -> WaveGrid:
    """Some of the frequencies of a grid, with all of their directions."""
    count = len(grid.frequency)
    chosen = (count * np.arange(grid.order)[:, None] + np.arange(count)[frequencies]).ravel()
    return WaveGrid(
        frequency=grid.frequency[frequencies],
        step=grid.step,
        sea=GridSea(
            angular_frequency=grid.sea.angular_frequency[chosen],
            wavenumber=grid.sea.wavenumber[chosen],
            heading=grid.sea.heading[chosen],
            water_depth=grid.sea.water_depth,
            gravity=grid.sea.gravity,
        ),
        omega=grid.omega[chosen],
        root=grid.root[chosen],
    )
