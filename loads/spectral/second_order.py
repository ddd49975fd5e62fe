"""Loads of the second order: their products of first-order quantities, and spectra at difference and sum frequencies.

    viscous             P^T k C2 : (v v - Cov v)                        strips, see `viscous`             (1)
    splash              pieces at the surface, and profiles that follow it, see `viscous`                 (2)
    displaced position  sum_c x_c dF/dx_c,   dF/dx = -i k cos beta F    first-order loads where the platform is   (3)
    slow drift          2 T sqrt(S S)                                   difference frequencies only       (4)
    tethers             -1/2 r'' : (x x - Cov x)                        setdown, see `dynamics`           (5)

All hold first-order quantities of the same waves, so their decomposed bi-spectral matrices add before they are squared.
Eq. (3) takes the first-order loads of diffraction and drag together.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.hydro.drift import Kernel, Waves
from tlpsim.loads.spectral.bispectral import BispectralMatrix, difference_spectrum, quadratic, sum_spectrum
from tlpsim.loads.spectral.compiled import interpolated
from tlpsim.loads.spectral.products import Products, joined
from tlpsim.loads.spectral.wave_grid import WaveGrid

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

SLOW_DRIFT = "slow drift"
_ROUNDING = 1e-6  # of a step, at either end


@dataclass(frozen=True, slots=True, kw_only=True)
class EvenSpectrum:
    """Cross-spectra (n, k, k) on even frequencies first + j step, zero elsewhere."""

    first: float
    step: float
    values: ComplexArray

    def at(self, frequency: FloatArray) -> ComplexArray:
        """Linear in between, (m, k, k), at (m,) Hz."""
        return np.asarray(interpolated(self.values, (frequency - self.first) / self.step, _ROUNDING))


def displaced_products(position: ComplexArray, force: ComplexArray, grid: WaveGrid) -> Products:
    """Eq. (3) for decomposed positions (6, N) and first-order loads (6, N)."""
    sea = grid.sea
    gradient = -1j * sea.wavenumber * np.stack([np.cos(sea.heading), np.sin(sea.heading)])
    return Products(
        processes=np.concatenate([position[:2], (gradient[:, None] * force).reshape(12, -1)]),
        one=np.repeat([0, 1], 6),
        other=np.arange(2, 14),
        weights=np.tile(np.eye(6), 2),
    )


def tether_products(position: ComplexArray, curvature: FloatArray) -> Products:
    """1/2 c : x x for curvatures (q, 6, 6) and a decomposed position (6, N)."""
    rows, columns = np.triu_indices(6)
    weights = curvature[:, rows, columns] * np.where(rows == columns, 0.5, 1.0)
    kept = np.any(weights != 0.0, axis=0)
    return Products(processes=position, one=rows[kept], other=columns[kept], weights=weights[:, kept])


def drift_matrix(kernel: Kernel, grid: WaveGrid) -> ComplexArray:
    """Eq. (4), (6, N, N)."""
    waves = Waves(grid.sea.angular_frequency, grid.sea.heading)
    both = 2.0 * grid.root[:, None] * grid.root
    return np.stack([both * kernel(waves, waves, component) for component in range(6)])


@dataclass(frozen=True, slots=True, kw_only=True)
class SecondOrder:
    """What is of the second order in the waves.

    Attributes
    ----------
    products
        Generalized forces by part, with weights (6, M).
    drift
        Eq. (4), (6, N, N); None for no slow drift.
    further
        Quantities beside the forces, with weights (q, M); None for none.
    """

    products: Mapping[str, Products]
    drift: ComplexArray | None
    further: Products | None = None


def matrices(parts: SecondOrder, grid: WaveGrid) -> Iterator[tuple[str, BispectralMatrix]]:
    """Decomposed bi-spectral matrices of the forces by part, one at a time: those of many directions are large."""
    for name, each in parts.products.items():
        yield name, quadratic(grid.frequency, each)
    if parts.drift is not None:
        nothing = np.zeros_like(parts.drift)
        yield SLOW_DRIFT, BispectralMatrix(frequency=grid.frequency, difference=parts.drift, total=nothing)


def whole(parts: SecondOrder, grid: WaveGrid) -> BispectralMatrix:
    """Decomposed bi-spectral matrices of the forces of all parts, those of one long list of products, and the further.

    Shape (6 + q, N, N).
    """
    found = quadratic(grid.frequency, joined(*parts.products.values()))
    if parts.drift is not None:
        np.add(found.difference, parts.drift, out=found.difference)
    return with_further(found, parts, grid)


def with_further(forces: BispectralMatrix, parts: SecondOrder, grid: WaveGrid) -> BispectralMatrix:
    """Matrices of forces with those of the further quantities after them."""
    if parts.further is None or not len(parts.further.weights):
        return forces
    further = quadratic(grid.frequency, parts.further)
    return BispectralMatrix(
        frequency=grid.frequency,
        difference=np.concatenate([forces.difference, further.difference]),
        total=np.concatenate([forces.total, further.total]),
    )


def means(parts: SecondOrder, grid: WaveGrid) -> dict[str, FloatArray]:
    """Means of the forces by part, (6,), of products as they stand."""
    found = {
        name: each.weights @ (grid.step * np.einsum("mn,mn->m", each.first, each.second.conj()).real)
        for name, each in parts.products.items()
    }
    if parts.drift is not None:
        found[SLOW_DRIFT] = grid.step * np.einsum("knn->k", parts.drift).real
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class QuadraticSpectra:
    """Cross-spectra (n, k, k) of quadratic quantities at difference and at sum frequencies."""

    difference: EvenSpectrum
    total: EvenSpectrum


def spectra(found: BispectralMatrix, grid: WaveGrid) -> QuadraticSpectra:
    """Spectra of decomposed bi-spectral matrices."""
    slow, low = difference_spectrum(found)
    fast, high = sum_spectrum(found)
    return QuadraticSpectra(
        difference=EvenSpectrum(first=float(slow[0]), step=grid.step, values=low),
        total=EvenSpectrum(first=float(fast[0]), step=grid.step, values=high),
    )
