"""A model on the grids of frequencies on which the frequency domain iterates.

Waves stand on even steps, wide since nothing is resonant in them; slow motion on fine steps up to `SLOW_BAND`, and on
wide ones beyond.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.hydro.morison import inertia_transfer
from tlpsim.loads.spectral import viscous
from tlpsim.loads.spectral.decomposition import DecomposedSpectrum, covariance, decompose, trapezoidal_weights
from tlpsim.loads.spectral.dynamics import Memory, fluid_memory
from tlpsim.loads.spectral.model import SpectralModel, SpectralWaves, SpectralWind
from tlpsim.loads.spectral.second_order import drift_matrix
from tlpsim.loads.spectral.wave_grid import HIGHEST, WaveGrid, equivalent_width, part_of, wave_grid

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

WAVE_STEP = 4e-3
"""Hz, largest of the waves' grid, on which nothing is resonant: spreads are within 3e-4 of those with 1e-3 Hz."""
MOST_COMPONENTS = 600
"""of the waves' grid, over all directions, unless its steps would be longer than `LONGEST_WAVE_STEP`."""
COMPONENTS_AT_ONCE = 1500
"""of waves on fine steps, whose velocities at all strips take some 10 kB each."""
LONGEST_WAVE_STEP = 8e-3
"""Hz, with which spreads are within 1.5e-3."""
GROUP_COMPONENTS, FEWEST_COMPONENTS = 100, 24
"""of a sea whose groups are resolved, over all directions, and at least of each: skewness and kurtosis are within 5e-3
of those with twice as many. With many directions slow modes are narrower than its steps."""
ENERGY_OUTSIDE = 1e-3
"""Part of the waves' energy that may be left out there on either side."""
NARROWEST = 2e-3
"""Hz, equivalent width of the narrowest spectrum of waves; swell has some 5e-3 or more."""
SLOW_BAND = 0.06
"""Hz, below which the slow motion is resolved in fine steps within the iteration."""

_STEPS_IN_SPECTRUM = 10
_FAST_STEP = 2e-3  # Hz, of what is faster than slow motion: tether modes are some hundredths of a Hz wide
_NEAR_ZERO = 0.25  # of a step
_HIGHEST = 0.6  # Hz, at least, to hold the tether modes


@dataclass(frozen=True, slots=True, kw_only=True)
class SeaOnGrid:
    """Waves on a grid of N components, and what of their loads does not depend on the response.

    Attributes
    ----------
    waves, grid
        The sea and its grid.
    elements, rows
        Strips and pieces at the surface, and what is linear in the waves at them.
    excitation
        Decomposed first-order loads without drag, (6, N).
    drift
        Decomposed bi-spectral matrices of slow drift, (6, N, N); None for none.
    """

    waves: SpectralWaves
    grid: WaveGrid
    elements: tuple[viscous.DragElements, viscous.DragElements]
    rows: tuple[viscous.DragRows, viscous.DragRows]
    excitation: ComplexArray
    drift: ComplexArray | None


@dataclass(frozen=True, slots=True, kw_only=True)
class GustsOnGrid:
    """Wind on a grid of frequencies: decomposed speeds at the n segments, and their variances (n,) m²/s²."""

    wind: SpectralWind
    speeds: DecomposedSpectrum
    variance: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """A model on its grids.

    Attributes
    ----------
    model, memory
        The model, and the response of the fluid's memory.
    sea, gusts
        None where the model has no waves and current, or no wind.
    groups
        The sea on steps that resolve its groups, without what has next to no energy; None in calm water.
    frequency, weight
        Of slow motion, (m,) Hz, and of the trapezoidal rule on it.
    """

    model: SpectralModel
    memory: Memory
    sea: SeaOnGrid | None
    groups: SeaOnGrid | None
    gusts: GustsOnGrid | None
    frequency: FloatArray
    weight: FloatArray


def sea_on_grid(waves: SpectralWaves, step: float) -> SeaOnGrid:
    """Waves at whole multiples of `step` (Hz)."""
    return _on_grid(waves, wave_grid(waves, step), (viscous.strips(waves), viscous.surface_pieces(waves)))


def refined_sea(sea: SeaOnGrid, step: float) -> Iterator[SeaOnGrid]:
    """The same waves at whole multiples of `step` (Hz), without their drift, some of the frequencies at a time."""
    grid = wave_grid(sea.waves, step)
    count = max(COMPONENTS_AT_ONCE // max(grid.order, 1), 1)
    for first in range(0, len(grid.frequency), count):
        yield _on_grid(sea.waves, part_of(grid, slice(first, first + count)), sea.elements, with_drift=False)


def _on_grid(
    waves: SpectralWaves,
    grid: WaveGrid,
    elements: tuple[viscous.DragElements, viscous.DragElements],
    *,
    with_drift: bool = True,
) -> SeaOnGrid:
    transfer_of = waves.excitation
    if not len(grid.root):
        excitation = np.zeros((6, 0), dtype=np.complex128)
    elif transfer_of is None:
        excitation = inertia_transfer(waves.members, grid.sea, waves.water_density)
    else:
        excitation = transfer_of(grid.sea)
    rows = viscous.drag_rows(elements[0], grid), viscous.drag_rows(elements[1], grid)
    has_drift = with_drift and waves.drift is not None and len(grid.root) > 0
    return SeaOnGrid(
        waves=waves,
        grid=grid,
        elements=elements,
        rows=rows,
        excitation=excitation * grid.root,
        drift=drift_matrix(waves.drift, grid) if has_drift and waves.drift is not None else None,
    )


def _groups(sea: SeaOnGrid) -> SeaOnGrid:
    """The sea on at most `GROUP_COMPONENTS` components, without `ENERGY_OUTSIDE` of its energy at either end."""
    grid = sea.grid
    energy = np.cumsum(np.sum(grid.root.reshape(grid.order, -1) ** 2, axis=0))
    low, high = np.searchsorted(energy / energy[-1], [ENERGY_OUTSIDE, 1.0 - ENERGY_OUTSIDE])
    low, high = max(int(low) - 1, 0), min(int(high) + 1, len(grid.frequency) - 1)
    band = float(grid.frequency[low]), float(grid.frequency[high])
    step = (band[1] - band[0]) / max(GROUP_COMPONENTS // grid.order, FEWEST_COMPONENTS)
    return _on_grid(sea.waves, wave_grid(sea.waves, min(step, grid.step), band), sea.elements)


def gusts_on_grid(wind: SpectralWind, frequency: FloatArray) -> GustsOnGrid:
    """Gusts at frequencies (m,) Hz up to the end of their band; still air has no source."""
    chosen = frequency[frequency <= wind.highest_frequency]
    if np.any(wind.speed > 0.0):
        # Some spectra have no value at zero frequency.
        speeds = decompose(chosen, wind.spectrum(np.maximum(chosen, _NEAR_ZERO * frequency[1])))
    else:
        nothing = np.zeros((len(chosen), len(wind.speed), 0), dtype=np.complex128)
        speeds = DecomposedSpectrum(frequency=chosen, function=nothing)
    return GustsOnGrid(wind=wind, speeds=speeds, variance=np.diag(covariance(speeds)).copy())


def _highest_frequency(model: SpectralModel) -> float:
    """Sums of two waves, gusts and the tether modes lie below it, Hz."""
    waves = 0.0
    if model.waves is not None and model.waves.state.significant_height > 0.0:
        waves = 2.0 * HIGHEST * model.waves.state.highest_frequency
    wind = 0.0 if model.wind is None else model.wind.highest_frequency
    return max(waves, wind, _HIGHEST)


def wave_step(waves: SpectralWaves) -> float:
    """Step of the waves' grid in Hz: short beside the width of the spectrum, long where there are many directions.

    Raises
    ------
    ScenarioError
        If the sea is nearly a regular wave, which has no spectrum that steps could follow.
    """
    if not waves.state.significant_height > 0.0:
        return WAVE_STEP
    width = equivalent_width(waves.state)
    if width < NARROWEST:
        raise ScenarioError(
            f"frequency domain: the spectrum of the waves is {width:.2g} Hz wide, less than {NARROWEST:g} Hz; take the "
            "time domain, or a wider spectrum"
        )
    narrow = min(WAVE_STEP, width / _STEPS_IN_SPECTRUM)
    most = HIGHEST * waves.state.highest_frequency * waves.state.directions / MOST_COMPONENTS
    return max(narrow, min(most, LONGEST_WAVE_STEP))


def prepared(model: SpectralModel, step: float) -> Problem:
    """The model on grids whose slow motion has steps of `step` (Hz)."""
    sea = None if model.waves is None else sea_on_grid(model.waves, wave_step(model.waves))
    frequency = _slow_frequencies(model, step)
    return Problem(
        model=model,
        memory=fluid_memory(model.platform, model.step, 2.0 * np.pi * _highest_frequency(model)),
        sea=sea,
        groups=None if sea is None or not len(sea.grid.root) else _groups(sea),
        gusts=None if model.wind is None else gusts_on_grid(model.wind, frequency),
        frequency=frequency,
        weight=trapezoidal_weights(frequency),
    )


def refined(problem: Problem, step: float) -> Problem:
    """The problem with other steps of slow motion (Hz); waves and memory do not depend on them."""
    wind, frequency = problem.model.wind, _slow_frequencies(problem.model, step)
    return replace(
        problem,
        gusts=None if wind is None else gusts_on_grid(wind, frequency),
        frequency=frequency,
        weight=trapezoidal_weights(frequency),
    )


def _slow_frequencies(model: SpectralModel, step: float) -> FloatArray:
    slow = step * np.arange(int(SLOW_BAND / step) + 1)
    return np.concatenate([slow, np.arange(slow[-1] + _FAST_STEP, _highest_frequency(model), _FAST_STEP)])


def acting_sea(problem: Problem) -> SeaOnGrid | None:
    """The sea of a problem; None in calm water."""
    return None if problem.sea is None or not len(problem.sea.grid.root) else problem.sea
