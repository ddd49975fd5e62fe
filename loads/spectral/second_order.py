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

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.hydro.drift import Kernel, Waves
from tlpsim.loads.spectral.bispectral import BispectralMatrix, difference_spectrum, quadratic, sum_spectrum
from tlpsim.loads.spectral.products import Products
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
        place = (frequency - self.first) / self.step
        cell = np.clip(np.floor(place).astype(np.int64), 0, len(self.values) - 2)
        inside = (place >= -_ROUNDING) & (place <= len(self.values) - 1 + _ROUNDING)
        share = np.where(inside, place - cell, 0.0)[:, None, None]
        found = (1.0 - share) * self.values[cell] + share * self.values[cell + 1]
        return np.asarray(np.where(inside[:, None, None], found, 0.0))


def displaced_products(position: ComplexArray, force: ComplexArray, grid: WaveGrid) -> Products:
    """Eq. (3) for decomposed positions (6, N) and first-order loads (6, N)."""
    sea = grid.sea
    gradient = -1j * sea.wavenumber * np.stack([np.cos(sea.heading), np.sin(sea.heading)])
    return Products(
        first=np.repeat(position[:2], 6, axis=0),
        second=(gradient[:, None] * force).reshape(12, -1),
        weights=np.tile(np.eye(6), 2),
    )


def tether_products(position: ComplexArray, curvature: FloatArray) -> Products:
    """1/2 c : x x for curvatures (q, 6, 6) and a decomposed position (6, N)."""
    rows, columns = np.triu_indices(6)
    weights = curvature[:, rows, columns] * np.where(rows == columns, 0.5, 1.0)
    kept = np.any(weights != 0.0, axis=0)
    return Products(first=position[rows[kept]], second=position[columns[kept]], weights=weights[:, kept])


def drift_matrix(kernel: Kernel, grid: WaveGrid) -> ComplexArray:
    """Eq. (4), (6, N, N)."""
    waves = Waves(grid.sea.angular_frequency, grid.sea.heading)
    both = 2.0 * grid.root[:, None] * grid.root
    return np.stack([both * kernel(waves, waves, component) for component in range(6)])


@dataclass(frozen=True, slots=True, kw_only=True)
class SecondOrder:
    """What is of the second order in the waves, k quantities.

    Attributes
    ----------
    products
        By part, with weights (k, M).
    drift
        Eq. (4), (k, N, N); None for no slow drift.
    """

    products: Mapping[str, Products]
    drift: ComplexArray | None


def matrices(parts: SecondOrder, grid: WaveGrid) -> dict[str, BispectralMatrix]:
    """Decomposed bi-spectral matrices by part."""
    found = {
        name: quadratic(grid.frequency, each.first, each.second, each.weights) for name, each in parts.products.items()
    }
    if parts.drift is not None:
        nothing = np.zeros_like(parts.drift)
        found[SLOW_DRIFT] = BispectralMatrix(frequency=grid.frequency, difference=parts.drift, total=nothing)
    return found


def whole(parts: SecondOrder, grid: WaveGrid) -> BispectralMatrix:
    """Decomposed bi-spectral matrices of all parts together: those of one long list of products."""
    products = list(parts.products.values())
    found = quadratic(
        grid.frequency,
        np.concatenate([each.first for each in products]),
        np.concatenate([each.second for each in products]),
        np.concatenate([each.weights for each in products], axis=1),
    )
    if parts.drift is None:
        return found
    return BispectralMatrix(frequency=grid.frequency, difference=found.difference + parts.drift, total=found.total)


def means(parts: SecondOrder, grid: WaveGrid) -> dict[str, FloatArray]:
    """Means by part, (k,), of products as they stand."""
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
